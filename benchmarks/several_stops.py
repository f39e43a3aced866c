"""The search over several stops, against the times that it may take."""

from __future__ import annotations

from collections.abc import Callable

import optuav
from benchmarks.timing import Row, median_s
from benchmarks.towns import town
from optuav.mission import Mission, load
from optuav.solving import solve
from optuav.status import Status

TOWN = 200
"""Buildings."""


def run() -> list[Row]:
    """Two rests on ten and on 200 buildings, and two hovers besides; each has to be proved."""
    paper = load("paper")
    long = paper.replace({"limits.deadline_s": 2400.0})
    cases = (
        ("10 buildings, 2 rests", paper, 1, 1.0, 5),
        ("10 buildings, 2 rests, 2 hovers, 2400 s", long, 2, 10.0, 5),
        (f"{TOWN} buildings, 2 rests", town(TOWN), 1, 30.0, 1),
    )
    return [
        Row(f"{what} / {limit_s:g} s", median_s(_proved(*asked), runs), limit_s, at_least=1.0)
        for what, *asked, limit_s, runs in cases
    ]


def _proved(mission: Mission, hovers: int) -> Callable[[], None]:
    def find() -> None:
        plan = solve(mission, optuav.P1(stops=2, hovers=hovers), perspective="available")
        assert plan.status is Status.OPTIMAL

    return find
