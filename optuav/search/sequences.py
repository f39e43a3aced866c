"""Sequences of stops: which kinds of stops in order, and which buildings they rest on."""

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.search.bounds import passable
from optuav.search.terrain import (
    DESTINATION,
    FIRST_BUILDING,
    HOVER,
    ORIGIN,
    Boxes,
    Pattern,
    Terrain,
)

SEQUENCES_AT_ONCE = 1 << 16  # Sequences that are made at once
STOPS_FROM_BIT = 52
"""Bits of a rank below the number of stops; more sequences than that are out of reach."""


def patterns(rests: int, hovers: int) -> Iterator[Pattern]:
    """Kinds of stops in order, up to `rests` rests and 1 to `hovers` hovers, the shortest first.

    Two hovers in a row are one. Among equally many stops, rests come early, as ties are broken.
    """
    for stops in range(1, rests + hovers + 1):
        for pattern in itertools.product((False, True), repeat=stops):
            few = 1 <= sum(pattern) <= hovers and stops - sum(pattern) <= rests
            if few and not any(a and b for a, b in itertools.pairwise(pattern)):
                yield pattern


def sequences(
    terrain: Terrain, pattern: Pattern, to_beat_s: Callable[[], float] | None = None
) -> Iterator[Boxes]:
    """All sequences of a pattern that can be flown, each as one box of any durations.

    Two rests in a row on the same building are one, and left out. Sequences rank by the number of
    stops, then by the buildings in order, then resting early first. With a hover time to beat [s],
    sequences are left out with a part that rules it out (`optuav.search.bounds.passable`).
    """
    rests, hovers = (np.flatnonzero(np.array(pattern) == kind) + 1 for kind in (False, True))
    late = sum(1 << (len(pattern) - stop) for stop in hovers.tolist())
    inner = sorted(rests.tolist(), key=lambda stop: max(hovers[0] - stop, stop - hovers[-1], 0))
    places = np.full((len(pattern) + 2, 1), HOVER, dtype=np.intp)
    places[0], places[-1] = ORIGIN, DESTINATION
    for chosen, time_left_s in _chosen(terrain, pattern, places, inner, to_beat_s):
        number = np.zeros(len(time_left_s), dtype=np.int64)
        for stop in rests:
            number = (len(terrain.duration_s) - FIRST_BUILDING) * number
            number += chosen[stop] - FIRST_BUILDING
        rank = (len(pattern) << STOPS_FROM_BIT) + (number << len(pattern)) + late
        yield Boxes.whole(pattern, chosen, rank, time_left_s)


def _chosen(
    terrain: Terrain,
    pattern: Pattern,
    places: Integers,
    open_: Sequence[int],
    to_beat_s: Callable[[], float] | None,
) -> Iterator[tuple[Integers, Floats]]:
    """Places with buildings chosen for the open stops, one by one, and the time that legs leave.

    Those next to the hovers come first. A part that is ruled out takes all its sequences with it.
    """
    first, last = (np.flatnonzero(pattern) + 1)[[0, -1]]
    # The part around the hovers without an open stop.
    start = max((stop + 1 for stop in open_ if stop < first), default=0)
    end = min((stop - 1 for stop in open_ if stop > last), default=len(pattern) + 1)
    if not any(first < stop < last for stop in open_):
        part = places[start : end + 1]
        time_left_s = terrain.deadline_s - terrain.duration_s[part[:-1], part[1:]].sum(axis=0)
        kept = np.flatnonzero(time_left_s >= 0.0)
        if to_beat_s and open_ and start < first:  # the first place is left, its stay not counted
            within = pattern[start : min(end, len(pattern))]
            boxes = Boxes.whole(within, part[:, kept], kept, time_left_s[kept])
            kept = passable(terrain, boxes, np.full(len(kept), to_beat_s()))[0].rank
        places = places[:, kept]
        if not open_:
            yield places, time_left_s[kept]
            return
    stop, *later = open_
    buildings = len(terrain.duration_s) - FIRST_BUILDING
    for begin in range(0, places.shape[1] * buildings, SEQUENCES_AT_ONCE):
        number = np.arange(begin, min(begin + SEQUENCES_AT_ONCE, places.shape[1] * buildings))
        wider = places[:, number // buildings]
        wider[stop] = FIRST_BUILDING + number % buildings
        yield from _chosen(terrain, pattern, wider, later, to_beat_s)
