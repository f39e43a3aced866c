"""The tables of a mission file as frozen models; every attribute has the name of its key."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Discriminator, Tag, model_validator

from optuav.mission.quantities import (
    RATE_PER_MINUTE,
    Acceleration,
    Allowed,
    Altitude,
    Attenuation,
    Charge,
    Count,
    Current,
    Decibel,
    DragCoefficient,
    Duration,
    Energy,
    Footprint,
    Force,
    Fraction,
    FrictionTorque,
    Inertia,
    Length,
    LiftCoefficient,
    LoadCurrent,
    LoadPower,
    Mass,
    Name,
    NoisePower,
    Offset,
    PathLossExponent,
    Position,
    Power,
    Probability,
    Rate,
    Resistance,
    RiceFactor,
    RoofPosition,
    RotorInertia,
    RotorSpeed,
    Slope,
    Slot,
    Speed,
    StateOfCharge,
    Switch,
    TransmitPower,
    VelocityConstant,
    ViscousDamping,
    Visibility,
    Voltage,
    Wavelength,
)
from optuav.physics.charging import Charging
from optuav.physics.packs import SCHEDULES, Schedule

SCHEMA = 1
"""Version of the format of a mission file."""

SECONDS_PER_MINUTE = 60.0

CONVERSIONS: dict[float, dict[str, float]] = {
    810: {
        "emitter_slope": 0.445,
        "emitter_offset_W": -0.75,
        "receiver_slope": 0.5414,
        "receiver_offset_W": -0.2313,
    },
    1550: {
        "emitter_slope": 0.34,
        "emitter_offset_W": -1.1,
        "receiver_slope": 0.5434,
        "receiver_offset_W": -0.2761,
    },
}
"""Straight-line fits a1, b1, a2, b2 of emitter and receiver by wavelength [nm]."""


class Section(BaseModel):
    """A table of the mission: frozen, and without keys of its own invention."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        validate_default=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )


class Route(Section):
    """Where the mission starts, hovers and ends."""

    origin_m: Position
    """Start w0 (x, y, z) [m]."""
    destination_m: Position
    """End wF (x, y, z) [m]."""
    hover_m: Position | None = None
    """Hover point (x, y, z) [m]; without it the point w_U that the link gives."""


class Limits(Section):
    """What the plan has to respect."""

    deadline_s: Duration
    """Longest mission T_max [s]."""
    min_soc: StateOfCharge
    """State of charge η0 that must be left at the end [-]."""
    slot_s: Slot = 1.0
    """Length of a time slot of the grid [s]."""
    outage_probability: Probability
    """Largest outage probability ε of the link while hovering [-]."""
    min_altitude_m: Altitude
    """Lowest hover point z_min [m]."""
    max_altitude_m: Altitude
    """Highest hover point z_max [m]."""


_CHARGING = Allowed('one of "constant", "taper"')
_SCHEDULE = Allowed(f"one of {', '.join(map(repr, SCHEDULES))}".replace("'", '"'))


class Battery(Section):
    """The battery packs, each two wells of charge (kinetic battery model)."""

    packs: Count
    """Number of packs N [-]."""
    capacity_As: Charge
    """Capacity of one pack [A s]."""
    nominal_voltage_V: Voltage
    """Nominal voltage e_nom [V]."""
    available_fraction: Fraction
    """Share ω of the capacity in the available well [-]."""
    flow_rate_per_s: Rate
    """Rate k_F at which charge flows between the wells [1/s]; or state flow_rate_per_min."""
    charge_current_A: Current
    """Largest charging current I_ch [A]."""
    charging: Annotated[Charging, _CHARGING] = "constant"
    """Current near full: constant and never past full, or less and less once y1 is full."""
    schedule: Annotated[Schedule, _SCHEDULE] = "pooled"
    """Which pack carries a flight, a hover or a rest: all as one, or one while another charges."""
    period_s: Slot | None = None
    """Time after which schedule = "alternating" changes the pack [s]."""
    flight_energy_J: Energy | None = None
    """Energy E_1 of the full battery in flight [J]; without it derived from the loads."""
    hover_energy_J: Energy | None = None
    """Energy E_2 of the full battery in hover [J]; without it derived from the loads."""

    @property
    def takes_turns(self) -> bool:
        """Whether packs carry one after the other; a single one is the pooled battery."""
        return self.schedule != "pooled" and self.packs > 1

    @model_validator(mode="before")
    @classmethod
    def _rate_per_second(cls, stated: Any) -> Any:
        """Bring a sound rate per minute to one per second; any other is left to be refused."""
        if not isinstance(stated, dict) or "flow_rate_per_s" in stated:
            return stated
        rate = stated.get("flow_rate_per_min")
        if not RATE_PER_MINUTE.accepts(rate):
            return stated
        others = {key: value for key, value in stated.items() if key != "flow_rate_per_min"}
        return {**others, "flow_rate_per_s": rate / SECONDS_PER_MINUTE}


class Rotor(Section):
    """Constants of one of the four rotors with its motor and propeller."""

    max_speed_rad_s: RotorSpeed
    """Largest speed v_max [rad/s]."""
    lift_coefficient_N_s2_rad2: LiftCoefficient
    """Thrust over squared speed ϱ [N s²/rad²]."""
    friction_torque_Nm: FrictionTorque
    """Motor friction T_f [N m]."""
    drag_coefficient_Nm_s2_rad2: DragCoefficient
    """Aerodynamic torque over squared speed κ0 [N m s²/rad²]."""
    viscous_damping_Nm_s_rad: ViscousDamping
    """Viscous damping D_f [N m s/rad]."""
    velocity_constant_rpm_V: VelocityConstant
    """Velocity constant κ_V [rpm/V]; κ_E = κ_T = 9.5493/κ_V."""
    resistance_ohm: Resistance
    """Resistance of the winding R [Ω]."""
    inertia_kg_m2: RotorInertia
    """Inertia of the turning parts J [kg m²]."""


class Body(Section):
    """Mass and inertia of the airframe."""

    mass_kg: Mass
    """Mass of the UAV m [kg]."""
    gravity_m_s2: Acceleration = 9.8
    """Acceleration of gravity [m/s²]."""
    arm_length_m: Length
    """Distance l from the centre to a rotor [m]."""
    inertia_x_kg_m2: Inertia
    """Inertia in roll I_x [kg m²]."""
    inertia_y_kg_m2: Inertia
    """Inertia in pitch I_y [kg m²]."""
    inertia_z_kg_m2: Inertia
    """Inertia in yaw I_z [kg m²]."""


class Laser(Section):
    """The charging laser and the air that it shines through.

    Conversion coefficients that are not stated follow from the wavelength at 810 and 1550 nm.
    """

    position_m: Position
    """Source w_s (x, y, z) [m]."""
    power_W: Power
    """Largest source power P_s [W]."""
    wavelength_nm: Wavelength
    """Wavelength λ [nm]."""
    visibility_km: Visibility | None = None
    """Visibility V [km], from which the attenuation follows; or state attenuation_per_km."""
    attenuation_per_km: Attenuation | None = None
    """Attenuation α [1/km]; or state visibility_km."""
    emitter_slope: Slope
    """Slope a1 of the emitter's conversion [-]."""
    emitter_offset_W: Offset
    """Offset b1 of the emitter's conversion [W]."""
    receiver_slope: Slope
    """Slope a2 of the receiver's conversion [-]."""
    receiver_offset_W: Offset
    """Offset b2 of the receiver's conversion [W]."""

    @model_validator(mode="before")
    @classmethod
    def _conversion_of_wavelength(cls, stated: Any) -> Any:
        """Fill in the four coefficients where none is stated and the wavelength gives them."""
        if not isinstance(stated, dict) or not CONVERSIONS[810].keys().isdisjoint(stated):
            return stated
        wavelength = stated.get("wavelength_nm")
        if not isinstance(wavelength, int | float):
            return stated
        return {**stated, **CONVERSIONS.get(wavelength, {})}


class Link(Section):
    """The radio link to the ground device."""

    device_m: Position
    """Ground device w_u (x, y, z) [m]."""
    noise_power_W: NoisePower
    """Noise power N0 [W]."""
    transmit_power_W: TransmitPower
    """Transmit power P_u [W]."""
    transmit_voltage_V: Voltage
    """Voltage e_tr of the transmitter [V]."""
    rice_factor: RiceFactor
    """Rice factor K, a ratio and not dB [-]."""
    snr_threshold_dB: Decibel
    """Smallest signal-to-noise ratio γ_th [dB]."""
    path_loss_exponent: PathLossExponent
    """Path-loss exponent β [-]."""


class Wind(Section):
    """Steady wind."""

    force_N: Force = (0.0, 0.0, 0.0)
    """Force of the wind on the UAV (x, y, z) [N]."""


_MODEL = Allowed('"rotors" or "regimes"')


class RotorFlight(Section):
    """Flight computed from rotor and airframe."""

    model: Annotated[Literal["rotors"], _MODEL] = "rotors"
    """Flight model: "rotors" computes loads and legs from [rotor] and [body]."""
    through_buildings: Switch = False
    """Whether a leg may cross a building."""


class RegimeFlight(Section):
    """Flight with constant loads by regime and bang-bang legs."""

    model: Annotated[Literal["regimes"], _MODEL]
    """Flight model: "regimes" has constant loads in flight, in hover and at rest."""
    through_buildings: Switch = False
    """Whether a leg may cross a building."""
    acceleration_m_s2: Acceleration
    """Acceleration and braking of a leg [m/s²]."""
    max_speed_m_s: Speed | None = None
    """Largest speed of a leg [m/s]; without it there is no cap."""
    flight_current_A: LoadCurrent
    """Current in flight [A]."""
    flight_power_W: LoadPower
    """Power in flight [W]."""
    hover_current_A: LoadCurrent
    """Current in hover, communication included [A]."""
    hover_power_W: LoadPower
    """Power in hover, communication included [W]."""
    rest_current_A: Current = 0.0
    """Current at rest [A]."""
    rest_power_W: Power = 0.0
    """Power at rest [W]."""
    charge_current_A: Current | None = None
    """Charging current in sight of the laser [A]; replaces the laser's power model."""
    charge_power_W: Power | None = None
    """Charging power in sight of the laser [W]; replaces the laser's power model."""


REGIME_KEYS = frozenset(RegimeFlight.model_fields) - frozenset(RotorFlight.model_fields)
"""Keys of [flight] that have a meaning with ``flight.model = "regimes"`` only."""


def flight_model(stated: Any) -> str:
    """Which of the two tables [flight] is meant to be; a misspelt model is judged by its keys."""
    if not isinstance(stated, dict):
        return getattr(stated, "model", "rotors")
    model = stated.get("model", "rotors")
    if model in ("rotors", "regimes"):
        return str(model)
    return "rotors" if REGIME_KEYS.isdisjoint(stated) else "regimes"


Flight: TypeAlias = Annotated[
    Annotated[RotorFlight, Tag("rotors")] | Annotated[RegimeFlight, Tag("regimes")],
    Discriminator(flight_model),
]


class Building(Section):
    """A prism from the ground up to its roof, on which the UAV may rest."""

    name: Name
    """Name of the building, one of its kind; not origin, hover or destination."""
    position_m: RoofPosition
    """Where the UAV rests (x, y, z) [m]; z is the height of the roof."""
    footprint_m: Footprint | None = None
    """Size [x, y] around position_m, or polygon of [x, y] corners on the map [m]."""


SECTIONS: dict[str, type[Section]] = {
    "route": Route,
    "limits": Limits,
    "battery": Battery,
    "rotor": Rotor,
    "body": Body,
    "laser": Laser,
    "link": Link,
    "wind": Wind,
    "flight": RegimeFlight,
    "buildings": Building,
}
"""The tables of a mission file; for [flight] the one with all its keys."""
