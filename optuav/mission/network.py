"""A mission worked out: its places, legs and itineraries."""

from __future__ import annotations

from dataclasses import dataclass

from optuav.mission.itineraries import NO_LEG, Itineraries, itineraries
from optuav.mission.legs import Legs, legs
from optuav.mission.places import Places, places
from optuav.mission.schema import Mission
from optuav.mission.sight import prisms


@dataclass(frozen=True)
class Network:
    """Places and legs of a mission, and the itineraries over them.

    Parameters
    ----------
    mission
        What was worked out.
    places, legs, itineraries
        Tables of arrays, which refer to each other by number.
    """

    mission: Mission
    places: Places
    legs: Legs
    itineraries: Itineraries

    def route_names(self, route: int) -> tuple[str, ...]:
        """Names of the places of an itinerary in the order in which they are reached."""
        flown = [int(leg) for leg in self.itineraries.legs[route] if leg != NO_LEG]
        names = self.places.names
        return (names[self.legs.start[flown[0]]], *(names[self.legs.end[leg]] for leg in flown))


def network(mission: Mission) -> Network:
    """Work out places, legs and itineraries of a mission."""
    obstacles = prisms(mission)
    where = places(mission, obstacles)
    table = legs(mission, where, obstacles)
    return Network(mission, where, table, itineraries(table, where))
