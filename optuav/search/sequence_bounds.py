"""A bound on the hover time of boxes of plans: a linear programme in the stays t ≥ 0.

Its rows hold for every plan within 0 ≤ y1 ≤ ωB, so none is lost. The total charge y is linear in t.

1. *Time and charge.* The stays fit into the box and into the time that flights leave; the charge
   that must be left is left, at the end and, if it must, at every landing.
2. *Full.* y ≤ B after every stay that charges: y1 ≤ ωB, and y2 ≤ (1−ω)B always, as
   y2' ≤ k_F (B − y2/(1−ω)) while y1 ≤ ωB. Where charging tapers, both wells after such a stay are
   unknowns of their own, with the rows of `optuav.search.tapering`.
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
from optuav.search.tapering import ChargePlanes, Row, tapering
from optuav.search.terrain import Boxes, Flown, Terrain
from optuav.search.tilt import Tilt

TANGENTS = 0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0  # Points of β whose tangents are rows [deadline]
BOUND_ROUNDING_S = 1e-9  # Added to each bound [s]


class Bounds(NamedTuple):
    """Hover times that no plan of a box exceeds (box,) [s], −inf if it holds none.

    With the stays (stop, box) [s] that reach it, unless their programme was stopped.
    """

    hover_s: Floats
    stays_s: Floats


class Programmes(NamedTuple):
    """Rows (row, unknown, box) · x ≤ limits (row, box) that all plans of boxes keep.

    Unknowns are the stays [s], and y1 and y2 after each stay that may taper, in seconds of
    `unit_A`. None exceeds its top (unknown, box). The first row is the deadline.
    """

    rows: Floats
    limits: Floats
    tops: Floats


def bounded(terrain: Terrain, boxes: Boxes, enough_s: Floats) -> Bounds:
    """Bound boxes; a programme is stopped once its bound is no more than enough (box,) [s]."""
    rows, limits, tops_s = programmes(terrain, boxes)
    stops, hovers = len(boxes.pattern), boxes.hovers
    worth = np.zeros(rows.shape[1])
    worth[hovers] = 1.0
    sure_s = boxes.low_s[hovers].sum(axis=0) + BOUND_ROUNDING_S
    left = limits - (rows[:, :stops] * boxes.low_s).sum(axis=1)
    tops_s[:stops] -= boxes.low_s
    result = dual_simplex(rows, left, worth, enough_s - sure_s)
    # By the prices on the rows themselves, so that rounding of the exchanges hides no plan.
    paid = (result.prices[:, None] * rows).sum(axis=0)
    limit = (result.prices * left).sum(axis=0)
    none = result.value == -np.inf
    void = none & (limit + (np.maximum(-paid, 0.0) * tops_s).sum(axis=0) < 0.0)
    hover_s = limit + (np.maximum(worth[:, None] - paid, 0.0) * tops_s).sum(axis=0)
    hover_s = np.where(none, tops_s[hovers].sum(axis=0), hover_s) + sure_s
    return Bounds(np.where(void, -np.inf, hover_s), result.x[:stops] + boxes.low_s)


def programmes(terrain: Terrain, boxes: Boxes) -> Programmes:
    """The rows that all plans of boxes keep."""
    battery, stops = terrain.battery, len(boxes.pattern)
    legs = Flown(*(table[-1][boxes.places[:-1], boxes.places[1:]] for table in terrain.leg_maps))
    current_A = terrain.stay_current_A[boxes.places[1:-1]]
    begin = terrain.charge_at(boxes.places[0])
    full = [stop for stop in range(stops) if (current_A[stop] > 0.0).any()]
    # At every landing: time and charge without stays, the stays before, and what they add.
    elapsed_s = legs.duration_s.cumsum(axis=0)
    charge_As = begin.total_As - legs.charge_As.cumsum(axis=0)
    before = np.repeat(np.tri(stops + 1, stops, -1)[:, :, None], len(boxes), axis=2)
    gained, stay = before * current_A, np.repeat(np.eye(stops)[:, :, None], len(boxes), axis=2)
    tops, tapers = boxes.high_s.copy(), full if terrain.tapers else []
    if tapers:
        unit_A = float(np.abs(terrain.stay_current_A).max())
        none = np.zeros((stops + 1, 2 * len(tapers), len(boxes)))
        gained, before, stay = (np.hstack([x, none[: len(x)]]) for x in (gained, before, stay))
        for number, stop in enumerate(tapers):
            column = stops + 2 * number
            # From here on the charge counts from both wells, not from the start.
            gained[stop + 1 :, : stop + 1] = gained[stop + 1 :, stops:column] = 0.0
            gained[stop + 1 :, column : column + 2] = unit_A
            charge_As[stop + 1 :] -= charge_As[stop].copy()
        wells_s = np.repeat(np.array(battery.full)[:, None] / unit_A, len(boxes), axis=1)
        tops = np.vstack([tops, *[wells_s] * len(tapers)])
    least_As = [*[terrain.least_on_landing_As] * stops, terrain.least_charge_As]
    left = [landing for landing in range(stops + 1) if least_As[landing] > -math.inf]
    rows = [stay.sum(axis=0)[None], stay, -gained[left]]
    limits = [terrain.deadline_s - elapsed_s[-1:], boxes.high_s]
    limits.append(charge_As[left] - np.array(least_As)[left, None])
    if not terrain.tapers:
        rows.append(gained[[stop + 1 for stop in full]])
        limits.append(battery.capacity_As - charge_As[full])
    drained_per_s = battery.flow_rate_per_s / battery.bound_fraction
    bound_As = battery.bound_fraction * begin.total_As - begin.tilt_As
    for share in TANGENTS if drained_per_s else TANGENTS[:1]:
        at_s = share * terrain.deadline_s
        height_As = bound_As * np.exp(-drained_per_s * at_s)
        slope_A = -drained_per_s * height_As
        rows.append(slope_A * before - gained)
        limits.append(charge_As - height_As - slope_A * (elapsed_s - at_s))
    wells = zip(*_wells(terrain, boxes, legs, gained, charge_As, tapers), strict=True)
    for blocks, more in zip((rows, limits), wells, strict=True):
        blocks.append(np.array(more))
    return Programmes(np.concatenate(rows), np.concatenate(limits), tops)


def _wells(
    terrain: Terrain,
    boxes: Boxes,
    legs: Flown,
    gained: Floats,
    charge_As: Floats,
    tapers: list[int],
) -> Iterator[Row]:
    """Rows y1 ≥ 0 after each stage of a leg and each stay that draws, y1 ≤ ωB after others."""
    battery, stops, maps = terrain.battery, len(boxes.pattern), terrain.leg_maps
    share, current_A = battery.available_fraction, terrain.stay_current_A[boxes.places[1:-1]]
    before_As, tilt_As = (np.full(len(boxes), x) for x in terrain.charge_at(boxes.places[0]))
    # −z as well: a plane above it is one below z.
    tilt, opposite = (Tilt.at_start(sign * tilt_As, gained.shape[1]) for sign in (1.0, -1.0))
    envelopes = enveloped(terrain, boxes, legs).after if tapers else None

    def row(rises: Floats, tilt: Tilt, room_As: Floats) -> Row:
        """Row of ± y1, whose total rises by so much with the unknowns, and what it may fall."""
        return -share * rises - tilt.slope_A, share * room_As + tilt.height_As

    for stop, leg in enumerate(itertools.pairwise(boxes.places)):
        start = tilt
        for number, drawn_As in enumerate(maps.charge_As):
            remaining, tilted_As = maps.remaining[number][leg], maps.tilt_As[number][leg]
            tilt = start.flown(remaining, tilted_As)
            yield row(gained[stop], tilt, before_As - drawn_As[leg])
        if stop == stops:
            break
        before_As, amps = charge_As[stop], current_A[stop]
        opposite = opposite.flown(remaining, -tilted_As)
        if stop in tapers and envelopes is not None:
            column = stops + 2 * tapers.index(stop)
            wells_A = np.zeros((2, *gained[stop].shape))
            wells_A[0, column] = wells_A[1, column + 1] = gained[stop + 1][column]
            landing, after = ChargePlanes(before_As, gained[stop], tilt, opposite), envelopes[stop]
            yield from tapering(battery, boxes, stop, amps, landing, wells_A, after)
            before_As = np.zeros_like(before_As)
            tilt = Tilt.of_wells(battery, wells_A, after.tilts_As(battery))
            opposite = Tilt(-tilt.height_As, -tilt.slope_A, -tilt.most_As, -tilt.least_As)
            continue
        times_s = boxes.low_s[stop], boxes.high_s[stop]
        tilt = tilt.stayed(battery, stop, amps, *times_s)
        opposite = opposite.stayed(battery, stop, -amps, *times_s)
        if (amps < 0.0).any():
            yield row(gained[stop + 1], tilt, before_As)
        if (amps > 0.0).any():
            yield row(-gained[stop + 1], opposite, battery.capacity_As - before_As)
