"""``optuav sensitivity``: which numbers of a mission matter most."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optuav.cli import options
from optuav.cli.output import NO, check_places, deliver_results
from optuav.options import Perspective


def sensitivity(
    mission: options.MissionArgument,
    uncertainty: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="How keys are spread, as TOML; by default all that is measured is within 10 %.",
        ),
    ] = None,
    perspective: Annotated[
        Perspective,
        typer.Option(
            parser=str,
            metavar="<str>",
            help="available, battery, energy or adjusted: how charge counts.",
        ),
    ] = "available",
    plan: Annotated[
        Path | None,
        typer.Option(
            metavar="PLAN", help="A saved plan to hold fixed; by default the mission's best."
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="How many samples to draw.")] = 10_000,
    seed: Annotated[int, typer.Option(help="Seed of the samples.")] = 0,
    settings: options.SetOption = None,
    as_json: options.JsonOption = False,
    save: options.SaveTableOption = None,
    plot: options.PlotOption = None,
) -> None:
    """Find which numbers matter most, and what their uncertainty means for the hover time.

    Exit code 1 if the mission has no plan.
    """
    check_places(save, plot, ".csv", ".json")
    from optuav.plan import load_plan
    from optuav.studies import sensitivity as studies

    found = studies.sensitivity(
        options.mission_of(mission, settings),
        uncertainty,
        perspective=perspective,
        plan=None if plan is None else load_plan(plan),
        samples=samples,
        seed=seed,
    )
    deliver_results(found, save, plot, as_json=as_json)
    if not found.facts["hover_time_s"]:
        raise typer.Exit(NO)
