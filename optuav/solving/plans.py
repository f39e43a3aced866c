"""Plans from the answers of engines, and the reasons why there is none."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from formulations.p1 import P1
from formulations.p4 import P4
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES
from optuav.arrays import Integers
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError, SolverError
from optuav.judge.replay import replay
from optuav.mission.messages import written_out
from optuav.modelling import Constraint, Model, evaluate
from optuav.modelling.check import evaluated, relations
from optuav.modelling.classify import traits
from optuav.modelling.traversal import has_unknowns
from optuav.network.network import NO_LEG, Network
from optuav.network.one_stop import find_shortcuts, shortcuts_in_words
from optuav.network.places import charging_cap
from optuav.network.timeline import route_phases, simulated
from optuav.physics.flight import speed_warning
from optuav.plan import Phase, Plan
from optuav.solving.assemble import quantities, step_ends
from optuav.solving.dispatch import answer
from optuav.solving.question import AUTO, PROBLEM_NAMES, Question
from optuav.status import Status

MOST_VIOLATED = 2
"""Violated constraints that are stated in full."""
ROUNDING = 1e-9
"""Share of the capacity that rounding may take."""
TIMES = ("hover_time_s", "rest_time_s")
"""Unknowns that make a plan; a formulation may have others."""


@dataclass(frozen=True)
class Part:
    """One declaration that serves several itineraries.

    Parameters
    ----------
    model
        The declaration; its parameters are arrays with one entry an itinerary.
    routes
        Numbers of the itineraries.
    """

    model: Model
    routes: Integers

    @property
    def rests(self) -> bool:
        """Whether the declaration has a rest time."""
        return any(each.name == "rest_time_s" for each in self.model.variables)


def plan_for(question: Question, network: Network, **found: Any) -> Plan:
    """A plan as an answer to a question: what was asked, and what was found."""
    notes = (*found.pop("notes", ()), *_refused(network, found.get("phases", ())))
    return Plan(
        mission=network.mission,
        problem=question.problem.name,
        trajectory=question.trajectory,
        building=question.building,
        order=question.order,
        perspective=question.perspective,
        slot_s=question.slot_s,
        notes=notes,
        **found,
    )


def _refused(network: Network, flown: Sequence[Phase]) -> Iterator[str]:
    """A note where charging tapered: what was offered and is not in the wells."""
    packs = network.mission.battery
    if not flown or packs.takes_turns or packs.charging == "constant":
        return
    capacity_As = packs.packs * packs.capacity_As
    offered_As = sum(each.current_A * each.duration_s for phase in flown for each in phase.stages)
    refused_As = capacity_As + offered_As - _left_As(flown)
    if refused_As > ROUNDING * capacity_As:
        yield (
            f"charging tapered: the {refused_As:.6g} A s that the full battery refused are lost, "
            "and only battery tells so, not energy and adjusted"
        )


def _left_As(flown: Sequence[Phase]) -> float:
    """What the packs hold at the end [A s]."""
    return sum(flown[-1].available_As) + sum(flown[-1].bound_As)


def plan_of(
    question: Question, network: Network, part: Part, solution: Solution, entry: int
) -> Plan:
    """The plan that belongs to the answer to one entry of a part.

    Raises
    ------
    InputError
        If a formulation left a time free to be negative, and it is.
    """
    route = int(part.routes[entry])
    times = {name: solution.point(entry).get(name, 0.0) for name in TIMES}
    if any(time_s < 0.0 for time_s in times.values()):
        stated = "at least 0 s, or no plan is made of it: state lower=0.0"
        raise InputError([Fault(n, f"{t:g}", stated) for n, t in times.items() if t < 0.0])
    flown = planned_phases(network, route, **times)
    return plan_for(
        question,
        network,
        engine=solution.engine,
        proof=solution.proof,
        status=solution.statuses[entry],
        binding=tuple(words(network, part, entry, solution.binding_labels(entry))),
        notes=tuple(_notes(question, network, part, route, times)),
        phases=flown,
        soc=soc_at_end(network, route, flown, **times),
    )


def words(network: Network, part: Part, entry: int, labels: Sequence[str]) -> Iterator[str]:
    """Labels of constraints with their moments by the places of the route."""
    known = {each.label: each for each in relations(part.model)}
    stated = [known.get(label) for label in labels]
    moments = moment_words(network, part, entry, stated)
    for label, each, moment in zip(labels, stated, moments, strict=True):
        yield f"{each.name} {moment}" if each and moment else label


def moment_words(
    network: Network, part: Part, entry: int, constraints: Sequence[Constraint | None]
) -> list[str]:
    """By constraint, the moment at which it holds by the places of the route; empty without one."""
    if not any(each and each.step is not None for each in constraints):
        return [""] * len(constraints)
    ends = step_ends(network, part.routes, entry, rests=part.rests)
    return [
        ends[each.step] if each and each.step is not None and ends else "" for each in constraints
    ]


def plan_without(
    question: Question, network: Network, status: Status, proof: str, reasons: Sequence[str]
) -> Plan:
    """The plan that says why there is none."""
    return plan_for(
        question,
        network,
        engine=question.engine_name if question.engine != AUTO else "",
        proof=proof,
        status=status,
        reasons=tuple(reasons),
    )


def planned_phases(
    network: Network, route: int, hover_time_s: float, rest_time_s: float
) -> tuple[Phase, ...]:
    """Phases of a plan with the wells of its packs at their ends."""
    return simulated(network.mission, route_phases(network, route, hover_time_s, rest_time_s))


def states_of_charge(
    given: Quantities, hover_time_s: float, rest_time_s: float
) -> dict[str, float]:
    """State of charge at the end [-] by the perspectives of the paper, for one itinerary."""
    return {
        name: float(np.squeeze(PERSPECTIVES[name](given, hover_time_s, rest_time_s)))
        for name in PAPER
    }


def soc_at_end(
    network: Network,
    route: int,
    flown: Sequence[Phase],
    hover_time_s: float,
    rest_time_s: float,
) -> dict[str, float]:
    """State of charge at the end [-] by perspective; `battery` counts what packs accepted."""
    soc = states_of_charge(quantities(network, np.array([route])), hover_time_s, rest_time_s)
    return counted(network, flown, soc)


def counted(network: Network, flown: Sequence[Phase], soc: dict[str, float]) -> dict[str, float]:
    """States of charge, where packs may refuse charge with what they hold."""
    packs = network.mission.battery
    if not packs.takes_turns and packs.charging == "constant":
        return soc
    return {**soc, "battery": _left_As(flown) / (packs.packs * packs.capacity_As)}


def _notes(
    question: Question, network: Network, part: Part, route: int, times: dict[str, float]
) -> Iterator[str]:
    if part.rests and times["rest_time_s"] == 0.0:
        note = "the optimum is at T' = 0: resting gains nothing here"
        if isinstance(question.problem, P4):
            note += "; with T' > 0, as (P4) is printed, this limit is approached but not attained"
        yield note
    legs = network.routes.legs[route]
    flown = legs[legs != NO_LEG]
    if network.legs.edited[flown].any():
        yield "some legs have figures from the graph, not from the flight model"
    if network.places.edited[network.legs.end[flown]].any():
        yield "some places have sight or power of the laser from the graph, not from the mission"
    one_stop = (question.stops, question.hovers) == (1, 1)
    if isinstance(question.problem, P1) and question.trajectory == "optimal" and one_stop:
        shortcuts = find_shortcuts(network)
        if shortcuts:
            yield shortcuts_in_words(shortcuts)
    if too_fast := speed_warning(float(network.legs.peak_speed_m_s[flown].max())):
        yield too_fast
    cap = charging_cap(network.mission, network.places)
    if cap and any(network.places.names[place] in cap.places for place in network.legs.end[flown]):
        yield str(cap)


def shortfalls(question: Question, network: Network, parts: Sequence[Part]) -> tuple[str, ...]:
    """Why no times are feasible, for the route with the shortest flight."""
    flight_s = network.routes.flight_time_s
    part = min(parts, key=lambda each: float(flight_s[each.routes].min()))
    entry = int(flight_s[part.routes].argmin())
    shortest_s = float(flight_s[part.routes[entry]])
    deadline_s = network.mission.limits.deadline_s
    if shortest_s > deadline_s:
        return (
            f"the flight alone takes {shortest_s:.2f} s, "
            f"longer than limits.deadline_s = {deadline_s:g} s",
        )
    if question.slot_s is not None and _feasible_without_slots(question, parts):
        return tuple(_between_slots(question.slot_s, part.model, part.model.row(entry)))
    parameters = part.model.row(entry)
    least = {each.name: evaluate(each.lower, parameters) for each in part.model.variables}
    times = ", ".join(f"{each.symbol} = {least[each.name]:g}" for each in part.model.variables)
    broken = [row for row in evaluated(part.model, {**parameters, **least}) if not row.satisfied]
    labels = words(network, part, entry, [row.label for row in broken])
    violated = [
        f"{label}: {row.left:.6g} {row.sense} {row.right:.6g} does not hold at {times}, "
        "nor at any longer time that the other constraints admit"
        for label, row in zip(labels, broken, strict=True)
    ]
    if len(violated) > MOST_VIOLATED:
        more = len(violated) - MOST_VIOLATED
        violated[MOST_VIOLATED:] = [f"nor do {more} other constraints hold there"]
    return tuple(violated) or ("no times satisfy all constraints together",)


def _feasible_without_slots(question: Question, parts: Sequence[Part]) -> bool:
    """Whether there are feasible times without slots; known for linear models only."""
    continuous = replace(question, slot_s=None, engine=AUTO)
    return any(
        status.has_answer
        for part in parts
        if traits(part.model).linear
        for status in answer(part.model, len(part.routes), continuous).statuses
    )


def _between_slots(slot_s: float, model: Model, parameters: Mapping[str, float]) -> Iterator[str]:
    """Sentences on a programme that has feasible times, but none in whole slots."""
    yield (
        f"no whole slots of {written_out(slot_s)} s satisfy all constraints together; without "
        "slots there are times that do"
    )
    for constraint in model.constraints:
        relation = constraint.relation
        if relation.sense == "==" and not has_unknowns(relation.right):
            right = float(evaluate(relation.right, parameters))
            yield f"{constraint.label}: exactly {right:.6g} {constraint.unit} are asked for"


SAME_S = 1e-6
"""Times that differ by no more than this are equal [s]."""


def best(
    hover_time_s: npt.ArrayLike,
    mission_time_s: npt.ArrayLike,
    stops: npt.ArrayLike,
) -> int | None:
    """Number of the best plan, or None if there is none.

    The longest hover wins; among equals (to 1e-6 s) the shortest mission, then the fewest stops,
    then the earliest in the list.

    Parameters
    ----------
    hover_time_s, mission_time_s
        Δ and T of every plan [s]; NaN where there is no plan.
    stops
        Number of stops of every plan.
    """
    hover, mission = np.asarray(hover_time_s, float), np.asarray(mission_time_s, float)
    if not np.isfinite(hover).any():
        return None
    tied = hover >= np.nanmax(hover) - SAME_S
    tied &= mission <= np.min(mission, where=tied, initial=np.inf) + SAME_S
    fewest = np.where(tied, np.asarray(stops, float), np.inf)
    return int(np.argmin(fewest))


WARNED_OF = ("empty", "full")
"""Events of a simulation that `Plan.warnings` states already."""


def replayed(plan: Plan) -> Plan:
    """The plan with the verdict of its simulation.

    Raises
    ------
    SolverError
        If a plan of the perspective `available` fails, which would be a fault of this package.
    """
    if not plan:
        return plan
    found = replay(plan)
    if plan.perspective == AVAILABLE and plan.problem in PROBLEM_NAMES and not found.flyable:
        words = "; ".join(event.words + event.figures for event in found.violations)
        raise SolverError(f"{plan.engine} returned a plan that fails its simulation: {words}")
    more = tuple(
        f"this plan cannot be flown: {event.words}{event.figures}"
        for event in found.violations
        if event.kind not in WARNED_OF
    )
    return plan.model_copy(update={"flyable": found.flyable, "notes": (*plan.notes, *more)})


PROVED = {
    "P2": "bounded: no flight and rest is shorter than the shortest flight",
    "P2-tight": "bounded: no flight and rest is shorter, as the engine {} proves that no hover is "
    "longer",
}
"""Why a local optimum is the global one, by problem."""


def against_p1(question: Question, network: Network, parts: Sequence[Part], plan: Plan) -> Plan:
    """The plan of (P2) compared with (P1), and proved where (P1) is a proof; others unchanged.

    (P2) minimises T_fl + T'. As printed it cannot be less than the shortest T_fl. With the deadline
    tight it is T_max − Δ, and Δ cannot be more than in (P1).

    Parameters
    ----------
    question, network, parts
        The question, and the models that answered it.
    plan
        The answer.
    """
    if question.problem.name not in PROVED:
        return plan
    solutions = [_longest_hovers(question, network, part) for part in parts]
    notes = list(_p1_notes(question, solutions, plan.hover_time_s))
    changes: dict[str, object] = {}
    if plan.status is Status.LOCALLY_OPTIMAL:
        over_s = (
            plan.flight_time_s + plan.rest_time_s - _least_s(question, network, parts, solutions)
        )
        if over_s <= SAME_S:
            proof = PROVED[question.problem.name].format(solutions[0].engine)
            changes = {"status": Status.OPTIMAL, "proof": proof}
        elif math.isfinite(over_s):
            notes.append(f"not proved: up to {over_s:.6g} s less has not been ruled out")
    return plan.model_copy(update={"notes": (*plan.notes, *notes), **changes})


def _least_s(
    question: Question, network: Network, parts: Sequence[Part], solutions: Sequence[Solution]
) -> float:
    """A lower bound of T_fl + T' [s]; −∞ where none is known."""
    flight_s = [network.routes.flight_time_s[part.routes] for part in parts]
    if question.problem.name == "P2":
        return min(float(each.min()) for each in flight_s)
    deadline_s, longest_s = network.mission.limits.deadline_s, -math.inf
    for flown_s, solution in zip(flight_s, solutions, strict=True):
        if solution.beyond is None:
            return -math.inf
        beyond_s = solution.beyond
        if "rest_time_s" not in solution.values:
            # Without a rest all of the time left is hovered, or the deadline is not tight.
            beyond_s = beyond_s[beyond_s >= deadline_s - flown_s - SAME_S]
        longest_s = max(longest_s, float(beyond_s.max(initial=-math.inf)))
    return deadline_s - longest_s


def _p1_notes(
    question: Question, solutions: Sequence[Solution], hover_time_s: float
) -> Iterator[str]:
    if question.problem.name == "P2":
        yield "(P2) as printed has no Δ in its objective: any feasible hover time is optimal"
    longest_s = max(float(np.nanmax(each.objective, initial=-np.inf)) for each in solutions)
    if longest_s > hover_time_s + SAME_S:
        yield (
            f"(P1) hovers {longest_s:.2f} s on the same mission, "
            f"{longest_s - hover_time_s:.2f} s longer"
        )


def _longest_hovers(question: Question, network: Network, part: Part) -> Solution:
    given = quantities(network, part.routes, rests=part.rests)
    p1 = P1().model(given, question.perspective)
    return answer(p1, len(part.routes), replace(question, problem=P1()))
