"""The best plan of every variant of a mission, from arrays, with the answers of `optuav.solve`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES, start_charge, tapered
from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines import bracket
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.modelling.check import CONSTRAINT_TOLERANCE, evaluated
from optuav.modelling.forms import CONSTANT, Exponential, Monomial, part
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.physics.kibam import Battery, Shift, Stage, Tilted, start, tilted_after
from optuav.physics.quantity import Quantity
from optuav.solving.assemble import quantities, route_quantities, select, table_entries, transpose
from optuav.solving.balance import (
    TIMES,
    Balance,
    balance,
    flight_and_rest_bounds_s,
    longest_by_balance,
    shortest_by_balance,
)
from optuav.solving.longest import longest, shortest_rests
from optuav.solving.question import MOST_ROWS, Question, count_of_routes, solve_model
from optuav.solving.ranking import tied
from optuav.solving.route_models import by_shares, declarations, permitted_routes, routes_by_kind
from optuav.status import SAME_S, Status

Codes: TypeAlias = npt.NDArray[np.int8]

STATUSES = tuple(Status)
LONGEST_HOVER_PROBLEMS = P1, P3, P4  # The problems of the longest hover
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
    "(flight.obstacles)",
    "late": "the shortest flight takes longer than limits.deadline_s",
    "charge": "the battery does not hold the charge for any route",
    "wells": "on every route the available well runs dry or is charged past full",
    "together": "no times satisfy all constraints together",
    "unbounded": "no constraint keeps the objective finite",
    "unknown": "the engine found neither times nor proof that none exist",
    "error": "the engine failed, met numbers that it cannot use, or returned times that violate a "
    "constraint",
    "too_windy": "the UAV cannot fly: the wind is faster than its largest air speed "
    "(wind.velocity_m_s, flight.max_speed_m_s)",
}
"""Why a variant has no plan: short names, whose places are the codes, and sentences."""
SLACK_S = 2.0 * SAME_S  # Tolerance of a bound for rounding and ties [s]
BRACKET_ROUNDS = 3  # Rounds of bracketing: the most promising open routes; at last, all open ones
NEWTON_STEPS = 4  # Newton's steps from a bound by charge; further ones are below rounding as a rule
BEYOND_S = 1e-6  # Time after Newton's moment when the well is shown to be empty [s]
ROUNDED_WELL = 1e-11  # Share of the capacity missing from the well then, more than brackets allow
HOVER_TIME: Monomial = frozenset({("hover", "time")})
HOVERING = Exponential({HOVER_TIME: 1.0})
CODES = {name: code for code, name in enumerate(REASONS)}


@dataclass(frozen=True)
class BestPlans:
    """The best plan of every variant; arrays with one entry per variant.

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
    objective: Floats
    bound: Floats  # No plan passes it if the answer is open; else NaN

    @classmethod
    def none(cls, count: int) -> BestPlans:
        """No plan anywhere, and not known why."""
        arrays: dict[str, Any] = {field.name: np.full(count, np.nan) for field in fields(cls)}
        codes = {name: np.zeros(count, np.int8) for name in ("status", "reason")}
        return cls(**arrays | codes | {"route": np.full(count, -1)})


class TiedPlans(NamedTuple):
    """Times on routes that tie for the best, in the order of the variants and of the routes."""

    variant: Integers
    route: Integers
    hover_time_s: Floats
    rest_time_s: Floats
    # By variant: the status of its best candidate, or without one.
    status: Codes
    otherwise: Codes
    objective: Floats | None = None  # Only for a question that an engine answers
    bound: Floats | None = None  # By variant; NaN where the answer is proved


def takes_arrays(mission: Mission, question: Question) -> bool:
    """Return whether `best_plans` answers a question; else each mission is solved separately."""
    problem, through_wells = question.problem, question.perspective not in PAPER
    # with (P1), for its proof
    compared = isinstance(problem, P2) and through_wells and not wants_hover(question)
    many = bool(mission.devices) and count_of_routes(mission, problem) > MOST_ROWS
    several = question.several or question.searched
    return not (several or compared or many or mission.battery.takes_turns)


def best_plans(variants: Variants, question: Question) -> BestPlans:
    """The best plans with one stop by the tie rule of `optuav.solve`, one per variant."""
    problem, perspective = question.problem, question.perspective
    table, early = route_quantities(variants), impossible(variants)
    able, longest_hover = (
        permitted_routes(variants, problem, early == 0),
        type(problem) in LONGEST_HOVER_PROBLEMS,
    )
    if rests := rests_for_hover(variants, question, able):
        answers = rests
    elif perspective == "wells" or not longest_hover:
        answers = _answered(variants, question, able)
    elif perspective == AVAILABLE:
        answers = _longest_by_wells(variants, able)
    else:
        answers = _by_balance(variants, able, perspective)
    flown_s = table_entries(table.flight_time_s, answers.variant, answers.route)
    flight_s = np.broadcast_to(flown_s, answers.variant.shape)
    mission_s = flight_s + answers.hover_time_s + answers.rest_time_s
    shortest = tied(answers.variant, mission_s)
    won = shortest[np.flatnonzero(np.diff(answers.variant[shortest], prepend=-1))]  # The first
    variant, route = answers.variant[won], answers.route[won]
    times_s = answers.hover_time_s[won], answers.rest_time_s[won]
    winners = select(table, route, variant)
    soc = {name: PERSPECTIVES[name](winners, *times_s) for name in PAPER}
    counted = soc[perspective if perspective in PAPER else "battery"]
    if winners.tapers:
        soc["battery"] = np.empty(len(variant))
        for some, steps in in_steps(variants, variant, route):
            soc["battery"][some] = tapered(steps, *(time_s[some] for time_s in times_s))
        counted = soc["battery"] if perspective == AVAILABLE else counted
    kept = np.ones(len(variant), bool)
    if longest_hover:
        late = mission_s[won] > (1.0 + CONSTRAINT_TOLERANCE) * winners.deadline_s
        kept = ~(late | (counted < winners.min_soc - CONSTRAINT_TOLERANCE))
        answers.otherwise[variant[~kept]] = STATUSES.index(Status.ERROR)
    columns = {
        "hover_time_s": times_s[0],
        "rest_time_s": times_s[1],
        "flight_time_s": flight_s[won],
        "mission_time_s": mission_s[won],
        **{f"soc_{name}": values for name, values in soc.items()},
        "route": route,
        "status": answers.status[variant],
        "reason": CODES["none"],
        "objective": times_s[0] if answers.objective is None else answers.objective[won],
        "bound": np.nan if answers.bound is None else answers.bound[variant],
    }
    plans = {name: _filled(column, variant.shape) for name, column in columns.items()}
    if np.count_nonzero(kept) == variants.count:
        return BestPlans(**plans)
    best = BestPlans.none(variants.count)
    best.status[:] = answers.otherwise
    why = _reasons(variants, able, answers.otherwise, question)
    best.reason[:] = np.where(early > 0, early, why)
    for name, values in plans.items():
        getattr(best, name)[variant[kept]] = values[kept]
    return best


def wants_hover(question: Question) -> bool:
    """Whether a question is for the shortest flight and rest for a hover through the wells."""
    problem = question.problem
    wanted = isinstance(problem, P2) and problem.hover_time_s is not None
    return wanted and question.perspective == AVAILABLE


def _always_draws(variants: Variants) -> bool:
    """Whether every hover takes charge from the battery."""
    received_A = variants.received[0][:, variants.network.places.hovers]
    return bool(np.all(variants.hover_load.current_A > received_A))


def rests_for_hover(variants: Variants, question: Question, able: Booleans) -> TiedPlans | None:
    """The shortest flights and rests that tie for a wanted hover through the wells.

    None for other questions, and where an engine has to search: a longer hover than wanted never
    needs less rest if every hover takes charge; else a bound by charge has to prove the answer.
    """
    hover_s = question.problem.hover_time_s if isinstance(question.problem, P2) else None
    table = route_quantities(variants)
    if hover_s is None or question.perspective != AVAILABLE or table.tapers:
        return None
    variant, route = np.broadcast_to(able, (variants.count, able.shape[1])).nonzero()
    rest_s = np.full(len(route), np.nan)
    for some, steps in in_steps(variants, variant, route):
        rest_s[some] = shortest_rests(steps, len(some), hover_s)
    known = ~np.isnan(rest_s)
    variant, route, rest_s = variant[known], route[known], rest_s[known]
    flown_s = np.broadcast_to(table_entries(table.flight_time_s, variant, route), rest_s.shape)
    best = tied(variant, flown_s + rest_s)
    variant, route, rest_s, flown_s = (x[best] for x in (variant, route, rest_s, flown_s))
    if not _always_draws(variants):
        least_s = np.where(able, flight_and_rest_bounds_s(variants, hover_s).T, np.inf).min(axis=1)
        shortest_s = np.full(variants.count, np.inf)
        np.minimum.at(shortest_s, variant, flown_s + rest_s)
        if not np.all(shortest_s <= least_s + SAME_S):  # NaN where no route is able
            return None
    codes = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    return TiedPlans(variant, route, np.full(len(route), hover_s), rest_s, *codes, flown_s + rest_s)


def hover_times_s(variants: Variants, perspective: Perspective, least_s: float = 0.0) -> Floats:
    """The longest hover by variant and itinerary [s], −∞ without a plan.

    Also −∞ if it is shorter than the least of interest, ≥ 0.
    """
    able = permitted_routes(variants, P1(), impossible(variants) == 0)
    if perspective != AVAILABLE:
        return _longest(variants, able, perspective).T
    most_s = _most_s(variants, able)
    hover_s = np.full(most_s.shape, -np.inf)
    route, variant = np.nonzero(most_s >= least_s)
    for some, steps in in_steps(variants, variant, route):
        times_s, *_ = bracketed(steps, len(some), shortest_rest=False, least_s=least_s)
        hover_s[route[some], variant[some]] = np.nan_to_num(times_s, nan=-np.inf)
    return hover_s.T


def hover_bounds_s(variants: Variants, perspective: Perspective) -> Floats:
    """Upper bounds of Δ (route, variant) [s], −∞ if it cannot be flown; see `_well_bound`."""
    if perspective == AVAILABLE:
        return _most_s(variants, variants.able)
    return _longest(variants, variants.able, perspective if perspective in PAPER else "battery")


def impossible(variants: Variants) -> Codes:
    """Codes of why no route can be flown, whatever its way and the battery; 0 where one may."""
    code = np.zeros((variants.count, 1), np.int8)
    for name, applies in reversed(variants.hindrances.items()):
        if applies.any():
            code[np.broadcast_to(applies, code.shape)] = CODES[name]
    return code[:, 0]


def _reasons(variants: Variants, able: Booleans, otherwise: Codes, question: Question) -> Codes:
    """Codes of the reasons why `able` variants have no plan."""
    table = route_quantities(variants)
    flight_s = np.where(able, table.flight_time_s, np.inf).min(axis=1, keepdims=True)
    last = "together"
    if type(question.problem) in LONGEST_HOVER_PROBLEMS:
        last = "wells" if question.perspective == AVAILABLE else "charge"
    code = np.full(variants.count, CODES[last], np.int8)
    if last == "wells":
        hover_s = _longest(variants, able, "battery")
        code[(hover_s < 0.0).all(axis=0)] = CODES["charge"]
    code[np.broadcast_to((flight_s > table.deadline_s)[:, 0], code.shape)] = CODES["late"]
    code[np.broadcast_to(~able.any(axis=1), code.shape)] = CODES["blocked"]
    for status in Status.UNBOUNDED, Status.UNKNOWN, Status.ERROR:
        code[otherwise == STATUSES.index(status)] = CODES[status.value]
    return code


def _longest(
    variants: Variants, able: Booleans, perspective: Perspective, known: Balance | None = None
) -> Floats:
    """The longest Δ by balance (route, variant) [s], −∞ where none is possible."""
    hover_s = longest_by_balance(known or balance(variants, perspective))
    if not able.all():
        hover_s = np.where(able.T, hover_s, -np.inf)
    return np.broadcast_to(hover_s, (len(variants.network.routes), variants.count))


def _by_balance(variants: Variants, able: Booleans, perspective: Perspective) -> TiedPlans:
    """The longest hovers that tie, by a state of charge that is affine in both times."""
    routes = balance(variants, perspective)
    hover_s = _longest(variants, able, perspective, routes)
    least_s = np.maximum(hover_s.max(axis=0) - SAME_S, 0.0)
    best = np.flatnonzero((hover_s >= least_s).T)
    variant = best // len(hover_s)
    route = best - len(hover_s) * variant
    times_s = hover_s[route, variant]
    balances = routes.map(lambda values: table_entries(values, route, variant))
    rests_s = shortest_by_balance(times_s, balances)
    known = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    return TiedPlans(variant, route, times_s, rests_s, *known)


def _longest_by_wells(variants: Variants, able: Booleans) -> TiedPlans:
    """The longest hovers that the available well allows.

    The most promising routes of each variant are bracketed first. Routes whose bound is shorter
    than the hover on them are left out.
    """
    most_s = _most_s(variants, able)
    hover_s, rest_s, beyond_s = (np.full(most_s.shape, fill) for fill in (np.nan, np.nan, -np.inf))
    open_, least_s = most_s >= 0.0, np.zeros(variants.count)
    for number in range(BRACKET_ROUNDS):
        if number < BRACKET_ROUNDS - 1:
            left_s = np.where(open_, most_s, np.nan)
            tops_s = np.fmax.reduce(left_s, axis=0) - SAME_S
            route, variant = np.nonzero(left_s >= tops_s)
        else:
            route, variant = np.nonzero(open_)
        for some, steps in in_steps(variants, variant, route):
            at = route[some], variant[some]
            hovers = bracketed(steps, len(some), least_s=least_s[at[1]])
            hover_s[at], rest_s[at], beyond_s[at] = hovers
        top_s = np.fmax.reduce(hover_s, axis=0)
        least_s = np.fmax(top_s - SAME_S, 0.0)
        open_[route, variant] = False
        open_ &= ~(most_s < least_s)
    variant, route = np.nonzero((hover_s >= least_s).T)
    most_s = beyond_s.max(axis=0)
    not_closed = most_s > top_s + SAME_S
    status, otherwise = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    status[not_closed] = STATUSES.index(Status.FEASIBLE)
    otherwise[~np.isneginf(beyond_s).all(axis=0)] = STATUSES.index(Status.UNKNOWN)
    times_s = hover_s[route, variant], rest_s[route, variant]
    bound_s = np.where(not_closed, most_s, np.nan)
    return TiedPlans(variant, route, *times_s, status, otherwise, bound=bound_s)


def _most_s(variants: Variants, able: Booleans) -> Floats:
    """Upper bounds of Δ through the wells (route, variant) [s], −∞ where none is possible."""
    most_s, tapers = _longest(variants, able, "battery"), route_quantities(variants).tapers
    return most_s if tapers else np.minimum(most_s, _well_bound(variants, most_s))


def in_steps(
    variants: Variants, variant: Integers, route: Integers
) -> Iterator[tuple[Integers, Quantities]]:
    """Numbers of itineraries that one declaration serves, and their quantities with the steps.

    The stages of a flight are one step if the available well falls all along it.
    """
    routes, shares = variants.network.routes, [device.share for device in variants.mission.served]
    whole = np.broadcast_to(variants.falls_in_flight[:, 0], variants.count)[variant]
    whole = whole & (not route_quantities(variants).tapers)
    for shifts, alike in (variants.shifts, whole), ((), ~whole):
        members = np.flatnonzero(alike)
        of_kind = routes_by_kind(routes, route[members], ordered=True, shares=shares)
        for group, rests in of_kind:
            batch = members[group]
            which = route[batch], variant[batch]
            yield batch, quantities(variants, *which, rests=rests, shifts=shifts)


def bracketed(
    table: Quantities, count: int, *, shortest_rest: bool = True, least_s: Quantity = 0.0
) -> tuple[Floats, Floats, Floats]:
    """Longest Δ and T' of itineraries, and upper bounds of Δ [s]."""
    if not table.tapers:
        return longest(table, count, shortest_rest=shortest_rest, least_s=least_s)
    solution = bracket.solve(P1().model(table, AVAILABLE), count)
    assert solution.beyond is not None
    hover_s, rest_s = (solution.values.get(name, np.zeros(count)) for name in TIMES)
    return hover_s, rest_s, solution.beyond


def _well_bound(variants: Variants, most_s: Floats) -> Floats:
    """Upper bounds of Δ (route, variant) [s]: the flights and hovers before a rest, and after it.

    Wells that hold more keep holding more (`optuav.physics.kibam`): no rest leaves more than full
    wells, and the available well must not be empty before the next stay.
    """
    table, routes = transpose(route_quantities(variants)), variants.network.routes
    pool = Battery(table.battery_As, table.available_fraction, table.flow_rate_per_s)
    gained, tilted = tilted_after(pool, Tilted(0.0, 0.0), *variants.shifts)
    whole = gained, math.prod(shift.remaining for shift in variants.shifts), tilted
    flights = [Shift(*(values.T[legs] for values in whole)) for legs in routes.legs.T]
    received_A, points = variants.received[0], variants.network.places.hovers
    net_A = (variants.hover_load.current_A - received_A[:, points]).T
    served, last = variants.mission.served, routes.devices.shape[1]
    shares, begin = np.array([device.share for device in served]), start_charge(pool, table)
    bound_s = np.full(most_s.shape, np.inf)
    for after in range(last + 1):
        (members,) = np.nonzero(routes.rest_after == after)
        parts = by_shares(routes.devices[members], shares.tolist()) if len(members) else ()
        for alike in parts:
            group = members[alike]
            # Numbers of the hovers, and of the flights more than hovers before them.
            until_rest = [(begin, range(after), 0)] * (after > 0)
            from_rest = [(start(pool), range(after, last), 1)] * (after < last)
            for charge, hovers, rested in until_rest + from_rest:
                stages = list[Stage | Shift]()
                for k in [*hovers, hovers.stop]:
                    stages.append(Shift(*(x[group] for x in flights[k + rested])))
                    if k < hovers.stop:
                        devices = routes.devices[group, k]
                        alone = devices[:1] if (devices == devices[:1]).all() else devices
                        hover = part(float(shares[devices[0]]), HOVERING)
                        stages.append(Stage(-net_A[alone], hover))
                known_s = _empty_by(pool, _of_group(charge, group), stages, most_s[group])
                bound_s[group] = np.minimum(bound_s[group], known_s)
    return bound_s


def _of_group(charge: Tilted, group: Integers) -> Tilted:
    """The charge at the start of some routes; it may be the same for all."""
    return Tilted(*(x[group] if np.ndim(x) and len(x) > 1 else x for x in charge))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _empty_by(
    pool: Battery, charge: Tilted, stages: Sequence[Stage | Shift], most_s: Floats
) -> Floats:
    """Upper bounds of Δ [s] by which the available well is empty at the end of some stages.

    Newton's method finds the moment when it is empty. Just after it, the well is shown to be below
    0 and to fall; else the bound is infinite.
    """
    terms = tilted_after(pool, charge, *stages).wells(pool).available_As.terms
    level, slope = (terms.get(monomial, 0.0) for monomial in (CONSTANT, HOVER_TIME))
    bends = [(s, c) for m, c in terms.items() for _, s in m if s != "time"]
    rate_per_s, bound_s = pool.rate_per_s, most_s
    for step in range(NEWTON_STEPS + 1):
        left, falls, rises = level + slope * bound_s, slope, slope
        for share, bend in bends:
            s_bound_s = bound_s if share == 1.0 else share * bound_s
            levelled_s = np.expm1(-rate_per_s * s_bound_s) / -rate_per_s
            left = left + bend * levelled_s
            by_share = bend * (1.0 - rate_per_s * levelled_s)
            by_share = by_share if share == 1.0 else share * by_share
            falls, rises = falls + by_share, rises + np.maximum(by_share, 0.0)
        if step < NEWTON_STEPS:
            bound_s = bound_s - left / falls + (BEYOND_S if step == NEWTON_STEPS - 1 else 0.0)
    sinks = (falls < 0.0) & (slope <= 0.0) & (rises <= 0.0)
    proved = (left < -ROUNDED_WELL * pool.capacity_As) & sinks
    return np.where(proved & (bound_s >= 0.0), bound_s, np.inf)


def _answered(variants: Variants, question: Question, able: Booleans) -> TiedPlans:
    """The answers of an engine on all routes."""
    status, otherwise = _every(variants, Status.OPTIMAL), _every(variants, Status.INFEASIBLE)
    columns, sign = list[tuple[Any, ...]](), 1.0
    beyond = np.full(variants.count, -np.inf)
    for of_kind, variant in declarations(question, variants, able):
        model, sign = of_kind.declared, of_kind.declared.sign
        solution = solve_model(model, len(variant), question, of_kind.given)
        codes = np.array([STATUSES.index(status) for status in solution.statuses], np.int8)
        answered = np.isin(codes, [k for k, status in enumerate(STATUSES) if status.has_answer])
        refuted = _refuted(model, {**solution.given, **solution.values}, answered)
        codes[refuted], answered = STATUSES.index(Status.ERROR), answered & ~refuted
        for known in Status.UNKNOWN, Status.UNBOUNDED, Status.ERROR:
            otherwise[variant[codes == STATUSES.index(known)]] = STATUSES.index(known)
        # The best of some routes may be better than the answers on them.
        if solution.beyond is None:
            for known in Status.UNKNOWN, Status.FEASIBLE, Status.LOCALLY_OPTIMAL:
                short = Status.FEASIBLE if known is Status.UNKNOWN else known
                status[variant[codes == STATUSES.index(known)]] = STATUSES.index(short)
        else:
            np.fmax.at(beyond, variant, solution.beyond)
        times = (solution.values.get(name, np.zeros(len(variant))) for name in TIMES)
        rows = variant, of_kind.routes, *times, solution.objective * sign, solution.ties
        columns.append(tuple(column[answered] for column in rows))
    none = *(np.zeros(0, np.intp) for _ in range(2)), *(np.zeros(0) for _ in range(4))
    answers = zip(none, *columns, strict=True)
    variant, route, hover_s, rest_s, score, ties = map(np.concatenate, answers)
    # If a programme has no bound, or no numbers, no answer to another is the best.
    void = np.isin(otherwise, [STATUSES.index(s) for s in (Status.UNBOUNDED, Status.ERROR)])
    order = np.lexsort((route, variant))
    order = order[~void[variant[order]]]
    order = order[tied(variant[order], -score[order], ties[order])]
    variant, route, score = variant[order], route[order], score[order]
    open_, bound = beyond[variant] > score + ties[order], np.full(variants.count, np.nan)
    status[variant[open_]] = STATUSES.index(Status.FEASIBLE)
    bound[variant[open_]] = sign * beyond[variant[open_]]
    times_s = hover_s[order], rest_s[order]
    return TiedPlans(variant, route, *times_s, status, otherwise, sign * score, bound)


def _refuted(model: Model, point: Values, answered: Booleans) -> Booleans:
    """Return which answers violate a constraint when evaluated again outside the engine."""
    with np.errstate(invalid="ignore", over="ignore"):  # without an answer
        held = [np.broadcast_to(r.satisfied, answered.shape) for r in evaluated(model, point)]
    return np.asarray(answered & ~np.logical_and.reduce(held, initial=True))


def _filled(values: Quantity, shape: tuple[int, ...]) -> Any:
    """An array of a shape, from one of it or from a number."""
    return values if np.shape(values) == shape else np.broadcast_to(values, shape)


def _every(variants: Variants, status: Status) -> Codes:
    """One status for all variants."""
    return np.full(variants.count, STATUSES.index(status), np.int8)
