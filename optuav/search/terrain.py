"""A mission as arrays for the search, and boxes of the plans over it.

Each leg and stay is a map of the state (y, z): the total charge y = y1 + y2 and the tilt
z = y1 − ωy. A leg of duration T that draws Q takes it to (y − Q, z e^(−k'T) + Z), a stay of
duration t at the current I to (y + I t, z e^(−k't) + (1−ω) I (1 − e^(−k't))/k'), with
k' = k_F/(ω(1−ω)); see `optuav.physics.kibam`.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.physics import kibam

ORIGIN, HOVER, DESTINATION, FIRST_BUILDING = 0, 1, 2, 3  # Numbers of places
AT_ONCE = 1 << 16  # Sequences that are made at once
STOPS_FROM_BIT = 52
"""Bits of a rank below the number of stops; more sequences than that are out of reach."""
Pattern = tuple[bool, ...]  # Kinds of the stops in order: True for a hover, False for a rest
ROUNDING = 1e-11  # Share of the capacity by which a limit must be missed before a box falls [-]


class Flown(NamedTuple):
    """What legs take and do to the wells: arrays (leg, box), or (stage, start, end) from take-off.

    Duration of the leg [s], Q [A s], e^(−k'T) [-] and Z [A s].
    """

    duration_s: Floats
    charge_As: Floats
    remaining: Floats
    tilt_As: Floats


@dataclass(frozen=True)
class Terrain:
    """Places and legs between them, by number: origin, hover point, destination, then buildings."""

    battery: kibam.Battery  # One, full at the start; B > 0, 0 < ω < 1, k_F ≥ 0
    deadline_s: float
    least_charge_As: float  # η0 B, to be left at the end [A s]
    duration_s: Floats  # Of the legs (start, end) [s]; inf where there is none
    # Stages of the legs (stage, start, end) [s], [A]; the current that they draw, ≥ 0.
    stage_durations_s: Floats
    stage_currents_A: Floats
    # Net current into the battery while staying (place,) [A]: hovering at the hover point, resting
    # elsewhere.
    stay_current_A: Floats
    tapers: bool = False  # Whether charging tapers once y1 = ωB; else it must not go on

    @property
    def longest_stay_s(self) -> float:
        """What the deadline leaves of the shortest way by the hover point [s]; −inf if none."""
        there_s, back_s = self.duration_s[ORIGIN].copy(), self.duration_s[:, DESTINATION].copy()
        for _ in range(len(self.duration_s)):
            there_s = np.minimum(there_s, (there_s[:, None] + self.duration_s).min(axis=0))
            back_s = np.minimum(back_s, (self.duration_s + back_s).min(axis=1))
        return self.deadline_s - float(there_s[HOVER] + back_s[HOVER])

    @cached_property
    def leg_maps(self) -> Flown:
        """All legs up to the end of each stage; only whole legs where y1 is least at their ends."""
        charge, elapsed_s, found = kibam.Tilted(0.0, 0.0), np.zeros_like(self.duration_s), []
        for current_A, time_s in zip(self.stage_currents_A, self.stage_durations_s, strict=True):
            charge = kibam.tilted_after(self.battery, charge, kibam.Stage(-current_A, time_s))
            elapsed_s = elapsed_s + time_s
            remaining, _ = kibam.levelling(self.battery, elapsed_s)
            found.append((-charge.total_As, remaining, charge.tilt_As))
        drawn_A = self.stage_currents_A[self.stage_durations_s > 0.0]
        kept = found[-1:] if np.all(kibam.falls_throughout(self.battery, -drawn_A)) else found
        return Flown(self.duration_s[None], *(np.array(table) for table in zip(*kept, strict=True)))


@dataclass(frozen=True)
class Boxes:
    """Boxes of one pattern: a sequence of stops with an interval for the duration of each stay.

    Arrays have one column a box.
    """

    pattern: Pattern
    places: Integers  # Numbers of the places, both ends included (stop + 2, box)
    rank: Integers  # Rank of the sequence in the order in which ties are broken (box,)
    # Shortest and longest stays (stop, box) [s].
    low_s: Floats
    high_s: Floats
    promise: Floats  # How far the box is from being ruled out (box,) [A s]
    # Whether something pulls the stay from the corner of long rests and short hovers (stop, box):
    # the deadline, the hover time to reach, or a full battery.
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

    def take(self, which: Booleans | Integers | slice) -> "Boxes":
        """Some of the boxes."""
        columns = (getattr(self, each.name) for each in fields(self)[1:])
        return Boxes(self.pattern, *(each[..., which] for each in columns))

    def halves(self) -> "Boxes":
        """Every box cut in two where it is widest, of the stays that something pulls."""
        width_s = self.high_s - self.low_s
        widest = np.argmax(np.where(self.pulled, width_s, 0.0), axis=0)
        column = np.arange(len(self))
        middle_s = self.low_s[widest, column] + 0.5 * width_s[widest, column]
        twice = self.take(np.tile(column, 2))
        twice.high_s[widest, column] = middle_s
        twice.low_s[widest, len(self) + column] = middle_s
        return twice


def patterns(rests: int, hovers: int) -> Iterator[Pattern]:
    """Kinds of stops in order, up to `rests` rests and 1 to `hovers` hovers, the shortest first.

    Two hovers in a row are one. Among equally many stops, rests come early, as ties are broken.
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
    late = sum(1 << (len(pattern) - stop) for stop, hover in enumerate(pattern, 1) if hover)
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
        rank = (len(pattern) << STOPS_FROM_BIT) + (number[kept] << len(pattern)) + late
        high_s = np.tile(time_left_s[kept], (len(pattern), 1))
        low_s, pulled = np.zeros_like(high_s), np.ones_like(high_s, dtype=bool)
        promise = np.full(len(rank), np.inf)
        yield Boxes(pattern, places[:, kept], rank, low_s, high_s, promise, pulled)
