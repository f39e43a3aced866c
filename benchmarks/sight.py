"""Sight of all roofs of a city from one laser, the plan past its walls, and all legs to roofs."""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from unittest.mock import patch

import numpy as np

import optuav
from benchmarks.timing import Row
from benchmarks.towns import CROSS, SQUARE, slanting_town
from optuav.arrays import Booleans
from optuav.mission import Mission
from optuav.network import obstacles
from optuav.network.network import Network, build_network
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import Places, _kept_sight, build_places
from optuav.network.prisms import Prisms, prisms
from optuav.network.variants import as_variants
from optuav.solving.best_plans import hover_bounds_s
from optuav.solving.program import declared_program
from optuav.solving.question import checked_question

# Size of a footprint, side of the square that each has to itself [m], and the outline.
TOWNS = {
    "dense": (15.0, 30.0, SQUARE),
    "crosses": (30.0, 60.0, CROSS),
    "sparse": (5.0, 200.0, SQUARE),
}
LASERS_M = (50.0, 200.0)  # Heights, of which the slower counts
BEST = 10  # Roofs that are wanted


def run() -> list[Row]:
    """Towns of 10² to 10⁶; at 10⁵ against following every line, with equal verdicts.

    The best roofs of the smallest are those that plans for each of its buildings give.
    """
    rows = list[Row]()
    for name, shape in TOWNS.items():
        each_s = 0.0
        for power in range(2, 7):
            town = slanting_town(10**power, *shape)
            missions = [_lit(town, height_m) for height_m in LASERS_M]
            sights_s = [_seconds(partial(_places, each)) for each in missions]
            plans_s = [_seconds(partial(_planned, each)) for each in missions]
            sight_s, plan_s = max(sights_s), max(plans_s)
            each_s = sight_s / 10**power if power == 3 else each_s
            what = f"{name}, 10^{power}: sight"
            if power == 2:
                assert best_roofs(build_network(missions[-1])) == one_by_one(missions[-1])
            if 3 < power < 6:
                rows.append(Row(f"{what} of a roof / of 10^3", sight_s / 10**power, each_s))
            if power == 6:
                rows.append(Row(f"{what} / 10 s", sight_s, 10.0, at_most=1.0))
                rows.append(Row(f"{what} and plan / 20 s", plan_s, 20.0, at_most=1.0))
            if power == 5:
                again_s = _seconds(partial(build_places, missions[-1]))
                rows.append(Row(f"{what} again / anew", again_s, sight_s, at_least=5.0))
                rows.append(_against_following(what, missions[-1]))
    peak_MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    rows.append(Row("memory with the towns / 2 GB", peak_MB, 2000.0, at_most=1.0, unit="MB"))
    for name, shape in TOWNS.items():
        mission = _lit(slanting_town(10**6, *shape), LASERS_M[-1])
        sight_s = _seconds(partial(_places, mission))
        more_s = _seconds(partial(_best_of_all, mission)) - sight_s
        what = f"{name}, 10^6: legs from three places to all roofs, the best {BEST} / 10 s"
        rows.append(Row(what, more_s, 10.0, at_most=1.0))
    return rows


def best_roofs(network: Network) -> list[int]:
    """Numbers of the buildings by way of which a UAV hovers longest, the best first.

    Bounds on all routes tell which are worth to be solved: more, until no other may be better.
    """
    question, routes, size = checked_question(network.mission), network.routes, 2 * BEST
    bounds_s = hover_bounds_s(as_variants(network), question.perspective)[:, 0]
    order = np.argsort(-bounds_s[1:], kind="stable") + 1
    while True:
        some = np.sort(order[:size])
        program = declared_program(question, replace(network, routes=routes.take(some)))
        found_s = np.full(len(network.mission.buildings), -np.inf)
        for part, solution in zip(program.parts, program.answers(), strict=True):
            np.fmax.at(found_s, routes.building[some][part.routes], solution.objective)
        best = np.argsort(-found_s, kind="stable")[:BEST]
        if size >= len(order) or found_s[best[-1]] >= bounds_s[order[size]]:
            return [int(number) for number in best]
        size *= 4


def _best_of_all(mission: Mission) -> list[int]:
    """The best roofs of a mission, whose network is made anew."""
    return best_roofs(build_network.__wrapped__(mission))


def one_by_one(mission: Mission) -> list[int]:
    """The same buildings by a plan for each of them."""
    plans = [optuav.solve(mission, optuav.P4(name)) for name in mission.buildings.names]
    hovers_s = np.array([plan.hover_time_s if plan else -np.inf for plan in plans])
    return [int(number) for number in np.argsort(-hovers_s, kind="stable")[:BEST]]


def _lit(town: Mission, height_m: float) -> Mission:
    """A town with its laser at a height [m]."""
    x_m, y_m, _ = town.device_m
    return town.replace({"laser.position_m": (x_m - 100.0, y_m - 500.0, height_m)})


def _prisms(mission: Mission) -> Prisms:
    """The prisms of a mission, made anew."""
    prisms.cache_clear()
    return prisms(mission.buildings)


def _places(mission: Mission) -> Places:
    """The places of a mission, made anew."""
    _kept_sight.cache_clear()
    prisms.cache_clear()
    return build_places(mission)


def _planned(mission: Mission) -> None:
    """Solve a mission whose prisms, sight and network nobody has asked for."""
    _kept_sight.cache_clear()
    prisms.cache_clear()
    build_network.cache_clear()
    assert optuav.solve(mission)


def _against_following(what: str, mission: Mission) -> Row:
    """The lines of sight against the same ones followed over the map, with equal verdicts."""
    laser, roofs_m = mission.laser, mission.buildings.roof_m
    assert laser is not None
    place_m = np.broadcast_to(laser.position_m, roofs_m.shape)
    lines = _prisms(mission), place_m, roofs_m, np.arange(len(roofs_m))[:, None]
    found = list[Booleans]()
    ours_s = _seconds(lambda: found.append(crossed(*lines) == CLEAR))
    with patch.object(obstacles, "MANY", math.inf):
        followed_s = _seconds(lambda: found.append(crossed(*lines) == CLEAR))
    assert np.array_equal(found[0], found[1])
    return Row(f"{what} / followed", ours_s, followed_s)


def _seconds(work: Callable[[], object]) -> float:
    """CPU time of some work [s]."""
    begin = time.process_time()
    work()
    return time.process_time() - begin
