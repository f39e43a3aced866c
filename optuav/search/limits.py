"""What must not be negative in a box of plans: envelopes, and limits with the price of each stay.

*Envelopes.* With durations t ≥ 0, every leg and stay maps (y, y1) to
e^(−k't) y1 + ω (1 − e^(−k't)) y + a constant for y1 and to y + a constant for y: more of either
never leads to less of either. So the largest and the least (y, y1) of a box, carried from phase to
phase with the duration that is best or worst for each, enclose all its plans. A box is dropped
where the largest y1 is below 0, the least above ωB, or the largest y at the end below η0 B. Between
phases the envelopes are cut back to 0 ≤ y1 ≤ ωB, y1 ≤ y ≤ y1 + (1−ω)B, which all its plans keep.
Where charging tapers, the least (y, y1) are left out; the cuts to y1 ≤ ωB hold there too
(`optuav.search.bound` says why).

*Prices.* The corner of a box has the longest rests and the shortest hovers. A second of stay i more
or less changes y1 after a later phase, by τ, by ∂y1/∂t_i = ωI_i + e^(−k'τ) ((1−ω) I_i − k'z_i),
where z_i is the tilt at the end of the stay; interval arithmetic bounds it over the box. The charge
at the end is a limit as well, where a second of a stay is worth its current.

A sum of limits with weights ≥ 0 is a limit as well. Two kinds are useful: those that level the
prices of early and late stays, and those in which a rest's price in a limit on y1 ≥ 0 cancels
against y1 ≤ ωB.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.physics.kibam import Battery, levelling
from optuav.physics.quantity import TINY
from optuav.search.boxes import Boxes
from optuav.search.terrain import ROUNDING, Flown, Terrain


class Corner:
    """The corner of boxes of one pattern, followed leg by leg and stay by stay.

    Arrays have one column a box, as shortest and longest stays (stop, box) [s]. It begins at
    take-off; `past` counts the stays that are over.
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


class Limit(NamedTuple):
    """A quantity that must not be negative, at the corner that is best for it (box,) [A s].

    A price is the least that it loses a second by which a stay leaves that corner (stop, box) [A].
    If it is `full`, it keeps y1 ≤ ωB, and its corner is the one of short rests and long hovers.
    """

    value_As: Floats
    price_A: Floats
    full: bool


def limits(
    terrain: Terrain, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats
) -> Iterator[Limit]:
    """0 ≤ y1 after every leg, y1 ≤ ωB after every stay, and the charge left at the end."""
    corner = Corner(terrain, boxes, legs, low_s, high_s)
    for _ in boxes.pattern:
        corner.fly()
        yield Limit(corner.available_As, corner.prices_A, full=False)
        corner.stay()
        if not terrain.tapers:
            yield Limit(corner.room_As, corner.prices_A, full=True)
    corner.fly()
    yield Limit(corner.available_As, corner.prices_A, full=False)
    price_A = np.where(np.array(boxes.pattern)[:, None], -corner.current_A, corner.current_A)
    yield Limit(corner.total_As - terrain.least_charge_As, price_A, full=False)


def _sum(one: Limit, other: Limit, weight: Floats) -> Limit:
    """A limit that follows from two with the same corner; the other counts with a weight ≥ 0."""
    return Limit(
        one.value_As + weight * other.value_As, one.price_A + weight * other.price_A, one.full
    )


def _weight(dear_A: Floats, price_A: Floats) -> Floats:
    """Ratio of two prices, 0 where either is not positive."""
    return np.maximum(dear_A, 0.0) * (price_A > TINY) / np.maximum(price_A, TINY)


def levelled(limits: Sequence[Limit], boxes: Boxes) -> list[Limit]:
    """Sums of limits in which leaving the corner early costs as much as leaving it late.

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
