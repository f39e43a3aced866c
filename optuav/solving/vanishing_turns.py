"""Points on the surfaces on which turns of an itinerary vanish, where its time has a cusp."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav.arrays import Floats
from optuav.physics.quantity import TINY
from optuav.solving.hover_region import Region
from optuav.solving.open_routes import OpenRoutes

STEPS, STEP_M = 8, 1e-3
"""Newton's method: steps, and the width of differences [m]."""
AT_BOUND_M, WITHIN_M = 1e-6, 1e-7
"""How near a bound of the region counts as at it, and how far beyond as rounding [m]."""
ZERO_RAD = 1e-7
"""A turn that has vanished but for rounding [rad]."""


def surfaces(
    routes: OpenRoutes,
    entry: int,
    where: Region,
    points_m: Floats,
    straight: tuple[int, ...] = (),
) -> Iterator[tuple[int, Floats]]:
    """Turns that vanish somewhere, and points moved there; one of those that vanish at once."""
    free = routes.taken(entry)
    seen: list[int] = list(straight)
    turns = len(free.turns_at(tuple(points_m[0])))
    for turn in range(turns):
        if turn in seen:
            continue
        on_m = moved_onto(routes, entry, where, points_m, (*straight, turn))
        if not len(on_m):
            continue
        angles = np.abs(free.turns_at(tuple(on_m.T)))
        seen += np.flatnonzero((angles < ZERO_RAD).all(axis=1)).tolist()
        yield turn, on_m


def moved_onto(
    routes: OpenRoutes, entry: int, where: Region, points_m: Floats, straight: tuple[int, ...]
) -> Floats:
    """Points (k, 3) [m] moved to where turns vanish, inside the region; those that arrive.

    Newton's method; a bound of the region at which or beyond which a point is counts as well.
    """
    free = routes.taken(entry)

    def excess(points: Floats) -> Floats:
        turns = free.turns_at(tuple(np.moveaxis(points, -1, 0)))
        kept = [np.asarray(turns[number])[..., None] for number in straight]
        return np.concatenate([*kept, where.beyond_m(points)], axis=-1)

    shifts = STEP_M * np.concatenate([np.eye(3), -np.eye(3)])[:, None]
    for _ in range(STEPS):
        now, sides = excess(points_m), excess(points_m + shifts)
        slopes = np.moveaxis(sides[:3] - sides[3:], 0, -1) / (2.0 * STEP_M)
        idle = now[:, len(straight) :] < -AT_BOUND_M
        now[:, len(straight) :][idle] = 0.0
        slopes[:, len(straight) :][idle] = 0.0
        step_m = (np.linalg.pinv(slopes) @ now[..., None])[..., 0]
        length_m = np.linalg.norm(step_m, axis=1, keepdims=True)
        points_m = points_m - step_m * np.minimum(1.0, where.radius_m / (length_m + TINY))
    left = excess(points_m)
    turned = np.abs(left[:, : len(straight)]).max(axis=1, initial=0.0)
    beyond_m = left[:, len(straight) :].max(axis=1)
    moved: Floats = points_m[(turned < ZERO_RAD) & (beyond_m < WITHIN_M)]
    return moved
