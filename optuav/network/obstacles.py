"""Buildings as prisms from the ground up to their roofs, and the lines that cross them."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.mission.schema import Building

if TYPE_CHECKING:
    import shapely

MARGIN_M = 1e-6
"""How far walls and roofs are moved inwards [m], so that to graze a building is not to cross it."""
MOST_PAIRS = 1 << 21  # Lines that are tried at once, times buildings
BUILDINGS_PASSED = 4
"""About as many buildings a piece of a line passes, where they stand evenly on the map."""
REMEMBERED = 4
"""Sets of buildings whose prisms are kept: missions that are compared share theirs as a rule."""
CLEAR = -1  # In place of the number of a building: there is none
Outline: TypeAlias = tuple[tuple[float, float], ...]  # Corners of a footprint on the map [m]


@dataclass(frozen=True)
class Prisms:
    """Footprints with a spatial index."""

    footprints: tuple[Outline, ...]
    building: Integers  # Number of the building of every footprint
    roof_m: Floats  # Height of its roof over ground [m]

    @cached_property
    def tree(self) -> shapely.STRtree:
        """`shapely.STRtree` of the footprints, each smaller by `MARGIN_M` all round."""
        import shapely

        corners = np.array([corner for outline in self.footprints for corner in outline])
        ring = np.repeat(np.arange(len(self.footprints)), list(map(len, self.footprints)))
        outer = shapely.polygons(shapely.linearrings(corners.reshape(-1, 2), indices=ring))
        inner = np.asarray(shapely.buffer(outer, -MARGIN_M, join_style="mitre"))
        shapely.prepare(inner)
        return shapely.STRtree(inner)


def outline_m(building: Building) -> Outline | None:
    """Corners of a footprint on the map [m]; None if the building states none."""
    stated, (x, y, _) = building.footprint_m, building.position_m
    if stated is None or isinstance(stated[0], tuple):
        return stated
    width, depth = stated
    west, east, south, north = x - width / 2, x + width / 2, y - depth / 2, y + depth / 2
    return ((west, south), (east, south), (east, north), (west, north))


def prisms(mission: Mission) -> Prisms:
    """The mission's buildings that have a footprint."""
    outlines = tuple(map(outline_m, mission.buildings))
    return _prisms(outlines, tuple(each.position_m[2] for each in mission.buildings))


@lru_cache(maxsize=REMEMBERED)
def _prisms(stated: tuple[Outline | None, ...], top_m: tuple[float, ...]) -> Prisms:
    """Of all buildings, by outlines and heights."""
    building = np.array([k for k, each in enumerate(stated) if each is not None], dtype=np.intp)
    footprints = tuple(each for each in stated if each is not None)
    return Prisms(footprints, building, np.array(top_m, dtype=float)[building])


def crossed(obstacles: Prisms, start_m: Floats, end_m: Floats, exempt: Integers) -> Integers:
    """A building that each straight line (line, 3) [m] runs through, −1 for a clear way.

    A line crosses a building if it runs inside the footprint below the roof; to graze a wall, a
    corner or the roof is not to cross. The `exempt` buildings (line, k) do not block a line.
    """
    swap = (start_m[:, 2] > end_m[:, 2])[:, None]
    low_m, high_m = np.where(swap, end_m, start_m), np.where(swap, start_m, end_m)
    found = np.full(len(start_m), CLEAR, dtype=np.intp)
    count = len(obstacles.building)
    if not count:
        return found
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
    known = np.asarray(np.isfinite(position_m).all(axis=2))
    free = np.asarray(known[:, lines].all(axis=2))
    moves = (position_m != position_m[:1]).any(axis=(0, 2))[lines].any(axis=1)
    first = np.arange(len(position_m))[:, None] == 0
    # A line that is the same in all variants is tried once.
    variant, line = np.nonzero(free & (moves | first))
    start_m, end_m = np.moveaxis(position_m[variant[:, None], lines[line]], 1, 0)
    blocked = np.zeros_like(free)
    blocked[variant, line] = crossed(obstacles, start_m, end_m, exempt[line]) != CLEAR
    free &= ~np.where(moves, blocked, blocked[:1])
    return free
