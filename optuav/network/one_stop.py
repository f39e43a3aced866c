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
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from optuav.network.network import Network
from optuav.network.places import ENDS, FIRST_BUILDING

FIGURES = ("duration_s", "charge_As", "energy_J")
UNITS = ("s", "A s", "J")
TOLERANCE = 1e-9  # Relative; a detour that is shorter by rounding alone is none


class Shortcut(NamedTuple):
    """Two legs that together take less than the leg from the first place to the last."""

    places: tuple[str, str, str]  # Names of the three places
    figure: str  # ``"duration_s"``, ``"charge_As"`` or ``"energy_J"``
    # The figure of the leg from the first to the last place, infinite where there is no such leg,
    # and of the two legs together.
    direct: float
    by_way: float

    def __str__(self) -> str:
        first, _, last = self.places
        way, unit = " → ".join(self.places), UNITS[FIGURES.index(self.figure)]
        if math.isinf(self.direct):
            return f"{way} can be flown, {first} → {last} cannot"
        return (
            f"{way} takes {self.by_way:.6g} {unit}, {first} → {last} takes {self.direct:.6g} {unit}"
        )


def find_shortcuts(network: Network) -> tuple[Shortcut, ...]:
    """Where routes with more than one stop could pay in the linear perspectives.

    Empty if one stop is enough; two legs with no direct leg in their place count once.
    """
    legs, names = network.legs, network.places.names[FIRST_BUILDING:]
    figures = np.stack([getattr(legs, each) for each in FIGURES], axis=1)
    figures[~legs.flyable] = np.inf
    arriving, leaving = figures[:2]
    there, to_hover, back, onward = np.moveaxis(figures[2:].reshape(-1, 4, 3), 1, 0)
    direct = np.stack(np.broadcast_arrays(arriving, leaving, there, onward))
    by_way = np.stack([there + to_hover, back + onward, arriving + back, to_hover + leaving])
    less = direct > by_way * (1.0 + TOLERANCE)
    less[..., 1:] &= np.isfinite(direct[..., 1:])
    both = less[2:].any(axis=2).all(axis=0)  # pieces of a hover around a rest
    less[2:] &= np.asarray(both)[:, None]
    origin, hover, destination = ENDS
    found = []
    for number, k, figure in np.argwhere(less.swapaxes(0, 1)).tolist():
        name = names[number]
        ways = (origin, name, hover), (hover, name, destination)
        places = (*ways, (origin, hover, name), (name, hover, destination))[k]
        numbers = float(direct[k, number, figure]), float(by_way[k, number, figure])
        found.append(Shortcut(places, FIGURES[figure], *numbers))
    return tuple(found)


def shortcuts_in_words(shortcuts: Sequence[Shortcut]) -> str:
    """What shortcuts mean for routes with more than one stop, in a sentence."""
    if not shortcuts:
        return (
            "one stop is enough: times, charges and energies of the legs obey the triangle "
            "inequality"
        )
    more = f", and {len(shortcuts) - 1} more such" if len(shortcuts) > 1 else ""
    return f"a route with more than one stop may be better and was not tried: {shortcuts[0]}{more}"
