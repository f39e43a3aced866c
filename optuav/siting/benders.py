"""The sites with the largest total, by HiGHS.

With y_j = 1 where site j is chosen and θ_i for what demand i gets, the largest Σ w_i θ_i where
θ_i ≤ u + Σ_j (h_ij − u)⁺ y_j for all levels u among its worths. Few of these rows are needed: those
next to the multipliers of `optuav.siting.bounds`, and those that a solution violates. They are the
Benders cuts of [1]_; for demands that are covered or not, one covering row each.

References
----------
.. [1] C. Duran-Mateluna, Z. Ales and S. Elloumi, "An efficient Benders decomposition for the
   p-median problem", European Journal of Operational Research 308, 2023.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.errors import SolverError
from optuav.siting.heuristics import best_of, interchange, total
from optuav.siting.highs import run, solver_with

VIOLATED = 1e-6  # Relative; by how much a row has to be broken to be added
SETTLED = 1e-5  # Relative; rounds that lower the relaxation by less are the last


def most_in_total(
    worth: Floats,
    weights: Floats,
    count: int,
    levels: Floats,
    chosen: Sequence[int],
    gap: float,
    latest: float,
) -> tuple[tuple[int, ...], float]:
    """Up to `count` sites with a large total, and what no such choice exceeds.

    The search starts from sites chosen, and ends within the relative gap or at the time `latest` of
    `time.monotonic` [s].

    Raises
    ------
    SolverError
        If the solver states a bound that a choice exceeds.
    """
    import highspy

    demands, sites = worth.shape
    most, every = best_of(worth, range(sites)), np.arange(demands)
    solver = solver_with(mip_rel_gap=gap, mip_abs_gap=0.0, mip_heuristic_effort=0.0)
    solver.addVars(sites + demands, np.zeros(sites + demands), np.r_[np.ones(sites), most])
    columns = np.arange(sites + demands, dtype=np.int32)
    solver.changeColsCost(len(columns), columns, np.r_[np.zeros(sites), weights])
    solver.changeObjectiveSense(highspy.ObjSense.kMaximize)
    solver.addRow(-math.inf, float(count), sites, columns[:sites], np.ones(sites))

    def add(which: Integers, level: Floats) -> None:
        """Add the rows of some demands at one level each."""
        from scipy import sparse

        above = sparse.csr_array(-np.maximum(worth[which] - level[:, None], 0.0))
        ones = np.ones(len(which)), which, np.arange(len(which) + 1)
        own = sparse.csr_array(ones, shape=(len(which), demands))
        rows = sparse.hstack([above, own], format="csr")
        ends = np.full(len(which), -math.inf), np.asarray(level, dtype=float)
        start, index = rows.indptr[:-1].astype(np.int32), rows.indices.astype(np.int32)
        solver.addRows(len(which), *ends, rows.nnz, start, index, rows.data)

    below = np.where(worth < levels[:, None], worth, 0.0).max(axis=1)
    next_up = np.where(worth >= levels[:, None], worth, math.inf).min(axis=1)
    add(every, below)
    between = np.flatnonzero((next_up > below) & (next_up < most))
    add(between, next_up[between])
    order = np.argsort(-worth, axis=1, kind="stable")

    def violated(solution: Floats) -> tuple[Integers, Floats]:
        """The demands that get more than a row admits, and the levels of these rows."""
        opened = solution[:sites]
        reached = np.cumsum(opened[order], axis=1) >= 1.0 - 1e-9
        at = np.where(reached.any(axis=1), reached.argmax(axis=1), -1)
        level = np.where(at < 0, 0.0, worth[every, order[every, at]])
        admitted = level + np.maximum(worth - level[:, None], 0.0) @ opened
        which = np.flatnonzero(solution[sites:] > admitted + VIOLATED * np.maximum(1.0, admitted))
        return which, level[which]

    # Of demands that are covered or not, all rows are there; else more of them are found on the
    # relaxation, which is solved again from where it was.
    more, relaxed = bool(((worth > 0.0) & (worth < most[:, None])).any()), math.inf
    while more and run(solver, latest):
        if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            break
        before, relaxed = relaxed, solver.getInfo().objective_function_value
        which, level = violated(np.array(solver.getSolution().col_value))
        if not len(which) or before - relaxed <= SETTLED * relaxed:
            break
        add(which, level)
    whole = np.full(sites, highspy.HighsVarType.kInteger)
    solver.changeColsIntegrality(sites, columns[:sites], whole)
    best, value, bound = tuple(chosen), total(worth, weights, chosen), math.inf
    while bound > (1.0 + gap) * value:
        start = highspy.HighsSolution()
        start.col_value = [*np.isin(columns[:sites], best).astype(float), *best_of(worth, best)]
        solver.setSolution(start)
        if not run(solver, latest):
            break
        bound, which = min(bound, solver.getInfo().mip_dual_bound), every[:0]
        solution = np.array(solver.getSolution().col_value)
        if solver.getInfo().primal_solution_status:
            opened = np.flatnonzero(solution[:sites] > 0.5).tolist()
            again = interchange(worth, weights, opened)
            if (reached := total(worth, weights, again)) > value:
                best, value = again, reached
            solution[:sites] = solution[:sites].round()
            which, level = violated(solution)
        if bound < (1.0 - VIOLATED) * value:
            raise SolverError(f"HiGHS bounds by {bound:.9g} what a choice exceeds: {value:.9g}")
        if not len(which):
            break
        add(which, level)
    return best, bound
