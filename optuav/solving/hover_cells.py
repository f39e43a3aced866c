"""The best hover point near a start: IPOPT solves `P1Free` cell by cell.

In a cell the same turns vanish, and what is in sight stays in sight.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from formulations.p1_free import AXES, HOVER_POINT, Cell, Side
from optuav.arrays import Floats
from optuav.errors import SolverError
from optuav.modelling import Parameter
from optuav.network import obstacles as sight
from optuav.network.clearance import clear_sides
from optuav.network.obstacles import CLEAR
from optuav.solving.hover_times import LASER, Found, HoverTimes
from optuav.solving.open_routes import OpenRoutes
from optuav.solving.vanishing_turns import moved_onto

SIZE, MOST_CELLS = 0.2, 8
"""How far a cell reaches from its start, as a share of the coverage radius; cells in a row."""
SIZE_OF_LEG, LEAST_M = 0.5, 0.5
"""How far it reaches at most, as a share of the shorter leg, and at least [m]."""
MOST_SIDES = 6
"""Planes that cut a cell."""
EVERYWHERE = Side((0.0, 0.0, 0.0), -1.0)
BESIDE_M = 0.1
"""How far from the start IPOPT begins [m], as derivatives do not exist where a turn vanishes."""
LOOSE_RAD = 1e-5
"""Turns that are smaller at the start vanish with others: their signs are not kept [rad]."""
ACCURACY, ITERATIONS = 1e-9, 200
"""What IPOPT asks of optimality, and its most iterations."""
SAME_S = 1e-5
"""A gain that is none [s]."""


class Cells:
    """Models of cells, compiled once for all itineraries of a group.

    Parameters
    ----------
    times
        Hover times with the real geometry.
    """

    def __init__(self, times: HoverTimes) -> None:
        self.times, self.where = times, times.where
        self.compiled: dict[tuple[int, tuple[int, ...]], Any] = {}

    def climbed(self, start: Found) -> Found:
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
        times, routes, entry = self.times, start.routes, start.entry
        lit = bool(times.lit(start.point_m[None])[0])
        legs = [] if times.mission.flight.through_buildings else routes.around[entry].tolist()
        sides: list[Side] = []
        while len(sides) <= MOST_SIDES:
            point_m = self._solved(start, lit, sides)
            if point_m is None:
                break
            views = [(place, times.hidden(place, point_m)[0]) for place in legs + [LASER] * lit]
            blocked = [(place, building) for place, building in views if building != CLEAR]
            if not blocked:
                hover_s = float(times.at(routes, np.array([entry]), point_m)[0, 0])
                return start._replace(point_m=point_m[0], hover_s=hover_s)
            side = self._past(*blocked[0], start.point_m)
            if side is None or side in sides:
                break
            sides.append(side)
        return None

    def _past(self, place: int, building: int, start_m: Floats) -> Side | None:
        """The half-space furthest around a start in which a building does not hide a place."""
        stated = self.times.mission.buildings[building]
        outline_m = np.array(sight.outline_m(stated))
        sides = clear_sides(outline_m, stated.position_m[2], self.times.position_m(place))
        deepest = max(sides, key=lambda side: float(side.depth_m(start_m)))
        x, y, z = deepest.normal.tolist()
        return Side((x, y, z), deepest.least_m) if deepest.depth_m(start_m) >= 0.0 else None

    def _reach_m(self, start: Found) -> float:
        """How far the cell of a start reaches [m]: not to where a leg has no length."""
        ends_m = self.times.places_m[start.routes.around[start.entry]]
        nearest_m = float(np.linalg.norm(ends_m - start.point_m, axis=1).min())
        return min(SIZE * self.where.radius_m, max(SIZE_OF_LEG * nearest_m, LEAST_M))

    def _solved(self, start: Found, lit: bool, sides: Sequence[Side]) -> Floats | None:
        """Where IPOPT ends in a cell (1, 3) [m], what stands in the way left aside."""
        self.times.check_limit()
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
        times_s = start.routes.times_s(
            self.times.perspective,
            np.array([start.entry]),
            start.point_m[None],
            np.array([lit]),
        )
        begin = {name: float(each[0]) for name, each in times_s.items()}
        begin |= dict(zip(HOVER_POINT, (start.point_m + BESIDE_M).tolist(), strict=True))
        try:
            solution = engine.solve(values, [begin])
        except SolverError:
            self.times.check_limit()
            return None
        if not solution.status.has_answer:
            return None
        point_m = np.array([[solution.point(0)[name] for name in HOVER_POINT]])
        found = moved_onto(start.routes, start.entry, self.where, point_m, start.straight)
        return found if len(found) else None

    def _engine(self, routes: OpenRoutes, straight: tuple[int, ...]) -> Any:
        """A model of a cell and IPOPT for it; the itinerary and the sides are parameters."""
        from optuav.engines.casadi_engine import CasadiProgramme

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
            model = routes.model(self.times.perspective, cell)
            model.preferences = []
            engine = CasadiProgramme(model, self.times.time_limit_s, ACCURACY, ITERATIONS)
            self.compiled[key] = model, engine
        return self.compiled[key]


def _sign_name(number: int) -> str:
    return f"sign_{number}"


def _side_names(number: int) -> tuple[str, str, str, str]:
    return (f"n_x_{number}", f"n_y_{number}", f"n_z_{number}", f"least_{number}_m")
