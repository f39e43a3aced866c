"""Whether more stops or the problem (P1) would be better than a plan, and the notes on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from formulations.p1 import P1
from formulations.soc import AVAILABLE, PAPER
from optuav.judge.replay import MISMATCH, replay
from optuav.mission import Mission
from optuav.network.feasibility import impossibilities
from optuav.network.graph import Graph
from optuav.network.network import Network
from optuav.network.one_stop import one_stop_is_enough
from optuav.network.timeline import route_phases
from optuav.network.variants import as_variants
from optuav.plan import Plan
from optuav.presentation.numbers import figure, seconds
from optuav.solving.assemble import quantities
from optuav.solving.balance import by_balance
from optuav.solving.question import MOST_BUILDINGS, Question, solve_model
from optuav.solving.ranking import best
from optuav.solving.route_models import RouteModel, permitted_routes
from optuav.status import SAME_S, Status

BOUNDED = "bracketed: a feasible time, and a longer one that none exceeds"
MORE_STOPS = "more stops might gain hover time"
SEARCHED = "--stops 2 --hovers 2, or P1(stops=2, hovers=2)"
PROVED = {
    "P2": "bounded: no flight and rest is shorter than the shortest flight",
    "P2-tight": "bounded: no flight and rest is shorter, as the engine {} proves that no hover is "
    "longer",
}
"""Why a local optimum is the global one, by problem."""


def against_p1(
    question: Question, network: Network, parts: Sequence[RouteModel], plan: Plan
) -> Plan:
    """The plan of (P2) compared with (P1), and proved where (P1) is a proof."""
    # (P2) minimises T_fl + T'. As printed it cannot be less than the shortest T_fl. With the
    # deadline tight it is T_max − Δ, and Δ cannot be more than in (P1).
    name, deadline_s = question.problem.name, network.mission.limits.deadline_s
    least_s, longest_s, beyond_s = math.inf, -math.inf, -math.inf
    for part in parts:
        values, count = quantities(network, part.routes, rests=part.rests), len(part.routes)
        model = P1().model(values, question.perspective)
        solution = solve_model(model, count, replace(question, problem=P1()))
        flight_s = network.routes.flight_time_s[part.routes]
        most_s = np.full(count, np.inf) if solution.beyond is None else solution.beyond
        if not part.rests:
            # All of the time left is hovered, or the deadline is not tight.
            most_s = most_s[most_s >= deadline_s - flight_s - SAME_S]
        least_s = min(least_s, float(flight_s.min()))
        longest_s = max(longest_s, float(np.nanmax(solution.objective, initial=-np.inf)))
        beyond_s = max(beyond_s, float(most_s.max(initial=-np.inf)))
    notes, changes = list(plan.notes), dict[str, object]()
    if name == "P2":
        any_hover = "any feasible hover time is optimal"
        notes.append(f"(P2) as printed has no Δ in its objective: {any_hover}")
    if (longer_s := longest_s - plan.hover_time_s) > SAME_S:
        notes.append(
            f"(P1) hovers {seconds(longest_s)} on the same mission, {seconds(longer_s)} longer"
        )
    bound_s = least_s if name == "P2" else deadline_s - beyond_s
    over_s = plan.flight_time_s + plan.rest_time_s - bound_s
    if plan.status is Status.LOCALLY_OPTIMAL and over_s <= SAME_S:
        changes = {"status": Status.OPTIMAL, "proof": PROVED[name].format(solution.engine)}
    elif plan.status is Status.LOCALLY_OPTIMAL and math.isfinite(over_s):
        notes.append(f"not proved: up to {figure(over_s)} s less has not been ruled out")
    return plan.model_copy(update={"notes": tuple(notes), **changes})


def not_excluded(question: Question, mission: Mission) -> str:
    """A note that more stops may help, and how to search for them."""
    if len(mission.buildings) > MOST_BUILDINGS:
        return f"{MORE_STOPS}; optuav searches for them among at most {MOST_BUILDINGS} buildings"
    options = {"slots": question.slot_s, "a stated order": question.problem.order}
    without = " or ".join(name for name, value in options.items() if value is not None)
    return f"{MORE_STOPS}: try {SEARCHED}" + (f", without {without}" if without else "")


def more_stops_may_help(
    question: Question, network: Network, plan: Plan, graph: Graph | None = None
) -> bool:
    """Return whether more rests or hovers may give a longer hover than the best plan for P1.

    No is certain of a plan over all routes: there is nowhere to rest, no number of stops makes the
    mission flyable, or one rest and one hover are enough (`optuav.network.one_stop` says when);
    under ``available`` the plan also hovers as long as charge and deadline allow on any route with
    one rest, which bounds all. Other problems, a free hover point and packs that take turns allow
    no more stops.
    """
    mission, perspective = network.mission, question.perspective
    if not isinstance(question.problem, P1) or replace(question.problem, order=None) != P1():
        return False
    turns = mission.battery.takes_turns and perspective == AVAILABLE
    if mission.devices or turns or perspective not in (*PAPER, AVAILABLE) or not mission.buildings:
        return False
    if not plan and impossibilities(network, one_stop=False):
        return False
    if perspective == AVAILABLE:
        hovers_s, _ = by_balance(network)
        most_s = hovers_s[network.routes.flyable].max(initial=-np.inf)
        if (plan.hover_time_s if plan else -np.inf) < most_s - SAME_S:
            return True
    return not one_stop_is_enough(network, graph)


def note_what_battery_allows(question: Question, network: Network, plan: Plan) -> Iterator[str]:
    """Note the hover that charge allows, if a battery that never runs dry allows less."""
    routes = network.routes
    hover_s, rest_s = by_balance(network)
    hover_s = np.where(
        permitted_routes(as_variants(network), question.problem)[0], hover_s, -np.inf
    )
    route = best(hover_s, routes.flight_time_s + hover_s + rest_s, routes.building >= 0)
    if route is None or hover_s[route] <= plan.hover_time_s + SAME_S:
        return
    note = "perspective battery, which checks only charge, and not the wells, "
    here = "" if network.mission.route.hover_m is None else " at this hover point"
    note += f"promises {seconds(hover_s[route])} of hover{here}"
    phases = route_phases(network, route, float(hover_s[route]), float(rest_s[route]))
    flown = plan.model_copy(update={"phases": phases})
    dry_s, full_s = flown.limits_passed_s()
    ends = (full_s, "overfill the available well"), (dry_s, "run dry and fall")
    if faults := [f"{words} at {seconds(at_s)}" for at_s, words in ends if at_s is not None]:
        note += f"; that plan would {' and '.join(faults)}"
    elif others := [event for event in replay(flown).violations if event.kind != MISMATCH]:
        note += f"; that plan cannot be flown: {others[0].words}{others[0].value_and_limit}"
    yield note
