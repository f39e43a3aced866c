"""The two public functions: `formulate` declares, `solve` declares and solves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from formulations.formulation import Formulation
from optuav.engines.registry import Engine
from optuav.errors import Fault, InputError, SolverError
from optuav.flight.model import BENT
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.network import vehicle
from optuav.network.feasibility import impossibilities
from optuav.network.graph import Graph, network_of
from optuav.network.network import Network
from optuav.network.variants import as_variants
from optuav.options import Perspective, ProblemName
from optuav.plan import Plan
from optuav.presentation.numbers import seconds
from optuav.solving.device_routes import network_for
from optuav.solving.more_stops import more_stops_may_help, not_excluded
from optuav.solving.program import Program, best_plan, declared_program
from optuav.solving.question import Question, along_edges, mission_and_question
from optuav.solving.route_models import permitted_routes

MANY, MANY_BENT = 2_000, 61
"""Buildings of a mission whose routes are compared by bounds first; where legs are bent."""

if TYPE_CHECKING:
    from optuav.search.branch import Progress


def formulate(
    mission: Mission | str | Path,
    problem: Formulation | ProblemName = "P1",
    *,
    perspective: Perspective = "available",
    slot_s: float | None = None,
    engine: str | Engine = "auto",
    graph: Graph | None = None,
    time_limit_s: float | None = None,
) -> Program:
    """Declare a problem over a mission, without solving it.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    problem
        ``"P1"``, ``"P2"``, ``"P3"``, or an instance such as `P4`, with one rest and one hover at
        most.
    perspective, slot_s, engine, graph, time_limit_s
        How to count charge, length of slots [s] (None for continuous times), engine that will solve
        the program, edited graph, and time limit of the engine [s]; `optuav.solve` explains them.

    Returns
    -------
    Program
        The declared models; none, and the reasons, if nothing can be flown.

    Raises
    ------
    InputError
        If an option does not exist or contradicts another, the problem has several stops, the
        engine does not take it, or the graph is invalid.

    Examples
    --------
    >>> import optuav
    >>> optuav.formulate("paper", optuav.P4("b1"), perspective="battery")
    <Program for 'paper': P4, perspective battery, 1 model>
    """
    options = problem, perspective, slot_s, engine, time_limit_s
    program = _program(*mission_and_question(mission, *options), graph)
    if program.question.several:
        raise InputError(
            "several stops have no single programme, they are searched for: "
            "formulate one rest and one hover, or use solve"
        )
    return program


def solve(
    mission: Mission | str | Path,
    problem: Formulation | ProblemName = "P1",
    *,
    perspective: Perspective = "available",
    slot_s: float | None = None,
    engine: str | Engine = "auto",
    graph: Graph | None = None,
    time_limit_s: float | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Solve a problem over a mission.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    problem
        `P1` (longest hover over all routes of a trajectory), `P2` (shortest flight and rest), `P3`
        (direct, no rest), `P4` (one rest on a building) or an instance of your own `Formulation`.
        ``"P1"``, ``"P2"``, ``"P2-tight"`` and ``"P3"`` stand for these with their defaults.
    perspective
        ``"available"``: the available well never runs dry nor past full, and charge counts the
        content of both wells at the end; ``"battery"``, ``"energy"`` or ``"adjusted"``: the
        paper's, which check only the end; ``"wells"``: as ``"battery"``, but step by step through
        both wells.
    slot_s
        Length of the time slots [s], 0.001 to 1e7; None for continuous times.
    engine
        ``"closed-form"``, ``"cvxpy"``, ``"bracket"``, ``"casadi"``, ``"grid"`` (slots; without
        `slot_s` the mission's ``limits.slot_s``) or ``"auto"``: the grid for slots, otherwise the
        first engine that accepts the model; or an engine with options, such as
        ``Cvxpy(solver="clarabel")``.
    graph
        A graph from `optuav.graph` that was edited; its figures replace the computed ones.
    time_limit_s
        Time limit of the engine [s], > 0 and at most 1e9; None for no limit.
    progress
        Callback for progress in the search for several stops: receives the best hover time so far
        [s] and the numbers of boxes of durations examined and open.

    Returns
    -------
    Plan
        The best plan. Among plans with the same objective (to what 1e-6 s are worth), it has the
        shortest mission, then the fewest stops, then the building that comes first in the mission,
        then the rest first; and it has the shortest rest that its hover time allows. If no plan is
        feasible, the result says why.

    Raises
    ------
    InputError
        If an option does not exist or contradicts another, the engine does not take the problem,
        or the graph is invalid.
    SolverError
        If the engine fails or does not prove its answer in time.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", optuav.P4("b9", order="hover-first"))
    >>> print(f"{plan.hover_time_s:.2f} s, flyable: {plan.flyable}")
    597.27 s, flyable: True
    """
    options = problem, perspective, slot_s, engine, time_limit_s
    known, question = mission_and_question(mission, *options)
    plan = _plan(known, question, graph, progress)
    calm = calm_notes(known, question, graph) if plan else ()
    return plan.model_copy(update={"notes": (*plan.notes, *calm)}) if calm else plan


def calm_notes(known: Mission, question: Question, graph: Graph | None) -> tuple[str, ...]:
    """Say what the best plan in calm air is, if hovering counts on the wind; else nothing."""
    calm = vehicle.in_calm_air(known)
    if calm is None:
        return ()
    note = "this holds while the wind blows"
    return (note if graph is not None else f"{note}; {_calm_words(calm, question)}",)


def _calm_words(calm: Mission, question: Question) -> str:
    """The best plan in calm air in words."""
    try:
        plan = _plan(calm, question, None, None)
    except SolverError as error:
        return f"the plan in calm air is not known: {error}"
    return (
        f"the plan in calm air hovers {seconds(plan.hover_time_s)}"
        if plan
        else "calm air allows none"
    )


def _plan(
    known: Mission, question: Question, graph: Graph | None, progress: Progress | None
) -> Plan:
    """The best plan of a mission, with a note if more stops may help."""
    if question.p1.hover_point == "free":
        from optuav.solving.free_hover import longest_anywhere

        _refuse_graph(question, graph)
        return longest_anywhere(question, known)
    if question.speed_free:
        return _program(known, question, graph).solve()
    if along_edges(known, question):
        from optuav.solving.edge_choice import best_along_edges

        return best_along_edges(question, network_of(known, graph)).plan
    network = _routes_in_question(known, question, graph)
    if question.several:
        from optuav.solving.several_stops import several_stops

        return several_stops(declared_program(question, network), graph, progress)
    plan = best_plan(question, network)
    if more_stops_may_help(question, network, plan, graph):
        note = not_excluded(question, network.mission)
        return plan.model_copy(update={"notes": (*plan.notes, note)})
    return plan


def _routes_in_question(known: Mission, question: Question, graph: Graph | None) -> Network:
    """The network of a mission; of a large town only the routes that decide, if they do."""
    many = MANY_BENT if known.flight.obstacle_rule in BENT else MANY
    if not known.devices and graph is None and len(known.buildings) >= many:
        from optuav.solving.promising_buildings import promising_network

        few = promising_network(known, question)
        able = few is not None and permitted_routes(as_variants(few), question.problem).any()
        if few and (able or impossibilities(few, one_stop=False)):
            return few
    return network_for(known, graph, question)


def _program(known: Mission, question: Question, graph: Graph | None) -> Program:
    """Declare the problem, with one rest and one hover if it allows several."""
    if not question.searched:
        return declared_program(question, network_for(known, graph, question))
    from optuav.solving import free_hover, free_speed

    _refuse_graph(question, graph)
    if question.speed_free:
        return free_speed.free_program(question, known)
    return free_hover.free_program(question, known)


def _refuse_graph(question: Question, graph: Graph | None) -> None:
    """A free hover point or free speeds have no graph's figures."""
    if graph is None:
        return
    why = "hover_point = 'free', as its legs lead to one hover point"
    if question.speed_free:
        why = "speed = 'free', as its legs have figures of one speed"
    raise InputError([Fault("graph", shown(graph), f"no graph goes with {why}")])
