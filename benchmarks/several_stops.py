"""The search over several stops, against the times that it may take."""

from __future__ import annotations

from collections.abc import Callable
from unittest.mock import patch

import optuav
from benchmarks.timing import Row, interleaved_s, median_s
from benchmarks.towns import town
from optuav.mission import Mission, load
from optuav.search import branch
from optuav.search.sequences import sequences
from optuav.solving import solve
from optuav.status import Status

TOWN = 200
"""Buildings."""


def run() -> list[Row]:
    """Two rests on ten and on 200 buildings, and two hovers besides; each has to be proved.

    And bounds on parts of sequences against bounds on whole ones only.
    """
    paper = load("paper")
    long = paper.replace({"limits.deadline_s": 2400.0})
    cases = (
        ("10 buildings, 2 rests", paper, 1, 1.0, 5),
        ("10 buildings, 2 rests, 2 hovers, 2400 s", long, 2, 10.0, 5),
        (f"{TOWN} buildings, 2 rests", town(TOWN), 1, 30.0, 1),
    )
    rows = list[Row]()
    for what, mission, hovers, limit_s, runs in cases:
        ours_s = median_s(_proved(mission, hovers), runs)
        rows.append(Row(f"{what} / {limit_s:g} s", ours_s, limit_s, at_least=1.0))
    for buildings, stops, at_least in ((100, 3, 3.0), (1000, 2, 1.2)):
        ours = _proved(town(buildings), 1, stops)
        both_s = interleaved_s(ours, _by_whole_sequences(ours), 1)
        what = f"{buildings} buildings, {stops} rests: bounds on parts / on whole sequences"
        rows.append(Row(what, *both_s, at_least=at_least))
    return rows


def _proved(mission: Mission, hovers: int, stops: int = 2) -> Callable[[], None]:
    def find() -> None:
        plan = solve(mission, optuav.P1(stops=stops, hovers=hovers), perspective="available")
        assert plan.status is Status.OPTIMAL

    return find


def _by_whole_sequences(find: Callable[[], None]) -> Callable[[], None]:
    def find_so() -> None:
        with patch.object(
            branch, "sequences", lambda terrain, pattern, _: sequences(terrain, pattern)
        ):
            find()

    return find_so
