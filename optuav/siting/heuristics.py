"""Good sites, and a bound for every choice of sites: exchanges, and the Lagrangian bound.

Throughout `optuav.siting`, `worth` (demand, site) ≥ 0 is the worth of a site to a demand, which
takes the best of the sites chosen, and `weights` (demand,) say how much each demand counts.

For any level u_i of a demand and any sites S, max_{j∈S} h_ij ≤ u_i + Σ_{j∈S} (h_ij − u_i)⁺. Summed
over the demands, the right side is a constant and one term a site, so that the best p terms bound
every choice of p sites [1]_. The best levels give the bound of the strong linear relaxation; good
ones are found by subgradient steps. To check a bound takes its levels and one line of NumPy.

References
----------
.. [1] G. Cornuejols, M. L. Fisher and G. L. Nemhauser, "Location of bank accounts to optimize
   float", Management Science 23, 1977.
.. [2] M. B. Teitz and P. Bart, "Heuristic methods for estimating the generalized vertex median of a
   weighted graph", Operations Research 16, 1968.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.status import SAME_S

SAME_SUM = 1e-9  # Relative; sums that differ by less are equal, and the first of them is taken
MOST_BOUNDS = 300  # Most bounds of the subgradient method
PATIENCE, SHRINK = 15, 0.6  # Rounds without a better bound, after which steps get smaller by this
BETTER = 1e-5  # Relative; a bound that is lower by less does not count as better


def total(worth: Floats, weights: Floats, chosen: Sequence[int]) -> float:
    """Return what all demands get from the chosen sites."""
    return float(weights @ best_of(worth, chosen))


def best_of(worth: Floats, chosen: Sequence[int]) -> Floats:
    """Return what each demand gets from the best of the chosen sites; 0 from none."""
    return np.asarray(worth[:, list(chosen)].max(axis=1, initial=0.0), dtype=float)


def greedy(
    worth: Floats, weights: Floats, count: int, chosen: Sequence[int] = ()
) -> tuple[int, ...]:
    """Up to `count` sites, each the one that adds most to those before it [1]_.

    At least 1 − (1 − 1/count)^count of the best is reached. A site that adds nothing is not taken.
    """
    sites, held = [*chosen], best_of(worth, chosen)
    while len(sites) < min(count, worth.shape[1]):
        added = weights @ np.maximum(worth - held[:, None], 0.0)
        site = _first(added)
        if added[site] <= SAME_SUM * (weights @ held):
            break
        sites.append(site)
        held = np.maximum(held, worth[:, site])
    return tuple(sites)


def needed(worth: Floats, chosen: Sequence[int]) -> tuple[int, ...]:
    """The sites chosen without those that serve nobody once the others are there.

    Worths that differ by no more than `SAME_S` are equal, as in `Siting.laser`.
    """
    kept, reached = [*chosen], best_of(worth, chosen)
    for site in reversed(chosen):
        others = [other for other in kept if other != site]
        if (best_of(worth, others) >= reached - SAME_S).all():
            kept = others
    return tuple(kept)


def interchange(worth: Floats, weights: Floats, chosen: Sequence[int]) -> tuple[int, ...]:
    """Sites that no exchange with another improves, from some to start with [2]_."""
    sites = [*chosen]
    while sites:
        held = worth[:, sites]
        first = held.argmax(axis=1)
        best = held.max(axis=1)
        second = np.where(np.arange(len(sites)) == first[:, None], 0.0, held).max(axis=1)
        more = np.maximum(worth - best[:, None], 0.0)
        added = weights @ more
        gained = np.empty((len(sites), worth.shape[1]))
        for place in range(len(sites)):
            # Those that lose their best site get their second or the new one.
            losers = first == place
            instead = np.maximum(worth[losers], second[losers, None]) - best[losers, None]
            gained[place] = added + weights[losers] @ (instead - more[losers])
        pair = _first(gained.ravel())
        place, site = divmod(pair, worth.shape[1])
        if gained[place, site] <= SAME_SUM * (weights @ best):
            break
        sites[place] = site
    return tuple(sites)


def undominated(worth: Floats) -> Booleans:
    """Return the sites that no other site equals for every demand; the first of equal ones."""
    kept, is_kept = np.empty(0, dtype=np.intp), np.zeros(worth.shape[1], bool)
    for site in np.argsort(-worth.sum(axis=0), kind="stable").tolist():
        worth_here = worth[:, site]
        demands = np.flatnonzero(worth_here)
        demands = demands[np.argsort(-worth_here[demands], kind="stable")]
        rivals, begin, count = kept, 0, 8
        while len(rivals) and begin < len(demands):
            rows = demands[begin : begin + count]
            rivals = rivals[(worth[np.ix_(rows, rivals)] >= worth_here[rows, None]).all(axis=0)]
            begin, count = begin + count, 2 * count
        if not len(rivals):
            is_kept[site] = True
            kept = np.append(kept, site)
    return is_kept


def _first(values: Floats) -> int:
    """The number of the largest value, of equal ones the first, whatever rounding adds."""
    most = values.max()
    return int(np.argmax(values >= most - SAME_SUM * abs(most)))


def bound_by_site(worth: Floats, weights: Floats, count: int, levels: Floats) -> Floats:
    """Bound of `count` sites that include a given one (site,), by any levels."""
    terms = weights @ np.maximum(worth - levels[:, None], 0.0)
    most = np.sort(terms)[::-1][:count]
    return np.asarray(weights @ levels + most.sum() + np.minimum(terms - most[-1], 0.0))


def multipliers(
    worth: Floats, weights: Floats, count: int, chosen: Sequence[int], gap: float = 0.0
) -> tuple[Floats, list[tuple[int, ...]]]:
    """Levels (demand,) that give low bounds, and choices met on the way, the best first.

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
    for _ in range(MOST_BOUNDS):
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
    # The worth of its best site bounds a demand as well.
    most = worth.max(axis=1)
    return most if weights @ most < lowest else best, sorted(met, key=lambda each: -met[each])
