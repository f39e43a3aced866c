"""``optuav explain``: why a plan is optimal, or why there is none and what would repair that."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, cast

import typer

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
    SetOption,
    mission_of,
)
from optuav.errors import Fault, InputError
from optuav.options import Perspective

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
    stops: Annotated[int | None, STOPS] = None,
    hovers: Annotated[int | None, HOVERS] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say why a plan is the best one, or why there is none and which changes would help.

    With --stops or --hovers, search for more stops and say what they bring, for a minute unless
    --time-limit-s says otherwise. Exit code 1 if there is no feasible plan.
    """
    of_mission = {
        "problem": problem,
        "trajectory": trajectory,
        "building": building,
        "order": order,
        "hover_point": hover_point,
        "perspective": perspective,
        "slot_s": slot_s,
        "engine": engine,
        "time_limit_s": time_limit_s,
        "set": settings,
    }
    from optuav.diagnosis import explain as explain_subject

    if Path(mission).suffix == ".json":
        if faults := [
            Fault(f"--{name.replace('_', '-')}", "", "goes with a mission, not with a saved plan")
            for name, value in of_mission.items()
            if value is not None
        ]:
            raise InputError(faults)
        from optuav.plan import load_plan

        explained = explain_subject(load_plan(mission), stops=stops, hovers=hovers)
    else:
        from optuav.solving.question import problem_of

        explained = explain_subject(
            mission_of(mission, settings),
            problem_of(
                problem or "P1",
                trajectory=trajectory,
                building=building,
                order=order,
                hover_point=hover_point,
            ),
            perspective=cast(Perspective | None, perspective),
            slot_s=slot_s,
            engine=engine,
            time_limit_s=time_limit_s,
            stops=stops,
            hovers=hovers,
        )
    if as_json:
        typer.echo(json.dumps(explained.to_dict(), indent=2, ensure_ascii=False))
    else:
        typer.echo(str(explained))
    if not explained:
        raise typer.Exit(NO)
