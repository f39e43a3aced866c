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
    own = count * (count + 1) + (2 * count + 2) * np.arange(len(buildings))[:, None]
    straight = np.empty((orders, count + 1), dtype=np.intp)
    straight[:, 0], straight[:, -1] = devices[:, 0], count * count + devices[:, -1]
    here, there = devices[:, :-1], devices[:, 1:]
    straight[:, 1:-1] = count + here * (count - 1) + there - (there > here)
    numbers = np.full((orders, len(buildings), count + 1, count + 2), NO_LEG, dtype=np.intp)
    for before in range(count + 1):
        way = numbers[:, :, before]
        way[:, :, :before] = straight[:, None, :before]
        way[:, :, before + 2 :] = straight[:, None, before + 1 :]
        way[:, :, before] = (own + (1 + count + devices[:, before - 1] if before else 0)).T
        last = 1 + 2 * count
        way[:, :, before + 1] = (own + (1 + devices[:, before] if before < count else last)).T
    direct = np.full((orders, count + 2), NO_LEG, dtype=np.intp)
    direct[:, :-1] = straight
    places = np.arange(count + 1)
    return routes_along(
        legs,
        np.concatenate([direct, numbers.reshape(-1, count + 2)]),
        np.append(np.full(orders, -1), np.tile(buildings.repeat(len(places)), orders)),
        np.append(np.full(orders, count), np.tile(places, orders * len(buildings))),
        np.concatenate([devices, devices.repeat(len(buildings) * len(places), axis=0)]),
    )


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
