"""Maps of ten thousand points of the shipped mission, in every perspective."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, get_args

import numpy as np

import optuav
from benchmarks.timing import Row
from optuav.options import Perspective

SIDE, REPEATS, LIMIT_S = 100, 3, 1.0
WHERE = {"device": (0.0, 1000.0), "laser": (0.0, 0.0), "hover_point": (500.0, 2500.0)}
"""Where the maps begin [m]; they are 2 km wide, that of hover points 1 km."""


def run() -> list[Row]:
    """A map over each of the three places, against the second that it may take."""
    rows = []
    for over, (x, y) in WHERE.items():
        along_m = np.linspace(0.0, 1000.0 if over == "hover_point" else 2000.0, SIDE)
        for perspective in get_args(Perspective):
            options: Any = {"perspective": perspective}
            draw: Callable[..., Any] = getattr(optuav.maps, over)
            spent = []
            for _ in range(REPEATS):
                begin = time.process_time()
                found = draw("paper", (x + along_m, y + along_m), **options)
                spent.append(time.process_time() - begin)
            assert not found.isnull().all()
            title = f"{over.replace('_', ' ')}, {perspective}: {SIDE**2} points / {LIMIT_S:g} s"
            rows.append(Row(title, min(spent), LIMIT_S, at_most=1.0))
    return rows
