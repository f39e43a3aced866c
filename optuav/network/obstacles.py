"""Buildings as prisms from the ground up to their roofs, and the lines that cross them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.mission.schema import Building, Footprint, RoofPosition

if TYPE_CHECKING:
    import shapely

MARGIN_M = 1e-6
"""How far walls and roofs are moved inwards [m], so that to graze a building is not to cross it."""
MOST_PAIRS = 1 << 21
"""Lines that are tried at once, times buildings."""
BUILDINGS_PASSED = 4
"""About as many buildings a piece of a line passes, where they stand evenly on the map."""
REMEMBERED = 4
"""Sets of buildings whose prisms are kept: missions that are compared share theirs as a rule."""
CLEAR = -1
"""In place of the number of a building: there is none."""
FEW = 256
"""Lines of a bundle that are tried one by one rather than as a bundle."""
Outline: TypeAlias = tuple[tuple[float, float], ...]
"""Corners of a footprint on the map [m]."""


@dataclass(frozen=True)
class Prisms:
    """Footprints with a spatial index."""

    # `shapely.STRtree` of the footprints, each smaller by `MARGIN_M` all round.
    tree: shapely.STRtree
    building: Integers  # Number of the building of every footprint
    roof_m: Floats  # Height of its roof over ground [m]


def outline_m(building: Building) -> Outline | None:
    """Corners of a footprint on the map [m]; None if the building states none."""
    stated = building.footprint_m
    return None if stated is None else _outline_m(stated, building.position_m)


def _outline_m(stated: Footprint, position_m: RoofPosition) -> Outline:
    if isinstance(stated[0], tuple):
        return stated
    (x, y, _), (width, depth) = position_m, stated
    west, east, south, north = x - width / 2, x + width / 2, y - depth / 2, y + depth / 2
    return ((west, south), (east, south), (east, north), (west, north))


def prisms(mission: Mission) -> Prisms:
    """The mission's buildings that have a footprint."""
    every = mission.buildings
    building = tuple(k for k, each in enumerate(every) if each.footprint_m is not None)
    return _prisms(
        building,
        tuple(every[k].footprint_m for k in building),
        tuple(every[k].position_m for k in building),
    )


@lru_cache(maxsize=REMEMBERED)
def _prisms(
    building: tuple[int, ...],
    footprint_m: tuple[Footprint, ...],
    position_m: tuple[RoofPosition, ...],
) -> Prisms:
    """Of buildings by number; tuples of numbers compare faster than buildings do."""
    import shapely

    outlines = list(map(_outline_m, footprint_m, position_m))
    corners = np.array([corner for outline in outlines for corner in outline])
    sides = np.array([len(outline) for outline in outlines], dtype=np.intp)
    ring = np.repeat(np.arange(len(outlines)), sides)
    outer = shapely.polygons(shapely.linearrings(corners.reshape(-1, 2), indices=ring))
    inner = np.asarray(shapely.buffer(outer, -MARGIN_M, join_style="mitre"))
    shapely.prepare(inner)
    roof_m = np.array(position_m, dtype=float).reshape(-1, 3)[:, 2]
    return Prisms(shapely.STRtree(inner), np.array(building, dtype=np.intp), roof_m)


def crossed(obstacles: Prisms, start_m: Floats, end_m: Floats, exempt: Integers) -> Integers:
    """A building that each straight line (line, 3) [m] runs through, −1 for a clear way.

    A line crosses a building if it runs inside the footprint below the roof; to graze a wall, a
    corner or the roof is not to cross. The `exempt` buildings (line, k) do not block a line.
    """
    swap = (start_m[:, 2] > end_m[:, 2])[:, None]
    low_m, high_m = np.where(swap, end_m, start_m), np.where(swap, start_m, end_m)
    found = np.full(len(start_m), CLEAR, dtype=np.intp)
    count = len(obstacles.building)
    at_once = 1 + MOST_PAIRS // max(1, count)
    # Buildings in the way stand near the low end as a rule; short pieces have slim boxes.
    cuts = np.linspace(0.0, 1.0, 2 + int(math.sqrt(count) / BUILDINGS_PASSED))
    for first in range(0, len(found), at_once):
        lines = np.arange(first, min(first + at_once, len(found)))
        for begin, end in itertools.pairwise(cuts):
            way_m = high_m[lines] - low_m[lines]
            line, building = _through(
                obstacles, low_m[lines] + begin * way_m, low_m[lines] + end * way_m, exempt[lines]
            )
            found[lines[line]] = building
            lines = lines[found[lines] == CLEAR]
    return found


def _through(
    obstacles: Prisms, low_m: Floats, high_m: Floats, exempt: Integers
) -> tuple[Integers, Integers]:
    """Pairs of lines and buildings that they cross; each line by its low and its high end."""
    import shapely

    line, footprint = obstacles.tree.query(_on_map(low_m, high_m))
    depth_m = obstacles.roof_m[footprint] - MARGIN_M - low_m[line, 2]
    kept = depth_m > 0.0
    kept &= (exempt[line] != obstacles.building[footprint, None]).all(axis=1)
    if not kept.any():
        return line[kept], obstacles.building[footprint[kept]]
    line, footprint, depth_m = line[kept], footprint[kept], depth_m[kept]
    way_m = high_m[line] - low_m[line]
    share = np.where(way_m[:, 2] > depth_m, depth_m / np.maximum(way_m[:, 2], depth_m), 1.0)
    below = _on_map(low_m[line], low_m[line] + share[:, None] * way_m)
    inside = shapely.intersects(obstacles.tree.geometries[footprint], below)
    return line[inside], obstacles.building[footprint[inside]]


def _on_map(start_m: Floats, end_m: Floats) -> npt.NDArray[np.object_]:
    """Lines seen from above; an upright one is a point."""
    import shapely

    seen = np.asarray(shapely.linestrings(np.stack([start_m[:, :2], end_m[:, :2]], axis=1)))
    upright = (start_m[:, :2] == end_m[:, :2]).all(axis=1)
    if upright.any():
        seen[upright] = shapely.points(start_m[upright, :2])
    return seen


def clear_lines(
    obstacles: Prisms, position_m: Floats, lines: Integers, exempt: Integers
) -> Booleans:
    """Whether lines between places cross no building (variant, line); False without an end.

    The `lines` (line, 2) join places (variant, place, 3) [m] by number; the `exempt` buildings
    (line, k) do not block them.
    """
    known: Booleans = np.asarray(np.isfinite(position_m).all(axis=2))
    free: Booleans = np.asarray(known[:, lines].all(axis=2))
    stays = (position_m == position_m[:1]).all(axis=(0, 2))
    still = stays[lines].all(axis=1)
    first_m = position_m[0, lines[still]].reshape(-1, 6)
    free[:, still] &= _crossing_none(obstacles, first_m, exempt[still])
    for line in np.flatnonzero(free.any(axis=0) & ~still).tolist():
        (here,) = np.nonzero(free[:, line])
        ends_m = np.concatenate([position_m[here, end].T for end in lines[line]])
        free[here, line] = _bundle(obstacles, ends_m, exempt[line])
    return free


def _bundle(obstacles: Prisms, ends_m: Floats, exempt: Integers) -> Booleans:
    """Whether the lines of a bundle (6, line) are clear: all at once, or in two halves."""
    low, high = ends_m.min(axis=1), ends_m.max(axis=1)
    count = ends_m.shape[1]
    met = _met(obstacles, low, high, exempt)
    if not met.size:
        return np.ones(count, bool)
    if _through_one_wall(obstacles, met, low, high):
        return np.zeros(count, bool)
    if count <= FEW:
        return _crossing_none(obstacles, ends_m.T, np.tile(exempt, (count, 1)))
    order = np.argpartition(ends_m[np.argmax(high - low)], count // 2)
    free = np.empty(count, bool)
    for half in np.array_split(order, 2):
        free[half] = _bundle(obstacles, ends_m[:, half], exempt)
    return free


def _met(obstacles: Prisms, low: Floats, high: Floats, exempt: Integers) -> Integers:
    """Footprints of buildings in the hull of the two boxes that hold the ends of a bundle."""
    import shapely

    hull = shapely.convex_hull(shapely.multipoints(_corners(low, high).reshape(-1, 2)))
    footprint = obstacles.tree.query(hull, predicate="intersects")
    below = obstacles.roof_m[footprint] > min(low[2], low[5])
    exempted = (obstacles.building[footprint, None] == exempt).any(axis=1)
    return np.asarray(footprint[below & ~exempted])


def _through_one_wall(obstacles: Prisms, footprint: Integers, low: Floats, high: Floats) -> bool:
    """Whether all lines between two boxes go through the same wall of a building.

    Let s be how far a place stands before a wall [m] and |s'| how far one behind it. The line from
    one to the other meets the wall's plane at their mean with weights |s'| and s. That it does so
    beside the wall or above it is, times s + |s'|, affine in either place: if the lines between the
    corners of the boxes all go through the wall, from the same side, all lines do. It counts
    only if they do by `MARGIN_M`, which is far more than rounding.
    """
    import shapely

    rings = shapely.get_exterior_ring(obstacles.tree.geometries[footprint])
    corner_m, ring = shapely.get_coordinates(rings, return_index=True)
    (side,) = np.nonzero(ring[1:] == ring[:-1])
    way_m = corner_m[side + 1] - corner_m[side]
    length_m = np.hypot(*way_m.T)[:, None, None]
    along = way_m / length_m[:, 0]
    before = np.stack([-along[:, 1], along[:, 0]], axis=1)
    seen_m = _corners(low, high) - corner_m[side, None, None]  # (wall, box, corner, 2)
    near_m, far_m = np.moveaxis(np.einsum("wbck,wk->wbc", seen_m, before), 1, 0)
    here_m, there_m = np.moveaxis(np.einsum("wbck,wk->wbc", seen_m, along), 1, 0)
    roof_m = obstacles.roof_m[footprint][ring[side], None, None] - 2.0 * MARGIN_M
    near_m, far_m = near_m[:, :, None], far_m[:, None, :]
    opposite = (np.minimum(near_m, -far_m) > MARGIN_M) | (np.minimum(-near_m, far_m) > MARGIN_M)
    near_m, far_m = abs(near_m), abs(far_m)
    at_m = here_m[:, :, None] * far_m + there_m[:, None, :] * near_m
    height_m = high[2] * far_m + high[5] * near_m
    apart_m = near_m + far_m
    through = opposite & (height_m < roof_m * apart_m)
    through &= (at_m > MARGIN_M * apart_m) & (at_m < (length_m - MARGIN_M) * apart_m)
    return bool(through.all(axis=(1, 2)).any())


def _corners(low: Floats, high: Floats) -> Floats:
    """Corners on the map of the boxes of both ends (box, corner, 2) [m]."""
    return np.array(
        [[(x, y) for x in (low[k], high[k]) for y in (low[k + 1], high[k + 1])] for k in (0, 3)]
    )


def _crossing_none(obstacles: Prisms, ends_m: Floats, exempt: Integers) -> Booleans:
    """Whether lines, each by its six coordinates, are known and cross no building."""
    known = np.isfinite(ends_m).all(axis=1)
    free: Booleans = np.asarray(known).copy()
    free[known] = crossed(obstacles, ends_m[known, :3], ends_m[known, 3:], exempt[known]) == CLEAR
    return free
