"""The tilt z = y1 − ωy over a box of stays: planes above it, so that rows y1 ≥ 0 become linear.

A leg maps z linearly. A stay of duration t takes it to z + p h with p = (1−ω)I − k'z and
h = (1 − e^(−k't))/k'. The product of both is below McCormick's planes [1]_ over their ranges, and h
is concave in t: below its tangents and above its chord. The planes are exact at a corner of the
box, and their distance falls with the square of its width.

References
----------
.. [1] G. P. McCormick, "Computability of global solutions to factorable nonconvex programs:
   Part I", Mathematical Programming, 1976.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import Battery, levelling
from optuav.physics.quantity import TINY


@dataclass(frozen=True)
class Tilt:
    """A plane height + slope · x over the unknowns x that z never exceeds, and the range of z.

    The first unknowns are the stays.
    """

    height_As: Floats  # (box,)
    slope_A: Floats  # (unknown, box)
    least_As: Floats
    most_As: Floats

    @classmethod
    def at_start(cls, tilt_As: Floats, unknowns: int) -> Self:
        """The known tilt of the start (box,) [A s]."""
        return cls(tilt_As, np.zeros((unknowns, len(tilt_As))), tilt_As, tilt_As)

    def flown(self, remaining: Floats, tilt_As: Floats) -> Tilt:
        """The tilt after a leg, which maps z to remaining · z + tilt."""
        moved = (
            z_As * remaining + tilt_As for z_As in (self.height_As, self.least_As, self.most_As)
        )
        height_As, least_As, most_As = moved
        return Tilt(height_As, self.slope_A * remaining, least_As, most_As)

    def stayed(
        self, battery: Battery, stop: int, current_A: Floats, low_s: Floats, high_s: Floats
    ) -> Tilt:
        """The tilt after a stay (box,) between two durations [s]."""
        middle_s = 0.5 * (low_s + high_s)
        remaining, integral_s = levelling(battery, np.stack([low_s, middle_s, high_s]))
        short, middle, long = integral_s
        push_A = battery.bound_fraction * current_A
        weak_A, strong_A = (push_A - battery.rate_per_s * z for z in (self.most_As, self.least_As))
        # The lower in the middle of two planes above p h, which are exact for one h each.
        by_long = strong_A * (middle - short) + 0.5 * (weak_A + strong_A) * short >= (
            0.5 * (weak_A + strong_A) * long + weak_A * (middle - long)
        )
        factor_A, exact = np.where(by_long, weak_A, strong_A), np.where(by_long, long, short)
        stays = np.where(by_long, remaining[2], remaining[0])
        width_s = high_s - low_s
        chord = np.where(width_s > TINY, (long - short) / np.maximum(width_s, TINY), remaining[0])
        rises, above = factor_A > 0.0, middle - remaining[1] * middle_s
        pitch = np.where(rises, remaining[1], chord)
        base = np.where(rises, above, short - chord * low_s)
        slope_A = self.slope_A * stays
        slope_A[stop] = factor_A * pitch
        height_As = self.height_As * stays + push_A * exact + factor_A * (base - exact)
        # z heads for (1−ω)I/k' all the time.
        ends = [
            z_As * remaining[end] + push_A * integral_s[end]
            for z_As in (self.least_As, self.most_As)
            for end in (0, 2)
        ]
        return Tilt(height_As, slope_A, np.minimum(*ends[:2]), np.maximum(*ends[2:]))

    @classmethod
    def of_wells(cls, battery: Battery, wells_A: Floats, range_As: tuple[Floats, Floats]) -> Self:
        """The tilt of wells that are unknowns themselves, y1 and y2 with columns (unknown, box)."""
        slope_A = battery.bound_fraction * wells_A[0] - battery.available_fraction * wells_A[1]
        return cls(np.zeros_like(range_As[0]), slope_A, *range_As)
