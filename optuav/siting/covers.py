"""The sites with which the demand that gets least gets most.

Sites that give every demand at least some level are a set cover; the highest level for which there
is one of so many sites is found by halving.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.siting.heuristics import best_of, greedy
from optuav.siting.highs import run, solver_with

Cover: TypeAlias = Callable[[Booleans], tuple[int, ...] | None]
"""Sites that cover all demands (demand, site); none where there are none, None if not known."""


def most_for_the_least(
    worth: Floats, chosen: Sequence[int], cover: Cover, gap: float = 0.0
) -> tuple[tuple[int, ...], float]:
    """Sites that give every demand as much as can be, and what no choice gives every demand.

    The sites give no less than those chosen. The search ends within the relative gap, or where
    `cover` does not know; the bound is as true as what it says.
    """
    best, value = tuple(chosen), float(best_of(worth, chosen).min())
    ceiling = worth.max(axis=1).min()
    levels = np.unique(worth[(worth > value) & (worth <= ceiling)])
    while len(levels) and levels[-1] > (1.0 + gap) * value:
        level = levels[len(levels) // 2]
        found = cover(worth >= level)
        if found is None:
            break
        if found:
            best, value = found, float(best_of(worth, found).min())
        levels = levels[levels > value] if found else levels[levels < level]
    return best, float(levels[-1]) if len(levels) else value


def by_greedy(count: int) -> Cover:
    """Covers by up to `count` sites that the greedy choice finds."""

    def cover(covers: Booleans) -> tuple[int, ...]:
        table = covers.astype(float)
        found = greedy(table, np.ones(len(table)), count)
        return found if best_of(table, found).all() else ()

    return cover


def by_programme(count: int, latest: float) -> Cover:
    """Covers by up to `count` sites, sought by HiGHS up to a time of `time.monotonic` [s]."""
    import highspy

    def cover(covers: Booleans) -> tuple[int, ...] | None:
        from scipy import sparse

        rows = sparse.csr_array(np.unique(covers, axis=0).astype(float))
        demands, sites = rows.shape
        solver = solver_with()
        columns = np.arange(sites, dtype=np.int32)
        solver.addVars(sites, np.zeros(sites), np.ones(sites))
        whole = np.full(sites, highspy.HighsVarType.kInteger)
        solver.changeColsIntegrality(sites, columns, whole)
        solver.addRow(-math.inf, float(count), sites, columns, np.ones(sites))
        ends = np.ones(demands), np.full(demands, math.inf)
        start, index = rows.indptr[:-1].astype(np.int32), rows.indices.astype(np.int32)
        solver.addRows(demands, *ends, rows.nnz, start, index, rows.data)
        if not run(solver, latest):
            return None
        if solver.getModelStatus() == highspy.HighsModelStatus.kInfeasible:
            return ()
        if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return None
        opened = np.array(solver.getSolution().col_value) > 0.5
        assert covers[:, opened].any(axis=1).all()
        return tuple(np.flatnonzero(opened).tolist())

    return cover
