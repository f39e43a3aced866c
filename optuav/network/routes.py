"""Routes with at most one building, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.legs import NO_LEG, Legs
from optuav.options import Order, Trajectory
from optuav.status import SAME_S


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


def usable_routes(
    routes: Routes,
    name: Trajectory,
    order: Order | None,
    flyable: Booleans,
    flight_time_s: Floats,
    away_m: Floats,
) -> Booleans:
    """Return which flyable routes a trajectory may use in every variant (variant or 1, route).

    Without a stop (``"direct"``), by the building nearest the device (``"traj1"``), the shortest in
    time by a building, or several that tie (``"traj2"``), or any (``"optimal"``); in one order, or
    in both. Flight times [s] are of the same shape; `away_m` (variant or 1, building, 3) are the
    ways from the device to the buildings [m].
    """
    usable, rests = flyable, routes.building >= 0
    if order is not None:
        usable = usable & (~rests | (routes.rest_first == (order == "rest-first")))
    if name == "direct":
        usable = usable & ~rests
    elif name == "traj1":
        distance_m2 = np.pad((away_m**2).sum(axis=2), ((0, 0), (0, 1)), constant_values=np.inf)
        usable = usable & rests & (routes.building == distance_m2.argmin(axis=1)[:, None])
    elif name == "traj2":
        usable = usable & rests
        times_s = np.where(usable, flight_time_s, np.inf)
        usable = usable & (times_s <= times_s.min(axis=1, keepdims=True) + SAME_S)
    return usable
