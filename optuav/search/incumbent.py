"""The best plan so far, and what a box must promise to be worth a look."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from optuav.arrays import Floats
from optuav.search.boxes import Boxes
from optuav.search.trial import Stops, Trial


@dataclass
class Incumbent:
    """The best plan so far; of plans that tie, the one whose sequence ranks first.

    Parameters
    ----------
    trial
        What tries plans out.
    tie_s
        Hover times that differ by no more tie [s].
    best
        The plan; None before the first.
    longest_s
        Longest hover time met [s]; the plan's own is less by no more than a tie.
    """

    trial: Trial
    tie_s: float
    best: Stops | None = None
    longest_s: float = field(default=-np.inf)

    def to_beat_s(self, boxes: Boxes) -> Floats:
        """Hover time that makes a box worth a look [s]: a tie where it ranks first."""
        if self.best is None:
            return np.zeros(len(boxes))
        first = boxes.rank < self.best.rank
        beat_s: Floats = np.maximum(self.longest_s + np.where(first, -self.tie_s, self.tie_s), 0.0)
        return beat_s

    def improve(self, boxes: Boxes) -> None:
        """Look for a better plan in boxes."""
        beat_s = self.to_beat_s(boxes)
        if self.best is not None:
            # The sequence that leads may go on to lead by less than a tie.
            ahead_s = np.nextafter(self.best.hover_s, np.inf)
            beat_s = np.where(boxes.rank == self.best.rank, ahead_s, beat_s)
        found, stays_s = self.trial.longest(boxes, beat_s)
        if not found.any():
            return
        hover_s, rank = stays_s[boxes.hovers].sum(axis=0), boxes.rank[found]
        self.longest_s = max(self.longest_s, float(hover_s.max()))
        ties = np.flatnonzero(hover_s >= self.longest_s - self.tie_s)
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
        falls_behind = old is None or old.hover_s < self.longest_s - self.tie_s
        if old is None or falls_behind or (new.rank, -new.hover_s) < (old.rank, -old.hover_s):
            self.best = new
