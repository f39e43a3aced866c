"""Towns of any size: the shipped mission with roofs at random on its map."""

from __future__ import annotations

import numpy as np

from optuav.mission import Mission, load

LOW_M, HIGH_M = (0.0, 0.0, 30.0), (2000.0, 2000.0, 100.0)


def town(buildings: int) -> Mission:
    """The mission `paper` with that many buildings in place of its own."""
    chance = np.random.default_rng(1)
    roofs_m = chance.uniform(LOW_M, HIGH_M, (buildings, 3)).tolist()
    rows = [{"name": f"x{k}", "position_m": roof_m} for k, roof_m in enumerate(roofs_m)]
    return load("paper").replace({"buildings": rows})
