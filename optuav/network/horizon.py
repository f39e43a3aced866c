"""A survey of many lines from one place: which are clear, and what may well block the others.

Footprints are taken up from the nearest to the farthest, a few at a time, into a horizon: for every
bearing the steepest slope where a footprint so far may hide points behind it. A line that
ends farther away is clear if it is at least as steep. Bearings are coarse and footprints count as
wider and nearer than they are, so a line called clear is clear. Others are left to be decided:
few footprints in the bearing of a line are high enough to block it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers, portions, ragged
from optuav.network.prisms import MARGIN_M, Prisms
from optuav.physics.quantity import TINY

FOOTPRINTS_AT_ONCE = 500  # Footprints that are taken up between two looks at the horizon
BEARINGS = 8  # Bearings that the average footprint covers, about
FEWEST_BEARINGS, MOST_BEARINGS = 1 << 10, 1 << 22  # Bearings
MOST_CORNERS = 1 << 16  # Corners handled together: as many as fit the cache
MOST_PAIRS = 1 << 18  # Pairs of footprints and bearings, or lines and footprints, likewise
NONE = -1  # Number that stands for no footprint


class View(NamedTuple):
    """Footprints as seen from a place, by number; bearings are counted all round."""

    near_m: Floats  # Distance on the map, no more than it is; 0 around the place [m]
    by_distance: Integers  # Numbers from the nearest to the farthest
    slope: Floats  # A line from the place that is at least as steep passes over it [-]
    first: Integers  # The first bearing that it may reach
    spans: Integers  # Into so many it may reach from there on; 0 around the place
    bearings: int  # How many there are


class Lines(NamedTuple):
    """Straight lines from a place, by number."""

    length_m: Floats  # On the map [m]
    steepness: Floats  # [-]
    bearing: Integers


def view(obstacles: Prisms, place_m: Floats) -> View:
    """Return the footprints as seen from a place [m]."""
    at_m, wall_m, count = place_m[:2, None], 2.0 * MARGIN_M, len(obstacles.sizes)
    out_m = np.maximum(obstacles.low_m - wall_m - at_m, at_m - obstacles.high_m - wall_m)
    near_m = np.hypot(*np.maximum(out_m, 0.0))
    left, right, far_m = np.empty(count), np.empty(count), np.empty(count)
    for part in portions(obstacles.sizes, MOST_CORNERS):
        sizes, first = obstacles.sizes[part], obstacles.first[part] - obstacles.first[part.start]
        corner = slice(obstacles.first[part.start], obstacles.first[part.start] + sizes.sum())
        middle_m = obstacles.middle_m[:, part] - at_m
        u, v = np.repeat(middle_m, sizes, axis=1)
        x, y = obstacles.corners_m[corner].T - at_m
        turn = np.arctan2(u * y - v * x, u * x + v * y)
        bearing = np.arctan2(middle_m[1], middle_m[0])
        left[part] = bearing + np.minimum.reduceat(turn, first)
        right[part] = bearing + np.maximum.reduceat(turn, first)
        far_m[part] = np.sqrt(np.maximum.reduceat(x**2 + y**2, first))
    rise_m, outside = obstacles.roof_m - place_m[2], near_m > 0.0
    by_m = np.where(rise_m >= 0.0, near_m, far_m)
    slope = np.where(by_m > 0.0, rise_m / np.maximum(by_m, TINY), np.inf)
    width = float((right - left)[outside].sum())
    bearings = int(
        np.clip(BEARINGS * count * 2.0 * math.pi / max(width, 1e-9), FEWEST_BEARINGS, MOST_BEARINGS)
    )
    per_radian = bearings / (2.0 * math.pi)
    # A millionth of a bearing more than it has, which is more than rounding takes from it.
    begin = np.floor(left * per_radian - 1e-6).astype(np.intp)
    spans = np.floor(right * per_radian + 1e-6).astype(np.intp) - begin + 1
    spans = np.where(outside, np.minimum(spans, bearings), 0)
    return View(near_m, np.argsort(near_m, kind="stable"), slope, begin, spans, bearings)


def lines_from(place_m: Floats, ends_m: Floats, bearings: int) -> Lines:
    """The straight lines from a place to `ends_m` (line, 3) [m], by bearings all round."""
    x, y, rise_m = (ends_m - place_m).T
    length_m = np.hypot(x, y)
    turns = np.arctan2(y, x) * (bearings / (2.0 * math.pi)) // 1.0
    steepness = rise_m / np.maximum(length_m, TINY)
    return Lines(length_m, steepness, turns.astype(np.intp) % bearings)


def survey(
    seen: View, ways: Lines, obstacles: Prisms, exempt: Integers
) -> tuple[Booleans, Integers]:
    """Return which straight lines from a place are certainly clear, and what likely blocks each.

    The `exempt` buildings (line, k) do not block them. The second array has numbers of footprints,
    `NONE` without one. Lines that are not clear may still be, and their likely blockers
    may not block. Footprints around the place do not count.
    """
    count, bearing = len(seen.near_m), ways.bearing
    # Groups of footprints from the nearest on.
    group = np.empty(count, dtype=np.intp)
    group[seen.by_distance] = np.arange(count) // FOOTPRINTS_AT_ONCE
    begins_m = seen.near_m[seen.by_distance[::FOOTPRINTS_AT_ONCE]]

    # Only footprints of groups before `after` begin before the line ends.
    after = np.searchsorted(begins_m, ways.length_m)
    at_exempt = np.minimum(np.searchsorted(obstacles.building, exempt), count - 1)
    exempted = (obstacles.building[at_exempt] == exempt) & (group[at_exempt] < after[:, None])
    exempted &= (bearing[:, None] - seen.first[at_exempt]) % seen.bearings < seen.spans[at_exempt]
    for k in range(1, exempt.shape[1]):
        exempted[:, k] &= (exempt[:, :k] != exempt[:, k, None]).all(axis=1)
    # The horizon is looked at before the first exempt footprint is in it. Where the bearing has no
    # more footprints from there on than the exempt ones, no other stands behind that horizon.
    before = np.minimum(
        np.where(exempted, group[at_exempt], count).min(axis=1, initial=count), after
    )
    later = -exempted.sum(axis=1)

    groups = np.arange(len(begins_m) + 2)
    narrow = np.min_scalar_type(len(groups))  # A type that is sorted fast
    looks, ends = (np.argsort(group.astype(narrow), kind="stable") for group in (before, after))
    look_at = np.searchsorted(before[looks], groups)
    end_at = np.searchsorted(after[ends], groups)
    horizon = np.full(seen.bearings, -np.inf)
    highest, blocker = horizon.copy(), np.full(seen.bearings, NONE)
    standing = np.zeros(seen.bearings, dtype=np.intp)
    needed, likely = np.empty(len(bearing)), np.empty(len(bearing), dtype=np.intp)
    for k in range(len(begins_m) + 1):
        line = ends[end_at[k] : end_at[k + 1]]
        later[line] += standing[bearing[line]]
        line = looks[look_at[k] : look_at[k + 1]]
        at = bearing[line]
        needed[line], likely[line] = horizon[at], blocker[at]
        later[line] -= standing[at]
        footprint = seen.by_distance[k * FOOTPRINTS_AT_ONCE : (k + 1) * FOOTPRINTS_AT_ONCE]
        footprint = footprint[np.argsort(seen.slope[footprint], kind="stable")]
        reach = seen.spans[footprint]
        place, step = ragged(np.zeros_like(reach), reach)
        filling = footprint[place]
        at, tall = (seen.first[filling] + step) % seen.bearings, seen.slope[filling]
        np.maximum.at(horizon, at, tall)
        np.add.at(standing, at, 1)
        # If it fills a bearing, it likely blocks lower lines; the last of equals stays.
        fills = ((step > 0) & (step < reach[place] - 1)) | (reach[place] < 3)
        fills &= tall >= highest[at]
        highest[at[fills]], blocker[at[fills]] = tall[fills], filling[fills]
    return (ways.steepness >= needed) & (later == 0), likely


def candidates(seen: View, ways: Lines, some: Integers) -> Iterator[tuple[Integers, Integers]]:
    """Numbers of some lines, each with the numbers of footprints that may block it.

    Footprints around the place do not count.
    """
    line = some[np.lexsort((ways.length_m[some], ways.bearing[some]))]
    bearing, length_m, steepness = ways.bearing[line], ways.length_m[line], ways.steepness[line]
    # Every line by its bearing and then its length, as one number.
    lengths_m, many = np.unique(length_m), len(line) + 1
    key = bearing * many + np.searchsorted(lengths_m, length_m)
    # The lowest of the lines in its bearing that are as long or longer, by its rank.
    slopes = np.unique(steepness)
    rank = bearing * many + np.searchsorted(slopes, steepness)
    lowest = slopes[np.minimum.accumulate(rank[::-1])[::-1] - bearing * many]
    last = np.searchsorted(bearing, np.arange(seen.bearings), side="right")
    beyond = np.empty_like(seen.by_distance)
    near_m = seen.near_m[seen.by_distance]
    beyond[seen.by_distance] = np.searchsorted(lengths_m, near_m, side="right")
    # No line in a bearing is steeper down or longer than this.
    steepest, longest_m = np.full(seen.bearings, np.inf), np.zeros(seen.bearings)
    np.minimum.at(steepest, bearing, steepness)
    np.maximum.at(longest_m, bearing, length_m)
    for part in portions(seen.spans, MOST_PAIRS):
        row, at = ragged(seen.first[part], seen.spans[part])
        footprint, at = part.start + row, at % seen.bearings
        there = (seen.slope[footprint] > steepest[at]) & (seen.near_m[footprint] < longest_m[at])
        footprint, at = footprint[there], at[there]
        first = np.searchsorted(key, at * many + beyond[footprint])
        count = last[at] - first
        (high,) = np.nonzero(count > 0)
        high = high[seen.slope[footprint[high]] > lowest[first[high]]]
        footprint, first, count = footprint[high], first[high], count[high]
        for pairs in portions(count, MOST_PAIRS):
            row, number = ragged(first[pairs], count[pairs])
            other = footprint[pairs][row]
            may = seen.slope[other] > steepness[number]
            yield line[number[may]], other[may]
