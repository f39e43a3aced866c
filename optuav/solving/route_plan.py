"""From the times of a route to a plan, and the plan simulated again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NotRequired, TypedDict, Unpack

import numpy as np

from formulations.p4 import P4
from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES
from optuav.arrays import Values
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError, SolverError
from optuav.judge.replay import BELOW_RESERVE, replay
from optuav.laser.beam import SpreadingBeam
from optuav.mission.keys import as_stated, numeric_keys
from optuav.network import vehicle
from optuav.network.feasibility import rate_doubt
from optuav.network.network import Network, network_by
from optuav.network.places import build_places, charging_cap
from optuav.network.timeline import route_phases, simulated
from optuav.physics.flight import speed_warning
from optuav.plan import Phase, Plan
from optuav.plan.data import CANNOT
from optuav.presentation.numbers import figure, typed
from optuav.solving.assemble import quantities
from optuav.solving.balance import TIMES
from optuav.solving.constraint_words import words
from optuav.solving.question import PROBLEM_NAMES, Question
from optuav.solving.route_models import RouteModel
from optuav.status import Status

ROUNDED_SOC = 1e-9  # share of the capacity that rounding may take
COUNT_ROUNDING = 1e-6  # Distance of an unknown from a whole number that is rounding
EDITED = {
    True: "some legs have figures from the graph, not from the flight model",
    False: "some places have sight or power of the laser from the graph, not from the mission",
}
"""Notes on figures that a user stated, of legs or else of stays."""
WARNED_OF = ("empty", "full")  # Events of a simulation that `Plan.warnings` states already.


class AnswerFields(TypedDict):
    """Fields of a plan that say how its answer is known."""

    engine: str
    proof: str
    status: Status
    notes: NotRequired[Sequence[str]]
    reasons: NotRequired[tuple[str, ...]]
    binding: NotRequired[tuple[str, ...]]
    objective: NotRequired[float]  # The hover time, unless it says another
    objective_unit: NotRequired[str]
    bound: NotRequired[float]


def plan_for(
    question: Question,
    network: Network,
    flown: Sequence[Phase] = (),
    given: Quantities | None = None,
    times_s: tuple[float, float] = (0.0, 0.0),
    **answer: Unpack[AnswerFields],
) -> Plan:
    """Return question and answer as a plan, with notes on its phases."""
    mission, notes, packs = network.mission, [*answer.get("notes", ())], network.mission.battery
    fields: dict[str, Any] = {}
    if flown and given:
        edited = {phase.kind == "flight" for phase in flown if phase.edited}
        notes += (words for is_leg, words in EDITED.items() if is_leg in edited)
        peak_m_s, has_drag = max(p.peak_speed_m_s for p in flown), mission.flight_model.has_drag
        warnings = [speed_warning(peak_m_s, has_drag=has_drag), _slowed(network, flown)]
        cap = charging_cap(mission, network.places)
        if cap and any(phase.end_place in cap.places for phase in flown):
            warnings.append(cap.words)
        if (beam := mission.beam) is not None:
            warnings.append(beam.limit_warning())
        if isinstance(beam, SpreadingBeam):
            warnings.append(beam.eye_warning)
        notes += filter(None, warnings)
        soc = {p: float(np.squeeze(PERSPECTIVES[p](given, *times_s))) for p in PAPER}
        if packs.takes_turns or packs.charging != "constant":
            # Packs may refuse charge: `battery` counts the accepted charge.
            capacity_As = float(mission.pool.capacity_As)
            left_As = sum(flown[-1].available_As) + sum(flown[-1].bound_As)
            soc["battery"] = left_As / capacity_As
            begin_As = float(vehicle.start(mission).total_As)
            refused_As = begin_As + sum(phase.charge_As for phase in flown) - left_As
            if refused_As > ROUNDED_SOC * capacity_As and not packs.takes_turns:
                refused = f"the {figure(refused_As)} A s that the full battery refused are lost"
                only = "only the perspective battery counts that"
                notes.append(f"charging slowed down near full, it tapers: {refused}; {only}")
        hover_s = sum(phase.duration_s for phase in flown if phase.kind == "hover")
        fields = {"objective": hover_s, "objective_unit": "s", "phases": flown, "soc": soc}
    return Plan(
        mission=mission,
        problem=question.problem.name,
        trajectory=question.problem.trajectory,
        building=question.problem.building,
        order=question.problem.order,
        device_order=question.problem.device_order,
        perspective=question.perspective,
        slot_s=question.slot_s,
        **{**fields, **answer, "notes": tuple(notes)},
    )


def _slowed(network: Network, flown: Sequence[Phase]) -> str | None:
    """Say which limit keeps legs below the speed that the mission states, if one does."""
    places, ways_m = network.places, [np.empty((0, 3))]
    for leg in flown:
        if leg.kind == "flight" and not (leg.edited or leg.speeds_m_s):
            start, end = (places.names.index(name) for name in (leg.start_place, leg.end_place))
            start_m, end_m = places.position_m[[start, end]]
            ways_m.append(np.diff([start_m, *leg.waypoints_m, end_m], axis=0))
    x, y, z = np.concatenate(ways_m).T
    return network.mission.flight_model.slowed((x, y, z)) if len(x) else None


def route_plan(
    question: Question,
    network: Network,
    route: int,
    times_s: tuple[float, float],
    **answer: Unpack[AnswerFields],
) -> Plan:
    """The plan that flies a route, and hovers and rests there for some times [s]."""
    flown = simulated(network.mission, route_phases(network, route, *times_s))
    given = quantities(network, np.array([route]), steps=False)
    return plan_for(question, network, flown, given, times_s, **answer)


def plan_of(
    question: Question, network: Network, part: RouteModel, solution: Solution, entry: int
) -> Plan:
    """The plan that belongs to the answer to one entry of a part, which is evaluated again."""
    rows = solution.verify(entry)
    point, route = solution.point(entry), int(part.routes[entry])
    hover_s, rest_s = (point.get(name, 0.0) for name in TIMES)
    if min(hover_s, rest_s) < 0.0:
        reason = "must be at least 0 s: declare the variable with lower=0.0"
        times = zip(TIMES, (hover_s, rest_s), strict=True)
        raise InputError([Fault(name, typed(t), reason) for name, t in times if t < 0.0])
    network, notes = _with_unknowns(network, point)
    if part.rests and rest_s == 0.0:
        approached = "; with T' > 0, as in printed (P4), this limit is approached but not attained"
        more = approached if isinstance(question.problem, P4) else ""
        notes.append(f"the optimum is at T' = 0: resting gains nothing here{more}")
    return route_plan(
        question,
        network,
        route,
        (hover_s, rest_s),
        objective=float(solution.objective[entry]),
        objective_unit=part.declared.objective_unit,
        engine=solution.engine,
        proof=solution.proof,
        status=solution.statuses[entry],
        binding=tuple(words(network, part, entry, solution.binding_labels(entry, rows))),
        notes=notes,
    )


@cache
def _keys_by_name() -> dict[str, str]:
    """Numeric keys of missions by the names that these have in `given`."""
    keys = dict[str, str]()
    for key in numeric_keys():
        stem, _, axis = key.replace(".", "_", 1).partition("[")
        keys[f"{stem}_{'xyz'[int(axis[0])]}" if axis else stem] = key
    return keys | {
        quantity.name: key for quantity in QUANTITIES if (key := quantity.metadata["key"])
    }


def _with_unknowns(network: Network, point: Values) -> tuple[Network, list[str]]:
    """The network where unknowns that stand for numbers of the mission have their values.

    With a note where no mission could have them.
    """
    if point.keys() <= {*TIMES}:
        return network, []
    values = {key: point[name] for name, key in _keys_by_name().items() if name in point}
    if not values:
        return network, []
    ranges, nearest = numeric_keys(), {key: round(value) for key, value in values.items()}
    counts = {key: value for key, value in values.items() if ranges[key].whole}
    counts = {
        k: nearest[k] if abs(v - nearest[k]) <= COUNT_ROUNDING else v for k, v in counts.items()
    }
    try:
        mission = network.mission.replace(as_stated(network.mission, values) | counts)
    except InputError as error:
        return network, [f"the plan has the mission's own numbers, not those found: {error}"]
    edited = network.legs.edited.any() or network.places.edited.any()
    if edited or all(key.startswith("start.") for key in values):
        return replace(network, mission=mission), []
    return network_by(mission, build_places(mission), network.buildings), []


def replayed(plan: Plan, *, must_fly: bool = True) -> Plan:
    """The plan with the verdict of its simulation; one that must fly and does not is an error."""
    if not plan:
        return plan
    simulated_plan = replay(plan)
    events = simulated_plan.violations
    # That a plan of the perspective `available` fails would be a fault of this package.
    if must_fly and plan.perspective == AVAILABLE and plan.problem in PROBLEM_NAMES and events:
        why = "; ".join(event.words + event.value_and_limit for event in events)
        raise SolverError(f"{plan.engine} returned a plan that fails its simulation: {why}")
    untold = (
        event.words + event.value_and_limit for event in events if event.kind not in WARNED_OF
    )
    notes = (*plan.notes, *(f"{CANNOT}{words}" for words in untold))
    low = (event for event in simulated_plan.events if event.kind == BELOW_RESERVE)
    notes = (*notes, *(event.words + event.value_and_limit for event in low))
    notes = (*notes, *rate_doubt(plan.mission, _draws(plan)))
    return plan.model_copy(update={"flyable": not events, "notes": notes})


def _draws(plan: Plan) -> Iterator[tuple[str, float]]:
    """The largest draw of every phase [A]."""
    for phase in plan.phases:
        way = phase.start_place, phase.end_place
        what = f"the leg {' → '.join(way)}" if phase.kind == "flight" else f"the {phase.kind}"
        yield what, max(-stage.current_A for stage in phase.stages)
