"""Maps of ten thousand points of the shipped mission in every perspective, and the command."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any, get_args

import optuav
from benchmarks.startup import process_s
from benchmarks.timing import Row
from optuav.options import Perspective

REPEATS, LIMIT_S = 3, 1.0
WHERE = {
    "device": (20, (0, 1000, 1980, 2980)),
    "laser": (20, (0, 0, 1980, 1980)),
    "hover_point": (10, (500, 2500, 1490, 3490)),
}
"""Distances of 100 × 100 points, and their bounds [m]."""


def run() -> list[Row]:
    """A map over each of the three places, against the second that it may take."""
    rows = []
    for over, (step_m, bounds) in WHERE.items():
        for perspective in get_args(Perspective):
            options: Any = {"perspective": perspective}
            draw: Callable[..., Any] = getattr(optuav.maps, over)
            spent = []
            for _ in range(REPEATS):
                begin = time.process_time()
                found = draw("paper", step_m, bounds=bounds, **options)
                spent.append(time.process_time() - begin)
            assert not found.isnull().all()
            title = f"{over.replace('_', ' ')}, {perspective}: {found.size} points / {LIMIT_S:g} s"
            rows.append(Row(title, min(spent), LIMIT_S, at_most=1.0))
    return [*rows, command()]


def command() -> Row:
    """The words of `optuav map`, which label no array, against a process that makes the array."""
    printed = ["-m", "optuav", "map", "paper", "--over", "device", "--step", "50"]
    labelled = ["-c", "import optuav.cli.app; optuav.maps.device('paper', 50)"]
    rounds = [(process_s(printed), process_s(labelled)) for _ in range(REPEATS)]
    printed_s, labelled_s = (statistics.median(each) for each in zip(*rounds, strict=True))
    what = "optuav map, step 50: printed / as a labelled array"
    return Row(what, printed_s, labelled_s, at_least=1.5)
