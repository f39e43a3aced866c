"""Fig. 9: the wind in which hovering takes the least energy, and the most that can be held."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from optuav.paper.curves.settings import HOVER_S
from optuav.paper.curves.wind import AXES, calmest_N, hover_energy, limits_N
from optuav.paper.ledger.scenario import Scenario
from optuav.paper.ledger.statement import Statement, Value, meets, printed_interval, setting

PLACE = "text on Fig. 9"
CUT = "a limit that is rounded away from 0 could not be held; the last digit is cut off"


def statements() -> Iterator[Statement]:
    """Limits and calmest wind along each axis."""
    yield setting("fig9-hover", PLACE, "hover time Δ", HOVER_S)
    for axis in ("x", "y"):
        yield _calmest(axis, "0")
        yield _limit(f"{axis}-plus", "11.57", reason=CUT)
        yield _limit(f"{axis}-minus", "-11.57", reason=CUT)
    yield _limit(
        "z-minus",
        "-4.45",
        reason=_why_down(),
        contradicted=not meets("-4.45", _down_by_level_limit()),
    )
    yield _limit("z-plus", "29.9", reason=CUT)
    yield _calmest("z", "12.74")


def _calmest(axis: str, stated: str) -> Statement:
    return Statement(
        name=f"fig9-least-{axis}",
        place=PLACE,
        what=f"wind along {axis} with the least hover energy",
        stated=stated,
        unit="N",
        how="where the curve of the energy is lowest",
        compute=partial(_calmest_N, axis),
    )


def _limit(end: str, stated: str, *, reason: str, contradicted: bool = False) -> Statement:
    axis, side = end.split("-")
    return Statement(
        name=f"fig9-limit-{end}",
        place=PLACE,
        what=f"limit of the wind along {axis}",
        stated=stated,
        unit="N",
        how="where gravity and wind take the full thrust",
        compute=partial(_limit_N, axis, 1 if side == "plus" else 0),
        limit=True,
        reason=reason,
        contradicted=lambda: contradicted,
    )


def _calmest_N(axis: str, scenario: Scenario) -> Value:
    if not scenario.has_rotors:
        return None
    return calmest_N(hover_energy(scenario.mission, AXES[axis], HOVER_S))


def _limit_N(axis: str, end: int, scenario: Scenario) -> Value:
    return limits_N(scenario.mission, AXES[axis])[end] if scenario.has_rotors else None


def _down_by_level_limit() -> tuple[float, float]:
    """Limit downwards that follows from the printed 11.57 N and 12.74 N [N]: F − m g."""
    least, most = printed_interval("11.57")
    # A limit that is cut, not rounded, may be up to a whole unit larger.
    thrusts = (math.hypot(least, 12.74), math.hypot(most + 0.005, 12.74))
    return 12.74 - thrusts[1], 12.74 - thrusts[0]


def _why_down() -> str:
    low, high = _down_by_level_limit()
    return f"with the printed 11.57 N the full thrust leaves {high:.2f} to {low:.2f} N downwards"
