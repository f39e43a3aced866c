"""Whether one stop is enough: the triangle inequality in time, charge and energy of the legs.

Routes with more than one stop never pay in the linear perspectives if no detour by way of a
building is shorter than the leg it replaces: resting may then be moved to the stop that charges
best, and the other stops left out. Hovering in two pieces around a rest never pays if either piece
can be moved to the other, that is if flying to the building first, or straight from it to the
destination, is no longer than by way of the hover point. Flight models obey this; the figures of an
edited graph, and buildings in the way of a leg, may not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from optuav.mission.network import Network
from optuav.mission.places import ENDS

if TYPE_CHECKING:
    from optuav.mission.graph import Graph

FIGURES = ("duration_s", "charge_As", "energy_J")
UNITS = {"duration_s": "s", "charge_As": "A s", "energy_J": "J"}
TOLERANCE = 1e-9
"""Relative; a detour that is shorter by rounding alone is none."""

Costs = Mapping[tuple[str, str], Mapping[str, float]]


@dataclass(frozen=True)
class Shortcut:
    """Two legs that together take less than the leg from the first place to the last.

    Parameters
    ----------
    places
        Names of the three places.
    figure
        ``"duration_s"``, ``"charge_As"`` or ``"energy_J"``.
    direct, by_way
        The figure of the leg from the first to the last place, infinite where there is no such leg,
        and of the two legs together.
    """

    places: tuple[str, str, str]
    figure: str
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


def one_stop_is_enough(legs: Network | Graph) -> tuple[Shortcut, ...]:
    """Where routes with more than one stop could pay in the linear perspectives.

    Parameters
    ----------
    legs
        A graph from `optuav.graph`, perhaps edited, or a mission that was worked out.

    Returns
    -------
    The shortcuts that break the triangle inequality; empty if one stop is enough. Of a way that has
    no direct leg there is one entry.
    """
    costs = _costs(legs)
    after: dict[str, list[str]] = {}
    for start, end in costs:
        after.setdefault(start, []).append(end)
    found: list[Shortcut] = []
    for start, stop in costs:
        if stop in ENDS or start == "destination":
            continue
        for end in after.get(stop, ()):
            if end not in (start, "origin") and (start, end) != ("origin", "destination"):
                found += _broken(costs, (start, stop, end))
        if start == "hover" and "hover" in after.get(stop, ()):
            before = [*_broken(costs, ("origin", "hover", stop))]
            behind = [*_broken(costs, (stop, "hover", "destination"))]
            found += before + behind if before and behind else []
    return tuple(found)


def in_words(shortcuts: Sequence[Shortcut]) -> str:
    """What shortcuts mean for routes with more than one stop, in a sentence."""
    if not shortcuts:
        return (
            "one stop is enough: times, charges and energies of the legs obey the triangle "
            "inequality"
        )
    more = f", and {len(shortcuts) - 1} more such" if len(shortcuts) > 1 else ""
    return f"a route with more than one stop may be better and was not tried: {shortcuts[0]}{more}"


def _costs(legs: Network | Graph) -> Costs:
    """Figures of the legs that may be flown, by names of start and end."""
    if not isinstance(legs, Network):
        return {(start, end): data for start, end, data in legs.edges(data=True)}
    names, table = legs.places.names, legs.legs
    columns = [getattr(table, figure).tolist() for figure in FIGURES]
    return {
        (names[start], names[end]): dict(zip(FIGURES, row, strict=True))
        for start, end, flyable, *row in zip(
            table.start.tolist(), table.end.tolist(), table.flyable.tolist(), *columns, strict=True
        )
        if flyable
    }


def _broken(costs: Costs, places: tuple[str, str, str]) -> Iterator[Shortcut]:
    """The figures in which two legs together take less than the direct one."""
    first, stop, last = places
    if (first, stop) not in costs or (stop, last) not in costs:
        return
    direct = costs.get((first, last))
    for figure in FIGURES:
        by_way = float(costs[first, stop][figure] + costs[stop, last][figure])
        straight = math.inf if direct is None else float(direct[figure])
        if straight > by_way * (1.0 + TOLERANCE):
            yield Shortcut(places, figure, straight, by_way)
        if direct is None:
            return
