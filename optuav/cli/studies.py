"""``optuav compare`` and ``optuav sensitivity``: tables of many solves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optuav.cli.options import (
    JsonOption,
    MissionArgument,
    PlotOption,
    SaveTableOption,
    SetOption,
    mission_of,
    perspectives,
)
from optuav.cli.output import FAILED, NO, check_places, deliver_results, progress
from optuav.errors import Fault, InputError
from optuav.options import Perspective


def compare(
    mission: MissionArgument,
    slots: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="Lengths of time slots, 0.5,1,5,10,60 by default; with --by one length, "
            "continuous times by default.",
        ),
    ] = None,
    perspective: Annotated[
        Perspective | None,
        perspectives(
            "How charge is counted: battery (the default), energy or adjusted; with --by also "
            "available (the default there)."
        ),
    ] = None,
    engines: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES", help="Some of closed-form,cvxpy,bracket,casadi,grid; all by default."
        ),
    ] = None,
    time_limit_s: Annotated[
        float | None,
        typer.Option(help="Longest search for one programme in seconds."),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Compare plans, not methods: by perspective,trajectory, by one of the two, "
            "or by schedule of the packs.",
        ),
    ] = None,
    times: Annotated[
        bool, typer.Option("--times", help="Show the times taken, which differ from run to run.")
    ] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
    save: SaveTableOption = None,
    plot: PlotOption = None,
) -> None:
    """Compare answers in slots and in continuous times, by all engines, or plans.

    Exit code 1 if answers disagree or there is no feasible plan, 3 if an engine failed.
    """
    check_places(save, plot, ".csv", ".json")
    from optuav.studies import compare as studies

    with progress() as bar:
        found = studies.compare(
            mission_of(mission, settings),
            by=_names(by) or "method",
            perspective=perspective,
            slots_s=_lengths(slots),
            engines=_names(engines),
            time_limit_s=time_limit_s,
            times=times,
            progress=bar,
        )
    deliver_results(found, save, plot, as_json=as_json)
    if found.facts.get("failures"):
        raise typer.Exit(FAILED)
    has_plan = any(row["hover_time_s"] is not None for row in found.rows)
    if not has_plan or found.facts.get("disagreements"):
        raise typer.Exit(NO)


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
        Perspective, perspectives("available, battery, energy or adjusted: how charge counts.")
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
    check_places(save, plot, ".csv", ".json")
    from optuav.plan import load_plan
    from optuav.studies import sensitivity as studies

    found = studies.sensitivity(
        mission_of(mission, settings),
        uncertainty,
        perspective=perspective,
        plan=None if plan is None else load_plan(plan),
        samples=samples,
        seed=seed,
    )
    deliver_results(found, save, plot, as_json=as_json)
    if not found.facts["hover_time_s"]:
        raise typer.Exit(NO)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",")]


def _lengths(text: str | None) -> list[float] | None:
    try:
        return None if text is None else [float(each) for each in text.split(",")]
    except ValueError:
        words = "numbers of seconds with commas between them, as in 0.5,1,60"
        raise InputError([Fault("--slots", repr(text), words)]) from None
