"""Where the search for the best hover point starts: the best of points all over the region."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.solving.hover_region import Region
from optuav.solving.hover_times import Found, HoverTimes
from optuav.solving.open_routes import OpenRoutes
from optuav.solving.vanishing_turns import WITHIN_M, surfaces

SAMPLES = (60, 12, 4)
"""Angles, radii and heights of the points that are tried."""
NEAR, REACH = (7, 24, 9), 0.2
"""Distances, angles and slopes of the points that are tried around places; the largest distance as
a share of the coverage radius."""
PROMISING_S = 2.0
"""Routes and starts that are worse than the best by more than this lead nowhere [s]."""
MOST_ROUTES, MOST_STARTS, STARTS_OF_A_KIND, MOST_MOVED = 6, 20, 2, 60
"""Routes looked at closely, starts in all and of one itinerary lit or not, and points moved to
where a turn vanishes."""
APART = 0.1
"""Distance of such starts from each other, as a share of the coverage radius."""


def starts(groups: tuple[OpenRoutes, ...], times: HoverTimes) -> list[Found]:
    """Points from which the best may be reached, the best first."""
    where = times.where
    around_m = [_near(place_m, where) for place_m in times.places_m]
    known_m = _known(times.mission, times.places_m, where)
    points_m = np.concatenate([known_m, where.spread(*SAMPLES), *around_m])
    sampled = [
        (routes, times.at(routes, np.arange(len(routes.index)), points_m)) for routes in groups
    ]
    top_s = max(float(hover_s.max()) for _, hover_s in sampled) - PROMISING_S
    promising = sorted(
        (-float(hover_s[entry].max()), number, entry)
        for number, (_, hover_s) in enumerate(sampled)
        for entry in range(len(hover_s))
        if hover_s[entry].max() > top_s
    )
    found: list[Found] = []
    for _, number, entry in promising[:MOST_ROUTES]:
        routes, hover_s = sampled[number]
        found += _apart(times, routes, entry, (), points_m, hover_s[entry])
        best_m = points_m[np.argsort(-hover_s[entry])[:MOST_MOVED]]
        for turn, on_m in surfaces(routes, entry, where, best_m):
            on_s = times.at(routes, np.array([entry]), on_m)[0]
            found += _apart(times, routes, entry, (turn,), on_m, on_s)
    promise = [each for each in found if each.hover_s > top_s]
    return sorted(promise, key=lambda each: -each.hover_s)[:MOST_STARTS]


def _known(mission: Mission, places_m: Floats, where: Region) -> Floats:
    """w_U and the places of the mission (k, 3) [m], as far as they are in the region."""
    w_U_m = vehicle.hover_point_m(mission.replace({"route.hover_m": None}))
    points_m = np.vstack([w_U_m, places_m])
    points_m = points_m[np.isfinite(points_m).all(axis=1)]
    inside_m = where.inside(points_m)
    kept: Floats = inside_m[np.abs(inside_m - points_m).max(axis=1) < WITHIN_M]
    return kept


def _near(place_m: Floats, where: Region) -> Floats:
    """Points of the region (k, 3) [m] around a place, ever closer: short legs save most."""
    reach_m = REACH * where.radius_m * 0.5 ** np.arange(NEAR[0])
    angles = np.linspace(0.0, 2.0 * np.pi, NEAR[1], endpoint=False)
    slopes = np.linspace(-0.5 * np.pi, 0.5 * np.pi, NEAR[2])
    r, φ, θ = (each.ravel() for each in np.meshgrid(reach_m, angles, slopes))
    way_m = np.column_stack([np.cos(θ) * np.cos(φ), np.cos(θ) * np.sin(φ), np.sin(θ)])
    points_m: Floats = place_m + r[:, None] * way_m
    return points_m[(where.beyond_m(points_m) <= 0.0).all(axis=1)]


def _apart(
    times: HoverTimes,
    routes: OpenRoutes,
    entry: int,
    straight: tuple[int, ...],
    points_m: Floats,
    hover_s: Floats,
) -> Iterator[Found]:
    """The best of some points in sight of the laser and of those out of sight, a few each."""
    lit = times.lit(points_m)
    for sight_is in (True, False):
        chosen: list[Floats] = []
        for k in np.argsort(-hover_s, kind="stable"):
            if lit[k] != sight_is or not np.isfinite(hover_s[k]):
                continue
            away_m = [float(np.linalg.norm(points_m[k] - each)) for each in chosen]
            if min(away_m, default=math.inf) > APART * times.where.radius_m:
                chosen.append(points_m[k])
                yield Found(routes, entry, straight, points_m[k], float(hover_s[k]))
            if len(chosen) == STARTS_OF_A_KIND:
                break
