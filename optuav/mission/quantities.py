"""What the values of a mission may be: one type per kind of quantity, with unit and finite range.

The ranges are broad, and narrow enough that no product or power in the physics overflows.
Whole numbers pass for numbers; strings, truth values, NaN and infinities do not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from operator import ge, gt, le, lt
from typing import Annotated, Any, TypeGuard

from annotated_types import Ge, GroupedMetadata, Gt, Le, Len, Lt, Predicate
from pydantic import BeforeValidator, Strict


@dataclass(frozen=True)
class Allowed:
    """What a value may be, in the words that a fault shows."""

    words: str


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
        """Whether the value is such a number."""
        if not isinstance(value, int | float) or isinstance(value, bool):
            return False
        if self.whole and isinstance(value, float) and not value.is_integer():
            return False
        bounds = ((gt, self.gt), (ge, self.ge), (lt, self.lt), (le, self.le))
        return all(holds(value, bound) for holds, bound in bounds if bound is not None)

    @property
    def words(self) -> str:
        """For example ``a number, 0 <= x < 1 [-]``."""
        noun = "a whole number" if self.whole else "a number"
        if self.le is not None and self.ge == -self.le:
            return f"{noun}, |x| <= {short(self.le)} [{self.unit}]{self.note}"
        low = f"{short(self.gt)} < " if self.gt is not None else ""
        low = f"{short(self.ge)} <= " if self.ge is not None else low
        high = f" < {short(self.lt)}" if self.lt is not None else ""
        high = f" <= {short(self.le)}" if self.le is not None else high
        return f"{noun}, {low}x{high} [{self.unit}]{self.note}"


def short(number: float) -> str:
    """A bound as a person writes it: ``1e6``, not ``1e+06``."""
    mantissa, _, exponent = f"{number:g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def _listed(value: Any) -> Any:
    """A list, TOML's only sequence, is as good as a tuple."""
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
Switch = Annotated[bool, Strict(), Allowed("true or false")]
Count = Annotated[int, Number("-", ge=1, le=1000, whole=True)]

# Space
Coordinate = Annotated[float, Number("m", ge=-1e6, le=1e6)]
Altitude = Annotated[float, Number("m", ge=0, le=1e6)]
Length = Annotated[float, Number("m", ge=1e-3, le=1e6)]
Position = Annotated[
    tuple[Coordinate, Coordinate, Coordinate],
    Strict(),
    Listed,
    Allowed("three numbers [x, y, z], each |x| <= 1e6 [m]"),
]
RoofPosition = Annotated[
    tuple[Coordinate, Coordinate, Altitude],
    Strict(),
    Listed,
    Allowed("three numbers [x, y, z], |x| and |y| <= 1e6, 0 <= z <= 1e6 [m]"),
]
Size = Annotated[tuple[Length, Length], Strict(), Listed]
Corner = Annotated[tuple[Coordinate, Coordinate], Strict(), Listed]
Polygon = Annotated[tuple[Corner, ...], Len(3, 10_000), Strict(), Listed]
Footprint = Annotated[
    Size | Polygon,
    Allowed(
        "a size [x, y], each 0.001 <= x <= 1e6, or a polygon [[x, y], ...] of 3 to 10000 corners, "
        "each |x| <= 1e6 [m]"
    ),
]

# Time
Duration = Annotated[float, Number("s", gt=0, le=1e7)]
SLOT = Number("s", ge=1e-3, le=1e7)
Slot = Annotated[float, SLOT]

# Shares
StateOfCharge = Annotated[float, Number("-", ge=0, lt=1)]
Probability = Annotated[float, Number("-", ge=1e-12, lt=1)]
Fraction = Annotated[float, Number("-", ge=1e-6, le=0.999999)]

# Electricity
Charge = Annotated[float, Number("A s", ge=1e-3, le=1e9)]
Rate = Annotated[float, Number("1/s", ge=0, le=1e3, note="; or state flow_rate_per_min")]
RATE_PER_MINUTE = Number("1/min", ge=0, le=6e4)
Voltage = Annotated[float, Number("V", ge=1e-3, le=1e6)]
Current = Annotated[float, Number("A", ge=0, le=1e6)]
LoadCurrent = Annotated[float, Number("A", ge=1e-6, le=1e6)]
Power = Annotated[float, Number("W", ge=0, le=1e9)]
LoadPower = Annotated[float, Number("W", ge=1e-6, le=1e9)]
Energy = Annotated[float, Number("J", ge=1e-3, le=1e15)]
Resistance = Annotated[float, Number("ohm", ge=0, le=1e6)]

# Mechanics
RotorSpeed = Annotated[float, Number("rad/s", ge=1e-3, le=1e6)]
LiftCoefficient = Annotated[float, Number("N s2/rad2", ge=1e-12, le=10)]
DragCoefficient = Annotated[float, Number("N m s2/rad2", ge=1e-15, le=10)]
FrictionTorque = Annotated[float, Number("N m", ge=0, le=1e6)]
ViscousDamping = Annotated[float, Number("N m s/rad", ge=0, le=1e3)]
VelocityConstant = Annotated[float, Number("rpm/V", ge=1e-3, le=1e6)]
RotorInertia = Annotated[float, Number("kg m2", ge=0, le=1e3)]
Mass = Annotated[float, Number("kg", ge=1e-6, le=1e6)]
Inertia = Annotated[float, Number("kg m2", ge=1e-9, le=1e6)]
Acceleration = Annotated[float, Number("m/s2", ge=1e-6, le=1e6)]
Speed = Annotated[float, Number("m/s", ge=1e-3, le=1e6)]
FORCE = Number("N", ge=-1e6, le=1e6)
_ForceComponent = Annotated[float, FORCE]
Force = Annotated[
    tuple[_ForceComponent, _ForceComponent, _ForceComponent],
    Strict(),
    Listed,
    Allowed("three numbers [x, y, z], each |x| <= 1e6 [N]"),
]

# Light and radio
Wavelength = Annotated[float, Number("nm", ge=1, le=1e6)]
Visibility = Annotated[float, Number("km", ge=1e-3, le=1e4)]
Attenuation = Annotated[float, Number("1/km", ge=0, le=1e4)]
_KNOWN = "; known at 810 and 1550 nm"
Slope = Annotated[float, Number("-", ge=1e-6, le=1e3, note=_KNOWN)]
Offset = Annotated[float, Number("W", ge=-1e9, le=1e9, note=_KNOWN)]
NoisePower = Annotated[float, Number("W", ge=1e-30, le=1e9)]
TransmitPower = Annotated[float, Number("W", ge=1e-12, le=1e9)]
RiceFactor = Annotated[float, Number("-", ge=0, le=1e4)]
Decibel = Annotated[float, Number("dB", ge=-200, le=200)]
PathLossExponent = Annotated[float, Number("-", ge=1, le=10)]
