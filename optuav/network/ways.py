"""Ways of legs that a building blocks: over it by one apex, or around it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from optuav.arrays import Floats, Integers
from optuav.errors import Fault, InputError
from optuav.flight.model import FlightTable
from optuav.mission import Mission
from optuav.mission.buildings import Buildings
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.prisms import MARGIN_M, Prisms, prisms
from optuav.network.sightlines import shortest_past
from optuav.physics.flight import Loads
from optuav.physics.quantity import TINY, Quantity, Vector

CLEARANCE_M = 5.0  # Default clearance of a mission
CEILING_M = 10_000.0  # Default largest altitude of its waypoints; few multirotors flew as high
LINES_AT_ONCE = 1 << 11  # Lines that are bent together, in bounded memory
MOST_MET = 500  # Footprints that a way around may meet
EQUAL_CHARGES = 1e-9  # Relative difference of two charges that count as equal
ROUNDING_M = 1e-9  # An apex that passes the ceiling by no more is at the ceiling


class Ways(NamedTuple):
    """Ways along lines between places, the same there and back."""

    # (variant or 1, line, waypoint, 3) from the first place on [m]; NaN beyond a way's own.
    waypoints_m: Floats
    blocker: Integers  # (variant or 1, line): a building that closes the way, −1 for an open one

    def of_legs(self, line: Integers, backwards: npt.NDArray[np.bool_]) -> Floats:
        """Waypoints (variant or 1, leg, waypoint, 3) [m] of legs along lines, in their order."""
        waypoints_m = self.waypoints_m[:, line]
        waypoints_m[:, backwards] = _turned(waypoints_m[:, backwards])
        return waypoints_m


def _turned(waypoints_m: Floats) -> Floats:
    """Waypoints (…, waypoint, 3) in the other order; NaN stays behind them."""
    turned_m = waypoints_m[..., ::-1, :]
    order = np.argsort(np.isnan(turned_m[..., 0]), axis=-1, kind="stable")
    return np.take_along_axis(turned_m, order[..., None], axis=-2)


def loads_along(
    leg: Callable[[Vector], Loads], start_m: Floats, end_m: Floats, waypoints_m: Floats
) -> Loads:
    """Loads of ways (…, 3) [m] by waypoints (…, waypoint, 3), NaN beyond a way's own.

    Segments are legs from rest to rest, one after the other; missing ones take no time.
    """
    stops_m = np.where(absent := np.isnan(waypoints_m), end_m[..., None, :], waypoints_m)
    moves_m = [b - a for a, b in pairwise([start_m, *np.moveaxis(stops_m, -2, 0), end_m])]
    first = leg(_vector(moves_m[0]))
    if len(moves_m) == 1:
        return first
    whole = first._replace(way_m=_vector(end_m - start_m), bent_m=first.distance_m)
    for k, move_m in enumerate(moves_m[1:]):
        gone = absent[..., k, 0]
        segment = leg(_vector(np.where(gone[..., None], moves_m[0], move_m)))
        peak_m_s = np.where(gone, 0.0, segment.peak_speed_m_s)
        peak_s = whole.duration_s + segment.peak_s
        durations_s = (np.where(gone, 0.0, duration_s) for duration_s in segment.durations_s)
        whole = whole._replace(
            stages=whole.stages + first.stages,
            durations_s=(*whole.durations_s, *durations_s),
            currents_A=whole.currents_A + segment.currents_A,
            powers_W=whole.powers_W + segment.powers_W,
            peak_speed_m_s=np.maximum(whole.peak_speed_m_s, peak_m_s),
            peak_s=np.where(peak_m_s > whole.peak_speed_m_s, peak_s, whole.peak_s),
            bent_m=whole.distance_m + np.where(gone, 0.0, segment.distance_m),
        )
    return whole


def _vector(points_m: Floats) -> Vector:
    """Points (…, 3) by component."""
    return points_m[..., 0], points_m[..., 1], points_m[..., 2]


def way_limits_m(flight: FlightTable) -> tuple[Quantity, Quantity]:
    """Clearance of bent ways and largest altitude of their waypoints [m], stated or by default."""
    clearance_m, ceiling_m = flight.clearance_m, flight.max_altitude_m
    return (
        CLEARANCE_M if clearance_m is None else clearance_m,
        CEILING_M if ceiling_m is None else ceiling_m,
    )


def build_ways(
    mission: Mission, towns: Sequence[Buildings], position_m: Floats, lines: Integers, own: Integers
) -> Ways:
    """Ways along lines (line, 2) between places (variant or 1, place, 3) [m] past buildings.

    A line may cross its `own` buildings ([variant,] line, k). Each of several towns belongs to as
    many variants in a row. Numbers of the mission may be columns (variant, 1). Raises `InputError`
    where a way around meets more than 500 footprints.
    """
    count, own_limits_m = len(lines), np.atleast_2d(*way_limits_m(mission.flight))
    limits_m = np.stack(np.broadcast_arrays(*own_limits_m), axis=-1)
    rows = max(len(position_m), len(limits_m))
    ends_m = position_m[:, lines].reshape(-1, count, 6)
    shapes = ((column, (rows, count, column.shape[-1])) for column in (ends_m, limits_m))
    table = np.concatenate([np.broadcast_to(*column) for column in shapes], axis=-1)
    # A line that is as in the first variant of its town is bent once.
    first = np.arange(rows) // (in_town := rows // len(towns)) * in_town
    source = np.where((table == table[first]).all(axis=2).T, first, np.arange(rows)).T
    distinct, cell = np.unique(source * count + np.arange(count), return_inverse=True)
    row, line = np.divmod(distinct, count)
    start_m, end_m, apart_m, ceiling_m = np.split(table[row, line], (3, 6, 7), axis=1)
    exempt = own[line] if own.ndim == 2 else own[row, line]
    blocker, waypoints_m = np.full(len(row), CLEAR), np.full((len(row), 1, 3), np.nan)
    paths_m = dict[int, Floats]()
    exists = np.isfinite(start_m + end_m).all(axis=1)
    for number, town in enumerate(towns):
        (here,) = np.nonzero(exists & (row // in_town == number))
        blocker[here] = crossed(prisms(town), start_m[here], end_m[here], exempt[here])
        bent = here[blocker[here] != CLEAR]
        for end_in_m in (start_m, end_m):  # No way leads into a building
            at_m = end_in_m[bent]
            bent = bent[crossed(prisms(town), at_m, at_m, exempt[bent]) == CLEAR]
        for clearance_m in np.unique(apart_m[bent]).tolist():
            fences = _fences(town, clearance_m)
            alike = bent[apart_m[bent, 0] == clearance_m]
            for some in np.split(alike, range(LINES_AT_ONCE, len(alike), LINES_AT_ONCE)):
                hurdles = start_m[some], end_m[some], exempt[some]
                waypoints_m[some, 0], closer = fences.over(*hurdles, ceiling_m[some])
                bent_up = np.isfinite(waypoints_m[some, 0, 0])
                blocker[some] = np.where(bent_up | (closer != CLEAR), closer, blocker[some])
            for k in alike.tolist() if mission.flight.obstacle_rule == "around" else ():
                path_m = fences.around(start_m[k], end_m[k], exempt[k])
                if path_m is not None and (path_m[:, 2] <= ceiling_m[k]).all():
                    paths_m[k], blocker[k] = path_m, CLEAR
    cell = cell.reshape(rows, count)
    if not paths_m:
        return Ways(waypoints_m[cell], blocker[cell])
    around_m = np.full((len(row), max(map(len, paths_m.values())), 3), np.nan)
    for k, path_m in paths_m.items():
        around_m[k, : len(path_m)] = path_m
    over_m = np.full_like(around_m, np.nan)
    over_m[:, :1] = waypoints_m
    ends = table[..., :3], table[..., 3:6]
    return Ways(
        _better(mission.flight_model.leg, *ends, over_m[cell], around_m[cell]), blocker[cell]
    )


def _better(
    leg: Callable[[Vector], Loads], start_m: Floats, end_m: Floats, *ways_m: Floats
) -> Floats:
    """Choose from two ways by waypoints, NaN for none, by less charge there and back, then time."""
    drawn = []
    for way_m in ways_m:
        there = loads_along(leg, start_m, end_m, way_m)
        back = loads_along(leg, end_m, start_m, _turned(way_m))
        none = np.isnan(way_m[..., 0, 0])
        sums = there.charge_As + back.charge_As, there.duration_s + back.duration_s
        drawn.append([np.where(none, np.inf, total) for total in sums])
    (over_As, over_s), (around_As, around_s) = drawn
    alike = np.isclose(over_As, around_As, rtol=EQUAL_CHARGES, atol=0.0)
    first = np.where(alike, over_s <= around_s, over_As < around_As)
    return np.where(first[..., None, None], *ways_m)


class Corners(NamedTuple):
    """Corners of walls that lines meet on the map, (line, corner) from the start on.

    Before and behind the corners of a line stand such as bind nothing, at its ends.
    """

    at_m: Floats  # Distance from the start over ground [m]
    top_m: Floats  # Least altitude there [m]
    building: Integers


class Fences(NamedTuple):
    """Prisms with the room that bent ways leave around them and above."""

    obstacles: Prisms
    walls: npt.NDArray[np.object_]  # Footprints, wider by the clearance, as polygons of `shapely`
    tree: Any  # Search tree of the walls, by number
    top_m: Floats  # Roofs, higher by the clearance [m]

    def over(
        self, start_m: Floats, end_m: Floats, exempt: Integers, ceiling_m: Floats
    ) -> tuple[Floats, Integers]:
        """Apexes (line, 3) [m] of the shortest ways over straight lines (line, 3) [m].

        NaN where none is as low as the ceiling (line, 1) [m]; and by line the building that closes
        the way, −1 for an open one. The `exempt` buildings (line, k) do not count.
        """
        way_m = end_m - start_m
        level_m = np.hypot(*way_m[:, :2].T)[:, None]
        ahead = way_m[:, :2] / np.maximum(level_m, TINY)
        corners = self._corners(start_m, end_m, exempt, ahead)
        a, b, t, h = start_m[:, 2:], end_m[:, 2:], corners.at_m, corners.top_m
        excess_m = h - (a + (b - a) * t / np.maximum(level_m, TINY))
        with np.errstate(divide="ignore", invalid="ignore"):
            # Slopes from both ends that clear the corners up to here, and from here on.
            up, down = (np.fmax((h - z) / x, -np.inf) for z, x in ((a, t), (b, level_m - t)))
            excess_m = np.where(np.isposinf(np.maximum(up, down)), np.inf, excess_m)
            rise = np.maximum.accumulate(up, axis=1)
            fall = np.maximum.accumulate(down[:, ::-1], axis=1)[:, ::-1]
            s, z = _apexes(t, rise, fall, (a, b, level_m), ceiling_m)
            length_m = np.hypot(s, z - a) + np.hypot(level_m - s, z - b)
            flown = np.isfinite(length_m) & (s > 0.0) & (s < level_m)
        length_m = np.where(flown, length_m, np.inf)
        row, best = np.arange(len(s)), length_m.argmin(axis=1)
        apex_m = np.column_stack([start_m[:, :2] + s[row, best, None] * ahead, z[row, best]])
        closed = ~np.isfinite(length_m[row, best])
        apex_m[closed] = np.nan
        return apex_m, np.where(closed, corners.building[row, excess_m.argmax(axis=1)], CLEAR)

    def _corners(self, start_m: Floats, end_m: Floats, exempt: Integers, ahead: Floats) -> Corners:
        """Return where lines enter and leave walls; `ahead` (line, 2) are their directions."""
        import shapely

        lines = np.asarray(shapely.linestrings(np.stack([start_m[:, :2], end_m[:, :2]], axis=1)))
        line, footprint = self.tree.query(lines, predicate="intersects")
        counts = (exempt[line] != self.obstacles.building[footprint][:, None]).all(axis=1)
        line, footprint = line[counts], footprint[counts]
        walls, top_m = self.seen(footprint, start_m[line], end_m[line])
        common = shapely.intersection(lines[line], walls)
        points_m, pair = shapely.get_coordinates(common, return_index=True)
        along_m = ((points_m - start_m[line[pair], :2]) * ahead[line[pair]]).sum(axis=1)
        enter_m, leave_m = np.full(len(line), np.inf), np.full(len(line), -np.inf)
        np.minimum.at(enter_m, pair, along_m)
        np.maximum.at(leave_m, pair, along_m)
        met = np.tile(enter_m <= leave_m, 2)
        building = self.obstacles.building[footprint]
        line, building, top_m = (np.tile(x, 2)[met] for x in (line, building, top_m))
        level_m = np.hypot(*(end_m - start_m)[:, :2].T)
        at_m = np.clip(np.concatenate([enter_m, leave_m])[met], 0.0, level_m[line])
        order, many = np.lexsort((at_m, line)), np.bincount(line, minlength=len(start_m))
        place = line[order], 1 + np.arange(len(line)) - (np.cumsum(many) - many)[line[order]]
        shape = len(start_m), 2 + int(many.max(initial=0))
        none = np.full(shape, -np.inf), np.full(shape, CLEAR)
        table = Corners(np.broadcast_to(level_m[:, None], shape).copy(), *none)
        table.at_m[:, 0] = 0.0
        for values, own in zip(table, (at_m, top_m, building), strict=True):
            values[place] = own[order]
        return table

    def seen(
        self, footprint: Integers, start_m: Floats, end_m: Floats
    ) -> tuple[npt.NDArray[np.object_], Floats]:
        """Walls and tops of footprints as lines (line, 3) [m] meet them, one each.

        An end within a wall sees the footprint's own outline; an end above a roof, its own height.
        """
        import shapely

        walls, top_m = self.walls[footprint], self.top_m[footprint]
        near = [shapely.intersects_xy(walls, *point[:, :2].T) for point in (start_m, end_m)]
        close = near[0] | near[1]
        walls[close] = self.obstacles.inner(footprint[close])
        roof_m = self.obstacles.roof_m[footprint] - MARGIN_M
        for each_m in (start_m, end_m):
            above = shapely.intersects_xy(walls, *each_m[:, :2].T) & (each_m[:, 2] >= roof_m)
            top_m = np.where(above, np.minimum(top_m, each_m[:, 2]), top_m)
        return walls, top_m

    def around(self, start_m: Floats, end_m: Floats, exempt: Integers) -> Floats | None:
        """Waypoints (waypoint, 3) [m] of the shortest way around footprints as high as its ends.

        None without a way. Only footprints that the best way so far crosses are in the graph:
        a shortest way that is free of all others is the shortest of all.
        """
        import shapely

        ends_m, low_m = np.stack([start_m, end_m])[:, :2], min(start_m[2], end_m[2])
        path_m, met = ends_m, np.zeros(0, dtype=np.intp)
        while True:
            line = shapely.linestrings(path_m)
            near = self.tree.query(line, predicate="intersects")
            near = near[~np.isin(self.obstacles.building[near], exempt)]
            walls, top_m = self.seen(near, *(np.tile(x, (len(near), 1)) for x in (start_m, end_m)))
            new = np.setdiff1d(near[(top_m > low_m) & shapely.intersects(walls, line)], met)
            if not len(new):
                break
            met = np.append(met, new)
            if len(met) > MOST_MET:
                words = f'a route around met more than {MOST_MET} footprints; set "over"'
                raise InputError([Fault("flight.obstacles", '"around"', words)])
            walls, _ = self.seen(met, *(np.tile(x, (len(met), 1)) for x in (start_m, end_m)))
            shortest_m = shortest_past(walls, ends_m)
            if shortest_m is None:
                return None
            path_m = shortest_m
        if len(path_m) == 2:
            return None
        along_m = np.cumsum(np.hypot(*np.diff(path_m, axis=0).T))
        z_m = start_m[2] + (end_m[2] - start_m[2]) * along_m[:-1] / along_m[-1]
        return np.column_stack([path_m[1:-1], z_m])


def _apexes(
    t: Floats, rise: Floats, fall: Floats, ends: tuple[Floats, Floats, Floats], ceiling_m: Floats
) -> tuple[Floats, Floats]:
    """Distances over ground and altitudes of apexes (line, k) [m], NaN for none; see `Fences.over`.

    Between two corners, at distances t, the lowest apex rises from the start and then falls to the
    end; the nearer to that end, the shorter the way. So the best is at a corner, or between two
    where both slopes meet, or where one passes the ceiling. The `ends` are the altitudes of start
    and end, and their distance.
    """
    (a, b, level_m), before, after = ends, t[:, :-1], t[:, 1:]
    rises, falls = rise[:, :-1], fall[:, 1:]
    meet_m = (b - a + falls * level_m) / (rises + falls)
    up_m, down_m = (ceiling_m - a) / rises, level_m - (ceiling_m - b) / falls
    z_m = (
        np.fmax(a + rise * t, b + fall * (level_m - t)),
        a + rises * meet_m,
        np.fmax(b + falls * (level_m - up_m), ceiling_m),
        np.fmax(a + rises * down_m, ceiling_m),
    )
    between = [np.where((before <= s) & (s <= after), s, np.nan) for s in (meet_m, up_m, down_m)]
    z = np.concatenate(z_m, axis=1)
    z = np.where(z <= ceiling_m + ROUNDING_M, np.minimum(z, ceiling_m), np.nan)
    return np.concatenate([t, *between], axis=1), z


@lru_cache(maxsize=4)
def _fences(town: Buildings, clearance_m: float) -> Fences:
    """The fences of a town for a clearance [m]."""
    import shapely

    obstacles = prisms(town)
    walls = obstacles.polygons
    if clearance_m > MARGIN_M:  # GEOS makes nothing of a footprint that grows by less than rounding
        walls = shapely.buffer(walls, clearance_m, join_style="mitre")
    shapely.prepare(walls)
    return Fences(obstacles, walls, shapely.STRtree(walls), obstacles.roof_m + clearance_m)
