"""``optuav solve``: the best plan for a mission."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

import optuav
from optuav.cli.options import (
    BUILDING,
    ENGINE,
    HOVER_POINT,
    HOVERS,
    ORDER,
    PERSPECTIVE,
    PROBLEM,
    SLOT,
    STOPS,
    TIME_LIMIT,
    TRAJECTORY,
    JsonOption,
    MissionArgument,
    PlotOption,
    SaveOption,
    SetOption,
    mission_of,
)
from optuav.cli.progress import progress
from optuav.errors import Fault, InputError
from optuav.options import Perspective
from optuav.plan import Plan
from optuav.status import Status

if TYPE_CHECKING:
    from optuav.engines.registry import Engine

NO, NOT_PROVED = 1, 3
OTHER = {"battery": "available", "available": "battery"}
"""What counts charge only, and what keeps the battery from running dry."""


def solve(
    mission: MissionArgument,
    problem: Annotated[str, PROBLEM] = "P1",
    trajectory: Annotated[str | None, TRAJECTORY] = None,
    building: Annotated[str | None, BUILDING] = None,
    order: Annotated[str | None, ORDER] = None,
    perspective: Annotated[str, PERSPECTIVE] = "available",
    slot_s: Annotated[float | None, SLOT] = None,
    engine: Annotated[str, ENGINE] = "auto",
    solver: Annotated[
        str | None, typer.Option(help="Solver behind cvxpy, by its name; HIGHS by default.")
    ] = None,
    time_limit_s: Annotated[float | None, TIME_LIMIT] = None,
    hover_point: Annotated[str | None, HOVER_POINT] = None,
    stops: Annotated[int | None, STOPS] = None,
    hovers: Annotated[int | None, HOVERS] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
    save: SaveOption = None,
    plot: PlotOption = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            "--animate", metavar="FILE", help="Write the mission as a .gif (needs matplotlib)."
        ),
    ] = None,
) -> None:
    """Find the longest hover for a mission, and show the plan."""
    asked = mission_of(mission, settings)
    from optuav.solving.question import problem_of

    stated = problem_of(
        problem,
        trajectory=trajectory,
        building=building,
        order=order,
        hover_point=hover_point,
        stops=stops,
        hovers=hovers,
    )
    if animate is not None:
        from optuav.plots import gif_file

        gif_file(animate)
    several = {stops, hovers} - {None, 1}
    with progress() if several else nullcontext() as tell:
        plan = optuav.solve(
            asked,
            stated,
            perspective=cast(Perspective, perspective),
            slot_s=slot_s,
            engine=_engine(engine, solver),
            time_limit_s=time_limit_s,
            progress=tell and partial(_tell_boxes, tell),
        )
    from optuav.cli.output import deliver

    alike = not several and hover_point in (None, "w_U")
    beside = list(_by_the_other_perspective(plan)) if plot and alike else []
    deliver(plan, as_json=as_json, save=save, plot=plot, beside=beside, animate=animate)
    if plan.status is Status.INFEASIBLE and alike and not as_json:
        typer.echo(f"optuav explain {shlex.quote(mission)} … tells what would repair it")
    if not plan:
        raise typer.Exit(NO)
    if plan.status is Status.FEASIBLE:
        raise typer.Exit(NOT_PROVED)


def _engine(name: str, solver: str | None) -> str | Engine:
    """The engine of a name, with the solver behind it if one is stated."""
    if solver is None:
        return name
    if name != "cvxpy":
        raise InputError([Fault("--solver", repr(solver), "goes with --engine cvxpy")])
    from optuav.engines.cvxpy_engine import Cvxpy

    return Cvxpy(solver=solver)


def _tell_boxes(
    tell: Callable[[int, int | None, str], None], best_s: float, examined: int, left: int
) -> None:
    """How far a search over several stops is."""
    tell(examined, None, f"hover {best_s:.3f} s so far, {examined} boxes looked at, {left} open")


def _by_the_other_perspective(plan: Plan) -> Iterator[Plan]:
    """What the same question gives where charge alone counts, or where the battery has to last."""
    if not plan or plan.perspective not in OTHER or plan.mission.battery.takes_turns:
        return
    from optuav.solving.question import problem_of

    problem = problem_of(
        plan.problem, trajectory=plan.trajectory, building=plan.building, order=plan.order
    )
    other = optuav.solve(
        plan.mission,
        problem,
        perspective=cast(Perspective, OTHER[plan.perspective]),
        slot_s=plan.slot_s,
    )
    if other:
        yield other
