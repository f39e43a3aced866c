"""Packs that take turns: the search from bounds on the flight after the hover, or from none."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np

import optuav
from benchmarks.timing import Row, interleaved_s
from optuav.solving.packs_by_schedule import _Route
from optuav.studies.results import Comparison

AT_LEAST, REPEATS = 3.0, 3


def run() -> list[Row]:
    """The plans of `paper` by schedule."""

    def ours() -> Comparison:
        return optuav.compare("paper", by="schedule")

    def unbounded() -> Comparison:
        with patch.object(_Route, "_needed_As", lambda *_: -np.inf):
            return optuav.compare("paper", by="schedule")

    assert ours().rows == unbounded().rows
    pair = interleaved_s(ours, unbounded, REPEATS)
    return [Row("paper, by schedule: bounded / every hover", *pair, at_least=AT_LEAST)]
