"""Towns of any size: the shipped mission with roofs at random on its map, or on a larger one."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission, load
from optuav.mission.building_columns import of_polygons

Outline: TypeAlias = tuple[tuple[int, int], ...]

LOW_M, HIGH_M = (0.0, 0.0, 30.0), (2000.0, 2000.0, 100.0)


def _roofs(buildings: int, apart_m: float | None) -> tuple[np.random.Generator, Floats]:
    """Roofs at random (building, 3) [m], and the generator that drew them."""
    chance = np.random.default_rng(1)
    side_m = HIGH_M[0] if apart_m is None else apart_m * math.sqrt(buildings)
    return chance, chance.uniform(LOW_M, (side_m, side_m, HIGH_M[2]), (buildings, 3))


def town(buildings: int, footprint_m: float | None = None, apart_m: float | None = None) -> Mission:
    """The mission `paper` with that many buildings in place of its own.

    With square footprints if a side is given [m], and as dense as squares of side `apart_m` [m].
    """
    _, roofs_m = _roofs(buildings, apart_m)
    table = dict(zip(("x_m", "y_m", "z_m"), roofs_m.T, strict=True))
    if footprint_m is not None:
        table |= dict.fromkeys(("width_m", "depth_m"), np.full(buildings, footprint_m))
    return load("paper").with_buildings({"name": [f"x{k}" for k in range(buildings)], **table})


SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
HALF_CROSS = ((-1, -3), (1, -3), (1, -1), (3, -1), (3, 1), (1, 1))
CROSS = (*HALF_CROSS, *((-x, -y) for x, y in HALF_CROSS))


def slanting_town(
    buildings: int, footprint_m: float, apart_m: float, outline: Outline = SQUARE
) -> Mission:
    """The mission `paper` in the middle of a town of outlines of some size in any direction."""
    chance, roofs_m = _roofs(buildings, apart_m)
    turn = chance.uniform(0.0, 2.0 * np.pi, (buildings, 1))
    x, y = footprint_m * np.array(outline).T / np.ptp(outline)
    offsets_m = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
    corners_m = (roofs_m[:, None, :2] + np.stack(offsets_m, axis=-1)).reshape(-1, 2)
    names, count = [f"x{k}" for k in range(buildings)], np.full(buildings, len(x))
    half_m = apart_m * math.sqrt(buildings) / 2
    return load("paper").replace(
        {
            "route.origin_m": (half_m - 300.0, half_m, 130.0),
            "route.destination_m": (half_m + 300.0, half_m, 130.0),
            "link.device_m": (half_m, half_m + 300.0, 0.0),
            "limits.min_altitude_m": 130.0,
            "limits.max_altitude_m": 200.0,
            "buildings": of_polygons(names, roofs_m, corners_m, count),
        }
    )
