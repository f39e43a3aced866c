"""``optuav calibrate``: parameters of a mission from data."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from optuav.cli.output import check_places, deliver, warning

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

    from optuav.calibration import Fit

MOST_ROWS = 40  # Observations that the table lists one by one

Kind = Literal["kibam", "regimes", "rotor", "table"]


def calibrate(
    kind: Kind,
    files: list[Path],
    extends: str | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find parameters of a mission from measurements, and say how sure they are."""
    from optuav.mission import load
    from optuav.mission.files import must_be_new, write_text

    if extends is not None:
        load(extends)  # refused before the work
    check_places(None, plot)
    if save is not None:
        must_be_new(save)
    from optuav import calibration

    found: Fit = getattr(calibration, f"fit_{kind}")(files)
    written = []
    if save is not None:
        write_text(save, found.to_toml(extends, save))
        written.append(save)
    if plot is not None and found.panels:
        from optuav import plots

        written.append(plots.save(plots.fit(found)[0], plot / "fit.png"))
    notes = [warning(each) for each in found.warnings]
    if found.changes:
        settings = (f"--set {key}={value}" for key, value in found.changes.items())
        notes.append(f"\noptuav solve MISSION {' '.join(settings)}")
    deliver(found.to_dict, _pieces(found), as_json=as_json, notes=notes, written=written)


def _pieces(found: Fit) -> Iterator[RenderableType]:
    """The values, table by table of the mission, then what was observed."""
    from rich.markup import escape
    from rich.text import Text

    from optuav.studies.results import plain_table

    yield Text(f"{found.kind}: {found.data}", style="bold")
    tables: dict[str, Table] = {}
    for each in found.values:
        name, _, key = each.key.partition(".")
        if name not in tables:
            tables[name] = plain_table("value", "95 % between", words=[rf"\[{name}]"])
        row = each.written(" – ") if each.determined else ["?", "not determined"]
        tables[name].add_row(key, *row, *([] if each.interval else ["–"]))
    for table in tables.values():
        yield from ("", table)
    for panel in found.panels:
        yield ""
        if not panel.names:
            left = math.dist(panel.observed, panel.fitted) / math.sqrt(len(panel.observed))
            words = f"{left:.3g} {panel.unit} rms left over of {len(panel.observed)} samples"
            yield Text(f"{panel.quantity}: {words}")
            continue
        head = ("observed", "fitted", "difference")
        table = plain_table(*head, words=[escape(f"{panel.quantity} [{panel.unit}]")])
        table.columns[0].max_width = 30
        table.add_column("")
        roles = panel.roles or ["fitted"] * len(panel.names)
        rows = zip(panel.names, panel.observed, panel.fitted, roles, strict=True)
        for name, observed, fitted, role in islice(rows, MOST_ROWS):
            same = math.isclose(fitted, observed, rel_tol=1e-9)
            difference = "0" if same else f"{fitted - observed:+.3g}"
            about = "" if role == "fitted" else role
            table.add_row(Text(name), f"{observed:.6g}", f"{fitted:.6g}", difference, about)
        if len(panel.names) > MOST_ROWS:
            table.add_row(f"and {len(panel.names) - MOST_ROWS} more")
        yield table
