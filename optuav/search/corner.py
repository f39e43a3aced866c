"""The wells along one corner of a box, and what a second of each stay is worth to them.

The corner has the longest rests and the shortest hovers. A second of stay i more or less changes y1
after a later phase, by τ, by ∂y1/∂t_i = ωI_i + e^(−k'τ) ((1−ω) I_i − k'z_i), where z_i is the tilt
at the end of the stay; interval arithmetic bounds it over the box.
"""

from __future__ import annotations

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import levelling
from optuav.search.boxes import Boxes
from optuav.search.terrain import Flown, Terrain


class Corner:
    """The corner of boxes of one pattern, followed leg by leg and stay by stay.

    Arrays have one column a box. It begins at take-off; `past` counts the stays that are over.

    Parameters
    ----------
    terrain
        The mission.
    boxes, legs
        The boxes, and what their legs do to the wells.
    low_s, high_s
        Shortest and longest stays (stop, box) [s].
    """

    def __init__(
        self, terrain: Terrain, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats
    ) -> None:
        self.battery, self.legs, self.past = terrain.battery, legs, 0
        self.hover = boxes.pattern
        self.current_A = terrain.stay_current_A[boxes.places[1:-1]]
        self.low_s, self.high_s = low_s, high_s
        self.after_low, self.after_high = (levelling(self.battery, s) for s in (low_s, high_s))
        # y and z here, the same at the opposite corner, and between which bounds z is in the box.
        self.total_As = self.far_total_As = np.full(len(boxes), self.battery.capacity_As)
        self.tilt_As = self.far_tilt_As = np.zeros(len(boxes))
        self.low_tilt_As = self.high_tilt_As = np.zeros(len(boxes))
        # Of every stay, bounds of (1−ω) I − k'z at its end, and of e^(−k'τ) from there to now.
        self.weakest_A, self.strongest_A = np.empty_like(low_s), np.empty_like(low_s)
        self.least, self.most = np.ones_like(low_s), np.ones_like(low_s)

    def fly(self) -> None:
        """The leg to the next stop, or to the destination."""
        leg = self.past
        remaining, offset_As = self.legs.remaining[leg], self.legs.tilt_As[leg]
        self.total_As = self.total_As - self.legs.charge_As[leg]
        self.far_total_As = self.far_total_As - self.legs.charge_As[leg]
        self.tilt_As = self.tilt_As * remaining + offset_As
        self.far_tilt_As = self.far_tilt_As * remaining + offset_As
        self.low_tilt_As = self.low_tilt_As * remaining + offset_As
        self.high_tilt_As = self.high_tilt_As * remaining + offset_As
        self.least[: self.past] *= remaining
        self.most[: self.past] *= remaining

    def stay(self) -> None:
        """The stay at the stop that was reached."""
        stop, current_A = self.past, self.current_A[self.past]
        charging_A = (1.0 - self.battery.available_fraction) * current_A

        def tilted(tilt_As: Floats, *, longest: bool) -> Floats:
            """z at the end of the longest or the shortest stay."""
            remaining, integral_s = self.after_high if longest else self.after_low
            moved: Floats = tilt_As * remaining[stop] + charging_A * integral_s[stop]
            return moved

        rests = not self.hover[stop]
        best_s, worst_s = (self.high_s, self.low_s) if rests else (self.low_s, self.high_s)
        self.total_As = self.total_As + current_A * best_s[stop]
        self.far_total_As = self.far_total_As + current_A * worst_s[stop]
        self.tilt_As = tilted(self.tilt_As, longest=rests)
        self.far_tilt_As = tilted(self.far_tilt_As, longest=not rests)
        low_As, high_As = self.low_tilt_As, self.high_tilt_As
        self.low_tilt_As = np.minimum(tilted(low_As, longest=True), tilted(low_As, longest=False))
        self.high_tilt_As = np.maximum(
            tilted(high_As, longest=True), tilted(high_As, longest=False)
        )
        rate = self.battery.rate_per_s
        self.weakest_A[stop] = charging_A - rate * self.high_tilt_As
        self.strongest_A[stop] = charging_A - rate * self.low_tilt_As
        self.least[:stop] *= self.after_high[0][stop]
        self.most[:stop] *= self.after_low[0][stop]
        self.past += 1

    @property
    def available_As(self) -> Floats:
        """y1 at the corner (box,) [A s]."""
        found: Floats = self.battery.available_fraction * self.total_As + self.tilt_As
        return found

    @property
    def room_As(self) -> Floats:
        """What is missing to y1 = ωB at the opposite corner (box,) [A s]."""
        far_As = self.battery.available_fraction * self.far_total_As + self.far_tilt_As
        found: Floats = self.battery.full.available_As - far_As
        return found

    @property
    def prices_A(self) -> Floats:
        """Least that y1 loses a second by which a stay leaves the corner (stop, box) [A].

        Of stays that are over; 0 for the others.
        """
        price_A = np.zeros_like(self.low_s)
        for stay, hovers in enumerate(self.hover[: self.past]):
            push_A = self.strongest_A[stay] if hovers else self.weakest_A[stay]
            much = (push_A > 0.0) == hovers
            fade = np.where(much, self.most[stay], self.least[stay])
            price_A[stay] = self.battery.available_fraction * self.current_A[stay] + push_A * fade
            if hovers:
                price_A[stay] *= -1.0
        return price_A
