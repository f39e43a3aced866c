"""Two workers of a cluster against one process, on a study in parts that are written."""

from __future__ import annotations

import os
import time
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

import optuav
from benchmarks.timing import Row
from optuav.studies.cluster import local_cluster

STUDY = """
output = "{name}"
scenarios_per_part = 20_000
[samples]
count = {samples}
limits.deadline_s = {{ low = 600, high = 3000 }}
battery.capacity_As = {{ percent = 20 }}
"""
SAMPLES, REPEATS = 400_000, 3
FASTER = 1.8
"""How many times faster two workers shall be on two idle cores."""
IDLE, WAIT_S = 0.5, 3.0


def run() -> list[Row]:
    """Wall time, which others on the machine bear upon, and what follows from CPU time.

    Two idle cores, of which a cluster that waits takes a share, do the work of all processes in
    work / (2 - share). Others bear upon this too, by the caches: there is no limit beside them.
    """
    names, load = count(), os.getloadavg()[0]
    with TemporaryDirectory() as folder, local_cluster(2) as local:

        def swept(samples: int, scheduler: str | None) -> tuple[float, float]:
            file = Path(folder) / f"{next(names)}.toml"
            file.write_text(STUDY.format(name=file.stem, samples=samples))
            cpu_s, wall_s = _cpu_s(), time.perf_counter()
            optuav.sweep(file, scheduler=scheduler)
            wall_s, cpu_s = time.perf_counter() - wall_s, _cpu_s() - cpu_s
            return wall_s, (cpu_s - share * wall_s) / (1.0 if scheduler is None else 2.0 - share)

        share = 0.0
        for scheduler in (None, local.scheduler_address):
            swept(100_000, scheduler)  # All is imported
        waiting_s = _cpu_s()
        time.sleep(WAIT_S)
        share = (_cpu_s() - waiting_s) / WAIT_S
        pairs = [
            [swept(SAMPLES, scheduler) for scheduler in (local.scheduler_address, None)]
            for _ in range(REPEATS)
        ]
    two, one = (
        [min(each) for each in zip(*side, strict=True)] for side in zip(*pairs, strict=True)
    )
    words = f"two workers / one process, wall time, {load:.1f} others at work"
    limit, judged = (FASTER, "") if load < IDLE else (None, ": not judged")
    return [
        Row(f"{words}{judged}", two[0], one[0], limit),
        Row(f"the same by CPU time{judged}", two[1], one[1], limit),
    ]


def _cpu_s() -> float:
    """CPU time of this process and its children [s]."""
    own = psutil.Process()
    times = [each.cpu_times() for each in (own, *own.children(recursive=True))]
    return float(sum(each.user + each.system for each in times))
