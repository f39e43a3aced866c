"""The tables of a mission file as frozen models; every attribute has the name of its key.

[flight] and [laser], which have a form for every model, stand with these: `optuav.flight.model` and
`optuav.laser.beam`.
"""

from typing import Annotated

from pydantic import model_validator

from optuav.fields import (
    RATE_PER_MINUTE,
    WELL,
    Acceleration,
    Allowed,
    Altitude,
    Breadth,
    Current,
    Efficiency,
    Energy,
    Footprint,
    Force,
    Inertia,
    Length,
    LoadPower,
    MissionSection,
    Name,
    Position,
    Range,
    RoofPosition,
    Slot,
    Velocity,
    Voltage,
)
from optuav.options import SCHEDULES, Charging, KeepSoc, Schedule

_CHARGING = Allowed('one of "constant", "taper"')
_SCHEDULE = Allowed(f"one of {', '.join(map(repr, SCHEDULES))}".replace("'", '"'))
_KEEP_SOC = Allowed('one of "end", "always"')


class RouteEnds(MissionSection):
    """Places where the mission starts, hovers and ends."""

    origin_m: Position
    """Origin w0 (x, y, z) [m]."""
    destination_m: Position
    """Destination w_F (x, y, z) [m]."""
    hover_m: Position | None = None
    """Hover point (x, y, z) [m]; without it the point w_U that the link gives."""


class Limits(MissionSection):
    """Limits that the plan must respect."""

    deadline_s: Annotated[float, Range("s", gt=0, le=1e7)]
    """Longest mission T_max [s]."""
    min_soc: Annotated[float, Range("-", ge=0, lt=1)]
    """State of charge η0 that must be left at the end [-], or always, see `keep_soc`."""
    keep_soc: Annotated[KeepSoc, _KEEP_SOC] = "end"
    """When η0 must be left: "end", as in the paper, or "always", at the end of every leg;
    return, coverage, event and horizon keep it at landings in any case."""
    slot_s: Slot = 1.0
    """Length of a time slot of the grid [s]."""
    outage_probability: Annotated[float, Range("-", ge=1e-12, lt=1)]
    """Largest outage probability ε of the link while hovering [-]."""
    min_altitude_m: Altitude
    """Lowest hover point z_min [m]."""
    max_altitude_m: Altitude
    """Highest hover point z_max [m]."""


class BatteryPacks(MissionSection):
    """The battery packs, each two wells of charge (kinetic battery model)."""

    packs: Annotated[int, Range("-", ge=1, le=1000, whole=True)]
    """Number of packs N [-]."""
    capacity_As: Annotated[float, Range("A s", ge=1e-3, le=1e9)]
    """Capacity of one pack [A s]."""
    nominal_voltage_V: Voltage
    """Nominal voltage e_nom [V]."""
    available_fraction: Annotated[float, Range("-", ge=1e-6, le=0.999999)]
    """Share ω of the capacity in the available well [-]."""
    flow_rate_per_s: Annotated[float, Range("1/s", ge=0, le=1e3, note="; or set flow_rate_per_min")]
    """Flow rate k_F of charge between the wells [1/s]; or set flow_rate_per_min."""
    charge_current_A: Current
    """Largest charging current I_ch [A]."""
    charging: Annotated[Charging, _CHARGING] = "constant"
    """Current near full: constant and never past full, or less and less once y1 is full."""
    schedule: Annotated[Schedule, _SCHEDULE] = "pooled"
    """Pack that carries a flight, a hover or a rest: all as one, or one while another charges."""
    period_s: Slot | None = None
    """Time after which schedule = "alternating" changes the pack [s]; >= deadline_s / 20000."""
    flight_energy_J: Energy | None = None
    """Energy E_1 of the full battery in flight [J]; without it derived from the loads."""
    hover_energy_J: Energy | None = None
    """Energy E_2 of the full battery in hover [J]; without it derived from the loads."""

    @property
    def takes_turns(self) -> bool:
        """True if packs carry in turn; a single one is the pooled battery."""
        return self.schedule != "pooled" and self.packs > 1

    @model_validator(mode="before")
    @classmethod
    def _rate_per_second(cls, stated: object) -> object:
        """Convert a valid rate per minute to one per second; any other is left to be refused."""
        if not isinstance(stated, dict) or "flow_rate_per_s" in stated:
            return stated
        others = dict(stated)
        rate = others.pop("flow_rate_per_min", None)
        accepted = RATE_PER_MINUTE.accepts(rate)
        return {**others, "flow_rate_per_s": rate / 60.0} if accepted else stated


class Start(MissionSection):
    """Charge at the start of the mission; wells left out are full."""

    available_As: Annotated[float, WELL] | None = None
    """Charge in the available wells of all packs y1 [A s]; beside bound_As."""
    bound_As: Annotated[float, WELL] | None = None
    """Charge in the bound wells of all packs y2 [A s]; beside available_As."""
    soc: Annotated[float, Range("-", ge=0, le=1)] | None = None
    """State of charge of level wells [-], in place of both."""


class Rotor(MissionSection):
    """Constants of one of the four rotors with its motor and propeller."""

    max_speed_rad_s: Annotated[float, Range("rad/s", ge=1e-3, le=1e6)]
    """Largest speed v_max [rad/s]."""
    lift_coefficient_N_s2_rad2: Annotated[float, Range("N s2/rad2", ge=1e-12, le=10)]
    """Thrust over squared speed ϱ [N s²/rad²]."""
    friction_torque_Nm: Annotated[float, Range("N m", ge=0, le=1e6)]
    """Motor friction T_f [N m]."""
    drag_coefficient_Nm_s2_rad2: Annotated[float, Range("N m s2/rad2", ge=1e-15, le=10)]
    """Aerodynamic torque over squared speed κ0 [N m s²/rad²]."""
    viscous_damping_Nm_s_rad: Annotated[float, Range("N m s/rad", ge=0, le=1e3)]
    """Viscous damping D_f [N m s/rad]."""
    velocity_constant_rpm_V: Annotated[float, Range("rpm/V", ge=1e-3, le=1e6)]
    """Velocity constant κ_V [rpm/V]; κ_E = κ_T = 9.5493/κ_V."""
    resistance_ohm: Annotated[float, Range("ohm", ge=0, le=1e6)]
    """Resistance of the winding R [Ω]."""
    inertia_kg_m2: Annotated[float, Range("kg m2", ge=0, le=1e3)]
    """Inertia of the turning parts J [kg m²]."""


class Body(MissionSection):
    """Mass and inertia of the airframe."""

    mass_kg: Annotated[float, Range("kg", ge=1e-6, le=1e6)]
    """Mass of the UAV m [kg]."""
    gravity_m_s2: Acceleration = 9.8
    """Acceleration of gravity [m/s²]."""
    arm_length_m: Length | None = None
    """Distance l from the centre to a rotor [m]."""
    inertia_x_kg_m2: Inertia | None = None
    """Inertia in roll I_x [kg m²]."""
    inertia_y_kg_m2: Inertia | None = None
    """Inertia in pitch I_y [kg m²]."""
    inertia_z_kg_m2: Inertia | None = None
    """Inertia in yaw I_z [kg m²]."""
    drag_area_m2: Annotated[float, Range("m2", ge=0, le=1e3)] = 0.0
    """Drag area C_d A [m²]; 0 for flight without drag."""


class Air(MissionSection):
    """The air through which the UAV flies."""

    density_kg_m3: Annotated[float, Range("kg/m3", ge=1e-3, le=100)] = 1.225
    """Density ρ [kg/m³]."""


class Earth(MissionSection):
    """Place of the mission on Earth."""

    latitude_deg: Annotated[float, Range("deg", ge=-90, le=90)] | None = None
    """Latitude of x = y = 0 [deg]; y points north. Not beside crs."""
    longitude_deg: Annotated[float, Range("deg", ge=-180, le=180)] | None = None
    """Longitude of x = y = 0 [deg]; x points east. Not beside crs."""
    altitude_m: Annotated[float, Range("m", ge=-1e4, le=1e5)] = 0.0
    """Altitude of z = 0 above mean sea level [m]."""


class LightReceiver(MissionSection):
    """The receiver of the light on the UAV, for a laser whose beam spreads."""

    radius_m: Breadth | None = None
    """Radius a of a round receiver [m]."""
    area_m2: Annotated[float, Range("m2", ge=1e-6, le=1e4)] | None = None
    """Area A of the receiver [m²]."""
    optics_efficiency: Efficiency = 1.0
    """Light behind its optics over light on it; for "divergence" χ, DC power over light [-]."""
    cell_efficiency: Efficiency | None = None
    """Electric power of its cells over light on them [-]."""
    dc_efficiency: Efficiency | None = None
    """DC power over cell power; without it 1 [-]."""
    max_irradiance_W_m2: Annotated[float, Range("W/m2", gt=0, le=1e12)] | None = None
    """Largest irradiance, the mean over the receiver before its optics [W/m²]."""
    max_power_W: LoadPower | None = None
    """Largest DC power [W]."""


class Link(MissionSection):
    """The radio link to the ground device, or to each of several."""

    device_m: Position | None = None
    """Ground device w_u (x, y, z) [m]; several devices have a list of their own instead."""
    noise_power_W: Annotated[float, Range("W", ge=1e-30, le=1e9)]
    """Noise power N0 [W]."""
    transmit_power_W: Annotated[float, Range("W", ge=1e-12, le=1e9)]
    """Transmit power P_u [W]."""
    transmit_voltage_V: Voltage
    """Voltage e_tr of the transmitter [V]."""
    rice_factor: Annotated[float, Range("-", ge=0, le=1e4)]
    """Rice factor K, a ratio and not dB [-]."""
    snr_threshold_dB: Annotated[float, Range("dB", ge=-200, le=200)]
    """Smallest signal-to-noise ratio γ_th [dB]."""
    path_loss_exponent: Annotated[float, Range("-", ge=1, le=10)]
    """Path-loss exponent β [-]."""


class Wind(MissionSection):
    """Steady wind."""

    force_N: Force = (0.0, 0.0, 0.0)
    """Force of the wind on the UAV (x, y, z) [N]."""
    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """Velocity of the wind (x, y, 0) [m/s]."""


class Device(MissionSection):
    """A ground device of several: the UAV hovers over each once, for its share of the hover time.

    They replace `link.device_m` and `route.hover_m`; one alone is the same as these.
    """

    name: Name
    """Name of the device, unique; not origin, hover, destination or a building's."""
    position_m: Position
    """Ground device w_u (x, y, z) [m]."""
    hover_m: Position | None = None
    """Its hover point (x, y, z) [m]; without it the point w_U that the link gives."""
    share: Annotated[float, Range("-", gt=0, le=1)] | None = None
    """Share of the hover time Δ [-]; all devices state it, adding up to 1, or none: then equal."""


class Building(MissionSection):
    """A prism from the ground up to its roof, where the UAV may rest."""

    name: Name
    """Name of the building, unique; not origin, hover or destination."""
    position_m: RoofPosition
    """Resting place of the UAV (x, y, z) [m]; z is the height of the roof."""
    footprint_m: Footprint | None = None
    """Size [x, y] around position_m, or polygon of [x, y] corners on the map [m]."""
