"""Samples of an uncertain mission, over all its itineraries, against the times they may take."""

from __future__ import annotations

import time

from benchmarks.timing import Row
from optuav.options import Perspective
from optuav.studies.sensitivity import sensitivity

SAMPLES = 100_000


def run() -> list[Row]:
    """The shipped mission with everything that is measured uncertain, less what is not samples."""
    limits_s: dict[Perspective, float] = {"battery": 5.0, "available": 10.0}
    return [
        Row(f"10⁵ samples, {name} / {limit_s:g} s", _seconds(name), limit_s, at_most=1.0)
        for name, limit_s in limits_s.items()
    ]


def _seconds(perspective: Perspective) -> float:
    sensitivity("paper", perspective=perspective, samples=1)
    begin = time.process_time()
    sensitivity("paper", perspective=perspective, samples=1)
    single = time.process_time()
    sensitivity("paper", perspective=perspective, samples=SAMPLES)
    return (time.process_time() - single) - (single - begin)
