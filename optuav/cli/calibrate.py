"""``optuav calibrate``: parameters of a mission from data."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from optuav.cli.options import JsonOption, PlotOption
from optuav.mission import load
from optuav.mission.files import make_directory, must_be_new, write_text

if TYPE_CHECKING:
    from optuav.calibration import Fit, Panel, Value

MOST_ROWS = 40
"""Observations that the table lists one by one."""


class Kind(StrEnum):
    """What is to be found."""

    kibam = "kibam"
    regimes = "regimes"
    rotor = "rotor"
    table = "table"


def calibrate(
    kind: Annotated[
        Kind,
        typer.Argument(
            metavar="KIND",
            help="kibam (battery, from lifetimes or records of one pack), regimes (loads, from "
            "flight logs), rotor (from a bench test or data sheets) or table (keys of a mission, "
            "from results).",
            case_sensitive=False,
        ),
    ],
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="CSV files; for table one TOML file.")
    ],
    extends: Annotated[
        str | None,
        typer.Option(
            metavar="MISSION",
            help="Mission that the fragment extends; paper by default, for table its own.",
        ),
    ] = None,
    as_json: JsonOption = False,
    save: Annotated[
        Path | None,
        typer.Option("--save", metavar="FILE", help="Write a new mission file with the values."),
    ] = None,
    plot: PlotOption = None,
) -> None:
    """Find parameters of a mission from measurements, and say how sure they are."""
    base = None if extends is None else load(extends)
    if save is not None:
        must_be_new(save)
    if plot is not None:
        from optuav import plots

        make_directory(plot)
        _ = plots.fit  # refused here where matplotlib is missing
    from optuav import calibration

    fit = {
        Kind.kibam: calibration.fit_kibam,
        Kind.regimes: calibration.fit_regimes,
        Kind.rotor: calibration.fit_rotor,
        Kind.table: calibration.fit_table,
    }[kind]
    found = fit(files)
    found = found.beside(base or load(found.extends))
    written = []
    if save is not None:
        write_text(save, found.to_toml(extends, save))
        written.append(save)
    if plot is not None and found.panels:
        written.append(plots.save(plots.fit(found)[0], plot / "fit.png"))
    if as_json:
        typer.echo(json.dumps(found.to_dict(), indent=2, ensure_ascii=False))
        return
    _show(found, written)


def _show(found: Fit, written: list[Path]) -> None:
    from optuav.studies.results import as_text

    screen = Console(highlight=False)
    if screen.is_terminal:
        for piece in _pieces(found):
            screen.print(piece)
    else:
        typer.echo(as_text(_pieces(found)))
    for warning in found.warnings:
        screen.print("warning:", style="bold yellow", end=" ")
        screen.print(warning, markup=False, soft_wrap=True)
    if found.changes:
        settings = (f"--set {key}={value}" for key, value in found.changes.items())
        screen.print(f"\noptuav solve MISSION {' '.join(settings)}", markup=False, soft_wrap=True)
    for path in written:
        screen.print(f"wrote {path}", style="dim", markup=False, soft_wrap=True)


def _pieces(found: Fit) -> Iterator[RenderableType]:
    yield Text(f"{found.kind}: {found.data}", style="bold")
    for table in dict.fromkeys(value.key.partition(".")[0] for value in found.values):
        yield ""
        yield _values([each for each in found.values if each.key.startswith(f"{table}.")], table)
    for panel in found.panels:
        yield ""
        yield _observations(panel) if panel.names else _spread(panel)


def _values(values: list[Value], name: str) -> Table:
    table = _table()
    table.add_column(Text(f"[{name}]"), no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("95 % between", justify="right", no_wrap=True)
    for each in values:
        row = each.written(" – ") if each.determined else ["?", "not determined"]
        if each.interval is None:
            row.append("–")
        table.add_row(each.key.partition(".")[2], *row)
    return table


def _observations(panel: Panel) -> Table:
    """Every named observation beside what the fit makes of it."""
    table = _table()
    table.add_column(Text(f"{panel.quantity} [{panel.unit}]"), no_wrap=True, max_width=30)
    for heading in ("observed", "fitted", "difference"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("")
    rows = zip(panel.names, panel.observed, panel.fitted, panel.each_role, strict=True)
    for number, (name, observed, fitted, role) in enumerate(rows):
        if number == MOST_ROWS:
            table.add_row(f"and {len(panel.names) - MOST_ROWS} more")
            break
        difference = 0.0 if math.isclose(fitted, observed, rel_tol=1e-9) else fitted - observed
        table.add_row(
            Text(name),
            f"{observed:.6g}",
            f"{fitted:.6g}",
            f"{difference:+.3g}" if difference else "0",
            "" if role == "fitted" else role,
        )
    return table


def _spread(panel: Panel) -> Text:
    """What the fit leaves over of many samples."""
    squares = [(a - b) ** 2 for a, b in zip(panel.observed, panel.fitted, strict=True)]
    left = math.sqrt(sum(squares) / len(squares))
    count = len(panel.observed)
    return Text(f"{panel.quantity}: {left:.3g} {panel.unit} rms left over of {count} samples")


def _table() -> Table:
    return Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="")
