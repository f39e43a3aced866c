"""Buildings as prisms from the ground up to their roofs, sorted into the cells of a map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers, ragged
from optuav.mission.buildings import Buildings
from optuav.physics.quantity import TINY

MARGIN_M = 1e-6
"""How far walls and roofs are moved inwards [m], so that to graze a building is not to cross it."""
FEW = 32  # So many footprints are all tried on every line


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
    # What was asked for, see `inner` and `inscribed_m`; None and NaN for others
    made: npt.NDArray[np.object_]
    radius_m: Floats

    @cached_property
    def middle_m(self) -> Floats:
        """Middle of every box (axis, footprint) [m]."""
        return 0.5 * (self.low_m + self.high_m)

    @cached_property
    def first(self) -> Integers:
        """Number of the first corner of every footprint."""
        return np.cumsum(self.sizes) - self.sizes

    def inscribed_m(self, footprint: Integers) -> Floats:
        """Radius of a disc around the middle of its box within some of the footprints [m], or 0.

        Each is computed when first asked for.
        """
        if len(new := np.unique(footprint[np.isnan(self.radius_m[footprint])])):
            ring, corner = ragged(self.first[new], sizes := self.sizes[new])
            first, last = np.cumsum(sizes) - sizes, np.cumsum(sizes) - 1
            after = np.arange(1, 1 + len(corner))
            after[last] = first
            start_m = self.corners_m[corner].T - self.middle_m[:, new[ring]]
            end_m = start_m[:, after]
            edge_m = end_m - start_m
            share = -(start_m * edge_m).sum(axis=0) / np.maximum((edge_m**2).sum(axis=0), TINY)
            away_m = np.hypot(*(start_m + np.clip(share, 0.0, 1.0) * edge_m))
            # A ray from the middle along x leaves the footprint once more than it enters.
            area = start_m[0] * end_m[1] - start_m[1] * end_m[0]
            leaves = ((start_m[1] > 0.0) != (end_m[1] > 0.0)) & ((area > 0.0) == (edge_m[1] > 0.0))
            within = np.bitwise_xor.reduceat(leaves, first)
            self.radius_m[new] = np.where(within, np.minimum.reduceat(away_m, first), 0.0)
        return self.radius_m[footprint]

    @property
    def polygons(self) -> npt.NDArray[np.object_]:
        """The footprints as polygons of `shapely`."""
        return self.inner(np.arange(len(self.sizes)))

    def inner(self, footprint: Integers) -> npt.NDArray[np.object_]:
        """Some of the footprints as polygons of `shapely`, each made when first asked for."""
        import shapely

        if len(new := np.unique(footprint[shapely.is_missing(self.made[footprint])])):
            ring, corner = ragged(self.first[new], self.sizes[new])
            outer = shapely.polygons(shapely.linearrings(self.corners_m[corner], indices=ring))
            self.made[new] = shapely.buffer(outer, -MARGIN_M, join_style="mitre")
            shapely.prepare(self.made[new])
        return self.made[footprint]


@lru_cache(maxsize=4)
def prisms(buildings: Buildings) -> Prisms:
    """The buildings that have a footprint; missions that are compared share theirs as a rule."""
    corners_m, count = buildings.outlines()
    (number,) = np.nonzero(count)
    return prisms_of(corners_m, count[number], number, buildings.roof_m[number, 2])


def prisms_of(corners: Floats, sizes: Integers, building: Integers, roof_m: Floats) -> Prisms:
    """Prisms of columns: all corners (corner, axis) [m], their numbers by footprint, and roofs [m].

    The numbers of their buildings rise from footprint to footprint.
    """
    count, first = len(sizes), np.cumsum(sizes) - sizes
    low_m, high_m = (each.reduceat(corners, first).T for each in (np.minimum, np.maximum))
    low_m, high_m = low_m + MARGIN_M, high_m - MARGIN_M
    # Four corners, and every edge along an axis.
    (four,) = np.nonzero((sizes == 4) & (low_m < high_m).all(axis=0))
    ring = corners[first[four, None] + np.arange(4)]
    is_box = np.zeros(len(sizes), bool)
    is_box[four] = ((ring != np.roll(ring, 1, axis=1)).sum(axis=2) == 1).all(axis=1)
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
    footprint, number = ragged(np.zeros_like(entries), entries)
    x, y = first[:, footprint] + np.divmod(number, spans[1, footprint])
    numbers = x * across + y, y * across + x
    in_cells = [footprint[np.argsort(each, kind="stable")] for each in numbers]
    begins = [np.cumsum(np.bincount(each + 1, minlength=across**2 + 1)) for each in numbers]
    shapes = corners, sizes, low_m, high_m, is_box, building, roof_m
    asked = np.full(count, None, dtype=object), np.full(count, np.nan)
    return Prisms(*shapes, map_low_m, cell_m, across, in_cells, begins, *asked)
