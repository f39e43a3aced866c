"""A mission with legs between any two places: sequences of stops, and the terrain of a search."""

from __future__ import annotations

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.network import vehicle
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG, Routes
from optuav.network.timeline import hover_net, rest_net
from optuav.search.terrain import Terrain


def terrain(network: Network) -> Terrain:
    """What a search knows of a mission; there is no way where it has no leg that can be flown."""
    mission, table = network.mission, network.legs
    places = len(network.places.names)

    def square(figures: Floats, absent: float) -> Floats:
        filled = np.full((*figures.shape[:-1], places, places), absent)
        filled[..., table.start, table.end] = np.where(table.flyable, figures, absent)
        return filled

    stay_current_A = np.zeros(places)
    stay_current_A[HOVER] = hover_net(network).current_A
    buildings = np.arange(places - FIRST_BUILDING)
    stay_current_A[FIRST_BUILDING:] = rest_net(network, buildings).current_A
    pool = vehicle.pool(mission)
    return Terrain(
        pool,
        mission.limits.deadline_s,
        mission.limits.min_soc * float(pool.capacity_As),
        square(table.duration_s, np.inf),
        square(table.durations_s, 0.0),
        square(table.currents_A, 0.0),
        stay_current_A,
        mission.battery.charging == "taper",
    )


def ways(network: Network, places: Integers, building: Integers) -> Routes:
    """Sequences of places as itineraries over a table of legs.

    Parameters
    ----------
    network
        Its legs lead between any two places.
    places
        Numbers of the places (place, sequence), −1 behind the last of a sequence.
    building
        Number of the building that each rests on (sequence,), −1 for none.
    """
    table = network.legs
    number = np.full((len(network.places.names),) * 2, NO_LEG, dtype=np.intp)
    number[table.start, table.end] = np.arange(len(table.start))
    legs = np.where(places[1:] >= 0, number[places[:-1], places[1:]], NO_LEG).T
    flown = legs != NO_LEG

    def total(per_leg: Floats) -> Floats:
        sums: Floats = np.where(flown, per_leg[legs], 0.0).sum(axis=1)
        return sums

    hovers_first = (places == HOVER).argmax(axis=0)
    rests_first = (places == FIRST_BUILDING + building).argmax(axis=0)
    return Routes(
        legs,
        building,
        (building >= 0) & (rests_first < hovers_first),
        np.asarray(np.where(flown, table.flyable[legs], True).all(axis=1)),
        total(table.duration_s),
        total(table.charge_As),
        total(table.energy_J),
    )
