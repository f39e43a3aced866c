"""A mission as arrays for the search, and boxes of the plans over it.

Each leg and stay is a map of the state (y, z): the total charge y = y1 + y2 and the tilt
z = y1 − ωy. A leg of duration T that draws Q takes it to (y − Q, z e^(−k'T) + Z), a stay of
duration t at the current I to (y + I t, z e^(−k't) + (1−ω) I (1 − e^(−k't))/k'), with
k' = k_F/(ω(1−ω)); see `optuav.physics.kibam`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.physics import kibam

ORIGIN, HOVER, DESTINATION, FIRST_BUILDING = 0, 1, 2, 3  # Numbers of places
Pattern = tuple[bool, ...]  # Kinds of the stops in order: True for a hover, False for a rest
LEAST_VIOLATION = (
    1e-11  # Least violation of a limit that drops a box, as a share of the capacity [-]
)


class Flown(NamedTuple):
    """Time of legs and their effect on the wells: (leg, box), or (stage, start, end) from take-off.

    Duration of the leg [s], Q [A s], e^(−k'T) [-] and Z [A s].
    """

    duration_s: Floats
    charge_As: Floats
    remaining: Floats
    tilt_As: Floats


@dataclass(frozen=True)
class Terrain:
    """Places and legs between them, by number: origin, hover point, destination, then buildings."""

    battery: kibam.Battery  # One; B > 0, 0 < ω < 1, k_F ≥ 0
    deadline_s: float
    least_charge_As: float  # η0 B, to be left at the end [A s]
    duration_s: Floats  # Time of the legs (start, end) [s]; inf without a leg
    # Stages of the legs (stage, start, end) [s], [A]; the current that they draw, ≥ 0.
    stage_durations_s: Floats
    stage_currents_A: Floats
    # Net current into the battery while staying (place,) [A]: hovering at the hover point, resting
    # elsewhere.
    stay_current_A: Floats
    tapers: bool = False  # Whether charging tapers once y1 = ωB; else it must not go on
    begin: kibam.Tilted | None = None  # Charge at the start; None: full
    # Charge to be left at the end of every leg before the last [A s]; −inf for none
    least_on_landing_As: float = -math.inf

    @property
    def longest_stay_s(self) -> float:
        """Time that the deadline leaves beyond the shortest way by the hover point [s], or −inf."""
        back_s = least_sums(self.duration_s, HOVER)[DESTINATION]
        return self.deadline_s - float(least_sums(self.duration_s.T, HOVER)[ORIGIN] + back_s)

    def charge_at(self, places: Integers) -> kibam.Tilted:
        """Largest charge on leaving first places: at the start the charge of take-off."""
        full = kibam.start(self.battery)
        return self.begin if self.begin and (places == ORIGIN).all() else full

    @cached_property
    def leg_maps(self) -> Flown:
        """All legs up to the end of each stage; only whole legs where y1 is least at their ends."""
        drawn_A = self.stage_currents_A[self.stage_durations_s > 0.0]
        whole = np.all(kibam.falls_throughout(self.battery, -drawn_A))
        charge, elapsed_s, flown = kibam.Tilted(0.0, 0.0), np.zeros_like(self.duration_s), []
        stages = zip(self.stage_currents_A, self.stage_durations_s, strict=True)
        for number, (current_A, time_s) in enumerate(stages, 1):
            charge = kibam.tilted_after(self.battery, charge, kibam.Stage(-current_A, time_s))
            elapsed_s = elapsed_s + time_s
            if number == len(self.stage_currents_A) or not whole:
                remaining, _ = kibam.levelling(self.battery, elapsed_s)
                flown.append((-charge.total_As, remaining, charge.tilt_As))
        return Flown(self.duration_s[None], *map(np.array, zip(*flown, strict=True)))


def least_sums(figures: Floats, place: int) -> Floats:
    """Least sums of the figures of legs (start, end) from a place to every other."""
    least: Floats = figures[place].copy()
    before = b""
    least[place] = 0.0
    while before != (before := least.tobytes()):
        least = np.minimum(least, (least[:, None] + figures).min(axis=0))
    return least


@dataclass(frozen=True)
class Boxes:
    """Boxes of one pattern: a sequence of stops with an interval for the duration of each stay.

    Arrays have one column a box.
    """

    pattern: Pattern
    places: Integers  # Numbers of the places, both ends included (stop + 2, box)
    rank: Integers  # Rank of the sequence for breaking ties (box,)
    # Shortest and longest stays (stop, box) [s].
    low_s: Floats
    high_s: Floats
    bound_s: Floats  # Hover time that no plan of the sequence exceeds (box,) [s]
    # Whether something pulls the stay from the corner of long rests and short hovers (stop, box):
    # the deadline, the hover time to reach, or a full battery.
    pulled: Booleans

    @classmethod
    def whole(
        cls, pattern: Pattern, places: Integers, rank: Integers, time_left_s: Floats
    ) -> "Boxes":
        """Boxes of any durations in the time that is left [s]."""
        high_s = np.tile(time_left_s, (len(pattern), 1))
        low_s, pulled = np.zeros_like(high_s), np.ones_like(high_s, dtype=bool)
        return cls(pattern, places, rank, low_s, high_s, np.full(len(rank), np.inf), pulled)

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
        columns = (getattr(self, field.name) for field in fields(self)[1:])
        return Boxes(self.pattern, *(column[..., which] for column in columns))

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


def joined(parts: Sequence[Boxes]) -> Boxes:
    """All boxes of some of one pattern."""
    columns = ([getattr(part, field.name) for part in parts] for field in fields(Boxes)[1:])
    return Boxes(parts[0].pattern, *(np.concatenate(column, axis=-1) for column in columns))
