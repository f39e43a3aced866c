"""``optuav sensitivity``: which numbers of a mission matter most."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer

from optuav.cli.compare import deliver, make_ready
from optuav.cli.options import (
    JsonOption,
    MissionArgument,
    PlotOption,
    SaveTableOption,
    SetOption,
    mission_of,
)
from optuav.options import Perspective

NO = 1


def sensitivity(
    mission: MissionArgument,
    uncertainty: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="How keys are spread, as TOML; by default all that is measured is within 10 %.",
        ),
    ] = None,
    perspective: Annotated[
        str, typer.Option(help="available, battery, energy or adjusted: how charge counts.")
    ] = "available",
    plan: Annotated[
        Path | None,
        typer.Option(
            metavar="PLAN", help="A saved plan to hold fixed; by default the mission's best."
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="How many samples to draw.")] = 10_000,
    seed: Annotated[int, typer.Option(help="Seed of the samples.")] = 0,
    settings: SetOption = None,
    as_json: JsonOption = False,
    save: SaveTableOption = None,
    plot: PlotOption = None,
) -> None:
    """Find which numbers matter most, and what their uncertainty means for the hover time.

    Exit code 1 if the mission has no plan.
    """
    make_ready(save, plot)
    from optuav.plan import load_plan
    from optuav.studies import sensitivity as studies

    found = studies.sensitivity(
        mission_of(mission, settings),
        uncertainty,
        perspective=cast(Perspective, perspective),
        plan=None if plan is None else load_plan(plan),
        samples=samples,
        seed=seed,
    )
    deliver(found, save, plot, as_json=as_json)
    if not found.facts["hover_time_s"]:
        raise typer.Exit(NO)
