"""The network of a mission: its places, legs and routes, and the paper's trajectories over it."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from optuav.arrays import Integers
from optuav.mission import Mission
from optuav.network.legs import Legs, build_legs, one_stop_legs
from optuav.network.obstacles import prisms
from optuav.network.places import Places, build_places
from optuav.network.routes import NO_LEG, Routes, build_routes
from optuav.options import Order, Trajectory

SAME_S = 1e-6
"""Flight times that differ by no more than this are equal [s]."""


@dataclass(frozen=True)
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

    def only(self, route: int) -> Network:
        """The same network with a single route, number 0, and the legs that it uses."""
        routes, table = self.routes.take([route]), self.legs
        flown = routes.legs != NO_LEG
        used = routes.legs[flown]
        legs = Legs(*(getattr(table, each.name)[..., used] for each in fields(table)))
        routes = replace(routes, legs=np.where(flown, np.cumsum(flown) - 1, NO_LEG))
        return replace(self, legs=legs, routes=routes)


def build_network(mission: Mission) -> Network:
    """The network of a mission: its places, and all legs and routes with at most one building."""
    obstacles = prisms(mission)
    places = build_places(mission, obstacles)
    legs = build_legs(mission, places, obstacles, *one_stop_legs(len(mission.buildings)))
    return Network(mission, places, legs, build_routes(legs, places))


def trajectory_routes(network: Network, name: Trajectory, order: Order | None = None) -> Integers:
    """Numbers of the flyable routes that a trajectory may use, in one order or in both.

    The trajectory ``"direct"`` has no stop, ``"traj1"`` goes by the building nearest the device,
    ``"traj2"`` is the shortest in time by one building (several where they tie), ``"optimal"`` is
    any.
    """
    routes = network.routes
    usable, rests = routes.flyable, routes.building >= 0
    if order is not None:
        usable = usable & (~rests | (routes.rest_first == (order == "rest-first")))
    if name == "direct":
        usable = usable & ~rests
    elif name == "traj1":
        usable = usable & rests & (routes.building == nearest_building(network))
    elif name == "traj2":
        usable = usable & rests
        if usable.any():
            usable &= routes.flight_time_s <= routes.flight_time_s[usable].min() + SAME_S
    return np.flatnonzero(usable)


def nearest_building(network: Network) -> int:
    """Number of the building nearest the device, −1 if the mission has none."""
    roofs = network.places.position_m[network.places.buildings]
    if not len(roofs):
        return -1
    device_m = np.array(network.mission.link.device_m)
    return int(np.argmin(((roofs - device_m) ** 2).sum(axis=1)))
