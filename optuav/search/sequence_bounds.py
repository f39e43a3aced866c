"""A bound on the hover time of boxes of plans: a linear programme in the stays t ≥ 0.

Its rows hold for every plan within 0 ≤ y1 ≤ ωB, so none is lost. The total charge y is linear in t.

1. *Time and charge.* The stays fit into the box and into the time that flights leave; the charge
   that must be left is left, at the end and, if it must, at every landing.
2. *Full.* y ≤ B after every stay that charges: y1 ≤ ωB, and y2 ≤ (1−ω)B always, as
   y2' ≤ k_F (B − y2/(1−ω)) while y1 ≤ ωB. Where charging tapers, a stay takes I t − s with some
   s ≥ 0 refused, one more unknown per stay, and y is at most what the envelopes of the box allow.
3. *Bound charge.* Charge cannot leave the bound well faster than y2' ≥ −k_F y2/(1−ω), as y1 ≥ 0. So
   y ≥ y2 ≥ β(e) = y2(0) e^(−k_F e/(1−ω)) at any time e after the start; β is convex and lies above
   its tangents, which are linear in t.
4. *Wells.* y1 = ωy + z ≥ 0 with a plane above the tilt z, and y1 ≤ ωB with a plane below it
   (`optuav.search.tilt`). In small boxes these rows are as good as the limits themselves.

With k_F = 0 rows 1 to 3 are the problem itself for whole sequences.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.search.bounds import enveloped
from optuav.search.dual_simplex import dual_simplex
from optuav.search.terrain import Boxes, Flown, Terrain
from optuav.search.tilt import Tilt

TANGENTS = 0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0  # Points of β whose tangents are rows [deadline]
ROUNDING_S = 1e-9  # Added to each bound [s]


class Bounds(NamedTuple):
    """Hover times that no plan of a box exceeds (box,) [s], −inf if it holds none.

    With the stays (stop, box) [s] that reach it, unless their programme was stopped.
    """

    hover_s: Floats
    stays_s: Floats


def bounded(terrain: Terrain, boxes: Boxes, enough_s: Floats) -> Bounds:
    """Bound boxes; a programme is stopped once its bound is no more than enough (box,) [s]."""
    rows, limits = rows_of(terrain, boxes)
    stops, hovers = len(boxes.pattern), boxes.hovers
    worth = np.zeros(rows.shape[1])
    worth[hovers] = 1.0
    sure_s = boxes.low_s[hovers].sum(axis=0) + ROUNDING_S
    left = limits - (rows[:, :stops] * boxes.low_s).sum(axis=1)
    found = dual_simplex(rows, left, worth, enough_s - sure_s)
    hover_s = found.value + sure_s
    if terrain.tapers:
        # Rounding of many exchanges may hide the plans of a small box: none is called empty.
        hover_s = np.where(hover_s > -np.inf, hover_s, boxes.high_s[hovers].sum(axis=0))
    return Bounds(hover_s, found.x[:stops] + boxes.low_s)


def rows_of(terrain: Terrain, boxes: Boxes) -> tuple[Floats, Floats]:
    """Rows (row, unknown, box) · x ≤ limits (row, box) that all plans of boxes keep.

    Unknowns are the stays [s] and, where charging tapers, the charge that each refuses, in seconds
    of its current. The first row is the deadline.
    """
    battery, stops = terrain.battery, len(boxes.pattern)
    legs = Flown(*(table[-1][boxes.places[:-1], boxes.places[1:]] for table in terrain.leg_maps))
    current_A, begin = (
        terrain.stay_current_A[boxes.places[1:-1]],
        terrain.charge_at(boxes.places[0]),
    )
    # At every landing: time and charge without stays, the stays before, and what they add.
    elapsed_s = legs.duration_s.cumsum(axis=0)
    charge_As = begin.total_As - legs.charge_As.cumsum(axis=0)
    before = np.repeat(np.tri(stops + 1, stops, -1)[:, :, None], len(boxes), axis=2)
    gained, stay = before * current_A, np.repeat(np.eye(stops)[:, :, None], len(boxes), axis=2)
    most_As = np.full_like(current_A, battery.capacity_As)
    if terrain.tapers:
        gained = np.hstack([gained, -before * np.maximum(current_A, 0.0)])
        before, stay = (np.hstack([rows, np.zeros_like(rows)]) for rows in (before, stay))
        most_As = enveloped(terrain, boxes, legs).most_As
    least_As = [*[terrain.least_on_landing_As] * stops, terrain.least_charge_As]
    left = [landing for landing in range(stops + 1) if least_As[landing] > -math.inf]
    full = [stop for stop in range(stops) if (current_A[stop] > 0.0).any()]
    rows = [stay.sum(axis=0)[None], stay, -gained[left], gained[[stop + 1 for stop in full]]]
    limits = [terrain.deadline_s - elapsed_s[-1:], boxes.high_s]
    limits += [charge_As[left] - np.array(least_As)[left, None], (most_As - charge_As[:-1])[full]]
    drained_per_s = battery.flow_rate_per_s / battery.bound_fraction
    bound_As = battery.bound_fraction * begin.total_As - begin.tilt_As
    for share in TANGENTS if drained_per_s else TANGENTS[:1]:
        at_s = share * terrain.deadline_s
        height_As = bound_As * np.exp(-drained_per_s * at_s)
        slope_A = -drained_per_s * height_As
        rows.append(slope_A * before - gained)
        limits.append(charge_As - height_As - slope_A * (elapsed_s - at_s))
    wells = zip(*_wells(terrain, boxes, gained, charge_As), strict=True)
    for each, more in zip((rows, limits), wells, strict=True):
        each.append(np.array(more))
    return np.concatenate(rows), np.concatenate(limits)


def _wells(
    terrain: Terrain, boxes: Boxes, gained: Floats, charge_As: Floats
) -> Iterator[tuple[Floats, Floats]]:
    """Rows y1 ≥ 0 after each stage of a leg and each stay that draws, y1 ≤ ωB after others."""
    battery, stops, maps = terrain.battery, len(boxes.pattern), terrain.leg_maps
    share, current_A = battery.available_fraction, terrain.stay_current_A[boxes.places[1:-1]]
    before_As, tilt_As = (np.full(len(boxes), x) for x in terrain.charge_at(boxes.places[0]))
    # −z as well: a plane above it is one below z.
    tilt, opposite = (Tilt.at_start(sign * tilt_As, boxes) for sign in (1.0, -1.0))

    def row(rises: Floats, tilt: Tilt, room_As: Floats) -> tuple[Floats, Floats]:
        """Row of ± y1, whose total rises by so much with the unknowns, and what it may fall."""
        falls = -share * rises
        falls[:stops] -= tilt.slope_A
        return falls, share * room_As + tilt.height_As

    for stop, leg in enumerate(itertools.pairwise(boxes.places)):
        start = tilt
        for number, drawn_As in enumerate(maps.charge_As):
            remaining, tilted_As = maps.remaining[number][leg], maps.tilt_As[number][leg]
            tilt = start.flown(remaining, tilted_As)
            yield row(gained[stop], tilt, before_As - drawn_As[leg])
        if stop == stops:
            break
        before_As, amps = charge_As[stop], current_A[stop]
        times_s = boxes.low_s[stop], boxes.high_s[stop]
        tilt = tilt.stayed(battery, stop, amps, *times_s)
        opposite = opposite.flown(remaining, -tilted_As).stayed(battery, stop, -amps, *times_s)
        if (amps < 0.0).any():
            yield row(gained[stop + 1], tilt, before_As)
        if terrain.tapers:
            tilt = tilt.tapered()
        elif (amps > 0.0).any():
            yield row(-gained[stop + 1], opposite, battery.capacity_As - before_As)
