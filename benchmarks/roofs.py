"""Legs and sight among roofs with walls, which stand in the way of both."""

from __future__ import annotations

import resource
import time

from benchmarks.timing import Row, median_s
from benchmarks.towns import town
from optuav.network.graph import as_graph
from optuav.network.network import build_network

FOOTPRINT_M = 5.0  # Narrow ones let lines through, which makes them longer to follow
APART_M = 200.0  # Each has a square of this side to itself on average, in a town of any size


def run() -> list[Row]:
    """Towns of 10³ to 10⁵ buildings, which should take a time in proportion."""
    rows, each_s = list[Row](), 0.0
    for buildings, repeats in ((1_000, 5), (10_000, 3), (100_000, 1)):
        mission = town(buildings, FOOTPRINT_M, APART_M)
        seconds = median_s(lambda: build_network.__wrapped__(mission), repeats)  # noqa: B023
        each_s = each_s or seconds / buildings
        rows.append(Row(f"a building of {buildings} / of 1000", seconds / buildings, each_s))
    peak_MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    what = f"legs and sight of 10⁵ buildings, {peak_MB:.0f} MB with the mission / 5 s"
    rows.append(Row(what, seconds, 5.0, at_most=1.0))
    begin = time.process_time()
    edges = as_graph(build_network(town(100_000))).number_of_edges()
    what = f"graph of 10⁵ buildings in the open, {edges} edges / 10 s"
    return [*rows, Row(what, time.process_time() - begin, 10.0, at_most=1.0)]
