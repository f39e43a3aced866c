"""Where a straight line from a point may end without crossing a building, as half-spaces.

Seen from a point, a building hides what lies inside the cone around its outline and behind it. Its
complement is a union of half-spaces: before a facade that faces the point, above the roof, or
beyond one of the planes through the point and an edge of the outline. In each of them no line from
the point meets the building.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats

UP = np.array([0.0, 0.0, 1.0])
SLACK_M = 1e-6
"""Rounding of points on a plane that goes through them [m]."""


class Side(NamedTuple):
    """The points w with normal·w ≥ least_m; the normal has length 1."""

    normal: Floats
    least_m: float

    def depth_m(self, points_m: Floats) -> Floats:
        """How far points (point, 3) [m] are inside, negative outside [m]."""
        depth: Floats = points_m @ self.normal - self.least_m
        return depth


def clear_sides(outline_m: Floats, roof_m: float, from_m: Floats) -> list[Side]:
    """Half-spaces in which every line from a point passes a building by.

    Parameters
    ----------
    outline_m
        Corners of the building on the map (corner, 2) [m]; their convex hull counts.
    roof_m
        Height of the roof [m]; below it, the building reaches down without end.
    from_m
        Where the lines begin [m], outside the building.

    Returns
    -------
    Half-spaces that together hold every point not hidden by that hull. The point itself is in each
    of them or on its plane.
    """
    import shapely

    hull = shapely.get_coordinates(shapely.MultiPoint(outline_m).convex_hull)[:-1]
    roof = np.column_stack([hull, np.full(len(hull), roof_m)])
    return [
        side
        for side in _planes(roof, from_m)
        # The building is outside: the corners of the roof, and all that is below them.
        if side.normal[2] >= 0.0
        and (side.depth_m(roof) <= SLACK_M).all()
        and side.depth_m(from_m[None])[0] >= -SLACK_M
    ]


def _planes(roof: Floats, from_m: Floats) -> Iterator[Side]:
    """Both sides of the roof, of the facades, and of the planes through a point and an edge."""
    found = [(UP, roof[0])]
    for corner, following in zip(roof, np.roll(roof, -1, axis=0), strict=True):
        edge, view = following - corner, from_m - corner
        found += [(np.cross(along, UP), corner) for along in (edge, view)]
        found.append((np.cross(edge, view), corner))
    for normal, point in found:
        length = float(np.linalg.norm(normal))
        if length > 0.0:
            for unit in (normal / length, -normal / length):
                yield Side(unit, float(unit @ point))
