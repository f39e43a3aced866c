"""`optuav.explain`: reasons for an optimum, reasons for no plan, and repairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p4 import P4
from formulations.soc import AVAILABLE, StepEnd
from optuav.diagnosis.findings import ConstraintAtOptimum
from optuav.diagnosis.in_words import limit
from optuav.diagnosis.infeasibility import bound, conflicts, is_own, parameters_in
from optuav.diagnosis.key_prices import key_prices
from optuav.diagnosis.parameter_prices import prices
from optuav.diagnosis.repair import MissionQuestion, repairs
from optuav.diagnosis.report import Explanation
from optuav.engines.registry import Engine, engine_names
from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.judge import audit
from optuav.mission import Mission
from optuav.mission.files import refusal
from optuav.mission.messages import path_of
from optuav.modelling import Model, Variable
from optuav.modelling.check import evaluated, relations
from optuav.modelling.traversal import has_unknowns, leaves
from optuav.modelling.writer import Text
from optuav.network.graph import Graph, as_graph
from optuav.network.network import build_network
from optuav.network.places import charging_cap
from optuav.options import ORDERS, Perspective, ProblemName
from optuav.plan import Plan, load_plan, load_subject
from optuav.plan.plane import kind_of
from optuav.presentation.numbers import figure, seconds
from optuav.solving import Program, solve
from optuav.solving.best_plans import wants_hover
from optuav.solving.constraint_words import limits_share, words
from optuav.solving.free_speed import FreeSpeedProgram
from optuav.solving.more_stops import more_stops_may_help, not_excluded
from optuav.solving.packs_by_schedule import ENGINE as SIMULATION
from optuav.solving.question import PROBLEM_NAMES, mission_and_question, problem_of
from optuav.solving.route_models import RouteModel
from optuav.solving.solve import calm_notes
from optuav.status import SAME_S, Status


@runtime_checkable
class PlanInDoubt(Protocol):
    """A plan that holds for uncertain numbers, with the hover that each of them costs [s]."""

    @property
    def plan(self) -> Plan:
        """The plan, which records its question."""

    @property
    def doubt_costs_s(self) -> Mapping[str, float]:
        """Hover that each uncertain number costs [s], by name; the largest first."""


Asked: TypeAlias = Program | Plan | Mission | str | Path
Subject: TypeAlias = Asked | PlanInDoubt
STOPS = (
    "several stops have no single programme, they are searched for: explain the mission for the "
    "constraints, prices and repairs of one rest and one hover"
)
TURNS = (
    "packs that take turns are simulated, without a programme: constraints, prices and repairs are "
    "known with battery.schedule=pooled only"
)
WITHOUT_STOPS = (
    "constraints and prices are known for one rest and one hover: explain the mission without "
    "--stops and --hovers"
)
HELD = "constraints and prices are those at the hover point found, which has no price of its own"
AT_SPEEDS = "constraints and prices are those at the speeds found"
NO_SPEEDS = "this is for the speeds that the mission sets; at other speeds no plan was found either"
NOWHERE = "this is for hovering at w_U; elsewhere within reach no plan was found either"
LONGEST_STATEMENT = 500  # Characters of a constraint that is written out
SEARCH_S = 60.0  # Time limit of a search for more stops where none is stated [s]


def explain(
    subject: Subject,
    /,
    problem: Formulation | ProblemName | None = None,
    *,
    perspective: Perspective | None = None,
    slot_s: float | None = None,
    engine: str | Engine | None = None,
    graph: Graph | None = None,
    time_limit_s: float | None = None,
) -> Explanation:
    """Explain an answer: binding constraints and prices, or conflicts and repairs.

    For P1 with several stops, it gives their gain over one rest and one hover.

    Parameters
    ----------
    subject
        A plan or its file (.json), a program of `optuav.formulate`, or a mission for
        `optuav.solve`. For a `PlanInDoubt`, its question is explained with certain numbers,
        and the number that costs most hover is named.
    problem, perspective, slot_s, engine, graph
        With a mission only: as for `optuav.solve`; None for ``"P1"``, ``"available"``, continuous
        times, ``"auto"`` and the mission's own graph.
    time_limit_s
        With a mission only: as for `optuav.solve`, but 60 s by default for a search for more stops.

    Returns
    -------
    Explanation
        Text by `print`, data by `to_dict`.

    Raises
    ------
    InputError
        If an option does not exist, contradicts another or comes with anything but a mission; if
        the engine does not accept the problem; or if a plan does not record its question, such as a
        plan over an edited graph or of a user's formulation.
    SolverError
        If the engine fails.

    Examples
    --------
    >>> import optuav
    >>> explained = optuav.explain("paper", "P3", perspective="battery")
    >>> {price.key: round(price.gain, 3) for price in explained.prices[1:4]}
    {'battery.packs': 389.033, 'battery.capacity_As': 0.022, 'limits.min_soc': -8.19}
    """
    options = {"slot_s": slot_s, "engine": engine, "time_limit_s": time_limit_s}
    if isinstance(subject, str | Path) and Path(subject).suffix == ".json":
        subject = saved_plan(subject)
    elif isinstance(subject, PlanInDoubt):
        _refuse_options("robust plan", options, graph, problem=problem, perspective=perspective)
        taken = {**_of_plan(subject.plan), "engine": "auto"}  # Whatever engine took the corners
        certain = explain(subject.plan.mission, **taken)
        return replace(certain, doubt_costs_s=dict(subject.doubt_costs_s))
    elif not isinstance(subject, Program | str | Path):
        subject = load_subject(subject)
    if isinstance(subject, Plan) and subject.has_several_stops:
        return Explanation(subject, notes=(STOPS,), more_stops_open=True)
    question = question_of(subject, graph, problem=problem, perspective=perspective, **options)
    if question.stated.several:
        return _in_wind(question, _with_more_stops(question))
    plan = subject if isinstance(subject, Plan) else None
    return _in_wind(question, _noted(question, _explained(question, plan)))


def _in_wind(question: MissionQuestion, explained: Explanation) -> Explanation:
    """Add what calm air gives to the explanation of a plan that counts on the wind."""
    if not explained:
        return explained
    options = vars(question.stated)
    if question.stated.several and question.stated.time_limit_s is None:
        options = {**options, "time_limit_s": SEARCH_S}
    loaded, checked = mission_and_question(question.mission, **options)
    notes = *explained.notes, *calm_notes(loaded, checked, question.graph)
    return replace(explained, notes=tuple(dict.fromkeys(notes)))


def _noted(question: MissionQuestion, explained: Explanation) -> Explanation:
    """Add a note to the explanation if more stops may gain more."""
    if not explained.more_stops_open or question.stated.p1.hover_point != "w_U":
        return explained
    note = not_excluded(question.stated, question.mission)
    return replace(explained, notes=(*explained.notes, note))


def explain_plan(program: Program, plan: Plan) -> Explanation:
    """Explain the plan that `Program.solve` gave, without a second solve.

    Whole steps are solved again only for parameters with a price. The program has its mission's own
    graph, and at most one rest and one hover.
    """
    question = MissionQuestion(program.network.mission, program.question)
    return _noted(question, _explained(question, plan, program))


def saved_plan(path: str | Path) -> Plan:
    """Return the plan of a file; refused where its simulation contradicts it."""
    plan = load_plan(path)
    if plan and audit(plan).contradicted:
        raise refusal(path_of(path), "its simulation contradicts this plan: optuav show says where")
    return plan


def question_of(subject: Asked, graph: Graph | None = None, **options: Any) -> MissionQuestion:
    """The question behind a program, a plan, or a mission with options of `optuav.formulate`.

    None stands for a default. `InputError` if anything but a mission has options, or a plan does
    not record its question or has several stops.
    """
    set_options = {name: value for name, value in options.items() if value is not None}
    if isinstance(subject, Program | Plan):
        _refuse_options(type(subject).__name__.lower(), set_options, graph)
    if isinstance(subject, Program):
        used = subject.network
        computed = build_network(used.mission)
        edited = used.legs.edited.any() or used.places.edited.any()
        if edited or not np.array_equal(computed.legs.flyable, used.legs.flyable):
            graph = as_graph(used)
        return MissionQuestion(used.mission, subject.question, graph)
    if isinstance(subject, Plan):
        set_options, subject = _of_plan(subject), subject.mission
    mission, checked = mission_and_question(subject, **set_options)
    return MissionQuestion(mission, replace(checked, slot_s=set_options.get("slot_s")), graph)


def _refuse_options(
    subject: str, options: Mapping[str, Any], graph: Graph | None, **more: Any
) -> None:
    """Raise `InputError` for options that the subject has itself."""
    every = {**more, **options, "graph": graph}
    if given := ", ".join(name for name, value in every.items() if value is not None):
        words = f"a {subject} has its own options"
        raise InputError(f"{given}: {words}; explain its mission to change them")


def problem_of_plan(plan: Plan, **fields: Any) -> Formulation:
    """The problem that a plan answers, with further fields, None for their defaults."""
    names = "trajectory", "building", "order", "device_order"
    return problem_of(plan.problem, **{name: getattr(plan, name) for name in names}, **fields)


def _of_plan(plan: Plan) -> dict[str, Any]:
    """Problem, perspective, slots and engine of a plan."""
    if plan.has_several_stops:
        raise InputError(f"the plan's question cannot be asked again: {STOPS}")
    if any(phase.edited for phase in plan.phases):
        raise InputError("the plan is over an edited graph: explain its mission with graph=")
    if plan.problem not in PROBLEM_NAMES:
        words = "is not of the paper, and a plan does not record the fields of such a problem"
        raise InputError(f"the plan's problem {plan.problem} {words}: explain its mission with it")
    if plan.engine not in ("", SIMULATION, *engine_names()):
        words = "register it, or explain the mission with engine="
        raise InputError(f"the plan's engine {plan.engine} is not known by its name: {words}")
    sought = any(phase.speeds_m_s for phase in plan.phases)
    return {
        "problem": problem_of_plan(plan, speed="free" if sought else None),
        "perspective": plan.perspective,
        "slot_s": plan.slot_s,
        # Packs that take turns are simulated, and speeds sought, by no engine that can be named.
        "engine": "auto" if sought or plan.engine in ("", SIMULATION) else plan.engine,
    }


def _explained(
    question: MissionQuestion, plan: Plan | None = None, program: Program | None = None
) -> Explanation:
    """The explanation of a question with one rest and one hover, and of its plan if it is known.

    A program that is known has been solved; then steps without a price are not solved again.
    """
    brief, turns = program is not None, question.mission.battery.takes_turns
    if turns and question.stated.perspective == AVAILABLE:
        return Explanation(plan or question.solve(), notes=(TURNS,))
    if question.stated.p1.hover_point == "free":
        plan = plan or question.solve()
        at_w_u = question.about(replace(question.stated.p1, hover_point="w_U"))
        explained = _explained(question_of(plan) if plan else at_w_u, plan or None)
        note = HELD if plan else NOWHERE
        return replace(explained, plan=plan, notes=(note, *explained.notes))
    program, solutions = program or question.program(), None
    if isinstance(program, FreeSpeedProgram):
        plan = plan or program.solve()
        if not plan:
            problem: Any = question.stated.problem
            explained = _explained(question.about(replace(problem, speed="mission")))
            return replace(explained, plan=plan, notes=(NO_SPEEDS, *explained.notes))
        held = program.held(plan)
        reply = _optimum(held, plan, held.answers(), brief)
        return replace(reply, notes=(program.price_words(plan), AT_SPEEDS, *reply.notes))
    # Whether a wanted hover fits, no engine has to say.
    unfit = wants_hover(program.question) and not (plan := plan or program.solve())
    if program.parts and program.question.slot_s is None and not unfit:
        solutions = program.answers()
        plan = plan if plan or brief else program.plan(solutions)
    plan = plan if plan or brief else program.solve()
    assert plan is not None
    cap = charging_cap(program.network.mission, program.network.places)
    notes = [cap.words] if cap and any(part.rests for part in program.parts) else []
    more_stops_open = more_stops_may_help(program.question, program.network, plan, question.graph)
    if plan:
        reply = _optimum(program, plan, solutions, brief)
        notes = [*dict.fromkeys([*_rest_between(question, plan), *reply.notes, *notes])]
        return replace(reply, notes=tuple(notes), more_stops_open=more_stops_open)
    if plan.status is not Status.INFEASIBLE:
        return Explanation(plan)
    clashing, repaired = conflicts(program), repairs(question)
    keys = [key for conflict in clashing for proof in conflict.proofs for key in proof.keys]
    drained = any(key.startswith("battery.") for key in keys)
    reply = Explanation(plan, conflicts=clashing, repairs=repaired, more_stops_open=more_stops_open)
    return replace(reply, notes=tuple(notes)) if drained else reply


def _rest_between(question: MissionQuestion, plan: Plan) -> Iterator[str]:
    """Say what a rest between the hovers over several devices gains over one elsewhere."""
    question_of_plan, stays = question.stated, plan.stops
    problem: Any = question_of_plan.problem
    rests = [n for n, stop in enumerate(stays) if stop.kind == "rest"]
    if not (question.mission.devices and rests and isinstance(problem, P1 | P4)):
        return
    (number,) = rests
    if not 0 < number < len(stays) - 1 or problem.order is not None:
        return
    times_s = list[float]()
    for order in ORDERS:  # Either of them has the direct routes of P1 too
        options = vars(replace(question_of_plan, problem=replace(problem, order=order)))
        other = solve(question.mission, graph=question.graph, **options)
        times_s += [other.hover_time_s] if other else []
    before, after = stays[number - 1].at, stays[number + 1].at
    where = f"the rest lies between the hovers over {before} and {after}"
    if not times_s:
        yield f"{where}: without a rest there, no plan exists"
    elif (gain_s := plan.hover_time_s - max(times_s)) > SAME_S:
        least = f"the best plan hovers {seconds(max(times_s))}, {seconds(gain_s)} less"
        yield f"{where}: without a rest there, {least}"
    else:
        yield f"{where}: without a rest there, a plan hovers as long"


def _with_more_stops(question: MissionQuestion) -> Explanation:
    """Explain how much more stops gain over one rest and one hover."""
    several = question.stated
    one = question.about(replace(several.p1, stops=1, hovers=1))
    counts = ((several.p1.stops, "rest"), (several.p1.hovers, "hover"))
    asked_for = " and ".join(f"{n} {name}{'s' * (n != 1)}" for n, name in counts)
    limit_s = SEARCH_S if several.time_limit_s is None else several.time_limit_s
    try:
        options = vars(replace(several, time_limit_s=limit_s))
        plan = solve(question.mission, graph=question.graph, **options)
    except SolverError as error:
        explained = _explained(one)
        outcome = Status.FEASIBLE if explained else Status.UNKNOWN
        proof = f"known for one rest and one hover only: {explained.plan.proof}"
        answered = explained.plan.model_copy(update={"status": outcome, "proof": proof})
        note = f"at most {asked_for}: {error}"
        return replace(explained, plan=answered, notes=(note, *explained.notes))
    if not plan:
        return replace(_explained(one), plan=plan)
    single, gain_s = one.program().solve(), None
    gain = " make a plan possible: with one rest and one hover none exists"
    if single:
        gain_s = plan.hover_time_s - single.hover_time_s
        compared = f"one rest and one hover in one piece, {seconds(single.hover_time_s)}"
        change = f"{seconds(abs(gain_s))} {'longer' if gain_s > 0.0 else 'shorter'}"
        gain = f": {seconds(plan.hover_time_s)} of hover, {change} than with {compared}"
    if gain_s is None or abs(gain_s) > SAME_S:
        notes = (f"at most {asked_for}{gain}", WITHOUT_STOPS)
        return Explanation(plan, notes=notes, more_stops_open=True, gain_s=gain_s)
    explained = _explained(one, single)
    nothing = f"at most {asked_for}: no longer hover was found than with {compared}"
    if plan.status is Status.OPTIMAL:
        nothing = f"at most {asked_for} gain nothing: no hover is longer than with {compared}"
    return replace(explained, plan=plan, notes=(nothing, *explained.notes), gain_s=0.0)


def _optimum(
    program: Program, plan: Plan, solutions: Sequence[Solution] | None, brief: bool
) -> Explanation:
    """Why a plan is the best one, by the programme with continuous times that it answers."""
    if solutions is None:
        continuous = replace(program.question, slot_s=None, engine="auto")
        solutions = replace(program, question=continuous).answers()
    tied = program.tied(solutions)
    if not tied:
        return Explanation(plan, notes=("solving again gave no answer",))
    number, entry = tied[0]
    part, solution = program.parts[number], solutions[number]
    point, row = solution.point(entry), part.model.row(entry)
    hover_s, sought = point.get("hover_time_s", 0.0), _objective(part.model)
    second = float(solution.second[entry])
    notes = [] if plan.status is Status.OPTIMAL else [*plan.notes]
    if program.question.slot_s is not None:
        best = f"the optimum with continuous times, {figure(solution.objective[entry])} {sought}"
        belong = "constraints, proof and prices belong to"
        notes.append(f"an answer in slots has no shadow prices: {belong} {best}")
    elif abs(hover_s - plan.hover_time_s) > SAME_S * max(1.0, hover_s):
        notes.append(f"solving again returns {seconds(hover_s, 6)} of hover, not the plan's")
    if len(tied) > 1:
        routes = [program.network.route_names(program.parts[k].routes[e])[1:-1] for k, e in tied]
        ways = ", ".join(" → ".join(route) for route in routes[:4])
        notes.append(f"{len(tied)} routes tie ({ways}): a price follows the best on either side")
    return Explanation(
        plan,
        objective=sought,
        sense=part.model.sense,
        constraints=tuple(_sides(program, part, entry, {**row, **point})),
        bound=bound(part.model, row, solution.binding_labels(entry)),
        prices=prices(program, solutions, tied[0], brief=brief),
        key_prices=() if brief else key_prices(program.question, program.network, second),
        notes=tuple(notes),
    )


def _objective(model: Model) -> str:
    """The unit of the objective, stated or of all its terms; its name if it is a known time."""
    goal, names = model.objective, {"hover_time_s": "hover", "rest_time_s": "rest"}
    units = {model.objective_unit} - {""} or {leaf.unit for leaf in leaves(goal)}
    unit = units.pop() if len(units) == 1 and units != {"1"} else ""
    noun = names.get(goal.name) if isinstance(goal, Variable) else None
    return f"{unit} of {noun}" if unit and noun else unit or f"of {noun or 'the objective'}"


def _sides(
    program: Program, part: RouteModel, entry: int, values: dict[str, float]
) -> Iterator[ConstraintAtOptimum]:
    """The constraints with unknowns or own parameters; others compare figures of the mission."""
    way = program.network.route_names(int(part.routes[entry]))
    plain = [relation.label for relation in relations(part.model)]
    labels = words(program.network, part, entry, plain)
    for label, row in zip(labels, evaluated(part.model, values), strict=True):
        constraint, slack, right = row.constraint, float(row.slack), float(row.right)
        kind, moment = kind_of(constraint), constraint.moment
        has_own = any(map(is_own, parameters_in(constraint)))
        if not (has_own or has_unknowns(*constraint.relation.sides)):
            continue
        notation = Text()
        statement = notation.write(constraint.relation).replace(notation.after, " ")
        yield ConstraintAtOptimum(
            label,
            row.unit,
            statement if len(statement) <= LONGEST_STATEMENT else "",
            float(row.left),
            Text.senses[row.sense],
            right,
            slack,
            binds=abs(slack) <= 1e-6 * max(1.0, abs(right)),
            kind=kind,
            step=constraint.step,
            in_flight=isinstance(moment, StepEnd) and not moment.stay,
            words=limit(kind, moment, way, label),
            is_share=limits_share(constraint),
        )
