"""(P1), (P3) and (P4) with the speeds of the legs free: how fast to fly each of them.

If only the charge at the end counts, one price of a second gives the speeds of all legs, with
proof; under `available`, and if η0 must be left at every landing, they are searched for (both in
`speed_search`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np

from formulations.formulation import Given
from formulations.parameters import QUANTITIES, Landing
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats, Integers
from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.modelling import Model, Parameter
from optuav.modelling.expression import Indexed
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity
from optuav.physics.rotary_wing import level_direction, level_length
from optuav.plan import Plan
from optuav.presentation.numbers import figure
from optuav.solving.assemble import legs_and_stays, quantities
from optuav.solving.best_plans import SLACK_S
from optuav.solving.program import Program, best_plan, declared_program
from optuav.solving.question import Question
from optuav.solving.ranking import best
from optuav.solving.route_models import RouteModel, routes_by_kind
from optuav.solving.speed_search import (
    LegSpeeds,
    RoutePrices,
    RoutePricing,
    RouteSpeeds,
    SpeedSearch,
    best_first,
    vector,
)
from optuav.status import SAME_S, Status

PRICED = "priced: every leg is cheapest at one price of a second, and the dual bound is met"
SEARCHED = "local: named and priced speeds, the best of them refined by ever smaller steps"
BOUNDED = "no legs, each with its least time, charge and tilt, hover longer"
TRIED = "a feasible plan: the best of the speeds that were tried within the time limit"
LATE = "the search for speeds did not end within the time limit"
NONE = "no ground speeds of the legs make a plan possible; at those that come nearest:"
NOT_FOUND = "no ground speeds were found that make a plan possible, and no proof that none do"
AT_LARGEST_SPEED = 1e-9  # Share of the largest speed within which a leg flies at it
DIGITS = 9  # Decimals of a price that are exact [A]
SAME_A = 1e-6  # Relative difference of prices that are one
LIFTS = 1e-12  # Share of the charge of a leg that a climb adds at least; less is rounding
REFUSED = (
    "speed = 'free' has no shadow prices of its own: optuav.explain has those at the speeds found"
)


def free_program(question: Question, mission: Mission) -> "FreeSpeedProgram":
    """(P1), (P3) or (P4) with the speeds of the legs free, for the routes that can be flown."""
    problem: Any = question.problem
    fixed = replace(question, problem=replace(problem, speed="mission"), time_limit_s=None)
    speeds, parts = LegSpeeds(build_network(mission)), list[RouteModel]()
    fastest = declared_program(fixed, speeds.fastest)
    reached = np.concatenate([np.zeros(0, np.intp), *(part.routes for part in fastest.parts)])
    routes, ways_m = speeds.network.routes, vector(speeds.ways_m)
    # Missing segments, those straight up or down, and those that have a speed.
    kinds = np.sign(level_length(ways_m)) + 1.0
    legs = routes.legs[reached]
    kinds_of_legs = np.where(legs == NO_LEG, 0.0, np.nan_to_num(kinds)[:, legs])
    kinds_of_legs = np.moveaxis(kinds_of_legs, 1, 0).reshape(len(reached), 3 * len(kinds_of_legs))
    for alike in np.unique(kinds_of_legs, axis=0):
        members = np.sort(reached[(kinds_of_legs == alike).all(axis=1)])
        ordered = question.perspective not in PAPER or mission.limits.keep_soc == "always"
        for group, rests in routes_by_kind(routes, members, ordered=ordered):
            which = members[group]
            parts.append(RouteModel(_declared(question, speeds, which, rests), which))
    return FreeSpeedProgram(question, speeds.network, tuple(parts), fastest.reasons, fixed, speeds)


@dataclass(frozen=True)
class FreeSpeedProgram(Program):
    """A program whose legs have unknown speeds: print it, check points, or solve it."""

    stated: Question  # The same at given speeds
    speeds: LegSpeeds

    def solve(self) -> Plan:
        """The best plan: optimal by its dual bound, or under `available` the best one found."""
        if not self.parts:
            return self._at(self.speeds.fastest)
        routes = np.sort(np.concatenate([part.routes for part in self.parts]))
        always = self.network.mission.limits.keep_soc == "always"
        searched = self.question.perspective == AVAILABLE or always
        return self._searched(routes) if searched else self._priced(routes)

    def _at(self, network: Network) -> Plan:
        """The best plan at the speeds of a network."""
        return best_plan(self.stated, network)

    def _priced(self, routes: Integers) -> Plan:
        """The best plan by the price of a second."""
        pricing = RoutePricing.of(self.speeds, routes, self.question.perspective)
        tried, least_s = dict[int, RoutePrices](), -math.inf
        for number, prices in best_first(pricing):
            if prices.bound_s[0] < least_s:
                break
            tried[number] = prices
            # Without a hover so far, a bound below 0 proves that no other route has one.
            least_s = max(least_s, prices.hover_s[0] - SLACK_S, min(prices.bound_s[0], 0.0))
        most_s, numbers = float(tried[next(iter(tried))].bound_s[0]), sorted(tried)
        likely = RoutePrices(*np.concatenate([tried[number] for number in numbers], axis=1))
        hover_s = np.where(likely.hover_s >= 0.0, likely.hover_s, np.nan)
        mission_s = likely.flight_s + hover_s + likely.rest_s
        place = best(hover_s, mission_s, self.network.routes.building[routes[numbers]] >= 0)
        chosen = 0 if place is None else numbers[place]  # The reasons are those of the first route
        prices = tried.get(chosen) or pricing.take(np.array([chosen])).prices()
        speeds = self.speeds.only(int(routes[chosen]))
        plan = self._at(speeds.at(speeds.priced(float(prices.price_A[0]))))
        if not plan:
            return plan.model_copy(update={"reasons": (NONE, *plan.reasons), "proof": PRICED})
        return _bounded(plan, most_s, PRICED, Status.FEASIBLE)

    def _searched(self, routes: Integers) -> Plan:
        """The best plan that a search finds."""
        limit_s, perspective = self.question.time_limit_s, self.question.perspective
        search = SpeedSearch(self.speeds, routes, limit_s, perspective)
        tops, most_s = search.tops(), max(search.bounds_s.values())
        if self.network.mission.battery.charging == "taper":  # It was searched without
            searched = {top.branch for top in tops}
            tops += [trial for trial in search.tried if trial.branch in searched]
        else:
            tops = [max(tops, key=lambda top: top.value)] if tops else []
        plans = []
        for top in (top for top in tops if top.value >= 0.0):
            route = search.of_route(top.branch)
            real = RouteSpeeds(self.speeds.only(top.branch))
            plans.append(self._at(real.at(top.at * route.largest_m_s)))
        plan = max(filter(None, plans), key=lambda each: each.hover_time_s, default=None)
        if plan is not None:
            limited = Status.FEASIBLE if search.ended else Status.LOCALLY_OPTIMAL
            plan = _bounded(plan, most_s, TRIED if search.ended else SEARCHED, limited)
            late = (LATE,) if search.ended else ()
            return plan.model_copy(update={"notes": (*late, *plan.notes)})
        if search.ended:
            raise SolverError(f"{LATE}, without a plan or proof that none exists")
        nearest = self._priced(routes)
        if most_s < 0.0:
            return nearest
        changes = {"status": Status.UNKNOWN, "proof": NOT_FOUND, "reasons": nearest.reasons}
        return nearest.model_copy(update=changes)

    def route_of(self, plan: Plan) -> RouteSpeeds:
        """The segments of the route of a plan."""
        names, routes = self.network.route_names, range(len(self.network.routes))
        return RouteSpeeds(self.speeds.only(next(k for k in routes if names(k) == plan.route)))

    def held(self, plan: Plan) -> Program:
        """The program at the speeds of a plan, over its route."""
        return declared_program(self.stated, self.route_of(plan).at(_speeds_m_s(plan)))

    def price_words(self, plan: Plan) -> str:
        """Return the price of a second of flight at a plan's speeds, in words."""
        route, speeds_m_s = self.route_of(plan), _speeds_m_s(plan)
        moves = speeds_m_s > 0.0
        way_m, speed = vector(np.array(route.way_m)[:, moves]), speeds_m_s[moves]
        exact_A = np.asarray(route.speeds.flight.price_A(way_m, speed))
        price_A: Floats = np.round(exact_A, DIGITS) + 0.0  # No −0
        capped = speed >= route.largest_m_s[moves] * (1.0 - AT_LARGEST_SPEED)
        if capped.all():
            most = f"{figure(price_A.max(), 4)} A s" if np.isfinite(price_A).all() else "any charge"
            return f"a second less of flight is worth {most} or more: all legs fly at their fastest"
        free_A = price_A[~capped]
        if np.ptp(free_A) <= SAME_A * max(1.0, float(np.abs(free_A).max())):
            rest = ", where no cap binds" if capped.any() else " on every leg"
            return f"a second less of flight is worth {figure(free_A[0], 4)} A s of charge{rest}"
        figures = zip(price_A.tolist(), capped.tolist(), strict=True)
        each = ", ".join("any" if cap else f"{figure(price, 4)} A s" for price, cap in figures)
        return f"a second less of flight is worth, leg by leg: {each}"

    def shadow_prices(self, solutions: Sequence[Solution] | None = None) -> NoReturn:
        """Refused: `optuav.explain` has those at the speeds found."""
        raise InputError(REFUSED)


def _speeds_m_s(plan: Plan) -> Floats:
    """The speeds of a plan (segment,) in flight order [m/s]."""
    return np.array([speed for leg in plan.speeds_m_s for speed in leg])


def _bounded(plan: Plan, most_s: float, proof: str, otherwise: Status) -> Plan:
    """Return the plan with the proof for its speeds: it is optimal if it meets a bound."""
    proved = plan.status is Status.OPTIMAL
    if proved and most_s - plan.hover_time_s <= SAME_S * max(1.0, plan.hover_time_s):
        words = proof if proof == PRICED else BOUNDED
        return plan.model_copy(update={"proof": words, "bound": None})
    return plan.model_copy(update={"status": otherwise, "proof": proof, "bound": most_s})


def _declared(question: Question, speeds: LegSpeeds, which: Integers, rests: bool) -> Model:
    """The problem over the speeds of the legs, Δ and T', for routes of segments of like kinds."""
    network, problem = speeds.network, question.problem
    model = Model(f"{problem.name} with the speeds of the legs free: longest hover")
    table = quantities(network, which, rests=rests, steps=False)
    values = Given.of(table, question.perspective)
    stages, steps, landings = list[Stage](), list[Stage | str](), list[Landing]()
    for legs, stay in legs_and_stays(network, which, rests):
        for segment in np.flatnonzero(np.isfinite(speeds.ways_m[0][:, legs[0]])).tolist():
            stages.append(_segment(model, speeds, len(stages) + 1, segment, legs))
            steps.append(stages[-1])
        if stay:
            flown_As: Any = sum(-stage.current_A * stage.duration_s for stage in stages)
            before = tuple(step for step in steps if isinstance(step, str))
            flown_J = values.nominal_voltage_V * flown_As
            landings.append(Landing(flown_As, flown_J, before, len(steps) - 1))
            steps.append(stay)
    charge_As = sum(-stage.current_A * stage.duration_s for stage in stages)
    flown: dict[str, Quantity] = {
        "flight_time_s": sum(stage.duration_s for stage in stages),
        "flight_charge_As": charge_As,
        "flight_energy_J": values.nominal_voltage_V * charge_As,
        "flight_voltage_V": values.nominal_voltage_V,
    }
    for quantity in QUANTITIES:
        if quantity.name in flown:
            words = {name: quantity.metadata[name] for name in ("symbol", "unit")}
            flown[quantity.name] = model.let(quantity.name, flown[quantity.name], **words)
    kept = tuple(landings) if network.mission.limits.keep_soc == "always" else ()
    problem.declare(model, replace(values, **flown, steps=steps, landings=kept))
    return model


def _segment(model: Model, speeds: LegSpeeds, number: int, segment: int, legs: Integers) -> Stage:
    """The segment of a number on the way of each route, over its speed if it has one."""

    def stated(name: str, symbol: str, unit: str, value: Quantity) -> Parameter:
        """A figure of it, by route."""
        key = f"{name}_{number}_{unit.replace('/', '_').replace(' ', '')}"
        return Parameter(key, Indexed(symbol, number), unit, value)

    flight, way_m = speeds.flight, vector(speeds.ways_m[:, segment, legs])
    length_m, direction = level_length(way_m), level_direction(way_m)
    least_m_s, most_m_s = (
        speeds_m_s[segment, legs] for speeds_m_s in (speeds.least, speeds.priced(math.inf))
    )
    fastest = flight.leg_at(way_m, most_m_s)
    if not length_m.any():  # Straight up or down
        (drawn_A,) = fastest.currents_A
        time_s = stated("flown", "t^fl", "s", fastest.duration_s)
        return Stage(-stated("drawn", "I^fl", "A", drawn_A), time_s)
    V = model.variable(
        f"speed_{number}_m_s",
        Indexed("V", number),
        unit="m/s",
        lower=stated("least_speed", "V^min", "m/s", least_m_s),
        upper=stated("most_speed", "V^max", "m/s", most_m_s),
    )
    x, y, z = direction
    if any(speeds.network.mission.wind.velocity_m_s):
        direction = stated("eastward", "u^x", "1", x), stated("northward", "u^y", "1", y), z
    duration, drawn = flight.level(stated("length", "d", "m", length_m), direction, V)
    level_s, level = flight.level(length_m, (x, y, z), most_m_s)
    lift_As = np.maximum(fastest.charge_As - level.current_A * level_s, 0.0)
    t = model.let(f"duration {number}", duration, symbol=Indexed("t^fl", number), unit="s")
    current = drawn.current_A
    if (lift_As > LIFTS * fastest.charge_As).any():
        current = current + stated("lift", "Q^up", "A s", lift_As) / t
    named = model.let(f"current {number}", current, symbol=Indexed("I^fl", number), unit="A")
    return Stage(-named, t)
