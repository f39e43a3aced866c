"""What is explained or repaired: a mission with a question about it, however it is given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.soc import AVAILABLE
from optuav.engines.registry import Engine
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.network.network import Network, build_network
from optuav.options import Perspective, ProblemName
from optuav.plan import Plan
from optuav.solving import Program, formulate
from optuav.solving.packs_by_schedule import ENGINE as SIMULATION
from optuav.solving.question import PROBLEMS, Question, checked_question, problem_of
from optuav.solving.several_stops import ENGINE as SEARCH
from optuav.solving.solve import network_of

if TYPE_CHECKING:
    from optuav.network.graph import Graph

Subject: TypeAlias = Program | Plan | Mission | str | Path
STOPS = (
    "several stops are searched for, and no single programme declares them: constraints, prices "
    "and repairs are known for one rest and one hover only, if the mission is explained"
)


class Case(NamedTuple):
    """A question about the network of a mission."""

    question: Question
    network: Network


@dataclass(frozen=True)
class MissionQuestion:
    """A question that can be put to other missions as well."""

    mission: Mission
    stated: Question  # The slots of the mission are left out where it does not state its own
    graph: Graph | None = None  # A graph that was edited

    def program(self) -> Program:
        """The question declared."""
        return formulate(self.mission, graph=self.graph, **vars(self.stated))

    def case(self, mission: Mission | None = None) -> Case:
        """The question and the network, of this mission or of another, without declarations."""
        known = self.mission if mission is None else mission
        return Case(checked_question(known, **vars(self.stated)), network_of(known, self.graph))

    @property
    def takes_turns(self) -> bool:
        """Whether packs take turns, which is simulated and not declared."""
        return self.stated.perspective == AVAILABLE and self.mission.battery.takes_turns

    @property
    def several(self) -> bool:
        """Whether more than one rest or one hover in one piece is asked for."""
        return self.stated.several

    def with_stops(self, stops: int | None, hovers: int | None) -> MissionQuestion:
        """The question with so many rests and hovers; an `InputError` if the problem is not P1."""
        if stops is None and hovers is None:
            return self
        problem = self.stated.problem
        if not isinstance(problem, P1):
            words = f"problem {problem.name} takes none, P1 does"
            counts = (("stops", stops), ("hovers", hovers))
            raise InputError([Fault(n, str(v), words) for n, v in counts if v is not None])
        problem = replace(
            problem,
            stops=problem.stops if stops is None else stops,
            hovers=problem.hovers if hovers is None else hovers,
        )
        return replace(self, stated=replace(self.stated, problem=problem))


def question_of(
    subject: Subject,
    problem: Formulation | ProblemName | None = None,
    perspective: Perspective | None = None,
    slot_s: float | None = None,
    engine: str | Engine | None = None,
    graph: Graph | None = None,
    time_limit_s: float | None = None,
) -> MissionQuestion:
    """The question behind a program, a plan, or a mission with the options of `optuav.formulate`.

    Raises `InputError` if options are given for anything but a mission, or a plan does not record
    its question, or has several stops.
    """
    options = {
        "problem": problem,
        "perspective": perspective,
        "slot_s": slot_s,
        "engine": engine,
        "graph": graph,
        "time_limit_s": time_limit_s,
    }
    given = [name for name, value in options.items() if value is not None]
    if isinstance(subject, Program | Plan) and given:
        raise InputError(
            f"{', '.join(given)}: a {type(subject).__name__.lower()} brings its own options; "
            "name the mission to change them"
        )
    if isinstance(subject, Program):
        return _of_program(subject)
    if isinstance(subject, Plan):
        return _of_plan(subject)
    mission = subject if isinstance(subject, Mission) else load(subject)
    return _stated(
        mission,
        "P1" if problem is None else problem,
        AVAILABLE if perspective is None else perspective,
        slot_s,
        "auto" if engine is None else engine,
        time_limit_s,
        graph,
    )


def _stated(
    mission: Mission,
    problem: Formulation | ProblemName,
    perspective: str,
    slot_s: float | None,
    engine: str | Engine,
    time_limit_s: float | None = None,
    graph: Graph | None = None,
) -> MissionQuestion:
    checked = checked_question(mission, problem, perspective, slot_s, engine, time_limit_s)
    return MissionQuestion(mission, replace(checked, slot_s=slot_s), graph)


def _of_program(program: Program) -> MissionQuestion:
    mission, used = program.network.mission, program.network
    computed = build_network(mission)
    same_legs = np.array_equal(computed.legs.flyable, used.legs.flyable)
    same_power = np.array_equal(computed.places.received_power_W, used.places.received_power_W)
    if same_legs and same_power and not used.legs.edited.any():
        return MissionQuestion(mission, program.question)
    from optuav.network.graph import as_graph

    return MissionQuestion(mission, program.question, as_graph(used))


def of_several_stops(plan: Plan) -> bool:
    """Whether a plan answers a question of several stops, which no single programme declares."""
    kinds = [phase.kind for phase in plan.phases]
    return plan.engine == SEARCH or kinds.count("rest") > 1 or kinds.count("hover") > 1


def _of_plan(plan: Plan) -> MissionQuestion:
    if of_several_stops(plan):
        raise InputError(f"the plan's question cannot be asked again: {STOPS}")
    if any(phase.edited for phase in plan.phases):
        raise InputError("the plan is over an edited graph: explain its mission with graph=")
    if plan.problem not in (*PROBLEMS, "P4"):
        raise InputError(
            f"the plan's problem {plan.problem} is a formulation of one's own, which its file does "
            "not hold: explain the mission with it"
        )
    problem = problem_of(
        plan.problem, trajectory=plan.trajectory, building=plan.building, order=plan.order
    )
    # Packs that take turns are simulated, by no engine that can be named.
    engine = "auto" if plan.engine in ("", SIMULATION) else plan.engine
    return _stated(plan.mission, problem, plan.perspective, plan.slot_s, engine)
