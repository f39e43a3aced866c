"""Sequences of stops: which kinds of stops in order, and which buildings they rest on."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.search.bounds import passable
from optuav.search.terrain import (
    DESTINATION,
    FIRST_BUILDING,
    HOVER,
    ORIGIN,
    ROUNDING,
    Boxes,
    Pattern,
    Terrain,
)

AT_ONCE = 1 << 16  # Sequences that are made at once
STOPS_FROM_BIT = 52
"""Bits of a rank below the number of stops; more sequences than that are out of reach."""
OPEN = -1  # Number in place of a building that is not chosen yet


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
    stops, then by the buildings in order, then resting early first. Of a hover time to beat [s],
    sequences are left out with a part that rules it out (`optuav.search.bounds.passable`).
    """
    buildings = len(terrain.duration_s) - FIRST_BUILDING
    late = sum(1 << (len(pattern) - stop) for stop, hover in enumerate(pattern, 1) if hover)
    for places, time_left_s in _Choice(terrain, pattern, to_beat_s).sequences():
        number = np.zeros(places.shape[1], dtype=np.int64)
        for stop in np.flatnonzero(~np.array(pattern)) + 1:
            number = buildings * number + places[stop] - FIRST_BUILDING
        rank = (len(pattern) << STOPS_FROM_BIT) + (number << len(pattern)) + late
        yield _boxes(pattern, places, rank, time_left_s)


def _boxes(pattern: Pattern, places: Integers, rank: Integers, time_left_s: Floats) -> Boxes:
    """Boxes of any durations in the time that is left [s]."""
    high_s = np.tile(time_left_s, (len(pattern), 1))
    low_s, pulled = np.zeros_like(high_s), np.ones_like(high_s, dtype=bool)
    return Boxes(pattern, places, rank, low_s, high_s, np.full(len(rank), np.inf), pulled)


class _Choice:
    """Buildings are chosen one by one, those between hovers first, then outwards from the hovers.

    A part of a sequence that is ruled out takes all sequences with it.
    """

    def __init__(
        self, terrain: Terrain, pattern: Pattern, to_beat_s: Callable[[], float] | None
    ) -> None:
        self.terrain, self.pattern, self.to_beat_s = terrain, pattern, to_beat_s
        self.hovers = [stop for stop, hover in enumerate(pattern, 1) if hover]
        rests = [stop for stop, hover in enumerate(pattern, 1) if not hover]
        first, last = self.hovers[0], self.hovers[-1]
        self.rests = sorted(rests, key=lambda stop: max(first - stop, stop - last, 0))
        # By number of open stops and place: the least time from the origin, and to the destination.
        leg_s, on = terrain.duration_s, slice(FIRST_BUILDING, None)
        self.there_s, self.back_s = [leg_s[ORIGIN]], [leg_s[:, DESTINATION]]
        for _ in rests[1:]:
            there_s, back_s = self.there_s[-1], self.back_s[-1]
            self.there_s.append((there_s[on, None] + leg_s[on]).min(axis=0))
            self.back_s.append((leg_s[:, on] + back_s[on]).min(axis=1))

    def sequences(self) -> Iterator[tuple[Integers, Floats]]:
        """Places of whole sequences (stop + 2, sequence), and the time that legs leave them [s]."""
        places = np.full((len(self.pattern) + 2, 1), OPEN, dtype=np.intp)
        places[[0, *self.hovers, -1], 0] = ORIGIN, *[HOVER] * len(self.hovers), DESTINATION
        return self._chosen(places, self.rests)

    def _chosen(self, places: Integers, rests: Sequence[int]) -> Iterator[tuple[Integers, Floats]]:
        """The same with some buildings chosen, of which none is ruled out."""
        if not rests:
            places, time_left_s = self._left(places)
            if places.shape[1]:
                yield places, time_left_s
            return
        stop, *later = rests
        buildings = len(self.terrain.duration_s) - FIRST_BUILDING
        count = places.shape[1] * buildings
        for begin in range(0, count, AT_ONCE):
            of, building = np.divmod(np.arange(begin, min(begin + AT_ONCE, count)), buildings)
            wider = places[:, of]
            wider[stop] = FIRST_BUILDING + building
            if later:
                wider, _ = self._left(wider)
            yield from self._chosen(wider, later)

    def _left(self, places: Integers) -> tuple[Integers, Floats]:
        """Those that neither the deadline nor their part around the hovers rules out."""
        chosen, last = places[:, :1].ravel() != OPEN, len(places) - 1
        start, end = self.hovers[0], self.hovers[-1]
        while start > 0 and chosen[start - 1]:
            start -= 1
        while end < last and chosen[end + 1]:
            end += 1
        part, deadline_s = places[start : end + 1], self.terrain.deadline_s
        time_left_s = deadline_s - self.terrain.duration_s[part[:-1], part[1:]].sum(axis=0)
        if start > 0:
            time_left_s += ROUNDING * deadline_s - self.there_s[start - 1][part[0]]
        if end < last:
            time_left_s += ROUNDING * deadline_s - self.back_s[last - end - 1][part[-1]]
        places, part, time_left_s = _kept(time_left_s >= 0.0, places, part, time_left_s)
        # Its first place is left with full wells, so that must not be a hover, which counts.
        if self.to_beat_s and start < self.hovers[0] and (start > 0 or end < last):
            pattern = self.pattern[start : min(end, last - 1)]
            boxes = _boxes(pattern, part, np.zeros(part.shape[1], np.int64), time_left_s)
            found = passable(self.terrain, boxes, time_left_s, self.to_beat_s())
            places, time_left_s = _kept(found, places, time_left_s)
        return places, time_left_s


def _kept(which: Booleans, *columns: Any) -> tuple[Any, ...]:
    """Some columns of arrays."""
    return columns if which.all() else tuple(each[..., which] for each in columns)
