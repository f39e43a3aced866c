"""``optuav validate``: whether a mission file is in order, and the mission can be flown."""

from __future__ import annotations

from rich.text import Text

from optuav.cli.options import JsonOption, MissionArgument, SetOption, mission_of
from optuav.cli.output import deliver, warning


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
