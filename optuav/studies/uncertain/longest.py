"""The longest hover of every variant of a mission, over all itineraries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from formulations.p1 import P1
from formulations.perspectives import AVAILABLE
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines import closed_form
from optuav.solving.delivered import delivered
from optuav.solving.ties import SAME_S
from optuav.studies.uncertain.ensemble import Ensemble

NO_ROUTE = -1


class Longest(NamedTuple):
    """Hover time [s], NaN where there is no plan, and itinerary, −1 there; one entry a variant."""

    hover_time_s: Floats
    itinerary: Integers


def longest(ensemble: Ensemble, perspective: str) -> Longest:
    """Solve (P1) for every variant.

    Parameters
    ----------
    ensemble
        The variants.
    perspective
        How the state of charge is written: linear, or ``"available"``.

    Returns
    -------
    Of itineraries as good as the best (to 1e-6 s), the first in the order of the mission.
    """
    variants, itineraries = _candidates(ensemble, pruned=perspective != AVAILABLE)
    hover_s = _hover_times_s(ensemble, variants, itineraries, perspective)
    best_s = np.full(ensemble.count, np.nan)
    np.fmax.at(best_s, variants, hover_s)
    winner = np.full(ensemble.count, np.iinfo(np.intp).max)
    tied = hover_s >= best_s[variants] - SAME_S
    np.minimum.at(winner, variants[tied], itineraries[tied])
    return Longest(best_s, np.where(np.isnan(best_s), NO_ROUTE, winner))


def best_itineraries(ensemble: Ensemble, perspective: str) -> Integers:
    """Routes of a single variant that are as good as the best (to 1e-6 s).

    None without a plan. Parameters as for `longest`, with one variant.
    """
    variants, itineraries = _candidates(ensemble, pruned=False)
    hover_s = _hover_times_s(ensemble, variants, itineraries, perspective)
    best_s = np.fmax.reduce(hover_s, initial=-np.inf)
    return np.asarray(itineraries[hover_s >= best_s - SAME_S])


def _hover_times_s(
    ensemble: Ensemble, variants: Integers, itineraries: Integers, perspective: str
) -> Floats:
    """Longest hover of pairs of a variant and an itinerary [s], NaN where there is no plan."""
    hover_s = np.full(len(variants), np.nan)
    for group in _groups(ensemble, itineraries, apart=perspective == AVAILABLE):
        hover_s[group] = _solved(ensemble, variants[group], itineraries[group], perspective)
    return hover_s


def _solved(
    ensemble: Ensemble, variants: Integers, itineraries: Integers, perspective: str
) -> Floats:
    rests = bool(ensemble.base.worked_out.routes.building[itineraries[0]] >= 0)
    if perspective == AVAILABLE:
        given = ensemble.quantities(variants, itineraries, rests=rests, steps=True)
        return delivered(given, len(variants))["hover_time_s"]
    given = ensemble.quantities(variants, itineraries, rests=rests)
    solution = closed_form.solve(P1.model(given, perspective), len(variants))
    return np.asarray(solution.objective)


def _groups(ensemble: Ensemble, itineraries: Integers, *, apart: bool) -> list[Booleans]:
    """Pairs that one declaration serves: direct or by way of a building, by order if needed."""
    routes = ensemble.base.worked_out.routes
    by_way = routes.building[itineraries] >= 0
    first = routes.rest_first[itineraries]
    groups = [~by_way, by_way & first, by_way & ~first] if apart else [~by_way, by_way]
    return [group for group in groups if group.any()]


def _candidates(ensemble: Ensemble, *, pruned: bool) -> tuple[Integers, Integers]:
    """Pairs of a variant and an itinerary that may be the best of their variant.

    By way of a building, an itinerary is out if another takes no more time, charge and energy in
    flight and charges no less at rest: all constraints that are linear in the times are as easy to
    meet with the other.
    """
    able = ensemble.flyable & np.isfinite(ensemble.hover_load.current_A)
    count = able.shape[1]
    able = np.broadcast_to(able, (ensemble.count, count)).copy()
    if pruned and count > 2:
        costs = [
            np.broadcast_to(each, (ensemble.count, count))[:, 1:]
            for each in (
                ensemble.flight_time_s,
                ensemble.flight_charge_As,
                ensemble.flight_energy_J,
                -ensemble.rest_current_A,
                -ensemble.rest_received_W,
            )
        ]
        able[:, 1:] &= ~_dominated(costs, able[:, 1:])
    variants, itineraries = np.nonzero(able)
    return variants, itineraries


def _dominated(costs: list[Floats], able: Booleans) -> Booleans:
    """Whether another column is no worse in all costs; of equal columns the first stays."""
    costs = [np.where(able, each, np.inf) for each in costs]
    out = np.zeros(able.shape, bool)
    number = np.arange(able.shape[1])
    rivals = {rival for cost in costs for rival in np.unique(cost.argmin(axis=1)).tolist()}
    for rival in sorted(rivals):
        no_worse: Booleans = able[:, [rival]] & ~out[:, [rival]]
        better = np.broadcast_to(number > rival, able.shape)
        for cost in costs:
            own = cost[:, [rival]]
            no_worse = no_worse & (own <= cost)
            better = better | (own < cost)
        out |= no_worse & better
    return out
