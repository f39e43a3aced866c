"""Several devices: routes in any order by bounds, and the programme along edges."""

from __future__ import annotations

from collections.abc import Callable

import optuav
from benchmarks.timing import Row, median_s
from benchmarks.towns import town
from optuav.mission import Mission
from optuav.options import Perspective

ROOFS, ENUMERATED, ALONG_EDGES = 50, 7, 12
"""Buildings, and devices whose orders are compared and chosen along edges."""


def run() -> list[Row]:
    """The longest hover over 7 devices and 50 roofs by bounds, and over 12 along edges."""
    by_bounds = _solved(_mission(ENUMERATED), "available")
    along_edges = _solved(_mission(ALONG_EDGES), "battery")
    cases = (
        (f"{ENUMERATED} devices, {ROOFS} roofs, available", by_bounds, 10.0),
        (f"{ALONG_EDGES} devices, {ROOFS} roofs, along edges", along_edges, 30.0),
    )
    rows = list[Row]()
    for what, solved, limit_s in cases:
        rows.append(Row(f"{what} / {limit_s:g} s", median_s(solved, 3), limit_s, at_least=1.0))
    return rows


def _mission(count: int) -> Mission:
    """A town with devices in a row across the middle."""
    devices = [
        {"name": f"d{k}", "position_m": [300 + 1400 * k / (count - 1), 2300 + 150 * (k % 3), 0]}
        for k in range(count)
    ]
    return town(ROOFS).replace({"devices": devices, "limits.deadline_s": 1800.0})


def _solved(mission: Mission, perspective: Perspective) -> Callable[[], None]:
    def solved() -> None:
        assert optuav.solve(mission, perspective=perspective)

    return solved
