"""What is to be explained: a mission and the options of `optuav.solve`, however they are given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.soc import AVAILABLE
from optuav.diagnosis.stacked import Case
from optuav.errors import InputError
from optuav.mission import Mission, load
from optuav.network.network import build_network
from optuav.options import HoverPoint, ProblemName
from optuav.plan import Plan
from optuav.solving import Program, formulate
from optuav.solving.declare import work_out
from optuav.solving.packs_by_schedule import ENGINE as SIMULATION
from optuav.solving.question import PROBLEMS, checked_question, problem_of
from optuav.solving.several_stops import ENGINE as SEARCH

SIGNATURE = signature(formulate)
OPTIONS = frozenset(SIGNATURE.parameters) - {"mission"}
STOPS = (
    "several stops are searched for, and no single programme declares them: there are no "
    "constraints, prices or repairs to tell of; for one rest and one hover there are, if the "
    "mission is explained"
)


@dataclass(frozen=True)
class Asked:
    """A question that can be asked again of another mission.

    Parameters
    ----------
    mission
        The mission.
    options
        Those of `optuav.formulate`.
    """

    mission: Mission
    options: Mapping[str, Any]

    @property
    def problem(self) -> Formulation:
        """The problem, by default P1."""
        stated = self.options.get("problem", "P1")
        return PROBLEMS[stated] if isinstance(stated, str) else stated

    @property
    def hover_point(self) -> HoverPoint:
        """Whether the hover point is the mission's own or free."""
        return self.problem.hover_point if isinstance(self.problem, P1) else "w_U"

    def program(self, mission: Mission | None = None) -> Program:
        """The question declared, of this mission or of another."""
        return formulate(self.mission if mission is None else mission, **self.options)

    def case(self, mission: Mission | None = None) -> Case:
        """The question and the mission worked out, without declarations."""
        stated = SIGNATURE.bind(mission or self.mission, **self.options)
        stated.apply_defaults()
        graph = stated.arguments.pop("graph")
        network = work_out(stated.arguments["mission"], graph)
        return Case(checked_question(**stated.arguments), network)

    @property
    def takes_turns(self) -> bool:
        """Whether packs take turns in it, of which a declaration knows nothing."""
        available = self.options.get("perspective", AVAILABLE) == AVAILABLE
        return available and self.mission.battery.takes_turns


def asked(subject: Program | Plan | Mission | str | Path, options: Mapping[str, Any]) -> Asked:
    """The question behind a program, a plan or a mission.

    Parameters
    ----------
    subject
        What `optuav.formulate` or `optuav.solve` returned, or a mission as they take it.
    options
        Those of `optuav.formulate`, for a mission only.

    Raises
    ------
    InputError
        If options are given for anything but a mission, or a plan does not tell its question, or
        has several stops.
    """
    if isinstance(subject, Program | Plan) and options:
        raise InputError(
            f"{', '.join(options)}: a {type(subject).__name__.lower()} brings its own options; "
            "name the mission to change them"
        )
    if isinstance(subject, Program):
        return _of_program(subject)
    if isinstance(subject, Plan):
        return _of_plan(subject)
    return Asked(subject if isinstance(subject, Mission) else load(subject), options)


def with_problem(
    problem: Formulation | ProblemName | None, options: Mapping[str, Any]
) -> dict[str, Any]:
    """The options, with the problem among them if one is stated."""
    return {**options} if problem is None else {"problem": problem, **options}


def _of_program(program: Program) -> Asked:
    stated = {each.name: getattr(program.question, each.name) for each in fields(program.question)}
    options = {name: stated[name] for name in OPTIONS & stated.keys() if stated[name] is not None}
    mission = program.network.mission
    computed, used = build_network(mission), program.network
    same_legs = np.array_equal(computed.legs.flyable, used.legs.flyable)
    same_power = np.array_equal(computed.places.received_power_W, used.places.received_power_W)
    if used.legs.edited.any() or not (same_legs and same_power):
        from optuav.network.graph import as_graph

        options["graph"] = as_graph(used)
    return Asked(mission, options)


def of_several_stops(plan: Plan) -> bool:
    """Whether a plan answers a question of several stops, which no single programme declares."""
    kinds = [phase.kind for phase in plan.phases]
    return plan.engine == SEARCH or kinds.count("rest") > 1 or kinds.count("hover") > 1


def _of_plan(plan: Plan) -> Asked:
    if of_several_stops(plan):
        raise InputError(f"the plan's question cannot be asked again: {STOPS}")
    if any(phase.edited for phase in plan.phases):
        raise InputError("the plan is over an edited graph: explain its mission with graph=")
    if plan.problem not in (*PROBLEMS, "P4"):
        raise InputError(
            f"the plan's problem {plan.problem} is a formulation of one's own, which its file does "
            "not hold: explain the mission with it"
        )
    recorded = {name: getattr(plan, name) for name in ("perspective", "slot_s", "engine")}
    recorded["problem"] = problem_of(
        plan.problem, trajectory=plan.trajectory, building=plan.building, order=plan.order
    )
    stated = {name: value for name, value in recorded.items() if value not in (None, "")}
    if plan.engine == SIMULATION:
        del stated["engine"]  # it answers without being named
    return Asked(plan.mission, stated)
