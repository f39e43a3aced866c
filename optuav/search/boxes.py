"""Boxes: a sequence of stops with an interval for the duration of each stay; all sequences."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.search.terrain import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN, Terrain

Pattern = tuple[bool, ...]
"""Kinds of the stops in order: True for a hover, False for a rest."""


@dataclass(frozen=True)
class Boxes:
    """Boxes of one pattern, as arrays with one column a box.

    Numbers of the places, both ends included (stop + 2, box); rank of the sequence in the order in
    which ties are broken (box,); shortest and longest stays (stop, box) [s]; the promise, how far
    the box is from being ruled out (box,) [A s]; and whether something pulls the stay from the
    corner of long rests and short hovers (stop, box): the deadline, the hover time to reach, or a
    full battery.
    """

    pattern: Pattern
    places: Integers
    rank: Integers
    low_s: Floats
    high_s: Floats
    promise: Floats
    pulled: Booleans

    def __len__(self) -> int:
        return len(self.rank)

    @property
    def hovers(self) -> list[int]:
        """Numbers of the stops that are hovers."""
        return [k for k, hover in enumerate(self.pattern) if hover]

    @property
    def rests(self) -> list[int]:
        """Numbers of the stops that are rests."""
        return [k for k, hover in enumerate(self.pattern) if not hover]

    def take(self, which: Booleans | Integers | slice) -> Boxes:
        """Some of the boxes."""
        return Boxes(self.pattern, *(each[..., which] for each in self._columns))

    @property
    def _columns(self) -> list[Any]:
        return [getattr(self, each.name) for each in fields(self)[1:]]

    def pieces(self, size: int) -> Iterator[Boxes]:
        """The boxes in groups of at most so many."""
        for first in range(0, len(self), size):
            yield self.take(slice(first, first + size))

    def halves(self) -> Boxes:
        """Every box cut in two where it is widest, of the stays that something pulls."""
        width_s = self.high_s - self.low_s
        widest = np.argmax(np.where(self.pulled, width_s, 0.0), axis=0)
        column = np.arange(len(self))
        middle_s = self.low_s[widest, column] + 0.5 * width_s[widest, column]
        low_s, high_s = self.low_s.copy(), self.high_s.copy()
        high_s[widest, column] = middle_s
        low_s[widest, column] = middle_s
        twice = self.take(np.tile(column, 2))
        return replace(
            twice,
            low_s=np.concatenate([self.low_s, low_s], axis=1),
            high_s=np.concatenate([high_s, self.high_s], axis=1),
        )


def joined(groups: Sequence[Boxes]) -> Boxes:
    """Boxes of one pattern as one group; at least one group is needed."""
    columns = zip(*(boxes._columns for boxes in groups), strict=True)
    return Boxes(groups[0].pattern, *(np.concatenate(each, axis=-1) for each in columns))


AT_ONCE = 1 << 16
"""Sequences that are made at once."""
STOPS_FROM_BIT = 52
"""Bits of a rank below the number of stops; more sequences than that are out of reach."""


def patterns(rests: int, hovers: int) -> Iterator[Pattern]:
    """Kinds of stops in order, at most so many of each and at least one hover, the short first.

    Two hovers in a row are one. Among as many stops, rests come early, as ties are broken.
    """
    for stops in range(1, rests + hovers + 1):
        for pattern in itertools.product((False, True), repeat=stops):
            few = 1 <= sum(pattern) <= hovers and stops - sum(pattern) <= rests
            if few and not any(a and b for a, b in itertools.pairwise(pattern)):
                yield pattern


def sequences(terrain: Terrain, pattern: Pattern) -> Iterator[Boxes]:
    """All sequences of a pattern that can be flown, each as one box of any durations.

    Two rests in a row on the same building are one, and left out. Sequences rank by the number of
    stops, then by the buildings in order, then resting early first.
    """
    buildings = len(terrain.duration_s) - FIRST_BUILDING
    rests = [stop for stop, hover in enumerate(pattern, 1) if not hover]
    count = buildings ** len(rests)
    for first in range(0, count, AT_ONCE):
        number = np.arange(first, min(first + AT_ONCE, count))
        places = np.full((len(pattern) + 2, len(number)), HOVER, dtype=np.intp)
        places[0], places[-1] = ORIGIN, DESTINATION
        digits = number
        for stop in reversed(rests):
            digits, building = np.divmod(digits, buildings)
            places[stop] = FIRST_BUILDING + building
        time_left_s = terrain.deadline_s - terrain.duration_s[places[:-1], places[1:]].sum(axis=0)
        kept = time_left_s >= 0.0
        high_s = np.broadcast_to(time_left_s[kept], (len(pattern), int(kept.sum()))).copy()
        yield Boxes(
            pattern,
            places[:, kept],
            _rank(pattern, number[kept]),
            np.zeros_like(high_s),
            high_s,
            np.full(high_s.shape[1], np.inf),
            np.ones(high_s.shape, bool),
        )


def _rank(pattern: Pattern, number: Integers) -> Integers:
    """Rank of sequences by their number within the pattern."""
    late = sum(1 << (len(pattern) - stop) for stop, hover in enumerate(pattern, 1) if hover)
    rank: Integers = (len(pattern) << STOPS_FROM_BIT) + (number << len(pattern)) + late
    return rank
