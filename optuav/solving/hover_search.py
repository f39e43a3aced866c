"""The search for the best hover point: many points over the region, the best of them refined.

A turn of a leg costs time that has a cusp where the turn vanishes, charging stops where a building
hides the laser, and no leg may cross a building. So no derivatives are used: all itineraries are
evaluated at points all over the region, with the real geometry, and from the best of these points
ever smaller steps are tried. Without wind, turns vanish where a coordinate of the hover point is
that of the place before or after, so steps to there are tried too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from formulations.free_hover import FreeHover
from formulations.p1 import P1
from formulations.parameters import QUANTITIES
from optuav.arrays import Booleans, Floats, Integers
from optuav.errors import SolverError
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import Network, nearest_building
from optuav.network.obstacles import CLEAR, crossed, prisms
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.options import Perspective
from optuav.physics.kibam import Stage
from optuav.physics.quantity import TINY
from optuav.solving.assemble import quantities
from optuav.solving.batch import delivered
from optuav.solving.question import Question

WITHIN = 1.0 - 1e-12
"""Share of the coverage radius that is used, for rounding."""
SAMPLES = (60, 12, 4)
"""Angles, radii and heights of the points that are tried."""
NEAR, REACH = (7, 24, 9), 0.2
"""Distances, angles and slopes of the points around places; the largest distance as a share of the
coverage radius."""
PROMISING_S = 2.0
"""Starts that are worse than the best by more than this are left [s]."""
MOST_ROUTES, MOST_STARTS, STARTS_OF_A_KIND = 6, 20, 2
"""Itineraries refined, starts in all, and starts of one itinerary in sight of the laser or not."""
APART = 0.1
"""Distance between such starts, as a share of the coverage radius."""
AROUND, FIRST_M, LAST_M, SHRINK = 100, 20.0, 1e-7, 0.5
"""Refinement: points a round, first and last length of steps [m], factor after a failure."""
CLOSE_S = 1e-3
"""Points that are worse than the best by more than this are left after refinement [s]."""


@dataclass(frozen=True)
class Region:
    """Where a UAV may hover: a ball around the device, cut by the altitude band.

    Parameters
    ----------
    centre_m, radius_m
        Device and d_max [m].
    low_m, high_m
        Least and largest altitude in the ball and in the band [m]; low > high where there is none.
    """

    centre_m: Floats
    radius_m: float
    low_m: float
    high_m: float

    @classmethod
    def of(cls, mission: Mission) -> Region:
        """The region of a mission."""
        radius_m, limits = WITHIN * vehicle.coverage_radius_m(mission), mission.limits
        device_m = np.array(mission.link.device_m)
        low_m = max(limits.min_altitude_m, float(device_m[2]) - radius_m)
        high_m = min(limits.max_altitude_m, float(device_m[2]) + radius_m)
        return cls(device_m, radius_m, low_m, high_m)

    def inside(self, points_m: Floats) -> Floats:
        """Points (…, 3) [m] moved into the region: up or down, then level to the device."""
        z = np.clip(points_m[..., 2:], self.low_m, self.high_m)
        way_m = points_m[..., :2] - self.centre_m[:2]
        share = self._level_m(z) / np.maximum(np.linalg.norm(way_m, axis=-1, keepdims=True), TINY)
        return np.concatenate([self.centre_m[:2] + np.minimum(1.0, share) * way_m, z], axis=-1)

    def spread(self, angles: int, radii: int, heights: int) -> Floats:
        """Points (point, 3) [m] all over the region, its rim, floor and ceiling included."""
        φ = np.linspace(0.0, 2.0 * np.pi, angles, endpoint=False)
        share = np.sqrt(np.linspace(1.0, 0.0, radii, endpoint=False))
        z = np.linspace(self.low_m, self.high_m, heights)
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
        points_m: Floats = place_m + r[:, None] * way_m
        return self.kept(points_m)

    def kept(self, points_m: Floats) -> Floats:
        """Those of some points (…, 3) [m] that are in the region, but for rounding."""
        known_m = points_m[np.isfinite(points_m).all(axis=1)]
        inside_m = self.inside(known_m)
        found: Floats = inside_m[np.abs(inside_m - known_m).max(axis=1, initial=0.0) < 1e-7]
        return found

    def _level_m(self, altitude_m: Floats) -> Floats:
        """Radius of the disc at an altitude [m]."""
        height_m = altitude_m - self.centre_m[2]
        level_m: Floats = np.sqrt(np.maximum(self.radius_m**2 - height_m**2, 0.0))
        return level_m


@dataclass(frozen=True)
class OpenRoutes:
    """Itineraries whose hover point is free: all direct, or all by way of a building in one order.

    Parameters
    ----------
    index
        Numbers of the itineraries.
    around
        (itinerary, 2): numbers of the places before and after the hover point.
    free
        Their quantities by hover point; arrays with one entry an itinerary.
    """

    index: Integers
    around: Integers
    free: FreeHover

    def times_s(
        self, perspective: Perspective, entry: Integers, points_m: Floats, lit: Booleans
    ) -> Mapping[str, Floats]:
        """Δ and T' [s] by name of itineraries (k,) at points (k, 3) [m]; NaN where none are.

        Buildings do not count; `lit` says where the laser charges.
        """
        at_points = replace(self._taken(entry), laser_sight=np.where(lit, 1.0, 0.0))
        given = at_points.at(tuple(points_m.T))
        if perspective == "available":
            return delivered(given, len(points_m))
        from optuav.engines import closed_form

        return closed_form.solve(P1().model(given, perspective), len(points_m)).values

    def _taken(self, entry: Integers) -> FreeHover:
        """The figures of some itineraries."""
        given = self.free.rest_of_route
        steps = (
            step if isinstance(step, str) else Stage(*(_taken(each, entry) for each in step))
            for step in given.steps
        )
        arrays = {
            each.name: value[entry]
            for each in QUANTITIES
            if np.ndim(value := getattr(given, each.name))
        }
        return replace(
            self.free,
            rest_of_route=replace(given, **arrays, steps=tuple(steps)),
            before_m=tuple(values[entry] for values in self.free.before_m),
            after_m=tuple(values[entry] for values in self.free.after_m),
        )


def _taken(figure: Any, entry: Integers) -> Any:
    """A figure of some itineraries: their own, or the one of all."""
    return figure[entry] if np.ndim(figure) else figure


def open_routes(question: Question, network: Network) -> tuple[OpenRoutes, ...]:
    """The itineraries that a question allows and some hover point may make flyable."""
    routes, table = network.routes, network.legs
    flown = routes.legs != NO_LEG
    to_hover = flown & (table.end[routes.legs] == HOVER)
    from_hover = flown & (table.start[routes.legs] == HOVER)
    apart = flown & ~to_hover & ~from_hover
    around = np.stack(
        [table.start[routes.legs[to_hover]], table.end[routes.legs[from_hover]]], axis=1
    )
    by_way = routes.building >= 0
    usable = np.where(apart, table.flyable[routes.legs], True).all(axis=1)
    if question.trajectory == "direct":
        usable &= ~by_way
    elif question.trajectory == "traj1":
        usable &= by_way & (routes.building == nearest_building(network))
    if question.order is not None:
        usable &= ~by_way | (routes.rest_first == (question.order == "rest-first"))
    groups = [usable & ~by_way, usable & by_way]
    if question.perspective == "available":  # the steps differ with the order of the stays
        groups[1:] = [groups[1] & routes.rest_first, groups[1] & ~routes.rest_first]
    return tuple(
        OpenRoutes(which, around[which], _opened(network, which, apart[which], around[which]))
        for which in map(np.flatnonzero, groups)
        if len(which)
    )


def _opened(network: Network, which: Integers, apart: Booleans, around: Integers) -> FreeHover:
    """The quantities of itineraries by hover point; `apart` marks legs that do not touch it."""
    mission, table = network.mission, network.legs
    legs = network.routes.legs[which]
    given = quantities(
        network,
        which,
        rests=bool(network.routes.building[which[0]] >= 0),
        hover_open=True,
    )
    totals = {
        f"flight_{figure}": np.where(apart, drawn[legs], 0.0).sum(axis=1)
        for figure, drawn in (
            ("time_s", table.duration_s),
            ("charge_As", table.charge_As),
            ("energy_J", table.energy_J),
        )
    }
    drawn_A = float(vehicle.hover_load(mission).current_A)
    before_m, after_m = (tuple(network.places.position_m[place].T) for place in around.T)
    return FreeHover(
        rest_of_route=replace(given, **totals, hover_current_A=drawn_A, hover_received_W=0.0),
        before_m=before_m,
        after_m=after_m,
        device_m=mission.link.device_m,
        laser_m=None if mission.laser is None else mission.laser.position_m,
        leg=lambda way_m: vehicle.leg_loads(mission, way_m)[0],
        charging=lambda distance_m: vehicle.charging(mission, distance_m),
    )


class Found(NamedTuple):
    """A hover point (3,) [m] of one of some itineraries, and the hover time Δ [s] there."""

    routes: OpenRoutes
    entry: int
    point_m: Floats
    hover_s: float


def best_points(
    groups: Sequence[OpenRoutes], question: Question, network: Network, region: Region
) -> list[Found]:
    """The best points found, the best first, with those that are nearly as good.

    The battery is taken to be charged at constant current.

    Parameters
    ----------
    groups
        Itineraries with their hover point free.
    question, network, region
        What is asked, the mission's network, and where the UAV may hover.

    Raises
    ------
    SolverError
        If the time limit passes.
    """
    evaluator = _Evaluator(question, network)
    constant = [_at_constant_current(each) for each in groups]
    refined = [_refined(each, evaluator, region) for each in _starts(constant, evaluator, region)]
    refined.sort(key=lambda each: -each.hover_s)
    return [each for each in refined if each.hover_s >= refined[0].hover_s - CLOSE_S]


def _at_constant_current(routes: OpenRoutes) -> OpenRoutes:
    given = replace(routes.free.rest_of_route, tapers=False)
    return replace(routes, free=replace(routes.free, rest_of_route=given))


class _Evaluator:
    """Hover times with buildings in the way, until the time limit passes."""

    def __init__(self, question: Question, network: Network) -> None:
        self.perspective, self.mission = question.perspective, network.mission
        self.places_m = network.places.position_m
        self.obstacles = prisms(network.mission)
        self.latest = time.monotonic() + (question.time_limit_s or math.inf)

    def hover_s(self, routes: OpenRoutes, entry: Integers, points_m: Floats) -> Floats:
        """Δ [s] of itineraries (r,) at points (k, 3) [m], shape (r, k); −∞ where none is."""
        if time.monotonic() > self.latest:
            raise SolverError("the search for a hover point did not end within the time limit")
        which, point = (each.ravel() for each in np.indices((len(entry), len(points_m))))
        lit = self.lit(points_m)
        times = routes.times_s(self.perspective, entry[which], points_m[point], lit[point])
        found = np.nan_to_num(times["hover_time_s"], nan=-np.inf).reshape(len(entry), -1)
        if not self.mission.flight.through_buildings:
            around = routes.around[entry]
            for place in np.unique(around).tolist():
                hidden = self._hidden(self.places_m[place], place, points_m)
                found[(around == place).any(axis=1)[:, None] & hidden] = -np.inf
        return found

    def lit(self, points_m: Floats) -> Booleans:
        """Whether points (k, 3) [m] are in sight of the laser."""
        if self.mission.laser is None:
            return np.zeros(len(points_m), bool)
        return ~self._hidden(np.array(self.mission.laser.position_m), -1, points_m)

    def _hidden(self, from_m: Floats, place: int, points_m: Floats) -> Booleans:
        """Whether a building other than that of the place is between it and each point (k, 3)."""
        own = np.full((len(points_m), 1), place - FIRST_BUILDING if place >= 0 else CLEAR)
        lines_m = np.broadcast_to(from_m, points_m.shape)
        hidden: Booleans = crossed(self.obstacles, lines_m, points_m, own) != CLEAR
        return hidden


def _starts(groups: Sequence[OpenRoutes], evaluator: _Evaluator, region: Region) -> list[Found]:
    """The points from which to refine, the best first."""
    w_U_m = vehicle.hover_point_m(evaluator.mission.replace({"route.hover_m": None}))
    known_m = region.kept(np.vstack([w_U_m, evaluator.places_m]))
    near_m = [region.near(place_m) for place_m in evaluator.places_m]
    points_m = np.concatenate([known_m, region.spread(*SAMPLES), *near_m])
    sampled = [
        (routes, evaluator.hover_s(routes, np.arange(len(routes.index)), points_m))
        for routes in groups
    ]
    least_s = max(float(hover_s.max()) for _, hover_s in sampled) - PROMISING_S
    promising = sorted(
        (-float(hover_s[entry].max()), number, entry)
        for number, (_, hover_s) in enumerate(sampled)
        for entry in range(len(hover_s))
        if hover_s[entry].max() > least_s
    )
    lit, found = evaluator.lit(points_m), list[Found]()
    for _, number, entry in promising[:MOST_ROUTES]:
        routes, hover_s = sampled[number]
        for in_sight in (True, False):
            usable = (lit == in_sight) & (hover_s[entry] > least_s)
            row_s = np.where(usable, hover_s[entry], -np.inf)
            for k in _apart(points_m, row_s, APART * region.radius_m):
                found.append(Found(routes, entry, points_m[k], float(row_s[k])))
    return sorted(found, key=lambda each: -each.hover_s)[:MOST_STARTS]


def _apart(points_m: Floats, hover_s: Floats, apart_m: float) -> Iterator[int]:
    """Numbers of the best few points that are apart from each other."""
    left_s = hover_s.copy()
    for _ in range(STARTS_OF_A_KIND):
        k = int(left_s.argmax())
        if not np.isfinite(left_s[k]):
            return
        yield k
        left_s[np.linalg.norm(points_m - points_m[k], axis=1) <= apart_m] = -np.inf


def _refined(found: Found, evaluator: _Evaluator, region: Region) -> Found:
    """The best point that ever smaller steps lead to, by a seeded random search."""
    random, reach_m, entry = np.random.default_rng(0), FIRST_M, np.array([found.entry])
    around_m = evaluator.places_m[found.routes.around[found.entry]]
    while reach_m > LAST_M:
        steps_m = reach_m * random.normal(size=(AROUND, 3))
        for axis in range(3):
            steps_m[axis::4, axis] = 0.0
        points_m = found.point_m + steps_m
        for number, place_m in enumerate(around_m):  # where turns may vanish
            for axis in range(2):
                points_m[2 * number + axis :: 8, axis] = place_m[axis]
        points_m = region.inside(points_m)
        hover_s = evaluator.hover_s(found.routes, entry, points_m)[0]
        top = int(hover_s.argmax())
        if hover_s[top] > found.hover_s:
            found = found._replace(point_m=points_m[top], hover_s=float(hover_s[top]))
        else:
            reach_m *= SHRINK
    return found
