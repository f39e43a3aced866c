"""What no choice of sites exceeds: the Lagrangian bound of the p-median problem.

For any level u_i of a demand and any sites S, max_{j∈S} h_ij ≤ u_i + Σ_{j∈S} (h_ij − u_i)⁺. Summed
over the demands, the right side is a constant and one term a site, so that the best p terms bound
every choice of p sites [1]_. The best levels give the bound of the strong linear relaxation; good
ones are found by subgradient steps. To check a bound takes its levels and one line of NumPy.

References
----------
.. [1] G. Cornuejols, M. L. Fisher and G. L. Nemhauser, "Location of bank accounts to optimize
   float", Management Science 23, 1977.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optuav.arrays import Floats
from optuav.siting.heuristics import total

ROUNDS = 300
PATIENCE, SHRINK = 15, 0.6  # Rounds without a better bound, after which steps get smaller by this
BETTER = 1e-5  # Relative; a bound that is lower by less is no better


def upper_bound(worth: Floats, weights: Floats, count: int, levels: Floats) -> float:
    """What no `count` sites exceed in total, proved by any levels (demand,)."""
    return float(bound_by_site(worth, weights, count, levels).max(initial=0.0))


def bound_by_site(worth: Floats, weights: Floats, count: int, levels: Floats) -> Floats:
    """What no `count` sites exceed of which a given one is among them (site,)."""
    terms = weights @ np.maximum(worth - levels[:, None], 0.0)
    most = np.sort(terms)[::-1][:count]
    return np.asarray(weights @ levels + most.sum() + np.minimum(terms - most[-1], 0.0))


def multipliers(
    worth: Floats, weights: Floats, count: int, chosen: Sequence[int], gap: float = 0.0
) -> tuple[Floats, list[tuple[int, ...]]]:
    """Levels (demand,) that give a low `upper_bound`, and choices met on the way, the best first.

    Those chosen to start with are among them. The search ends within the relative gap.
    """
    sites = worth.shape[1]
    # Half the accuracy is enough on the way, and twice as fast.
    table, share = worth.astype(np.float32), weights.astype(np.float32)
    rank = max(1, sites // (2 * count))
    levels = -np.partition(-worth, rank - 1, axis=1)[:, rank - 1]
    lowest, best, step, waited = np.inf, levels, 1.0, 0
    met = {tuple(chosen): total(worth, weights, chosen)}
    value = met[tuple(chosen)]
    above = np.empty_like(table)
    for _ in range(ROUNDS):
        np.subtract(table, levels.astype(np.float32)[:, None], out=above)
        np.maximum(above, 0.0, out=above)
        terms = share @ above
        top = np.argsort(-terms, kind="stable")[:count]
        bound = float(weights @ levels + terms[top].sum(dtype=float))
        waited = 0 if bound < lowest * (1.0 - BETTER) else waited + 1
        if bound < lowest:
            lowest, best = bound, levels
        if (sites_met := tuple(sorted(top.tolist()))) not in met:
            met[sites_met] = total(worth, weights, sites_met)
            value = max(value, met[sites_met])
        if waited == PATIENCE:
            step, waited, levels = step * SHRINK, 0, best
            continue
        slope = 1.0 - (above[:, top] > 0.0).sum(axis=1)
        steepness = weights @ slope**2
        if bound <= (1.0 + gap) * value or steepness == 0.0:
            break
        levels = np.maximum(levels - step * (bound - value) / steepness * slope, 0.0)
    # What a demand gets from its best site bounds it as well.
    most = worth.max(axis=1)
    return most if weights @ most < lowest else best, sorted(met, key=lambda each: -met[each])
