"""Sight of all roofs of a city from one laser, and the legs to all of them from three places."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterable

import numpy as np

from benchmarks.timing import Row
from benchmarks.towns import slanting_town
from optuav.arrays import Floats
from optuav.network.obstacles import CLEAR, _followed, crossed
from optuav.network.prisms import Prisms

TOWNS = {"dense": (15.0, 30.0), "sparse": (5.0, 200.0)}  # Side of a footprint and of its square [m]
LASERS_M = (50.0, 200.0)


def run() -> list[Row]:
    """Slanting squares, 10² to 10⁶; at 10⁵ against following every line, with equal verdicts."""
    rows = list[Row]()
    for name, (footprint_m, apart_m) in TOWNS.items():
        each_s = 0.0
        for power in range(2, 7):
            obstacles, roofs_m, side_m = slanting_town(10**power, footprint_m, apart_m)
            lasers_m = [(side_m / 2, 0.0, height_m) for height_m in LASERS_M]
            lasers_s = [_seconds(obstacles, [place], roofs_m) for place in lasers_m]
            ends_m = [(0.0, 0.0, 50.0), (side_m / 2, side_m / 2, 60.0), (side_m, 0.0, 50.0)]
            legs_s = _seconds(obstacles, ends_m, roofs_m)
            each_s = each_s or max(lasers_s) / 10**power
            what = f"{name}, 10^{power}: sight"
            rows.append(
                Row(f"{what} of a roof / of 10^2", max(lasers_s) / len(roofs_m), each_s)
                if power < 6
                else Row(f"{what} / 10 s", max(lasers_s), 10.0, at_most=1.0)
            )
            if power == 5:
                place_m = np.broadcast_to(lasers_m[1], roofs_m.shape)
                own = np.arange(len(roofs_m))[:, None]
                begin = time.process_time()
                followed = _followed(obstacles, place_m, roofs_m, own)
                rows.append(Row(f"{what} / followed", lasers_s[1], time.process_time() - begin))
                found = crossed(obstacles, place_m, roofs_m, own)
                assert np.array_equal(found == CLEAR, followed == CLEAR)
        rows.append(Row(f"{name}, 10^6: legs from three places / 10 s", legs_s, 10.0))
    peak_MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    rows.append(Row("memory [MB] / 2000 MB", peak_MB, 2000.0, at_most=1.0))
    return rows


def _seconds(obstacles: Prisms, places_m: Iterable[tuple[float, ...]], roofs_m: Floats) -> float:
    """CPU time of the lines from places to all roofs [s]."""
    own, begin = np.arange(len(roofs_m))[:, None], time.process_time()
    for place_m in places_m:
        crossed(obstacles, np.broadcast_to(place_m, roofs_m.shape), roofs_m, own)
    return time.process_time() - begin
