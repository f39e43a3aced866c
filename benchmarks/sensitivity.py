"""Samples of what is uncertain in a town of 1000 buildings: few routes and a bound, or all."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np

import optuav
from benchmarks.timing import Row, interleaved_s
from benchmarks.towns import town
from optuav.studies import batch
from optuav.studies.sensitivity import Sensitivity

BUILDINGS, AT_LEAST, REPEATS = 1000, 4.0, 3


def run() -> list[Row]:
    """A sensitivity with 10 000 samples."""
    mission = town(BUILDINGS)

    def ours() -> Sensitivity:
        return optuav.sensitivity(mission)

    def every() -> Sensitivity:
        with patch.object(batch, "fewer", lambda *_: None):
            return optuav.sensitivity(mission)

    few, all_routes = ours().chances, every().chances
    assert few is not None
    assert all_routes is not None
    assert np.array_equal(few.hover_times_s, all_routes.hover_times_s)
    title = f"sensitivity, {BUILDINGS} buildings: few routes and a bound / all routes"
    return [Row(title, *interleaved_s(ours, every, REPEATS), at_least=AT_LEAST)]
