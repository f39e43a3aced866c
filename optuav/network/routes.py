"""Routes with at most one building, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.legs import NO_LEG, Legs
from optuav.options import Order


@dataclass(frozen=True)
class Routes:
    """Routes with at most one building; all arrays have one entry a route.

    In the order of ties: direct, then the buildings in order, each rest first, then hover first.
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

    def take(self, which: Sequence[int] | Integers) -> "Routes":
        """The routes with the given numbers, in that order."""
        chosen = np.asarray(which, dtype=np.intp)
        return Routes(**{field.name: getattr(self, field.name)[chosen] for field in fields(self)})

    def order(self, index: int) -> Order | None:
        """Order of rest and hover on a route; None for the direct one."""
        if self.building[index] < 0:
            return None
        return "rest-first" if self.rest_first[index] else "hover-first"


def build_routes(legs: Legs, buildings: Integers) -> Routes:
    """All routes with at most one of some buildings, over the legs of `network_by`."""
    first = np.arange(2, len(legs.start), 4)
    numbers = np.empty((1 + 2 * len(first), 3), dtype=np.intp)
    numbers[0] = 0, 1, NO_LEG
    numbers[1::2] = np.stack([first, first + 1, np.ones_like(first)], axis=1)
    numbers[2::2] = np.stack([np.zeros_like(first), first + 2, first + 3], axis=1)
    count = np.arange(len(numbers))
    return routes_along(legs, numbers, np.append(-1, buildings.repeat(2)), count % 2 == 1)


def routes_along(legs: Legs, numbers: Integers, building: Integers, rest_first: Booleans) -> Routes:
    """Routes by the numbers of the legs that each flies, with their totals; see `Routes`."""
    flyable = np.asarray((legs.flyable[numbers] | (numbers == NO_LEG)).all(axis=1))
    of_legs = np.stack([legs.duration_s, legs.charge_As, legs.energy_J])
    return Routes(numbers, building, rest_first, flyable, *totals(of_legs, numbers))


def totals(of_legs: Floats, numbers: Integers) -> Floats:
    """Sums of a figure (row, leg) over the legs that each route flies (row, route)."""
    padded = np.concatenate([of_legs, np.zeros((len(of_legs), 1))], axis=1)  # for NO_LEG
    first, *others = (padded[:, legs] for legs in numbers.T)
    return np.asarray(sum(others, first))
