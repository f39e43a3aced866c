"""The network of a mission as arrays: its places, legs and routes, and the trajectories over it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from optuav.arrays import Integers
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.network.legs import NO_LEG, Legs, build_legs
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN, Places, build_places
from optuav.network.prisms import prisms
from optuav.network.routes import Routes, build_routes


@dataclass(frozen=True, eq=False)
class Network:
    """The places and legs of a mission, and the routes over them."""

    mission: Mission
    # Tables of arrays, which refer to each other by number.
    places: Places
    legs: Legs
    routes: Routes

    def route_names(self, route: int) -> tuple[str, ...]:
        """Names of the places of a route in flight order."""
        flown = [int(leg) for leg in self.routes.legs[route] if leg != NO_LEG]
        names = self.places.names
        return (names[self.legs.start[flown[0]]], *(names[self.legs.end[leg]] for leg in flown))

    def only(self, which: Sequence[int] | Integers) -> "Network":
        """Return the network with some of its routes, and only the legs and places that they use.

        Routes, legs and places are numbered anew; the ends stay.
        """
        routes, places, table = self.routes.take(which), self.places, self.legs
        flown, building = routes.legs != NO_LEG, np.unique(routes.building)
        kept = np.append(np.arange(FIRST_BUILDING), places.on(building[building >= 0]))
        used, number = np.unique(routes.legs[flown], return_inverse=True)
        numbers = np.full(routes.legs.shape, NO_LEG)
        numbers[flown] = number
        start, end = (np.searchsorted(kept, ends[used]) for ends in (table.start, table.end))
        legs = replace(table.take(used), start=start, end=end)
        routes = replace(routes, legs=numbers)
        return replace(self, places=places.take(kept), legs=legs, routes=routes)


@lru_cache(maxsize=1)
def build_network(mission: Mission) -> Network:
    """The network of a mission: its places, and all legs and routes with at most one building.

    Legs 0 and 1 are origin → hover and hover → destination; legs 2 + 4 b to 5 + 4 b belong to
    building b: origin → b, b → hover, hover → b, b → destination. The last network is kept.
    """
    if mission.buildings.source and mission.buildings.lacking:
        words = "the table itself is needed; the plan has only the buildings that it uses"
        raise InputError([Fault("buildings_file", "", words)])
    places = build_places(mission)
    return network_by(mission, places, np.arange(len(mission.buildings)))


def network_by(mission: Mission, places: Places, buildings: Integers) -> Network:
    """The network of a mission with only the routes by way of some buildings, by number."""
    roof = FIRST_BUILDING + buildings
    ways = np.array([(ORIGIN, -1), (-1, HOVER), (HOVER, -1), (-1, DESTINATION)])  # −1 for its roof
    by_roof = np.where(ways < 0, roof[:, None, None], ways).reshape(-1, 2)
    start, end = np.concatenate([[(ORIGIN, HOVER), (HOVER, DESTINATION)], by_roof]).T
    legs = build_legs(mission, places, prisms(mission.buildings), start, end)
    routes = build_routes(legs, buildings)
    for array in (var for table in (places, legs, routes) for var in vars(table).values()):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)  # All who ask for an equal mission share it
    return Network(mission, places, legs, routes)
