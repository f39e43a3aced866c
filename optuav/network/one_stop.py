"""Whether one stop is enough: the triangle inequality in time, charge and energy of the legs.

Routes with more than one stop never pay in the linear perspectives if no detour over a building is
shorter than the leg it replaces: resting may then be moved to the stop that charges best, and the
other stops left out. Hovering in two pieces around a rest never pays if either piece can be moved
to the other, that is if flying to the building first, or straight from it to the destination, is no
longer than over the hover point. Flight models obey this; the figures of an edited graph, and
buildings in the way of a leg, may not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.network import Network
from optuav.network.places import DESTINATION, ENDS, FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.routes import NO_LEG

if TYPE_CHECKING:
    from optuav.network.graph import Graph

FIGURES = ("duration_s", "charge_As", "energy_J")
UNITS = {"duration_s": "s", "charge_As": "A s", "energy_J": "J"}
TOLERANCE = 1e-9
"""Relative; a detour that is shorter by rounding alone is none."""


@dataclass(frozen=True)
class Shortcut:
    """Two legs that together take less than the leg from the first place to the last."""

    places: tuple[str, str, str]  # Names of the three places
    figure: str  # ``"duration_s"``, ``"charge_As"`` or ``"energy_J"``
    # The figure of the leg from the first to the last place, infinite where there is no such leg,
    # and of the two legs together.
    direct: float
    by_way: float

    def __str__(self) -> str:
        way, unit = " → ".join(self.places), UNITS[self.figure]
        if math.isinf(self.direct):
            return f"{way} can be flown, {self.places[0]} → {self.places[2]} cannot"
        return (
            f"{way} takes {self.by_way:.6g} {unit}, "
            f"{self.places[0]} → {self.places[2]} takes {self.direct:.6g} {unit}"
        )


class _FlyableLegs(NamedTuple):
    """The legs that may be flown: names of places, starts and ends of legs, `FIGURES` (leg, 3)."""

    names: Sequence[str]
    start: Integers
    end: Integers
    figures: Floats

    def between(self, start: Integers, end: Integers) -> Integers:
        """Numbers of the legs between places; −1 where there is none."""
        ends, wanted = self.start * len(self.names) + self.end, start * len(self.names) + end
        order = np.argsort(ends)
        at = np.minimum(np.searchsorted(ends, wanted, sorter=order), len(order) - 1)
        return np.where(ends[order[at]] == wanted, order[at], NO_LEG)

    def followed(self, legs: Integers) -> tuple[Integers, Integers]:
        """Pairs of each of some legs with each leg that begins where it ends."""
        order = np.argsort(self.start, kind="stable")
        low, high = (
            np.searchsorted(self.start, self.end[legs], side, sorter=order)
            for side in ("left", "right")
        )
        count = high - low
        number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        return np.repeat(legs, count), order[np.repeat(low, count) + number]

    def shorter(self, first: Integers, second: Integers) -> Booleans:
        """In which figures two legs together take less than the direct one (pair, 3).

        In the first alone where there is no direct one; in none where one of the two is missing.
        """
        by_way = self.figures[first] + self.figures[second]
        direct = self.between(self.start[first], self.end[second])
        missing = direct == NO_LEG
        straight = np.where(missing[:, None], np.inf, self.figures[direct])
        less: Booleans = straight > by_way * (1.0 + TOLERANCE)
        less[missing, 1:] = False
        less[(first == NO_LEG) | (second == NO_LEG)] = False
        return less

    def shortcuts(self, first: int, second: int) -> Iterator[Shortcut]:
        """The shortcuts that two legs are, figure by figure."""
        start, stop, end = self.start[first], self.start[second], self.end[second]
        direct = int(self.between(start, end))
        for number in np.flatnonzero(self.shorter(np.array([first]), np.array([second]))[0]):
            yield Shortcut(
                (self.names[start], self.names[stop], self.names[end]),
                FIGURES[number],
                math.inf if direct == NO_LEG else float(self.figures[direct, number]),
                float(self.figures[first, number] + self.figures[second, number]),
            )


def _flyable_legs(network: Network | Graph) -> _FlyableLegs:
    """The legs of a network or a graph that may be flown."""
    if isinstance(network, Network):
        legs, flyable = network.legs, np.flatnonzero(network.legs.flyable)
        figures = np.stack([getattr(legs, figure)[flyable] for figure in FIGURES], axis=1)
        return _FlyableLegs(network.places.names, legs.start[flyable], legs.end[flyable], figures)
    names = [*ENDS, *(name for name in network if name not in ENDS)]
    numbers = {name: number for number, name in enumerate(names)}
    start, end = (np.array([numbers[each[k]] for each in network.edges], int) for k in (0, 1))
    figures = np.array([[data[each] for each in FIGURES] for *_, data in network.edges(data=True)])
    return _FlyableLegs(names, start, end, figures.reshape(-1, len(FIGURES)))


def find_shortcuts(network: Network | Graph) -> tuple[Shortcut, ...]:
    """Where routes with more than one stop could pay in the linear perspectives.

    Empty if one stop is enough; two legs with no direct leg in their place count once.
    """
    legs = _flyable_legs(network)
    if not len(legs.start):
        return ()
    to_stop = np.flatnonzero((legs.end >= FIRST_BUILDING) & (legs.start != DESTINATION))
    first, second = legs.followed(to_stop)
    start, end = legs.start[first], legs.end[second]
    around = (start == HOVER) & (end == HOVER)
    by_way = ~around & (start != end) & (end != ORIGIN)
    by_way &= (start != ORIGIN) | (end != DESTINATION)
    by_way[by_way] = legs.shorter(first[by_way], second[by_way]).any(axis=1)
    found = [(leg, leg, after) for leg, after in zip(first[by_way], second[by_way], strict=True)]
    there, back = first[around], second[around]
    arriving, leaving = (
        int(legs.between(np.array(start), np.array(end)))
        for start, end in ((ORIGIN, HOVER), (HOVER, DESTINATION))
    )
    before = legs.shorter(np.full_like(there, arriving), there).any(axis=1)
    behind = legs.shorter(back, np.full_like(back, leaving)).any(axis=1)
    for leg, after in zip(there[before & behind], back[before & behind], strict=True):
        found += [(leg, arriving, leg), (leg, after, leaving)]
    found.sort(key=lambda each: each[0])
    return tuple(each for _, leg, after in found for each in legs.shortcuts(leg, after))


def shortcuts_in_words(shortcuts: Sequence[Shortcut]) -> str:
    """What shortcuts mean for routes with more than one stop, in a sentence."""
    if not shortcuts:
        return (
            "one stop is enough: times, charges and energies of the legs obey the triangle "
            "inequality"
        )
    more = f", and {len(shortcuts) - 1} more such" if len(shortcuts) > 1 else ""
    return f"a route with more than one stop may be better and was not tried: {shortcuts[0]}{more}"
