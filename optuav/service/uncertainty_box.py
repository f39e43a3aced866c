"""Boxes of uncertain numbers, with their corners and samples."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, collected, refuse
from optuav.fields import Range
from optuav.mission import Mission
from optuav.mission.files import read_toml
from optuav.mission.messages import nearest, of_kind, path_of
from optuav.network.variants import Columns
from optuav.physics.cells import TYPED
from optuav.physics.quantity import Quantity
from optuav.presentation.numbers import figure
from optuav.studies.samples import (
    Draws,
    Spread,
    form_shown,
    independent,
    spreads,
    with_conversion,
)

FACTORS = ("drain", "charge")
FORMS = "must be { percent = p }, 0 < p < 100, or { low = a, high = b }, 0 < a < b"
LEVELS = {"battery.available_fraction": 5, "battery.flow_rate_per_s": 5}
"""Number of values of keys in which the wells are not monotone; of all others, both ends."""
WIND = "wind.velocity_m_s"  # A helicopter draws most in the least wind or in the strongest
MOST_CORNERS = 128  # Corners of the box of keys


class Box(NamedTuple):
    """Uncertain keys, and the ends of both factors."""

    spreads: tuple[Spread, ...]
    factors: Mapping[str, tuple[float, float]]

    @property
    def numbers(self) -> dict[str, tuple[float, float]]:
        """Ends of all uncertain numbers, by name."""
        factors = {name: ends for name, ends in self.factors.items() if ends[0] < ends[1]}
        return factors | {spread.key.name: (spread.low, spread.high) for spread in self.spreads}

    @property
    def outside(self) -> tuple[str, ...]:
        """Numbers of the mission itself that do not lie in the box, in words."""
        now = dict.fromkeys(FACTORS, 1.0) | {
            spread.key.name: spread.key.now for spread in self.spreads
        }
        return tuple(
            f"{name} = {figure(now[name])} of the mission is not in {figure(low)} to {figure(high)}"
            for name, (low, high) in self.numbers.items()
            if not low - TYPED * abs(low) <= now[name] <= high + TYPED * abs(high)
        )

    @property
    def nearest(self) -> list[float]:
        """The point of the keys nearest to the mission's own numbers, by shares of their ranges."""
        spreads = self.spreads
        return [min(max((s.key.now - s.low) / (s.high - s.low), 0.0), 1.0) for s in spreads]

    @property
    def extremes(self) -> tuple[tuple[float, float], ...]:
        """Drain and charge that leave least in the battery, and those that leave most."""
        (drain_low, drain_high), (charge_low, charge_high) = (self.factors[k] for k in FACTORS)
        return (drain_high, charge_low), (drain_low, charge_high)

    def shrunk(self, share: float) -> Box:
        """The box with a share of its reach to either side of the mission's own numbers.

        The range of a number that lies outside shrinks about its middle.
        """
        keys = tuple(
            replace(spread, low=low, high=high)
            for spread in self.spreads
            for low, high in [_shrunk(spread.low, spread.high, spread.key.now, share)]
        )
        return Box(keys, {k: _shrunk(*ends, 1.0, share) for k, ends in self.factors.items()})

    def with_nominal(self, name: str) -> Box:
        """The box with one number at its nominal value."""
        kept = tuple(spread for spread in self.spreads if spread.key.name != name)
        return Box(kept, {k: (1.0, 1.0) if k == name else e for k, e in self.factors.items()})


def _shrunk(low: float, high: float, now: float, share: float) -> tuple[float, float]:
    """A share of a range to either side of a number; of its middle, where that lies outside."""
    about = now if low <= now <= high else 0.5 * (low + high)
    return about - share * (about - low), about + share * (high - about)


def stated_ranges(uncertainty: Mapping[str, object] | str | Path) -> dict[str, object]:
    """Return the ranges by key of a mapping or of a TOML file, which are not checked."""
    words = "ranges by key, or the path of a TOML file with them"
    of_kind("uncertainty", uncertainty, Mapping | str | Path, words)
    return (
        dict(uncertainty) if isinstance(uncertainty, Mapping) else read_toml(path_of(uncertainty))
    )


def box_of(mission: Mission, ranges: Mapping[str, object]) -> Box:
    """Return the box that ranges by key state, or refuse it with all faults."""
    table = dict(ranges)
    factors, faults, keys = dict.fromkeys(FACTORS, (1.0, 1.0)), list[Fault](), tuple[Spread, ...]()
    if not table:
        faults.append(Fault("uncertainty", "", "at least one key or factor with its range"))
    for name in FACTORS:
        if name in table:
            if ends := _factor(form := table.pop(name)):
                factors[name] = ends
            else:
                faults.append(Fault(name, form_shown(form), FORMS))
    for name in [name for name in table if nearest(name, FACTORS)]:
        faults.append(
            Fault(name, form_shown(table.pop(name)), f"is not a factor{nearest(name, FACTORS)}")
        )
    with collected(faults):
        keys = spreads(mission, table) if table else ()
    refuse(faults)
    # Samples of a normal distribution stay in the box too
    keys = tuple(
        replace(spread, key=replace(spread.key, low=spread.low, high=spread.high))
        if spread.deviation is not None
        else spread
        for spread in keys
    )
    return Box(keys, factors)


def _factor(form: object) -> tuple[float, float] | None:
    """Return both ends of a factor; None if it has another form."""
    numbers = form if isinstance(form, dict) else {}
    if not all(Range("-", gt=0.0, le=1e6).accepts(number) for number in numbers.values()):
        return None
    if numbers.keys() == {"percent"} and numbers["percent"] < 100.0:
        return 1.0 - numbers["percent"] / 100.0, 1.0 + numbers["percent"] / 100.0
    if numbers.keys() == {"low", "high"} and numbers["low"] < numbers["high"]:
        return float(numbers["low"]), float(numbers["high"])
    return None


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the keys of a box, and the factors to try with each.

    Levels of ω and k_F come one after the other at the same corner of the other keys.
    """

    columns: Columns
    factors: tuple[tuple[Quantity, Quantity], ...]
    """Drain and charge: the first pair leaves least in the battery, the last one most."""
    levels: int = 1  # Pairs of values of ω and k_F among the corners

    @property
    def count(self) -> int:
        """Number of points."""
        return len(next(iter(self.columns.values())))

    def and_at(self, others: Points) -> Points:
        """The points, and others with the same factors."""
        both = {
            key: np.concatenate([values, others.columns[key]])
            for key, values in self.columns.items()
        }
        return replace(self, columns=both)


def corners_of(mission: Mission, box: Box) -> Points:
    """The corners of a box, or a refusal if there are too many."""
    keys = sorted(box.spreads, key=lambda spread: spread.key.name in LEVELS)
    values = [_values(key) for key in keys]
    if (count := math.prod(map(len, values))) > MOST_CORNERS:
        words = f"must be at most {MOST_CORNERS} corners: 7 keys, or fewer with ω, k_F or wind"
        raise InputError([Fault("uncertainty", f"{count} corners", words)])
    points = np.array([*itertools.product(*values)])
    levels = math.prod(LEVELS.get(key.key.name, 1) for key in keys)
    return Points(_columns(mission, keys, points), box.extremes, levels)


def _values(spread: Spread) -> Floats:
    """Values of a key among the corners."""
    name, ends = spread.key.name, (spread.low, spread.high)
    if name.startswith(WIND):
        return np.unique([*ends, np.clip(0.0, *ends)])
    return np.linspace(*ends, LEVELS.get(name, 2))


def points_within(mission: Mission, box: Box, shares: Floats) -> Points:
    """Points of the keys (point, key) by shares of their ranges, with both ends of the factors."""
    low, high = np.transpose([(spread.low, spread.high) for spread in box.spreads])
    return Points(_columns(mission, box.spreads, low + shares * (high - low)), box.extremes)


def samples_of(mission: Mission, box: Box, first: int, count: int, seed: int) -> Points:
    """Samples of the keys and of both factors, from a number on."""
    columns = Draws(mission, box.spreads, count, seed, independent).values(first, count)
    shares = independent(FACTORS, seed, first, count)
    low, high = np.transpose([box.factors[name] for name in FACTORS])
    drain, charge = (low + shares * (high - low)).T
    return Points(columns or _as_stated(mission, count), ((drain, charge),))


def _columns(mission: Mission, keys: Sequence[Spread], points: Floats) -> dict[str, Floats]:
    """Values by key of points (point, key)."""
    columns = dict[str, Floats]()
    for spread, values in zip(keys, points.T, strict=True):
        columns |= spread.columns(values)
    return with_conversion(mission, columns) or _as_stated(mission, len(points))


def _as_stated(mission: Mission, count: int) -> dict[str, Floats]:
    """Columns of equal variants: one key with its value in the mission."""
    return {"limits.deadline_s": np.full(count, mission.limits.deadline_s)}
