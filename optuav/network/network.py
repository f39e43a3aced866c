"""The network of a mission as arrays: its places, legs and routes, and the trajectories over it."""

from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache

import numpy as np

from optuav.arrays import Integers
from optuav.mission import Mission
from optuav.network.legs import NO_LEG, Legs, build_legs
from optuav.network.obstacles import prisms
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
from optuav.network.routes import Routes, build_routes
from optuav.options import Order, Trajectory

SAME_S = 1e-6  # Times that differ by no more than this are equal [s]


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

    def only(self, route: int) -> "Network":
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


def trajectory_routes(network: Network, name: Trajectory, order: Order | None = None) -> Integers:
    """Numbers of the flyable routes that a trajectory may use, in one order or in both.

    Without a stop (``"direct"``), by the building nearest the device (``"traj1"``), the shortest in
    time by a building, or several that tie (``"traj2"``), or any (``"optimal"``).
    """
    routes = network.routes
    usable, rests = routes.flyable, routes.building >= 0
    if order is not None:
        usable = usable & (~rests | (routes.rest_first == (order == "rest-first")))
    if name == "direct":
        usable = usable & ~rests
    elif name == "traj1":
        device_m = np.array(network.mission.link.device_m)
        away_m = network.places.position_m[FIRST_BUILDING:] - device_m
        nearest = np.append((away_m**2).sum(axis=1), np.inf).argmin()
        usable = usable & rests & (routes.building == nearest)
    elif name == "traj2":
        usable = usable & rests
        if usable.any():
            usable &= routes.flight_time_s <= routes.flight_time_s[usable].min() + SAME_S
    return np.flatnonzero(usable)
