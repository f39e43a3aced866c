"""What follows from everything that is uncertain at once: samples, and what they say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.solving.ties import SAME_S
from optuav.studies.uncertain.ensemble import Base, Ensemble
from optuav.studies.uncertain.fixed_plan import CONDITIONS, FixedPlan
from optuav.studies.uncertain.longest import Longest, longest
from optuav.studies.uncertain.spread import Spread, drawn

AT_ONCE = 8192
"""Samples that are worked out together: as many as fit the cache, for any number of samples."""
SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles that are told."""


@dataclass(frozen=True)
class Chances:
    """What follows from everything that is uncertain.

    Parameters
    ----------
    samples, seed
        Number of samples, and what they are drawn from.
    uncertain
        Keys that vary.
    stated
        Whether their spread was stated; else all are within 10 % of their values.
    hover_times_s
        Longest hover of every sample [s], no less than the fixed plan's where that is feasible; 0
        where there is no plan.
    no_plan
        Share of samples without a plan.
    routes
        Share of samples by the route of the best plan; the most frequent first.
    kept
        Share of samples in which the fixed plan keeps each condition; None without a plan.
    flyable
        Share of samples in which it keeps all of them; None without a plan.
    """

    samples: int
    seed: int
    uncertain: tuple[str, ...]
    stated: bool
    hover_times_s: Floats = field(repr=False, compare=False)
    no_plan: float
    routes: Mapping[str, float]
    kept: Mapping[str, float] | None
    flyable: float | None

    @property
    def quantiles_s(self) -> dict[float, float]:
        """Hover times [s] below which there is a share of the samples."""
        found = np.quantile(self.hover_times_s, SHARES)
        return dict(zip(SHARES, found.tolist(), strict=True))

    @property
    def mean_s(self) -> float:
        """Mean of the hover times [s]."""
        return float(np.mean(self.hover_times_s))


def chances(
    base: Base,
    uncertain: Sequence[Spread],
    perspective: str,
    plan: FixedPlan | None,
    samples: int,
    seed: int,
    *,
    stated: bool,
    at_once: int = AT_ONCE,
) -> Chances:
    """Work out the samples, so many at once; the result does not depend on how many."""
    routes = base.worked_out.routes
    hover_s = np.empty(samples)
    wins = np.zeros(len(routes) + 1, dtype=np.intp)
    kept = dict.fromkeys(CONDITIONS, 0)
    flyable = 0
    for first in range(0, samples, at_once):
        some = slice(first, min(first + at_once, samples))
        ensemble = Ensemble(base, drawn(uncertain, seed, first, some.stop - first))
        best = longest(ensemble, perspective)
        if plan is not None:
            judged = plan.judged(ensemble, perspective)
            flyable += int(judged.flyable.sum())
            kept = {name: kept[name] + int(judged.kept[name].sum()) for name in kept}
            best = _no_less(best, plan, judged.feasible)
        hover_s[some] = np.nan_to_num(best.hover_time_s, nan=0.0)
        wins += np.bincount(best.itinerary + 1, minlength=len(wins))
    names = base.worked_out.places.names
    by_route: dict[str, int] = {}
    for number, count in enumerate(wins[1:].tolist()):
        building = int(routes.building[number])
        name = "direct" if building < 0 else f"by way of {names[3 + building]}"
        by_route[name] = by_route.get(name, 0) + count
    ranked = sorted(by_route.items(), key=lambda item: -item[1])
    return Chances(
        samples,
        seed,
        tuple(k.name for each in uncertain for k in (each.key, *each.along)),
        stated,
        hover_s,
        int(wins[0]) / samples,
        {name: count / samples for name, count in ranked if count},
        None if plan is None else {name: count / samples for name, count in kept.items()},
        None if plan is None else flyable / samples,
    )


def _no_less(best: Longest, plan: FixedPlan, feasible: Booleans) -> Longest:
    """The best plans, or the fixed one where it is feasible and hovers longer.

    It keeps its hover point, which otherwise moves with what the radio covers: from there all ways
    may be barred, or longer.
    """
    better = feasible & ~(best.hover_time_s >= plan.hover_time_s - SAME_S)
    return Longest(
        np.where(better, plan.hover_time_s, best.hover_time_s),
        np.where(better, plan.itinerary, best.itinerary),
    )
