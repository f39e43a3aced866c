"""Which of several plans is the best, and when two are equally good."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

SAME_S = 1e-6
"""Times that differ by no more than this are equal [s]."""


def best(
    hover_time_s: npt.ArrayLike,
    mission_time_s: npt.ArrayLike,
    stops: npt.ArrayLike,
) -> int | None:
    """Number of the best plan, or None if there is none.

    The longest hover wins; among equals (to 1e-6 s) the shortest mission, then the fewest stops,
    then the earliest in the list.

    Parameters
    ----------
    hover_time_s, mission_time_s
        Δ and T of every plan [s]; NaN where there is no plan.
    stops
        Number of stops of every plan.
    """
    hover, mission = np.asarray(hover_time_s, float), np.asarray(mission_time_s, float)
    if not np.isfinite(hover).any():
        return None
    tied = hover >= np.nanmax(hover) - SAME_S
    tied &= mission <= np.min(mission, where=tied, initial=np.inf) + SAME_S
    fewest = np.where(tied, np.asarray(stops, float), np.inf)
    return int(np.argmin(fewest))
