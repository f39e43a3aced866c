"""What stands in the way: buildings as prisms from the ground up to their roofs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from optuav.mission.schema import Mission
from optuav.mission.sections import Building

Points = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.intp]

ALTITUDE_TOLERANCE_M = 1e-9
LINES_AT_ONCE = 4096


@dataclass(frozen=True)
class Prisms:
    """Footprints with a spatial index.

    Parameters
    ----------
    tree
        `shapely.STRtree` of the footprints.
    building
        Number of the building of every footprint.
    roof_m
        Height of its roof over ground [m].
    """

    tree: Any
    building: Numbers
    roof_m: Points


def outline_m(building: Building) -> tuple[tuple[float, float], ...] | None:
    """Corners of a footprint on the map [m]; None if the building states none."""
    stated = building.footprint_m
    if stated is None:
        return None
    if isinstance(stated[0], tuple):
        return stated
    (x, y, _), (width, depth) = building.position_m, stated
    west, east, south, north = x - width / 2, x + width / 2, y - depth / 2, y + depth / 2
    return ((west, south), (east, south), (east, north), (west, north))


def prisms(mission: Mission) -> Prisms:
    """The mission's buildings that have a footprint."""
    import shapely

    outlines = [outline_m(building) for building in mission.buildings]
    with_footprint = [k for k, outline in enumerate(outlines) if outline is not None]
    rings = [outlines[k] for k in with_footprint]
    return Prisms(
        shapely.STRtree([shapely.Polygon(ring) for ring in rings]),
        np.array(with_footprint, dtype=np.intp),
        np.array([mission.buildings[k].position_m[2] for k in with_footprint], dtype=float),
    )


def crossings(
    obstacles: Prisms, start_m: Points, end_m: Points, exempt: Numbers
) -> tuple[Numbers, Numbers]:
    """Which straight lines run through which buildings.

    A line crosses a prism if it runs inside the footprint below the roof; to graze a wall, a corner
    or the roof is not to cross.

    Parameters
    ----------
    obstacles
        The buildings.
    start_m, end_m
        Ends of the lines (line, 3) [m].
    exempt
        Buildings that do not block a line (line, k), by number; −1 for none.

    Returns
    -------
    Numbers of lines and of buildings, one pair an entry.
    """
    found = [
        _crossings_of(obstacles, start_m[part], end_m[part], exempt[part], part.start)
        for first in range(0, len(start_m), LINES_AT_ONCE)
        for part in (slice(first, first + LINES_AT_ONCE),)
    ]
    if not found:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    return (
        np.concatenate([lines for lines, _ in found]),
        np.concatenate([buildings for _, buildings in found]),
    )


def _crossings_of(
    obstacles: Prisms, start_m: Points, end_m: Points, exempt: Numbers, offset: int
) -> tuple[Numbers, Numbers]:
    import shapely

    plans: Any = shapely.linestrings(np.stack([start_m[:, :2], end_m[:, :2]], axis=1))
    upright = (start_m[:, :2] == end_m[:, :2]).all(axis=1)
    plans[upright] = shapely.points(start_m[upright, :2])
    line, footprint = obstacles.tree.query(plans, predicate="intersects")
    low = np.minimum(start_m[line, 2], end_m[line, 2])
    candidate = low < obstacles.roof_m[footprint] - ALTITUDE_TOLERANCE_M
    candidate &= (exempt[line] != obstacles.building[footprint][:, None]).all(axis=1)
    line, footprint = line[candidate], footprint[candidate]
    outlines = obstacles.tree.geometries[footprint]
    inside = ~shapely.touches(plans[line], outlines)
    line, footprint, outlines = line[inside], footprint[inside], outlines[inside]
    lowest = _lowest_altitude(plans[line], outlines, start_m[line], end_m[line])
    below = lowest < obstacles.roof_m[footprint] - ALTITUDE_TOLERANCE_M
    return (line[below] + offset).astype(np.intp), obstacles.building[footprint[below]]


def _lowest_altitude(plans: Any, outlines: Any, start_m: Points, end_m: Points) -> Points:
    """Least altitude [m] of each line over its outline; it is linear, so an end has it."""
    import shapely

    way = end_m[:, :2] - start_m[:, :2]
    squared_length = (way**2).sum(axis=1)
    points, index = shapely.get_coordinates(
        shapely.intersection(plans, outlines), return_index=True
    )
    along = ((points - start_m[index, :2]) * way[index]).sum(axis=1)
    share = along / np.where(squared_length > 0.0, squared_length, 1.0)[index]
    first, last = np.full(len(plans), np.inf), np.full(len(plans), -np.inf)
    np.minimum.at(first, index, share)
    np.maximum.at(last, index, share)
    rise = end_m[:, 2] - start_m[:, 2]
    over = np.minimum(start_m[:, 2] + first * rise, start_m[:, 2] + last * rise)
    upright = squared_length == 0.0
    return np.where(upright, np.minimum(start_m[:, 2], end_m[:, 2]), over)
