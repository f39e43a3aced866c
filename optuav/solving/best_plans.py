"""The best plan of every variant of a mission, from arrays, with the answers of `optuav.solve`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES, tapered
from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines import bracket
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.modelling.check import TOLERANCE, evaluated
from optuav.modelling.forms import CONSTANT, Exponential, Monomial
from optuav.network.feasibility import TOLERANCE as RIM
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER, as_points
from optuav.network.routes import usable_routes
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.physics.kibam import Battery, Shift, Stage, Tilted, tilted_after
from optuav.physics.quantity import Quantity
from optuav.solving.assemble import (
    Single,
    chosen,
    figures,
    quantities,
    single,
    table_entries,
    turned,
)
from optuav.solving.longest import longest
from optuav.solving.outcome import TIMES, longest_by_balance, shortest_by_balance, tied
from optuav.solving.question import Question, answer
from optuav.status import SAME_S, Status

Codes: TypeAlias = npt.NDArray[np.int8]

STATUSES = tuple(Status)
REASONS = {
    "none": "there is a plan",
    "contradiction": "the numbers of the mission contradict each other, as where "
    "limits.max_altitude_m is below limits.min_altitude_m",
    "no_lift": "the UAV cannot fly: full thrust does not carry weight and wind "
    "(body.mass_kg, wind.force_N, rotor.max_speed_rad_s)",
    "out_of_reach": "the device is out of reach of the hover point "
    "(link.device_m, link.transmit_power_W, limits.outage_probability, limits.min_altitude_m)",
    "altitude": "route.hover_m is outside limits.min_altitude_m and limits.max_altitude_m",
    "blocked": "no route that the problem may take can be flown past the buildings "
    "(flight.through_buildings)",
    "late": "the shortest flight alone takes longer than limits.deadline_s",
    "charge": "the battery does not hold the charge for any route",
    "wells": "on every route the available well runs dry or is charged past full",
    "together": "no times satisfy all constraints together",
    "unbounded": "no constraint keeps the objective finite",
    "unknown": "the engine found neither times nor proof that there are none",
    "error": "the engine failed, met numbers that it cannot use, or returned times that violate a "
    "constraint",
}
"""Why a variant has no plan: short names, whose places are the codes, and sentences."""
TURNS = 3  # In which routes are bracketed: the likeliest of what is left, and then all of that
STEPS = 4  # Newton's from a bound by charge, after which as a rule they are below rounding
BEYOND_S = 1e-6  # So far beyond the moment that they find the well is shown to be empty
ROUNDING = 1e-11  # Share of the capacity by which it is short there, more than brackets allow
CODES = {name: code for code, name in enumerate(REASONS)}


@dataclass(frozen=True)
class Best:
    """The best plan of every variant; arrays with one entry a variant.

    Without a plan times and charges are NaN, the route −1.
    """

    hover_time_s: Floats
    rest_time_s: Floats
    flight_time_s: Floats
    mission_time_s: Floats
    # State of charge at the end by perspective of the paper [-].
    soc_battery: Floats
    soc_energy: Floats
    soc_adjusted: Floats
    route: Integers
    status: Codes  # Number in `STATUSES`
    reason: Codes  # Number in `REASONS`
    # And what no plan is better than if that is open; NaN for none
    objective: Floats
    bound: Floats

    @classmethod
    def none(cls, count: int) -> Best:
        """No plan anywhere, and not known why."""
        a, b, c, d, e, f, g, h, i = (np.full(count, np.nan) for _ in range(9))
        status, reason = (np.zeros(count, np.int8) for _ in range(2))
        return cls(a, b, c, d, e, f, g, np.full(count, -1), status, reason, h, i)


class Candidates(NamedTuple):
    """Times on routes that tie for the best, in the order of the variants and of the routes."""

    variant: Integers
    route: Integers
    hover_time_s: Floats
    rest_time_s: Floats
    # By variant: the status of its best candidate, or without one.
    status: Codes
    otherwise: Codes
    # Of a question that is answered by an engine
    objective: Floats | None = None
    bound: Floats | None = None  # By variant; NaN where the answer is proved


def takes_arrays(mission: Mission, question: Question) -> bool:
    """Whether `best_plans` answers a question; else each mission is solved by itself."""
    problem, through_wells = question.problem, question.perspective not in PAPER
    searched = question.several or question.p1.hover_point == "free"
    compared = isinstance(problem, P2) and through_wells  # with (P1), for its proof
    return not (searched or compared or mission.battery.takes_turns)


def best_plans(variants: Variants, question: Question, table: Quantities | None = None) -> Best:
    """The best plans with one stop by the tie rule of `optuav.solve`, one a variant.

    The `figures` of the variants may be known.
    """
    problem, perspective = question.problem, question.perspective
    table, early = table or figures(variants), impossible(variants)
    able, longest_hover = allowed(variants, problem, early == 0), type(problem) in (P1, P3, P4)
    if perspective == "wells" or not longest_hover:
        found = _answered(variants, question, table, able)
    elif perspective == AVAILABLE:
        found = _never_dry(variants, table, able)
    else:
        found = _by_balance(variants, table, able, perspective)
    flown_s = table_entries(table.flight_time_s, found.variant, found.route)
    flight_s = np.broadcast_to(flown_s, found.variant.shape)
    mission_s = flight_s + found.hover_time_s + found.rest_time_s
    shortest = tied(found.variant, mission_s)
    won = shortest[np.flatnonzero(np.diff(found.variant[shortest], prepend=-1))]  # The first
    variant, route = found.variant[won], found.route[won]
    hover_s, rest_s = found.hover_time_s[won], found.rest_time_s[won]
    given = chosen(table, route, variant)
    soc = {name: PERSPECTIVES[name](given, hover_s, rest_s) for name in PAPER}
    counted = soc[perspective if perspective in PAPER else "battery"]
    if given.tapers:
        soc["battery"] = np.empty(len(variant))
        for some, steps in _in_steps(variants, table, variant, route):
            soc["battery"][some] = tapered(steps, hover_s[some], rest_s[some])
        counted = soc["battery"] if perspective == AVAILABLE else counted
    kept = np.arange(len(variant))
    if longest_hover:
        late = mission_s[won] > (1.0 + TOLERANCE) * given.deadline_s
        refuted = late | (counted < given.min_soc - TOLERANCE)
        found.otherwise[variant[refuted]] = STATUSES.index(Status.ERROR)
        kept = np.flatnonzero(~refuted)
    plans = {
        "hover_time_s": hover_s,
        "rest_time_s": rest_s,
        "flight_time_s": flight_s[won],
        "mission_time_s": mission_s[won],
        **{f"soc_{name}": values for name, values in soc.items()},
        "route": route,
        "status": found.status[variant],
        "reason": CODES["none"],
        "objective": hover_s if found.objective is None else found.objective[won],
        "bound": np.nan if found.bound is None else found.bound[variant],
    }
    if len(kept) == variants.count:
        return Best(**{name: np.broadcast_to(each, variant.shape) for name, each in plans.items()})
    best = Best.none(variants.count)
    best.status[:] = found.otherwise
    why = _reasons(variants, table, able, found.otherwise, question)
    best.reason[:] = np.where(early > 0, early, why)
    for name, values in plans.items():
        getattr(best, name)[variant[kept]] = np.broadcast_to(values, variant.shape)[kept]
    return best


def hover_times_s(variants: Variants, perspective: Perspective, least_s: float = 0.0) -> Floats:
    """The longest hover by variant and itinerary [s], −∞ without a plan.

    Also −∞ where one that is shorter than the least of interest, ≥ 0, is not sought.
    """
    table = figures(variants)
    able = allowed(variants, P1(), impossible(variants) == 0)
    if perspective != AVAILABLE:
        return _longest(variants, _balance(table, perspective), able).T
    most_s = _most_s(variants, table, able)
    hover_s = np.full(most_s.shape, -np.inf)
    route, variant = np.nonzero(most_s >= least_s)
    for some, given in _in_steps(variants, table, variant, route):
        found, *_ = _bracketed(given, len(some), shortest_rest=False, least_s=least_s)
        hover_s[route[some], variant[some]] = np.nan_to_num(found, nan=-np.inf)
    return hover_s.T


def hover_bounds_s(network: Network, perspective: str) -> Floats:
    """What no Δ exceeds by route [s], −∞ where none can be flown; see `_well_bound`."""
    tables, table = single(network)
    balance = _balance(table, perspective if perspective in PAPER else "battery")
    most_s = np.where(network.routes.flyable[:, None], longest_by_balance(*balance), -np.inf)
    if perspective == AVAILABLE and not table.tapers:
        most_s = np.minimum(most_s, _well_bound(tables, table, most_s))
    return np.asarray(most_s[:, 0])


def impossible(variants: Variants) -> Codes:
    """Codes of why no route can be flown, whatever its way and the battery; 0 where one may."""
    mission, limits = variants.mission, variants.mission.limits
    hover_m, radius_m = variants.position_m[:, [HOVER]], variants.coverage_radius_m
    stated, altitude_m = mission.route.hover_m is not None, hover_m[..., 2]
    away_m = np.sqrt(((hover_m - as_points(mission.link.device_m)) ** 2).sum(axis=-1))
    outside = (altitude_m < limits.min_altitude_m) | (altitude_m > limits.max_altitude_m)
    # Of those that apply, the last is stated.
    cases = {
        "altitude": stated & outside,
        "out_of_reach": np.isnan(altitude_m) | (stated & (away_m > radius_m * (1.0 + RIM))),
        "no_lift": ~np.isfinite(np.atleast_2d(variants.hover_load.current_A)),
        "contradiction": np.atleast_2d(limits.min_altitude_m > limits.max_altitude_m),
    }
    code = np.zeros((variants.count, 1), np.int8)
    for name, applies in cases.items():
        if applies.any():
            code[np.broadcast_to(applies, code.shape)] = CODES[name]
    return code[:, 0]


def allowed(variants: Variants, problem: Formulation, possible: Booleans) -> Booleans:
    """Which routes a problem may take, and that can be flown (variant or 1, route)."""
    routes, name = variants.network.routes, problem.trajectory or "optimal"
    able, flight_s = variants.able, variants.flight[0]
    if not possible.all():
        able = able & possible[:, None]
    if problem.building is not None:
        number = variants.network.mission.buildings.names.index(problem.building)
        able = able & (routes.building == number)
    if isinstance(problem, P3):
        able = able & (routes.building < 0)
    away_m = variants.position_m[:, FIRST_BUILDING:] - as_points(variants.mission.link.device_m)
    return usable_routes(routes, name, problem.order, able, flight_s, away_m)


def _reasons(
    variants: Variants, table: Quantities, able: Booleans, otherwise: Codes, question: Question
) -> Codes:
    """Codes of why there is no plan, where there is none and it is not `impossible`."""
    flight_s = np.where(able, table.flight_time_s, np.inf).min(axis=1, keepdims=True)
    last = "together"
    if type(question.problem) in (P1, P3, P4):
        last = "wells" if question.perspective == AVAILABLE else "charge"
    code = np.full(variants.count, CODES[last], np.int8)
    if last == "wells":
        some_s = _longest(variants, _balance(table, "battery"), able)
        code[(some_s < 0.0).all(axis=0)] = CODES["charge"]
    code[np.broadcast_to((flight_s > table.deadline_s)[:, 0], code.shape)] = CODES["late"]
    code[np.broadcast_to(~able.any(axis=1), code.shape)] = CODES["blocked"]
    for status in Status.UNBOUNDED, Status.UNKNOWN, Status.ERROR:
        code[otherwise == STATUSES.index(status)] = CODES[status.value]
    return code


def _balance(table: Quantities, perspective: Perspective) -> tuple[Quantity, ...]:
    """What is left at the end without stays, what hovering takes and resting brings, and the time.

    Of the state of charge, which is affine in both times, above η0: [-], [1/s], [1/s], [s]; each a
    number or (route or 1, variant or 1), as NumPy is fastest along many variants.
    """
    given = turned(table)
    keys: list[Monomial] = [frozenset({(name, "time")}) for name in TIMES]
    hover, rest = keys
    times = (Exponential({each: 1.0}) for each in (hover, rest))
    terms = (PERSPECTIVES[perspective](given, *times) - given.min_soc).terms
    return terms[CONSTANT], -terms[hover], terms[rest], given.time_left


def _longest(variants: Variants, balance: tuple[Quantity, ...], able: Booleans) -> Floats:
    """The longest Δ by `_balance` (route, variant) [s], −∞ where none is possible."""
    hover_s = longest_by_balance(*balance)
    if not able.all():
        hover_s = np.where(able.T, hover_s, -np.inf)
    return np.broadcast_to(hover_s, (len(variants.network.routes), variants.count))


def _by_balance(
    variants: Variants, table: Quantities, able: Booleans, perspective: Perspective
) -> Candidates:
    """The longest hovers that tie, by a state of charge that is affine in both times."""
    balance = _balance(table, perspective)
    hover_s = _longest(variants, balance, able)
    least_s = np.maximum(hover_s.max(axis=0) - SAME_S, 0.0)
    best = np.flatnonzero((hover_s >= least_s).T)
    variant = best // len(hover_s)
    route = best - len(hover_s) * variant
    times_s = hover_s[route, variant]
    own = (table_entries(each, route, variant) for each in balance)
    rests_s = shortest_by_balance(times_s, *own)
    known = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    return Candidates(variant, route, times_s, rests_s, *known)


def _never_dry(variants: Variants, table: Quantities, able: Booleans) -> Candidates:
    """The longest hovers that the available well admits.

    Routes that cannot be the best by a bound are left out: the likeliest is bracketed first.
    """
    most_s = _most_s(variants, table, able)
    hover_s, rest_s, beyond_s = (np.full(most_s.shape, each) for each in (np.nan, np.nan, -np.inf))
    open_, every, least_s = most_s >= 0.0, np.arange(variants.count), np.zeros(variants.count)
    for turn in range(TURNS):
        if turn < TURNS - 1:
            route = np.where(open_, most_s, -np.inf).argmax(axis=0)
            (variant,) = np.nonzero(open_[route, every])
            route = route[variant]
        else:
            route, variant = np.nonzero(open_)
        for some, given in _in_steps(variants, table, variant, route):
            at = route[some], variant[some]
            found = _bracketed(given, len(some), least_s=least_s[at[1]])
            for into, values in zip((hover_s, rest_s, beyond_s), found, strict=True):
                into[at] = values
        top_s = np.fmax.reduce(hover_s, axis=0)
        least_s = np.fmax(top_s - SAME_S, 0.0)
        open_[route, variant] = False
        open_ &= ~(most_s < least_s)
    variant, route = np.nonzero((hover_s >= least_s).T)
    not_closed = beyond_s.max(axis=0) > top_s + SAME_S
    status, otherwise = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    status[not_closed] = STATUSES.index(Status.FEASIBLE)
    otherwise[~np.isneginf(beyond_s).all(axis=0)] = STATUSES.index(Status.UNKNOWN)
    times_s = hover_s[route, variant], rest_s[route, variant]
    return Candidates(variant, route, *times_s, status, otherwise)


def _most_s(variants: Variants, table: Quantities, able: Booleans) -> Floats:
    """What no Δ exceeds where the wells count (route, variant) [s], −∞ where none is possible."""
    most_s = _longest(variants, _balance(table, "battery"), able)
    return most_s if table.tapers else np.minimum(most_s, _well_bound(variants, table, most_s))


def _in_steps(
    variants: Variants, table: Quantities, variant: Integers, route: Integers
) -> Iterator[tuple[Integers, Quantities]]:
    """Numbers of itineraries that one declaration serves, and their quantities with the steps.

    Where the available well falls all along a flight, its stages are one step.
    """
    falls = np.broadcast_to(variants.falls_in_flight[:, 0], variants.count)[variant]
    for shifts, alike in (variants.shifts, falls & (not table.tapers)), ((), ~falls | table.tapers):
        own = np.flatnonzero(alike)
        for which, rests in _groups(variants, route[own], ordered=True):
            here = own[which]
            yield (
                here,
                quantities(
                    variants, route[here], variant[here], rests=rests, known=table, shifts=shifts
                ),
            )


def _bracketed(
    given: Quantities, count: int, *, shortest_rest: bool = True, least_s: Quantity = 0.0
) -> tuple[Floats, Floats, Floats]:
    """Longest Δ and T' of itineraries, and what no Δ exceeds [s]."""
    if not given.tapers:
        return longest(given, count, shortest_rest=shortest_rest, least_s=least_s)
    found = bracket.solve(P1().model(given, AVAILABLE), count)
    assert found.beyond is not None
    hover_s, rest_s = (found.values.get(name, np.zeros(count)) for name in TIMES)
    return hover_s, rest_s, found.beyond


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _well_bound(variants: Variants | Single, table: Quantities, most_s: Floats) -> Floats:
    """What no Δ exceeds (route, variant) [s]: from full wells, over one flight, to the next's end.

    Wells that hold more keep holding more (`optuav.physics.kibam`): no rest leaves more than full
    wells, and before the next stay the available well must not be empty. Newton's method finds
    where it is; just beyond, it is shown to be below 0 and to fall. Else the bound is infinite.
    """
    given, routes = turned(table), variants.network.routes
    pool = Battery(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    first, second, third = routes.legs.T
    rest_first = (routes.building >= 0) & routes.rest_first
    gained, tilted = tilted_after(pool, Tilted(0.0, 0.0), *variants.shifts)
    whole = gained, math.prod(each.remaining for each in variants.shifts), tilted
    before, after = (
        Shift(*(each.T[legs] for each in whole))
        for legs in np.where(rest_first, (second, third), (first, second))
    )
    hover = Exponential({frozenset({("hover", "time")}): 1.0})
    stages = before, Stage(-given.hover_current_A, hover), after
    charge = tilted_after(pool, Tilted(pool.capacity_As, 0.0), *stages)
    terms = charge.wells(pool).available_As.terms
    level, slope, bend = (
        terms.get(each, 0.0)
        for each in (CONSTANT, *(frozenset({("hover", kind)}) for kind in ("time", "levelling")))
    )
    rate_per_s, bound_s = pool.rate_per_s, most_s
    for step in range(STEPS + 1):
        levelled_s = np.expm1(-rate_per_s * bound_s) / -rate_per_s
        left = level + slope * bound_s + bend * levelled_s
        falls = slope + bend * (1.0 - rate_per_s * levelled_s)
        if step < STEPS:
            bound_s = bound_s - left / falls + (BEYOND_S if step == STEPS - 1 else 0.0)
    proved = (left < -ROUNDING * pool.capacity_As) & (falls < 0.0) & (slope <= 0.0)
    return np.where(proved & (bound_s >= 0.0), bound_s, np.inf)


def _answered(
    variants: Variants, question: Question, table: Quantities, able: Booleans
) -> Candidates:
    """What an engine finds on every route."""
    status, otherwise = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    through_wells, parts = question.perspective not in PAPER, list[tuple[Any, ...]]()
    beyond = np.full(variants.count, -np.inf)
    every = np.nonzero(np.broadcast_to(able, (variants.count, able.shape[1])))
    for own, rests in _groups(variants, every[1], ordered=through_wells):
        variant, route = every[0][own], every[1][own]
        given = quantities(variants, route, variant, rests=rests, steps=through_wells, known=table)
        model, values = question.problem.declared(given, question.perspective)
        if any(each.name == "rest_time_s" for each in model.variables) != rests:
            continue  # the problem has no use for the rests of these routes
        found = answer(model, len(variant), question, values)
        codes = np.array([STATUSES.index(each) for each in found.statuses], np.int8)
        answered = np.isin(codes, [k for k, each in enumerate(STATUSES) if each.has_answer])
        refuted = _refuted(model, {**found.given, **found.values}, answered)
        codes[refuted], answered = STATUSES.index(Status.ERROR), answered & ~refuted
        for known in Status.UNKNOWN, Status.UNBOUNDED, Status.ERROR:
            otherwise[variant[codes == STATUSES.index(known)]] = STATUSES.index(known)
        # The best of some routes may be better than what was found on them.
        if found.beyond is None:
            for known in Status.UNKNOWN, Status.FEASIBLE, Status.LOCALLY_OPTIMAL:
                short = Status.FEASIBLE if known is Status.UNKNOWN else known
                status[variant[codes == STATUSES.index(known)]] = STATUSES.index(short)
        else:
            np.fmax.at(beyond, variant, found.beyond)
        times = (found.values.get(name, np.zeros(len(variant))) for name in TIMES)
        columns = variant, route, *times, found.objective * model.towards
        parts.append(tuple(each[answered] for each in columns))
    none = np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros(0), np.zeros(0), np.zeros(0)
    variant, route, hover_s, rest_s, score = map(np.concatenate, zip(none, *parts, strict=True))
    # Where a programme has no bound, or no numbers, no answer to another is the best.
    void = np.isin(otherwise, [STATUSES.index(s) for s in (Status.UNBOUNDED, Status.ERROR)])
    order = np.lexsort((route, variant))
    order = order[~void[variant[order]]]
    order = order[tied(variant[order], -score[order])]
    variant, route = variant[order], route[order]
    open_ = beyond[variant] > score[order] + SAME_S
    status[variant[open_]] = STATUSES.index(Status.FEASIBLE)
    towards = model.towards if parts else 1.0
    objective, bound = towards * score[order], np.full(variants.count, np.nan)
    bound[variant[open_]] = towards * beyond[variant[open_]]
    hover_s, rest_s = hover_s[order], rest_s[order]
    return Candidates(variant, route, hover_s, rest_s, status, otherwise, objective, bound)


def _refuted(model: Model, point: Values, answered: Booleans) -> Booleans:
    """Which answers violate a constraint when they are evaluated again, outside the engine."""
    with np.errstate(invalid="ignore", over="ignore"):  # where there is no answer
        held = [np.broadcast_to(r.satisfied, answered.shape) for r in evaluated(model, point)]
    return np.asarray(answered & ~np.logical_and.reduce(held, initial=True))


def _groups(
    variants: Variants, route: Integers, *, ordered: bool
) -> Iterator[tuple[Integers, bool]]:
    """Numbers of itineraries that one declaration serves, and whether they may rest.

    Where the order of the stays matters, all have the same.
    """
    routes = variants.network.routes
    by_way, first = routes.building[route] >= 0, routes.rest_first[route]
    for group in (~by_way, by_way & first, by_way & ~first) if ordered else (~by_way, by_way):
        if len(which := np.flatnonzero(group)):
            yield which, bool(by_way[which[0]])


def _every(variants: Variants, status: Status) -> Codes:
    """One status for all variants."""
    return np.full(variants.count, STATUSES.index(status), np.int8)
