"""Towns past which a device or a laser moves, against a loop of solves in the same process."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

import optuav
from benchmarks.timing import Row
from benchmarks.towns import slanting_town
from optuav.arrays import Floats
from optuav.mission import Mission

FOOTPRINT_M, APART_M, HEIGHT_M = 15.0, 40.0, 60.0
SMALL, TOWN, LARGE = 1_000, 3_000, 10_000
DEVICES, SITES = 20, 10
MOST = {TOWN: 0.35, LARGE: 0.8}
"""Most that a batch whose device moves may take, as a share of the loop."""
PLACED, POINT_S = 30.0, 0.035
"""CPU time that the largest siting, and a point of a map, may take [s]."""
GROWTH = 1.2
"""Largest exponent of the time in the number of buildings."""
SAME_S = 2e-6


def run() -> list[Row]:
    """A batch whose device moves, sites for a laser, maps of both, and how their times grow."""
    towns = {count: slanting_town(count, FOOTPRINT_M, APART_M) for count in (SMALL, TOWN, LARGE)}
    work: dict[str, tuple[Callable[[Mission], object], int]] = {
        "a device that moves": (lambda town: _batch(town, _devices_m(town, DEVICES)), DEVICES),
        "a site, 1 laser": (lambda town: _placed([town], _sites_m(town, SITES), 1), SITES),
        "a point, device moves": (lambda town: _map(town, "device"), 100),
        "a point, laser moves": (lambda town: _map(town, "laser"), 100),
    }
    rows, each_s = list[Row](), dict[tuple[str, int], float]()
    for what, (do, count) in work.items():
        do(towns[SMALL])
        for buildings, town in towns.items():
            each_s[what, buildings] = _seconds(lambda: do(town)) / count  # noqa: B023
        grown_s = each_s[what, SMALL] * (LARGE / SMALL) ** GROWTH
        title = f"{what}, {LARGE} buildings / {SMALL} × {LARGE // SMALL}^{GROWTH:g}"
        rows.append(Row(title, each_s[what, LARGE], grown_s, at_most=1.0))
    for buildings, most in MOST.items():
        loop_s = _loop_s(towns[buildings], "link.device_m", _devices_m(towns[buildings], DEVICES))
        title = f"a device that moves, {buildings} buildings / a solve"
        rows.append(Row(title, each_s["a device that moves", buildings], loop_s, at_most=most))
    loop_s = _loop_s(towns[LARGE], "laser.position_m", _sites_m(towns[LARGE], SITES))
    title = f"a site of {SITES}, 1 laser, {LARGE} buildings / a solve"
    rows.append(Row(title, each_s["a site, 1 laser", LARGE], loop_s, at_most=1.0))
    for over in ("device", "laser"):
        title = f"a point, {over} moves, {TOWN} buildings / {1e3 * POINT_S:g} ms"
        rows.append(Row(title, each_s[f"a point, {over} moves", TOWN], POINT_S, at_most=1.0))
    town = towns[TOWN]
    missions = [town.replace({"link.device_m": m.tolist()}) for m in _devices_m(town, 20)]
    placed_s = _seconds(lambda: _placed(missions, _sites_m(town, 40), 3))
    title = f"20 missions × 40 sites × 3 lasers, {TOWN} buildings / {PLACED:g} s"
    return [*rows, Row(title, placed_s, PLACED, at_most=1.0)]


def _devices_m(town: Mission, count: int) -> Floats:
    """Places of the device around its own (device, 3) [m]."""
    aside_m = np.random.default_rng(0).uniform(-200.0, 200.0, (count, 2))
    return np.array(town.device_m) + np.column_stack([aside_m, np.zeros(count)])


def _sites_m(town: Mission, count: int) -> Floats:
    """Sites of the laser (site, 3) [m], by the way of the drone."""
    x_m, y_m, _ = town.device_m
    aside_m = np.random.default_rng(1).uniform(-400.0, 400.0, (count, 2))
    return np.column_stack([aside_m + np.array([x_m, y_m - 500.0]), np.full(count, HEIGHT_M)])


def _batch(town: Mission, devices_m: Floats) -> Floats:
    """Hover times over places of the device [s]."""
    values = {f"link.device_m[{axis}]": devices_m[:, axis] for axis in (0, 1)}
    hover_s: Floats = optuav.batch_arrays(town, values, paired=True)["hover_time_s"]
    return hover_s


def _placed(missions: Sequence[Mission], sites_m: Floats, lasers: int) -> optuav.Siting:
    """The sites of lasers, refined."""
    return optuav.place_laser(missions, sites_m, lasers)


def _map(town: Mission, over: str) -> object:
    """A map of 100 points."""
    x_m, y_m, _ = town.device_m
    y_m -= 500.0 if over == "laser" else 0.0
    bounds = x_m - 450.0, y_m - 450.0, x_m + 450.0, y_m + 450.0
    height_m = HEIGHT_M if over == "laser" else None
    draw: Callable[..., object] = getattr(optuav.maps, over)
    return draw(town, 100.0, bounds=bounds, height_m=height_m)


def _loop_s(town: Mission, key: str, places_m: Floats) -> float:
    """CPU time of a solve [s] with something at each place; with the answers of the batch."""
    missions = [town.replace({key: place_m.tolist()}) for place_m in places_m]
    plans = list[optuav.Plan]()
    seconds = _seconds(lambda: plans.extend(map(optuav.solve, missions)))
    columns = {f"{key}[{axis}]": places_m[:, axis] for axis in range(3)}
    found_s = optuav.batch_arrays(town, columns, paired=True)["hover_time_s"]
    known_s = np.array([plan.hover_time_s if plan else np.nan for plan in plans])
    assert np.allclose(found_s, known_s, rtol=0.0, atol=SAME_S, equal_nan=True)
    return seconds / len(places_m)


def _seconds(work: Callable[[], object]) -> float:
    """CPU time of some work [s]."""
    begin = time.process_time()
    work()
    return time.process_time() - begin
