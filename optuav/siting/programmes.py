"""The sites with the largest total, and the sites with the largest minimum, by HiGHS.

References
----------
.. [1] C. Duran-Mateluna, Z. Ales and S. Elloumi, "An efficient Benders decomposition for the
   p-median problem", European Journal of Operational Research 308, 2023.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import SolverError
from optuav.presentation.numbers import figure
from optuav.silence import silent
from optuav.siting.heuristics import best_of, interchange, total

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult
    from scipy.sparse import csr_array

SOLVER_ACCURACY = 1e-6  # Relative; the solver's values may be off by this
LEAST_S = 0.01  # With less time left nothing is begun [s]
INFEASIBLE = 2  # Status of a programme without a solution


def most_in_total(
    worth: Floats,
    weights: Floats,
    count: int,
    levels: Floats,
    chosen: Sequence[int],
    gap: float,
    latest: float,
) -> tuple[tuple[int, ...], float]:
    """Up to `count` sites with a larger total than those chosen, and what no such choice exceeds.

    With y_j = 1 where site j is chosen and θ_i for what demand i gets, the largest Σ w_i θ_i where
    θ_i ≤ u + Σ_j (h_ij − u)⁺ y_j for all levels u among its worths, the Benders cuts of [1]_. Few
    of these rows are needed: those for the levels next to the given ones, and those that a solution
    violates, then solved again. The search ends within the relative gap or at the time
    `latest` of `time.monotonic` [s].

    Raises
    ------
    SolverError
        If the solver states a bound that a choice exceeds.
    """
    from scipy import sparse

    (demands, sites), value = worth.shape, partial(total, worth, weights)
    rows_at, most = _next_to(levels, worth), worth.max(axis=1)
    best, bound = tuple(chosen), math.inf
    while bound > (1.0 + gap) * value(best):
        which, level = map(np.array, zip(*sorted(rows_at), strict=True))
        above = sparse.csr_array(np.maximum(worth[which] - level[:, None], 0.0))
        ones = np.ones(len(which)), which, np.arange(len(which) + 1)
        rows = sparse.hstack([above, -sparse.csr_array(ones, shape=(len(which), demands))])
        answer = _solved(count, sites, rows, -level, weights, most, gap, latest)
        if answer is None or answer.x is None:
            break
        opened = np.flatnonzero(answer.x[:sites] > 0.5).tolist()
        best = max(best, interchange(worth, weights, opened), key=value)
        bound = min(bound, -float(answer.mip_dual_bound))
        if bound < (1.0 - SOLVER_ACCURACY) * value(best):
            raise SolverError(f"HiGHS gives the bound {figure(bound, 9)}, but a choice exceeds it")
        reached = best_of(worth, opened)
        beyond = np.flatnonzero(answer.x[sites:] > (1.0 + SOLVER_ACCURACY) * reached)
        if not (more := {*zip(beyond.tolist(), reached[beyond].tolist(), strict=True)} - rows_at):
            break
        rows_at |= more
    return best, bound


def _next_to(levels: Floats, worth: Floats) -> set[tuple[int, float]]:
    """Demands, each with the levels among its worths that are next to the given one."""
    below = np.where(worth < levels[:, None], worth, 0.0).max(axis=1)
    above = np.where(worth >= levels[:, None], worth, math.inf).min(axis=1)
    inside = np.flatnonzero((above > below) & (above < worth.max(axis=1)))
    pairs = {*enumerate(below.tolist())}
    return pairs | {*zip(inside.tolist(), above[inside].tolist(), strict=True)}


def most_for_the_least(
    worth: Floats, count: int, chosen: Sequence[int], gap: float, latest: float
) -> tuple[tuple[int, ...], float]:
    """Sites with the largest minimum over demands, and a bound on that minimum.

    Sites that give every demand at least some level are a set cover. The highest level with a
    cover of up to `count` sites is found by halving, from the least that sites chosen give.
    The search ends like `most_in_total`.
    """
    best, value = tuple(chosen), float(best_of(worth, chosen).min())
    ceiling = worth.max(axis=1).min()
    levels = np.unique(worth[(worth > value) & (worth <= ceiling)])
    while len(levels) and levels[-1] > (1.0 + gap) * value:
        level = levels[len(levels) // 2]
        cover = _cover(worth >= level, count, latest)
        if cover is None:
            break
        if cover:
            best, value = cover, float(best_of(worth, cover).min())
        levels = levels[levels > value] if cover else levels[levels < level]
    return best, float(levels[-1]) if len(levels) else value


def _cover(covers: Booleans, count: int, latest: float) -> tuple[int, ...] | None:
    """Up to `count` sites that cover all demands; empty if none exist, None if not known."""
    from scipy import sparse

    rows = sparse.csr_array(np.unique(covers, axis=0).astype(float))
    nothing, at_least = np.empty(0), np.ones(rows.shape[0])
    answer = _solved(count, covers.shape[1], rows, at_least, nothing, nothing, 0.0, latest)
    if answer is None or (answer.x is None and answer.status != INFEASIBLE):
        return None
    opened = [] if answer.x is None else np.flatnonzero(answer.x > 0.5).tolist()
    assert not opened or covers[:, opened].any(axis=1).all()
    return tuple(opened)


@silent()
def _solved(
    count: int,
    sites: int,
    rows: csr_array,
    at_least: Floats,
    gains: Floats,
    most: Floats,
    gap: float,
    latest: float,
) -> OptimizeResult | None:
    """Up to `count` sites where rows are large enough, by HiGHS; None without time.

    After the sites come numbers, up to the `most`; their sum with the gains is maximised.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    if (left_s := latest - time.monotonic()) < LEAST_S:
        return None
    whole = np.r_[np.ones(sites), np.zeros(len(gains))]
    return milp(
        -np.r_[np.zeros(sites), gains],
        integrality=whole,
        bounds=Bounds(0.0, np.r_[np.ones(sites), most]),
        constraints=[LinearConstraint(rows, lb=at_least), LinearConstraint(whole, ub=count)],
        options={"time_limit": left_s, "mip_rel_gap": gap},
    )
