"""Routes: which legs in which order, with what they draw and where they rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.legs import Legs
from optuav.network.places import Places
from optuav.options import Order

NO_LEG = -1


@dataclass(frozen=True)
class Routes:
    """Routes with at most one building; all arrays have one entry a route.

    They are ordered as ties are broken: the direct route, then the buildings in the mission's
    order, each rest first and then hover first.
    """

    legs: Integers  # (route, 3): numbers of the legs flown, −1 for none
    building: Integers  # Number of the building it goes by, −1 for the direct route
    rest_first: Booleans  # Whether the building comes before the hover point
    flyable: Booleans  # Whether all its legs are
    # Totals over its legs [s], [A s], [J].
    flight_time_s: Floats
    flight_charge_As: Floats
    flight_energy_J: Floats

    def __len__(self) -> int:
        return len(self.building)

    def take(self, which: Sequence[int] | Integers) -> Routes:
        """The routes with the given numbers, in that order."""
        chosen = np.asarray(which, dtype=np.intp)
        return Routes(**{each.name: getattr(self, each.name)[chosen] for each in fields(self)})

    def order(self, index: int) -> Order | None:
        """Order of rest and hover on a route; None for the direct one."""
        if self.building[index] < 0:
            return None
        return "rest-first" if self.rest_first[index] else "hover-first"


def build_routes(legs: Legs, places: Places) -> Routes:
    """All routes with at most one building, over legs in the order of `one_stop_legs`."""
    count = len(places.buildings)
    numbers = np.empty((1 + 2 * count, 3), dtype=np.intp)
    numbers[0] = 0, 1, NO_LEG
    to_roof = 2 + 4 * np.arange(count)
    numbers[1::2] = np.stack([to_roof, to_roof + 1, np.ones_like(to_roof)], axis=1)
    numbers[2::2] = np.stack([np.zeros_like(to_roof), to_roof + 2, to_roof + 3], axis=1)
    flown = numbers != NO_LEG

    def total(per_leg: Floats) -> Floats:
        return np.asarray(np.where(flown, per_leg[numbers], 0.0).sum(axis=1))

    return Routes(
        legs=numbers,
        building=(np.arange(1 + 2 * count) - 1) // 2,
        rest_first=np.arange(1 + 2 * count) % 2 == 1,
        flyable=np.asarray(np.where(flown, legs.flyable[numbers], True).all(axis=1)),
        flight_time_s=total(legs.duration_s),
        flight_charge_As=total(legs.charge_As),
        flight_energy_J=total(legs.energy_J),
    )
