"""Boxes of uncertain numbers, with their corners and samples."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, collected, refuse
from optuav.mission import Mission
from optuav.mission.files import read_toml
from optuav.mission.messages import of_kind, path_of, shown
from optuav.mission.schema import Number
from optuav.network.network import Network
from optuav.network.variants import Variants
from optuav.physics.quantity import Quantity
from optuav.studies.samples import Draws, Spread, independent, spreads

FACTORS = ("drain", "charge")
LEVELS = {"battery.available_fraction": 5, "battery.flow_rate_per_s": 5}
"""Number of values of keys in which the wells are not monotone; of all others, both ends."""
WIND = "wind.velocity_m_s"  # A helicopter draws most in the least wind or in the strongest
MOST = 128  # Corners of the box of keys


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
    def holds_now(self) -> bool:
        """Whether the numbers of the mission itself lie in the box."""
        return all(low <= 1.0 <= high for low, high in self.factors.values()) and all(
            spread.low <= spread.key.now <= spread.high for spread in self.spreads
        )

    def shrunk(self, share: float) -> Box:
        """The box shrunk about its middle to a share of its reach."""
        keys = tuple(
            replace(spread, low=low, high=high)
            for spread in self.spreads
            for low, high in [_about_middle(spread.low, spread.high, share)]
        )
        return Box(keys, {k: _about_middle(*ends, share) for k, ends in self.factors.items()})

    def without(self, name: str) -> Box:
        """The box with one number at its nominal value."""
        kept = tuple(spread for spread in self.spreads if spread.key.name != name)
        return Box(kept, {k: (1.0, 1.0) if k == name else e for k, e in self.factors.items()})


def _about_middle(low: float, high: float, share: float) -> tuple[float, float]:
    middle, reach = 0.5 * (low + high), 0.5 * share * (high - low)
    return middle - reach, middle + reach


def box_of(mission: Mission, uncertainty: Mapping[str, object] | str | Path) -> Box:
    """Return the box that a mapping or a file states, or refuse it with all faults."""
    words = "ranges by key, or the path of a TOML file with them"
    of_kind("uncertainty", uncertainty, Mapping | str | Path, words)
    table = (
        dict(uncertainty) if isinstance(uncertainty, Mapping) else read_toml(path_of(uncertainty))
    )
    factors, faults, keys = dict.fromkeys(FACTORS, (1.0, 1.0)), list[Fault](), tuple[Spread, ...]()
    if not table:
        faults.append(Fault("uncertainty", "", "at least one key or factor with its range"))
    for name in FACTORS:
        if name in table:
            form = table.pop(name)
            if (ends := _factor(form)) is None:
                words = "must be { percent = p }, 0 < p < 100, or { low = a, high = b }, 0 < a < b"
                pairs = form.items() if isinstance(form, dict) else ()
                value = ", ".join(f"{key} = {shown(number)}" for key, number in pairs)
                faults.append(Fault(name, f"{{ {value} }}" if value else shown(form), words))
            else:
                factors[name] = ends
    with collected(faults):
        keys = spreads(mission, table) if table else ()
    refuse(faults)
    return Box(keys, factors)


def _factor(form: object) -> tuple[float, float] | None:
    """Return both ends of a factor; None if it has another form."""
    numbers = form if isinstance(form, dict) else {}
    if not all(Number("-", gt=0.0, le=1e6).accepts(number) for number in numbers.values()):
        return None
    if numbers.keys() == {"percent"} and numbers["percent"] < 100.0:
        return 1.0 - numbers["percent"] / 100.0, 1.0 + numbers["percent"] / 100.0
    if numbers.keys() == {"low", "high"} and numbers["low"] < numbers["high"]:
        return float(numbers["low"]), float(numbers["high"])
    return None


class Points(NamedTuple):
    """Points of a box: variants of the mission by its keys, and both factors at each."""

    variants: Variants
    drain: Quantity
    charge: Quantity


class Corners(NamedTuple):
    """All corners of the keys, with the factors that leave least and most in the battery.

    Levels of ω and k_F come one after the other at the same corner of the other keys.
    """

    emptiest: Points
    fullest: Points
    levels: int  # Pairs of values of ω and k_F among the corners

    @property
    def size(self) -> int:
        """Number of corners of the keys."""
        return self.emptiest.variants.count


def corners_of(network: Network, box: Box) -> Corners:
    """The corners of a box, or a refusal if there are too many."""
    keys = sorted(box.spreads, key=lambda spread: spread.key.name in LEVELS)
    values = [_values(key) for key in keys]
    if (count := math.prod(map(len, values))) > MOST:
        words = f"must be at most {MOST} corners: 7 keys, or fewer with ω, k_F or wind"
        raise InputError([Fault("uncertainty", f"{count} corners", words)])
    points = np.array([*itertools.product(*values)])
    columns = {} if keys else _as_stated(network.mission, 1)
    for number, spread in enumerate(keys):
        columns |= spread.columns(points[:, number])
    variants = Variants(network, columns)
    (drain_low, drain_high), (charge_low, charge_high) = (box.factors[name] for name in FACTORS)
    return Corners(
        Points(variants, drain_high, charge_low),
        Points(variants, drain_low, charge_high),
        math.prod(LEVELS.get(key.key.name, 1) for key in keys),
    )


def _values(spread: Spread) -> Floats:
    """Values of a key among the corners."""
    name, ends = spread.key.name, (spread.low, spread.high)
    if name.startswith(WIND):
        return np.unique([*ends, np.clip(0.0, *ends)])
    return np.linspace(*ends, LEVELS.get(name, 2))


def samples_of(network: Network, box: Box, first: int, count: int, seed: int) -> Points:
    """Samples of the keys and of both factors, from a number on."""
    mission, columns = network.mission, _as_stated(network.mission, count)
    if box.spreads:
        columns = Draws(mission, box.spreads, count, seed, independent).values(first, count)
    shares = independent(FACTORS, seed, first, count)
    low, high = np.transpose([box.factors[name] for name in FACTORS])
    drain, charge = (low + shares * (high - low)).T
    return Points(Variants(network, columns), drain, charge)


def _as_stated(mission: Mission, count: int) -> dict[str, Floats]:
    """Columns of equal variants: one key with its value in the mission."""
    return {"limits.deadline_s": np.full(count, mission.limits.deadline_s)}
