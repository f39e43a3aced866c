"""From the answer of an engine to a plan, or to the words why there is none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from formulations.p1 import P1
from formulations.p4 import P4
from formulations.parameters import Quantities
from formulations.soc import PAPER, PERSPECTIVES
from optuav.arrays import Integers
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError
from optuav.mission.messages import written_out
from optuav.modelling import Constraint, Model, evaluate
from optuav.modelling.check import evaluated, relations
from optuav.modelling.classify import traits
from optuav.modelling.traversal import has_unknowns
from optuav.network import timeline as mission_phases
from optuav.network.network import Network
from optuav.network.one_stop import find_shortcuts, shortcuts_in_words
from optuav.network.routes import NO_LEG
from optuav.network.timeline import route_phases
from optuav.plan import Phase, Plan, Stage
from optuav.plan.phases import wells_at_ends
from optuav.solving.dispatch import answer
from optuav.solving.given import quantities, step_ends
from optuav.solving.question import AUTO, Question
from optuav.status import Status

MOST_VIOLATED = 2
"""Constraints of which it is told in full that they do not hold."""
ROUNDING = 1e-9
"""Share of the capacity that rounding may take."""
TIMES = ("hover_time_s", "rest_time_s")
"""Unknowns that make a plan; other unknowns of a formulation serve it alone."""


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


def plan_for(asked: Question, worked_out: Network, **found: Any) -> Plan:
    """A plan as an answer to a question: what was asked, and what was found."""
    told = (*found.pop("notes", ()), *_refused(worked_out, found.get("phases", ())))
    return Plan(
        mission=worked_out.mission,
        problem=asked.problem.name,
        trajectory=asked.trajectory,
        building=asked.building,
        order=asked.order,
        perspective=asked.perspective,
        slot_s=asked.slot_s,
        notes=told,
        **found,
    )


def _refused(worked_out: Network, flown: Sequence[Phase]) -> Iterator[str]:
    """A note where charging tapered: what was offered and is not in the wells."""
    packs = worked_out.mission.battery
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
    asked: Question, worked_out: Network, part: Part, solution: Solution, entry: int
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
    flown = planned_phases(worked_out, route, **times)
    return plan_for(
        asked,
        worked_out,
        engine=solution.engine,
        proof=solution.proof,
        status=solution.statuses[entry],
        binding=tuple(words(worked_out, part, entry, solution.binding_labels(entry))),
        notes=tuple(_notes(asked, worked_out, part, route, times)),
        phases=flown,
        soc=soc_at_end(worked_out, route, flown, **times),
    )


def words(worked_out: Network, part: Part, entry: int, labels: Sequence[str]) -> Iterator[str]:
    """Labels of constraints with their moments by the places of the route."""
    known = {each.label: each for each in relations(part.model)}
    stated = [known.get(label) for label in labels]
    moments = moment_words(worked_out, part, entry, stated)
    for label, each, moment in zip(labels, stated, moments, strict=True):
        yield f"{each.name} {moment}" if each and moment else label


def moment_words(
    worked_out: Network, part: Part, entry: int, constraints: Sequence[Constraint | None]
) -> list[str]:
    """By constraint, the moment at which it holds by the places of the route; empty without one."""
    if not any(each and each.step is not None for each in constraints):
        return [""] * len(constraints)
    rests = any(variable.name == "rest_time_s" for variable in part.model.variables)
    ends = step_ends(worked_out, part.routes, entry, rests=rests)
    return [
        ends[each.step] if each and each.step is not None and ends else "" for each in constraints
    ]


def plan_without(
    asked: Question, worked_out: Network, status: Status, proof: str, reasons: Sequence[str]
) -> Plan:
    """What is returned where there is no plan."""
    return plan_for(
        asked,
        worked_out,
        engine=asked.engine_name if asked.engine != AUTO else "",
        proof=proof,
        status=status,
        reasons=tuple(reasons),
    )


def planned_phases(
    worked_out: Network, route: int, hover_time_s: float, rest_time_s: float
) -> tuple[Phase, ...]:
    """Phases of a plan with the wells of its packs at their ends."""
    found = route_phases(worked_out, route, hover_time_s, rest_time_s)
    return with_wells(worked_out, found)


def with_wells(worked_out: Network, found: Sequence[mission_phases.Phase]) -> tuple[Phase, ...]:
    """Phases of a mission as those of a plan: with the wells of its packs, pooled ones as one."""
    ends = wells_at_ends(worked_out.mission, [(each.kind, each.stages) for each in found])
    where, table, names = worked_out.places, worked_out.legs, worked_out.places.names
    start_s, planned = 0.0, []
    for each, wells in zip(found, ends, strict=True):
        flown = each.leg != NO_LEG
        planned.append(
            Phase(
                kind=each.kind,
                start_place=names[each.start_place],
                end_place=names[each.end_place],
                start_s=start_s,
                stages=tuple(
                    Stage(duration_s=stage.duration_s, current_A=stage.current_A, power_W=power_W)
                    for stage, power_W in zip(each.stages, each.powers_W, strict=True)
                ),
                distance_m=float(table.distance_m[each.leg]) if flown else 0.0,
                peak_speed_m_s=float(table.peak_speed_m_s[each.leg]) if flown else 0.0,
                edited=bool(table.edited[each.leg] if flown else where.edited[each.end_place]),
                available_As=tuple(np.atleast_1d(wells.available_As).tolist()),
                bound_As=tuple(np.atleast_1d(wells.bound_As).tolist()),
            )
        )
        start_s = planned[-1].end_s
    return tuple(planned)


def states_of_charge(
    given: Quantities, hover_time_s: float, rest_time_s: float
) -> dict[str, float]:
    """State of charge at the end [-] by the perspectives of the paper, for one itinerary."""
    return {
        name: float(np.squeeze(PERSPECTIVES[name](given, hover_time_s, rest_time_s)))
        for name in PAPER
    }


def soc_at_end(
    worked_out: Network,
    route: int,
    flown: Sequence[Phase],
    hover_time_s: float,
    rest_time_s: float,
) -> dict[str, float]:
    """State of charge at the end [-]: `battery` counts what the packs hold if they may refuse."""
    soc = states_of_charge(quantities(worked_out, np.array([route])), hover_time_s, rest_time_s)
    return counted(worked_out, flown, soc)


def counted(worked_out: Network, flown: Sequence[Phase], soc: dict[str, float]) -> dict[str, float]:
    """States of charge, with what the packs hold in place of what they were offered."""
    packs = worked_out.mission.battery
    if not packs.takes_turns and packs.charging == "constant":
        return soc
    return {**soc, "battery": _left_As(flown) / (packs.packs * packs.capacity_As)}


def _notes(
    asked: Question, worked_out: Network, part: Part, route: int, times: dict[str, float]
) -> Iterator[str]:
    rests = any(variable.name == "rest_time_s" for variable in part.model.variables)
    if rests and times["rest_time_s"] == 0.0:
        note = "the optimum is at T' = 0: resting gains nothing here"
        if isinstance(asked.problem, P4):
            note += "; with T' > 0, as (P4) is printed, this limit is approached but not attained"
        yield note
    legs = worked_out.routes.legs[route]
    flown = legs[legs != NO_LEG]
    if worked_out.legs.edited[flown].any():
        yield "some legs have figures from the graph, not from the flight model"
    if worked_out.places.edited[worked_out.legs.end[flown]].any():
        yield "some places have sight or power of the laser from the graph, not from the mission"
    one_stop = (asked.stops, asked.hovers) == (1, 1)
    if isinstance(asked.problem, P1) and asked.trajectory == "optimal" and one_stop:
        shortcuts = find_shortcuts(worked_out)
        if shortcuts:
            yield shortcuts_in_words(shortcuts)


def shortfalls(asked: Question, worked_out: Network, parts: Sequence[Part]) -> tuple[str, ...]:
    """Why no times are feasible, in words, told for the route with the shortest flight."""
    flight_s = worked_out.routes.flight_time_s
    part = min(parts, key=lambda each: float(flight_s[each.routes].min()))
    entry = int(flight_s[part.routes].argmin())
    shortest_s = float(flight_s[part.routes[entry]])
    deadline_s = worked_out.mission.limits.deadline_s
    if shortest_s > deadline_s:
        return (
            f"the flight alone takes {shortest_s:.2f} s, "
            f"longer than limits.deadline_s = {deadline_s:g} s",
        )
    if asked.slot_s is not None and _feasible_without_slots(asked, parts):
        return tuple(_between_slots(asked.slot_s, part.model, part.model.row(entry)))
    parameters = part.model.row(entry)
    least = {each.name: evaluate(each.lower, parameters) for each in part.model.variables}
    times = ", ".join(f"{each.symbol} = {least[each.name]:g}" for each in part.model.variables)
    broken = [row for row in evaluated(part.model, {**parameters, **least}) if not row.satisfied]
    labels = words(worked_out, part, entry, [row.label for row in broken])
    violated = [
        f"{label}: {row.left:.6g} {row.sense} {row.right:.6g} does not hold at {times}, "
        "nor at any longer time that the other constraints admit"
        for label, row in zip(labels, broken, strict=True)
    ]
    if len(violated) > MOST_VIOLATED:
        more = len(violated) - MOST_VIOLATED
        violated[MOST_VIOLATED:] = [f"nor do {more} other constraints hold there"]
    return tuple(violated) or ("no times satisfy all constraints together",)


def _feasible_without_slots(asked: Question, parts: Sequence[Part]) -> bool:
    """Whether times that are no whole slots would do; told of linear models only."""
    continuous = replace(asked, slot_s=None, engine=AUTO, solver=None)
    return any(
        status.has_answer
        for part in parts
        if traits(part.model).linear
        for status in answer(part.model, len(part.routes), continuous).statuses
    )


def _between_slots(slot_s: float, model: Model, parameters: Mapping[str, float]) -> Iterator[str]:
    """Words on a programme that has times, but none in whole slots."""
    yield (
        f"no whole slots of {written_out(slot_s)} s satisfy all constraints together; without "
        "slots there are times that do"
    )
    for constraint in model.constraints:
        relation = constraint.relation
        if relation.sense == "==" and not has_unknowns(relation.right):
            right = float(evaluate(relation.right, parameters))
            yield f"{constraint.label}: exactly {right:.6g} {constraint.unit} are asked for"
