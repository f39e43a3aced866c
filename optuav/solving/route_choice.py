"""(P1) over all routes as one mixed-integer programme, and its LP bound.

As a convex hull (`formulations.milp`) that bound is the optimum itself. The form big-M is looser:
on the mission ``paper`` it gives 1124.2 s, the deadline less the shortest flight, where the optimum
is 719.5 s. Both have unknowns for each route. Along the edges of the graph (`formulations.edges`)
there are as many as devices times roofs, and the bound is slightly above the optimum.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from formulations.edges import edge_choice
from formulations.milp import FORMS, Form, Route
from formulations.milp import route_choice as joined
from formulations.p1 import P1
from formulations.soc import PAPER
from optuav.engines.linear_form import last_slot, own_bounds
from optuav.engines.registry import AUTO
from optuav.errors import Fault, InputError, NoPlanError, SolverError, printable, refuse
from optuav.mission import Mission, load
from optuav.mission.messages import shown, unlisted
from optuav.modelling import Model
from optuav.modelling.expression import PartedLabel
from optuav.network.graph import Graph, network_of
from optuav.network.network import Network
from optuav.network.one_stop import one_stop_words
from optuav.options import Order, Perspective, Trajectory
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts
from optuav.presentation.numbers import figure, seconds
from optuav.presentation.presented import Presented
from optuav.solving.assemble import quantities
from optuav.solving.edge_choice import agree, best_along_edges
from optuav.solving.files import writer
from optuav.solving.no_plan import plan_without, shortfalls
from optuav.solving.program import Program
from optuav.solving.question import (
    MOST_FREE,
    Question,
    along_edges,
    checked_question,
    solve_model,
)
from optuav.solving.route_models import RouteModel
from optuav.solving.route_plan import plan_of
from optuav.solving.solve import formulate
from optuav.status import Status

ChoiceForm: TypeAlias = Form | Literal["edges"]
CHOICE_FORMS: tuple[ChoiceForm, ...] = (*FORMS, "edges")
MOST_BY_ROUTES = 3  # Devices up to which the choice is stated by routes unless a form is named


@dataclass(frozen=True)
class RouteChoice(Presented):
    """The answer of `route_choice`.

    Parameters
    ----------
    plan, form, notes
        The best plan, like one of `optuav.solve`; ``"hull"`` or ``"big-M"``; how tight that form
        is, and whether one stop is enough.
    model
        The programme; None where nothing can be flown.
    relaxation_s, gap_s
        Bound on the hover time by the LP relaxation, slots and choice relaxed, and by how much it
        exceeds the plan's hover time [s]; None without a plan.
    shares
        λ of every route in the relaxation, by its name, 0 to 1; in the form ``"edges"`` x of every
        leg, such as ``"origin → b1"``, in the order of the programme. Empty without a plan.

    Examples
    --------
    >>> import optuav
    >>> choice = optuav.route_choice("paper", perspective="battery")
    >>> round(choice.relaxation_s, 2), round(choice.shares["b1 rest-first"], 2)
    (719.54, 1.0)
    """

    plan: Plan
    form: ChoiceForm
    notes: tuple[str, ...]
    model: Model | None = None
    relaxation_s: float | None = None
    gap_s: float | None = None
    shares: Mapping[str, float] = field(default_factory=dict)

    def to_file(self, form: str | Path) -> str:
        """Return the text of the programme for other solvers; given a path, write it there too.

        Forms and errors as in `Program.to_file`.
        """
        write = writer(form)
        if self.model is None:
            raise NoPlanError(self.plan.summary())
        remarks = [printable(f"mission {self.plan.mission.name}, form {self.form}")]
        if self.form == "edges":
            remarks += (f"edge[{k}] is {name}" for k, name in enumerate(self.shares, start=1))
        return write(self.model, self.model.row(0), remarks)

    def blocks(self) -> Iterator[Block]:
        """Yield route, hover, relaxation and proof."""
        if not self.plan:
            yield from self.plan.blocks()
            return
        assert self.relaxation_s is not None
        assert self.gap_s is not None
        relaxed = f"{seconds(self.relaxation_s, 3)} ({self.form}), gap {seconds(self.gap_s, 3)}"
        facts = [
            ("Route", " → ".join(self.plan.route)),
            ("Hover", seconds(self.plan.hover_time_s, 3)),
            ("Relaxed", relaxed),
            ("Proof", self.plan.proof),
        ]
        yield Facts([*facts, *(("Note", note) for note in self.notes)])


def route_choice(
    mission: Mission | str | Path,
    *,
    perspective: Perspective,
    form: ChoiceForm | None = None,
    trajectory: Trajectory = "optimal",
    order: Order | None = None,
    device_order: Sequence[str] | None = None,
    slot_s: float | None = None,
    graph: Graph | None = None,
    time_limit_s: float | None = None,
    solver: str | None = None,
) -> RouteChoice:
    """Solve (P1) over all its routes as one MILP, and bound it by its LP relaxation.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    perspective
        How to count charge, as for `optuav.solve`: ``"battery"``, ``"energy"`` or ``"adjusted"``,
        which are linear in the times.
    form
        Formulation of the choice. ``"hull"``: unknowns and homogenised rows for each route, the
        tightest form; ``"big-M"``: shared unknowns, and rows that the deadline's slack switches
        off; fewer unknowns, a looser relaxation. See `formulations.milp`. ``"edges"``: a choice for
        each leg instead of each route, for up to 12 devices in any order, in continuous times; see
        `formulations.edges`. By default ``"hull"`` for at most 3 devices or in slots, else
        ``"edges"``.
    trajectory, order
        Routes to choose from: ``"optimal"`` (all), ``"direct"``, ``"traj1"`` or ``"traj2"``; and
        ``"rest-first"``, ``"hover-first"``, or None for both. `P1` explains them.
    device_order
        Names of several devices in the order of the hovers, or None for the best one.
    slot_s, time_limit_s
        Length of the time slots [s], 0.001 to 1e7, and time limit of the solver [s], > 0
        and at most 1e9; None for continuous times and for no limit.
    graph
        A graph from `optuav.graph` that was edited; its figures replace the computed ones.
    solver
        Name of a solver that CVXPY finds installed; None for HiGHS.

    Returns
    -------
    RouteChoice
        The plan that Algorithm 2 of the paper finds, also in ties, with the bound.

    Raises
    ------
    InputError
        If an option does not exist or contradicts another.
    SolverError
        If the solver fails or the time limit passes.

    Examples
    --------
    >>> import optuav
    >>> choice = optuav.route_choice("paper", perspective="battery", trajectory="direct")
    >>> print(f"{choice.plan.hover_time_s:.2f} s, relaxed {choice.relaxation_s:.2f} s")
    688.85 s, relaxed 688.85 s
    """
    chosen_form = (("form", form, CHOICE_FORMS),) if form is not None else ()
    refuse(unlisted(*chosen_form, ("perspective", perspective, PAPER)))
    from optuav.engines.cvxpy_engine import Cvxpy

    known = load(mission)
    few = len(known.served) <= MOST_BY_ROUTES or slot_s is not None
    form = form or ("hull" if few else "edges")
    devices = None if device_order is None else tuple(device_order)
    problem = P1(trajectory=trajectory, order=order, device_order=devices)
    engine = Cvxpy(solver=solver)
    # Along edges every order may be chosen: no engine on routes is asked.
    question = checked_question(known, problem, perspective, slot_s, AUTO, time_limit_s)
    if form == "edges":
        question = replace(question, engine=engine)
        return _along_edges(question, network_of(known, graph), graph)
    if along_edges(known, question):
        words = f"must be 'edges' over more than {MOST_FREE} devices in any order"
        raise InputError([Fault("form", shown(form), words)])
    program = formulate(
        known,
        problem,
        perspective=perspective,
        slot_s=slot_s,
        engine=engine,
        graph=graph,
        time_limit_s=time_limit_s,
    )
    question, network = program.question, program.network
    enough = _one_stop_words(network, graph)
    if not program.parts:
        return RouteChoice(program.solve(), form, enough)
    routes, parts = _routes(program)
    model = joined(routes, perspective, form)
    if question.slot_s is not None:
        # No time is longer than the deadline: up to it whole slots are counted.
        most = last_slot(network.mission.limits.deadline_s, question.slot_s, begun=True) + 1
        for variable in model.variables:
            variable.upper = 1.0 if variable.binary else question.slot_s * most
    solution = solve_model(model, 1, question)
    if solution.status is Status.INFEASIBLE:
        why = shortfalls(question, network, program.parts)
        plan = plan_without(question, network, solution.status, solution.proof, why)
        return RouteChoice(plan, form, enough, model)
    if not solution.status.has_answer:
        raise SolverError(f"{solution.engine} did not solve the choice: {solution.words[0]}")
    chosen = solution.point(0)
    part = parts[int(np.argmax([chosen[f"choice[{k}]"] for k in range(1, len(parts) + 1)]))]
    times = solve_model(part.model, 1, question)
    hover_s, among_all_s = float(times.objective[0]), float(solution.objective[0])
    if not agree(hover_s, among_all_s):
        raise SolverError(
            f"{solution.engine} returned {figure(among_all_s, 9)} s for all routes together, "
            f"but {figure(hover_s, 9)} s for the one that it chose"
        )
    relaxed = joined(routes, perspective, form, relaxed=True)
    relaxation = solve_model(relaxed, 1, replace(question, slot_s=None))
    relaxation_s = float(relaxation.objective[0])
    proof = f"{solution.proof}; {_left_words(relaxation_s - hover_s)}"
    plan = plan_of(question, network, part, times, 0).model_copy(update={"proof": proof})
    point, gap_s = relaxation.point(0), relaxation_s - hover_s
    shares = {variable.name: point[f"choice[{k}]"] for k, variable in enumerate(routes, start=1)}
    return RouteChoice(plan, form, enough, model, relaxation_s, gap_s, shares)


def _along_edges(question: Question, network: Network, graph: Graph | None) -> RouteChoice:
    """The answer of the programme along edges, with the bound of its relaxation."""
    answer, enough = best_along_edges(question, network), _one_stop_words(network, graph)
    if not (answer.plan and answer.edges):
        return RouteChoice(answer.plan, "edges", enough, answer.model)
    relaxed = edge_choice(answer.edges, question.perspective, answer.subtours, relaxed=True)
    relaxation = solve_model(relaxed, 1, question)
    relaxation_s, point = float(relaxation.objective[0]), relaxation.point(0)
    gap_s = relaxation_s - answer.plan.hover_time_s
    shares = {edge.name: point[f"edge[{k}]"] for k, edge in enumerate(answer.edges.edges, start=1)}
    proof = f"{answer.plan.proof}; {_left_words(gap_s)}"
    plan = answer.plan.model_copy(update={"proof": proof})
    return RouteChoice(plan, "edges", enough, answer.model, relaxation_s, gap_s, shares)


def _one_stop_words(network: Network, graph: Graph | None) -> tuple[str, ...]:
    """Say whether one stop is enough, of a single device."""
    return () if len(network.mission.served) > 1 else (one_stop_words(network, graph),)


def _left_words(gap_s: float) -> str:
    return f"the LP relaxation leaves {figure(max(gap_s, 0.0), 3)} s"


def _routes(program: Program) -> tuple[list[Route], list[RouteModel]]:
    """The routes that may be chosen, in tie-breaking order, each with its part."""
    network, question = program.network, program.question
    routes, parts = list[Route](), list[RouteModel]()
    for number, rests in sorted(
        (int(route), part.rests) for part in program.parts for route in part.routes
    ):
        which = np.array([number])
        values = quantities(network, which, rests=rests)
        model = question.problem.model(values, question.perspective)
        building, name = int(network.routes.building[number]), PartedLabel("direct")
        passing = "" if rests or building < 0 else ", passing by"
        if len(network.mission.served) > 1:
            name = PartedLabel(" → ".join(network.route_names(number)[1:-1]) + passing)
        elif building >= 0:
            order = f"{network.routes.order(number)}{passing}"
            name = PartedLabel(network.mission.buildings.names[building], order)
        if network.mission.devices:
            name = PartedLabel(" ".join(network.route_names(number)[1:-1]))
        whole = Route(name, values)
        slots = [whole] if question.slot_s is None else [*_in_slots(whole, model, question.slot_s)]
        routes += slots
        parts += [RouteModel(model, which)] * len(slots)
    return routes, parts


def _in_slots(route: Route, model: Model, slot_s: float) -> Iterator[Route]:
    """A route for times in whole slots, and one more whose last slot is cut short."""
    # Where the deadline is Δ's own bound, it may cut the last slot short, which whole slots cannot
    # express: Δ is then at the end of that slot, and the cut off the objective.
    bounds = own_bounds(model, model.row(0))
    first = {v.name: max(bounds[v.name][0], v.first_slot * slot_s) for v in model.variables}
    least_s, bound_s = first["hover_time_s"], bounds["hover_time_s"][1]
    route = replace(route, least_rest_s=first.get("rest_time_s", 0.0))
    if not math.isfinite(bound_s):
        yield replace(route, hover_s=(least_s, math.inf))
        return
    most_s = slot_s * last_slot(bound_s, slot_s, begun=False)
    yield replace(route, hover_s=(least_s, most_s))
    if bounds["hover_time_s"][0] <= bound_s and bound_s > most_s:
        end_s = slot_s * last_slot(bound_s, slot_s, begun=True)
        *begin, end = PartedLabel(route.name).parts
        name = PartedLabel(*begin, f"{end}, last slot cut short")
        yield replace(route, name=name, hover_s=(end_s, end_s), cut_s=end_s - bound_s)
