"""``optuav compare``: a mission by every method, or by perspective and trajectory."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.console import Console, RenderableType

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
from optuav.mission import Mission
from optuav.mission.files import label, make_directory, refusal, write_text

YES, NO, ENGINE_FAILED = 0, 1, 3


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
        str,
        typer.Option(
            help="battery, energy or adjusted: how charge is counted; with --by also available."
        ),
    ] = "battery",
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
        bool, typer.Option("--times", help="Tell times taken, which differ from run to run.")
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
    lengths = None if slots is None else _numbers(slots)
    asked = mission_of(mission, settings)
    if by is not None:
        _refuse_with_by(lengths, engines=engines, time_limit_s=time_limit_s, times=times or None)
    slot_s = lengths[0] if lengths else None
    if by == "schedule":
        found = _by_schedule(asked, slot_s, plot)
    elif by is not None:
        found = _by_choice(asked, _names(by), perspective, slot_s, plot)
    else:
        options: dict[str, Any] = {} if engines is None else {"engines": _names(engines)}
        options |= {} if lengths is None else {"slots": lengths}
        options |= {"perspective": perspective, "time_limit_s": time_limit_s}
        found = _by_method(asked, options, plot, times=times)
    _deliver(found, as_json, save)
    if found.code:
        raise typer.Exit(found.code)


class Found(NamedTuple):
    """A comparison: as data, as CSV, as tables and pictures, and the exit code that it deserves."""

    data: dict[str, Any]
    table: str
    shown: Iterable[RenderableType]
    pictures: list[Path]
    code: int


def _by_method(
    mission: Mission, options: dict[str, Any], plot: Path | None, *, times: bool
) -> Found:
    """The answers of all engines, in slots and in continuous times."""
    from optuav import studies
    from optuav.studies import tables

    with progress() as told:
        found = studies.compare(mission, progress=told, **options)
    disagree = not found.agrees or not found
    return Found(
        found.to_dict(times=times),
        found.to_csv(times=times),
        tables.comparison_tables(found, times=times, width=_width(tables.WIDTH)),
        found.save_pictures(plot) if plot is not None else [],
        ENGINE_FAILED if found.failures else NO if disagree else YES,
    )


def _by_choice(
    mission: Mission, by: list[str], perspective: str, slot_s: float | None, plot: Path | None
) -> Found:
    """Plans by perspective and trajectory."""
    from optuav import studies
    from optuav.studies.choice_tables import choice_tables

    found = studies.compare_by(mission, by, perspective=perspective, slot_s=slot_s)
    has_plan = any(row.hover_time_s is not None for row in found.rows)
    return Found(
        found.to_dict(),
        found.to_csv(),
        choice_tables(found),
        found.save_pictures(plot) if plot is not None else [],
        YES if has_plan else NO,
    )


def _by_schedule(mission: Mission, slot_s: float | None, plot: Path | None) -> Found:
    """Plans by schedule of the packs."""
    from optuav import studies

    found = studies.compare_schedules(mission, slot_s=slot_s)
    return Found(
        found.to_dict(),
        found.to_csv(),
        found.tables(),
        found.save_pictures(plot) if plot is not None else [],
        YES if any(found.plans) else NO,
    )


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
        _ = plots.slot_gaps  # refused here where matplotlib is missing


def _refuse_with_by(lengths: list[float] | None, **others: Any) -> None:
    faults = [
        Fault(f"--{name.replace('_', '-')}", "", "does not go with --by")
        for name, value in others.items()
        if value is not None
    ]
    if lengths is not None and len(lengths) > 1:
        faults.append(Fault("--slots", "", "one length with --by"))
    if faults:
        raise InputError(faults)


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _numbers(text: str) -> list[float]:
    try:
        return [float(each) for each in text.split(",")]
    except ValueError:
        words = "numbers of seconds with commas between them, as in 0.5,1,60"
        raise InputError([Fault("--slots", repr(text), words)]) from None


def _width(otherwise: int) -> int:
    """Columns of the terminal; what is written elsewhere is as wide everywhere."""
    screen = Console()
    return screen.width if screen.is_terminal else otherwise


def _deliver(found: Found, as_json: bool, save: Path | None) -> None:
    """Print a comparison, and write what was asked for."""
    from optuav.studies.tables import as_text

    text = json.dumps(found.data, indent=2, ensure_ascii=False)
    if save is not None:
        write_text(save, found.table if save.suffix == ".csv" else f"{text}\n")
    if as_json:
        typer.echo(text)
        return
    screen = Console(highlight=False)
    if screen.is_terminal:
        for each in found.shown:
            screen.print(each)
    else:
        typer.echo(as_text(found.shown))
    for path in ([save] if save else []) + found.pictures:
        screen.print(f"wrote {path}", style="dim", markup=False, soft_wrap=True)
