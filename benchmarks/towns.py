"""Towns of any size: the shipped mission with roofs at random on its map, or on a larger one."""

from __future__ import annotations

import math

import numpy as np

from optuav.mission import Mission, load

LOW_M, HIGH_M = (0.0, 0.0, 30.0), (2000.0, 2000.0, 100.0)


def town(buildings: int, footprint_m: float | None = None, apart_m: float | None = None) -> Mission:
    """The mission `paper` with that many buildings in place of its own.

    With square footprints if a side is given [m], and as dense as squares of side `apart_m` [m].
    """
    chance = np.random.default_rng(1)
    side_m = HIGH_M[0] if apart_m is None else apart_m * math.sqrt(buildings)
    roofs_m = chance.uniform(LOW_M, (side_m, side_m, HIGH_M[2]), (buildings, 3)).tolist()
    walls = {} if footprint_m is None else {"footprint_m": [footprint_m, footprint_m]}
    rows = [{"name": f"x{k}", "position_m": at, **walls} for k, at in enumerate(roofs_m)]
    return load("paper").replace({"buildings": rows})
