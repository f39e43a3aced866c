"""``optuav sensitivity``: which numbers of a mission matter most."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from optuav.cli.compare import make_ready
from optuav.cli.options import (
    JsonOption,
    MissionArgument,
    PlotOption,
    SaveTableOption,
    SetOption,
    mission_of,
)
from optuav.mission.files import write_text

NO = 1


def sensitivity(
    mission: MissionArgument,
    uncertainty: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="How keys are spread, as TOML; else what is measured is within 10 %.",
        ),
    ] = None,
    perspective: Annotated[
        str, typer.Option(help="available, battery, energy or adjusted: how charge counts.")
    ] = "available",
    plan: Annotated[
        Path | None,
        typer.Option(metavar="PLAN", help="A saved plan to hold fixed; else the mission's best."),
    ] = None,
    samples: Annotated[int, typer.Option(help="How many samples to draw.")] = 10_000,
    seed: Annotated[int, typer.Option(help="What they are drawn from.")] = 0,
    settings: SetOption = None,
    as_json: JsonOption = False,
    save: SaveTableOption = None,
    plot: PlotOption = None,
) -> None:
    """Tell which numbers matter most, and what their uncertainty means for the hover time.

    Exit code 1 if the mission has no plan as it stands.
    """
    make_ready(save, plot)
    asked = mission_of(mission, settings)
    from optuav import studies
    from optuav.plan import load_plan

    found = studies.sensitivity(
        asked,
        uncertainty,
        perspective=perspective,
        plan=None if plan is None else load_plan(plan),
        samples=samples,
        seed=seed,
    )
    pictures = found.save_pictures(plot) if plot is not None else []
    text = json.dumps(found.to_dict(), indent=2, ensure_ascii=False)
    if save is not None:
        write_text(save, found.to_csv() if save.suffix == ".csv" else f"{text}\n")
    typer.echo(text if as_json else str(found))
    if not as_json:
        screen = Console(highlight=False)
        for path in ([save] if save else []) + pictures:
            screen.print(f"wrote {path}", style="dim", markup=False, soft_wrap=True)
    if not found.hover_time_s:
        raise typer.Exit(NO)
