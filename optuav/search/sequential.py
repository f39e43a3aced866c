"""The best stays of sequences by sequential linear programming on the exact limits."""

from __future__ import annotations

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.search.dual_simplex import ROW_TOLERANCE, dual_simplex
from optuav.search.plans import margins, steady_s
from optuav.search.terrain import Boxes, Terrain

MOST_PROGRAMMES = 200  # Largest number of linear programmes a sequence
STILL_S = 1e-9  # A shorter step is the last [s]
# Distance that is kept from limits, in seconds of the stay that counts most there: more than the
# tolerance of a linear programme.
APART_S = 3.0 * ROW_TOLERANCE
DIFFERENCE_S = 1e-3  # Step of a difference quotient [s]
LEAST_SLOPE_A = 1e-6  # Limits that no stay changes more than this are not scaled
PENALTY = 100.0  # Hover [s] that a violation of a limit by one second of stay is worth


def improved(terrain: Terrain, boxes: Boxes, begin_s: Floats) -> Floats:
    """Stays (stop, box) [s] that hover as long as steps from the given ones lead.

    Each step maximises the hover less a penalty on the largest violation of the limits, linear in
    the stays there, within a distance of each stay; the distance is halved if the step is too long
    to gain. They may violate limits where the wells leave no plan near by. Where charging tapers, a
    stay has two parts, at constant current and at constant y1, as the limits bend where it begins
    to taper; a charger that tapers holds no less at the end of both.
    """
    stays_s, worth = begin_s.copy(), np.array(boxes.pattern, float)
    able = np.ones(stays_s.shape, bool)
    if terrain.tapers:
        stays_s = steady_s(terrain, boxes.places, begin_s)
        stays_s = np.vstack([stays_s, begin_s - stays_s])
        worth, able = np.tile(worth, 2), np.vstack([able, _charges(terrain, boxes.places)])
    worth = np.append(worth, -PENALTY)
    legs_s = terrain.duration_s[boxes.places[:-1], boxes.places[1:]].sum(axis=0)
    left_s = np.maximum(terrain.deadline_s - legs_s - APART_S, 0.0)
    reach_s, moving = left_s.copy(), np.arange(len(boxes))
    for _ in range(MOST_PROGRAMMES):
        places, here_s, reach = boxes.places[:, moving], stays_s[:, moving], reach_s[moving]
        value_As, slope_A = _linear(terrain, places, here_s)
        scale_A = np.maximum(np.abs(slope_A).max(axis=1), LEAST_SLOPE_A)
        low_s = np.maximum(here_s - reach, 0.0)
        rows, limits = _programme(
            value_As / scale_A,
            slope_A / scale_A[:, None],
            here_s,
            low_s,
            reach * able[:, moving],
            left_s[moving],
        )
        result = dual_simplex(rows, limits, worth, np.full(len(moving), -np.inf))
        there_s = low_s + result.x[:-1]
        there_s *= np.minimum(1.0, left_s[moving] / np.maximum(there_s.sum(axis=0), STILL_S))
        there_As = _margins(terrain, places, there_s)
        now, then = (
            worth[:-1] @ each_s + PENALTY * np.minimum((each_As / scale_A - APART_S).min(axis=0), 0)
            for each_s, each_As in ((here_s, value_As), (there_s, there_As))
        )
        step_s = np.abs(there_s - here_s).max(axis=0)
        gains = then > now
        stays_s[:, moving[gains]] = there_s[:, gains]
        reach_s[moving] = np.where(gains, reach, 0.5 * np.minimum(step_s, reach))
        moving = moving[np.minimum(step_s, reach_s[moving]) >= STILL_S]
        if not len(moving):
            break
    return np.asarray(stays_s.reshape(-1, *begin_s.shape).sum(axis=0))


def _charges(terrain: Terrain, places: Integers) -> Booleans:
    """Whether stays at places charge (stop, plan)."""
    return np.asarray(terrain.stay_current_A[places[1:-1]] > 0.0)


def _margins(terrain: Terrain, places: Integers, stays_s: Floats) -> Floats:
    """Distances to the limits (limit, plan) [A s]; both parts of stays one after the other."""
    if not terrain.tapers:
        return margins(terrain, places, stays_s)
    return margins(terrain, places, *np.split(stays_s, 2))


def _linear(terrain: Terrain, places: Integers, stays_s: Floats) -> tuple[Floats, Floats]:
    """Distances to the limits (limit, plan) [A s], and what a stay adds (limit, stay, plan) [A]."""
    stays, count = stays_s.shape
    moved_s = np.repeat(stays_s[:, None], stays + 1, axis=1)
    moved_s[np.arange(stays), np.arange(stays)] += DIFFERENCE_S
    at = np.repeat(places[:, None], stays + 1, axis=1).reshape(len(places), -1)
    values = _margins(terrain, at, moved_s.reshape(stays, -1)).reshape(-1, stays + 1, count)
    return values[:, -1], (values[:, :-1] - values[:, -1:]) / DIFFERENCE_S


def _programme(
    value_s: Floats, slope: Floats, here_s: Floats, low_s: Floats, reach_s: Floats, left_s: Floats
) -> tuple[Floats, Floats]:
    """Rows and limits in the stays beyond the lowest and the largest violation, all [s]."""
    stops, count = here_s.shape
    no = np.zeros((1, 1, count))
    in_time = np.concatenate([np.ones((1, stops, count)), no], axis=1)
    keeps = np.concatenate([-slope, np.full((len(slope), 1, count), -1.0)], axis=1)
    near = np.repeat(np.eye(stops, stops + 1)[:, :, None], count, axis=2)
    from_low_s = value_s - APART_S - (slope * (here_s - low_s)).sum(axis=1)
    limits = left_s - low_s.sum(axis=0), from_low_s, here_s - low_s + reach_s
    return np.concatenate([in_time, keeps, near]), np.vstack(limits)
