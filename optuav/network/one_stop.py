"""Test if one rest and one hover are enough: the triangle inequality of the legs.

In the linear perspectives a plan may leave out all stops but one hover and the rest where charging
is best, if no way by a third place takes less time, charge or energy than a leg that is then flown
instead. Two hovers around a rest become one if either can be moved to the other: if flying to the
building first, or straight from it to the destination, takes no more than over the hover point.
Longer ways are not shorter then either. Flight models obey this; figures of an edited graph, and
buildings in the way of a leg, may not.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from optuav.network.graph import Graph, edited_legs
from optuav.network.legs import Legs, build_legs
from optuav.network.network import Network
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.prisms import prisms
from optuav.presentation.numbers import figure

FIGURES = ("duration_s", "charge_As", "energy_J")
FIGURE_UNITS = ("s", "A s", "J")
DETOUR_TOLERANCE = 1e-9  # Relative; a way around that is shorter only by rounding does not count
MOST_COMPARED = 60  # buildings of a mission whose legs are all compared with the ways around them


class Shortcut(NamedTuple):
    """Two legs that together take less than the leg from the first place to the last."""

    places: tuple[str, str, str]  # Names of the three places
    figure: str  # ``"duration_s"``, ``"charge_As"`` or ``"energy_J"``
    # The figure of the leg from the first to the last place, infinite without such a leg,
    # and of the two legs together.
    direct: float
    by_way: float

    def __str__(self) -> str:
        first, _, last = self.places
        way, unit = " → ".join(self.places), FIGURE_UNITS[FIGURES.index(self.figure)]
        straight = f"{first} → {last}"
        if np.isinf(self.direct):
            return f"{way} can be flown, {straight} cannot"
        return (
            f"{way} takes {figure(self.by_way)} {unit}, {straight} takes {figure(self.direct)} "
            f"{unit}"
        )


def all_legs(network: Network, graph: Graph | None = None) -> Legs:
    """The legs between any two places of a mission, with the figures that a graph states."""
    places = network.places
    start, end = np.nonzero(~np.eye(len(places.names), dtype=bool))
    table = build_legs(network.mission, places, prisms(network.mission.buildings), start, end)
    if graph is None:
        return table
    # A graph has the legs with one building on the way, so missing legs are forbidden.
    gone = np.array([name not in graph for name in places.names])
    one_stop = np.zeros((len(gone), len(gone)), bool)
    one_stop[network.legs.start, network.legs.end] = True
    needed = one_stop[start, end] | gone[start] | gone[end]
    return edited_legs(table, places.names, graph, needed)


def find_shortcuts(network: Network) -> tuple[Shortcut, ...]:
    """Return where plans with more than one rest and one hover could pay, linear perspectives.

    For every leg of a plan with one rest and one hover: the best way by a third place that
    takes less, one per figure. Legs lead between any two places; a missing one counts once.
    """
    table, names = network.legs, network.places.names
    figures = np.full((len(FIGURES), len(names), len(names)), np.inf)
    used = table.flyable & (table.end != ORIGIN) & (table.start != DESTINATION)
    figures_used = [getattr(table, name)[used] for name in FIGURES]
    figures[:, table.start[used], table.end[used]] = figures_used
    flown = np.zeros(figures.shape[1:], bool)
    flown[[ORIGIN, HOVER]] = flown[FIRST_BUILDING:, [HOVER, DESTINATION]] = True
    flown[:, ORIGIN] = flown[ORIGIN, DESTINATION] = flown[HOVER, HOVER] = False
    start, end = np.nonzero(flown)
    direct = figures[:, start, end][..., None]
    around = figures[:, start] + figures[:, :, end].swapaxes(1, 2)  # (figure, leg, third place)
    less = direct > around * (1.0 + DETOUR_TOLERANCE)
    less[1:] &= np.isfinite(direct[1:])
    # Over the hover point, to a building and on from it: one of the two hovers may be moved.
    there = (start == ORIGIN) & (end >= FIRST_BUILDING)
    back = (start >= FIRST_BUILDING) & (end == DESTINATION)
    stay = less[:, there, HOVER].any(axis=0) & less[:, back, HOVER].any(axis=0)
    less[:, there, HOVER] &= stay
    less[:, back, HOVER] &= stay
    third = np.where(less, around, np.inf).argmin(axis=2)
    shortcuts = []
    for leg, number in np.argwhere(less.any(axis=2).T).tolist():
        via = third[number, leg]
        places = names[start[leg]], names[via], names[end[leg]]
        numbers = float(direct[number, leg, 0]), float(around[number, leg, via])
        shortcuts.append(Shortcut(places, FIGURES[number], *numbers))
    return tuple(shortcuts)


@lru_cache(maxsize=1)
def one_stop_is_enough(network: Network, graph: Graph | None = None) -> bool:
    """Return whether no leg takes more than a way around; False for many buildings.

    Also False if η0 must be left at every landing: charge may be needed before the best building.
    """
    few = len(network.mission.buildings) <= MOST_COMPARED
    few = few and network.mission.limits.keep_soc == "end"
    return few and not find_shortcuts(replace(network, legs=all_legs(network, graph)))


def one_stop_words(network: Network, graph: Graph | None = None) -> str:
    """Say in a sentence whether routes with more than one stop may be better."""
    if one_stop_is_enough(network, graph):
        legs = "times, charges and energies of the legs obey the triangle inequality"
        return f"one stop is enough: {legs}"
    words = "a route with more than one stop may be better and was not tried"
    if len(network.mission.buildings) > MOST_COMPARED:
        return words
    if network.mission.limits.keep_soc == "always":
        return f"{words}, as limits.keep_soc = 'always' may need charge on the way"
    first, *others = find_shortcuts(replace(network, legs=all_legs(network, graph)))
    return f"{words}: {first}" + (f", and {len(others)} more such" if others else "")
