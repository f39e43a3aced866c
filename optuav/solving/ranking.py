"""The best of several answers, and those that tie with it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from optuav.arrays import Floats, Integers
from optuav.status import SAME_S


def best(
    score: npt.ArrayLike,
    mission_time_s: npt.ArrayLike,
    stops: npt.ArrayLike,
    ties: npt.ArrayLike = SAME_S,
) -> int | None:
    """Number of the plan with the best score, then the shortest mission, then the fewest stops.

    It is the first of plans that tie: scores within what the best one says, missions to 1e-6 s. The
    score, such as the hover time [s], and the mission time are NaN without a plan.
    """
    scores, mission_s = np.asarray(score, float), np.asarray(mission_time_s, float)
    if np.isnan(scores).all():
        return None
    first = int(np.nanargmax(scores))
    (plans,) = (scores >= scores[first] - np.broadcast_to(ties, scores.shape)[first]).nonzero()
    missions_s = mission_s[plans]
    plans = plans[missions_s <= missions_s.min() + SAME_S]
    return int(plans[np.asarray(stops)[plans].argmin()])


def tied(group: Integers, figures: Floats, ties: Floats | float = SAME_S) -> Integers:
    """Numbers of those in groups that lie together whose figures tie with the least."""
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    if len(starts) == len(group):
        return starts
    sizes = np.diff(starts, append=len(group))
    least = np.minimum.reduceat(figures, starts).repeat(sizes)
    of_least = np.where(figures == least, ties, 0.0)
    within = np.maximum.reduceat(of_least, starts).repeat(sizes)
    return np.flatnonzero(figures <= least + within)
