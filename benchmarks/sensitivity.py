"""Samples of what is uncertain in a town of 1000 buildings: few routes and a bound, or all."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np

import optuav
from benchmarks.timing import Row, interleaved_s
from benchmarks.towns import town
from optuav.studies import batch
from optuav.studies.results import Results

BUILDINGS, AT_LEAST, REPEATS = 1000, 4.0, 3


def run() -> list[Row]:
    """A sensitivity with 10 000 samples."""
    mission = town(BUILDINGS)

    def ours() -> Results:
        return optuav.sensitivity(mission)

    def every() -> Results:
        with patch.object(batch, "fewer", lambda *_: None):
            return optuav.sensitivity(mission)

    times_s = (each().facts["chances"].hover_times_s for each in (ours, every))
    assert np.array_equal(*times_s)
    title = f"sensitivity, {BUILDINGS} buildings: few routes and a bound / all routes"
    return [Row(title, *interleaved_s(ours, every, REPEATS), at_least=AT_LEAST)]
