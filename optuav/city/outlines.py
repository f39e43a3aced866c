"""Outlines that cross themselves are mended, within limits of time and memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from optuav.arrays import Booleans, Integers
from optuav.errors import Fault, InputError
from optuav.mission.files import label

POLYGON = shapely.GeometryType.POLYGON  # Collections have larger numbers
MOST_CROSSINGS = 100_000  # Crossings in one file: mending takes time and memory by their number
MOST_PAIRS = 5_000_000  # Pairs of edges, with overlapping boxes, that are compared for it
EDGES_AT_ONCE = 64  # Edges that are compared before the limits are checked


def mended(
    shapes: npt.NDArray[np.object_], names: Any, file: Path
) -> tuple[npt.NDArray[np.object_], Booleans]:
    """Valid shapes, and which of them were not valid."""
    broken = np.asarray(~shapely.is_valid(shapes) & ~shapely.is_missing(shapes))
    shapes = shapes.copy()
    if (at := _too_tangled(shapes[broken])) is not None:
        words = f"is too tangled to be mended: the outlines of a file may have {MOST_CROSSINGS} "
        words += f"crossings and {MOST_PAIRS} pairs of edges side by side; simplify this outline"
        raise InputError([Fault(f"feature {names[broken][at]}", "", words, label(file))])
    shapes[broken] = shapely.make_valid(shapes[broken], method="structure", keep_collapsed=False)
    return shapes, broken


def _too_tangled(shapes: npt.NDArray[np.object_]) -> int | None:
    """The number of the first shape that makes too much work together with those before it.

    Every shape is scaled to a cell of its own, so that it is compared with no other.
    """
    parts, of = parts_of(shapes)
    rings, part = shapely.get_rings(parts, return_index=True)
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    ends = shapely.bounds(shapes)
    low, size = ends[:, :2], ends[:, 2:] - ends[:, :2]
    of, joined = of[part[ring]], ring[1:] == ring[:-1]
    corners = (corners - low[of]) / np.where(size > 0.0, size, 1.0)[of]
    corners[:, 0] += 2.0 * of
    edges = shapely.linestrings(np.stack([corners[:-1], corners[1:]], axis=1)[joined])
    of, tree = of[1:][joined], shapely.STRtree(edges)
    crossings, pairs = 2 * MOST_CROSSINGS, 2 * MOST_PAIRS  # Each is met from both sides
    for first in range(0, len(edges), EDGES_AT_ONCE):
        some = edges[first : first + EDGES_AT_ONCE]
        pairs -= tree.query(some).shape[1]
        if pairs >= 0:  # Each meets itself and its neighbours
            crossings += 3 * EDGES_AT_ONCE - tree.query(some, predicate="intersects").shape[1]
        if min(pairs, crossings) < 0:
            return int(of[first])
    return None


def parts_of(shapes: npt.NDArray[np.object_]) -> tuple[npt.NDArray[np.object_], Integers]:
    """The single shapes that others consist of, and the number of the shape of each."""
    parts, of = shapes, np.arange(len(shapes))
    while (shapely.get_type_id(parts) > POLYGON).any():  # What collections collect
        parts, within = shapely.get_parts(parts, return_index=True)
        of = of[within]
    return parts, of
