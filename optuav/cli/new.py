"""``optuav new``: a commented mission file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from optuav.errors import Fault, InputError
from optuav.mission import load
from optuav.mission.files import write_text
from optuav.mission.template import template


def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write.")],
    source: Annotated[
        str, typer.Option("--from", metavar="MISSION", help="Whose values to start from.")
    ] = "paper",
) -> None:
    """Write a mission file in which every key is explained."""
    if file.exists():
        raise InputError([Fault("", "", "exists already; name a new file", str(file))])
    write_text(file, template(load(source), file.stem))
    Console(highlight=False, soft_wrap=True).print(
        f"wrote {file}; next: optuav validate {file}", markup=False
    )
