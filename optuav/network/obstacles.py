"""The straight lines that cross buildings, and those that are clear of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from optuav.arrays import Booleans, Floats, Integers, ragged
from optuav.mission.buildings import Buildings
from optuav.network.horizon import NONE, candidates, lines_from, survey, view
from optuav.network.prisms import MARGIN_M, Prisms, prisms
from optuav.physics.quantity import TINY, Quantity

FEW = 32  # So many footprints are all tried on every line
MOST_PAIRS = 1 << 13
"""Pairs of lines and footprints that are tried at once, about: as many as fit the cache."""
MANY, LEAST = 300, 0.2
"""So many lines from one place are surveyed before they are followed, if they are at least such a
share of the footprints."""
CLEAR = -1  # In place of the number of a building, for none

Lines: TypeAlias = Sequence[npt.NDArray[Any]]
"""Low ends (axis, line), the ways from there to the high ends [m], and the exempt (k, line)."""


def crossed(obstacles: Prisms, start_m: Floats, end_m: Floats, exempt: Integers) -> Integers:
    """A building that each straight line (line, 3) [m] runs through, −1 for a clear way.

    A line crosses a building if it runs inside the footprint below the roof; to graze a wall, a
    corner or the roof is not to cross. The `exempt` buildings (line, k) do not block a line.
    """
    blocker, count = np.full(len(start_m), CLEAR, dtype=np.intp), len(obstacles.building)
    if not count:
        return blocker
    swap = start_m[:, 2] > end_m[:, 2]
    low_m, high_m = np.where(swap, end_m.T, start_m.T), np.where(swap, start_m.T, end_m.T)
    lines = low_m, np.subtract(high_m, low_m, out=high_m), exempt.T
    if count <= FEW:
        pairs = count * len(blocker)
        for begin in range(0, pairs, MOST_PAIRS):
            pair = np.arange(begin, min(begin + MOST_PAIRS, pairs))
            line, footprint = _met(obstacles, lines, *np.divmod(pair, count))
            blocker[line] = obstacles.building[footprint]
        return blocker
    left = np.ones(len(blocker), bool)
    if len(blocker) >= (many := max(MANY, LEAST * count)):
        # Lines in a row that start in one place.
        other = np.flatnonzero((start_m[1:] != start_m[:-1]).any(axis=1)) + 1
        first, last = np.append(0, other), np.append(other, len(blocker))
        for row in map(slice, *(ends[last - first >= many].tolist() for ends in (first, last))):
            rows = [columns[:, row] for columns in lines]
            blocker[row] = _surveyed(obstacles, start_m[row.start], end_m[row], rows)
            left[row] = False
    blocker[left] = _followed(obstacles, [columns[:, left] for columns in lines])
    return blocker


def roofs_below(buildings: Buildings, places_m: Floats) -> Integers:
    """The building on whose roof each place (place, 3) [m] stands, −1 for none."""
    building, heights_m = np.full(len(places_m), CLEAR, dtype=np.intp), places_m[:, 2]
    roofs_m = np.append(np.sort(buildings.roof_m[:, 2]), np.inf)
    level = roofs_m[np.searchsorted(roofs_m[:-1], heights_m - MARGIN_M)] <= heights_m + MARGIN_M
    if level.any():
        at_m, none = places_m[level], np.full((np.count_nonzero(level), 1), CLEAR)
        away_m = np.array([0.0, 0.0, 3.0 * MARGIN_M])
        ends_m = np.concatenate([at_m - away_m, at_m + away_m])
        below, above = np.split(
            crossed(prisms(buildings), ends_m, ends_m, np.tile(none, (2, 1))), 2
        )
        building[level] = np.where(below == above, CLEAR, below)
    return building


def _surveyed(obstacles: Prisms, place_m: Floats, ends_m: Floats, lines: Lines) -> Integers:
    """A building that each line crosses, like `crossed`; all lines start in one place."""
    seen = view(obstacles, place_m)
    (around,) = np.nonzero(seen.near_m == 0.0)
    if len(around) > FEW:  # Then the place lies in a heap of footprints
        return _followed(obstacles, lines)
    blocker = np.full(len(ends_m), CLEAR, dtype=np.intp)

    def tried(line: Integers, footprint: Integers) -> None:
        for k in range(0, len(line), MOST_PAIRS):
            pairs = line[k : k + MOST_PAIRS], footprint[k : k + MOST_PAIRS]
            one, other = _met(obstacles, lines, *pairs)
            blocker[one] = obstacles.building[other]

    ways = lines_from(place_m, ends_m, seen.bearings)
    clear, likely = survey(seen, ways, obstacles, lines[-1].T)
    (guessed,) = np.nonzero(~clear & (likely != NONE))
    tried(guessed, likely[guessed])
    # A footprint around the place blocks any line, and is not part of the survey.
    for covered in around:
        (line,) = np.nonzero(blocker == CLEAR)
        tried(line, np.full_like(line, covered))
    (left,) = np.nonzero(~clear & (blocker == CLEAR))
    for line, footprint in candidates(seen, ways, left):
        still = blocker[line] == CLEAR
        tried(line[still], footprint[still])
    return blocker


def _followed(obstacles: Prisms, lines: Lines) -> Integers:
    """A building that each line crosses, like `crossed`: the lines are followed over the map."""
    low_m, way_m, _ = lines
    map_low_m, cell_m, n, in_cells, begins = obstacles.cells
    count, at_once = low_m.shape[1], 1 + 4 * MOST_PAIRS * n**2 // len(in_cells[0])
    if count > at_once:
        parts = (slice(begin, begin + at_once) for begin in range(0, count, at_once))
        pieces = ([columns[:, part] for columns in lines] for part in parts)
        return np.concatenate([_followed(obstacles, piece) for piece in pieces])
    blocker = np.full(count, CLEAR, dtype=np.intp)
    town = map_low_m, map_low_m + n * cell_m, obstacles.roof_m.max()
    within = enter, leave = np.stack(_stretch(low_m, way_m, *town))
    middle_m = obstacles.middle_m
    reach_m = 0.5 * (obstacles.high_m - obstacles.low_m).sum(axis=0) + 4.0 * MARGIN_M
    steep = np.abs(way_m[1]) > np.abs(way_m[0])
    for axis in (0, 1):
        # Column by column from the low ends on; a line that is blocked is followed no further.
        live = np.flatnonzero((enter <= leave) & (steep == axis))
        slope = way_m[1 - axis] / np.where(np.abs(way_m[axis]) < TINY, TINY, way_m[axis])
        offset_m = low_m[1 - axis] - slope * low_m[axis]
        ends_m = low_m[axis] + within * way_m[axis]
        ends = (ends_m[:, live] - map_low_m[axis]) / cell_m[axis]
        column, last = np.clip(ends.astype(np.intp), 0, n - 1)
        while len(live):
            walls_m = map_low_m[axis] + np.stack([column, column + 1]) * cell_m[axis]
            walls_m = np.clip(walls_m, *np.sort(ends_m[:, live], axis=0))
            ends = offset_m[live] + slope[live] * walls_m - map_low_m[1 - axis]
            row = column * n + np.clip((ends / cell_m[1 - axis]).astype(np.intp), 0, n - 1)
            first = begins[axis][row.min(axis=0)]
            number, entry = ragged(first, begins[axis][row.max(axis=0) + 1] - first)
            line, footprint = live[number], in_cells[axis][entry]
            # Most footprints lie well beside the line.
            beside_m = middle_m[1 - axis, footprint] - slope[line] * middle_m[axis, footprint]
            (near,) = np.nonzero(np.abs(beside_m - offset_m[line]) <= reach_m[footprint])
            line, footprint = _met(obstacles, lines, line[near], footprint[near])
            blocker[line] = obstacles.building[footprint]
            (on,) = np.nonzero((blocker[live] == CLEAR) & (column != last))
            live, last = live[on], last[on]
            column = column[on] + np.sign(last - column[on])
    return blocker


def _met(
    obstacles: Prisms, lines: Lines, line: Integers, footprint: Integers
) -> tuple[Integers, Integers]:
    """Return the pairs of a line and a footprint where the footprint blocks the line."""
    low_m, way_m, exempt = lines
    start_m, along_m = (_columns(ends, line) for ends in (low_m, way_m))
    box_m = [_columns(corners, footprint) for corners in (obstacles.low_m, obstacles.high_m)]
    enter, leave = _stretch(start_m, along_m, box_m[0], box_m[1], obstacles.roof_m[footprint])
    (met,) = np.nonzero(enter <= leave)
    line, footprint = line[met], footprint[met]
    blocks = (exempt[:, line] != obstacles.building[footprint]).all(axis=0)
    (other,) = np.nonzero(blocks & ~obstacles.is_box[footprint])
    if len(other):
        pairs = met[other]
        start_m, along_m = start_m[:2, pairs], along_m[:2, pairs]
        ends_m = np.stack([start_m + share[pairs] * along_m for share in (enter, leave)])
        blocks[other] = _inside(obstacles, footprint[other], ends_m)
    return line[blocks], footprint[blocks]


def _inside(obstacles: Prisms, footprint: Integers, ends_m: Floats) -> Booleans:
    """Test whether straight ways (end, axis, way) [m] run inside a footprint each, seen from above.

    A way that keeps d from the corners and runs l inside, in a footprint of n corners with edges up
    to D long, is at least 2 l d / (n D) from all edges in the middle of its longest stretch inside:
    edges that it meets there stand at least at the slope 2 d / D to it. Most are decided by that.
    """
    sizes, length_m = obstacles.sizes[footprint], np.hypot(*(ends_m[1] - ends_m[0]))
    along = (ends_m[1] - ends_m[0]) / np.maximum(length_m, TINY)
    way, corner = ragged(obstacles.first[footprint], sizes)
    corners_m = _columns(obstacles.corners_m.T, corner)
    from_m = along[0] * ends_m[0, 1] - along[1] * ends_m[0, 0]
    u, v, from_m = np.repeat([*along, from_m], sizes, axis=1)
    beside_m = u * corners_m[1] - v * corners_m[0] - from_m
    last = np.cumsum(sizes) - 1
    after = np.arange(1, 1 + len(way))
    after[last] = last - sizes + 1
    left = beside_m > 0.0
    (met,) = np.nonzero(left != left.take(after))  # Edges from one side of the way to the other
    way, after = way[met], after[met]
    share = beside_m[met] / (beside_m[met] - beside_m[after])
    at_m, to_m = (corners_m.take(numbers, axis=1) for numbers in (met, after))
    at_m += share * (to_m - at_m) - ends_m[0].take(way, axis=1)
    # The way enters a footprint by edges from one of its sides to the other, and leaves by others.
    ahead_m = np.clip((along.take(way, axis=1) * at_m).sum(axis=0), 0.0, length_m[way])
    inside_m = np.abs(np.bincount(way, np.copysign(ahead_m, beside_m[met]), len(sizes)))
    apart_m = np.minimum.reduceat(np.abs(beside_m), last - sizes + 1)
    low_m, high_m = (_columns(corner, footprint) for corner in (obstacles.low_m, obstacles.high_m))
    edge_m = np.hypot(*(high_m - low_m))
    inside = 2.0 * inside_m * apart_m > 10.0 * MARGIN_M * sizes * edge_m
    beside = (np.bincount(way, minlength=len(sizes)) == 0) & (apart_m > MARGIN_M)
    (unsure,) = np.nonzero(~(inside | beside))
    if len(unsure):
        import shapely

        start_m, end_m = ends_m[:, :, unsure]
        seen = np.asarray(shapely.linestrings(np.stack([start_m.T, end_m.T], axis=1)))
        # Seen from above, an upright line is a point.
        upright = (start_m == end_m).all(axis=0)
        seen[upright] = shapely.points(start_m.T[upright])
        inside[unsure] = shapely.intersects(obstacles.inner(footprint[unsure]), seen)
    return np.asarray(inside)


def _columns(values: Floats, which: Integers) -> Floats:
    """Columns of values that lie in memory column by column, to compute with row by row.

    This is several times faster than an index.
    """
    return np.ascontiguousarray(values.T.take(which, axis=0).T)


def _stretch(
    low_m: Floats, way_m: Floats, box_low_m: Floats, box_high_m: Floats, roof_m: Quantity
) -> tuple[Floats, Floats]:
    """From where to where on their way lines run in boxes below roofs; not if from is larger."""
    way = np.where(np.abs(way_m) < TINY, TINY, way_m)
    one, other = (box_low_m - low_m[:2]) / way[:2], (box_high_m - low_m[:2]) / way[:2]
    depth_m = roof_m - MARGIN_M - low_m[2]
    highest = np.where(depth_m > 0.0, np.minimum(depth_m / way[2], 1.0), -1.0)
    enter = np.minimum(one, other).max(axis=0)
    return np.maximum(enter, 0.0), np.minimum(np.maximum(one, other).min(axis=0), highest)


def clear_lines(
    obstacles: Prisms, position_m: Floats, lines: Integers, exempt: Integers
) -> Booleans:
    """Test whether lines between places cross no building (variant, line); False without an end.

    Lines (line, 2) join places (variant, place, 3) [m]; `exempt` ([variant,] line, k) do not block
    them, and are the same for the same ends.
    """
    exists = np.asarray(np.isfinite(position_m).all(axis=2))
    free = np.asarray(exists[:, lines].all(axis=2))
    if not len(obstacles.building):
        return free
    low_m, high_m = (extreme.reduce(position_m, axis=0) for extreme in (np.fmin, np.fmax))
    moves = (low_m != high_m).any(axis=1)
    (moving,) = np.nonzero(moves[lines].any(axis=1))
    if len(position_m) > len(obstacles.building):  # Else single lines are tried sooner than boxes
        roofs = exempt if exempt.ndim == 2 else np.full((len(lines), 1), CLEAR)
        ways = zip(low_m[lines[moving]], high_m[lines[moving]], roofs[moving], strict=True)
        moving = moving[[_box_meets(obstacles, *way) for way in ways]]
    # Each line is tried in the first variant with the same ends. One that is the same in all
    # variants, or clear in all, is tried in the first that has both.
    tried = np.tile(free.argmax(axis=0), (len(free), 1))
    pairs = np.where(moves[lines[moving]], lines[moving], CLEAR)
    for pair in {*map(tuple, pairs.tolist())}:
        ends_m = position_m[:, [end for end in pair if end != CLEAR]]
        alike = _first_alike(ends_m.reshape(len(free), -1))
        tried[:, moving[(pairs == pair).all(axis=1)]] = alike[:, None]
    variant, line = np.nonzero(free & (tried == np.arange(len(free))[:, None]))
    start_m, end_m = np.moveaxis(position_m[variant[:, None], lines[line]], 1, 0)
    blocked = np.zeros_like(free)
    exempt_of_line = exempt[line] if exempt.ndim == 2 else exempt[variant, line]
    blocked[variant, line] = crossed(obstacles, start_m, end_m, exempt_of_line) != CLEAR
    free &= ~blocked[tried, np.arange(len(lines))]
    return free


def _box_meets(obstacles: Prisms, low_m: Floats, high_m: Floats, exempt: Integers) -> bool:
    """Whether a line may cross a building, wherever its ends are in boxes (end, 3) [m]."""
    # In no variant is it farther from the middle one than its ends may be.
    middle_m, reach_m = 0.5 * (low_m + high_m), 0.5 * (high_m - low_m).max(axis=0)
    start_m, end_m = middle_m[np.argsort(middle_m[:, 2])]
    wider_m = reach_m[:2, None]
    boxes = obstacles.low_m - wider_m, obstacles.high_m + wider_m, obstacles.roof_m + reach_m[2]
    enter, leave = _stretch(start_m[:, None], (end_m - start_m)[:, None], *boxes)
    return not np.isin(obstacles.building[enter <= leave], exempt).all()


def _first_alike(rows: Floats) -> Integers:
    """The number of the first row that is equal to each of the rows."""
    order = np.lexsort(rows.T)
    new = np.append(True, (rows[order[1:]] != rows[order[:-1]]).any(axis=1))
    first = np.empty_like(order)
    first[order] = order[new][np.cumsum(new) - 1]
    return first
