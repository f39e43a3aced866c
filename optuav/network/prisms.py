"""Buildings as prisms from the ground up to their roofs, sorted into the cells of a map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers, ragged
from optuav.mission.buildings import Buildings

MARGIN_M = 1e-6
"""Shift of walls and roofs inwards [m]: grazing a building is not crossing it."""


class Cells(NamedTuple):
    """The cells of a map: as many across as along, each with the footprints that reach into it.

    They are numbered along y within x, and again along x within y.
    """

    low_m: Floats  # Where they begin (axis, 1) [m]
    size_m: Floats  # Size of each (axis, 1) [m]
    across: int
    # By numbering: footprints in the order of the cells, and where each cell's footprints begin.
    footprints: Sequence[Integers]
    begins: Sequence[Integers]


@dataclass(frozen=True)
class Prisms:
    """Footprints, each smaller by `MARGIN_M` all round."""

    corners_m: Floats  # Corners of all footprints as stated (corner, axis) [m]
    sizes: Integers  # Number of corners of every footprint
    # Ends of the box around it (axis, footprint) [m], and whether it fills that box.
    low_m: Floats
    high_m: Floats
    is_box: Booleans
    building: Integers  # Number of its building; they rise from footprint to footprint
    roof_m: Floats  # Height of its roof over ground [m]
    made: npt.NDArray[np.object_]  # What `inner` was asked for, None for others

    @cached_property
    def middle_m(self) -> Floats:
        """Middle of every box (axis, footprint) [m]."""
        return 0.5 * (self.low_m + self.high_m)

    @cached_property
    def first(self) -> Integers:
        """Number of the first corner of every footprint."""
        return np.cumsum(self.sizes) - self.sizes

    @cached_property
    def cells(self) -> Cells:
        """The map, in cells no smaller than footprints as a rule, so that each reaches into few."""
        out_m = np.stack([self.low_m - MARGIN_M, self.high_m + MARGIN_M])
        map_low_m = out_m[0].min(axis=1, keepdims=True)
        reach_m = out_m[1].max(axis=1, keepdims=True) - map_low_m
        typical_m = np.sqrt(((out_m[1] - out_m[0]) ** 2).mean(axis=1, keepdims=True))
        across = max(1, int(min((reach_m / typical_m).min(), math.sqrt(len(self.sizes)))))
        cell_m = reach_m / across
        first, last = np.clip(((out_m - map_low_m) / cell_m).astype(np.intp), 0, across - 1)
        entries = (spans := last - first + 1).prod(axis=0)
        footprint, number = ragged(np.zeros_like(entries), entries)
        x, y = first[:, footprint] + np.divmod(number, spans[1, footprint])
        numbers = x * across + y, y * across + x
        in_cells = [footprint[np.argsort(cell, kind="stable")] for cell in numbers]
        begins = [np.cumsum(np.bincount(cell + 1, minlength=across**2 + 1)) for cell in numbers]
        return Cells(map_low_m, cell_m, across, in_cells, begins)

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
    (building,) = np.nonzero(count)
    sizes = count[building]
    first = np.cumsum(sizes) - sizes
    low_m, high_m = (extreme.reduceat(corners_m, first).T for extreme in (np.minimum, np.maximum))
    low_m, high_m = low_m + MARGIN_M, high_m - MARGIN_M
    # Four corners, and every edge along an axis.
    (four,) = np.nonzero((sizes == 4) & (low_m < high_m).all(axis=0))
    ring = corners_m[first[four, None] + np.arange(4)]
    is_box = np.zeros(len(sizes), bool)
    is_box[four] = ((ring != np.roll(ring, 1, axis=1)).sum(axis=2) == 1).all(axis=1)
    made, roof_m = np.full(len(sizes), None, dtype=object), buildings.roof_m[building, 2]
    return Prisms(corners_m, sizes, low_m, high_m, is_box, building, roof_m, made)
