"""Kinds of fields with their units and ranges, and the base of the tables made of them.

The ranges are broad, and narrow enough that no product or power in the physics overflows. Whole
numbers pass for numbers; strings, truth values, NaN and infinities do not.
"""

import ast
import inspect
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from numbers import Real
from operator import ge, gt, le, lt
from pathlib import PurePath
from textwrap import dedent
from typing import TYPE_CHECKING, Annotated, NamedTuple, Self, TypeGuard, TypeVar

from annotated_types import Ge, GroupedMetadata, Gt, Le, Len, Lt, Predicate
from pydantic import BaseModel, BeforeValidator, ConfigDict, Strict

from optuav.errors import Fault, InputError, shown
from optuav.presentation.numbers import short

MOST_ITEMS = 100_000  # Most items that a list may have, such as buildings
LARGEST = 1e100  # Largest number in a graph or a plan, so that sums and products stay finite
SCALARS = (
    "does not take arrays of keys, places or ways: use np.minimum in place of min, np.where in "
    "place of if, and NumPy's functions in place of math's"
)


@dataclass(frozen=True)
class Allowed:
    """Allowed values, in the words that a fault shows."""

    words: str


REGISTERED_FIRST = "or one that is registered first"
"""Last of the choices where others may be added, often by importing their package."""


@dataclass(frozen=True)
class OneOf:
    """A name in a registry that others may be added to."""

    names: Mapping[str, object]

    @property
    def listed(self) -> str:
        """For example ``"rotors" or "regimes"``."""
        return " or ".join(f'"{name}"' for name in self.names)

    @property
    def words(self) -> str:
        """For example ``"rotors" or "regimes", or one that is registered first``."""
        return f"{self.listed}, {REGISTERED_FIRST}"


@dataclass(frozen=True)
class Range(GroupedMetadata):
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


def _listed(value: object) -> object:
    """A list, TOML's only sequence, is as good as a tuple; too long a one is refused as a whole."""
    if isinstance(value, list | tuple) and len(value) > MOST_ITEMS:
        raise ValueError(f"more than {MOST_ITEMS} items")
    return tuple(value) if isinstance(value, list) else value


Listed = BeforeValidator(_listed)


def _not_empty(value: object) -> object:
    """A list that is stated has entries; none at all is the default, an empty tuple."""
    if isinstance(value, list) and not value:
        raise ValueError("an empty list")
    return value


NotEmpty = BeforeValidator(_not_empty)
MOST_DEVICES = 100

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
COORDINATE = Range("m", ge=-1e6, le=1e6)
MOST_CORNERS = 10_000
Coordinate = Annotated[float, COORDINATE]
Altitude = Annotated[float, Range("m", ge=0, le=1e6)]
Length = Annotated[float, Range("m", ge=1e-3, le=1e6)]
Clearance = Annotated[float, Range("m", ge=0, le=1e3)]
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
SLOT = Range("s", ge=1e-3, le=1e7)
Slot = Annotated[float, SLOT]

# Electricity
RATE_PER_MINUTE = Range("1/min", ge=0, le=6e4)
Voltage = Annotated[float, Range("V", ge=1e-3, le=1e6)]
Current = Annotated[float, Range("A", ge=0, le=1e6)]
LoadCurrent = Annotated[float, Range("A", ge=1e-6, le=1e6)]
Power = Annotated[float, Range("W", ge=0, le=1e9)]
LoadPower = Annotated[float, Range("W", ge=1e-6, le=1e9)]
Energy = Annotated[float, Range("J", ge=1e-3, le=1e15)]

WELL = Range("A s", ge=-1e6, le=2e12, note=", from 0 to the size of the well")


# Mechanics
Inertia = Annotated[float, Range("kg m2", ge=1e-9, le=1e6)]
Acceleration = Annotated[float, Range("m/s2", ge=1e-6, le=1e6)]
FORCE = Range("N", ge=-1e6, le=1e6)
_Newton = Annotated[float, FORCE]
Force = Annotated[tuple[_Newton, _Newton, _Newton], Strict(), Listed, Allowed(f"{_THREE} [N]")]

WIND_SPEED = Range("m/s", ge=-1e3, le=1e3)
_WindSpeed = Annotated[float, WIND_SPEED]
Velocity = Annotated[
    tuple[_WindSpeed, _WindSpeed, Annotated[float, Range("m/s", ge=0, le=0)]],
    Strict(),
    Listed,
    Allowed("three numbers [x, y, 0], such as [6, 0, 0], each |x| <= 1e3 [m/s]"),
]
SPEED = Range("m/s", ge=1e-3, le=1e6)
Speed = Annotated[float, SPEED]

# Light and radio
Efficiency = Annotated[float, Range("-", gt=0, le=1)]
Breadth = Annotated[float, Range("m", ge=1e-3, le=100)]


PYDANTIC = {*dir(BaseModel)} - {*dir(object)}

Figures = TypeVar("Figures", bound=NamedTuple)

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

    def __setstate__(self, state: dict[str, object]) -> None:
        """Build the class, without which pydantic before 2.14 cannot dump what a pickle holds."""
        super().__setstate__(state)
        type(self).model_rebuild()

    @classmethod
    @cache
    def descriptions(cls) -> dict[str, str]:
        """Descriptions of the keys of this file, read from it on first use.

        A class without a file, as of a notebook, has none.
        """
        above = [base for base in cls.__bases__ if issubclass(base, MissionSection)]
        inherited = {key: words for base in above for key, words in base.descriptions().items()}
        try:
            (table,) = ast.parse(dedent(inspect.getsource(cls))).body
        except (OSError, TypeError, SyntaxError):
            return inherited
        assert isinstance(table, ast.ClassDef)
        return inherited | {
            key.target.id: inspect.cleandoc(str(text.value.value))
            for key, text in pairwise(table.body)
            if isinstance(key, ast.AnnAssign) and isinstance(text, ast.Expr)
            if isinstance(key.target, ast.Name) and isinstance(text.value, ast.Constant)
        }

    def as_record(self, record: type[Figures]) -> Figures:
        """The named tuple whose fields have the names of keys of this table."""
        return record(*map(vars(self).__getitem__, record._fields))


class Slider(NamedTuple):
    """A number of the mission that is worth moving by hand."""

    key: str  # Dotted
    axis: int | None  # Component, if it is a vector
    label: str
    symbol: str
    unit: str
    low: float
    high: float


class MadeOfTables:
    """A model whose constructor takes tables of a mission by their names."""

    @classmethod
    def of(cls, mission: MissionSection) -> Self:
        """The model made of the tables that a mission states."""
        names, tables = inspect.signature(cls).parameters, vars(mission)
        made = cls(**{name: tables[name] for name in names if tables.get(name) is not None})
        if not cls.__module__.startswith("optuav."):
            made._refuse_scalars()
        return made

    def _on_arrays(self) -> None:
        """Evaluate its figures at arrays of places or ways; refuse what are none."""

    def _expect(
        self, method: str, value: object, kind: type | tuple[type, ...], words: str
    ) -> None:
        """Refuse a value of a method that is of another kind."""
        if not isinstance(value, kind):
            raise InputError([Fault(f"{type(self).__name__}.{method}()", shown(value), words)])

    def _refuse_scalars(self) -> None:
        """Refuse formulas that work only for single numbers; any other error shows up in use."""
        import numpy as np  # Only models from outside the package need it to read a mission

        try:
            with np.errstate(all="ignore"):
                self._on_arrays()
        except InputError:
            raise
        except Exception as error:  # Of any kind, as the formulas come from outside the package
            if "array" not in str(error):
                return
            *_, frame = traceback.extract_tb(error.__traceback__)
            place = f"{frame.name} (line {frame.lineno} of {PurePath(frame.filename).name})"
            raise InputError([Fault(type(self).__name__, "", f"{place} {SCALARS}")]) from error
