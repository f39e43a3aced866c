"""Algorithm 1 of the paper as printed: every pair of whole slots, one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

SocEnd = Callable[[float, float], float]
"""State of charge at the end [-] after hovering and resting [s]."""

Table = npt.NDArray[np.float64]

TOLERANCE = 1e-9
"""State of charge [-] and slots [-] by which rounding may miss a limit that is met exactly."""


def algorithm1(
    soc_end: SocEnd, time_left_s: float, min_soc: float, slot_s: float = 1.0
) -> tuple[Table, Table]:
    """Tables Δ_ov and T'_ov [s] of the algorithm.

    Parameters
    ----------
    soc_end
        State of charge at the end of the mission.
    time_left_s
        T_max − T_fl [s].
    min_soc
        η0 [-].
    slot_s
        Length of a slot [s], > 0; the paper's is 1 s.

    Returns
    -------
    Two square tables [s]; row k, column l belong to T' = k + 1 and Δ = l + 1 slots. A cell is 0
    where the pair is not feasible.
    """
    slots = max(0, int(np.floor(time_left_s / slot_s * (1.0 + TOLERANCE))))
    hover_table = np.zeros((slots, slots))
    rest_table = np.zeros((slots, slots))
    for rest in range(1, slots + 1):
        for hover in range(1, slots - rest + 1):
            if soc_end(hover * slot_s, rest * slot_s) >= min_soc - TOLERANCE:
                hover_table[rest - 1, hover - 1] = hover * slot_s
                rest_table[rest - 1, hover - 1] = rest * slot_s
    return hover_table, rest_table


def best_pair(tables: tuple[Table, Table]) -> tuple[float, float] | None:
    """(Δ_opt, T'_opt) [s], lines 11-12 of the algorithm; None where no pair is feasible."""
    hover_table, rest_table = tables
    if not hover_table.any():
        return None
    cell = np.unravel_index(int(hover_table.argmax()), hover_table.shape)
    return float(hover_table[cell]), float(rest_table[cell])
