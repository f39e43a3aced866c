"""The network of a mission as arrays: its places, legs and routes, and the trajectories over it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import (
    DESTINATION,
    FIRST_BUILDING,
    HOVER,
    ORIGIN,
    ChargingCap,
    Places,
    build_places,
    charging_cap,
)
from optuav.network.prisms import Prisms, prisms
from optuav.options import Order, Trajectory
from optuav.physics.quantity import norm

NO_LEG = -1
SAME_S = 1e-6  # Flight times that differ by no more than this are equal [s]


@dataclass(frozen=True)
class Legs:
    """Legs by number; all arrays have one entry a leg."""

    # Numbers of places.
    start: Integers
    end: Integers
    # Length [m] and largest speed [m/s].
    distance_m: Floats
    peak_speed_m_s: Floats
    # (stage, leg): duration [s], current [A] and power [W] drawn in every stage.
    durations_s: Floats
    currents_A: Floats
    powers_W: Floats
    # Number of a building in the way, −1 if the way is clear or may cross buildings.
    crosses: Integers
    flyable: Booleans  # Whether a route may use it
    edited: Booleans  # Whether its figures were stated by the user rather than computed

    @property
    def duration_s(self) -> Floats:
        """Flight time [s]."""
        return np.asarray(self.durations_s.sum(axis=0))

    @property
    def charge_As(self) -> Floats:
        """Charge drawn [A s]."""
        return np.asarray((self.durations_s * self.currents_A).sum(axis=0))

    @property
    def energy_J(self) -> Floats:
        """Energy drawn [J]."""
        return np.asarray((self.durations_s * self.powers_W).sum(axis=0))


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


@dataclass(frozen=True, eq=False)
class Network:
    """The places and legs of a mission, and the routes over them."""

    mission: Mission
    # Tables of arrays, which refer to each other by number.
    places: Places
    legs: Legs
    routes: Routes

    def route_names(self, route: int) -> tuple[str, ...]:
        """Names of the places of a route in the order in which they are reached."""
        flown = [int(leg) for leg in self.routes.legs[route] if leg != NO_LEG]
        names = self.places.names
        return (names[self.legs.start[flown[0]]], *(names[self.legs.end[leg]] for leg in flown))

    @cached_property
    def charging_cap(self) -> ChargingCap | None:
        """Which key caps the charging current, and where; see `places.charging_cap`."""
        return charging_cap(self.mission, self.places)

    def only(self, route: int) -> Network:
        """The same network with a single route, number 0, and the legs that it uses."""
        routes, table = self.routes.take([route]), self.legs
        flown = routes.legs != NO_LEG
        used = routes.legs[flown]
        legs = Legs(*(getattr(table, each.name)[..., used] for each in fields(table)))
        routes = replace(routes, legs=np.where(flown, np.cumsum(flown) - 1, NO_LEG))
        return replace(self, legs=legs, routes=routes)


@lru_cache(maxsize=1)
def build_network(mission: Mission) -> Network:
    """The network of a mission: its places, and all legs and routes with at most one building.

    Legs 0 and 1 are origin → hover and hover → destination; legs 2 + 4 b to 5 + 4 b belong to
    building b: origin → b, b → hover, hover → b, b → destination. The last network is kept.
    """
    obstacles = prisms(mission.buildings)
    places = build_places(mission, obstacles)
    roof = np.arange(FIRST_BUILDING, len(places.names))
    ways = np.array([(ORIGIN, -1), (-1, HOVER), (HOVER, -1), (-1, DESTINATION)])  # −1 for its roof
    by_roof = np.where(ways < 0, roof[:, None, None], ways).reshape(-1, 2)
    start, end = np.concatenate([[(ORIGIN, HOVER), (HOVER, DESTINATION)], by_roof]).T
    legs = build_legs(mission, places, obstacles, start, end)
    routes = build_routes(legs)
    for array in (each for table in (places, legs, routes) for each in vars(table).values()):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)  # All who ask for an equal mission share it
    return Network(mission, places, legs, routes)


def build_legs(
    mission: Mission, places: Places, obstacles: Prisms, start: Integers, end: Integers
) -> Legs:
    """A table of the legs between places, from `start` to `end` (leg,), different in every leg."""
    x, y, z = (places.position_m[end] - places.position_m[start]).T
    loads, peak_m_s = vehicle.leg_loads(mission, (x, y, z))
    durations_s, currents_A, powers_W = (
        np.stack([np.broadcast_to(each, start.shape) for each in by_stage]) for by_stage in loads
    )
    crosses = np.full(len(start), CLEAR, dtype=np.intp)
    if not mission.flight.through_buildings:
        # A building in the way is the same there and back, and none where an end is not known.
        lines, line = shared_lines(start, end)
        known = np.isfinite(places.position_m)[lines].all(axis=(1, 2))
        low_m, high_m = np.moveaxis(places.position_m[lines[known]], 1, 0)
        blockers = np.full(len(lines), CLEAR, dtype=np.intp)
        blockers[known] = crossed(obstacles, low_m, high_m, lines[known] - FIRST_BUILDING)
        crosses = blockers[line]
    way = norm((x, y, z)), np.asarray(peak_m_s, dtype=float)
    drawn = durations_s, currents_A, powers_W
    flyable = np.isfinite(durations_s).all(axis=0) & (crosses == CLEAR)
    return Legs(start, end, *way, *drawn, crosses, flyable, np.zeros(len(start), bool))


def shared_lines(start: Integers, end: Integers) -> tuple[Integers, Integers]:
    """The lines between places (line, 2) that legs fly along, and the number of each leg's line.

    One line serves both directions, so that rounding cannot tell them apart.
    """
    low, high = np.minimum(start, end), np.maximum(start, end)
    count = 1 + int(high.max(initial=0))
    numbers, line = np.unique(low * count + high, return_inverse=True)
    return np.stack(np.divmod(numbers, count), axis=1), line


def build_routes(legs: Legs) -> Routes:
    """All routes with at most one building, over the legs of `build_network`."""
    first = np.arange(2, len(legs.start), 4)
    numbers = np.empty((1 + 2 * len(first), 3), dtype=np.intp)
    numbers[0] = 0, 1, NO_LEG
    numbers[1::2] = np.stack([first, first + 1, np.ones_like(first)], axis=1)
    numbers[2::2] = np.stack([np.zeros_like(first), first + 2, first + 3], axis=1)
    count = np.arange(len(numbers))
    return routes_along(legs, numbers, (count - 1) // 2, count % 2 == 1)


def routes_along(legs: Legs, numbers: Integers, building: Integers, rest_first: Booleans) -> Routes:
    """Routes by the numbers of the legs that each flies, with their totals; see `Routes`."""
    flown = numbers != NO_LEG
    stages_s = legs.durations_s
    figures = np.stack([stages_s, stages_s * legs.currents_A, stages_s * legs.powers_W]).sum(axis=1)
    flight_s, charge_As, energy_J = np.where(flown, figures[:, numbers], 0.0).sum(axis=2)
    flyable = np.asarray((legs.flyable[numbers] | ~flown).all(axis=1))
    return Routes(numbers, building, rest_first, flyable, flight_s, charge_As, energy_J)


def trajectory_routes(network: Network, name: Trajectory, order: Order | None = None) -> Integers:
    """Numbers of the flyable routes that a trajectory may use, in one order or in both.

    The trajectory ``"direct"`` has no stop, ``"traj1"`` goes by the building nearest the device,
    ``"traj2"`` is the shortest in time by one building (several where they tie), ``"optimal"`` is
    any.
    """
    away_m = network.places.position_m[FIRST_BUILDING:] - np.array(network.mission.link.device_m)
    usable, flight_s = network.routes.flyable[None], network.routes.flight_time_s[None]
    return np.flatnonzero(
        usable_routes(network.routes, name, order, usable, flight_s, away_m[None])
    )


def usable_routes(
    routes: Routes,
    name: Trajectory,
    order: Order | None,
    flyable: Booleans,
    flight_time_s: Floats,
    away_m: Floats,
) -> Booleans:
    """Which flyable routes a trajectory may use in every variant (variant or 1, route).

    Flight times [s] are of the same shape; `away_m` (variant or 1, building, 3) are the ways from
    the device to the buildings [m].
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
