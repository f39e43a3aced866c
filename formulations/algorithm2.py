"""Algorithm 2 of the paper: the best of the direct flight and of a rest on any building."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

SAME_S = 1e-6
"""Times that differ by no more than this are equal [s]."""


@dataclass(frozen=True)
class Choice:
    """What the printed algorithm returns.

    Parameters
    ----------
    hover_time_s
        Δ [s].
    rest_time_s
        T' [s]; None for the direct flight.
    building
        Number of the building from 0; None for the direct flight.
    """

    hover_time_s: float
    rest_time_s: float | None
    building: int | None


def algorithm2_as_printed(
    direct_s: float, resting_s: Sequence[tuple[float, float] | None]
) -> Choice:
    """Choose as lines 8-13 of the algorithm do: the resting plan wins a tie.

    Parameters
    ----------
    direct_s
        Δ_1 of (P3) [s].
    resting_s
        For every building what Algorithm 1 returns, (Δ, T') [s] or None.
    """
    hovers = [0.0 if pair is None else pair[0] for pair in resting_s]
    if not hovers or direct_s > max(hovers):
        return Choice(direct_s, None, None)
    building = int(np.argmax(hovers))
    pair = resting_s[building]
    return Choice(hovers[building], 0.0 if pair is None else pair[1], building)


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
