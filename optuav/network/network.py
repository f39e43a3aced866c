"""The network of a mission as arrays: its places, legs and routes, and the trajectories over it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from optuav.arrays import Integers
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.network.legs import NO_LEG, Legs, build_legs
from optuav.network.places import DESTINATION, ORIGIN, Places, build_places
from optuav.network.prisms import prisms
from optuav.network.routes import Routes, build_routes, leg_ends


@dataclass(frozen=True, eq=False)
class Network:
    """The places and legs of a mission, and the routes over them."""

    mission: Mission
    # Tables of arrays, which refer to each other by number.
    places: Places
    legs: Legs
    routes: Routes

    @property
    def buildings(self) -> Integers:
        """Numbers of the buildings that its routes go by, rising."""
        building = np.unique(self.routes.building)
        return building[building >= 0]

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
        flown = routes.legs != NO_LEG
        on = places.on(replace(self, routes=routes).buildings)
        kept = np.append(np.arange(places.first_building), on)
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

    Legs are numbered as in `leg_ends`. With one device, 0 and 1 are origin → hover and hover →
    destination, and 2 + 4 b to 5 + 4 b belong to building b: origin → b, b → hover, hover → b, b →
    destination. Routes hover over several devices in the mission's order. The last network is kept.
    """
    if mission.buildings.source and mission.buildings.lacking:
        words = "the table itself is needed; the plan has only the buildings that it uses"
        raise InputError([Fault("buildings_file", "", words)])
    places = build_places(mission)
    return network_by(mission, places, np.arange(len(mission.buildings)))


def network_by(mission: Mission, places: Places, buildings: Integers) -> Network:
    """The network of a mission with only the routes by way of some buildings, by number."""
    roofs = places.first_building + buildings
    start, end = leg_ends(places.hovers, (ORIGIN, DESTINATION), roofs)
    legs = build_legs(mission, places, prisms(mission.buildings), start, end)
    routes = build_routes(legs, buildings, np.arange(len(places.hovers))[None])
    for array in (var for table in (places, legs, routes) for var in vars(table).values()):
        if isinstance(array, np.ndarray):
            array.setflags(write=False)  # All who ask for an equal mission share it
    return Network(mission, places, legs, routes)
