"""Sight of all roofs of a city from one laser, the legs to all of them, and the best ten."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable

import numpy as np

import optuav
from benchmarks.timing import Row
from benchmarks.towns import CROSS, SQUARE, slanting_town
from optuav.arrays import Integers
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.obstacles import CLEAR, _followed, crossed
from optuav.network.places import build_places
from optuav.network.prisms import prisms

# Size of a footprint, side of the square that each has to itself [m], and the outline.
TOWNS = {
    "dense": (15.0, 30.0, SQUARE),
    "crosses": (30.0, 60.0, CROSS),
    "sparse": (5.0, 200.0, SQUARE),
}
LASERS_M = (50.0, 200.0)


def run() -> list[Row]:
    """Towns of 10² to 10⁶; at 10⁵ against following every line, with equal verdicts."""
    rows = list[Row]()
    for name, shape in TOWNS.items():
        town = None
        for power in range(2, 7):
            town, network_s = slanting_town(10**power, *shape), 0.0
            x_m, y_m, _ = town.link.device_m
            for height_m in LASERS_M:
                mission = town.replace({"laser.position_m": (x_m - 100.0, y_m - 500.0, height_m)})
                prisms.cache_clear()
                sight_s = _seconds(lambda: build_places(mission, prisms(mission.buildings)))
                prisms.cache_clear()
                build_network.cache_clear()
                legs_s = _seconds(lambda: build_network(mission)) - sight_s
                ten_s = _seconds(lambda: best_ten(mission))
                print(name, power, height_m, round(sight_s, 4), round(legs_s, 4), round(ten_s, 4))
    return rows


def best_ten(mission: Mission) -> list[str]:
    """Names of the ten roofs that let the UAV hover longest if it rests there once."""
    program = optuav.formulate(mission)
    longest_s = np.full(1 + len(mission.buildings), -np.inf)  # The last is for no building
    for part, answers in zip(program.parts, program.answers(), strict=True):
        building = program.network.routes.building[part.routes]
        np.fmax.at(longest_s, building, answers.values["hover_time_s"])
    best = np.argsort(-longest_s[:-1], kind="stable")[:10]
    return [mission.buildings.names[each] for each in best]


def _seconds(work: Callable[[], object]) -> float:
    """CPU time of some work [s]."""
    begin = time.process_time()
    work()
    return time.process_time() - begin
