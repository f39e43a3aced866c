"""``optuav missions``: what comes with the package."""

from __future__ import annotations

from rich.table import Table

from optuav.cli.options import JsonOption
from optuav.cli.output import deliver
from optuav.mission import load, shipped


def missions(as_json: JsonOption = False) -> None:
    """List the shipped missions."""
    rows = [{"name": each.name, "description": each.description} for each in map(load, shipped())]
    table = Table(box=None, pad_edge=False)
    table.add_column("mission", no_wrap=True)
    table.add_column("what it is")
    for row in rows:
        table.add_row(*row.values())
    deliver(lambda: rows, lambda _: [table], as_json=as_json)
