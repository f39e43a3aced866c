"""``optuav explain``: why this is the optimum, or why there is none and what would repair that."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from optuav.cli.options import (
    BUILDING,
    ENGINE,
    HOVER_POINT,
    ORDER,
    PERSPECTIVE,
    PROBLEM,
    SLOT,
    TIME_LIMIT,
    TRAJECTORY,
    JsonOption,
    SetOption,
    mission_of,
)
from optuav.errors import Fault, InputError

NO = 1


def explain(
    mission: Annotated[
        str,
        typer.Argument(
            metavar="MISSION|PLAN",
            help="Name of a shipped mission, a mission file, or a saved plan (a .json file).",
        ),
    ],
    problem: Annotated[str | None, PROBLEM] = None,
    trajectory: Annotated[str | None, TRAJECTORY] = None,
    building: Annotated[str | None, BUILDING] = None,
    order: Annotated[str | None, ORDER] = None,
    perspective: Annotated[str | None, PERSPECTIVE] = None,
    slot_s: Annotated[float | None, SLOT] = None,
    engine: Annotated[str | None, ENGINE] = None,
    time_limit_s: Annotated[float | None, TIME_LIMIT] = None,
    hover_point: Annotated[str | None, HOVER_POINT] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say why a plan is the best one, or why there is none and which changes would help.

    Exit code 1 if there is no feasible plan.
    """
    given: dict[str, Any] = {
        "perspective": perspective,
        "slot_s": slot_s,
        "engine": engine,
        "time_limit_s": time_limit_s,
    }
    options = {name: value for name, value in given.items() if value is not None}
    of_problem: dict[str, Any] = {
        "trajectory": trajectory,
        "building": building,
        "order": order,
        "hover_point": hover_point,
    }
    fields = {name: value for name, value in of_problem.items() if value is not None}
    is_plan = Path(mission).suffix == ".json"
    stated = [*(["problem"] if problem else []), *fields, *options, *(["set"] if settings else [])]
    if is_plan and stated:
        raise InputError(
            Fault(f"--{name.replace('_', '-')}", "", "goes with a mission, not with a saved plan")
            for name in stated
        )
    if problem is not None or fields:
        from optuav.solving.question import problem_of

        options["problem"] = problem_of(problem or "P1", **fields)
    from optuav.diagnosis import explain as explain_subject
    from optuav.plan import load_plan

    if is_plan:
        explained = explain_subject(load_plan(mission))
    else:
        explained = explain_subject(mission_of(mission, settings), **options)
    if as_json:
        typer.echo(json.dumps(explained.to_dict(), indent=2, ensure_ascii=False))
    else:
        typer.echo(str(explained))
    if not explained:
        raise typer.Exit(NO)
