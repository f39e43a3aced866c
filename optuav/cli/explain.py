"""``optuav explain``: why a plan is optimal, or why there is none and what would repair that."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optuav.cli import options
from optuav.cli.output import NO, deliver
from optuav.errors import Fault, InputError
from optuav.options import Perspective


def explain(
    mission: Annotated[
        str,
        typer.Argument(
            metavar="MISSION|PLAN",
            help="Name of a shipped mission, a mission file, or a saved plan (a .json file).",
        ),
    ],
    problem: Annotated[str | None, options.PROBLEM] = None,
    trajectory: Annotated[str | None, options.TRAJECTORY] = None,
    building: Annotated[str | None, options.BUILDING] = None,
    order: Annotated[str | None, options.ORDER] = None,
    perspective: Annotated[Perspective | None, options.PERSPECTIVE] = None,
    slot_s: Annotated[float | None, options.SLOT] = None,
    engine: Annotated[str | None, options.ENGINE] = None,
    time_limit_s: Annotated[float | None, options.TIME_LIMIT] = None,
    hover_point: Annotated[str | None, options.HOVER_POINT] = None,
    stops: Annotated[int | None, options.STOPS] = None,
    hovers: Annotated[int | None, options.HOVERS] = None,
    settings: options.SetOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Say why a plan is the best one, or why there is none and which changes would help.

    With --stops or --hovers, search for more stops and say what they bring, for a minute unless
    --time-limit-s says otherwise. Exit code 1 if there is no feasible plan.
    """
    fields = {"trajectory": trajectory, "building": building, "order": order}
    fields |= {"hover_point": hover_point}
    of_mission: dict[str, object] = {
        "problem": problem,
        **fields,
        "perspective": perspective,
        "slot_s": slot_s,
    }
    of_mission |= {"engine": engine, "time_limit_s": time_limit_s, "set": settings}
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
        stated = options.mission_of(mission, settings)
        asked = options.problem_of(
            stated,
            problem or "P1",
            fields,
            perspective=perspective or "available",
            slot_s=slot_s,
            engine=engine or "auto",
            time_limit_s=time_limit_s,
        )
        explained = explain_subject(
            stated,
            asked,
            perspective=perspective,
            slot_s=slot_s,
            engine=engine,
            time_limit_s=time_limit_s,
            stops=stops,
            hovers=hovers,
        )
    deliver(explained.to_dict, str(explained), as_json=as_json)
    if not explained:
        raise typer.Exit(NO)
