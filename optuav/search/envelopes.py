"""The largest and the least that the wells of a box may hold, from phase to phase.

With durations t ≥ 0, every leg and stay maps (y, y1) to e^(−k't) y1 + ω (1 − e^(−k't)) y + a
constant for y1 and to y + a constant for y: more of either never leads to less of either. So the
largest and the least (y, y1) of a box, carried from phase to phase with the duration that is best
or worst for each, enclose all its plans. A box falls where the largest y1 is below 0, the least
above ωB, or the largest y at the end below η0 B. Between phases the envelopes are cut back to
0 ≤ y1 ≤ ωB, y1 ≤ y ≤ y1 + (1−ω)B, which all its plans keep.

Where charging tapers, the least (y, y1) are left out; the cuts to y1 ≤ ωB hold for it, and go on as
they are (`optuav.search.bound` says why).
"""

from __future__ import annotations

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.physics.kibam import Battery, levelling
from optuav.physics.quantity import TINY
from optuav.search.boxes import Boxes
from optuav.search.terrain import ROUNDING, Flown, Terrain


def enveloped(
    terrain: Terrain, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats
) -> tuple[Booleans, Booleans]:
    """Whether the envelopes leave a box possible (box,).

    And whether they pass y1 = ωB at the end of a stay or of a later one (stop, box).
    """
    battery = terrain.battery
    full, share = battery.full, battery.available_fraction
    rounding_As = ROUNDING * battery.capacity_As
    most = least = (np.full(len(boxes), battery.capacity_As), np.full(len(boxes), 0.0))
    alive = np.ones(len(boxes), bool)
    overfull = np.zeros(low_s.shape, bool)
    for stop in range(len(boxes.pattern) + 1):
        leg = Flown(*(each[stop] for each in legs))
        most = most[0] - leg.charge_As, most[1] * leg.remaining + leg.tilt_As
        least = least[0] - leg.charge_As, least[1] * leg.remaining + leg.tilt_As
        alive &= share * most[0] + most[1] >= -rounding_As
        if stop == len(boxes.pattern):
            break
        least_available = np.maximum(share * least[0] + least[1], 0.0)
        least_total = np.maximum(least[0], least_available)
        least = least_total, least_available - share * least_total
        current_A = terrain.stay_current_A[boxes.places[stop + 1]]
        times_s = low_s[stop], high_s[stop]
        total, available = _farthest(battery, most, current_A, times_s, np.maximum)
        alive &= available >= -rounding_As
        overfull[: stop + 1] |= available > full.available_As
        available = np.minimum(available, full.available_As)
        total = np.minimum(total, available + full.bound_As)
        most = total, available - share * total
        if terrain.tapers:
            least = np.zeros(len(boxes)), np.zeros(len(boxes))
            continue
        total, available = _farthest(battery, least, current_A, times_s, np.minimum)
        alive &= available <= full.available_As + rounding_As
        available = np.maximum(available, 0.0)
        total = np.maximum(total, available)
        least = total, available - share * total
    return alive & (most[0] >= terrain.least_charge_As - rounding_As), overfull


def _farthest(
    battery: Battery,
    state: tuple[Floats, Floats],
    current_A: Floats,
    times_s: tuple[Floats, Floats],
    pick: np.ufunc,
) -> tuple[Floats, Floats]:
    """Largest or least y and y1 [A s] after a stay of any duration between two."""
    share = battery.available_fraction
    total, tilt = state
    low_s, high_s = times_s

    def available(time_s: Floats) -> Floats:
        remaining, integral_s = levelling(battery, time_s)
        tilted_As = tilt * remaining + (1.0 - share) * current_A * integral_s
        sum_As: Floats = share * (total + current_A * time_s) + tilted_As
        return sum_As

    # dy1/dt = I − k'z vanishes where e^(−k't) = ω I / (k'z − (1−ω) I).
    rate = np.maximum(battery.rate_per_s, TINY)
    slope = rate * tilt - (1.0 - share) * current_A
    turn = share * current_A / np.where(slope == 0.0, TINY, slope)
    turn_s = -np.log(np.clip(turn, TINY, 1.0)) / rate
    found = pick(available(low_s), available(high_s))
    inside = (low_s < turn_s) & (turn_s < high_s)
    if inside.any():
        found = pick(found, available(np.where(inside, turn_s, low_s)))
    farthest: Floats = total + pick(current_A * low_s, current_A * high_s)
    return farthest, found
