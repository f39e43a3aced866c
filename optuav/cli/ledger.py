"""``optuav ledger``: the paper's numbers beside ours."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from optuav.cli.options import JsonOption
from optuav.errors import Fault, InputError
from optuav.mission.files import write_text


def ledger(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...", help="Names of entries, or beginnings of names; all by default."
        ),
    ] = None,
    as_json: JsonOption = False,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="FILE", help="Write the entries as .csv.")
    ] = None,
) -> None:
    """Compute the paper's numbers again, and say which match and why others do not."""
    if save is not None and save.suffix != ".csv":
        raise InputError([Fault("--save", repr(str(save)), "a name that ends in .csv")])
    from optuav.paper.ledger import ledger as computed

    found = computed(names or ())
    if save is not None:
        write_text(save, found.to_csv())
    text = json.dumps(found.records(), indent=2, ensure_ascii=False) if as_json else str(found)
    typer.echo(text)
