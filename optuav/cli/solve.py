"""``optuav solve``: the best plan for a mission."""

from __future__ import annotations

import shlex
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

import optuav
from optuav.cli import options
from optuav.cli.output import FAILED, NO, Progress, check_places, deliver, progress
from optuav.errors import Fault, InputError
from optuav.options import Perspective
from optuav.status import Status

if TYPE_CHECKING:
    from formulations.formulation import Formulation
    from optuav.engines.registry import Engine
    from optuav.plan import Plan

COMPARED: dict[str, Perspective] = {"battery": "available", "available": "battery"}
"""The perspective whose plan pictures show beside: one counts charge only, one both wells."""


def solve(
    mission: options.MissionArgument,
    problem: Annotated[str, options.PROBLEM] = "P1",
    trajectory: Annotated[str | None, options.TRAJECTORY] = None,
    building: Annotated[str | None, options.BUILDING] = None,
    order: Annotated[str | None, options.ORDER] = None,
    perspective: Annotated[Perspective, options.PERSPECTIVE] = "available",
    slot_s: Annotated[float | None, options.SLOT] = None,
    engine: Annotated[str, options.ENGINE] = "auto",
    solver: Annotated[
        str | None, typer.Option(help="Solver behind cvxpy, by its name; HIGHS by default.")
    ] = None,
    time_limit_s: Annotated[float | None, options.TIME_LIMIT] = None,
    hover_point: Annotated[str | None, options.HOVER_POINT] = None,
    stops: Annotated[int | None, options.STOPS] = None,
    hovers: Annotated[int | None, options.HOVERS] = None,
    settings: options.SetOption = None,
    as_json: options.JsonOption = False,
    save: options.SaveOption = None,
    plot: options.PlotOption = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            "--animate", metavar="FILE", help="Write the mission as a .gif (needs matplotlib)."
        ),
    ] = None,
) -> None:
    """Find the longest hover for a mission, and show the plan."""
    stated = options.mission_of(mission, settings)
    fields: dict[str, str | int | None] = {"trajectory": trajectory, "building": building}
    fields |= {"order": order, "hover_point": hover_point, "stops": stops, "hovers": hovers}
    asked = options.problem_of(
        stated,
        problem,
        fields,
        perspective=perspective,
        slot_s=slot_s,
        engine=engine,
        time_limit_s=time_limit_s,
    )
    check_places(save, plot)
    if animate is not None:
        from optuav.plots import gif_file

        gif_file(animate)
    one_stop = not {stops, hovers} - {None, 1}
    with nullcontext() if one_stop else progress() as bar:
        plan = optuav.solve(
            stated,
            asked,
            perspective=perspective,
            slot_s=slot_s,
            engine=_engine(engine, solver),
            time_limit_s=time_limit_s,
            progress=None if bar is None else partial(_show_search, bar),
        )
    written = []
    if save is not None:
        plan.save(save)
        written.append(save)
    explained = one_stop and hover_point in (None, "w_U")
    if plot is not None:
        from optuav.plots import save_pictures

        written += save_pictures(plan, plot, _beside(plan, asked) if explained else ())
    if animate is not None and plan:
        from optuav.judge import replay
        from optuav.plots import save_animation

        written.append(save_animation(replay(plan), animate))
    elif animate is not None:
        typer.echo(f"{animate} is not written: there is no plan to show", err=True)
    notes = []
    if plan.status is Status.INFEASIBLE and explained:
        notes.append(
            Text(f"optuav explain {shlex.quote(mission)} … shows what would make it feasible")
        )
    deliver(plan.to_dict, plan.summary(), as_json=as_json, notes=notes, written=written)
    if not plan:
        raise typer.Exit(NO)
    if plan.status is Status.FEASIBLE:
        raise typer.Exit(FAILED)


def _engine(name: str, solver: str | None) -> str | Engine:
    """The engine of a name, with the solver behind it if one is stated."""
    if solver is None:
        return name
    if name != "cvxpy":
        raise InputError([Fault("--solver", repr(solver), "goes with --engine cvxpy")])
    from optuav.engines.cvxpy_engine import Cvxpy

    return Cvxpy(solver=solver)


def _show_search(bar: Progress, best_s: float, examined: int, left: int) -> None:
    """Show how far a search over several stops is."""
    bar(examined, None, f"hover {best_s:.3f} s so far, {examined} boxes examined, {left} open")


def _beside(plan: Plan, problem: Formulation) -> list[Plan]:
    """The plan of the same problem in the perspective that pictures compare with; or none."""
    if not plan or plan.perspective not in COMPARED or plan.mission.battery.takes_turns:
        return []
    perspective = COMPARED[plan.perspective]
    other = optuav.solve(plan.mission, problem, perspective=perspective, slot_s=plan.slot_s)
    return [other] if other else []
