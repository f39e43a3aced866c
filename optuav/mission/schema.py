"""The tables of a mission file as frozen models; every attribute has the name of its key.

Each kind of quantity has a type with its unit and range. The ranges are broad, and narrow enough
that no product or power in the physics overflows. Whole numbers pass for numbers; strings, truth
values, NaN and infinities do not.
"""

import ast
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from numbers import Real
from operator import ge, gt, le, lt
from textwrap import dedent
from typing import TYPE_CHECKING, Annotated, NamedTuple, TypeGuard, TypeVar

from annotated_types import Ge, GroupedMetadata, Gt, Le, Len, Lt, Predicate
from pydantic import BaseModel, BeforeValidator, ConfigDict, Strict, model_validator

from optuav.mission.beam import BEAMS
from optuav.options import SCHEDULES, Charging, KeepSoc, Schedule

MOST_ITEMS = 100_000  # Most items that a list may have, such as buildings
LARGEST = 1e100  # Largest number in a graph or a plan, so that sums and products stay finite


@dataclass(frozen=True)
class Allowed:
    """Allowed values, in the words that a fault shows."""

    words: str


@dataclass(frozen=True)
class OneOf:
    """A name in a registry that others may be added to."""

    names: Mapping[str, object]

    @property
    def words(self) -> str:
        """For example ``"rotors" or "regimes"``."""
        return " or ".join(f'"{name}"' for name in self.names)


@dataclass(frozen=True)
class Number(GroupedMetadata):
    """A number with its unit and range; pydantic reads the constraints, a person the words."""

    unit: str
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    whole: bool = False
    note: str = ""

    def __iter__(self) -> Iterator[object]:
        yield Strict()
        for constraint, bound in ((Gt, self.gt), (Ge, self.ge), (Lt, self.lt), (Le, self.le)):
            if bound is not None:
                yield constraint(bound)

    def accepts(self, value: object) -> TypeGuard[float]:
        """Return whether the value is such a number."""
        if not isinstance(value, Real) or isinstance(value, bool):
            return False
        if self.whole and value % 1 != 0:
            return False
        bounds = ((gt, self.gt), (ge, self.ge), (lt, self.lt), (le, self.le))
        return all(holds(value, bound) for holds, bound in bounds if bound is not None)

    @property
    def words(self) -> str:
        """For example ``a number, 0 <= x < 1 [-]``."""
        noun = "a whole number" if self.whole else "a number"
        if self.le is not None and self.ge == -self.le:
            return f"{noun}, |x| <= {short(self.le)} [{self.unit}]{self.note}"
        low = ((self.ge, "<="), (self.gt, "<"))
        high = ((self.le, "<="), (self.lt, "<"))
        before = [f"{short(bound)} {sign} " for bound, sign in low if bound is not None]
        after = [f" {sign} {short(bound)}" for bound, sign in high if bound is not None]
        return f"{noun}, {''.join(before)}x{''.join(after)} [{self.unit}]{self.note}"


def short(number: float) -> str:
    """A bound as a person writes it: ``1e6``, not ``1e+06``, and ``2**63``."""
    if isinstance(number, int) and float(f"{number:g}") != number:  # Whole, to the last digit
        return f"2**{number.bit_length() - 1}" if number.bit_count() == 1 else str(number)
    mantissa, _, exponent = f"{number:g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def _listed(value: object) -> object:
    """A list, TOML's only sequence, is as good as a tuple; too long a one is refused as a whole."""
    if isinstance(value, list | tuple) and len(value) > MOST_ITEMS:
        raise ValueError(f"more than {MOST_ITEMS} items")
    return tuple(value) if isinstance(value, list) else value


Listed = BeforeValidator(_listed)

# Text
Name = Annotated[
    str,
    Strict(),
    Len(1, 200),
    Predicate(str.isprintable),
    Allowed("a string of 1 to 200 printable characters"),
]
Description = Annotated[str, Strict(), Len(0, 10_000), Allowed("a string, up to 10000 characters")]
ReferenceSystem = Annotated[
    str,
    Strict(),
    Len(1, 10_000),
    Predicate(str.isprintable),
    Allowed('a coordinate reference system that pyproj knows, such as "EPSG:25832"'),
]
Switch = Annotated[bool, Strict(), Allowed("true or false")]

# Space
_THREE = "three numbers [x, y, z], each |x| <= 1e6"
COORDINATE = Number("m", ge=-1e6, le=1e6)
MOST_CORNERS = 10_000
Coordinate = Annotated[float, COORDINATE]
Altitude = Annotated[float, Number("m", ge=0, le=1e6)]
Length = Annotated[float, Number("m", ge=1e-3, le=1e6)]
Clearance = Annotated[float, Number("m", ge=0, le=1e3)]
Position = Annotated[
    tuple[Coordinate, Coordinate, Coordinate], Strict(), Listed, Allowed(f"{_THREE} [m]")
]
RoofPosition = Annotated[
    tuple[Coordinate, Coordinate, Altitude],
    Strict(),
    Listed,
    Allowed("three numbers [x, y, z], |x| and |y| <= 1e6, 0 <= z <= 1e6 [m]"),
]
Size = Annotated[tuple[Length, Length], Strict(), Listed]
Corner = Annotated[tuple[Coordinate, Coordinate], Strict(), Listed]
Polygon = Annotated[tuple[Corner, ...], Len(3, MOST_CORNERS), Strict(), Listed]
Footprint = Annotated[
    Size | Polygon,
    Allowed(
        "a size [x, y], each 0.001 <= x <= 1e6, or a polygon [[x, y], ...] of 3 to 10000 corners, "
        "each |x| <= 1e6 [m]"
    ),
]

# Time
SLOT = Number("s", ge=1e-3, le=1e7)
Slot = Annotated[float, SLOT]

# Electricity
RATE_PER_MINUTE = Number("1/min", ge=0, le=6e4)
Voltage = Annotated[float, Number("V", ge=1e-3, le=1e6)]
Current = Annotated[float, Number("A", ge=0, le=1e6)]
LoadCurrent = Annotated[float, Number("A", ge=1e-6, le=1e6)]
Power = Annotated[float, Number("W", ge=0, le=1e9)]
LoadPower = Annotated[float, Number("W", ge=1e-6, le=1e9)]
Energy = Annotated[float, Number("J", ge=1e-3, le=1e15)]

WELL = Number("A s", ge=-1e6, le=2e12, note=", from 0 to the size of the well")

_CHARGING = Allowed('one of "constant", "taper"')
_SCHEDULE = Allowed(f"one of {', '.join(map(repr, SCHEDULES))}".replace("'", '"'))
_KEEP_SOC = Allowed('one of "end", "always"')

# Mechanics
Inertia = Annotated[float, Number("kg m2", ge=1e-9, le=1e6)]
Acceleration = Annotated[float, Number("m/s2", ge=1e-6, le=1e6)]
FORCE = Number("N", ge=-1e6, le=1e6)
_Newton = Annotated[float, FORCE]
Force = Annotated[tuple[_Newton, _Newton, _Newton], Strict(), Listed, Allowed(f"{_THREE} [N]")]

WIND_SPEED = Number("m/s", ge=-1e3, le=1e3)
_WindSpeed = Annotated[float, WIND_SPEED]
Velocity = Annotated[
    tuple[_WindSpeed, _WindSpeed, Annotated[float, Number("m/s", ge=0, le=0)]],
    Strict(),
    Listed,
    Allowed("three numbers [x, y, 0], such as [6, 0, 0], each |x| <= 1e3 [m/s]"),
]
SPEED = Number("m/s", ge=1e-3, le=1e6)
Speed = Annotated[float, SPEED]

# Light and radio
BEAM = OneOf(BEAMS)
Efficiency = Annotated[float, Number("-", gt=0, le=1)]
Breadth = Annotated[float, Number("m", ge=1e-3, le=100)]
_KNOWN = "; known at 810 and 1550 nm"
Slope = Annotated[float, Number("-", ge=1e-6, le=1e3, note=_KNOWN)]
Offset = Annotated[float, Number("W", ge=-1e9, le=1e9, note=_KNOWN)]


SCHEMA = 1  # Version of the format of a mission file
PYDANTIC = {*dir(BaseModel)} - {*dir(object)}

Figures = TypeVar("Figures", bound=NamedTuple)

_COEFFICIENTS = ("emitter_slope", "emitter_offset_W", "receiver_slope", "receiver_offset_W")
CONVERSIONS: dict[float, dict[str, float]] = {
    810: dict(zip(_COEFFICIENTS, (0.445, -0.75, 0.5414, -0.2313), strict=True)),
    1550: dict(zip(_COEFFICIENTS, (0.34, -1.1, 0.5434, -0.2761), strict=True)),
}
"""Straight-line fits a1, b1, a2, b2 of emitter and receiver by wavelength [nm]."""


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)  # It has no public name


class ListedByName(ModelMetaclass):
    """Metaclass of `Record`, for `dir` of the class."""

    def __dir__(self) -> list[str]:
        fields = vars(self).get("__pydantic_fields__", {})
        return sorted({*super().__dir__(), *fields} - PYDANTIC)


class Record(BaseModel, metaclass=ListedByName):
    """Validated fields; `dir` lists them and their uses, not their validation."""

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__()} - PYDANTIC)


class MissionSection(Record):
    """A table of the mission: frozen, without unknown keys."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        validate_default=True,
        allow_inf_nan=False,
        # Built when first used, and so with the mission, once: 20 ms at start.
        defer_build=True,
    )

    @classmethod
    @cache
    def descriptions(cls) -> dict[str, str]:
        """Descriptions of the keys of this file, read from it on first use."""
        (table,) = ast.parse(dedent(inspect.getsource(cls))).body
        assert isinstance(table, ast.ClassDef)
        above = [base for base in cls.__bases__ if issubclass(base, MissionSection)]
        inherited = {key: words for base in above for key, words in base.descriptions().items()}
        return inherited | {
            key.target.id: inspect.cleandoc(str(text.value.value))
            for key, text in pairwise(table.body)
            if isinstance(key, ast.AnnAssign) and isinstance(text, ast.Expr)
            if isinstance(key.target, ast.Name) and isinstance(text.value, ast.Constant)
        }

    def as_record(self, record: type[Figures]) -> Figures:
        """The named tuple whose fields have the names of keys of this table."""
        return record(*map(vars(self).__getitem__, record._fields))


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

    deadline_s: Annotated[float, Number("s", gt=0, le=1e7)]
    """Longest mission T_max [s]."""
    min_soc: Annotated[float, Number("-", ge=0, lt=1)]
    """State of charge η0 that must be left at the end [-], or always, see `keep_soc`."""
    keep_soc: Annotated[KeepSoc, _KEEP_SOC] = "end"
    """When η0 must be left: "end", as in the paper, or "always", at the end of every leg."""
    slot_s: Slot = 1.0
    """Length of a time slot of the grid [s]."""
    outage_probability: Annotated[float, Number("-", ge=1e-12, lt=1)]
    """Largest outage probability ε of the link while hovering [-]."""
    min_altitude_m: Altitude
    """Lowest hover point z_min [m]."""
    max_altitude_m: Altitude
    """Highest hover point z_max [m]."""


class BatteryPacks(MissionSection):
    """The battery packs, each two wells of charge (kinetic battery model)."""

    packs: Annotated[int, Number("-", ge=1, le=1000, whole=True)]
    """Number of packs N [-]."""
    capacity_As: Annotated[float, Number("A s", ge=1e-3, le=1e9)]
    """Capacity of one pack [A s]."""
    nominal_voltage_V: Voltage
    """Nominal voltage e_nom [V]."""
    available_fraction: Annotated[float, Number("-", ge=1e-6, le=0.999999)]
    """Share ω of the capacity in the available well [-]."""
    flow_rate_per_s: Annotated[
        float, Number("1/s", ge=0, le=1e3, note="; or state flow_rate_per_min")
    ]
    """Flow rate k_F of charge between the wells [1/s]; or state flow_rate_per_min."""
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
    soc: Annotated[float, Number("-", ge=0, le=1)] | None = None
    """State of charge of level wells [-], in place of both."""


class Rotor(MissionSection):
    """Constants of one of the four rotors with its motor and propeller."""

    max_speed_rad_s: Annotated[float, Number("rad/s", ge=1e-3, le=1e6)]
    """Largest speed v_max [rad/s]."""
    lift_coefficient_N_s2_rad2: Annotated[float, Number("N s2/rad2", ge=1e-12, le=10)]
    """Thrust over squared speed ϱ [N s²/rad²]."""
    friction_torque_Nm: Annotated[float, Number("N m", ge=0, le=1e6)]
    """Motor friction T_f [N m]."""
    drag_coefficient_Nm_s2_rad2: Annotated[float, Number("N m s2/rad2", ge=1e-15, le=10)]
    """Aerodynamic torque over squared speed κ0 [N m s²/rad²]."""
    viscous_damping_Nm_s_rad: Annotated[float, Number("N m s/rad", ge=0, le=1e3)]
    """Viscous damping D_f [N m s/rad]."""
    velocity_constant_rpm_V: Annotated[float, Number("rpm/V", ge=1e-3, le=1e6)]
    """Velocity constant κ_V [rpm/V]; κ_E = κ_T = 9.5493/κ_V."""
    resistance_ohm: Annotated[float, Number("ohm", ge=0, le=1e6)]
    """Resistance of the winding R [Ω]."""
    inertia_kg_m2: Annotated[float, Number("kg m2", ge=0, le=1e3)]
    """Inertia of the turning parts J [kg m²]."""


class Body(MissionSection):
    """Mass and inertia of the airframe."""

    mass_kg: Annotated[float, Number("kg", ge=1e-6, le=1e6)]
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
    drag_area_m2: Annotated[float, Number("m2", ge=0, le=1e3)] = 0.0
    """Drag area C_d A [m²]; 0 for flight without drag."""


class Air(MissionSection):
    """The air through which the UAV flies."""

    density_kg_m3: Annotated[float, Number("kg/m3", ge=1e-3, le=100)] = 1.225
    """Density ρ [kg/m³]."""


class Earth(MissionSection):
    """Place of the mission on Earth."""

    latitude_deg: Annotated[float, Number("deg", ge=-90, le=90)] | None = None
    """Latitude of x = y = 0 [deg]; y points north. Not beside crs."""
    longitude_deg: Annotated[float, Number("deg", ge=-180, le=180)] | None = None
    """Longitude of x = y = 0 [deg]; x points east. Not beside crs."""
    altitude_m: Annotated[float, Number("m", ge=-1e4, le=1e5)] = 0.0
    """Altitude of z = 0 above mean sea level [m]."""


class LaserTable(MissionSection):
    """The charging laser and the air that it shines through."""

    beam: Annotated[str | None, BEAM] = None
    """Model of the beam's spread; without it straight-line fits stand for beam and receiver."""
    position_m: Position
    """Source w_s (x, y, z) [m]."""
    power_W: Power
    """Largest source power P_s; for "divergence" of light, else electrical [W]."""
    wavelength_nm: Annotated[float, Number("nm", ge=1, le=1e6)]
    """Wavelength λ [nm]."""
    visibility_km: Annotated[float, Number("km", ge=1e-3, le=1e4)] | None = None
    """Visibility V [km], which gives the attenuation; or state attenuation_per_km."""
    attenuation_per_km: Annotated[float, Number("1/km", ge=0, le=1e4)] | None = None
    """Attenuation α [1/km]; or state visibility_km."""


class Laser(LaserTable):
    """The charging laser and the air that it shines through.

    Conversion coefficients that are not stated follow from the wavelength at 810 and 1550 nm.
    """

    beam: Annotated[None, BEAM] = None
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
    def _conversion_of_wavelength(cls, stated: object) -> object:
        """Fill in the four coefficients where none is stated and the wavelength gives them."""
        if not isinstance(stated, dict) or not CONVERSIONS[810].keys().isdisjoint(stated):
            return stated
        wavelength = stated.get("wavelength_nm")
        if not isinstance(wavelength, int | float):
            return stated
        return {**stated, **CONVERSIONS.get(wavelength, {})}


class LightReceiver(MissionSection):
    """The receiver of the light on the UAV, for a laser whose beam spreads."""

    radius_m: Breadth | None = None
    """Radius a of a round receiver [m]."""
    area_m2: Annotated[float, Number("m2", ge=1e-6, le=1e4)] | None = None
    """Area A of the receiver [m²]."""
    optics_efficiency: Efficiency = 1.0
    """Light behind its optics over light on it; for "divergence" χ, DC power over light [-]."""
    cell_efficiency: Efficiency | None = None
    """Electric power of its cells over light on them [-]."""
    dc_efficiency: Efficiency | None = None
    """DC power over cell power; without it 1 [-]."""
    max_irradiance_W_m2: Annotated[float, Number("W/m2", gt=0, le=1e12)] | None = None
    """Largest irradiance, the mean over the receiver before its optics [W/m²]."""
    max_power_W: LoadPower | None = None
    """Largest DC power [W]."""


class Link(MissionSection):
    """The radio link to the ground device."""

    device_m: Position
    """Ground device w_u (x, y, z) [m]."""
    noise_power_W: Annotated[float, Number("W", ge=1e-30, le=1e9)]
    """Noise power N0 [W]."""
    transmit_power_W: Annotated[float, Number("W", ge=1e-12, le=1e9)]
    """Transmit power P_u [W]."""
    transmit_voltage_V: Voltage
    """Voltage e_tr of the transmitter [V]."""
    rice_factor: Annotated[float, Number("-", ge=0, le=1e4)]
    """Rice factor K, a ratio and not dB [-]."""
    snr_threshold_dB: Annotated[float, Number("dB", ge=-200, le=200)]
    """Smallest signal-to-noise ratio γ_th [dB]."""
    path_loss_exponent: Annotated[float, Number("-", ge=1, le=10)]
    """Path-loss exponent β [-]."""


class Wind(MissionSection):
    """Steady wind."""

    force_N: Force = (0.0, 0.0, 0.0)
    """Force of the wind on the UAV (x, y, z) [N]."""
    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """Velocity of the wind (x, y, 0) [m/s]."""


class Building(MissionSection):
    """A prism from the ground up to its roof, where the UAV may rest."""

    name: Name
    """Name of the building, unique; not origin, hover or destination."""
    position_m: RoofPosition
    """Resting place of the UAV (x, y, z) [m]; z is the height of the roof."""
    footprint_m: Footprint | None = None
    """Size [x, y] around position_m, or polygon of [x, y] corners on the map [m]."""


SECTIONS: dict[str, type[MissionSection]] = {
    "route": RouteEnds,
    "limits": Limits,
    "battery": BatteryPacks,
    "start": Start,
    "rotor": Rotor,
    "body": Body,
    "air": Air,
    "earth": Earth,
    "laser": Laser,
    "receiver": LightReceiver,
    "link": Link,
    "wind": Wind,
    "buildings": Building,
}
"""The tables of a mission file but [flight]; [laser] has more forms, one for every beam."""
