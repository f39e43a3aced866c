"""A mission worked out: its places, legs and itineraries."""

from __future__ import annotations

from dataclasses import dataclass

from optuav.mission.itineraries import Itineraries, itineraries
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


def network(mission: Mission) -> Network:
    """Work out places, legs and itineraries of a mission."""
    obstacles = prisms(mission)
    where = places(mission, obstacles)
    table = legs(mission, where, obstacles)
    return Network(mission, where, table, itineraries(table, where))
