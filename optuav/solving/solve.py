"""The two public functions: `formulate` declares, `solve` declares and solves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from formulations.formulation import Formulation
from formulations.perspectives import AVAILABLE
from optuav.engines.registry import Engine
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.messages import shown
from optuav.plan import Plan
from optuav.solving.declaring import declared_program, work_out
from optuav.solving.free_hover import free_program
from optuav.solving.program import Program
from optuav.solving.question import AUTO, question
from optuav.solving.several_stops import several_stops

if TYPE_CHECKING:
    from optuav.network.graph import Graph
    from optuav.search.branch import Progress

PROMISING = ("P1", "P3", "P4")
"""Problems of which a plan tells what the paper's perspective would have promised."""


def formulate(
    mission: Mission | str | Path,
    problem: str | type[Formulation] = "P1",
    *,
    trajectory: str | None = None,
    building: str | None = None,
    order: str | None = None,
    perspective: str = AVAILABLE,
    slot_s: float | None = None,
    engine: str | Engine = "auto",
    graph: Graph | None = None,
    time_limit_s: float | None = None,
    solver: str | None = None,
    hover_point: str = "w_U",
) -> Program:
    """Declare a problem over a mission.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    problem
        ``"P1"`` (longest hover over all routes of a trajectory), ``"P2"`` (shortest flight and
        rest, as printed), ``"P2-tight"`` (with the deadline tight), ``"P3"`` (direct, no rest),
        ``"P4"`` (one rest on a building), or a subclass of
        `formulations.formulation.Formulation`: over the direct route, and over those by way of a
        building if it declares ``rest_time_s`` there.
    trajectory
        For P1 and P2: ``"optimal"`` (Algorithm 2 of the paper; the default), ``"direct"``,
        ``"traj1"`` (by way of the building nearest the device) or ``"traj2"`` (the shortest in
        time by way of one building); the latter two pass by or rest.
    building
        Name of the building to rest on; P4 needs it.
    order
        ``"rest-first"``, ``"hover-first"``, or None for the better of the two.
    perspective
        ``"available"``: the battery never runs dry nor is overcharged, and what it holds at the
        end is counted in charge; ``"battery"``, ``"energy"`` or ``"adjusted"``: the paper's, which
        look at the end alone; ``"wells"``: as ``"battery"``, but step by step through both wells.
    slot_s
        Length of the time slots [s], 0.001 to 1e7; None for continuous times.
    engine
        ``"closed-form"``, ``"cvxpy"``, ``"bracket"``, ``"casadi"``, ``"grid"`` (slots; without
        `slot_s` the mission's ``limits.slot_s``) or ``"auto"``: the grid for slots, else the first
        that takes the model; or an engine with options of its own, as ``Cvxpy(solver="clarabel")``.
    graph
        A graph from `optuav.graph` that was edited; its figures replace the computed ones.
    time_limit_s
        Longest that the engine may take [s], > 0 and at most 1e9; None for no limit.
    solver
        Solver behind the engine cvxpy, by CVXPY's name in any case; HiGHS by default.
    hover_point
        ``"w_U"``: the UAV hovers at ``route.hover_m`` of the mission, or where that is not stated
        at w_U of the paper; ``"free"``: wherever is best within reach of the device, for P1 in
        continuous times and any perspective but ``"wells"`` (engine casadi, locally optimal).

    Returns
    -------
    Program
        The declared models; without any, and with reasons, where nothing can be flown.

    Raises
    ------
    InputError
        If an option does not exist or contradicts another, the engine does not take the problem,
        or the graph is out of order.
    """
    asked_mission = mission if isinstance(mission, Mission) else load(mission)
    asked = question(
        asked_mission,
        problem,
        trajectory,
        building,
        order,
        perspective,
        slot_s,
        engine,
        time_limit_s,
        solver,
        hover_point,
    )
    if asked.hover_point == "free":
        if graph is not None:
            words = "with hover_point='free': none, its legs lead to one hover point"
            raise InputError([Fault("graph", shown(graph), words)])
        return free_program(asked, asked_mission)
    return declared_program(asked, work_out(asked_mission, graph))


def solve(
    mission: Mission | str | Path,
    problem: str | type[Formulation] = "P1",
    *,
    trajectory: str | None = None,
    building: str | None = None,
    order: str | None = None,
    perspective: str = AVAILABLE,
    slot_s: float | None = None,
    engine: str | Engine = "auto",
    graph: Graph | None = None,
    time_limit_s: float | None = None,
    solver: str | None = None,
    hover_point: str = "w_U",
    stops: int = 1,
    hovers: int = 1,
    progress: Progress | None = None,
) -> Plan:
    """Solve a problem over a mission; the other arguments are those of `formulate`.

    Parameters
    ----------
    stops, hovers
        Most rests, 0 to 10, and pieces in which the UAV may hover, 1 to 10, in any order over all
        places, for P1 with the trajectory optimal; places may be visited again. In the perspectives
        of the paper one of each is enough, under `available` it is not.
    progress
        Told how far the search over several stops is: the best hover time so far [s], and how many
        boxes of durations it has looked at and has open.

    Returns
    -------
    The best plan. Among plans with the same objective (to 1e-6 s) the one with the shortest
    mission, then the fewest stops, then the building that stands first in the mission, then resting
    first; and the smallest rest that its hover time admits. A mission that cannot be flown gets a
    plan that says why.

    Raises
    ------
    InputError
        As `formulate`.
    SolverError
        If the engine fails or does not prove its answer in time.
    """
    program = formulate(
        mission,
        problem,
        trajectory=trajectory,
        building=building,
        order=order,
        perspective=perspective,
        slot_s=slot_s,
        engine=engine,
        graph=graph,
        time_limit_s=time_limit_s,
        solver=solver,
        hover_point=hover_point,
    )
    if (stops, hovers) == (1, 1):
        plan = program.solve()
        if plan and plan.engine == "bracket" and perspective == AVAILABLE and problem in PROMISING:
            promised = replace(program.question, perspective="battery", engine=AUTO)
            return beside(plan, declared_program(promised, program.worked_out).solve())
        return plan
    return several_stops(program, stops, hovers, graph, progress)


def beside(plan: Plan, promised: Plan) -> Plan:
    """The plan with a note on what another, that looks at the end alone, promises."""
    if not promised or promised.hover_time_s <= plan.hover_time_s:
        return plan
    words = (
        f"perspective {promised.perspective}, which looks at the charge left at the end alone, "
        f"promises {promised.hover_time_s:.2f} s of hover"
    )
    if promised.runs_dry_s is not None:
        words += f"; that plan would run dry and fall at {promised.runs_dry_s:.2f} s"
    return plan.model_copy(update={"notes": (*plan.notes, words)})
