"""The selection of sites from a table of hover times: greedy, bounded, and solved by HiGHS."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.siting.heuristics import (
    SAME_SUM,
    best_of,
    bound_by_site,
    greedy,
    interchange,
    multipliers,
    needed,
    total,
    undominated,
)
from optuav.siting.programmes import most_for_the_least, most_in_total
from optuav.status import SAME_S

Objective: TypeAlias = Literal["mean", "worst", "covered"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)
NO_GAP = 1e-6  # Relative; a gap up to this counts as none
STARTS = 8  # Choices met by the multipliers that start an exchange of sites


@dataclass(frozen=True)
class Selection:
    """Candidates selected by `optuav.place_laser`, and a bound on every selection.

    Parameters
    ----------
    objective
        Quantity to maximise: ``"mean"``, ``"worst"`` or ``"covered"``.
    sites
        Numbers of the candidates selected, in rising order, the first is 0.
    value
        Mean or smallest hover time [s], or the number of missions covered.
    bound
        Bound on the value: no selection of as many candidates has a larger value.
    greedy_sites, greedy_value
        The selection that adds, one by one, the candidate with the largest gain in the mean or the
        number covered, in this order, and its value.
    alike
        For each selected site, the number of candidates outside the selection that would give the
        same value in its place.

    Examples
    --------
    >>> import optuav
    >>> hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    >>> selection = optuav.place_laser(hazy, [[1000, 0, 50], [1000, 2000, 50]]).selection
    >>> selection.sites, selection.greedy_sites, selection.gap, selection.alike
    ((1,), (1,), 0.0, (0,))
    """

    objective: Objective
    sites: tuple[int, ...]
    value: float
    bound: float
    greedy_sites: tuple[int, ...]
    greedy_value: float
    alike: tuple[int, ...]

    @property
    def gap(self) -> float:
        """Excess of the bound over the value, relative to the value."""
        more = self.bound - self.value
        return 0.0 if more <= NO_GAP * self.value else more / self.value if self.value else np.inf


def worth_of(hover_s: Floats, objective: Objective, at_least_s: float | None = None) -> Floats:
    """Worth of each site to each demand (demand, site): its hover [s], or 1 if that is enough.

    Of hover times (demand, site) [s], rounded so that no choice hangs on their last bits; NaN,
    without a plan, is worth 0.
    """
    found_s = np.nan_to_num(hover_s, nan=0.0)
    if objective == "covered":
        assert at_least_s is not None
        return np.asarray(found_s >= at_least_s - SAME_S, dtype=float)
    return np.asarray(np.round(found_s / SAME_S) * SAME_S)


def value_of(reached: Floats, objective: Objective) -> Any:
    """The objective of what each demand gets (demand, …)."""
    if objective == "covered":
        return reached.sum(axis=0)
    return reached.mean(axis=0) if objective == "mean" else reached.min(axis=0)


def best_sites(
    hover_s: Floats,
    count: int,
    objective: Objective = "mean",
    *,
    at_least_s: float | None = None,
    gap: float = 0.0,
    time_limit_s: float = 60.0,
) -> Selection:
    """Up to `count` columns of a table of hover times (demand, site) [s], NaN without a plan.

    Every demand takes the best column selected. Columns that serve no demand are left out. The
    search ends within the relative gap or after the time limit [s], and says how far it came.
    """
    latest = time.monotonic() + time_limit_s
    worth = worth_of(hover_s, objective, at_least_s)
    table, _, weights = _merged(worth, np.ones(len(worth)))
    names = np.flatnonzero(undominated(table))
    table = np.ascontiguousarray(table[:, names])
    first = greedy(table, weights, count)
    search = _for_the_least if objective == "worst" else _in_total
    best, bound = search(table, weights, count, first, gap, latest)
    chosen, greedily = (names[list(sites)].tolist() for sites in (needed(table, best), first))
    chosen.sort()
    value = float(value_of(best_of(worth, chosen), objective))
    if objective == "mean":
        bound /= len(worth)
    elif objective == "covered":
        bound = np.floor(bound + NO_GAP)  # Only whole demands are covered
    return Selection(
        objective=objective,
        sites=tuple(chosen),
        value=value,
        bound=float(max(value, bound)),
        greedy_sites=tuple(greedily),
        greedy_value=float(value_of(best_of(worth, greedily), objective)),
        alike=tuple(_alike(worth, chosen, objective)),
    )


def _alike(worth: Floats, chosen: list[int], objective: Objective) -> Iterator[int]:
    """By site chosen, how many of the others give the same value in its place."""
    value = value_of(best_of(worth, chosen), objective)
    others = np.delete(worth, chosen, axis=1)
    for site in chosen:
        rest = best_of(worth, [chosen_site for chosen_site in chosen if chosen_site != site])
        reached = value_of(np.maximum(others, rest[:, None]), objective)
        yield int((np.abs(reached - value) <= SAME_SUM * value).sum())


def _in_total(
    worth: Floats, weights: Floats, count: int, first: tuple[int, ...], gap: float, latest: float
) -> tuple[tuple[int, ...], float]:
    """The sites with the largest total, from some to start with, and what no sites exceed."""
    value = partial(total, worth, weights)
    best = interchange(worth, weights, first)
    levels, met = multipliers(worth, weights, count, best, gap)
    limits = bound_by_site(worth, weights, count, levels)
    bound = float(limits.max(initial=0.0))
    best = max(best, *(interchange(worth, weights, choice) for choice in met[:STARTS]), key=value)
    enough = (1.0 + max(gap, NO_GAP)) * value(best)
    if bound <= enough or time.monotonic() >= latest:
        return best, bound
    # With only the sites that can reach more, more demands are alike.
    left = limits > enough
    outside = float(limits[~left].max(initial=0.0))
    left[list(best)] = True
    names = np.flatnonzero(left)
    kinds, kept, alike = _merged(worth[:, names], weights)
    start, least = np.searchsorted(names, best).tolist(), max(gap, 0.5 * NO_GAP)
    chosen, inside = most_in_total(kinds, alike, count, levels[kept], start, least, latest)
    return tuple(names[list(chosen)].tolist()), min(bound, max(inside, outside))


def _for_the_least(
    worth: Floats, weights: Floats, count: int, first: tuple[int, ...], gap: float, latest: float
) -> tuple[tuple[int, ...], float]:
    """Like `_in_total`; sites that the least needs not go where they add most to the mean."""
    best, bound = most_for_the_least(worth, count, first, gap, latest)
    return greedy(worth, weights, count, needed(worth, best)), bound


def _merged(worth: Floats, weights: Floats) -> tuple[Floats, Integers, Floats]:
    """The demands that differ, the first of each kind, and what all of a kind weigh."""
    rows, first, kind_of = np.unique(worth, axis=0, return_index=True, return_inverse=True)
    return rows, first, np.bincount(kind_of.reshape(-1), weights).astype(float)
