"""``optuav validate``: whether a mission file is in order, and the mission can be flown."""

from __future__ import annotations

import json

import typer
from rich.console import Console
from rich.text import Text

from optuav.cli.options import JsonOption, MissionArgument, SetOption, mission_of
from optuav.network.feasibility import advice


def validate(
    mission: MissionArgument, settings: SetOption = None, as_json: JsonOption = False
) -> None:
    """Check a mission file; warn of what is stated well but cannot be flown."""
    checked = mission_of(mission, settings)
    warnings = advice(checked)
    if as_json:
        answer = {"mission": checked.name, "valid": True, "warnings": list(warnings)}
        typer.echo(json.dumps(answer, indent=2, ensure_ascii=False))
        return
    screen = Console(highlight=False)
    screen.print(f"{checked.name}: every key of the mission is in order", markup=False)
    for warning in warnings:
        screen.print(Text.assemble(("warning: ", "bold yellow"), warning))
