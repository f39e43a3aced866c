"""The longest hover of many itineraries at once, from arrays, under the perspective `available`."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from itertools import accumulate, chain
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.bracketing import largest, shortest
from optuav.engines.sweeping import WIDTH_S
from optuav.errors import Fault, InputError
from optuav.physics import battery
from optuav.physics.quantity import TINY
from optuav.solving.hover_rows import Legs, hover_rows

Leg: TypeAlias = Sequence[battery.Phase]
Stays: TypeAlias = Literal["hover", "rest-first", "hover-first"]
STAYS: Mapping[str, tuple[str, ...]] = {
    "hover": ("hover",),
    "rest-first": ("rest", "hover"),
    "hover-first": ("hover", "rest"),
}
AT_ONCE = 1 << 13
"""Itineraries worked on together: few enough to stay in the cache, and in bounded memory."""

LARGEST = sys.float_info.max
ANY = (-LARGEST, LARGEST, "a finite number")
NOT_NEGATIVE = (0.0, LARGEST, "a finite number ≥ 0")
RANGES: Mapping[str, tuple[float, float, str]] = {
    "deadline_s": NOT_NEGATIVE,
    "min_soc": (0.0, 1.0, "0 to 1"),
    "capacity_As": (TINY, LARGEST, "a finite number > 0"),
    "available_fraction": (TINY, math.nextafter(1.0, 0.0), "between 0 and 1, neither included"),
    "flow_rate_per_s": NOT_NEGATIVE,
    "hover_current_A": ANY,
    "rest_current_A": ANY,
}
"""Least and largest figure of each name, and both in words."""


class Hovers(NamedTuple):
    """Longest hovers, arrays with one entry an itinerary.

    Parameters
    ----------
    hover_time_s, rest_time_s
        Δ and T' [s]; NaN where no hover is possible. T' is admissible, the shortest if so asked.
    beyond_s
        No hover is longer than this [s]; −inf where it is proved that none is possible.
    """

    hover_time_s: Floats
    rest_time_s: Floats
    beyond_s: Floats

    @property
    def proved(self) -> Booleans:
        """Where the hover is the longest to within 1e-7 s, or proved impossible."""
        close = self.beyond_s - self.hover_time_s <= 10.0 * WIDTH_S
        return np.asarray(close | np.isneginf(self.beyond_s))


def longest_hovers(
    legs: Sequence[Leg],
    stays: Stays | Sequence[Stays] = "hover",
    *,
    deadline_s: Any,
    min_soc: Any,
    capacity_As: Any,
    available_fraction: Any,
    flow_rate_per_s: Any,
    hover_current_A: Any,
    rest_current_A: Any = 0.0,
    shortest_rest: bool = False,
) -> Hovers:
    """Longest hovers that the battery can deliver, each with its proof (engine bracket).

    From a full battery, 0 ≤ y1 ≤ ωB at every moment, η ≥ η0 at the end, all within the deadline.
    Charging is at constant current; where it tapers, `optuav.solve` answers.
    Every figure is a number, or an array of one shape for all: the itineraries, of one mission or
    of many.

    Parameters
    ----------
    legs
        What is flown before, between and after the stays: one leg more than stays, each a sequence
        of `optuav.physics.battery.Phase` (current [A], negative while it drains, and duration [s],
        ≥ 0).
    stays
        ``"hover"``, ``"rest-first"`` or ``"hover-first"``, or one of these for each itinerary. Then
        there are three legs, of which one that only hovers flies the last two without a stop: the
        third may last 0 s.
    deadline_s, min_soc
        T_max [s], ≥ 0, and η0 [-], 0 to 1.
    capacity_As, available_fraction, flow_rate_per_s
        B of all packs together [A s], > 0, ω [-], in (0, 1), and k_F [1/s], ≥ 0.
    hover_current_A, rest_current_A
        Net current drawn while hovering, and that charges while resting [A].
    shortest_rest
        Whether to find the shortest T' for each Δ, which takes about half as long again.

    Raises
    ------
    InputError
        If the number of legs does not fit the stays, shapes differ, or a figure is out of range.
    """
    given = {
        "deadline_s": deadline_s,
        "min_soc": min_soc,
        "capacity_As": capacity_As,
        "available_fraction": available_fraction,
        "flow_rate_per_s": flow_rate_per_s,
        "hover_current_A": hover_current_A,
        "rest_current_A": rest_current_A,
    }
    figures = {name: _figure(value) for name, value in given.items()}
    flown = [[battery.Phase(*map(_figure, phase)) for phase in leg] for leg in legs]
    order = stays if isinstance(stays, str) else np.asarray(stays, dtype=str)
    shape = _shape(flown, order, figures)
    count = math.prod(shape)
    found = np.empty((3, count))
    for first in range(0, count, AT_ONCE):
        here = slice(first, min(first + AT_ONCE, count))
        table, cut = _legs(flown, here), {name: _cut(each, here) for name, each in figures.items()}
        if not _in_range(table, cut):
            raise InputError(_faults(flown, order, figures))
        found[:, here] = _bracket(table, _cut(order, here), cut, shortest_rest)
    return Hovers(*found.reshape(3, *shape))


def _bracket(legs: Legs, stays: Any, figures: Mapping[str, Any], shortest_rest: bool) -> Floats:
    rows, x_top = hover_rows(legs, figures, stays == "rest-first")
    y_top = np.where(stays == "hover", 0.0, x_top)
    found = largest(rows, x_top, y_top)
    rest_s = shortest(rows, found, y_top) if shortest_rest else found.y
    return np.stack([found.x, rest_s, found.beyond])


def _figure(value: Any) -> Any:
    """A number, or an array of numbers."""
    array = np.asarray(value, dtype=float)
    return array if array.ndim else float(array)


def _cut(figure: Any, here: slice) -> Any:
    """A figure of some itineraries; what is no array holds for all."""
    return figure.ravel()[here] if isinstance(figure, np.ndarray) else figure


def _legs(flown: Sequence[Leg], here: slice) -> Legs:
    """The legs of some of the itineraries."""
    ends = list(accumulate(map(len, flown), initial=0))
    table = np.empty((2, ends[-1], here.stop - here.start))
    for stage, phase in enumerate(chain.from_iterable(flown)):
        for kind, figure in enumerate(phase):
            table[kind, stage] = _cut(figure, here)
    current_A, duration_s = table
    return Legs(current_A, duration_s, ends)


def _shape(flown: Sequence[Leg], stays: Any, figures: Mapping[str, Any]) -> tuple[int, ...]:
    """The one shape of all that are arrays."""
    shapes = _shapes(flown, stays, figures)
    if len(shapes) > 1 or len(flown) != _legs_needed(stays):
        raise InputError(_faults(flown, stays, figures))
    return shapes[0] if shapes else ()


def _shapes(flown: Sequence[Leg], stays: Any, figures: Mapping[str, Any]) -> list[tuple[int, ...]]:
    stages = chain.from_iterable(chain.from_iterable(flown))
    every = (stays, *figures.values(), *stages)
    return list(dict.fromkeys(each.shape for each in every if isinstance(each, np.ndarray)))


def _legs_needed(stays: Any) -> int:
    """One more than stays; 0 if one of these is unknown."""
    if isinstance(stays, str):
        return len(STAYS[stays]) + 1 if stays in STAYS else 0
    return 3 if np.isin(stays, list(STAYS)).all() else 0


def _in_range(legs: Legs, figures: Mapping[str, Any]) -> bool:
    """Whether all that is handed over can be worked with."""
    return (
        _within(legs.current_A, *ANY)
        and _within(legs.duration_s, *NOT_NEGATIVE)
        and all(_within(each, *RANGES[name]) for name, each in figures.items())
    )


def _within(figure: Any, least: float, most: float, _: str) -> bool:
    if isinstance(figure, float):
        return least <= figure <= most
    return bool(figure.min(initial=least) >= least and figure.max(initial=most) <= most)


def _faults(flown: Sequence[Leg], stays: Any, figures: Mapping[str, Any]) -> list[Fault]:
    """Everything that is wrong."""
    faults = []
    if not (needed := _legs_needed(stays)):
        unknown = set(np.ravel(stays).tolist()) - STAYS.keys()
        faults.append(Fault("stays", ", ".join(sorted(unknown)), f"one of {', '.join(STAYS)}"))
    elif len(flown) != needed:
        which = repr(stays) if isinstance(stays, str) else "stays that are told one by one"
        faults.append(Fault("legs", f"{len(flown)} legs", f"{needed} go with {which}"))
    if len(shapes := _shapes(flown, stays, figures)) > 1:
        faults.append(Fault("shapes", ", ".join(map(str, shapes)), "one shape for all arrays"))
    every = [(name, figure, RANGES[name]) for name, figure in figures.items()]
    for number, leg in enumerate(flown, start=1):
        for stage, phase in enumerate(leg, start=1):
            where = f"of stage {stage} of leg {number}"
            every.append((f"legs: current {where}", phase.current_A, ANY))
            every.append((f"legs: duration {where}", phase.duration_s, NOT_NEGATIVE))
    faults += [
        Fault(name, _outside(figure, *allowed), allowed[-1])
        for name, figure, allowed in every
        if not _within(figure, *allowed)
    ]
    return faults


def _outside(figure: Any, least: float, most: float, _: str) -> str:
    """The first entry that is out of range."""
    every = np.ravel(figure)
    return f"{every[~((every >= least) & (every <= most))][0]:g}"
