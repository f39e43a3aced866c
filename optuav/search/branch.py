"""Branch and bound over sequences of stops and the durations of their stays.

Every sequence has a bound by a linear programme (`optuav.search.sequence_bounds`) and, in falling
order of the bounds, a plan by sequential linear programming. Only sequences whose bound exceeds the
best plan are cut into boxes, until none is left that can hold a better one
(`optuav.search.bounds`).
"""

import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Floats
from optuav.presentation.numbers import figure
from optuav.search.bounds import possible
from optuav.search.plans import Stops, feasible, longest, with_short_rests
from optuav.search.sequence_bounds import bounded
from optuav.search.sequences import patterns, sequences
from optuav.search.sequential import improved
from optuav.search.terrain import Boxes, Pattern, Terrain, joined

TIE_S = 5e-7
"""Hover times that differ by no more tie [s]; a proof leaves a gap of twice that."""
PLANS_AT_ONCE = 32  # Sequences for which plans are made together first; then twice as many
MANY = 4000  # Sequences from which on the rules of boxes, quicker for many, come before programmes
MOST_PLANS = 1000  # Sequences that get plans before all are looked at as boxes
MOST_BOXES = 200_000  # Boxes that are looked at where no time limit is given: some ten seconds
GAP_HALVINGS = 6  # Halvings of the gap that so many boxes leave
BOXES_AT_ONCE = 1 << 14  # Boxes that are looked at together
INTERRUPTED = "was interrupted"  # Why a search ended early at Ctrl-C

Progress = Callable[[float, int, int], None]
"""Called with the best hover time so far [s], and how many boxes were examined and are open."""


@dataclass(frozen=True)
class SearchResult:
    """Result of a search."""

    stops: Stops | None
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

    None is better by more than a tie. Among plans that tie, the one with the fewest stops is
    returned, then the buildings that stand first, then resting early; its rests are as short as its
    hover time allows. Rests may be 0; places may be visited again. Without a time limit [s], a
    search ends after about `MOST_BOXES` boxes; Ctrl-C ends any.
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
        # Sequences without a plan yet, in falling order of their bounds, and boxes of the others.
        self.waiting = list[Boxes]()
        self.open = deque[Boxes]()
        self.examined, self.most_s = 0, np.inf

    def run(self, kinds: Iterable[Pattern]) -> SearchResult:
        ended, begun = "", False
        try:
            self._bound(kinds)
            begun = True
            self._plan(MOST_PLANS)
            self._look()
            self._plan(np.inf)
            self._divide()
        except _EarlyEnd as reason:
            ended = str(reason)
        except KeyboardInterrupt:
            ended = INTERRUPTED
        bound_s = self._bound_s() if begun else self.terrain.longest_stay_s
        best = None if self.best is None else with_short_rests(self.terrain, self.best)
        return SearchResult(best, bound_s, ended)

    def _bound(self, kinds: Iterable[Pattern]) -> None:
        """Bound every sequence; the most promising ones so far lead to a good plan."""
        most_s = -np.inf
        for pattern in kinds:
            for some in sequences(self.terrain, pattern, self._least_s):
                for first in range(0, len(some), BOXES_AT_ONCE):
                    roots = some.take(slice(first, first + BOXES_AT_ONCE))
                    self.examined += len(roots)
                    many = len(roots) > MANY
                    if many and self.best is not None:
                        roots = possible(self.terrain, roots, self._to_beat_s(roots))
                    roots = self._bounded(roots)
                    roots = roots.take(np.argsort(-roots.bound_s, kind="stable"))
                    if len(roots) and (many or roots.bound_s[0] > most_s + TIE_S):
                        most_s = max(most_s, float(roots.bound_s[0]))
                        roots = self._planned(roots)
                    self.waiting.append(roots)
                    self._go_on()

    def _plan(self, most: float) -> None:
        """Plan sequences that may hold a better plan, in falling order of their bounds."""
        count, planned = PLANS_AT_ONCE, 0
        while self.waiting and planned < most:
            tops_s = [roots.bound_s.max(initial=-np.inf) for roots in self.waiting]
            first = int(np.argmax(tops_s))
            roots = self._promising(self.waiting[first])
            planned += min(count, len(roots))
            self.waiting[first] = self._planned(roots, count)
            self.waiting = [roots for roots in self.waiting if len(roots)]
            count *= 2
            self._go_on()

    def _look(self) -> None:
        """Drop or cut whole sequences."""
        for number, roots in enumerate(self.waiting):
            left = self._looked_at(self._promising(roots))
            self.waiting[number] = left.take(np.argsort(-left.bound_s, kind="stable"))
        for _ in range(len(self.open)):
            self._keep(self._looked_at(self._promising(self.open[0])))
            self.open.popleft()

    def _planned(self, roots: Boxes, count: int = PLANS_AT_ONCE) -> Boxes:
        """Plan the first sequences, which then are open; the others are returned."""
        now, later = roots.take(slice(count)), roots.take(slice(count, None))
        if len(now):
            begin_s = bounded(self.terrain, now, np.full(len(now), -np.inf)).stays_s
            stays_s = improved(self.terrain, now, begin_s)
            better = feasible(self.terrain, now, stays_s)
            better &= stays_s[now.hovers].sum(axis=0) >= self._ahead_s(now)
            self._offer(now.take(better), stays_s[:, better])
            self.open.append(now)
        return later

    def _bounded(self, boxes: Boxes) -> Boxes:
        """Boxes whose linear programmes allow a better plan, with their bounds."""
        bound_s = bounded(self.terrain, boxes, self._to_beat_s(boxes)).hover_s
        return self._promising(replace(boxes, bound_s=np.minimum(bound_s, boxes.bound_s)))

    def _promising(self, boxes: Boxes) -> Boxes:
        """Boxes whose bounds allow a better plan."""
        return boxes.take(boxes.bound_s >= self._to_beat_s(boxes))

    def _divide(self) -> None:
        """Cut the open boxes until none is left, the largest first."""
        budget = self.examined + (MOST_BOXES if self.time_limit_s == np.inf else np.inf)
        kinds = sorted({boxes.pattern for boxes in self.open})
        parts = ([some for some in self.open if some.pattern == kind] for kind in kinds)
        self.open = deque(joined(part) for part in parts)
        while self.open:
            if self.examined > budget:
                self._close_in()
                raise _EarlyEnd(f"ended after {self.examined} boxes")
            self._keep(self._looked_at(self.open[0].halves()))
            self.open.popleft()

    def _close_in(self) -> None:
        """Lower the bound by halving over hover times that the open boxes allow."""
        low_s, self.most_s, left = max(self.longest_s, 0.0), self._bound_s(), [*self.open]
        for _ in range(GAP_HALVINGS):
            middle_s = 0.5 * (low_s + self.most_s)
            high = (boxes.take(boxes.bound_s >= middle_s) for boxes in left)
            passed = [
                possible(self.terrain, upper, np.full(len(upper), middle_s)) for upper in high
            ]
            if any(map(len, passed)):
                low_s, left = middle_s, [boxes for boxes in passed if len(boxes)]
            else:
                self.most_s = middle_s

    def _keep(self, boxes: Boxes) -> None:
        """Add boxes to the open ones, in groups of at most `BOXES_AT_ONCE`."""
        for first in range(0, len(boxes), BOXES_AT_ONCE):
            self.open.append(boxes.take(slice(first, first + BOXES_AT_ONCE)))

    def _looked_at(self, boxes: Boxes) -> Boxes:
        """Cut or drop boxes, look for a better plan in them, and return the rest."""
        self.examined += len(boxes)
        left = possible(self.terrain, boxes, self._to_beat_s(boxes))
        if len(left):
            left = self._bounded(left)
        if len(left):
            better, stays_s = longest(self.terrain, left, self._ahead_s(left))
            self._offer(left.take(better), stays_s)
        self._go_on()
        return left

    def _to_beat_s(self, boxes: Boxes) -> Floats:
        """Hover time that a plan in a box must reach [s]; a tie is enough if it ranks first."""
        if self.best is None:
            return np.zeros(len(boxes))
        first = boxes.rank < self.best.rank
        return np.maximum(self.longest_s + np.where(first, -TIE_S, TIE_S), 0.0)

    def _ahead_s(self, boxes: Boxes) -> Floats:
        """The same, but the sequence that leads may go on to lead by less than a tie [s]."""
        beat_s = self._to_beat_s(boxes)
        if self.best is None:
            return beat_s
        ahead_s = np.nextafter(self.best.hover_s, np.inf)
        return np.where(boxes.rank == self.best.rank, ahead_s, beat_s)

    def _least_s(self) -> float:
        """Hover time that a plan must reach in any box [s]."""
        self._go_on()
        return max(self.longest_s - TIE_S, 0.0)

    def _offer(self, boxes: Boxes, stays_s: Floats) -> None:
        """Take the best of plans that beat the best so far: stays (stop, box) [s]."""
        if not len(boxes):
            return
        hover_s = stays_s[boxes.hovers].sum(axis=0)
        self.longest_s = max(self.longest_s, float(hover_s.max()))
        ties = np.flatnonzero(hover_s >= self.longest_s - TIE_S)
        if not len(ties):
            return
        first = int(ties[np.lexsort((-hover_s[ties], boxes.rank[ties]))[0]])
        places, rank = boxes.places[:, first], int(boxes.rank[first])
        new = Stops(places, stays_s[:, first], float(hover_s[first]), rank)
        old = self.best
        falls_behind = old is None or old.hover_s < self.longest_s - TIE_S
        if old is None or falls_behind or (new.rank, -new.hover_s) < (old.rank, -old.hover_s):
            self.best = new

    def _go_on(self) -> None:
        """Report the progress; the search ends if it is late."""
        if self.progress is not None:
            self.progress(max(self.longest_s, 0.0), self.examined, sum(map(len, self.open)))
        if time.monotonic() - self.started_s > self.time_limit_s:
            raise _EarlyEnd(f"ended after {figure(self.time_limit_s)} s")

    def _bound_s(self) -> float:
        """Hover time that no plan exceeds [s]: the largest bound of a sequence with open boxes."""
        left = (boxes.bound_s.max(initial=-np.inf) for boxes in (*self.waiting, *self.open))
        return max(self.longest_s + TIE_S, min(float(max([-np.inf, *left])), self.most_s))
