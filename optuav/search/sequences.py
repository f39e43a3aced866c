"""All sequences of stops with so many rests and hovers, as boxes."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from optuav.arrays import Integers
from optuav.search.boxes import Boxes, Pattern
from optuav.search.terrain import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN, Terrain

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
