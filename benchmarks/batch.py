"""Batches of scenarios against closed forms that are written by hand for these very columns."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

import optuav
from benchmarks.by_hand import ByHand
from benchmarks.timing import Row, interleaved_s
from optuav.arrays import Floats
from optuav.mission import Mission

COUNT, VARIED, REPEATS = 100_000, 20_000, 5
# What is fastest by hand, where two keys vary and where masses, winds and places do as well.
AT_ONCE = {"battery": 1500, "available": 400}
AT_ONCE_VARIED = 200
LIMITS = {"battery": 2.0, "energy": 2.0, "adjusted": 2.0, "available": 3.0}
LIMIT_VARIED = 4.0
SAME_S = 1e-6
TOWNS, FEW = 200, 20
LEAST_OF_TOWNS = {"battery": 4.0, "available": 2.0}
TOWN_DEADLINES = {"limits.deadline_s": [1200]}
LENGTHS = 10**3, 10**4, 10**5, 10**6, 10**7
MOST_MB, MOST_LINEAR = 500.0, 1.5
"""Memory beside the result, and how many times longer a scenario may take among 10⁷ than 10⁶."""
MOVING = (
    "body.mass_kg",
    "wind.force_N[0]",
    "wind.force_N[1]",
    "link.device_m[0]",
    "link.device_m[1]",
)


def run() -> list[Row]:
    """Deadlines and sizes of the shipped mission, 21 itineraries each; then flights as well."""
    mission = optuav.load("paper")
    # Without footprints nothing stands in the way, and the laser is in sight everywhere.
    plain = {"buildings": [each.model_dump(exclude={"footprint_m"}) for each in mission.buildings]}
    bare = mission.replace(plain)
    two, varied = columns(mission, COUNT), columns(mission, VARIED, *MOVING)
    rows = [
        against_hand(mission, two, name, "", AT_ONCE.get(name, AT_ONCE["battery"]), limit)
        for name, limit in LIMITS.items()
    ]
    rows += [
        against_hand(bare, varied, name, ", flights vary", AT_ONCE_VARIED, LIMIT_VARIED)
        for name in AT_ONCE
    ]
    pair = interleaved_s(
        lambda: solved(bare, varied, "battery"), lambda: solved(mission, varied, "battery"), REPEATS
    )
    title = "a scenario, battery, flights vary: without / with footprints and sight"
    flights = Row(title, pair[0] / VARIED, pair[1] / VARIED)
    return [*rows, flights, *towns(mission), *lengths()]


def towns(mission: Mission) -> list[Row]:
    """Many random towns, each with its own legs and walls, against a loop of solves."""
    drawn, rows = optuav.layouts(mission, TOWNS, "uniform", buildings=10, seed=1), list[Row]()
    for name in AT_ONCE:

        def ours(perspective: Any = name) -> object:
            return optuav.batch_arrays(drawn, TOWN_DEADLINES, perspective=perspective)

        def loop(perspective: Any = name) -> object:
            return [optuav.solve(town, perspective=perspective) for town in drawn[:FEW]]

        ours_s, loop_s = interleaved_s(ours, loop, 3)
        title, least = (
            f"one of {TOWNS} random towns, {name} / solved by itself",
            LEAST_OF_TOWNS[name],
        )
        rows.append(Row(title, ours_s / TOWNS, loop_s / FEW, at_least=least))
    return rows


def columns(mission: Mission, count: int, *moving: str) -> dict[str, Floats]:
    """Drawn deadlines and sizes, and on demand masses, winds and places of the device."""
    draw, (x, y, _) = np.random.default_rng(0), mission.device_m
    found = {
        "limits.deadline_s": draw.uniform(600.0, 3000.0, count),
        "battery.capacity_As": draw.uniform(30e3, 45e3, count),
        "body.mass_kg": draw.uniform(1.2, 1.4, count),
        "wind.force_N[0]": draw.uniform(-2.0, 2.0, count),
        "wind.force_N[1]": draw.uniform(-1.0, 1.0, count),
        "link.device_m[0]": x + draw.uniform(-400.0, 400.0, count),
        "link.device_m[1]": y + draw.uniform(-300.0, 300.0, count),
    }
    return {key: found[key] for key in ("limits.deadline_s", "battery.capacity_As", *moving)}


def solved(mission: Mission, values: dict[str, Floats], perspective: Any) -> Floats:
    """Our hover times [s]."""
    found = optuav.batch_arrays(mission, values, perspective=perspective, paired=True)
    hover_s: Floats = found["hover_time_s"]
    return hover_s


def against_hand(
    mission: Mission, values: dict[str, Floats], name: str, what: str, at_once: int, limit: float
) -> Row:
    """A scenario in a perspective; energy and adjusted against the closed form of battery."""
    hand, count = ByHand(mission), len(values["limits.deadline_s"])
    kind = "available" if name == "available" else "battery"

    def other() -> Floats:
        parts = []
        for first in range(0, count, at_once):
            deadline_s, capacity_As, *moving = (
                column[first : first + at_once] for column in values.values()
            )
            flights = hand.flown(*moving, wells=kind == "available") if moving else hand.fixed
            parts.append(getattr(hand, kind)(deadline_s, capacity_As, flights))
        return np.concatenate(parts)

    if name == kind:
        apart_s = np.abs(solved(mission, values, name) - other()).max()
        assert apart_s < SAME_S, f"by hand, {name}{what} differs by {apart_s:g} s"
    ours_s, hand_s = interleaved_s(lambda: solved(mission, values, name), other, REPEATS)
    title = f"a scenario, {name}{what} / NumPy by hand, {kind}"
    return Row(title, ours_s / count, hand_s / count, at_most=limit)


def lengths() -> list[Row]:
    """Time a scenario and memory beside the result, each number in a process of its own."""
    found = dict[int, tuple[float, float]]()
    for count in LENGTHS:
        command = [sys.executable, "-c", f"import benchmarks.batch as b; b.one_length({count})"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        seconds, beside_MB = map(float, done.stdout.split())
        assert beside_MB < MOST_MB, f"{count} scenarios take {beside_MB:.0f} MB beside the result"
        found[count] = seconds, beside_MB
    rows, (fewer_s, _) = list[Row](), found[LENGTHS[-2]]
    for count, (seconds, beside_MB) in found.items():
        title = f"a scenario among {count:.0e}, battery ({beside_MB:.0f} MB beside) / among 1e6"
        limit = MOST_LINEAR if count == LENGTHS[-1] else None
        rows.append(Row(title, seconds, fewer_s, None, limit))
    return rows


def one_length(count: int) -> None:
    """Print the time of a scenario [s], and the most memory beside the result [MB]."""
    import time

    mission = optuav.load("paper")
    values, least_s = columns(mission, count), np.inf
    before_MB = memory_MB("VmRSS")
    for _ in range(REPEATS if count < LENGTHS[-1] else 1):
        begin, found = time.process_time(), dict[str, Any]()
        found = optuav.batch_arrays(mission, values, perspective="battery", paired=True)
        least_s = min(least_s, time.process_time() - begin)
    result_MB = sum(each.nbytes for each in found.values()) / 1e6
    most_MB = memory_MB("VmHWM") - before_MB
    print(least_s / count, most_MB - result_MB)


def memory_MB(name: str) -> float:
    """Memory of this process: VmRSS now, VmHWM the most since it began."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    (line,) = (each for each in lines if each.startswith(f"{name}:"))
    return int(line.split()[1]) * 1.024e-3
