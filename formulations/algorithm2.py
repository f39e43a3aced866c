"""Algorithm 2 of the paper as printed: the direct flight, or a rest on the best building."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Choice(NamedTuple):
    """What the algorithm returns.

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


def algorithm2(direct_s: float, resting_s: Sequence[tuple[float, float] | None]) -> Choice:
    """Choose as lines 8-13 of the algorithm do: of equal plans the resting one.

    Parameters
    ----------
    direct_s
        Δ_1 of (P3) [s].
    resting_s
        For every building what Algorithm 1 returns, (Δ, T') [s] or None.
    """
    rests = [Choice(*pair, b) for b, pair in enumerate(resting_s) if pair is not None]
    longest = max(rests, key=lambda choice: choice.hover_time_s, default=None)
    if longest is None or direct_s > longest.hover_time_s:
        return Choice(direct_s, None, None)
    return longest
