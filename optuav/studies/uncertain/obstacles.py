"""Which of many bundles of lines have a clear way between the buildings."""

from __future__ import annotations

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.obstacles import CLEAR, MARGIN_M, Prisms, crossed

FEW = 256
"""Lines of a bundle that are tried one by one rather than as a bundle."""


def clear(obstacles: Prisms, position_m: Floats, lines: Integers, exempt: Integers) -> Booleans:
    """Whether lines between places cross no building; False where an end is not known.

    Parameters
    ----------
    obstacles
        The buildings.
    position_m
        Places (variant, place, 3) [m].
    lines
        Numbers of the two places that each line joins (line, 2).
    exempt
        Buildings that do not block a line (line, k), by number; negative for none.

    Returns
    -------
    (variant, line)
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
    corners of the boxes all go through the wall, from the same side, all lines do. They are told to
    do so only if they do by `MARGIN_M`, which is far more than rounding.
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
    known = np.isfinite(ends_m).all(axis=1)
    free: Booleans = np.asarray(known).copy()
    free[known] = crossed(obstacles, ends_m[known, :3], ends_m[known, 3:], exempt[known]) == CLEAR
    return free
