"""A survey of many lines from one place: which are clear, and what may well block the others.

Footprints are taken up from the nearest to the farthest, a few at a time, into a horizon: for every
bearing the steepest slope up to which a footprint so far may hide what lies behind. A line that
ends farther away is clear if it is at least as steep. Bearings are coarse and footprints count as
wider and nearer than they are, so what is called clear is clear; others are left to be decided.
"""

from __future__ import annotations

import math

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.prisms import MARGIN_M, Prisms
from optuav.physics.quantity import TINY

AT_ONCE = 250  # Footprints that are taken up between two looks at the horizon
BEARINGS = 16  # Into so many bearings the average footprint reaches, about
FEWEST, MOST = 1 << 10, 1 << 22  # Bearings
NONE = -1  # In place of the number of a footprint


def around(obstacles: Prisms, place_m: Floats) -> list[int]:
    """Numbers of the footprints whose boxes contain a place: they have no bearing from there."""
    return np.flatnonzero(_beside(obstacles, place_m) == 0.0).tolist()


def _beside(obstacles: Prisms, place_m: Floats) -> Floats:
    """Distance on the map from a place to the box of every footprint [m], no more than it is."""
    at_m, wall_m = place_m[:2, None], 2.0 * MARGIN_M
    out_m = np.maximum(obstacles.low_m - wall_m - at_m, at_m - obstacles.high_m - wall_m)
    return np.asarray(np.hypot(*np.maximum(out_m, 0.0)))


def survey(
    obstacles: Prisms, place_m: Floats, ends_m: Floats, exempt: Integers
) -> tuple[Booleans, Integers]:
    """Which straight lines from a place are clear for certain, and what likely blocks each.

    The lines end at `ends_m` (line, 3) [m]; the `exempt` buildings (line, k) do not block them. The
    second array has numbers of footprints, `NONE` where there is none. Lines that are not clear may
    still be, and what likely blocks them may not. Footprints `around` the place do not count.
    """
    near_m, left, right, slope = _seen_from(obstacles, place_m)
    count, outside = len(near_m), near_m > 0.0
    width = float((right - left)[outside].sum())
    bearings = int(np.clip(BEARINGS * count * 2.0 * math.pi / max(width, 1e-9), FEWEST, MOST))
    per_radian = bearings / (2.0 * math.pi)
    # A millionth of a bearing more than it has, which is more than rounding takes from it.
    first = np.floor(left * per_radian - 1e-6).astype(np.intp)
    spans = np.floor(right * per_radian + 1e-6).astype(np.intp) - first + 1
    spans = np.where(outside, np.minimum(spans, bearings), 0)
    # Groups of footprints from the nearest on, within each the lower slopes first.
    by_distance = np.argsort(near_m, kind="stable")
    group = np.empty(count, dtype=np.intp)
    group[by_distance] = np.arange(count) // AT_ONCE
    begins_m = near_m[by_distance[::AT_ONCE]]
    order = np.lexsort((slope, group))

    way_m = ends_m - place_m
    length_m = np.hypot(way_m[:, 0], way_m[:, 1])
    steepness = way_m[:, 2] / np.maximum(length_m, TINY)
    bearing = (np.arctan2(way_m[:, 1], way_m[:, 0]) * per_radian // 1.0).astype(np.intp) % bearings
    # Only footprints of groups before `after` begin before the line ends.
    after = np.searchsorted(begins_m, length_m)
    known = np.minimum(np.searchsorted(obstacles.building, exempt), count - 1)
    own = (obstacles.building[known] == exempt) & (group[known] < after[:, None])
    own &= (bearing[:, None] - first[known]) % bearings < spans[known]
    for k in range(1, exempt.shape[1]):
        own[:, k] &= (exempt[:, :k] != exempt[:, k, None]).all(axis=1)
    # The horizon is looked at before the first exempt footprint is in it. Where the bearing has no
    # more footprints from there on than the exempt ones, no other stands behind that horizon.
    before = np.minimum(np.where(own, group[known], count).min(axis=1, initial=count), after)
    later = -own.sum(axis=1)

    looks, ends = (np.argsort(each, kind="stable") for each in (before, after))
    groups = np.arange(len(begins_m) + 2)
    look_at = np.searchsorted(before[looks], groups)
    end_at = np.searchsorted(after[ends], groups)
    horizon = np.full(bearings, -np.inf)
    highest, blocker = horizon.copy(), np.full(bearings, NONE)
    standing = np.zeros(bearings, dtype=np.intp)
    needed, likely = np.empty(len(ends_m)), np.empty(len(ends_m), dtype=np.intp)
    for k in range(len(begins_m) + 1):
        line = ends[end_at[k] : end_at[k + 1]]
        later[line] += standing[bearing[line]]
        line = looks[look_at[k] : look_at[k + 1]]
        at = bearing[line]
        needed[line], likely[line] = horizon[at], blocker[at]
        later[line] -= standing[at]
        footprint = order[k * AT_ONCE : (k + 1) * AT_ONCE]
        reach = spans[footprint]
        place = np.repeat(np.arange(len(footprint)), reach)
        step = np.arange(len(place)) - np.repeat(np.cumsum(reach) - reach, reach)
        each = footprint[place]
        at, tall = (first[each] + step) % bearings, slope[each]
        np.maximum.at(horizon, at, tall)
        np.add.at(standing, at, 1)
        # Where it fills a bearing, it likely blocks what is lower; the last of equals stays.
        fills = ((step > 0) & (step < reach[place] - 1)) | (reach[place] < 3)
        fills &= tall >= highest[at]
        highest[at[fills]], blocker[at[fills]] = tall[fills], each[fills]
    return (steepness >= needed) & (later == 0), likely


def _seen_from(obstacles: Prisms, place_m: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """How footprints look from a place: distance [m], ends of their bearings [rad], and slopes.

    A line from there that is at least as steep as the slope [-] passes over the footprint.
    """
    at_m, near_m = place_m[:2], _beside(obstacles, place_m)
    first = np.cumsum(obstacles.sizes) - obstacles.sizes
    middle_m = obstacles.middle_m - at_m[:, None]
    x, y = (obstacles.corners_m - at_m).T
    u, v = np.repeat(middle_m, obstacles.sizes, axis=1)
    turn = np.arctan2(u * y - v * x, u * x + v * y)
    bearing = np.arctan2(middle_m[1], middle_m[0])
    left = bearing + np.minimum.reduceat(turn, first)
    right = bearing + np.maximum.reduceat(turn, first)
    far_m = np.sqrt(np.maximum.reduceat(x**2 + y**2, first))
    rise_m = obstacles.roof_m - place_m[2]
    by_m = np.where(rise_m >= 0.0, near_m, far_m)
    return near_m, left, right, np.where(by_m > 0.0, rise_m / np.maximum(by_m, TINY), np.inf)
