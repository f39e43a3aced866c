"""``optuav compare``: a mission by every method, or by perspective and trajectory."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer
from rich.console import Console

from optuav.cli.options import (
    JsonOption,
    MissionArgument,
    PlotOption,
    SaveTableOption,
    SetOption,
    mission_of,
)
from optuav.cli.progress import progress
from optuav.errors import Fault, InputError
from optuav.mission.files import label, make_directory, refusal, write_text
from optuav.options import Perspective

if TYPE_CHECKING:
    from optuav.studies.results import Results

NO, ENGINE_FAILED = 1, 3


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
        str | None,
        typer.Option(
            help="How charge is counted: battery (the default), energy or adjusted; "
            "with --by also available (the default there)."
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
        typer.Option("--time-limit-s", help="Longest search for one programme in seconds."),
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
    make_ready(save, plot)
    from optuav.studies import compare as studies

    lengths = None if slots is None else _numbers(slots)
    names = None if engines is None else _names(engines)
    chosen = "method" if by is None else _names(by)
    with progress() as report:
        found = studies.compare(
            mission_of(mission, settings),
            by=chosen,
            perspective=cast(Perspective, perspective),
            slots_s=lengths,
            engines=names,
            time_limit_s=time_limit_s,
            times=times,
            progress=report,
        )
    deliver(found, save, plot, as_json=as_json)
    if found.facts.get("failures"):
        raise typer.Exit(ENGINE_FAILED)
    has_plan = any(row["hover_time_s"] is not None for row in found.rows)
    if not has_plan or found.facts.get("disagreements"):
        raise typer.Exit(NO)


def make_ready(save: Path | None, plot: Path | None) -> None:
    """Refuse places that cannot be written to before the work begins."""
    if save is not None:
        if save.suffix not in (".csv", ".json"):
            words = "a name that ends in .csv or .json"
            raise InputError([Fault("--save", repr(str(save)), words)])
        if not save.parent.is_dir():
            raise refusal(save, f"there is no directory {label(save.parent)}")
    if plot is not None:
        from optuav import plots

        make_directory(plot)
        _ = plots.bars  # refused here where matplotlib is missing


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _numbers(text: str) -> list[float]:
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        words = "numbers of seconds with commas between them, as in 0.5,1,60"
        raise InputError([Fault("--slots", repr(text), words)]) from None


def deliver(found: Results, save: Path | None, plot: Path | None, *, as_json: bool) -> None:
    """Print a table of results, as wide as the screen, and write the requested files."""
    text = json.dumps(found.to_dict(), indent=2, ensure_ascii=False)
    if save is not None:
        write_text(save, found.to_csv() if save.suffix == ".csv" else f"{text}\n")
    pictures = found.save_pictures(plot) if plot is not None else []
    if as_json:
        typer.echo(text)
        return
    screen = Console(highlight=False)
    if screen.is_terminal:
        for each in found.tables(screen.width):
            screen.print(each)
    else:
        typer.echo(str(found))
    for path in ([save] if save else []) + pictures:
        screen.print(f"wrote {path}", style="dim", markup=False, soft_wrap=True)
