"""A bound on the hover time of every sequence of stops: a linear programme in its stays t ≥ 0.

Its rows hold for every plan within 0 ≤ y1 ≤ ωB, so none is lost. The total charge y is linear in t.

1. *Time and charge.* The stays fit into the time that flights leave; the charge that must be left
   is left, at the end and, where it holds there, at every landing.
2. *Full.* y ≤ B after every stay that charges: y1 ≤ ωB, and y2 ≤ (1−ω)B always, as
   y2' ≤ k_F (B − y2/(1−ω)) while y1 ≤ ωB. Where charging tapers, a stay takes I t − s with some
   s ≥ 0 refused, an unknown more.
3. *Bound charge.* Charge cannot leave the bound well faster than y2' ≥ −k_F y2/(1−ω), as y1 ≥ 0. So
   y ≥ y2 ≥ β(e) = y2(0) e^(−k_F e/(1−ω)) at any time e after the start; β is convex and lies above
   its tangents, which are linear in t.
4. *Tilt.* y1 = ωy + z ≥ 0, so y ≥ −z⁺/ω at every landing, where the tilt z is at most z⁺: a stay
   moves z towards (1−ω)I/k', a leg by its own map.

With k_F = 0 rows 1 to 3 are the problem itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import Tilted, levelling
from optuav.search.dual_simplex import dual_simplex
from optuav.search.terrain import Boxes, Flown, Terrain

TANGENTS = 0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0  # Points of β whose tangents are rows [deadline]
ROUNDING_S = 1e-9  # Added to each bound [s]


class Bounds(NamedTuple):
    """Hover times that no plan of a sequence exceeds (box,) [s], −inf where none exists.

    With the stays (stop, box) [s] that reach it, if nothing stopped their programme.
    """

    hover_s: Floats
    stays_s: Floats


def bounded(terrain: Terrain, boxes: Boxes, enough_s: Floats) -> Bounds:
    """Bound sequences; one that cannot exceed what is enough (box,) [s] by no more than needed."""
    rows, limits = rows_of(terrain, boxes)
    stops = len(boxes.pattern)
    worth = np.zeros(rows.shape[1])
    worth[:stops] = boxes.pattern
    found = dual_simplex(rows, limits, worth, enough_s - ROUNDING_S)
    return Bounds(found.value + ROUNDING_S, found.x[:stops])


def rows_of(terrain: Terrain, boxes: Boxes) -> tuple[Floats, Floats]:
    """Rows (row, unknown, box) · x ≤ limits (row, box) that all plans keep, the deadline first.

    Unknowns are the stays [s] and, where charging tapers, the charge that each refuses [A s].
    """
    battery, stops = terrain.battery, len(boxes.pattern)
    legs = Flown(*(table[-1][boxes.places[:-1], boxes.places[1:]] for table in terrain.leg_maps))
    current_A, begin = terrain.stay_current_A[boxes.places[1:-1]], terrain.charge_at(boxes.places[0])
    # At every landing: time and charge without stays, the stays before, and what they add.
    elapsed_s = legs.duration_s.cumsum(axis=0)
    charge_As = begin.total_As - legs.charge_As.cumsum(axis=0)
    before = np.repeat(np.tri(stops + 1, stops, -1)[:, :, None], len(boxes), axis=2)
    gained = before * current_A
    stays = np.ones((1, *current_A.shape))
    if terrain.tapers:
        before, gained = np.hstack([before, 0.0 * before]), np.hstack([gained, -before])
        stays = np.hstack([stays, 0.0 * stays])
    left_s = terrain.deadline_s - elapsed_s[-1]
    least_As = _least_charge(terrain, legs, begin, current_A, left_s)
    least_As[:-1] = np.maximum(least_As[:-1], terrain.least_on_landing_As)
    least_As[-1] = np.maximum(least_As[-1], terrain.least_charge_As)
    rows, limits = [stays, -gained], [left_s[None], charge_As - least_As]
    drained_per_s = battery.flow_rate_per_s / battery.bound_fraction
    bound_As = battery.bound_fraction * begin.total_As - begin.tilt_As
    for share in TANGENTS if drained_per_s else TANGENTS[:1]:
        at_s = share * terrain.deadline_s
        height_As = bound_As * np.exp(-drained_per_s * at_s)
        slope_A = -drained_per_s * height_As
        rows.append(slope_A * before - gained)
        limits.append(charge_As - height_As - slope_A * (elapsed_s - at_s))
    charging = [stop for stop in range(stops) if (current_A[stop] > 0.0).any()]
    rows.append(gained[[stop + 1 for stop in charging]])
    limits.append(battery.capacity_As - charge_As[charging])
    return np.concatenate(rows), np.concatenate(limits)


def _least_charge(
    terrain: Terrain, legs: Flown, begin: Tilted, current_A: Floats, left_s: Floats
) -> Floats:
    """Charge without which y1 < 0 at a landing, however long the stays (stop + 1, box) [A s]."""
    battery, least_As = terrain.battery, np.zeros_like(legs.charge_As)
    tilt_As = begin.tilt_As
    remaining, integral_s = levelling(battery, left_s)
    for landing in range(len(least_As)):
        tilt_As = tilt_As * legs.remaining[landing] + legs.tilt_As[landing]
        least_As[landing] = np.maximum(-tilt_As / battery.available_fraction, 0.0)
        if landing < len(current_A):
            charging_A = battery.bound_fraction * current_A[landing]
            tilt_As = np.maximum(tilt_As, tilt_As * remaining + charging_A * integral_s)
    return least_As
