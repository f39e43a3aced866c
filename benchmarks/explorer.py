"""Moves of the explorer's sliders on the shipped mission, each answered whole and as JSON."""

from __future__ import annotations

import json
import time
from typing import Any

import numpy as np

import optuav
from benchmarks.timing import Row
from optuav.explorer.answers import answers
from optuav.explorer.state import controls

MOVES = 15  # Of every slider
SHARE = 95  # Percent of the moves within the limit
LIMITS_S = {"battery": 0.1, "available": 0.2}


def run() -> list[Row]:
    """The time that most moves stay below, against their limit."""
    mission, rows = optuav.load("paper"), list[Row]()
    for perspective, limit_s in LIMITS_S.items():
        spent = list[float]()
        for state in _moves(mission, perspective):
            begin = time.process_time()
            found = json.dumps(answers(mission, state))
            spent.append(time.process_time() - begin)
            assert '"faults"' not in found
        most_s, longest_s = (float(np.percentile(spent, share)) for share in (SHARE, 100))
        what = f"{SHARE} % of {len(spent)} moves, {perspective}, longest {1e3 * longest_s:.0f} ms"
        rows.append(Row(f"{what} / {1e3 * limit_s:g} ms", most_s, limit_s, at_most=1.0))
    return rows


def _moves(mission: optuav.Mission, perspective: str) -> list[dict[str, Any]]:
    """States in which one slider after the other stands at places of its whole range."""
    found = list[dict[str, Any]]()
    for control in controls(mission):
        for value in np.linspace(control.low, control.high, MOVES).tolist():
            stated: Any = value
            if control.axis is not None:
                stated = [value if axis == control.axis else 0.0 for axis in range(3)]
            found.append({"changes": {control.key: stated}, "perspective": perspective})
    return found
