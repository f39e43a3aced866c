"""``optuav reproduce`` and ``optuav ledger``: the paper's tables and figures, and its numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optuav.cli.options import JsonOption
from optuav.cli.output import NO, check_places, deliver, progress
from optuav.mission.files import write_text


def reproduce(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where to write.")] = Path(
        "reproduced"
    ),
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAME",
            help="One study by name, or by number as fig5 and table2; or ledger. Repeatable.",
        ),
    ] = None,
    mission: Annotated[
        str | None,
        typer.Option(
            "--mission",
            metavar="MISSION",
            help="Make the studies for this mission, a shipped one's name or a file.",
        ),
    ] = None,
) -> None:
    """Make every table and figure of the paper, with a report that opens offline.

    Exit code 1 if the mission has no plan.
    """
    from optuav.mission import load
    from optuav.paper import report
    from optuav.paper.curves import solve
    from optuav.paper.figures import why

    check_places(None, out)
    own = None if mission is None else load(mission)
    with progress() as bar:
        written = report.reproduce(out, only=only or (), mission=own, progress=bar)
    typer.echo(f"wrote {len(written)} files, among them {out / 'report.html'}")
    if own is not None and not (plan := solve(own)):
        typer.echo(f"{own.name} has no plan: {why(plan)}")
        raise typer.Exit(NO)


def ledger(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="Show these entries in full: names, or beginnings of names.",
        ),
    ] = None,
    details: Annotated[
        bool, typer.Option("--details", help="Show every entry in full, not a summary.")
    ] = False,
    as_json: JsonOption = False,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="FILE", help="Write the entries as .csv.")
    ] = None,
) -> None:
    """Compute the paper's numbers again, and say which match and why others do not."""
    check_places(save, None, ".csv")
    from optuav.paper.ledger import ledger as computed

    found = computed(names or ())
    if save is not None:
        write_text(save, found.to_csv())
    more = f"{found.summary}\n\nWith reasons: optuav ledger --details, or NAME..."
    deliver(found.records, found.details if names or details else more, as_json=as_json)
