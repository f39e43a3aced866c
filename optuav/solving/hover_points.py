"""Hover points all over the region where a UAV may hover, and the search for the best of them.

A turn of a leg costs time that has a cusp where the turn vanishes, charging stops where a building
hides the laser, and no leg may cross a building. So no derivatives are used: all routes are
evaluated at points all over the region, with the real geometry, and from the best of these points
ever smaller steps are tried.
"""

import math
import time
from dataclasses import replace

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.network.places import HOVER
from optuav.network.variants import Variants
from optuav.physics.quantity import TINY
from optuav.solving.best_plans import hover_times_s
from optuav.solving.maximise import AROUND, Lengths, Point, all_around, maximise
from optuav.solving.question import Question

AT_ONCE = 1 << 17
"""Itineraries that are evaluated together, in bounded memory. No result depends on it."""
WITHIN = 1.0 - 1e-12  # share of the coverage radius that is used, for rounding
SAMPLES = (60, 12, 4)  # angles, radii and heights of the points that are tried
NEAR, REACH = (7, 24, 9), 0.2
"""Distances, angles and slopes of the points around places; the largest distance as a share of the
coverage radius."""
PROMISING_S = 2.0  # starts that are worse than the best by more than this are left [s]
MOST_ROUTES, STARTS = 6, 2  # routes refined, and starts of each
APART = 0.1  # distance between such starts, as a share of the coverage radius
ALONG = 20  # Points of a round of steps on the way to each place before and after
LENGTHS_M = Lengths(first=20.0, rough=1.0, last=1e-7)


class Region:
    """Where a UAV may hover: a ball around the device, cut by the altitude band."""

    def __init__(self, mission: Mission) -> None:
        limits, device_m = mission.limits, np.array(mission.link.device_m)
        self.centre_m, self.radius_m = device_m, WITHIN * vehicle.coverage_radius_m(mission)
        # In the ball and in the band; low > high where there is no such altitude.
        self.low_m = max(limits.min_altitude_m, float(device_m[2]) - self.radius_m)
        self.high_m = min(limits.max_altitude_m, float(device_m[2]) + self.radius_m)

    def inside(self, points_m: Floats) -> Floats:
        """Points (…, 3) [m] moved into the region: up or down, then level to the device."""
        z = np.clip(points_m[..., 2:], self.low_m, self.high_m)
        way_m = points_m[..., :2] - self.centre_m[:2]
        share = self._level_m(z) / np.maximum(np.linalg.norm(way_m, axis=-1, keepdims=True), TINY)
        return np.concatenate([self.centre_m[:2] + np.minimum(1.0, share) * way_m, z], axis=-1)

    def spread(self) -> Floats:
        """Points (point, 3) [m] all over the region, its rim, floor and ceiling included."""
        φ = np.linspace(0.0, 2.0 * np.pi, SAMPLES[0], endpoint=False)
        share = np.sqrt(np.linspace(1.0, 0.0, SAMPLES[1], endpoint=False))
        z = np.linspace(self.low_m, self.high_m, SAMPLES[2])
        φ, share, z = (each.ravel() for each in np.meshgrid(φ, share, z))
        way_m = (share * self._level_m(z))[:, None] * np.column_stack([np.cos(φ), np.sin(φ)])
        return np.column_stack([self.centre_m[:2] + way_m, z])

    def near(self, place_m: Floats) -> Floats:
        """Points (point, 3) [m] around a place, ever closer, as far as they are in the region."""
        reach_m = REACH * self.radius_m * 0.5 ** np.arange(NEAR[0])
        angles = np.linspace(0.0, 2.0 * np.pi, NEAR[1], endpoint=False)
        slopes = np.linspace(-0.5 * np.pi, 0.5 * np.pi, NEAR[2])
        r, φ, θ = (each.ravel() for each in np.meshgrid(reach_m, angles, slopes))
        way_m = np.column_stack([np.cos(θ) * np.cos(φ), np.cos(θ) * np.sin(φ), np.sin(θ)])
        return self.kept(place_m + r[:, None] * way_m)

    def kept(self, points_m: Floats) -> Floats:
        """Those of some points (point, 3) [m] that are in the region, but for rounding."""
        known_m = points_m[np.isfinite(points_m).all(axis=1)]
        inside_m = self.inside(known_m)
        found: Floats = inside_m[np.abs(inside_m - known_m).max(axis=1, initial=0.0) < 1e-7]
        return found

    def _level_m(self, altitude_m: Floats) -> Floats:
        """Radius of the disc at an altitude [m]."""
        height_m = altitude_m - self.centre_m[2]
        return np.asarray(np.sqrt(np.maximum(self.radius_m**2 - height_m**2, 0.0)))


class PointSearch:
    """The search for the best hover point, with the battery charged at constant current."""

    def __init__(self, question: Question, mission: Mission) -> None:
        self.perspective, self.region = question.perspective, Region(mission)
        self.w_U_m = vehicle.hover_point_m(mission.replace({"route.hover_m": None}))
        # Any point is stated, as variants of the mission have others.
        anywhere_m = tuple(self.region.inside(self.region.centre_m).tolist())
        stated = {"route.hover_m": anywhere_m, "battery.charging": "constant"}
        self.network = build_network(mission.replace(stated))
        self.latest = time.monotonic() + (question.time_limit_s or math.inf)
        self.ended = False  # Whether the time limit ended it
        self.best = Point(-math.inf, 0, np.zeros(3))  # So far

    def best_m(self, routes: Integers) -> list[tuple[float, ...]]:
        """The best point found [m] over some routes; empty where none has a plan."""
        try:
            if starts := self._starts(routes):
                self.best = maximise(
                    starts, self._hovers_s, LENGTHS_M, self.region.inside, self._around_m
                )
        except TimeoutError:
            self.ended = True
        return [tuple(self.best.at.tolist())] if self.best.value >= 0.0 else []

    def _tried(
        self, network: Network, routes: Integers, points_m: Floats, least_s: float
    ) -> Floats:
        """Δ [s] at points by routes (point, route), as of `hover_times_s`; the best is kept."""
        if time.monotonic() > self.latest:
            raise TimeoutError
        columns = {f"route.hover_m[{axis}]": points_m[:, axis] for axis in range(3)}
        hover_s = hover_times_s(Variants(network, columns), self.perspective, least_s)
        point, route = divmod(int(hover_s.argmax()), len(routes))
        top = Point(float(hover_s[point, route]), int(routes[route]), points_m[point])
        self.best = max(self.best, top, key=lambda each: each.value)
        return hover_s

    def _starts(self, routes: Integers) -> list[Point]:
        """The points from which to refine: the best of every promising route, apart from others."""
        region, found = self.region, list[Point]()
        network = replace(self.network, routes=self.network.routes.take(routes))
        flown = network.routes.legs[network.routes.legs != NO_LEG]
        ends = np.union1d(network.legs.start[flown], network.legs.end[flown])
        places_m = np.vstack([self.w_U_m, network.places.position_m[ends[ends != HOVER]]])
        near_m = [region.near(place_m) for place_m in places_m]
        points_m = np.concatenate([region.kept(places_m), region.spread(), *near_m])
        # Of each portion, hovers that are promising beside the best so far.
        sampled, least_s, at_once = list[Floats](), 0.0, max(1, AT_ONCE // len(routes))
        for begin in range(0, len(points_m), at_once):
            portion_m = points_m[begin : begin + at_once]
            hover_s = self._tried(network, routes, portion_m, least_s)
            least_s = max(float(hover_s.max()) - PROMISING_S, least_s)
            point, route = np.nonzero(hover_s >= least_s)
            sampled.append(np.array([begin + point, route, hover_s[point, route]]))
        point, route, hover_s = np.concatenate(sampled, axis=1)
        best_s = np.full(len(routes), -np.inf)
        np.maximum.at(best_s, route.astype(np.intp), hover_s)
        for k in np.argsort(-best_s, kind="stable")[:MOST_ROUTES].tolist():
            near_m, left_s = points_m[point[route == k].astype(np.intp)], hover_s[route == k]
            for _ in range(STARTS):
                if left_s.max(initial=-np.inf) < least_s:
                    break
                start = int(left_s.argmax())
                found.append(Point(float(left_s[start]), int(routes[k]), near_m[start]))
                close = np.linalg.norm(near_m - near_m[start], axis=1) <= APART * region.radius_m
                left_s[close] = -np.inf
        return found

    def _hovers_s(self, route: int, points_m: Floats, least_s: float) -> Floats:
        """Δ [s] at points on one route, −∞ if it is shorter than the least of interest."""
        own = self.network.only(route)
        return self._tried(own, np.array([route]), points_m, max(least_s, 0.0))[:, 0]

    def _around_m(
        self, route: int, at_m: Floats, reach_m: float, random: np.random.Generator
    ) -> Floats:
        """Points (point, 3) [m] around one of a route, as `all_around`, and on its ridges."""
        # Hover times have ridges where a turn of a leg vanishes: lines through the place before or
        # after, in the plane of its x or its y without wind. A step that leaves a ridge loses, so
        # some steps keep to such lines and planes.
        network = self.network.only(route)
        hover_legs = (network.legs.start == HOVER) | (network.legs.end == HOVER)
        ends = network.legs.start[hover_legs] + network.legs.end[hover_legs] - HOVER
        around_m = network.places.position_m[ends]
        ways_m = at_m - around_m
        apart_m = np.linalg.norm(ways_m, axis=1)[:, None]
        steps_m = all_around(route, np.zeros(3), reach_m, random)
        steps_m[AROUND // 2 :] *= min(1.0, float(apart_m.min()) / reach_m)
        points_m = at_m + steps_m
        for number, place_m in enumerate(around_m):
            for axis in range(2):
                points_m[2 * number + axis :: 8, axis] = place_m[axis]
        share = np.minimum(reach_m / np.maximum(apart_m, LENGTHS_M.last), 1.0)
        share = share * random.normal(size=(2, ALONG))
        along_m = at_m + share[:, :, None] * ways_m[:, None]
        level_m = along_m.copy()
        level_m[..., 2] = at_m[2]
        return np.concatenate([points_m, *along_m, *level_m])
