"""``optuav missions``: what comes with the package."""

from __future__ import annotations

import json

import typer
from rich.console import Console
from rich.table import Table

from optuav.cli.options import JsonOption
from optuav.mission import load, shipped


def missions(as_json: JsonOption = False) -> None:
    """List the shipped missions."""
    found = [load(name) for name in shipped()]
    if as_json:
        rows = [{"name": each.name, "description": each.description} for each in found]
        typer.echo(json.dumps(rows, indent=2, ensure_ascii=False))
        return
    table = Table(box=None, pad_edge=False)
    table.add_column("mission", no_wrap=True)
    table.add_column("what it is")
    for each in found:
        table.add_row(each.name, each.description)
    Console(highlight=False).print(table)
