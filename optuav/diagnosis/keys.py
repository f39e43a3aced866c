"""The numeric keys of a mission with their ranges, read from its types, and changes of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import get_args

from pydantic.fields import FieldInfo

from optuav.mission import Mission
from optuav.mission.schema import FORCE, Number

TABLES = ("limits", "battery", "body", "rotor", "laser", "link", "flight")
MOST = 1e3
"""Largest change that is tried, as a factor."""
INSIDE = 1e-9
"""Distance of the outermost value from a bound that is excluded."""


@dataclass(frozen=True)
class Key:
    """A numeric key that a mission states."""

    name: str  # Dotted; of a component as ``wind.force_N[2]``
    now: float
    low: float
    high: float
    whole: bool  # Whether only whole numbers are allowed
    unit: str  # As its range states it; ``"-"`` for a ratio

    def further(self, sign: int) -> Iterator[float]:
        """Values ever larger (1) or smaller (−1), to a thousandfold or the end of the range."""
        last = self.high if sign > 0 else self.low
        value = self.now
        for step in self._steps(sign):
            before, value = value, sign * math.ceil(sign * step) if self.whole else step
            if sign * value >= sign * last:
                break
            if value != before:
                yield value
        else:
            return
        if last != self.now:
            yield last

    def _steps(self, sign: int) -> Iterator[float]:
        if self.low < 0.0 or self.now == 0.0:
            scale = abs(self.now) or 1e-6 * max(abs(self.low), abs(self.high))
            for share in (0.2, 1.0, 10.0, 100.0, MOST):
                yield self.now + sign * share * scale
        else:
            for factor in (1.2, 2.0, 10.0, 100.0, MOST):
                yield self.now * factor**sign


def keys(mission: Mission) -> Iterator[Key]:
    """The numeric keys that a mission states, in the order of its tables."""
    for table in TABLES:
        section = getattr(mission, table)
        if section is None:
            continue
        for name in type(section).model_fields:
            value, field = getattr(section, name), type(section).model_fields[name]
            number = _range(field)
            if number is not None and isinstance(value, int | float):
                low, high = _bounds(number)
                whole = field.annotation is int
                yield Key(f"{table}.{name}", value, low, high, whole, number.unit)


def wind_components(mission: Mission) -> Iterator[Key]:
    """The components of the wind, except those that are 0."""
    for axis, now in enumerate(mission.wind.force_N):
        if now:
            low, high = _bounds(FORCE)
            yield Key(f"wind.force_N[{axis}]", now, low, high, False, FORCE.unit)


def moved(mission: Mission, key: Key, value: float) -> Mission:
    """The mission with another value of a key, or an `InputError` where that breaks a rule."""
    name, _, axis = key.name.removesuffix("]").partition("[")
    if not axis:
        return mission.replace({name: int(value) if key.whole else value})
    table, field = name.split(".")
    vector = list(getattr(getattr(mission, table), field))
    vector[int(axis)] = value
    return mission.replace({name: vector})


def _range(field: FieldInfo) -> Number | None:
    """Unit and range of a number, or of the components of a vector; None for anything else."""
    optional = (getattr(option, "__metadata__", ()) for option in get_args(field.annotation))
    described = (*field.metadata, *(item for items in optional for item in items))
    return next((item for item in described if isinstance(item, Number)), None)


def _bounds(number: Number) -> tuple[float, float]:
    low, high = number.ge, number.le
    if low is None:
        assert number.gt is not None
        low = number.gt + INSIDE
    if high is None:
        assert number.lt is not None
        high = number.lt - INSIDE
    return low, high
