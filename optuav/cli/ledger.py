"""``optuav ledger``: the paper's numbers beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optuav.cli.options import JsonOption
from optuav.cli.output import check_places, deliver
from optuav.mission.files import write_text


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
