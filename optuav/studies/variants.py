"""The longest hover of each of many variants of a mission."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from formulations.p1 import P1
from formulations.parameters import steps_for
from formulations.soc import AVAILABLE
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines import closed_form
from optuav.modelling import Model
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.solving.assemble import variant_quantities
from optuav.solving.batch import delivered
from optuav.solving.plans import SAME_S

NO_ROUTE = -1


class LongestHovers(NamedTuple):
    """Hover time [s], NaN without a plan, and itinerary, −1 then; one entry a variant."""

    hover_time_s: Floats
    itinerary: Integers


def longest(variants: Variants, perspective: Perspective) -> LongestHovers:
    """Return the longest hover of each variant over all its itineraries.

    Of itineraries that are as good as the best (to 1e-6 s), it names the first.
    """
    number, itineraries = _candidates(variants, pruned=perspective != AVAILABLE)
    hover_s = _hover_times_s(variants, number, itineraries, perspective)
    best_s = np.full(variants.count, np.nan)
    np.fmax.at(best_s, number, hover_s)
    winner = np.full(variants.count, np.iinfo(np.intp).max)
    tied = hover_s >= best_s[number] - SAME_S
    np.minimum.at(winner, number[tied], itineraries[tied])
    return LongestHovers(best_s, np.where(np.isnan(best_s), NO_ROUTE, winner))


def best_itineraries(variants: Variants, perspective: Perspective) -> Integers:
    """Return the itineraries of a single variant that are as good as the best (to 1e-6 s)."""
    number, itineraries = _candidates(variants, pruned=False)
    hover_s = _hover_times_s(variants, number, itineraries, perspective)
    best_s = np.fmax.reduce(hover_s, initial=-np.inf)
    return np.asarray(itineraries[hover_s >= best_s - SAME_S])


def route_model(variants: Variants, itinerary: int, perspective: Perspective) -> Model:
    """Return (P1) of one itinerary in all variants, with the stages of flight as parameters."""
    every = np.arange(variants.count)
    given = variant_quantities(
        variants,
        every,
        np.full_like(every, itinerary),
        rests=bool(variants.network.routes.building[itinerary] >= 0),
        steps=perspective == AVAILABLE,
    )
    return P1().model(replace(given, steps=steps_for(given.steps, varies=True)), perspective)


def _hover_times_s(
    variants: Variants, number: Integers, itineraries: Integers, perspective: Perspective
) -> Floats:
    """Return the longest hover of pairs of variant and itinerary [s], NaN without a plan."""
    routes = variants.network.routes
    by_way, first = routes.building[itineraries] >= 0, routes.rest_first[itineraries]
    groups = [~by_way, by_way]
    if perspective == AVAILABLE:  # which needs one order of the stays for all
        groups = [~by_way, by_way & first, by_way & ~first]
    hover_s = np.full(len(number), np.nan)
    for group in groups:
        count, steps = int(group.sum()), perspective == AVAILABLE
        if not count:
            continue
        rests = bool(by_way[group][0])
        given = variant_quantities(
            variants, number[group], itineraries[group], rests=rests, steps=steps
        )
        if steps:
            hover_s[group] = delivered(given, count)["hover_time_s"]
        else:
            hover_s[group] = closed_form.solve(P1().model(given, perspective), count).objective
    return hover_s


def _candidates(variants: Variants, *, pruned: bool) -> tuple[Integers, Integers]:
    """Return pairs of a variant and an itinerary that may be the best of their variant.

    By way of a building, an itinerary is out if another takes no more time, charge and energy in
    flight and charges no less at rest: all constraints that are linear in the times are as easy to
    meet with the other.
    """
    shape = (variants.count, variants.able.shape[1])
    able = np.broadcast_to(variants.able, shape).copy()
    if pruned and shape[1] > 2:
        costs = [
            np.broadcast_to(each, shape)[:, 1:]
            for each in (
                variants.flight_time_s,
                variants.flight_charge_As,
                variants.flight_energy_J,
                -variants.rest_load.current_A,
                -variants.rest_load.power_W,
            )
        ]
        able[:, 1:] &= ~_dominated(costs, able[:, 1:])
    number, itineraries = np.nonzero(able)
    return number, itineraries


def _dominated(costs: list[Floats], able: Booleans) -> Booleans:
    """Return where another column is no worse in all costs; of equal columns the first stays."""
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
