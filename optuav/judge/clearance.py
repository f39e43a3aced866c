"""The distance that bent ways keep from buildings, computed from the waypoints of a plan."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.network.prisms import MARGIN_M, prisms

if TYPE_CHECKING:
    import shapely

MITRE = 5.0  # Largest distance of a wall's corner from its building's corner, in clearances


class Near(NamedTuple):
    """A building that a way comes too near to."""

    building: int
    distance_m: float  # Above its roof, or else beside it; < 0 below the roof


def too_near(
    mission: Mission, points_m: Floats, own: tuple[int, int], clearance_m: float, slack: float
) -> Iterator[Near]:
    """Buildings closer than the clearance [m] to the way along points (point, 3) [m].

    A way may miss altitudes by a share `slack`, and walls by `MARGIN_M`. Its own buildings, on
    whose roofs it ends, do not count. Clearance is above a footprint, and beside it up to mitred
    corners; of a footprint beside which an end lies, above it only, and of a roof above which an
    end lies, the height of that end.
    """
    import shapely

    obstacles, ends_m = prisms(mission.buildings), points_m[[0, -1]]
    for start_m, end_m in pairwise(points_m):
        low_m, high_m = np.sort([start_m[:2], end_m[:2]], axis=0)[..., None]
        beyond_m = MITRE * clearance_m + MARGIN_M
        close = (obstacles.low_m <= high_m + beyond_m) & (obstacles.high_m >= low_m - beyond_m)
        line = shapely.LineString([start_m[:2], end_m[:2]])
        numbers = np.flatnonzero(close.all(axis=0) & ~np.isin(obstacles.building, own))
        for number, outline in zip(numbers, obstacles.inner(numbers), strict=True):
            roof_m = obstacles.roof_m[number]
            top_m, apart_m = roof_m + clearance_m, clearance_m
            if _over(outline, clearance_m, ends_m).any():
                apart_m = 0.0
                above = _over(outline, 0.0, ends_m) & (ends_m[:, 2] >= roof_m - 2.0 * MARGIN_M)
                top_m = min([top_m, *ends_m[above, 2]])
            lowest_m = _lowest_m(start_m, end_m, line, _wider(outline, apart_m - MARGIN_M))
            if lowest_m < top_m - slack * max(1.0, abs(top_m)):
                over_m = _lowest_m(start_m, end_m, line, outline)
                beside_m = float(line.distance(outline))
                away_m = over_m - roof_m if np.isfinite(over_m) else beside_m
                yield Near(int(obstacles.building[number]), float(away_m))


def _over(outline: shapely.Geometry, apart_m: float, points_m: Floats) -> Booleans:
    """Return whether points are over a footprint that is wider by a distance [m], or graze it."""
    import shapely

    wide = _wider(outline, apart_m + MARGIN_M)
    return np.asarray(shapely.intersects_xy(wide, *points_m[:, :2].T))


def _wider(outline: shapely.Geometry, apart_m: float) -> shapely.Geometry:
    """The footprint wider by a distance [m], or narrower by `MARGIN_M`."""
    import shapely

    # GEOS makes nothing of a footprint that grows by less than rounding.
    wide_m = apart_m if apart_m >= MARGIN_M else -MARGIN_M
    return shapely.buffer(outline, wide_m, join_style="mitre")


def _lowest_m(
    start_m: Floats, end_m: Floats, line: shapely.LineString, area: shapely.Geometry
) -> float:
    """Least altitude of a straight way over an area [m]; infinite where it is not over it."""
    import shapely

    if line.length <= MARGIN_M:
        upright = shapely.intersects_xy(area, *start_m[:2])
        return float(min(start_m[2], end_m[2])) if upright else np.inf
    at_m = shapely.get_coordinates(line.intersection(area))
    shares = np.hypot(*(at_m - start_m[:2]).T) / line.length
    if len(shares) == 0 or (shares.max() - shares.min()) * line.length <= MARGIN_M:
        return np.inf  # To graze a wall is not to cross it
    return float((start_m[2] + (end_m[2] - start_m[2]) * shares).min())
