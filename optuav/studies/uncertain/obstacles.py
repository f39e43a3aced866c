"""Which of many bundles of lines have a clear way between the buildings."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from optuav.mission.sight import CLEAR, Numbers, Points, Prisms, crossed

FEW = 256
"""Lines of a bundle that are tried one by one rather than as a bundle."""

Booleans = npt.NDArray[np.bool_]


def clear(obstacles: Prisms, start_m: Points, end_m: Points, exempt: Numbers) -> Booleans:
    """Whether lines cross no building; False where an end is not known.

    Parameters
    ----------
    obstacles
        The buildings.
    start_m, end_m
        Ends of the lines (variant, line, 3) [m].
    exempt
        Buildings that do not block a line (line, k), by number; negative for none.

    Returns
    -------
    (variant, line)
    """
    ends_m = np.concatenate([start_m, end_m], axis=2)
    free: Booleans = np.asarray(np.isfinite(ends_m).all(axis=2))
    still = (ends_m == ends_m[:1]).all(axis=(0, 2))
    free[:, still] = _crossing_none(obstacles, ends_m[0, still], exempt[still])
    for line in np.flatnonzero(free.any(axis=0) & ~still).tolist():
        known = np.flatnonzero(free[:, line])
        free[known, line] = _bundle(obstacles, ends_m[known, line], exempt[line])
    return free


def _bundle(obstacles: Prisms, ends_m: Points, exempt: Numbers) -> Booleans:
    """Whether the lines of a bundle (line, 6) are clear: all at once, or in two halves."""
    low, high = ends_m.min(axis=0), ends_m.max(axis=0)
    if not _may_cross(obstacles, low, high, exempt):
        return np.ones(len(ends_m), bool)
    if len(ends_m) <= FEW:
        return _crossing_none(obstacles, ends_m, np.tile(exempt, (len(ends_m), 1)))
    widest = ends_m[:, np.argmax(high - low)]
    order = np.argsort(widest, kind="stable")
    free = np.empty(len(ends_m), bool)
    for half in np.array_split(order, 2):
        free[half] = _bundle(obstacles, ends_m[half], exempt)
    return free


def _may_cross(obstacles: Prisms, low: Points, high: Points, exempt: Numbers) -> bool:
    """Whether a building stands in the hull of the two boxes that hold the ends of a bundle."""
    import shapely

    corners = [(x, y) for k in (0, 3) for x in (low[k], high[k]) for y in (low[k + 1], high[k + 1])]
    hull = shapely.convex_hull(shapely.multipoints(corners))
    footprint = obstacles.tree.query(hull, predicate="intersects")
    below = obstacles.roof_m[footprint] > min(low[2], low[5])
    exempted = (obstacles.building[footprint, None] == exempt).any(axis=1)
    return bool((below & ~exempted).any())


def _crossing_none(obstacles: Prisms, ends_m: Points, exempt: Numbers) -> Booleans:
    known = np.isfinite(ends_m).all(axis=1)
    free: Booleans = np.asarray(known).copy()
    free[known] = crossed(obstacles, ends_m[known, :3], ends_m[known, 3:], exempt[known]) == CLEAR
    return free
