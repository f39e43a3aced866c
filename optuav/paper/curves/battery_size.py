"""Hover time against battery size, with and without laser: Fig. 8 of the paper."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from optuav.mission import Mission
from optuav.plan import Plan
from optuav.solving import solve

CHARGING = ("flight.charge_current_A", "flight.charge_power_W")
HALVINGS = 30
LARGEST_PACK = 4.0
"""How many times the mission's pack is the largest that is tried."""


def without_laser(mission: Mission) -> Mission:
    """A mission without its laser, and without what it states of charging."""
    stated = CHARGING if mission.flight.model == "regimes" else ()
    return mission.replace(dict.fromkeys(("laser", *stated)))


def direct(mission: Mission, capacity_As: float, **asked: Any) -> Plan:
    """(P3) with packs of another capacity [A s], by charge unless asked for otherwise."""
    asked = {"perspective": "battery", **asked}
    return solve(mission.replace({"battery.capacity_As": capacity_As}), "P3", **asked)


def pack_for(mission: Mission, hover_s: float, **asked: Any) -> float | None:
    """Least pack [A s] with which the direct path hovers so long [s]; None if none does."""
    return _first_pack(mission, lambda plan: plan.hover_time_s >= hover_s, **asked)


def saturation(mission: Mission, **asked: Any) -> float | None:
    """Least pack [A s] with which the deadline ends the direct path; None if it never does."""
    return _first_pack(mission, lambda plan: plan.binding == ("P3.b hover time",), **asked)


def _first_pack(mission: Mission, holds: Callable[[Plan], bool], **asked: Any) -> float | None:
    """Where a condition begins to hold as the pack grows, by halving."""

    def is_enough(capacity_As: float) -> bool:
        plan = direct(mission, capacity_As, **asked)
        return bool(plan) and holds(plan)

    low, high = 0.0, LARGEST_PACK * mission.battery.capacity_As
    if not is_enough(high):
        return None
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return high
