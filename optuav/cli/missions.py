"""``optuav missions`` and ``optuav validate``: shipped missions, and whether a file is in order."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from optuav.cli.options import JsonOption, MissionArgument, SetOption, mission_of
from optuav.cli.output import deliver, warning
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


def validate(
    mission: MissionArgument, settings: SetOption = None, as_json: JsonOption = False
) -> None:
    """Check a mission file; warn of what is stated well but cannot be flown."""
    from optuav.network.feasibility import advice

    checked = mission_of(mission, settings)
    warnings = list(advice(checked))
    lines = [Text(f"{checked.name}: every key of the mission is in order")]
    deliver(
        lambda: {"mission": checked.name, "valid": True, "warnings": warnings},
        lambda _: [*lines, *map(warning, warnings)],
        as_json=as_json,
    )
