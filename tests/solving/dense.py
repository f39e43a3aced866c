"""Hover points tried all over the coverage ball: the truth that a free hover point is held against.

Written apart from the package's own search: hover times from the balance of charge and time solved
by hand, sights and crossings from where every line enters and leaves a box.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from optuav.mission import Mission, vehicle
from optuav.physics import flight

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


def leg(mission: Mission, start_m: Array, end_m: Array) -> tuple[Array, Array]:
    """Time [s] and charge [A s] of legs; either end may be an array (point, 3) [m]."""
    x, y, z = np.moveaxis(end_m - start_m, -1, 0)
    loads = flight.leg(
        vehicle.airframe(mission), vehicle.motor(mission), (x, y, z), mission.wind.force_N
    ).loads
    return np.asarray(loads.duration_s), np.asarray(loads.charge_As)


def hover_s(mission: Mission, points_m: Array, building: int, rest_first: bool) -> Array:
    """Longest hover at points (point, 3) [m], resting on a building (−1: none); −∞ where none."""
    given, laser_m = mission.battery, np.array(mission.laser.position_m)
    origin_m, end_m = np.array(mission.route.origin_m), np.array(mission.route.destination_m)
    stops = [("", origin_m), ("hover", points_m), ("", end_m)]
    charge_A = 0.0
    if building >= 0:
        roof = mission.buildings[building]
        roof_m = np.array(roof.position_m)
        stops.insert(1 if rest_first else 2, (roof.name, roof_m))
        if not hidden(mission, laser_m, roof_m[None], roof.name)[0]:
            charge_A = float(
                vehicle.charging(mission, float(np.linalg.norm(roof_m - laser_m))).current_A
            )
    time_s, drawn_As, blocked = 0.0, 0.0, np.zeros(len(points_m), bool)
    for (name, start_m), (to, stop_m) in itertools.pairwise(stops):
        leg_s, leg_As = leg(mission, start_m, stop_m)
        time_s, drawn_As = time_s + leg_s, drawn_As + leg_As
        if not mission.flight.through_buildings:
            fixed_m, other_m = (start_m, stop_m) if start_m.ndim == 1 else (stop_m, start_m)
            roofs = name if name not in ("", "hover") else to if to not in ("", "hover") else ""
            blocked |= hidden(mission, fixed_m, np.atleast_2d(other_m), roofs)
    lit = ~hidden(mission, laser_m, points_m)
    distance_m = np.linalg.norm(points_m - laser_m, axis=1)
    net_A = vehicle.hover_load(mission).current_A - np.where(
        lit, vehicle.charging(mission, distance_m).current_A, 0.0
    )
    left_s = mission.limits.deadline_s - time_s
    budget_As = (1.0 - mission.limits.min_soc) * given.packs * given.capacity_As - drawn_As
    found = np.minimum(left_s, budget_As / net_A)
    if building >= 0 and charge_A > 0.0:
        # All time that is left goes into hovering and resting: I Δ − c (t − Δ) = Q.
        found = np.minimum(left_s, (budget_As + charge_A * left_s) / (net_A + charge_A))
        rest_s = np.maximum(0.0, (net_A * found - budget_As) / charge_A)
        found = np.where(found + rest_s <= left_s + 1e-9, found, -np.inf)
    return np.where(blocked | (found < 0.0) | np.isnan(found), -np.inf, found)


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


def best_s(mission: Mission, fineness: int = 61, close: int = 3) -> float:
    """Longest hover over all itineraries and all of the ball; −∞ if there is none."""
    points_m, top = spread(mission, fineness), -np.inf
    ways = [(-1, True)]
    ways += [(k, first) for k in range(len(mission.buildings)) for first in (True, False)]
    sampled = [hover_s(mission, points_m, *way) for way in ways]
    reached = max(each.max() for each in sampled)
    for way, values in zip(ways, sampled, strict=True):
        for k in np.argsort(-values)[: 10 * close : 10]:
            if values[k] > reached - 1.5:
                top = max(
                    top, closely(mission, lambda w, way=way: hover_s(mission, w, *way), points_m[k])
                )
    return float(max(top, reached))
