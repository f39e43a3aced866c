"""Good sites without a bound: one after another, then exchanged while that gains.

Throughout `optuav.siting`, `worth` (demand, site) ≥ 0 is what a demand gets from a site, of the
sites chosen it takes the best, and `weights` (demand,) say how much each demand counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optuav.arrays import Booleans, Floats

SAME = 1e-9  # Relative; sums that differ by less are equal, and the first of them is taken


def total(worth: Floats, weights: Floats, chosen: Sequence[int]) -> float:
    """What all demands get from the sites chosen."""
    return float(weights @ best_of(worth, chosen))


def best_of(worth: Floats, chosen: Sequence[int]) -> Floats:
    """What each demand gets from the best of the sites chosen; 0 from none."""
    return np.asarray(worth[:, list(chosen)].max(axis=1, initial=0.0), dtype=float)


def greedy(
    worth: Floats, weights: Floats, count: int, chosen: Sequence[int] = ()
) -> tuple[int, ...]:
    """Up to `count` sites, each the one that adds most to those before it; see [1]_.

    At least 1 − (1 − 1/count)^count of the best is reached. A site that adds nothing is not taken.

    References
    ----------
    .. [1] G. Cornuejols, M. L. Fisher and G. L. Nemhauser, "Location of bank accounts to optimize
       float", Management Science 23, 1977.
    """
    found, held = [*chosen], best_of(worth, chosen)
    while len(found) < min(count, worth.shape[1]):
        added = weights @ np.maximum(worth - held[:, None], 0.0)
        site = _first(added)
        if added[site] <= SAME * (weights @ held):
            break
        found.append(site)
        held = np.maximum(held, worth[:, site])
    return tuple(found)


def interchange(worth: Floats, weights: Floats, chosen: Sequence[int]) -> tuple[int, ...]:
    """Sites none of which can be exchanged for another with gain, from some to start with [1]_.

    References
    ----------
    .. [1] M. B. Teitz and P. Bart, "Heuristic methods for estimating the generalized vertex median
       of a weighted graph", Operations Research 16, 1968.
    """
    found = [*chosen]
    while found:
        held = worth[:, found]
        first = held.argmax(axis=1)
        best = held.max(axis=1)
        second = np.where(np.arange(len(found)) == first[:, None], 0.0, held).max(axis=1)
        more = np.maximum(worth - best[:, None], 0.0)
        added = weights @ more
        gained = np.empty((len(found), worth.shape[1]))
        for place in range(len(found)):
            # Those that lose their best site get their second or the new one.
            own = first == place
            instead = np.maximum(worth[own], second[own, None]) - best[own, None]
            gained[place] = added + weights[own] @ (instead - more[own])
        pair = _first(gained.ravel())
        place, site = divmod(pair, worth.shape[1])
        if gained[place, site] <= SAME * (weights @ best):
            break
        found[place] = site
    return tuple(found)


def undominated(worth: Floats) -> Booleans:
    """Which sites no other is as good as for every demand; of equal ones the first is kept."""
    kept, found = np.empty(0, dtype=np.intp), np.zeros(worth.shape[1], bool)
    for site in np.argsort(-worth.sum(axis=0), kind="stable").tolist():
        own = worth[:, site]
        demands = np.flatnonzero(own)
        demands = demands[np.argsort(-own[demands], kind="stable")]
        rivals, begin, some = kept, 0, 8
        while len(rivals) and begin < len(demands):
            rows = demands[begin : begin + some]
            rivals = rivals[(worth[np.ix_(rows, rivals)] >= own[rows, None]).all(axis=0)]
            begin, some = begin + some, 2 * some
        if not len(rivals):
            found[site] = True
            kept = np.append(kept, site)
    return found


def _first(values: Floats) -> int:
    """The number of the largest value, of equal ones the first, whatever rounding adds."""
    most = values.max()
    return int(np.argmax(values >= most - SAME * abs(most)))
