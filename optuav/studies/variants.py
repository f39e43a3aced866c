"""Quantities of many variants of a mission, and the longest hover of each."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from formulations.p1 import P1
from formulations.parameters import Quantities, steps_for
from formulations.soc import AVAILABLE
from optuav.arrays import Booleans, Floats, Integers
from optuav.engines import closed_form
from optuav.modelling import Model
from optuav.network import vehicle
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity
from optuav.solving.assemble import mean_voltage_V
from optuav.solving.batch import delivered
from optuav.solving.plans import SAME_S

NO_ROUTE = -1


def variant_quantities(
    variants: Variants, number: Integers, itineraries: Integers, *, rests: bool, steps: bool = False
) -> Quantities:
    """Return the quantities of pairs of a variant and an itinerary, one entry a pair.

    Parameters
    ----------
    variants
        The variants of a mission.
    number, itineraries
        Of variant and itinerary (pair,); all itineraries direct, or all by way of a building.
    rests
        Whether a rest on the building may be chosen.
    steps
        Whether to include the steps on the way, which need all itineraries in one order.
    """
    battery, limits = variants.mission.battery, variants.mission.limits

    def take(values: Quantity) -> Quantity:
        return variants.take(values, number, itineraries)

    def full_J(key: str, voltage_V: Quantity) -> Quantity:
        """Return what the full battery holds; computed if its stated energy was dropped."""
        stated_J = getattr(battery, key)
        if stated_J is not None:
            return take(stated_J)
        if getattr(variants.base.network.mission.battery, key) is None:
            return None
        return take(battery.packs) * take(battery.capacity_As) * voltage_V

    nominal_V = take(battery.nominal_voltage_V)
    hover, hover_m = variants.hover_load, variants.position_m[:, HOVER]
    at_hover = vehicle.Flow(*(each[:, [HOVER]] for each in variants.received))
    flight_J, flight_As = take(variants.flight_energy_J), take(variants.flight_charge_As)
    flight_V = mean_voltage_V(flight_J, flight_As, nominal_V)
    hover_V = mean_voltage_V(take(hover.power_W), take(hover.current_A), nominal_V)
    return Quantities(
        deadline_s=take(limits.deadline_s),
        min_soc=take(limits.min_soc),
        packs=take(battery.packs),
        capacity_As=take(battery.capacity_As),
        nominal_voltage_V=nominal_V,
        flight_time_s=take(variants.flight_time_s),
        flight_charge_As=flight_As,
        flight_energy_J=flight_J,
        hover_current_A=take(hover.current_A - at_hover.current_A),
        hover_power_W=take(hover.power_W),
        hover_received_W=take(at_hover.power_W),
        rest_current_A=take(variants.rest_load.current_A),
        rest_received_W=take(variants.rest_load.power_W),
        flight_voltage_V=flight_V,
        hover_voltage_V=hover_V,
        flight_battery_J=full_J("flight_energy_J", flight_V),
        hover_battery_J=full_J("hover_energy_J", hover_V),
        available_fraction=take(battery.available_fraction),
        flow_rate_per_s=take(battery.flow_rate_per_s),
        hover_distance_m=take(variants.hover_distance_m),
        coverage_radius_m=take(variants.coverage_radius_m),
        hover_altitude_m=take(hover_m[:, 2:]),
        min_altitude_m=take(limits.min_altitude_m),
        max_altitude_m=take(limits.max_altitude_m),
        end_gap_m=0.0,
        steps=_steps(variants, number, itineraries, rests) if steps else (),
        tapers=battery.charging == "taper",
        rests=rests,
    )


def _steps(
    variants: Variants, number: Integers, itineraries: Integers, rests: bool
) -> tuple[Stage | str, ...]:
    """Return the stages of the legs, and the stays by name."""
    loads, ends = variants.loads, variants.base.network.legs.end
    every = np.zeros(len(number))
    found: list[Stage | str] = []
    for legs in variants.base.network.routes.legs[itineraries].T:
        if legs[0] == NO_LEG:
            continue
        for duration_s, current_A in zip(loads.durations_s, loads.currents_A, strict=True):
            here = variants.take(duration_s, number, legs)
            drawn = variants.take(current_A, number, legs)
            if np.any(here):
                found.append(Stage(every - drawn, every + here))
        if ends[legs[0]] == HOVER:
            found.append("hover")
        elif ends[legs[0]] >= FIRST_BUILDING and rests:
            found.append("rest")
    return tuple(found)


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
        rests=bool(variants.base.network.routes.building[itinerary] >= 0),
        steps=perspective == AVAILABLE,
    )
    return P1().model(replace(given, steps=steps_for(given.steps, varies=True)), perspective)


def _hover_times_s(
    variants: Variants, number: Integers, itineraries: Integers, perspective: Perspective
) -> Floats:
    """Return the longest hover of pairs of variant and itinerary [s], NaN without a plan."""
    routes = variants.base.network.routes
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
