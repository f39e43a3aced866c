"""What must not be negative in a box of plans, and what a second of each stay is worth to it.

One corner of a box has the longest rests and the shortest hovers. A second of stay i more or less
changes y1 after a later phase, by τ, by ∂y1/∂t_i = ωI_i + e^(−k'τ) ((1−ω) I_i − k'z_i), where z_i
is the tilt at the end of the stay; interval arithmetic bounds it over the box. The same holds for y
at the end, where the derivative is I_i.

A sum of limits with weights ≥ 0 is a limit as well. Two kinds are useful: those that level the
prices of early and late stays, and those in which a rest's price in a limit on y1 ≥ 0 cancels
against y1 ≤ ωB.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from optuav.physics.battery import levelling
from optuav.physics.quantity import TINY
from optuav.search.boxes import Boxes
from optuav.search.terrain import Floats, Flown, Terrain


class Limit(NamedTuple):
    """A quantity that must not be negative, at the corner that is best for it, and its prices.

    Parameters
    ----------
    value_As
        At the corner (box,) [A s].
    price_A
        Least that it loses a second by which a stay leaves that corner (stop, box) [A].
    full
        Whether it keeps y1 ≤ ωB: then its corner is the one of short rests and long hovers.
    """

    value_As: Floats
    price_A: Floats
    full: bool


def limits(
    terrain: Terrain, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats
) -> Iterator[Limit]:
    """0 ≤ y1 after every leg, y1 ≤ ωB after every stay, and the charge left at the end."""
    battery, stops = terrain.battery, len(boxes.pattern)
    share, rate = battery.available_fraction, battery.rate_per_s
    hover = np.array(boxes.pattern)
    current_A = terrain.stay_current_A[boxes.places[1:-1]]
    faded_s = {True: levelling(battery, high_s), False: levelling(battery, low_s)}
    """Shares that remain, and their integrals, after the longest and the shortest stays."""
    total = short_total = np.full(len(boxes), battery.capacity_As)
    tilt = short_tilt = low_tilt = high_tilt = np.zeros(len(boxes))
    weakest, strongest = np.empty_like(low_s), np.empty_like(low_s)
    least, most = np.ones_like(low_s), np.ones_like(low_s)

    def prices(past: int) -> Floats:
        """Of the stays that lie in the past, 0 for the others."""
        price_A = np.zeros_like(low_s)
        for stay in range(past):
            push_A = strongest[stay] if hover[stay] else weakest[stay]
            much = (push_A > 0.0) == hover[stay]
            fade = np.where(much, most[stay], least[stay])
            price_A[stay] = share * current_A[stay] + push_A * fade
            if hover[stay]:
                price_A[stay] *= -1.0
        return price_A

    for stop in range(stops + 1):
        remaining, offset = legs.remaining[stop], legs.tilt_As[stop]
        total, short_total = (each - legs.charge_As[stop] for each in (total, short_total))
        tilt, short_tilt, low_tilt, high_tilt = (
            each * remaining + offset for each in (tilt, short_tilt, low_tilt, high_tilt)
        )
        least[:stop] *= remaining
        most[:stop] *= remaining
        yield Limit(share * total + tilt, prices(stop), full=False)
        if stop == stops:
            break
        charging_A = (1.0 - share) * current_A[stop]
        after = {
            long: (remains[stop], charging_A * integral_s[stop])
            for long, (remains, integral_s) in faded_s.items()
        }

        def at(tilt_As: Floats, long: bool, after: Any = after) -> Floats:
            remains, gained_As = after[long]
            moved: Floats = tilt_As * remains + gained_As
            return moved

        rests = not hover[stop]
        best_s, worst_s = (high_s, low_s) if rests else (low_s, high_s)
        total = total + current_A[stop] * best_s[stop]
        short_total = short_total + current_A[stop] * worst_s[stop]
        tilt, short_tilt = at(tilt, rests), at(short_tilt, not rests)
        low_tilt, high_tilt = (
            np.minimum(at(low_tilt, True), at(low_tilt, False)),
            np.maximum(at(high_tilt, True), at(high_tilt, False)),
        )
        weakest[stop] = charging_A - rate * high_tilt
        strongest[stop] = charging_A - rate * low_tilt
        least[:stop] *= after[True][0]
        most[:stop] *= after[False][0]
        if not terrain.tapers:
            room_As = battery.full.available_As - (share * short_total + short_tilt)
            yield Limit(room_As, prices(stop + 1), full=True)
    price_A = np.where(hover[:, None], -current_A, current_A)
    yield Limit(total - terrain.least_charge_As, price_A, full=False)


def _sum(one: Limit, other: Limit, weight: Floats) -> Limit:
    """A limit that follows from two with the same corner; the other counts with a weight ≥ 0."""
    return Limit(
        one.value_As + weight * other.value_As, one.price_A + weight * other.price_A, one.full
    )


def _weight(dear_A: Floats, price_A: Floats) -> Floats:
    """How often a price goes into another, 0 where either is none."""
    return np.maximum(dear_A, 0.0) * (price_A > TINY) / np.maximum(price_A, TINY)


def levelled(limits: Sequence[Limit], boxes: Boxes) -> list[Limit]:
    """Sums of limits that make it as dear to leave the corner early as late.

    A limit in the midst of a mission puts no price on what comes later, and the ones at the end a
    lower price on what came earlier, so each alone lets stays be traded where another forbids it.
    """
    found = []
    arrivals = [each for each in limits if not each.full]
    for hovering, stays in ((False, boxes.rests), (True, boxes.hovers)):
        parted = [pair for pair in itertools.pairwise(stays) if pair[1] > pair[0] + 1]
        for last in arrivals[-2:] if parted else ():
            level = last
            for early, late in reversed(parted):
                between = arrivals[early + 1 if hovering else late]
                dearer_A = level.price_A[late] - level.price_A[early]
                level = _sum(level, between, _weight(dearer_A, between.price_A[early]))
            found.append(level)
    return found


def against_full(limits: Sequence[Limit], rests: Sequence[int], width_s: Floats) -> list[Limit]:
    """Sums of a limit y1 ≤ ωB after a rest and a later one, in which the price of the rest cancels.

    Seen from the corner of long rests, y1 ≤ ωB has prices < 0: what leaving that corner gains.
    """
    found = []
    for number, limit in enumerate(limits):
        stay = number // 2
        if not limit.full or stay not in rests:
            continue
        missed_As = (limit.price_A * width_s).sum(axis=0)
        near = Limit(limit.value_As - missed_As, -limit.price_A, full=False)
        for later in limits[number + 1 :]:
            if not later.full:
                found.append(_sum(later, near, _weight(later.price_A[stay], limit.price_A[stay])))
    return found
