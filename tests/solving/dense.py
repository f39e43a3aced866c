"""Hover points tried all over the coverage ball: the truth that a free hover point is held against.

Written apart from the package's own search: hover times from the balance of charge and time solved
by hand or, where the battery has to deliver it, from wells of the tests' own; sights and crossings
from where every line enters and leaves a box.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from optuav.flight.rotors import Rotors
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics.flight import Loads
from tests.kibam import Kibam

Array = npt.NDArray[np.float64]
GRAZING = 1e-9
"""Share of a line that runs inside a building where it only touches it."""


def hidden(mission: Mission, from_m: Array, to_m: Array, exempt: str = "") -> npt.NDArray[np.bool_]:
    """Whether a building (with a footprint [width, depth]) stands between a point and others."""
    found = np.zeros(len(to_m), bool)
    way_m = to_m - from_m
    for building in mission.buildings:
        if building.name == exempt or building.footprint_m is None:
            continue
        (x, y, roof), (width, depth) = building.position_m, building.footprint_m
        enter, leave = np.zeros(len(to_m)), np.ones(len(to_m))
        slabs = ((x - width / 2, x + width / 2), (y - depth / 2, y + depth / 2), (-np.inf, roof))
        for axis, (low, high) in enumerate(slabs):
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = (np.array([[low], [high]]) - from_m[axis]) / way_m[:, axis]
            level = way_m[:, axis] == 0.0
            outside = level & ~((low < from_m[axis]) & (from_m[axis] < high))
            enter = np.where(level, enter, np.maximum(enter, ends.min(axis=0)))
            leave = np.where(level, leave, np.minimum(leave, ends.max(axis=0)))
            leave[outside] = -1.0
        found |= leave - enter > GRAZING
    return found


def leg(mission: Mission, start_m: Array, end_m: Array) -> Loads:
    """What legs draw; either end may be an array (point, 3) [m]."""
    x, y, z = np.moveaxis(end_m - start_m, -1, 0)
    return Rotors.of(mission).six_stage_leg((x, y, z)).loads


class Way(NamedTuple):
    """An itinerary at hover points (point, 3): its legs, and net currents [A] of the stays."""

    legs: list[Loads]
    hover_A: Array
    charge_A: float
    blocked: npt.NDArray[np.bool_]


def way(mission: Mission, points_m: Array, building: int, rest_first: bool) -> Way:
    """By way of a building, −1 for none."""
    assert mission.laser is not None
    laser_m = np.array(mission.laser.position_m)
    origin_m, end_m = np.array(mission.route.origin_m), np.array(mission.route.destination_m)
    stops = [("", origin_m), ("hover", points_m), ("", end_m)]
    charge_A = 0.0
    if building >= 0:
        roof = mission.buildings[building]
        roof_m = np.array(roof.position_m)
        stops.insert(1 if rest_first else 2, (roof.name, roof_m))
        if not hidden(mission, laser_m, roof_m[None], roof.name)[0]:
            charge_A = float(vehicle.charging(mission, tuple(roof_m)).current_A)
    legs, blocked = [], np.zeros(len(points_m), bool)
    for (name, start_m), (to, stop_m) in itertools.pairwise(stops):
        legs.append(leg(mission, start_m, stop_m))
        if not mission.flight.through_buildings:
            fixed_m, other_m = (start_m, stop_m) if start_m.ndim == 1 else (stop_m, start_m)
            roofs = name if name not in ("", "hover") else to if to not in ("", "hover") else ""
            blocked |= hidden(mission, fixed_m, np.atleast_2d(other_m), roofs)
    lit = ~hidden(mission, laser_m, points_m)
    net_A = vehicle.hover_load(mission).current_A - np.where(
        lit, vehicle.charging(mission, tuple(points_m.T)).current_A, 0.0
    )
    return Way(legs, net_A, charge_A, blocked)


def hover_s(mission: Mission, points_m: Array, building: int, rest_first: bool) -> Array:
    """Longest hover at points (point, 3) [m] by the balance of charge; −∞ where none."""
    legs, net_A, charge_A, blocked = way(mission, points_m, building, rest_first)
    given = mission.battery
    left_s = mission.limits.deadline_s - sum(np.asarray(each.duration_s) for each in legs)
    drawn_As = sum(np.asarray(each.charge_As) for each in legs)
    budget_As = (1.0 - mission.limits.min_soc) * given.packs * given.capacity_As - drawn_As
    found = np.minimum(left_s, budget_As / net_A)
    if building >= 0 and charge_A > 0.0:
        # All time that is left goes into hovering and resting: I Δ − c (t − Δ) = Q.
        found = np.minimum(left_s, (budget_As + charge_A * left_s) / (net_A + charge_A))
        rest_s = np.maximum(0.0, (net_A * found - budget_As) / charge_A)
        found = np.where(found + rest_s <= left_s + 1e-9, found, -np.inf)
    return np.where(blocked | (found < 0.0) | np.isnan(found), -np.inf, found)


def delivered_s(mission: Mission, points_m: Array, building: int, rest_first: bool) -> Array:
    """Longest hover at points (point, 3) [m] that the wells deliver; −∞ where none.

    Found by halving, where resting charges and hovering drains fast: then every shorter hover can
    be delivered, and the longest rest until the available well is full is best.
    """
    legs, net_A, charge_A, blocked = way(mission, points_m, building, rest_first)
    given = mission.battery
    left_s = mission.limits.deadline_s - sum(np.asarray(each.duration_s) for each in legs)

    def lasts(hover_s: Array) -> npt.NDArray[np.bool_]:
        wells = Kibam(
            given.packs * given.capacity_As, given.available_fraction, given.flow_rate_per_s
        )
        for number, loads in enumerate(legs):
            for current_A, time_s in zip(loads.currents_A, loads.durations_s, strict=True):
                wells.spend(-np.asarray(current_A), time_s)
            rests = building >= 0 and number == (0 if rest_first else 1)
            if rests:
                rest(wells, charge_A, left_s - hover_s)
            elif number < len(legs) - 1:
                wells.spend(-net_A, hover_s)
        return (wells.least >= 0.0) & (wells.soc >= mission.limits.min_soc) & (hover_s <= left_s)

    low, high = np.zeros(len(points_m)), np.maximum(left_s, 0.0)
    possible = lasts(low) & ~blocked
    for _ in range(32):
        middle = 0.5 * (low + high)
        fine = lasts(middle)
        low, high = np.where(fine, middle, low), np.where(fine, high, middle)
    return np.where(possible, low, -np.inf)


def rest(wells: Kibam, charge_A: float, longest_s: Array) -> None:
    """Charge as long as there is time and the available well is not past full."""
    full_As = wells.share * wells.capacity_As
    low, high = np.zeros(len(longest_s)), np.maximum(longest_s, 0.0)
    for _ in range(32):
        middle = 0.5 * (low + high)
        trial = copy.copy(wells)
        trial.spend(charge_A, middle)
        low, high = (
            np.where(trial.y1 <= full_As, middle, low),
            np.where(trial.y1 <= full_As, high, middle),
        )
    wells.spend(charge_A, low)


def spread(mission: Mission, fineness: int = 61, heights: int = 5) -> Array:
    """A grid over the ball and the altitude band, and rings on its rim."""
    radius_m, centre_m = vehicle.coverage_radius_m(mission), np.array(mission.link.device_m)
    z = np.linspace(mission.limits.min_altitude_m, mission.limits.max_altitude_m, heights)
    across = np.linspace(-radius_m, radius_m, fineness)
    grid = np.stack(np.meshgrid(across, across, z, indexing="ij"), axis=-1).reshape(-1, 3)
    grid[:, :2] += centre_m[:2]
    φ = np.linspace(0.0, 2.0 * np.pi, 6 * fineness)
    rings = []
    for height in z:
        level_m = np.sqrt(max(0.0, radius_m**2 - (height - centre_m[2]) ** 2))
        x, y = centre_m[0] + level_m * np.cos(φ), centre_m[1] + level_m * np.sin(φ)
        rings.append(np.column_stack([x, y, np.full(len(φ), height)]))
    points_m = np.concatenate([grid, *rings])
    return points_m[np.linalg.norm(points_m - centre_m, axis=1) <= radius_m * (1 + 1e-12)]


def closely(
    mission: Mission, value: Callable[[Array], Array], start_m: Array, rounds: int = 60
) -> float:
    """Best value of random points ever closer around a start."""
    random, reach_m = np.random.default_rng(1), 25.0
    radius_m, centre_m = vehicle.coverage_radius_m(mission), np.array(mission.link.device_m)
    low_m, high_m = mission.limits.min_altitude_m, mission.limits.max_altitude_m
    best_m, best = start_m, float(value(start_m[None])[0])
    for _ in range(rounds):
        step_m = random.normal(0.0, reach_m, (120, 3)) * (random.random((120, 3)) < 0.7)
        points_m = best_m + step_m
        points_m[:, 2] = np.clip(points_m[:, 2], low_m, high_m)
        level_m = np.sqrt(np.maximum(0.0, radius_m**2 - (points_m[:, 2] - centre_m[2]) ** 2))
        way_m = points_m[:, :2] - centre_m[:2]
        share = np.minimum(1.0, level_m / np.maximum(np.linalg.norm(way_m, axis=1), 1e-9))
        points_m[:, :2] = centre_m[:2] + share[:, None] * way_m
        found = value(points_m)
        if found.max() > best:
            best_m, best = points_m[found.argmax()], float(found.max())
        else:
            reach_m *= 0.75
    return best


def best_s(
    mission: Mission,
    fineness: int = 61,
    close: int = 3,
    hover_s: Callable[[Mission, Array, int, bool], Array] = hover_s,
) -> float:
    """Longest hover over all itineraries and all of the ball; −∞ if there is none."""
    points_m, top = spread(mission, fineness), -np.inf
    ways = [(-1, True)]
    ways += [(k, first) for k in range(len(mission.buildings)) for first in (True, False)]
    sampled = [hover_s(mission, points_m, *each) for each in ways]
    reached = max(each.max() for each in sampled)
    for each, values in zip(ways, sampled, strict=True):
        for k in np.argsort(-values)[: 10 * close : 10]:
            if values[k] > reached - 1.5:
                found = closely(
                    mission, lambda w, each=each: hover_s(mission, w, *each), points_m[k]
                )
                top = max(top, found)
    return float(max(top, reached))
