"""Lasers moved in the plane from the sites chosen, as far as no place comes into or out of sight.

Where sight of the laser begins or ends the hover time jumps, so that no bound on its slope holds
across. Within such borders it is tried point by point, each computed exactly as at a candidate, and
what is found is the best of these points, without a bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.options import Perspective
from optuav.siting.table import with_laser_at

LAST_M = 1.0  # Shortest step [m]
WORTHWHILE = 1e-5  # Relative; for less no laser is moved
ANGLES = np.arange(8) * np.pi / 4.0
AROUND = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(8)])  # Steps to all sides


def refined(
    missions: Sequence[Mission],
    position_m: Floats,
    reach_m: Floats,
    perspective: Perspective,
    value: Callable[[Floats], float],
) -> tuple[Floats, Floats]:
    """Better places of the lasers (laser, 3) [m], and the hover times there (mission, laser) [s].

    Each stays within its reach (laser,) [m] and at its height. What is made large is the `value` of
    hover times (mission, laser) [s], of which each mission takes the longest.
    """
    start_m, position_m = position_m, position_m.copy()
    tables = [_tried(missions, each[None], perspective) for each in start_m]
    hover_s = np.concatenate([each for each, _ in tables], axis=1)
    best, step_m = value(hover_s), 0.5 * reach_m.max(initial=0.0)
    while step_m >= LAST_M:
        before = best
        for laser, (_, lit) in enumerate(tables):
            points_m = position_m[laser] + step_m * AROUND
            far_m = np.linalg.norm(points_m - start_m[laser], axis=1)
            points_m = points_m[far_m <= reach_m[laser]]
            if not len(points_m):
                continue
            found_s, seen = _tried(missions, points_m, perspective)
            for point in np.flatnonzero((seen == lit).all(axis=1)).tolist():
                changed_s = hover_s.copy()
                changed_s[:, laser] = found_s[:, point]
                if (reached := value(changed_s)) > best + WORTHWHILE * abs(best):
                    best, hover_s, position_m[laser] = reached, changed_s, points_m[point]
        if best <= before + WORTHWHILE * abs(before):
            step_m *= 0.5
    return position_m, hover_s


def _tried(
    missions: Sequence[Mission], points_m: Floats, perspective: Perspective
) -> tuple[Floats, Booleans]:
    """Hover times at points (mission, point) [s], and what is lit there (point, place of all)."""
    hover_s, seen = np.empty((len(missions), len(points_m))), list[Booleans]()
    for numbers, some_s, lit in with_laser_at(missions, points_m, perspective):
        hover_s[numbers] = some_s
        seen += [*lit]
    return hover_s, np.concatenate(seen, axis=1)
