"""``optuav power``: the power of a drone against its airspeed."""

from __future__ import annotations

import optuav
from optuav.cli.study_options import StudyOptions


def power(mission: str, out: StudyOptions) -> None:
    """Show the power against airspeed, and the speeds of best endurance and best range."""
    out.deliver(optuav.power_curve(out.mission(mission)))
