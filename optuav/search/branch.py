"""Branch and bound over sequences of stops and the durations of their stays."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Floats
from optuav.search.bounds import possible
from optuav.search.terrain import Boxes, Pattern, Terrain, patterns, sequences
from optuav.search.trial import Stops, Trial

TIE_S = 5e-7
"""Hover times that differ by no more tie [s]; what is proved leaves a gap of twice that."""
BEAM, BEAM_LEVELS = 64, 10
"""Boxes that are followed down, and how far, for a good plan to begin with."""
MOST_BOXES = 1_000_000  # Boxes that are looked at where no time limit is given: some ten seconds
AT_ONCE = 1 << 14  # Boxes that are looked at together
GAP_HALVINGS = 20  # Of the gap that a search leaves which ended early
GAP_BOXES = 2_000_000  # Boxes that are looked at for that where no time limit is given
GAP_SHARE = 0.2  # Of a time limit that is kept for finding that gap
INTERRUPTED = "was interrupted"  # Why a search ended early at Ctrl-C
INTERRUPTED_S = 1.0  # That finding the gap may take then [s]

Progress = Callable[[float, int, int], None]
"""Called with the best hover time so far [s], and how many boxes were examined and are open."""


@dataclass(frozen=True)
class SearchResult:
    """What a search found."""

    stops: Stops | None
    bound_s: float  # No plan hovers longer [s]; −inf where it is proved that there is no plan
    examined: int  # Number of boxes that it looked at
    ended: str  # Why the search ended early; empty if it is complete


def search(
    terrain: Terrain,
    rests: int,
    hovers: int,
    *,
    time_limit_s: float | None = None,
    progress: Progress | None = None,
) -> SearchResult:
    """The plan of the longest hover time with at most so many rests and hovers.

    The durations of every sequence of stops are cut into boxes, until none is left that can hold a
    plan better than the best by more than a tie (`optuav.search.bounds` has the rules). Among plans
    that tie, the one with the fewest stops is returned, then the buildings that stand first, then
    resting early; and its rests, one after another, as short as its hover time admits.

    Rests may be 0; places may be visited again. Without a time limit [s], a search ends after about
    `MOST_BOXES` boxes. It ends at an interruption (Ctrl-C), too.
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
        self.trial, self.longest_s = Trial(terrain), -np.inf
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
        best = None if self.best is None else self.trial.with_short_rests(self.best)
        return SearchResult(best, bound_s, self.examined, ended)

    def _begin(self, kinds: Iterable[Pattern]) -> None:
        """Look at every sequence; the most promising boxes of each pattern lead to a good plan."""
        for pattern in kinds:
            for roots in sequences(self.terrain, pattern):
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
        """Add boxes to the open ones, in groups of at most so many."""
        for first in range(0, len(boxes), AT_ONCE):
            self.open.append(boxes.take(slice(first, first + AT_ONCE)))

    def _looked_at(self, boxes: Boxes) -> Boxes:
        """Cut or drop boxes, look for a better plan in them, and return what is left."""
        if self._late((1.0 - GAP_SHARE) * self.time_limit_s):
            raise _EarlyEnd(f"ended after {self.time_limit_s:g} s")
        self.examined += len(boxes)
        left = possible(self.terrain, boxes, self._to_beat_s(boxes))
        if len(left):
            self._improve(left)
        if self.progress is not None:
            best_s = max(self.longest_s, 0.0)
            self.progress(best_s, self.examined, sum(map(len, self.open)))
        return left

    def _to_beat_s(self, boxes: Boxes) -> Floats:
        """Hover time that a plan in a box must reach [s]; a tie is enough if it ranks first."""
        if self.best is None:
            return np.zeros(len(boxes))
        first = boxes.rank < self.best.rank
        beat_s: Floats = np.maximum(self.longest_s + np.where(first, -TIE_S, TIE_S), 0.0)
        return beat_s

    def _improve(self, boxes: Boxes) -> None:
        """Look for a better plan in boxes."""
        beat_s = self._to_beat_s(boxes)
        if self.best is not None:
            # The sequence that leads may go on to lead by less than a tie.
            ahead_s = np.nextafter(self.best.hover_s, np.inf)
            beat_s = np.where(boxes.rank == self.best.rank, ahead_s, beat_s)
        found, stays_s = self.trial.longest(boxes, beat_s)
        if not found.any():
            return
        hover_s, rank = stays_s[boxes.hovers].sum(axis=0), boxes.rank[found]
        self.longest_s = max(self.longest_s, float(hover_s.max()))
        ties = np.flatnonzero(hover_s >= self.longest_s - TIE_S)
        if not len(ties):
            return
        first = int(ties[np.lexsort((-hover_s[ties], rank[ties]))[0]])
        new = Stops(
            boxes.places[:, found][:, first].copy(),
            stays_s[:, first].copy(),
            float(hover_s[first]),
            int(rank[first]),
        )
        old = self.best
        falls_behind = old is None or old.hover_s < self.longest_s - TIE_S
        if old is None or falls_behind or (new.rank, -new.hover_s) < (old.rank, -old.hover_s):
            self.best = new

    def _late(self, limit_s: float) -> bool:
        return time.monotonic() - self.started_s > limit_s

    def _bound_s(self) -> float:
        """Hover time that no plan exceeds [s], by halving over what the open boxes let through.

        As far as that is found in time, or in so many boxes.
        """
        low_s, high_s = self.longest_s + TIE_S, self.terrain.longest_stay_s
        if not self.open:
            return low_s
        low_s, left = max(low_s, 0.0), list(self.open)
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
