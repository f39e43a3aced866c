"""``optuav reproduce``: the paper's tables and figures, and how its numbers stand beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from optuav.cli.output import NO, check_places, progress


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
    screen = Console(highlight=False, soft_wrap=True)
    screen.print(f"wrote {len(written)} files, among them {out / 'report.html'}", markup=False)
    if own is not None and not (plan := solve(own)):
        screen.print(f"{own.name} has no plan: {why(plan)}", markup=False)
        raise typer.Exit(NO)
