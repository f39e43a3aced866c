"""``optuav explain``: why this is the optimum, or why there is none and what would repair that."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from optuav.cli.options import JsonOption, SetOption, mission_of
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
    problem: Annotated[
        str | None, typer.Option(help="P1 (the default), P2, P2-tight, P3 or P4.")
    ] = None,
    trajectory: Annotated[
        str | None, typer.Option(help="For P1 and P2: optimal, direct, traj1 or traj2.")
    ] = None,
    building: Annotated[str | None, typer.Option(help="For P4: where to rest.")] = None,
    order: Annotated[
        str | None, typer.Option(help="rest-first or hover-first; the better by default.")
    ] = None,
    perspective: Annotated[
        str | None, typer.Option(help="How charge is counted; available by default.")
    ] = None,
    slot_s: Annotated[
        float | None,
        typer.Option("--slot-s", help="Length of time slots in seconds; continuous by default."),
    ] = None,
    engine: Annotated[str | None, typer.Option(help="Who answers; auto by default.")] = None,
    time_limit_s: Annotated[
        float | None, typer.Option("--time-limit-s", help="Longest search in seconds.")
    ] = None,
    hover_point: Annotated[
        str | None, typer.Option("--hover-point", help="w_U (the default), or free.")
    ] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say why a plan is the best one, or why there is none and which changes would help.

    Exit code 1 if there is no feasible plan.
    """
    given: dict[str, Any] = {
        "problem": problem,
        "trajectory": trajectory,
        "building": building,
        "order": order,
        "perspective": perspective,
        "slot_s": slot_s,
        "engine": engine,
        "time_limit_s": time_limit_s,
        "hover_point": hover_point,
    }
    options = {name: value for name, value in given.items() if value is not None}
    is_plan = Path(mission).suffix == ".json"
    if is_plan and (options or settings):
        stated = [*options, *(["set"] if settings else [])]
        raise InputError(
            Fault(f"--{name.replace('_', '-')}", "", "goes with a mission, not with a saved plan")
            for name in stated
        )
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
