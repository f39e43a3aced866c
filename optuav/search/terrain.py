"""A mission as arrays for the search: each leg and stay is a map of the two wells.

The state is (y, z): the total charge y = y1 + y2 and the tilt z = y1 − ωy. A leg of duration T that
draws Q takes it to (y − Q, z e^(−k'T) + Z), a stay of duration t at the current I to
(y + I t, z e^(−k't) + (1−ω) I (1 − e^(−k't))/k'), with k' = k_F/(ω(1−ω)); see
`optuav.physics.kibam`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import Battery, Stage, Wells, levelling, step

ORIGIN, HOVER, DESTINATION, FIRST_BUILDING = 0, 1, 2, 3
"""Numbers of places."""


ROUNDING = 1e-11
"""Share of the capacity by which a limit must be missed before a box falls [-]."""


class Flown(NamedTuple):
    """The legs of a sequence, each (leg, box): duration [s], Q [A s], e^(−k'T) [-], Z [A s]."""

    duration_s: Floats
    charge_As: Floats
    remaining: Floats
    tilt_As: Floats


class LegMaps(NamedTuple):
    """What the stages of every leg do to the wells, from take-off to the end of each.

    Arrays (stage, start, end): Q [A s], e^(−k'T) [-] and Z [A s].
    """

    charge_As: Floats
    remaining: Floats
    tilt_As: Floats


@dataclass(frozen=True)
class Terrain:
    """Places and legs between them, by number: origin, hover point, destination, then buildings.

    Parameters
    ----------
    battery
        One battery, full at the start; B > 0, 0 < ω < 1, k_F ≥ 0.
    deadline_s
        T_max [s].
    least_charge_As
        η0 B, the charge to be left at the end [A s].
    duration_s
        Of the legs (start, end) [s]; ``inf`` where there is none.
    stage_durations_s, stage_currents_A
        Stages of the legs (stage, start, end) [s], [A]; the current that they draw, ≥ 0.
    stay_current_A
        Net current into the battery while staying (place,) [A]: hovering at the hover point,
        resting elsewhere.
    tapers
        Whether charging tapers once y1 = ωB; else it must not go on.
    """

    battery: Battery
    deadline_s: float
    least_charge_As: float
    duration_s: Floats
    stage_durations_s: Floats
    stage_currents_A: Floats
    stay_current_A: Floats
    tapers: bool = False

    @property
    def longest_stay_s(self) -> float:
        """What the deadline leaves of the shortest way by the hover point [s]; −inf if none."""
        there_s, back_s = self.duration_s[ORIGIN].copy(), self.duration_s[:, DESTINATION].copy()
        for _ in range(len(self.duration_s)):
            there_s = np.minimum(there_s, (there_s[:, None] + self.duration_s).min(axis=0))
            back_s = np.minimum(back_s, (self.duration_s + back_s).min(axis=1))
        return self.deadline_s - float(there_s[HOVER] + back_s[HOVER])

    @property
    def drains_steadily(self) -> bool:
        """Whether y1 falls throughout every leg: each stage draws k_F B, which y1 ≥ 0 cannot fill.

        While the wells are within their limits dy1/dt = I − k'z with −k'z ≤ k_F B.
        """
        drawn = self.stage_currents_A[self.stage_durations_s > 0.0]
        return bool((drawn >= self.battery.flow_rate_per_s * self.battery.capacity_As).all())

    def leg_maps(self) -> LegMaps:
        """The maps of all legs, stage by stage; only whole legs where y1 is least at their ends."""
        wells, elapsed_s = Wells(0.0, 0.0), np.zeros_like(self.duration_s)
        charge, remaining, tilt = [], [], []
        share = self.battery.available_fraction
        for current_A, time_s in zip(self.stage_currents_A, self.stage_durations_s, strict=True):
            wells = step(self.battery, wells, Stage(-current_A, time_s))
            elapsed_s = elapsed_s + time_s
            charge.append(-wells.total_As)
            remaining.append(levelling(self.battery, elapsed_s)[0])
            tilt.append(wells.available_As - share * wells.total_As)
        kept = slice(-1, None) if self.drains_steadily else slice(None)
        return LegMaps(np.array(charge[kept]), np.array(remaining[kept]), np.array(tilt[kept]))
