"""The search for the best hover point: samples, IPOPT cell by cell, and a close search.

A turn of a leg costs time that has a cusp where the turn vanishes, the charging jumps where a
building hides the laser, and no leg may cross a building. So the hover times of all itineraries are
tried all over the region, and on the surfaces on which a turn vanishes, with the real geometry.
From the best of these points IPOPT solves `P1Free` in the cell around them: the same turns vanish,
and what is in sight stays in sight. At the end, points ever closer around the best are tried.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from formulations.p1_free import AXES, HOVER_POINT, Cell, Side
from optuav.engines.arrays import Booleans, Floats
from optuav.errors import SolverError
from optuav.mission import sight, vehicle
from optuav.mission.clearance import clear_sides
from optuav.mission.network import Network
from optuav.mission.places import FIRST_BUILDING
from optuav.mission.sight import CLEAR, Numbers, Points, crossed, prisms
from optuav.modelling import Parameter
from optuav.physics.quantity import TINY
from optuav.solving.hover_region import Region
from optuav.solving.open_routes import OpenRoutes
from optuav.solving.question import Question

SAMPLES = (60, 12, 4)
"""Angles, radii and heights of the points that are tried."""
PROMISING_S = 2.0
"""Itineraries and starts that are worse than the best by more than this lead nowhere [s]."""
MOST_ROUTES, MOST_STARTS, STARTS_A_CELL, MOST_MOVED, MOST_JUDGED = 6, 20, 2, 60, 6
"""Itineraries looked at closely, starts of IPOPT, and in a cell, points moved to where a turn
vanishes, and points found that are judged."""
APART = 0.1
"""Distance of the starts in a cell from each other, as a share of the coverage radius."""
CELL, MOST_CELLS = 0.2, 8
"""How far a cell reaches from its start, as a share of the coverage radius; cells in a row."""
CELL_OF_LEG, LEAST_M = 0.5, 0.5
"""How far it reaches at most, as a share of the shorter leg, and at least [m]."""
NEAR = (7, 24, 9)
"""Distances, angles and slopes of the points that are tried around places."""
AROUND, FIRST_M, LAST_M, SHRINK = 100, 5.0, 1e-6, 0.5
"""Close search: points a round, how far they reach first and last [m], and after a failure."""
MOST_SIDES = 6
"""Planes that cut a cell."""
EVERYWHERE = Side((0.0, 0.0, 0.0), -1.0)
LASER = -1
"""In place of the number of a place."""
STEPS, STEP_M = 8, 1e-3
"""Newton's method to where turns vanish: steps, and the width of differences [m]."""
AT_BOUND_M, WITHIN_M = 1e-6, 1e-7
"""How near a bound of the region counts as at it, and how far beyond as rounding [m]."""
BESIDE_M = 0.1
"""How far from the start IPOPT begins [m], as derivatives do not exist where a turn vanishes."""
LOOSE_RAD = 1e-5
"""Turns that are smaller at the start vanish with others: their signs are not kept [rad]."""
ACCURACY, ITERATIONS = 1e-9, 200
"""What IPOPT asks of optimality, and its most iterations."""
ZERO_RAD = 1e-7
"""A turn that has vanished but for rounding [rad]."""
SAME_S = 1e-5
"""A gain that is none [s]."""
CLOSE_S = 1e-3
"""Points that are worse than the best by more than this are not judged [s]."""


class Found(NamedTuple):
    """A hover point of an itinerary, and what it gives.

    Parameters
    ----------
    routes, entry
        The itinerary.
    straight
        Turns that vanish there, by number.
    point_m
        Where the UAV hovers (3,) [m].
    hover_s
        Δ [s].
    """

    routes: OpenRoutes
    entry: int
    straight: tuple[int, ...]
    point_m: Points
    hover_s: float


@dataclass
class Search:
    """The search for the best hover point.

    Parameters
    ----------
    asked, worked_out
        The question, and the mission.
    where
        Where the UAV may hover.
    """

    asked: Question
    worked_out: Network
    where: Region
    compiled: dict[tuple[int, tuple[int, ...]], Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.mission = self.worked_out.mission
        self.obstacles = prisms(self.mission)
        self.latest = time.monotonic() + (self.asked.time_limit_s or math.inf)

    def best(self, groups: tuple[OpenRoutes, ...]) -> list[Found]:
        """The best points found, the best first, those that are next to as good among them.

        They are sought as if the battery were charged at constant current.
        """
        groups = tuple(replace(each, free=replace(each.free, tapers=False)) for each in groups)
        climbed: list[Found] = []
        for start in self._starts(groups):
            if not climbed or start.hover_s > max(each.hover_s for each in climbed) - PROMISING_S:
                climbed.append(self._climbed(start))
        ends = _ordered(climbed)
        straightened = [better for end in ends[:MOST_JUDGED] for better in self._straightened(end)]
        found = _ordered(map(self._closely, _ordered([*ends, *straightened])[:MOST_JUDGED]))
        return [each for each in found if each.hover_s >= found[0].hover_s - CLOSE_S][:MOST_JUDGED]

    # What is in the way.

    def _hidden(self, place: int, points_m: Points) -> Numbers:
        """A building between a place, or the laser, and each point (k, 3) [m]; −1 for none."""
        if place == LASER and self.mission.laser is None:
            return np.full(len(points_m), CLEAR)
        from_m = np.broadcast_to(self._position_m(place), points_m.shape)
        exempt = np.full((len(points_m), 1), place - FIRST_BUILDING)
        return crossed(self.obstacles, from_m, points_m, exempt)

    def _position_m(self, place: int) -> Points:
        if place == LASER:
            assert self.mission.laser is not None
            return np.array(self.mission.laser.position_m)
        where: Points = self.worked_out.places.position_m[place]
        return where

    def _lit(self, points_m: Points) -> Booleans:
        if self.mission.laser is None:
            return np.zeros(len(points_m), bool)
        clear: Booleans = self._hidden(LASER, points_m) == CLEAR
        return clear

    def _hover_s(self, routes: OpenRoutes, entry: Numbers, points_m: Points) -> Floats:
        """Δ [s] of itineraries (r,) at points (k, 3) [m], shape (r, k); −∞ where none is."""
        self._in_time()
        which, point = (each.ravel() for each in np.indices((len(entry), len(points_m))))
        lit = self._lit(points_m)
        times = routes.times_s(self.asked.perspective, entry[which], points_m[point], lit[point])
        found = np.nan_to_num(times["hover_time_s"], nan=-np.inf).reshape(len(entry), -1)
        around = routes.around[entry]
        for place in [] if self.mission.flight.through_buildings else np.unique(around).tolist():
            blocked = self._hidden(place, points_m) != CLEAR
            found[(around == place).any(axis=1)[:, None] & blocked] = -np.inf
        return found

    def _in_time(self) -> None:
        if time.monotonic() > self.latest:
            raise SolverError("casadi did not finish within the time limit")

    # Where to start.

    def _starts(self, groups: tuple[OpenRoutes, ...]) -> list[Found]:
        """The best points of every cell that are apart, the best cells first."""
        points_m = np.concatenate([self._known_m(), self.where.spread(*SAMPLES)])
        points_m = np.concatenate([points_m, *map(self._near, self.worked_out.places.position_m)])
        sampled = [
            (routes, self._hover_s(routes, np.arange(len(routes.index)), points_m))
            for routes in groups
        ]
        top_s = max(float(hover_s.max()) for _, hover_s in sampled) - PROMISING_S
        promising = sorted(
            (-float(hover_s[entry].max()), number, entry)
            for number, (_, hover_s) in enumerate(sampled)
            for entry in range(len(hover_s))
            if hover_s[entry].max() > top_s
        )
        starts: list[Found] = []
        for _, number, entry in promising[:MOST_ROUTES]:
            routes, hover_s = sampled[number]
            starts += self._apart(routes, entry, (), points_m, hover_s[entry])
            best_m = points_m[np.argsort(-hover_s[entry])[:MOST_MOVED]]
            for turn, on_m in self._surfaces(routes, entry, best_m):
                on_s = self._hover_s(routes, np.array([entry]), on_m)[0]
                starts += self._apart(routes, entry, (turn,), on_m, on_s)
        return [each for each in _ordered(starts) if each.hover_s > top_s][:MOST_STARTS]

    def _known_m(self) -> Points:
        """w_U and the places of the mission, as far as they are in the region."""
        w_U_m = vehicle.hover_point_m(self.mission.replace({"route.hover_m": None}))
        points_m = np.vstack([w_U_m, self.worked_out.places.position_m])
        points_m = points_m[np.isfinite(points_m).all(axis=1)]
        inside_m = self.where.inside(points_m)
        kept: Points = inside_m[np.abs(inside_m - points_m).max(axis=1) < WITHIN_M]
        return kept

    def _near(self, place_m: Points) -> Points:
        """Points of the region (k, 3) [m] around a place, ever closer: short legs save most."""
        reach_m = CELL * self.where.radius_m * 0.5 ** np.arange(NEAR[0])
        angles = np.linspace(0.0, 2.0 * np.pi, NEAR[1], endpoint=False)
        slopes = np.linspace(-0.5 * np.pi, 0.5 * np.pi, NEAR[2])
        r, φ, θ = (each.ravel() for each in np.meshgrid(reach_m, angles, slopes))
        way_m = np.column_stack([np.cos(θ) * np.cos(φ), np.cos(θ) * np.sin(φ), np.sin(θ)])
        points_m: Points = place_m + r[:, None] * way_m
        return points_m[(self.where.beyond_m(points_m) <= 0.0).all(axis=1)]

    def _apart(
        self,
        routes: OpenRoutes,
        entry: int,
        straight: tuple[int, ...],
        points_m: Points,
        hover_s: Floats,
    ) -> Iterator[Found]:
        """The best of some points in sight of the laser and of those out of sight, a few each."""
        lit = self._lit(points_m)
        for sight_is in (True, False):
            chosen: list[Points] = []
            for k in np.argsort(-hover_s, kind="stable"):
                if lit[k] != sight_is or not np.isfinite(hover_s[k]):
                    continue
                away_m = [float(np.linalg.norm(points_m[k] - each)) for each in chosen]
                if min(away_m, default=math.inf) > APART * self.where.radius_m:
                    chosen.append(points_m[k])
                    yield Found(routes, entry, straight, points_m[k], float(hover_s[k]))
                if len(chosen) == STARTS_A_CELL:
                    break

    # Turns that vanish.

    def _surfaces(
        self, routes: OpenRoutes, entry: int, points_m: Points, straight: tuple[int, ...] = ()
    ) -> Iterator[tuple[int, Points]]:
        """Turns that vanish somewhere, and points moved there; one of those that vanish at once."""
        free = routes.taken(entry)
        seen: list[int] = list(straight)
        turns = len(free.turns_at(tuple(points_m[0])))
        for turn in range(turns):
            if turn in seen:
                continue
            on_m = self._onto(routes, entry, points_m, (*straight, turn))
            if not len(on_m):
                continue
            angles = np.abs(free.turns_at(tuple(on_m.T)))
            seen += np.flatnonzero((angles < ZERO_RAD).all(axis=1)).tolist()
            yield turn, on_m

    def _onto(
        self, routes: OpenRoutes, entry: int, points_m: Points, straight: tuple[int, ...]
    ) -> Points:
        """Points (k, 3) [m] moved to where turns vanish, inside the region; those that arrive.

        Newton's method; a bound of the region at which or beyond which a point is counts as well.
        """
        free = routes.taken(entry)

        def excess(points: Points) -> Points:
            turns = free.turns_at(tuple(np.moveaxis(points, -1, 0)))
            kept = [np.asarray(turns[number])[..., None] for number in straight]
            return np.concatenate([*kept, self.where.beyond_m(points)], axis=-1)

        shifts = STEP_M * np.concatenate([np.eye(3), -np.eye(3)])[:, None]
        for _ in range(STEPS):
            now, sides = excess(points_m), excess(points_m + shifts)
            slopes = np.moveaxis(sides[:3] - sides[3:], 0, -1) / (2.0 * STEP_M)
            idle = now[:, len(straight) :] < -AT_BOUND_M
            now[:, len(straight) :][idle] = 0.0
            slopes[:, len(straight) :][idle] = 0.0
            step_m = (np.linalg.pinv(slopes) @ now[..., None])[..., 0]
            length_m = np.linalg.norm(step_m, axis=1, keepdims=True)
            points_m = points_m - step_m * np.minimum(1.0, self.where.radius_m / (length_m + TINY))
        left = excess(points_m)
        turned = np.abs(left[:, : len(straight)]).max(axis=1, initial=0.0)
        beyond_m = left[:, len(straight) :].max(axis=1)
        moved: Points = points_m[(turned < ZERO_RAD) & (beyond_m < WITHIN_M)]
        return moved

    def _straightened(self, end: Found) -> Iterator[Found]:
        """What one more vanishing turn makes better, as long as there is one."""
        entry = np.array([end.entry])
        better = [
            Found(end.routes, end.entry, (*end.straight, turn), on_m[0], hover_s)
            for turn, on_m in self._surfaces(end.routes, end.entry, end.point_m[None], end.straight)
            if (hover_s := float(self._hover_s(end.routes, entry, on_m)[0, 0])) > end.hover_s
        ]
        for start in better:
            found = self._climbed(start)
            yield found
            yield from self._straightened(found)

    def _closely(self, found: Found) -> Found:
        """The best of points ever closer around a point, half of them where its turns vanish."""
        random, reach_m, entry = np.random.default_rng(0), FIRST_M, np.array([found.entry])
        while reach_m > LAST_M:
            steps_m = reach_m * random.normal(size=(AROUND, 3))
            for axis in range(3):
                steps_m[axis::4, axis] = 0.0
            points_m = self.where.inside(found.point_m + steps_m)
            if found.straight:
                on_m = self._onto(found.routes, found.entry, points_m[::2], found.straight)
                points_m = np.vstack([points_m, on_m])
            hover_s = self._hover_s(found.routes, entry, points_m)[0]
            top = int(hover_s.argmax())
            if hover_s[top] > found.hover_s:
                found = found._replace(point_m=points_m[top], hover_s=float(hover_s[top]))
            else:
                reach_m *= SHRINK
        return found

    # IPOPT in a cell.

    def _climbed(self, start: Found) -> Found:
        """Where IPOPT leads from a start, cell by cell, as long as it gets better."""
        for _ in range(MOST_CELLS):
            end = self._best_of_cell(start)
            if end is None or end.hover_s <= start.hover_s + SAME_S:
                break
            start = end
        return start

    def _best_of_cell(self, start: Found) -> Found | None:
        """What IPOPT finds in the cell around a start.

        IPOPT leaves aside what stands in the way. Where its point is hidden by a building, the cell
        is cut by the plane past that building that leaves the start furthest inside.
        """
        routes, entry = start.routes, start.entry
        lit = bool(self._lit(start.point_m[None])[0])
        legs = [] if self.mission.flight.through_buildings else routes.around[entry].tolist()
        sides: list[Side] = []
        while len(sides) <= MOST_SIDES:
            point_m = self._solved(start, lit, sides)
            if point_m is None:
                break
            views = [(place, self._hidden(place, point_m)[0]) for place in legs + [LASER] * lit]
            blocked = [(place, building) for place, building in views if building != CLEAR]
            if not blocked:
                hover_s = float(self._hover_s(routes, np.array([entry]), point_m)[0, 0])
                return start._replace(point_m=point_m[0], hover_s=hover_s)
            side = self._past(*blocked[0], start.point_m)
            if side is None or side in sides:
                break
            sides.append(side)
        return None

    def _past(self, place: int, building: int, start_m: Points) -> Side | None:
        """The half-space furthest around a start in which a building does not hide a place."""
        stated = self.mission.buildings[building]
        outline_m = np.array(sight.outline_m(stated))
        sides = clear_sides(outline_m, stated.position_m[2], self._position_m(place))
        deepest = max(sides, key=lambda side: float(side.depth_m(start_m)))
        x, y, z = deepest.normal.tolist()
        return Side((x, y, z), deepest.least_m) if deepest.depth_m(start_m) >= 0.0 else None

    def _reach_m(self, start: Found) -> float:
        """How far the cell of a start reaches [m]: not to where a leg has no length."""
        ends_m = self.worked_out.places.position_m[start.routes.around[start.entry]]
        nearest_m = float(np.linalg.norm(ends_m - start.point_m, axis=1).min())
        return min(CELL * self.where.radius_m, max(CELL_OF_LEG * nearest_m, LEAST_M))

    def _solved(self, start: Found, lit: bool, sides: Sequence[Side]) -> Points | None:
        """Where IPOPT ends in a cell (1, 3) [m], what stands in the way left aside."""
        self._in_time()
        model, engine = self._engine(start.routes, start.straight)
        values = {**model.row(start.entry), "laser_sight": float(lit)}
        turns = start.routes.taken(start.entry).turns_at(tuple(start.point_m))
        for number, turn in enumerate(turns):
            values[_sign_name(number)] = float(np.sign(turn)) if abs(turn) > LOOSE_RAD else 0.0
        for axis, coordinate_m in zip(AXES, start.point_m.tolist(), strict=True):
            values[f"least_{axis}_m"] = coordinate_m - self._reach_m(start)
            values[f"most_{axis}_m"] = coordinate_m + self._reach_m(start)
        for number in range(MOST_SIDES):
            (x, y, z), least_m = (*sides, *[EVERYWHERE] * MOST_SIDES)[number]
            values |= dict(zip(_side_names(number), (x, y, z, least_m), strict=True))
        times = start.routes.times_s(
            self.asked.perspective, np.array([start.entry]), start.point_m[None], np.array([lit])
        )
        begin = {name: float(each[0]) for name, each in times.items()}
        begin |= dict(zip(HOVER_POINT, (start.point_m + BESIDE_M).tolist(), strict=True))
        try:
            solution = engine.solve(values, [begin])
        except SolverError:
            self._in_time()
            return None
        if not solution.status.has_answer:
            return None
        point_m = np.array([[solution.point(0)[name] for name in HOVER_POINT]])
        found = self._onto(start.routes, start.entry, point_m, start.straight)
        return found if len(found) else None

    def _engine(self, routes: OpenRoutes, straight: tuple[int, ...]) -> Any:
        """A model of a cell and IPOPT for it; the itinerary and the sides are parameters."""
        from optuav.engines import smooth

        key = (id(routes), straight)
        if key not in self.compiled:
            given = [
                [Parameter(name, name, "1", 0.0) for name in _side_names(number)]
                for number in range(MOST_SIDES)
            ]
            sides = [Side((x, y, z), least_m) for x, y, z, least_m in given]
            turns = len(routes.taken(0).turns_at((0.0, 0.0, 0.0)))
            signs = [Parameter(_sign_name(number), "σ", "1", 0.0) for number in range(turns)]
            x, y, z, u, v, w = (
                Parameter(f"{which}_{axis}_m", f"{which}_{axis}", "m", 0.0)
                for which in ("least", "most")
                for axis in AXES
            )
            cell = Cell(straight, signs, sides, (x, y, z), (u, v, w))
            model = routes.model(self.asked.perspective, cell)
            model.preferences = []
            limit_s = self.asked.time_limit_s
            self.compiled[key] = model, smooth.Compiled(model, limit_s, ACCURACY, ITERATIONS)
        return self.compiled[key]


def _ordered(found: Iterable[Found]) -> list[Found]:
    return sorted(found, key=lambda each: -each.hover_s)


def _sign_name(number: int) -> str:
    return f"sign_{number}"


def _side_names(number: int) -> tuple[str, str, str, str]:
    return (f"n_x_{number}", f"n_y_{number}", f"n_z_{number}", f"least_{number}_m")
