"""Branch and bound over sequences of stops and the durations of their stays."""

import itertools
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.physics.kibam import Stage, Tilted, Wells, tapered, tilted_after
from optuav.physics.quantity import TINY
from optuav.search.bounds import possible
from optuav.search.sequences import patterns, sequences
from optuav.search.terrain import HOVER, Boxes, Pattern, Terrain

TIE_S = 5e-7
"""Hover times that differ by no more tie [s]; a proof leaves a gap of twice that."""
BEAM, BEAM_LEVELS = 64, 10
"""Boxes that are followed down, and how far, for a good plan to begin with."""
MOST_BOXES = 1_000_000  # Boxes that are looked at where no time limit is given: some ten seconds
AT_ONCE = 1 << 14  # Boxes that are looked at together
GAP_HALVINGS = 20  # Halvings of the gap that an early end of the search leaves
GAP_BOXES = 2_000_000  # Boxes that are looked at for that where no time limit is given
GAP_SHARE = 0.2  # Share of a time limit that is kept for finding that gap
INTERRUPTED = "was interrupted"  # Why a search ended early at Ctrl-C
INTERRUPTED_S = 1.0  # Longest time for finding the gap then [s]
HALVINGS = 40  # Halvings of a hover time; some 1e-9 s are left

Progress = Callable[[float, int, int], None]
"""Called with the best hover time so far [s], and how many boxes were examined and are open."""


@dataclass(frozen=True)
class SearchResult:
    """Result of a search."""

    stops: "Stops | None"
    bound_s: float  # No plan hovers longer [s]; −inf if it is proved that no plan exists
    ended: str  # Why the search ended early; empty if it is complete


def search(
    terrain: Terrain,
    rests: int,
    hovers: int,
    *,
    time_limit_s: float | None = None,
    progress: Progress | None = None,
) -> SearchResult:
    """The plan of the longest hover time with at most `rests` rests and `hovers` hovers.

    The durations of every sequence of stops are cut into boxes, until none is left that can hold a
    plan better than the best by more than a tie (`optuav.search.bounds`). Among plans that tie, the
    one with the fewest stops is returned, then the buildings that stand first, then resting early;
    its rests are as short as its hover time allows. Rests may be 0; places may be visited again.
    Without a time limit [s], a search ends after about `MOST_BOXES` boxes; Ctrl-C ends any.
    """
    return _BranchAndBound(terrain, time_limit_s, progress).run(patterns(rests, hovers))


class _EarlyEnd(Exception):  # noqa: N818
    """The search ends early, for the reason given as text."""


class _BranchAndBound:
    """The open boxes, and the best plan so far: of plans that tie, the one that ranks first.

    The longest hover time met exceeds the plan's own by no more than a tie.
    """

    def __init__(
        self, terrain: Terrain, time_limit_s: float | None, progress: Progress | None
    ) -> None:
        self.terrain, self.progress = terrain, progress
        self.time_limit_s = np.inf if time_limit_s is None else time_limit_s
        self.started_s = time.monotonic()
        self.longest_s = -np.inf
        self.best: Stops | None = None
        self.open: deque[Boxes] = deque()
        self.examined = 0

    def run(self, kinds: Iterable[Pattern]) -> SearchResult:
        ended, begun = "", False
        try:
            self._begin(kinds)
            begun = True
            self._divide()
        except _EarlyEnd as reason:
            ended = str(reason)
        except KeyboardInterrupt:
            ended = INTERRUPTED
            self.time_limit_s = time.monotonic() - self.started_s + INTERRUPTED_S
        bound_s = self._bound_s() if begun else self.terrain.longest_stay_s
        best = None if self.best is None else with_short_rests(self.terrain, self.best)
        return SearchResult(best, bound_s, ended)

    def _begin(self, kinds: Iterable[Pattern]) -> None:
        """Look at every sequence; the most promising boxes of each pattern lead to a good plan."""
        for pattern in kinds:
            for roots in sequences(self.terrain, pattern, self._least_s):
                boxes = self._looked_at(roots)
                self._keep(boxes)
                for _ in range(BEAM_LEVELS):
                    boxes = boxes.take(np.argsort(-boxes.promise, kind="stable")[:BEAM])
                    if not len(boxes):
                        break
                    boxes = self._looked_at(boxes.halves())

    def _divide(self) -> None:
        """Cut the open boxes until none is left, the largest first."""
        budget = self.examined + (MOST_BOXES if self.time_limit_s == np.inf else np.inf)
        while self.open:
            if self.examined > budget:
                raise _EarlyEnd(f"ended after {self.examined} boxes")
            self._keep(self._looked_at(self.open[0].halves()))
            self.open.popleft()

    def _keep(self, boxes: Boxes) -> None:
        """Add boxes to the open ones, in groups of at most `AT_ONCE`."""
        for first in range(0, len(boxes), AT_ONCE):
            self.open.append(boxes.take(slice(first, first + AT_ONCE)))

    def _looked_at(self, boxes: Boxes) -> Boxes:
        """Cut or drop boxes, look for a better plan in them, and return the rest."""
        self.examined += len(boxes)
        left = possible(self.terrain, boxes, self._to_beat_s(boxes))
        if len(left):
            self._improve(left)
        self._go_on()
        return left

    def _to_beat_s(self, boxes: Boxes) -> Floats:
        """Hover time that a plan in a box must reach [s]; a tie is enough if it ranks first."""
        if self.best is None:
            return np.zeros(len(boxes))
        first = boxes.rank < self.best.rank
        return np.maximum(self.longest_s + np.where(first, -TIE_S, TIE_S), 0.0)

    def _least_s(self) -> float:
        """Hover time that a plan must reach in any box [s]."""
        self._go_on()
        return max(self.longest_s - TIE_S, 0.0)

    def _improve(self, boxes: Boxes) -> None:
        """Look for a better plan in boxes."""
        beat_s = self._to_beat_s(boxes)
        if self.best is not None:
            # The sequence that leads may go on to lead by less than a tie.
            ahead_s = np.nextafter(self.best.hover_s, np.inf)
            beat_s = np.where(boxes.rank == self.best.rank, ahead_s, beat_s)
        better, stays_s = longest(self.terrain, boxes, beat_s)
        if not better.any():
            return
        places, rank = boxes.places[:, better], boxes.rank[better]
        hover_s = stays_s[boxes.hovers].sum(axis=0)
        self.longest_s = max(self.longest_s, float(hover_s.max()))
        ties = np.flatnonzero(hover_s >= self.longest_s - TIE_S)
        if not len(ties):
            return
        first = int(ties[np.lexsort((-hover_s[ties], rank[ties]))[0]])
        new = Stops(places[:, first], stays_s[:, first], float(hover_s[first]), int(rank[first]))
        old = self.best
        falls_behind = old is None or old.hover_s < self.longest_s - TIE_S
        if old is None or falls_behind or (new.rank, -new.hover_s) < (old.rank, -old.hover_s):
            self.best = new

    def _go_on(self) -> None:
        """Report the progress; the search ends if it is late."""
        if self.progress is not None:
            self.progress(max(self.longest_s, 0.0), self.examined, sum(map(len, self.open)))
        if self._late((1.0 - GAP_SHARE) * self.time_limit_s):
            raise _EarlyEnd(f"ended after {self.time_limit_s:g} s")

    def _late(self, limit_s: float) -> bool:
        return time.monotonic() - self.started_s > limit_s

    def _bound_s(self) -> float:
        """Hover time that no plan exceeds [s], by halving over times that open boxes allow."""
        low_s = self.longest_s + TIE_S
        if not self.open:
            return low_s
        low_s, high_s, left = max(low_s, 0.0), self.terrain.longest_stay_s, list(self.open)
        budget = GAP_BOXES if self.time_limit_s == np.inf else np.inf
        for _ in range(GAP_HALVINGS):
            middle_s, passed = 0.5 * (low_s + high_s), []
            for boxes in left:
                budget -= len(boxes)
                if budget < 0 or self._late(self.time_limit_s):
                    return high_s
                passed.append(possible(self.terrain, boxes, np.full(len(boxes), middle_s)))
            if any(map(len, passed)):
                low_s, left = middle_s, [boxes for boxes in passed if len(boxes)]
            else:
                high_s = middle_s
        return high_s


@dataclass(frozen=True)
class Stops:
    """A plan: numbers of the places, both ends included (stop + 2,), and stays (stop,) [s].

    With its hover time, and the rank of its sequence for breaking ties.
    """

    places: Integers
    stays_s: Floats
    hover_s: float
    rank: int


def slack(terrain: Terrain, places: Integers, stays_s: Floats) -> Floats:
    """Smallest distance of plans to a limit of the wells [A s]; < 0 where one is violated.

    At the ends of stages: y1 is least or largest there. Where charging tapers, none passes full.
    Places (stop + 2, plan), stays (stop, plan) [s].
    """
    battery, maps = terrain.battery, terrain.leg_maps
    share, full_As = battery.available_fraction, battery.full.available_As
    current_A = terrain.stay_current_A[places]
    count = places.shape[1]
    total, tilt = (np.full(count, charge_As) for charge_As in terrain.charge_at(places[0]))
    least = np.full(count, np.inf)
    for stop, (start, end) in enumerate(itertools.pairwise(places)):
        totals = total - maps.charge_As[:, start, end]
        tilts = tilt * maps.remaining[:, start, end] + maps.tilt_As[:, start, end]
        least = np.minimum(least, (share * totals + tilts).min(axis=0))
        total, tilt = totals[-1], tilts[-1]
        if stop == len(stays_s):
            break
        least = np.minimum(least, total - terrain.least_on_landing_As)
        stay = Stage(current_A[stop + 1], stays_s[stop])
        total, tilt = _after_stay(terrain, Tilted(total, tilt), stay)
        available = share * total + tilt
        room_As = np.inf if terrain.tapers else full_As - available
        least = np.minimum(least, np.minimum(available, room_As))
    return np.asarray(np.minimum(least, total - terrain.least_charge_As))


def _after_stay(terrain: Terrain, before: Tilted, stay: Stage) -> Tilted:
    """Charge (plan,) after a stay."""
    battery = terrain.battery
    after = tilted_after(battery, before, stay)
    if terrain.tapers:
        over = after.wells(battery).available_As > battery.full.available_As
        if over.any():
            start = Wells(*(well[over] for well in before.wells(battery)))
            end = tapered(battery, start, Stage(*(values[over] for values in stay)))
            after.total_As[over], after.tilt_As[over] = Tilted.of(battery, end)
    return after


def longest(terrain: Terrain, boxes: Boxes, hover_s: Floats) -> tuple[Booleans, Floats]:
    """Find plans in boxes that hover at least a given time.

    Two ways lead through a box: hovers grow from the shortest, and rests are as long or as short as
    they may be. Halving finds where the wells end each. Returns whether one was found (box,), and
    the stays of those found (stop, found) [s].
    """
    hover = np.array(boxes.pattern)[:, None]
    short = replace(boxes, high_s=np.where(hover, boxes.high_s, boxes.low_s))
    found_any, stays_s = _along(terrain, boxes, hover_s)
    found_short, short_s = _along(terrain, short, hover_s)
    hovers = boxes.hovers
    longer = short_s[hovers].sum(axis=0) > stays_s[hovers].sum(axis=0)
    take = found_short & (longer | ~found_any)
    found_any = found_any | found_short
    return found_any, np.where(take, short_s, stays_s)[:, found_any]


def _along(terrain: Terrain, boxes: Boxes, hover_s: Floats) -> tuple[Booleans, Floats]:
    """Like `longest`, with the long rests of a box only; stays of all boxes (stop, box)."""
    hovers, rests = boxes.hovers, boxes.rests
    legs_s = terrain.duration_s[boxes.places[:-1], boxes.places[1:]]
    left_s = terrain.deadline_s - legs_s.sum(axis=0)
    low_s = np.maximum(boxes.low_s[hovers].sum(axis=0), hover_s)
    stays_s = _stays(boxes, low_s, left_s)
    held = _holds(terrain, boxes, stays_s, left_s) & (stays_s[hovers].sum(axis=0) >= hover_s)
    if not held.any():
        return held, stays_s
    chosen, low_s, left_s = boxes.take(held), low_s[held], left_s[held]
    high_s = left_s - chosen.low_s[rests].sum(axis=0)
    high_s = np.maximum(low_s, np.minimum(high_s, chosen.high_s[hovers].sum(axis=0)))
    best_s = stays_s[:, held]
    for _ in range(HALVINGS):
        middle_s = 0.5 * (low_s + high_s)
        tried_s = _stays(chosen, middle_s, left_s)
        good = _holds(terrain, chosen, tried_s, left_s)
        best_s = np.where(good, tried_s, best_s)
        low_s, high_s = np.where(good, middle_s, low_s), np.where(good, high_s, middle_s)
    stays_s[:, held] = best_s
    return held, stays_s


def _holds(terrain: Terrain, boxes: Boxes, stays_s: Floats, left_s: Floats) -> Booleans:
    """Test whether deadline and wells allow stays."""
    in_time = stays_s.sum(axis=0) <= left_s
    return np.asarray(in_time & (slack(terrain, boxes.places, stays_s) >= 0.0))


def with_short_rests(terrain: Terrain, stops: Stops) -> Stops:
    """The same plan with every rest, one after another, as short as the wells allow."""
    places, stays_s = stops.places[:, None], stops.stays_s[:, None].copy()
    for stop in np.flatnonzero(stops.places[1:-1] != HOVER):
        low_s, high_s = 0.0, float(stays_s[stop, 0])
        for time_s in (low_s, *[None] * HALVINGS):
            tried_s = stays_s.copy()
            tried_s[stop] = 0.5 * (low_s + high_s) if time_s is None else time_s
            if slack(terrain, places, tried_s)[0] >= 0.0:
                high_s, stays_s = float(tried_s[stop, 0]), tried_s
            else:
                low_s = float(tried_s[stop, 0])
    return replace(stops, stays_s=stays_s[:, 0])


def _stays(boxes: Boxes, hover_s: Floats, left_s: Floats) -> Floats:
    """Stays (stop, box) of a given total hover, with rests for the other time, within the boxes."""
    stays_s = np.empty_like(boxes.low_s)
    for group, sum_s in ((boxes.hovers, hover_s), (boxes.rests, left_s - hover_s)):
        low_s, width_s = boxes.low_s[group], boxes.high_s[group] - boxes.low_s[group]
        most_s = np.maximum(width_s.sum(axis=0), TINY)
        stays_s[group] = low_s + np.clip((sum_s - low_s.sum(axis=0)) / most_s, 0.0, 1.0) * width_s
    return stays_s
