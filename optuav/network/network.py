"""A mission worked out: its places, legs and itineraries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from optuav.arrays import Integers
from optuav.mission.schema import Mission
from optuav.network.legs import Legs, legs
from optuav.network.obstacles import prisms
from optuav.network.places import DESTINATION, FIRST_BUILDING, ORIGIN, Places, places
from optuav.network.routes import NO_LEG, Order, Routes, itineraries

if TYPE_CHECKING:
    import networkx


@dataclass(frozen=True)
class Network:
    """Places and legs of a mission, and the itineraries over them.

    Parameters
    ----------
    mission
        What was worked out.
    places, legs, routes
        Tables of arrays, which refer to each other by number.
    """

    mission: Mission
    places: Places
    legs: Legs
    routes: Routes

    def route_names(self, route: int) -> tuple[str, ...]:
        """Names of the places of an itinerary in the order in which they are reached."""
        flown = [int(leg) for leg in self.routes.legs[route] if leg != NO_LEG]
        names = self.places.names
        return (names[self.legs.start[flown[0]]], *(names[self.legs.end[leg]] for leg in flown))


def build_network(mission: Mission) -> Network:
    """Work out places, legs and itineraries of a mission."""
    obstacles = prisms(mission)
    where = places(mission, obstacles)
    table = legs(mission, where, obstacles)
    return Network(mission, where, table, itineraries(table, where))


State = tuple[int, str]
START: State = (ORIGIN, "")
GOAL: State = (DESTINATION, "")

Trajectory = Literal["optimal", "direct", "traj1", "traj2"]
TRAJECTORIES: tuple[Trajectory, ...] = ("optimal", "direct", "traj1", "traj2")

SAME_S = 1e-6
"""Flight times that differ by no more than this are equal [s]."""


def trajectory_routes(
    worked_out: Network, name: Trajectory, order: Order | None = None
) -> Integers:
    """Numbers of the flyable itineraries that a trajectory may use.

    Parameters
    ----------
    worked_out
        Places, legs and itineraries.
    name
        ``"direct"``; ``"traj1"``, by way of the building nearest the device; ``"traj2"``, the
        shortest in time by way of one building (several where they tie); ``"optimal"``, all.
    order
        Only resting first or hovering first; both by default.
    """
    routes = worked_out.routes
    usable = routes.flyable.copy()
    by_way = routes.building >= 0
    if order is not None:
        usable &= ~by_way | (routes.rest_first == (order == "rest-first"))
    if name == "direct":
        usable &= ~by_way
    elif name == "traj1":
        usable &= by_way & (routes.building == nearest_building(worked_out))
    elif name == "traj2":
        usable &= np.isin(
            np.arange(len(routes)), list(_shortest(worked_out, np.flatnonzero(usable & by_way)))
        )
    return np.flatnonzero(usable)


def nearest_building(worked_out: Network) -> int:
    """Number of the building nearest the device, −1 if the mission has none."""
    roofs = worked_out.places.position_m[worked_out.places.buildings]
    if not len(roofs):
        return -1
    device_m = np.array(worked_out.mission.link.device_m)
    return int(np.argmin(((roofs - device_m) ** 2).sum(axis=1)))


def _shortest(worked_out: Network, usable: Integers) -> set[int]:
    """Of some itineraries by way of a building, the shortest in time (several where they tie)."""
    import networkx

    layers: networkx.DiGraph[State] = networkx.DiGraph()
    layers.add_nodes_from([START, GOAL])
    reached: dict[State, int] = {}
    routes, table = worked_out.routes, worked_out.legs
    duration_s = table.duration_s
    for index in usable.tolist():
        side = "before" if routes.rest_first[index] else "after"
        for leg in routes.legs[index]:
            tail, head = _state(int(table.start[leg]), side), _state(int(table.end[leg]), side)
            layers.add_edge(tail, head, duration_s=float(duration_s[leg]))
        reached[FIRST_BUILDING + int(routes.building[index]), side] = index
    shortest = networkx.single_source_dijkstra_path_length
    reach_s = shortest(layers, START, weight="duration_s")
    leave_s = shortest(layers.reverse(copy=False), GOAL, weight="duration_s")
    if GOAL not in reach_s:
        return set()
    return {
        index
        for state, index in reached.items()
        if reach_s[state] + leave_s[state] <= reach_s[GOAL] + SAME_S
    }


def _state(place: int, side: str) -> State:
    """A place on the way with the building before hovering, or after; the ends are shared."""
    return (place, side) if place not in (ORIGIN, DESTINATION) else (place, "")
