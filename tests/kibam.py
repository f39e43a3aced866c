"""The kinetic battery model again, for tests only: the differential equations of [1], (11)-(12).

Solved through the eigenvalues 0 and −k' of the two wells, by another formula than the package's.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


class Kibam:
    """Both wells, y1 and y2 [A s], from full; arrays of missions side by side."""

    def __init__(self, capacity_As: float, share: float, flow_per_s: float) -> None:
        self.capacity_As, self.share, self.flow_per_s = capacity_As, share, flow_per_s
        self.y1, self.y2 = np.array(share * capacity_As), np.array((1 - share) * capacity_As)
        self.least = self.y1 / capacity_As
        self.most = self.y1 / capacity_As

    def spend(self, current_A: float, time_s: Floats | float, samples: int = 1) -> None:
        """A stretch of constant current, > 0 while charging; y1 is looked at after equal parts."""
        for _ in range(samples):
            self._step(current_A, np.asarray(time_s, dtype=float) / samples)
            level = self.y1 / self.capacity_As
            self.least, self.most = np.minimum(self.least, level), np.maximum(self.most, level)

    def taper(self, current_A: float, time_s: Floats | float) -> None:
        """A stretch in which the charger holds y1 once it is full, by halving for that moment."""
        full_As, start = self.share * self.capacity_As, (self.y1, self.y2)
        whole = np.asarray(time_s, dtype=float) + 0.0 * self.y1
        low, high = np.zeros_like(whole), whole.copy()
        for tried in (whole, *[None] * 60):
            moment = 0.5 * (low + high) if tried is None else tried
            self.y1, self.y2 = start
            self._step(current_A, moment)
            over = self.y1 > full_As
            low, high = np.where(over, low, moment), np.where(over, moment, high)
        self.y1, self.y2 = start
        self._step(current_A, low)
        bound_As = (1 - self.share) * self.capacity_As
        held = (current_A > 0.0) & (low < whole)
        fade = np.exp(-self.flow_per_s / (1 - self.share) * (whole - low))
        self.y2 = np.where(held, bound_As - (bound_As - self.y2) * fade, self.y2)
        self.y1 = np.where(held, full_As, self.y1)
        self.least = np.minimum(self.least, self.y1 / self.capacity_As)

    def _step(self, current_A: float, time_s: Floats) -> None:
        c, k = self.share, self.flow_per_s
        rate = k / c + k / (1 - c)
        # Height difference of the wells: dh/dt = I/c − rate·h.
        difference = self.y1 / c - self.y2 / (1 - c)
        if rate == 0.0:
            after = difference + current_A / c * time_s
        else:
            levelled = -np.expm1(-rate * time_s)
            after = difference * (1.0 - levelled) + current_A / (c * rate) * levelled
        total = self.y1 + self.y2 + current_A * time_s
        self.y1 = c * total + c * (1 - c) * after
        self.y2 = total - self.y1

    @property
    def soc(self) -> Floats:
        """(y1 + y2)/B."""
        found: Floats = (self.y1 + self.y2) / self.capacity_As
        return found
