"""What is explained or repaired: a mission with a question, and whether any times are feasible."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from formulations.formulation import Formulation
from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import PAPER
from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines import bracket, grid
from optuav.engines.linear_form import slot_ranges
from optuav.engines.registry import MOST_UNKNOWNS
from optuav.errors import InputError, SolverError
from optuav.mission import Mission, load
from optuav.modelling import Model, NotAffineError
from optuav.modelling.check import evaluated, holding
from optuav.modelling.classify import traits
from optuav.modelling.forms import NotExponentialError, excess
from optuav.network.feasibility import impossibilities
from optuav.network.graph import Graph, as_graph, edited_network
from optuav.network.network import Network, build_network
from optuav.physics.kibam import Stage
from optuav.plan import Plan
from optuav.solving import Program, formulate
from optuav.solving.assemble import quantities
from optuav.solving.batch import AT_ONCE
from optuav.solving.outcome import Part
from optuav.solving.packs_by_schedule import ENGINE as SIMULATION
from optuav.solving.program import groups
from optuav.solving.question import PROBLEM_NAMES, Question, answer, checked_question, problem_of
from optuav.status import Status

Subject: TypeAlias = Program | Plan | Mission | str | Path
Case: TypeAlias = tuple[Question, Network]  # A question about the network of a mission
STOPS = (
    "several stops are searched for, and no single programme declares them: constraints, prices "
    "and repairs are known for one rest and one hover only, if the mission is explained"
)
MOST_SLOTS, MOST_FAR = 2500, 500
"""Slots of an unknown that are tried one by one, and others, ever further apart, beyond them."""


@dataclass(frozen=True)
class MissionQuestion:
    """A question that can be put to other missions as well."""

    mission: Mission
    stated: Question  # The slots of the mission are left out where it does not state its own
    graph: Graph | None = None  # A graph that was edited

    def program(self) -> Program:
        """The question declared."""
        return formulate(self.mission, graph=self.graph, **vars(self.stated))

    def case(self, mission: Mission) -> Case:
        """The question about another mission and its network, without declarations."""
        graph = self.graph
        network = build_network(mission) if graph is None else edited_network(mission, graph)
        return checked_question(mission, **vars(self.stated)), network

    def about(self, problem: Formulation) -> MissionQuestion:
        """The question with another problem."""
        return replace(self, stated=replace(self.stated, problem=problem))


def question_of(subject: Subject, graph: Graph | None = None, **options: Any) -> MissionQuestion:
    """The question behind a program, a plan, or a mission with options of `optuav.formulate`.

    Options that are None have their defaults. Raises `InputError` if any are given for anything but
    a mission, or a plan does not record its question, or has several stops.
    """
    stated = {name: value for name, value in options.items() if value is not None}
    if isinstance(subject, Program | Plan) and (stated or graph is not None):
        given = ", ".join([*stated, *(["graph"] if graph is not None else [])])
        words = f"a {type(subject).__name__.lower()} brings its own options"
        raise InputError(f"{given}: {words}; name the mission to change them")
    if isinstance(subject, Program):
        used = subject.network
        computed = build_network(used.mission)
        edited = used.legs.edited.any() or used.places.edited.any()
        if edited or not np.array_equal(computed.legs.flyable, used.legs.flyable):
            graph = as_graph(used)
        return MissionQuestion(used.mission, subject.question, graph)
    if isinstance(subject, Plan):
        mission, stated = subject.mission, _of_plan(subject)
    else:
        mission = subject if isinstance(subject, Mission) else load(subject)
    checked = checked_question(mission, **stated)
    return MissionQuestion(mission, replace(checked, slot_s=stated.get("slot_s")), graph)


def _of_plan(plan: Plan) -> dict[str, Any]:
    """Problem, perspective, slots and engine of a plan."""
    if plan.has_several_stops:
        raise InputError(f"the plan's question cannot be asked again: {STOPS}")
    if any(phase.edited for phase in plan.phases):
        raise InputError("the plan is over an edited graph: explain its mission with graph=")
    if plan.problem not in PROBLEM_NAMES:
        raise InputError(
            f"the plan's problem {plan.problem} is a formulation of one's own, which its file does "
            "not hold: explain the mission with it"
        )
    fields = {name: getattr(plan, name) for name in ("trajectory", "building", "order")}
    return {
        "problem": problem_of(plan.problem, **fields),
        "perspective": plan.perspective,
        "slot_s": plan.slot_s,
        # Packs that take turns are simulated, by no engine that can be named.
        "engine": "auto" if plan.engine in ("", SIMULATION) else plan.engine,
    }


class Stack(NamedTuple):
    """Routes of several cases as the quantities of one declaration."""

    question: Question  # The same about all of them
    given: Quantities  # Arrays with one entry a route
    cases: Integers  # Number of the case that each route belongs to


def feasible(cases: Sequence[Case]) -> list[bool]:
    """Whether some route of each case has feasible times.

    Exact for programmes in one or two unknowns that are linear, or state what phases of constant
    current do to the wells of a battery, as those of the package do; up to two thousand slots
    too. With more slots some are tried, so that a yes is certain and a no is not. For other
    programmes the engine is asked.
    """
    found = [False] * len(cases)
    for stack in _stacks(cases):
        question, slot_s = stack.question, stack.question.slot_s
        model = question.problem.model(stack.given, question.perspective)
        if Part(model, stack.cases).rests != stack.given.rests:
            continue
        possible = _continuous(stack, model)
        if slot_s is not None:
            possible &= _meetable(model, slot_s)
        for entry in np.flatnonzero(possible).tolist():
            case = stack.cases[entry]
            if not found[case]:
                found[case] = slot_s is None or _in_slots(model, model.row(entry), slot_s)
    return found


def _stacks(cases: Sequence[Case]) -> Iterator[Stack]:
    """All routes that can be flown, those together that a single declaration can serve.

    Declared one by one, the routes of an infeasible mission would take six times as long.
    """
    alike: dict[Hashable, list[Stack]] = {}
    for number, (question, network) in enumerate(cases):
        for which, rests in [] if impossibilities(network) else groups(question, network):
            through_wells = question.perspective not in PAPER
            given = quantities(network, which, rests=rests, steps=through_wells)
            stated = tuple(e.name for e in QUANTITIES if getattr(given, e.name) is not None)
            stays = tuple(step if isinstance(step, str) else "" for step in given.steps)
            kind = alike.setdefault((question, given.rests, stated, stays), [])
            kind.append(Stack(question, given, np.full(len(which), number)))
            if sum(len(each.cases) for each in kind) > AT_ONCE:
                yield _joined(kind)
                kind.clear()
    yield from (_joined(kind) for kind in alike.values() if kind)


def _joined(stacks: Sequence[Stack]) -> Stack:
    """Stacks of the same kind one after the other."""
    question, first, _ = stacks[0]
    every = [each.given for each in stacks]
    counts = [len(each.cases) for each in stacks]

    def join(*values: Floats | float) -> Floats:
        return np.concatenate([np.broadcast_to(*pair) for pair in zip(values, counts, strict=True)])

    figures: Values = {
        each.name: join(*(getattr(given, each.name) for given in every))
        for each in QUANTITIES
        if getattr(first, each.name) is not None
    }
    steps = tuple(
        same[0] if isinstance(same[0], str) else Stage(*map(join, *same))
        for same in zip(*(given.steps for given in every), strict=True)
    )
    cases = np.concatenate([each.cases for each in stacks])
    return Stack(question, replace(first, **figures, steps=steps), cases)


def _continuous(stack: Stack, model: Model) -> Booleans:
    """Which routes have feasible times, whole slots or not; evaluated outside the engine."""
    count = len(stack.cases)
    if len(model.variables) <= MOST_UNKNOWNS and not traits(model).integer:
        with suppress(NotExponentialError, InputError):
            rows = evaluated(model, bracket.some_point(model, count)[0])
            holds = np.broadcast_arrays(*(row.satisfied for row in rows))
            return np.asarray(np.logical_and.reduce(holds))
    try:
        statuses = answer(model, count, stack.question).statuses
    except SolverError:
        return np.zeros(count, bool)
    return np.array([each.has_answer or each is Status.UNBOUNDED for each in statuses])


def _meetable(model: Model, slot_s: float) -> Booleans:
    """Whether whole slots can add up to what sums of unknowns have to equal, by programme.

    Nearly no mission has such slots, and trying all of them takes a second a route.
    """
    possible = np.array(True)
    for relation in (each.relation for each in model.constraints if each.relation.sense == "=="):
        with suppress(NotAffineError):
            form, _ = excess(relation, {})
            if all(np.all(each == 1.0) for each in form.coefficients.values()):
                nearest_s = slot_s * np.round(form.constant / slot_s)
                possible = possible & holding("==", nearest_s, form.constant)
    return possible


def _in_slots(model: Model, parameters: Values, slot_s: float) -> bool:
    """Whether some whole slots are feasible, by the tests of the grid engine."""
    axes, ranges = [], slot_ranges(model, parameters, slot_s)
    for first, last in ranges.values():
        count = last - first + 1.0
        far = np.floor(np.geomspace(1.0, max(count, 1.0), MOST_FAR)) - 1.0
        slots = np.union1d(np.arange(min(count, MOST_SLOTS)), far[far < count])
        axes.append(slot_s * (first + slots))
    points = dict(zip(ranges, np.ix_(*axes), strict=True))
    return bool(grid.cells(itertools.chain(*grid.tests(model, parameters)), points).any())
