"""Buildings as prisms from the ground up to their roofs, and the lines that cross them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission.schema import Building
from optuav.physics.quantity import TINY, Quantity

MARGIN_M = 1e-6
"""How far walls and roofs are moved inwards [m], so that to graze a building is not to cross it."""
MOST_PAIRS = 1 << 15
"""Pairs of lines and footprints that are tried at once, about: as many as fit the cache."""
FEW = 32  # So many footprints are all tried on every line
CLEAR = -1  # In place of the number of a building: there is none
Outline: TypeAlias = tuple[tuple[float, float], ...]  # Corners of a footprint on the map [m]


@dataclass(frozen=True)
class Prisms:
    """Footprints, each smaller by `MARGIN_M` all round, and the cells of the map that they reach.

    There are as many cells across as along, numbered along y within x, and again along x within y.
    """

    corners_m: Floats  # Of all footprints as stated (corner, axis) [m]
    sizes: Integers  # Number of corners of every footprint
    # Ends of the box around it (axis, footprint) [m], and whether it fills that box.
    low_m: Floats
    high_m: Floats
    is_box: Booleans
    building: Integers  # Number of its building
    roof_m: Floats  # Height of its roof over ground [m]
    map_low_m: Floats  # Where the cells begin (axis, 1) [m]
    cell_m: Floats  # Size of each (axis, 1) [m]
    across: int
    # By numbering: footprints in the order of the cells, and where those of each cell begin.
    in_cells: Sequence[Integers]
    begins: Sequence[Integers]

    @cached_property
    def polygons(self) -> npt.NDArray[np.object_]:
        """The footprints as polygons of `shapely`."""
        import shapely

        ring = np.repeat(np.arange(len(self.sizes)), self.sizes)
        outer = shapely.polygons(shapely.linearrings(self.corners_m, indices=ring))
        inner = shapely.buffer(outer, -MARGIN_M, join_style="mitre")
        shapely.prepare(inner)
        return np.asarray(inner)


def outline_m(building: Building) -> Outline | None:
    """Corners of a footprint on the map [m]; None if the building states none."""
    stated, (x, y, _) = building.footprint_m, building.position_m
    if stated is None or isinstance(stated[0], tuple):
        return stated
    width, depth = stated
    west, east, south, north = x - width / 2, x + width / 2, y - depth / 2, y + depth / 2
    return ((west, south), (east, south), (east, north), (west, north))


@lru_cache(maxsize=4)
def prisms(buildings: tuple[Building, ...]) -> Prisms:
    """The buildings that have a footprint; missions that are compared share theirs as a rule."""
    outlines = {k: each for k, each in enumerate(map(outline_m, buildings)) if each is not None}
    building, count = np.array([*outlines], dtype=np.intp), len(outlines)
    corners = np.array([corner for each in outlines.values() for corner in each]).reshape(-1, 2)
    sizes = np.array([*map(len, outlines.values())], dtype=np.intp)
    first = np.cumsum(sizes) - sizes
    low_m, high_m = (each.reduceat(corners, first).T for each in (np.minimum, np.maximum))
    low_m, high_m = low_m + MARGIN_M, high_m - MARGIN_M
    # Four corners, and every edge along an axis.
    (four,) = np.nonzero((sizes == 4) & (low_m < high_m).all(axis=0))
    ring = corners[first[four, None] + np.arange(4)]
    is_box = np.zeros(len(sizes), bool)
    is_box[four] = ((ring != np.roll(ring, 1, axis=1)).sum(axis=2) == 1).all(axis=1)
    roof_m = np.array([buildings[k].position_m[2] for k in outlines], dtype=float)
    # Cells no smaller than footprints as a rule, so that each reaches into few.
    out_m = np.stack([low_m - MARGIN_M, high_m + MARGIN_M])
    map_low_m = out_m[0].min(axis=1, keepdims=True, initial=np.inf)
    reach_m = out_m[1].max(axis=1, keepdims=True, initial=-np.inf) - map_low_m
    across = 1
    if count > FEW:
        typical_m = np.sqrt(((out_m[1] - out_m[0]) ** 2).mean(axis=1, keepdims=True))
        across = max(1, int(min(float((reach_m / typical_m).min()), math.sqrt(count))))
    cell_m = reach_m / across
    first, last = np.clip(((out_m - map_low_m) / cell_m).astype(np.intp), 0, across - 1)
    entries = (spans := last - first + 1).prod(axis=0)
    footprint = np.repeat(np.arange(count), entries)
    number = np.arange(len(footprint)) - np.repeat(np.cumsum(entries) - entries, entries)
    x, y = first[:, footprint] + np.divmod(number, spans[1, footprint])
    numbers = x * across + y, y * across + x
    in_cells = [footprint[np.argsort(each, kind="stable")] for each in numbers]
    begins = [np.cumsum(np.bincount(each + 1, minlength=across**2 + 1)) for each in numbers]
    shapes = corners, sizes, low_m, high_m, is_box, building, roof_m
    return Prisms(*shapes, map_low_m, cell_m, across, in_cells, begins)


def crossed(obstacles: Prisms, start_m: Floats, end_m: Floats, exempt: Integers) -> Integers:
    """A building that each straight line (line, 3) [m] runs through, −1 for a clear way.

    A line crosses a building if it runs inside the footprint below the roof; to graze a wall, a
    corner or the roof is not to cross. The `exempt` buildings (line, k) do not block a line.
    """
    found = np.full(len(start_m), CLEAR, dtype=np.intp)
    count, n = len(obstacles.building), obstacles.across
    if not count:
        return found
    at_once = 1 + MOST_PAIRS * n**2 // len(obstacles.in_cells[0])
    if len(found) > at_once:
        parts = [slice(begin, begin + at_once) for begin in range(0, len(found), at_once)]
        return np.concatenate(
            [crossed(obstacles, start_m[each], end_m[each], exempt[each]) for each in parts]
        )
    swap = start_m[:, 2] > end_m[:, 2]
    low_m, high_m = np.where(swap, end_m.T, start_m.T), np.where(swap, start_m.T, end_m.T)
    way_m, map_low_m, cell_m = high_m - low_m, obstacles.map_low_m, obstacles.cell_m
    if n == 1:
        line, footprint = np.divmod(np.arange(count * len(found)), count)
        line, footprint = _met(obstacles, (low_m, way_m, exempt), line, footprint)
        found[line] = obstacles.building[footprint]
        return found
    town = map_low_m, map_low_m + n * cell_m, obstacles.roof_m.max()
    within = enter, leave = np.stack(_stretch(low_m, way_m, *town))
    middle_m = 0.5 * (obstacles.low_m + obstacles.high_m)
    reach_m = 0.5 * (obstacles.high_m - obstacles.low_m).sum(axis=0) + 4.0 * MARGIN_M
    steep = np.abs(way_m[1]) > np.abs(way_m[0])
    for axis in (0, 1):
        # Column by column from the low ends on; a line that is blocked is followed no further.
        live = np.flatnonzero((enter <= leave) & (steep == axis))
        slope = way_m[1 - axis] / np.where(np.abs(way_m[axis]) < TINY, TINY, way_m[axis])
        offset_m = low_m[1 - axis] - slope * low_m[axis]
        ends_m = low_m[axis] + within * way_m[axis]
        ends = (ends_m[:, live] - map_low_m[axis]) / cell_m[axis]
        column, last = np.clip(ends.astype(np.intp), 0, n - 1)
        while len(live):
            walls_m = map_low_m[axis] + np.stack([column, column + 1]) * cell_m[axis]
            walls_m = np.clip(walls_m, *np.sort(ends_m[:, live], axis=0))
            ends = offset_m[live] + slope[live] * walls_m - map_low_m[1 - axis]
            row = column * n + np.clip((ends / cell_m[1 - axis]).astype(np.intp), 0, n - 1)
            first = obstacles.begins[axis][row.min(axis=0)]
            entries = obstacles.begins[axis][row.max(axis=0) + 1] - first
            line = np.repeat(live, entries)
            before = np.repeat(first - np.cumsum(entries) + entries, entries)
            footprint = obstacles.in_cells[axis][np.arange(len(line)) + before]
            # Most footprints lie well beside the line.
            beside_m = middle_m[1 - axis, footprint] - slope[line] * middle_m[axis, footprint]
            (near,) = np.nonzero(np.abs(beside_m - offset_m[line]) <= reach_m[footprint])
            pairs = line[near], footprint[near]
            line, footprint = _met(obstacles, (low_m, way_m, exempt), *pairs)
            found[line] = obstacles.building[footprint]
            (on,) = np.nonzero((found[live] == CLEAR) & (column != last))
            live, last = live[on], last[on]
            column = column[on] + np.sign(last - column[on])
    return found


def _met(
    obstacles: Prisms, lines: tuple[Floats, Floats, Integers], line: Integers, footprint: Integers
) -> tuple[Integers, Integers]:
    """Those pairs of a line and a footprint in which the footprint blocks the line."""
    low_m, way_m, exempt = lines
    boxes = obstacles.low_m[:, footprint], obstacles.high_m[:, footprint]
    enter, leave = _stretch(low_m[:, line], way_m[:, line], *boxes, obstacles.roof_m[footprint])
    (met,) = np.nonzero(enter <= leave)
    line, footprint = line[met], footprint[met]
    blocks = (exempt[line] != obstacles.building[footprint, None]).all(axis=1)
    (other,) = np.nonzero(blocks & ~obstacles.is_box[footprint])
    if len(other):
        import shapely

        way = low_m[:2, line[other]], way_m[:2, line[other]]
        ends_m = np.stack(
            [(way[0] + each[met[other]] * way[1]).T for each in (enter, leave)], axis=1
        )
        seen = np.asarray(shapely.linestrings(ends_m))
        # Seen from above, an upright line is a point.
        upright = (ends_m[:, 0] == ends_m[:, 1]).all(axis=1)
        seen[upright] = shapely.points(ends_m[upright, 0])
        blocks[other] = shapely.intersects(obstacles.polygons[footprint[other]], seen)
    return line[blocks], footprint[blocks]


def _stretch(
    low_m: Floats, way_m: Floats, box_low_m: Floats, box_high_m: Floats, roof_m: Quantity
) -> tuple[Floats, Floats]:
    """From where to where on their way lines run in boxes below roofs; not if from is larger."""
    way = np.where(np.abs(way_m) < TINY, TINY, way_m)
    one, other = (box_low_m - low_m[:2]) / way[:2], (box_high_m - low_m[:2]) / way[:2]
    depth_m = roof_m - MARGIN_M - low_m[2]
    highest = np.where(depth_m > 0.0, np.minimum(depth_m / way[2], 1.0), -1.0)
    enter = np.minimum(one, other).max(axis=0)
    return np.maximum(enter, 0.0), np.minimum(np.maximum(one, other).min(axis=0), highest)


def clear_lines(
    obstacles: Prisms, position_m: Floats, lines: Integers, exempt: Integers
) -> Booleans:
    """Whether lines between places cross no building (variant, line); False without an end.

    Lines (line, 2) join places (variant, place, 3) [m]; `exempt` (line, k) do not block them.
    """
    known = np.asarray(np.isfinite(position_m).all(axis=2))
    free = np.asarray(known[:, lines].all(axis=2))
    low_m, high_m = (each.reduce(position_m, axis=0)[lines] for each in (np.fmin, np.fmax))
    moves = (low_m != high_m).any(axis=(1, 2))
    for k in np.flatnonzero(moves).tolist():
        # In no variant is it farther from the middle one than its ends may be.
        middle_m, reach_m = 0.5 * (low_m + high_m)[k], 0.5 * (high_m - low_m)[k].max(axis=0)
        start_m, end_m = middle_m[np.argsort(middle_m[:, 2])]
        wider_m = reach_m[:2, None]
        boxes = obstacles.low_m - wider_m, obstacles.high_m + wider_m, obstacles.roof_m + reach_m[2]
        enter, leave = _stretch(start_m[:, None], (end_m - start_m)[:, None], *boxes)
        moves[k] = ((enter <= leave) & ~np.isin(obstacles.building, exempt[k])).any()
    every, first = np.arange(len(position_m))[:, None], free.argmax(axis=0)
    # A line that is the same in all variants is tried once, and so is one that is always clear: in
    # the first variant that has both ends.
    variant, line = np.nonzero(free & (moves | (every == first)))
    start_m, end_m = np.moveaxis(position_m[variant[:, None], lines[line]], 1, 0)
    blocked = np.zeros_like(free)
    blocked[variant, line] = crossed(obstacles, start_m, end_m, exempt[line]) != CLEAR
    free &= ~np.where(moves, blocked, blocked[first, np.arange(len(lines))])
    return free
