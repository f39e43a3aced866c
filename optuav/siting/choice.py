"""The choice of sites from a table of hover times: greedy, bounded, and solved by HiGHS."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from typing import Literal, TypeAlias, get_args

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.siting.benders import most_in_total
from optuav.siting.bounds import bound_by_site, multipliers, upper_bound
from optuav.siting.covers import by_greedy, by_programme, most_for_the_least
from optuav.siting.heuristics import best_of, greedy, interchange, total, undominated

Objective: TypeAlias = Literal["mean", "worst", "covered"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)
CLOSE = 1e-6  # Relative; a gap that is no larger is none
SAME_S = 1e-6  # Hover times are rounded to this [s], so that no choice hangs on their last bits
STARTS = 8  # Choices met by the multipliers from which sites are exchanged
GAPS = (0.1, 0.01)
"""Gaps that are aimed at before the one that is wanted: the wider it is, the fewer sites matter."""


@dataclass(frozen=True)
class Choice:
    """Sites chosen from a table of hover times, and what no choice exceeds."""

    objective: Objective
    sites: tuple[int, ...]  # Numbers of columns, in rising order
    value: float  # Mean or smallest hover time [s], or the number of demands covered
    bound: float  # No choice of as many sites has a larger value
    greedy_sites: tuple[int, ...]  # In the order of choice
    greedy_value: float
    # Levels of the demands that prove `multiplier_bound`, see `optuav.siting.bounds`; empty for the
    # objective "worst".
    levels: Floats = field(repr=False, compare=False)
    multiplier_bound: float | None

    @property
    def gap(self) -> float:
        """By how much the bound exceeds the value, relative to the value."""
        more = self.bound - self.value
        return 0.0 if more <= CLOSE * self.value else more / self.value if self.value else np.inf


def worth_of(hover_s: Floats, objective: Objective, at_least_s: float | None = None) -> Floats:
    """What each demand gets from each site (demand, site): its hover [s], or 1 if that is enough.

    Of hover times (demand, site) [s]; NaN, where there is no plan, is worth 0.
    """
    found_s = np.nan_to_num(hover_s, nan=0.0)
    if objective == "covered":
        assert at_least_s is not None
        return np.asarray(found_s >= at_least_s - SAME_S, dtype=float)
    return np.asarray(np.round(found_s / SAME_S) * SAME_S)


def value_of(reached: Floats, objective: Objective) -> float:
    """The objective of what each demand gets (demand,)."""
    if objective == "covered":
        return float(reached.sum())
    return float(reached.mean() if objective == "mean" else reached.min())


def best_sites(
    hover_s: Floats,
    count: int,
    objective: Objective = "mean",
    *,
    at_least_s: float | None = None,
    gap: float = 0.0,
    time_limit_s: float = 60.0,
) -> Choice:
    """Up to `count` columns of a table of hover times (demand, site) [s], NaN without a plan.

    Every demand takes the best column chosen. Columns that gain nothing are left out. The search
    ends within the relative gap or after the time limit [s], and says how far it came.
    """
    latest = time.monotonic() + time_limit_s
    worth = worth_of(hover_s, objective, at_least_s)
    table, own, weights = _merged(worth)
    names = np.flatnonzero(undominated(table))
    if objective == "mean":
        weights = weights / len(worth)
    table = np.ascontiguousarray(table[:, names])
    search = _for_the_least if objective == "worst" else _in_total
    first, best, bound, levels = search(table, weights, count, gap, latest)
    chosen, greedily = (names[list(each)].tolist() for each in (best, first))
    value = value_of(best_of(worth, chosen), objective)
    if objective == "covered":
        bound = np.floor(bound + CLOSE)  # Only whole demands are covered
    checked = None if objective == "worst" else upper_bound(table, weights, count, levels)
    return Choice(
        objective=objective,
        sites=tuple(sorted(chosen)),
        value=value,
        bound=float(max(value, bound)),
        greedy_sites=tuple(greedily),
        greedy_value=value_of(best_of(worth, greedily), objective),
        levels=levels if checked is None else levels[own],
        multiplier_bound=checked,
    )


def _in_total(
    worth: Floats, weights: Floats, count: int, gap: float, latest: float
) -> tuple[tuple[int, ...], tuple[int, ...], float, Floats]:
    """The greedy sites, the best found, what no choice exceeds, and levels that prove a bound."""
    first = greedy(worth, weights, count)
    best = interchange(worth, weights, first)
    levels, met = multipliers(worth, weights, count, best, gap)
    bound = upper_bound(worth, weights, count, levels)
    for start in met[:STARTS]:
        again = interchange(worth, weights, start)
        best = max(best, again, key=partial(total, worth, weights))
    for wanted in sorted({max(gap, CLOSE), *(each for each in GAPS if each > gap)}, reverse=True):
        enough = (1.0 + wanted) * total(worth, weights, best)
        if bound <= enough or time.monotonic() >= latest:
            continue
        # Where only sites are left with which more can be reached, more demands are alike.
        limits = bound_by_site(worth, weights, count, levels)
        left = limits > enough
        outside = float(limits[~left].max(initial=0.0))
        left[list(best)] = True
        names = np.flatnonzero(left)
        some, own, alike = _merged(worth[:, names], weights)
        shared = np.bincount(own, weights * levels) / alike
        start = np.searchsorted(names, best).tolist()
        limit = wanted - 0.5 * CLOSE
        found, inside = most_in_total(some, alike, count, shared, start, limit, latest)
        best = tuple(names[list(found)].tolist())
        bound = min(bound, max(inside, outside))
    return first, best, bound, levels


def _for_the_least(
    worth: Floats, weights: Floats, count: int, gap: float, latest: float
) -> tuple[tuple[int, ...], tuple[int, ...], float, Floats]:
    """As `_in_total`; sites that the least needs not go where they add most to the mean."""
    first, _ = most_for_the_least(worth, greedy(worth, weights, count), by_greedy(count))
    best, bound = most_for_the_least(worth, first, by_programme(count, latest), gap)
    first, best = (greedy(worth, weights, count, each) for each in (first, best))
    return first, best, bound, np.empty(0)


def _merged(worth: Floats, weights: Floats | None = None) -> tuple[Floats, Integers, Floats]:
    """The demands that differ, for each demand which of them it is, and their weights."""
    rows, own = np.unique(worth, axis=0, return_inverse=True)
    own = own.reshape(-1)
    return rows, own, np.bincount(own, weights).astype(float)
