"""Towns of any size: the shipped mission with roofs at random on its map, or on a larger one."""

from __future__ import annotations

import math

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission, load
from optuav.network.prisms import Prisms, prisms_of

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


def slanting_town(
    buildings: int, footprint_m: float, apart_m: float
) -> tuple[Prisms, Floats, float]:
    """Prisms of squares in any direction, points on their roofs [m], and the town's side [m]."""
    chance, roofs_m = _roofs(buildings, apart_m)
    turn = chance.uniform(0.0, np.pi / 2, (buildings, 1)) + np.arange(4) * np.pi / 2
    corners_m = footprint_m / math.sqrt(2) * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    corners_m = (roofs_m[:, None, :2] + corners_m).reshape(-1, 2)
    sizes, number = np.full(buildings, 4), np.arange(buildings)
    side_m = apart_m * math.sqrt(buildings)
    return prisms_of(corners_m, sizes, number, roofs_m[:, 2]), roofs_m, side_m
