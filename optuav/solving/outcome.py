"""From answers to plans: the best one, whether others can be better, or why none exists."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from formulations.p1 import P1
from formulations.p4 import P4
from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES, StepEnd
from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines.registry import AUTO, MOST_UNKNOWNS
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError, SolverError
from optuav.judge.replay import BELOW_RESERVE, MISMATCH, replay
from optuav.laser.beam import SpreadingBeam
from optuav.mission import Mission
from optuav.mission.keys import as_stated, numeric_keys
from optuav.mission.messages import written_out
from optuav.modelling import Model, Relation, evaluate
from optuav.modelling.check import evaluated
from optuav.modelling.classify import traits
from optuav.modelling.declaration import Constraint
from optuav.modelling.forms import NotExponentialError
from optuav.modelling.traversal import has_unknowns
from optuav.network import vehicle
from optuav.network.feasibility import impossibilities, rate_doubt
from optuav.network.graph import Graph
from optuav.network.network import Network, network_by
from optuav.network.one_stop import one_stop_is_enough
from optuav.network.places import build_places, charging_cap, on_landing
from optuav.network.timeline import route_phases, simulated
from optuav.network.variants import stacked
from optuav.physics.flight import speed_warning
from optuav.plan import Phase, Plan
from optuav.plan.data import CANNOT
from optuav.solving.assemble import legs_and_stays, quantities
from optuav.solving.balance import TIMES, by_balance
from optuav.solving.parts import Part, allowed
from optuav.solving.question import MOST_BUILDINGS, PROBLEM_NAMES, Question, answer
from optuav.status import SAME_S, Status

ANY_S = 1e9  # Longer than any time of a mission [s]
MOST_VIOLATED = 2  # violated constraints that are stated in full
ROUNDING = 1e-9  # share of the capacity that rounding may take
WHOLE = 1e-6  # Distance of an unknown from a whole number that is rounding
EDITED = {
    True: "some legs have figures from the graph, not from the flight model",
    False: "some places have sight or power of the laser from the graph, not from the mission",
}
"""Notes on figures that a user stated, of legs or else of stays."""
WARNED_OF = ("empty", "full")  # Events of a simulation that `Plan.warnings` states already.
ENDS = {
    "flight": "at the end of the flight {} → {}",
    "hover": "after the hover",
    "rest": "after the rest at {1}",
}
"""The end of a phase in words, by its kind, with the places where it starts and ends."""
BOUNDED = "bracketed: a feasible time, and a longer one that none exceeds"
MORE_STOPS = "more stops might gain hover time"
SEARCHED = "--stops 2 --hovers 2, or P1(stops=2, hovers=2)"
PROVED = {
    "P2": "bounded: no flight and rest is shorter than the shortest flight",
    "P2-tight": "bounded: no flight and rest is shorter, as the engine {} proves that no hover is "
    "longer",
}
"""Why a local optimum is the global one, by problem."""


def best(
    score: npt.ArrayLike,
    mission_time_s: npt.ArrayLike,
    stops: npt.ArrayLike,
    ties: npt.ArrayLike = SAME_S,
) -> int | None:
    """Number of the plan with the best score, then the shortest mission, then the fewest stops.

    It is the first of plans that tie: scores within what the best one says, missions to 1e-6 s. The
    score, such as the hover time [s], and the mission time are NaN without a plan.
    """
    scores, mission_s = np.asarray(score, float), np.asarray(mission_time_s, float)
    if np.isnan(scores).all():
        return None
    first = int(np.nanargmax(scores))
    (plans,) = (scores >= scores[first] - np.broadcast_to(ties, scores.shape)[first]).nonzero()
    missions_s = mission_s[plans]
    plans = plans[missions_s <= missions_s.min() + SAME_S]
    return int(plans[np.asarray(stops)[plans].argmin()])


def tied(group: Integers, figures: Floats, ties: Floats | float = SAME_S) -> Integers:
    """Numbers of those in groups that lie together whose figures tie with the least."""
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    if len(starts) == len(group):
        return starts
    sizes = np.diff(starts, append=len(group))
    least = np.minimum.reduceat(figures, starts).repeat(sizes)
    of_least = np.where(figures == least, ties, 0.0)
    within = np.maximum.reduceat(of_least, starts).repeat(sizes)
    return np.flatnonzero(figures <= least + within)


def plan_for(
    question: Question,
    network: Network,
    flown: Sequence[Phase] = (),
    given: Quantities | None = None,
    times_s: tuple[float, float] = (0.0, 0.0),
    **found: Any,
) -> Plan:
    """Return question and answer as a plan, with notes on its phases."""
    mission, notes, packs = network.mission, [*found.pop("notes", ())], network.mission.battery
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
            capacity_As = packs.packs * packs.capacity_As
            left_As = sum(flown[-1].available_As) + sum(flown[-1].bound_As)
            soc["battery"] = left_As / capacity_As
            begin_As = float(vehicle.start(mission).total_As)
            refused_As = begin_As + sum(phase.charge_As for phase in flown) - left_As
            if refused_As > ROUNDING * capacity_As and not packs.takes_turns:
                refused = f"the {refused_As:.6g} A s that the full battery refused are lost"
                only = "only the state of charge battery counts that"
                notes.append(f"charging tapered: {refused}; {only}")
        hover_s = sum(phase.duration_s for phase in flown if phase.kind == "hover")
        found = {"objective": hover_s, "objective_unit": "s", **found, "phases": flown, "soc": soc}
    return Plan(
        mission=mission,
        problem=question.problem.name,
        trajectory=question.problem.trajectory,
        building=question.problem.building,
        order=question.problem.order,
        perspective=question.perspective,
        slot_s=question.slot_s,
        notes=tuple(notes),
        **found,
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
    question: Question, network: Network, route: int, times_s: tuple[float, float], **found: Any
) -> Plan:
    """The plan that flies a route, and hovers and rests there for some times [s]."""
    flown = simulated(network.mission, route_phases(network, route, *times_s))
    given = quantities(network, np.array([route]), steps=False)
    return plan_for(question, network, flown, given, times_s, **found)


def plan_of(
    question: Question, network: Network, part: Part, solution: Solution, entry: int
) -> Plan:
    """The plan that belongs to the answer to one entry of a part, which is evaluated again."""
    rows = solution.verify(entry)
    point, route = solution.point(entry), int(part.routes[entry])
    hover_s, rest_s = (point.get(name, 0.0) for name in TIMES)
    if min(hover_s, rest_s) < 0.0:
        reason = "must be at least 0 s: declare the variable with lower=0.0"
        times = zip(TIMES, (hover_s, rest_s), strict=True)
        raise InputError([Fault(name, f"{t:g}", reason) for name, t in times if t < 0.0])
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
    return keys | {each.name: key for each in QUANTITIES if (key := each.metadata["key"])}


def _with_unknowns(network: Network, point: Values) -> tuple[Network, list[str]]:
    """The network where unknowns that stand for numbers of the mission have their values.

    With a note where no mission could have them.
    """
    values = {key: point[name] for name, key in _keys_by_name().items() if name in point}
    if not values:
        return network, []
    ranges, nearest = numeric_keys(), {key: round(value) for key, value in values.items()}
    counts = {key: value for key, value in values.items() if ranges[key].whole}
    counts = {k: nearest[k] if abs(v - nearest[k]) <= WHOLE else v for k, v in counts.items()}
    try:
        mission = network.mission.replace(as_stated(network.mission, values) | counts)
    except InputError as error:
        return network, [f"the plan has the mission's own numbers, not those found: {error}"]
    edited = network.legs.edited.any() or network.places.edited.any()
    if edited or all(key.startswith("start.") for key in values):
        return replace(network, mission=mission), []
    buildings = network.routes.building[1::2]
    return network_by(mission, build_places(mission), buildings), []


def moments(network: Network, part: Part, entry: int) -> dict[str, str]:
    """Return by constraint label the moment when it holds on a route, by places, if it has one."""
    constraints = part.declared.constraints
    steps = {c.label: c.step for c in constraints if c.step is not None}
    flights = {c.label: c.moment.flight for c in constraints if isinstance(c.moment, StepEnd)}
    if not flights:
        return {}
    table, names, ends = network.legs, network.places.names, list[str]()
    landed = [""]
    # The declaration has the stages that any of its routes has, bent ways more than straight ones.
    whole = part.routes if part.whole is None else part.whole
    routes = (legs_and_stays(network, numbers, part.rests) for numbers in (part.routes, whole))
    for (legs, stay), (all_legs, _) in zip(*routes, strict=True):
        leg = names[table.start[legs[entry]]], names[table.end[legs[entry]]]
        stages = np.flatnonzero(table.durations_s[:, all_legs].any(axis=1)).tolist()
        of_flight = "of the flight {} → {}".format(*leg)
        for stage in stages[:-1]:
            ends.append(f"after stage {stage + 1} ({table.stages[stage]}) {of_flight}")
        ends += [ENDS["flight"].format(*leg)] * (len(stages) > 0)
        ends += [ENDS[stay].format(*leg)] if stay else []
        landed += [on_landing(leg[1])] if stay else []
    known = {label: ends[step] for label, step in steps.items()}
    return {
        label: landed[flight] for label, flight in flights.items() if label not in known
    } | known


def words(network: Network, part: Part, entry: int, labels: Sequence[str]) -> list[str]:
    """Labels of constraints with their moments by the places of the route."""
    known = moments(network, part, entry)
    names = {c.label: c.name for c in part.declared.constraints}
    return [f"{names[label]} {known[label]}" if label in known else label for label in labels]


def plan_without(
    question: Question, network: Network, status: Status, proof: str, reasons: Sequence[str]
) -> Plan:
    """Return an empty plan that holds the reasons."""
    engine = "" if question.engine == AUTO else question.engine_name
    why = tuple(reasons)
    return plan_for(question, network, engine=engine, proof=proof, status=status, reasons=why)


def none_proved(model: Model, count: int, values: Values | None = None) -> Booleans:
    """For which of some programmes it is proved that no times are feasible."""
    from optuav.engines.bracket import some_point

    model_traits = traits(model)
    with suppress(NotExponentialError, InputError):
        if not model_traits.integer and model_traits.unknowns <= MOST_UNKNOWNS:
            return some_point(model, count, values)[1]
    return np.zeros(count, bool)


def proof_of_none(parts: Sequence[Part]) -> str:
    """Return the proof that no times are feasible, whatever an engine found; empty without one."""
    from optuav.engines.bracket import PROOF_OF_NONE

    none = (none_proved(part.model, len(part.routes)).all() for part in parts)
    return PROOF_OF_NONE if all(none) else ""


def subset(model: Model, constraints: Iterable[Constraint], far_s: float = math.inf) -> Model:
    """Some constraints of a model over the same unknowns, their sum up to a limit; no objective."""
    part, (first, *others) = Model(model.title), model.variables
    part.variables, part.constraints = model.variables, [*constraints]
    if far_s < math.inf:
        far = Relation(sum(others, start=first + 0.0), "<=", far_s)
        part.constraints.append(Constraint("", far, "s", ""))
    return part


def shortest_flight(network: Network, parts: Sequence[Part]) -> tuple[int, int]:
    """Part and entry of the route with the shortest flight."""
    flight_s = [network.routes.flight_time_s[part.routes] for part in parts]
    number = int(np.argmin([flights_s.min() for flights_s in flight_s]))
    return number, int(flight_s[number].argmin())


def shortfalls(question: Question, network: Network, parts: Sequence[Part]) -> tuple[str, ...]:
    """Why no times are feasible: what cannot hold on the shortest flight, at the least times.

    If each constraint can be met separately, say that they cannot be met together.
    """
    number, entry = shortest_flight(network, parts)
    part, deadline_s = parts[number], network.mission.limits.deadline_s
    shortest_s = network.routes.flight_time_s[part.routes[entry]]
    if shortest_s > deadline_s:
        late = f"longer than limits.deadline_s = {deadline_s:g} s"
        return (f"the flight takes {shortest_s:.2f} s, {late}",)
    model, parameters = part.model, part.model.row(entry)
    continuous = replace(question, slot_s=None, engine=AUTO)
    linear = (part for part in parts if traits(part.model).linear)
    without = (answer(part.model, len(part.routes), continuous).statuses for part in linear)
    if question.slot_s is not None and any(s.has_answer for found in without for s in found):
        slots = f"no whole slots of {written_out(question.slot_s)} s satisfy all constraints"
        reasons = [f"{slots} together; without slots there are times that do"]
        for constraint in model.constraints:
            right = constraint.relation.right
            if constraint.relation.sense == "==" and not has_unknowns(right):
                exact = f"exactly {evaluate(right, parameters):.6g} {constraint.unit}"
                reasons.append(f"{constraint.label}: {exact} are asked for")
        return tuple(reasons)
    least = {variable.name: evaluate(variable.lower, parameters) for variable in model.variables}
    times = ", ".join(f"{each.symbol} = {least[each.name]:g}" for each in model.variables)
    broken = [row for row in evaluated(model, {**parameters, **least}) if not row.satisfied]
    labels = words(network, part, entry, [row.label for row in broken])
    way = " → ".join(network.route_names(int(part.routes[entry])))
    violated = [
        f"{label}: {row.left:.6g} {row.sense} {row.right:.6g} does not hold at {times} on {way}"
        for label, row in zip(labels, broken, strict=True)
        if not has_unknowns(*row.constraint.relation.sides)
        or none_proved(subset(model, [row.constraint], ANY_S), 1, parameters)[0]
    ]
    if (more := len(violated) - MOST_VIOLATED) > 0:
        violated[MOST_VIOLATED:] = [f"nor do {more} other constraints hold there"]
    if question.slot_s is not None:
        return tuple(violated) or ("no whole slots satisfy all constraints together",)
    met = f": those that satisfy {' and '.join(labels[:MOST_VIOLATED])} break others"
    return tuple(violated) or (f"no times satisfy all constraints together{met * bool(labels)}",)


def replayed(plan: Plan, *, must_fly: bool = True) -> Plan:
    """The plan with the verdict of its simulation; one that must fly and does not is an error."""
    if not plan:
        return plan
    simulated_plan = replay(plan)
    events = simulated_plan.violations
    # That a plan of the perspective `available` fails would be a fault of this package.
    if must_fly and plan.perspective == AVAILABLE and plan.problem in PROBLEM_NAMES and events:
        why = "; ".join(event.words + event.figures for event in events)
        raise SolverError(f"{plan.engine} returned a plan that fails its simulation: {why}")
    untold = (event.words + event.figures for event in events if event.kind not in WARNED_OF)
    notes = (*plan.notes, *(f"{CANNOT}{words}" for words in untold))
    low = (event for event in simulated_plan.events if event.kind == BELOW_RESERVE)
    notes = (*notes, *(event.words + event.figures for event in low))
    notes = (*notes, *rate_doubt(plan.mission, _draws(plan)))
    return plan.model_copy(update={"flyable": not events, "notes": notes})


def _draws(plan: Plan) -> Iterator[tuple[str, float]]:
    """The largest draw of every phase [A]."""
    for phase in plan.phases:
        way = phase.start_place, phase.end_place
        what = f"the leg {' → '.join(way)}" if phase.kind == "flight" else f"the {phase.kind}"
        yield what, max(-stage.current_A for stage in phase.stages)


def against_p1(question: Question, network: Network, parts: Sequence[Part], plan: Plan) -> Plan:
    """The plan of (P2) compared with (P1), and proved where (P1) is a proof."""
    # (P2) minimises T_fl + T'. As printed it cannot be less than the shortest T_fl. With the
    # deadline tight it is T_max − Δ, and Δ cannot be more than in (P1).
    name, deadline_s = question.problem.name, network.mission.limits.deadline_s
    least_s, longest_s, beyond_s = math.inf, -math.inf, -math.inf
    for part in parts:
        values, count = quantities(network, part.routes, rests=part.rests), len(part.routes)
        model = P1().model(values, question.perspective)
        solution = answer(model, count, replace(question, problem=P1()))
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
        notes.append(f"(P1) hovers {longest_s:.2f} s on the same mission, {longer_s:.2f} s longer")
    bound_s = least_s if name == "P2" else deadline_s - beyond_s
    over_s = plan.flight_time_s + plan.rest_time_s - bound_s
    if plan.status is Status.LOCALLY_OPTIMAL and over_s <= SAME_S:
        changes = {"status": Status.OPTIMAL, "proof": PROVED[name].format(solution.engine)}
    elif plan.status is Status.LOCALLY_OPTIMAL and math.isfinite(over_s):
        notes.append(f"not proved: up to {over_s:.6g} s less has not been ruled out")
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
    if turns or perspective not in (*PAPER, AVAILABLE) or not mission.buildings:
        return False
    if not plan and impossibilities(network, one_stop=False):
        return False
    if perspective == AVAILABLE:
        hovers_s, _ = by_balance(network)
        most_s = hovers_s[network.routes.flyable].max(initial=-np.inf)
        if (plan.hover_time_s if plan else -np.inf) < most_s - SAME_S:
            return True
    return not one_stop_is_enough(network, graph)


def promise(question: Question, network: Network, plan: Plan) -> Iterator[str]:
    """Note the hover that charge allows, if a battery that never runs dry allows less."""
    routes = network.routes
    hover_s, rest_s = by_balance(network)
    hover_s = np.where(allowed(stacked(network), question.problem)[0], hover_s, -np.inf)
    route = best(hover_s, routes.flight_time_s + hover_s + rest_s, routes.building >= 0)
    if route is None or hover_s[route] <= plan.hover_time_s + SAME_S:
        return
    note = "perspective battery, which checks only charge, and not the wells, "
    here = "" if network.mission.route.hover_m is None else " at this hover point"
    note += f"promises {hover_s[route]:.2f} s of hover{here}"
    phases = route_phases(network, route, float(hover_s[route]), float(rest_s[route]))
    flown = plan.model_copy(update={"phases": phases})
    ends = (flown.overfull_s, "overfill the available well"), (flown.runs_dry_s, "run dry and fall")
    if faults := [f"{words} at {at_s:.2f} s" for at_s, words in ends if at_s is not None]:
        note += f"; that plan would {' and '.join(faults)}"
    elif others := [event for event in replay(flown).violations if event.kind != MISMATCH]:
        note += f"; that plan cannot be flown: {others[0].words}{others[0].figures}"
    yield note
