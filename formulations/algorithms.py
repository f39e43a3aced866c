"""Algorithms 1 and 2 of the paper as printed: every pair of whole slots, and the best building."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats

SLOT_TOLERANCE = 1e-9
"""State of charge [-] and slots [-] by which rounding may miss a limit that is met exactly."""


def algorithm1(
    soc_end: Callable[[float, float], float],
    time_left_s: float,
    min_soc: float,
    slot_s: float = 1.0,
) -> tuple[Floats, Floats]:
    """Tables Δ_ov and T'_ov [s]: row k, column l belong to T' = k + 1 and Δ = l + 1 slots.

    A cell is 0 where the pair is not feasible: the state of charge at the end, a function of Δ and
    T' [s], is below η0, or both exceed the time left, T_max − T_fl [s]. The paper's slot is 1 s.
    """
    slots = max(0, int(np.floor(time_left_s / slot_s * (1.0 + SLOT_TOLERANCE))))
    hover_table = np.zeros((slots, slots))
    rest_table = np.zeros((slots, slots))
    for rest in range(1, slots + 1):
        for hover in range(1, slots - rest + 1):
            if soc_end(hover * slot_s, rest * slot_s) >= min_soc - SLOT_TOLERANCE:
                hover_table[rest - 1, hover - 1] = hover * slot_s
                rest_table[rest - 1, hover - 1] = rest * slot_s
    return hover_table, rest_table


def best_pair(tables: tuple[Floats, Floats]) -> tuple[float, float] | None:
    """(Δ_opt, T'_opt) [s], lines 11-12 of Algorithm 1; None where no pair is feasible."""
    hover_table, rest_table = tables
    if not hover_table.any():
        return None
    cell = np.unravel_index(int(hover_table.argmax()), hover_table.shape)
    return float(hover_table[cell]), float(rest_table[cell])


class Choice(NamedTuple):
    """Result of Algorithm 2."""

    hover_time_s: float
    # None for the direct flight.
    rest_time_s: float | None
    building: int | None  # Number of the building from 0


def algorithm2(direct_s: float, resting_s: Sequence[tuple[float, float] | None]) -> Choice:
    """Choose as lines 8-13 of Algorithm 2 do: of equal plans the resting one.

    From Δ_1 of (P3) [s], and for every building what Algorithm 1 returns.
    """
    rests = [Choice(*pair, b) for b, pair in enumerate(resting_s) if pair is not None]
    longest = max(rests, key=lambda choice: choice.hover_time_s, default=None)
    if longest is None or direct_s > longest.hover_time_s:
        return Choice(direct_s, None, None)
    return longest
