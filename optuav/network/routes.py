"""Routes with at most one building, as arrays: over every hover point once."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.legs import NO_LEG, Legs
from optuav.options import Order


@dataclass(frozen=True)
class Routes:
    """Routes with at most one building; all arrays have one entry a route.

    In the order of ties: without a building, then by the order of devices, the buildings in order,
    and the rest as early as possible.
    """

    legs: Integers  # (route, devices + 2): numbers of the legs flown, −1 for none
    building: Integers  # Number of the building it goes by, −1 for a direct route
    rest_after: Integers  # Number of hovers before the building; all of them on a direct route
    devices: Integers  # (route, device): numbers of the devices in flight order
    flyable: Booleans  # Whether all its legs are
    # Totals over its legs [s], [A s], [J].
    flight_time_s: Floats
    flight_charge_As: Floats
    flight_energy_J: Floats

    def __len__(self) -> int:
        return len(self.building)

    @property
    def rest_first(self) -> Booleans:
        """Whether the building comes before all hover points."""
        return np.asarray(self.rest_after == 0)

    def in_order(self, order: Order) -> Booleans:
        """Which routes have their rest before, between or after the hovers."""
        last = self.devices.shape[1]
        between = (self.rest_after > 0) & (self.rest_after < last)
        after = {"rest-first": self.rest_after == 0, "hover-first": self.rest_after == last}
        return np.asarray(after.get(order, between))

    def take(self, which: Sequence[int] | Integers) -> "Routes":
        """The routes with the given numbers, in that order."""
        chosen = np.asarray(which, dtype=np.intp)
        return Routes(**{field.name: getattr(self, field.name)[chosen] for field in fields(self)})

    def order(self, index: int) -> Order | None:
        """Order of rest and hovers on a route; None for a direct one."""
        if self.building[index] < 0:
            return None
        before, count = int(self.rest_after[index]), self.devices.shape[1]
        return "rest-first" if before == 0 else "hover-first" if before == count else "between"


def leg_ends(hovers: Integers, ends: tuple[int, int], roofs: Integers) -> tuple[Integers, Integers]:
    """Start and end, by number of the place, of all legs that routes over some roofs may use.

    First origin → d, d → d' and d → destination, then for every roof b origin → b, b → d, d → b and
    b → destination.
    """
    origin, destination = ends
    there = [(origin, d) for d in hovers.tolist()]
    across = [(d, e) for d in hovers.tolist() for e in hovers.tolist() if d != e]
    back = [(d, destination) for d in hovers.tolist()]
    to_roof = [(-1, d) for d in hovers.tolist()]  # −1 for its roof
    ways = np.array([(origin, -1), *to_roof, *((d, b) for b, d in to_roof), (-1, destination)])
    by_roof = np.where(ways < 0, roofs[:, None, None], ways).reshape(-1, 2)
    start, end = np.concatenate([there + across + back, by_roof]).T
    return start, end


ONE_DEVICE = np.zeros((1, 1), dtype=np.intp)  # The only order of one device


def build_routes(legs: Legs, buildings: Integers, devices: Integers = ONE_DEVICE) -> Routes:
    """All routes with at most one of some buildings, in some orders of devices (order, device).

    The legs are those of `leg_ends` over the buildings, numbered as there.
    """
    orders, count = devices.shape
    roof, after = np.arange(len(buildings)), np.arange(count + 1)
    resting = len(roof) * len(after)
    return some_routes(
        legs,
        buildings,
        np.concatenate([devices, devices.repeat(resting, axis=0)]),
        np.append(np.full(orders, -1), np.tile(roof.repeat(len(after)), orders)),
        np.append(np.full(orders, count), np.tile(after, orders * len(roof))),
    )


def some_routes(
    legs: Legs, buildings: Integers, devices: Integers, roof: Integers, after: Integers
) -> Routes:
    """Routes in orders of devices (route, device), over a roof after some of the hovers.

    A roof goes by its place among the buildings, −1 for none: then it comes after all hovers. The
    legs are those of `leg_ends` over the buildings.
    """
    count, rests = devices.shape[1], roof >= 0
    numbers = np.full((len(devices), count + 2), NO_LEG, dtype=np.intp)
    straight = straight_legs(devices)
    numbers[:, :-1] = straight
    for place in range(count + 1) if rests.any() else ():
        (here,) = np.nonzero(rests & (after == place))
        of_roof = count * (count + 1) + (2 * count + 2) * roof[here]
        numbers[here, place + 2 :] = straight[here, place + 1 :]
        numbers[here, place] = of_roof + (1 + count + devices[here, place - 1] if place else 0)
        onward = 1 + devices[here, place] if place < count else 1 + 2 * count
        numbers[here, place + 1] = of_roof + onward
    building = np.where(rests, buildings[roof] if len(buildings) else -1, -1)
    return routes_along(legs, numbers, building, after, devices)


def straight_legs(devices: Integers) -> Integers:
    """Numbers of the legs that fly over devices in some orders (order, leg), as in `leg_ends`."""
    orders, count = devices.shape
    straight = np.empty((orders, count + 1), dtype=np.intp)
    straight[:, 0], straight[:, -1] = devices[:, 0], count * count + devices[:, -1]
    here, there = devices[:, :-1], devices[:, 1:]
    straight[:, 1:-1] = count + here * (count - 1) + there - (there > here)
    return straight


def routes_along(
    legs: Legs, numbers: Integers, building: Integers, rest_after: Integers, devices: Integers
) -> Routes:
    """Routes by the numbers of the legs that each flies, with their totals; see `Routes`."""
    flyable = np.asarray((legs.flyable[numbers] | (numbers == NO_LEG)).all(axis=1))
    of_legs = np.stack([legs.duration_s, legs.charge_As, legs.energy_J])
    return Routes(numbers, building, rest_after, devices, flyable, *totals(of_legs, numbers))


def totals(of_legs: Floats, numbers: Integers) -> Floats:
    """Sums of a figure (row, leg) over the legs that each route flies (row, route)."""
    padded = np.concatenate([of_legs, np.zeros((len(of_legs), 1))], axis=1)  # for NO_LEG
    first, *others = (padded[:, legs] for legs in numbers.T)
    return np.asarray(sum(others, first))
