"""The shortest way past walls on the map, by the lines of sight between their corners."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats
from optuav.network.prisms import MARGIN_M
from optuav.physics.quantity import TINY

BESIDE_M = 10.0 * MARGIN_M  # Neighbours of a corner that are no farther from a line are on it


def shortest_past(walls: npt.NDArray[np.object_], ends_m: Floats) -> Floats | None:
    """Points (point, 2) [m] of the shortest way between ends (end, 2) [m] past prepared polygons.

    It bends at their corners, moved out by twice `MARGIN_M`. None without a way.
    """
    import shapely
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    corners_m, before_m, after_m = _corners(walls)
    outside = ~shapely.intersects_xy(walls[:, None], *corners_m.T).any(axis=0)
    nodes_m, *beside_m = (
        np.concatenate([ends_m, each_m[outside]]) for each_m in (corners_m, before_m, after_m)
    )
    i, j = np.nonzero(np.triu(_tangent(nodes_m, *beside_m), 1))
    free = _clear(walls, nodes_m[i], nodes_m[j])
    i, j = i[free], j[free]
    length_m = np.maximum(np.hypot(*(nodes_m[j] - nodes_m[i]).T), TINY)  # 0 is no edge
    edges = csr_array((length_m, (i, j)), shape=(len(nodes_m), len(nodes_m)))
    reached_m, last = dijkstra(edges, directed=False, indices=[0], return_predecessors=True)
    if not np.isfinite(reached_m[0, 1]):
        return None
    path = [1]
    while path[-1]:
        path.append(int(last[0, path[-1]]))
    path_m = nodes_m[path[::-1]]
    other = (np.diff(path_m, axis=0) != 0.0).any(axis=1)  # Walls may share a corner
    return np.asarray(path_m[np.append(True, other)])


def _corners(walls: npt.NDArray[np.object_]) -> tuple[Floats, Floats, Floats]:
    """Corners of polygons (corner, 2) [m] moved out, and those before and after each."""
    import shapely

    wider = shapely.buffer(walls, 2.0 * MARGIN_M, join_style="mitre")
    rings = shapely.get_rings(shapely.get_parts(wider))
    points_m, ring = shapely.get_coordinates(rings, return_index=True)
    # A ring ends with the corner where it begins.
    first = np.flatnonzero(np.diff(ring, prepend=-1))
    final = np.append(first[1:], len(ring)) - 1
    before = np.arange(len(ring)) - 1
    before[first] = final - 1
    corner = np.delete(np.arange(len(ring)), final)
    return points_m[corner], points_m[before[corner]], points_m[corner + 1]


def _tangent(nodes_m: Floats, before_m: Floats, after_m: Floats) -> Booleans:
    """Which lines between nodes (node, node) touch the walls at both ends, and do not enter them.

    Only these are on a shortest way: it bends at a corner around the wall. Ends of the way stand
    among the nodes with themselves before and after.
    """
    x, y = (nodes_m[None] - nodes_m[:, None]).transpose(2, 0, 1)
    length_m = np.maximum(np.hypot(x, y), TINY)
    x, y = x / length_m, y / length_m
    sides_m = [
        x * (each_m - nodes_m)[:, None, 1] - y * (each_m - nodes_m)[:, None, 0]
        for each_m in (before_m, after_m)
    ]
    enters = (np.minimum(*sides_m) < -BESIDE_M) & (np.maximum(*sides_m) > BESIDE_M)
    return np.asarray(~(enters | enters.T))


def _clear(walls: npt.NDArray[np.object_], start_m: Floats, end_m: Floats) -> Booleans:
    """Which straight lines (line, 2) [m] meet no wall."""
    import shapely

    lines = np.asarray(shapely.linestrings(np.stack([start_m, end_m], axis=1)))
    low_m, high_m = np.minimum(start_m, end_m).T.copy(), np.maximum(start_m, end_m).T.copy()
    left = np.arange(len(lines))
    for wall, (x, y, far_x, far_y) in zip(walls, shapely.bounds(walls), strict=True):
        near = (high_m[0] >= x) & (low_m[0] <= far_x) & (high_m[1] >= y) & (low_m[1] <= far_y)
        (near,) = np.nonzero(near)
        met = near[shapely.intersects(wall, lines[left[near]])]
        if len(met):
            left, low_m, high_m = (np.delete(ends, met, axis=-1) for ends in (left, low_m, high_m))
    free = np.zeros(len(lines), bool)
    free[left] = True
    return free
