"""(P1) with several rests and hovers, in any order over all places: mission in, plan out."""

from __future__ import annotations

import numpy as np

from optuav.mission import vehicle
from optuav.mission.legs import Legs, all_pairs, legs_between
from optuav.mission.network import Network
from optuav.mission.phases import hover_net, rest_net
from optuav.mission.places import FIRST_BUILDING, HOVER
from optuav.mission.sight import Points, prisms
from optuav.search.terrain import Terrain


def all_legs(worked_out: Network) -> Legs:
    """The legs between any two places of a mission."""
    where = worked_out.places
    pairs = all_pairs(len(where.names))
    return legs_between(worked_out.mission, where, prisms(worked_out.mission), *pairs)


def terrain(worked_out: Network, table: Legs) -> Terrain:
    """What a search knows of a mission.

    Parameters
    ----------
    worked_out
        The mission's places.
    table
        Legs between them; there is none where the table has none, or none that can be flown.
    """
    mission, where = worked_out.mission, worked_out.places
    places = len(where.names)

    def square(figures: Points, absent: float) -> Points:
        filled = np.full((*figures.shape[:-1], places, places), absent)
        filled[..., table.start, table.end] = np.where(table.flyable, figures, absent)
        return filled

    stay_current_A = np.zeros(places)
    stay_current_A[HOVER] = hover_net(worked_out).current_A
    buildings = np.arange(places - FIRST_BUILDING)
    stay_current_A[FIRST_BUILDING:] = rest_net(worked_out, buildings).current_A
    pool = vehicle.pool(mission)
    return Terrain(
        pool,
        mission.limits.deadline_s,
        mission.limits.min_soc * float(pool.capacity_As),
        square(table.duration_s, np.inf),
        square(table.durations_s, 0.0),
        square(table.currents_A, 0.0),
        stay_current_A,
    )
