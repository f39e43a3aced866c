"""Which boxes may hold a plan that hovers longer than a given time, and how much of each.

Every rule is valid without conditions on currents and wells: it drops only times that no plan
within 0 ≤ y1 ≤ ωB can have. They are

1. *Time.* The stays and the flight fit into the deadline, and the hovers last the given time.
2. *Envelopes.* With durations t ≥ 0, every leg and stay maps (y, y1) to e^(−k't) y1 +
   ω (1 − e^(−k't)) y + a constant for y1 and to y + a constant for y: more of either never leads to
   less of either. So the largest and the least (y, y1) of a box, carried from phase to phase with
   the duration that is best or worst for each, enclose all its plans. A box falls where the largest
   y1 is below 0, the least above ωB, or the largest y at the end below η0 B. Between phases the
   envelopes are cut back to 0 ≤ y1 ≤ ωB, y1 ≤ y ≤ y1 + (1−ω)B, which all its plans keep.
3. *Trading.* One corner of a box has the longest rests and the shortest hovers. The time rule makes
   a plan give up at least s_R of these rests and add at least s_H to these hovers. A second of stay
   i more or less changes y1 after a later phase, by τ, by ∂y1/∂t_i = ωI_i + e^(−k'τ)
   ((1−ω) I_i − k'z_i), where z_i is the tilt at the end of the stay; interval arithmetic bounds it
   over the box. So what y1 loses against the corner is at least the cheapest way to give up s_R
   and add s_H (a knapsack of fractions), and no stay is further from the corner than its own loss
   allows, which cuts the box. The same holds for y at the end, where the derivative is I_i.

4. *Sums of limits.* A sum of limits with weights ≥ 0 is a limit, and traded like one. Two kinds are
   useful: those that level the prices of early and late stays, and those in which a rest's price
   in a limit on y1 ≥ 0 cancels against y1 ≤ ωB.

Where charging tapers, all this is said of plans that may go past full instead: a plan that tapers
holds no more than the one of the same times that does not (`optuav.physics.charging`), so no hover
that is ruled out for those is possible. The limits y1 ≤ ωB and the least (y, y1) are left out then;
the cuts to y1 ≤ ωB hold for it, and go on as they are.

"More charge is better" is used nowhere: near full it is false, as charging at constant current
may then pass y1 = ωB.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from optuav.physics.battery import levelling
from optuav.physics.quantity import TINY
from optuav.search.boxes import Boxes
from optuav.search.terrain import Booleans, Floats, Terrain

ROUNDING = 1e-11
"""Share of the capacity by which a limit must be missed before a box falls [-]."""


class Flown(NamedTuple):
    """The legs of a sequence, each (leg, box): duration [s], Q [A s], e^(−k'T) [-], Z [A s]."""

    duration_s: Floats
    charge_As: Floats
    remaining: Floats
    tilt_As: Floats


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


@dataclass(frozen=True)
class Bound:
    """The test of boxes over one terrain.

    Parameters
    ----------
    terrain
        Legs and stays.
    legs
        Whole legs, each (start, end).
    """

    terrain: Terrain
    legs: Flown

    @classmethod
    def over(cls, terrain: Terrain) -> Bound:
        """The test over a terrain."""
        maps = terrain.leg_maps()
        whole = (maps.charge_As[-1], maps.remaining[-1], maps.tilt_As[-1])
        return cls(terrain, Flown(terrain.duration_s, *whole))

    def possible(self, boxes: Boxes, hover_s: Floats) -> Boxes:
        """What may hold plans that hover at least so long, boxes cut and empty ones left out.

        Parameters
        ----------
        boxes
            Boxes of one pattern.
        hover_s
            Total hover time to reach (box,) [s].
        """
        way = boxes.places[:-1], boxes.places[1:]
        legs = Flown(*(table[way] for table in self.legs))
        time_left_s = self.terrain.deadline_s - legs.duration_s.sum(axis=0)
        low_s, high_s, alive = _in_time(boxes, time_left_s, hover_s)
        within, overfull = self._enveloped(boxes, legs, low_s, high_s)
        alive &= within
        hovers, rests = boxes.hovers, boxes.rests
        hover = np.array(boxes.pattern)[:, None]
        hovered_s = np.maximum(hover_s, low_s[hovers].sum(axis=0))
        more_hover_s = hovered_s - low_s[hovers].sum(axis=0)
        less_rest_s = high_s[rests].sum(axis=0) + hovered_s - time_left_s
        less_hover_s = high_s[hovers].sum(axis=0) + low_s[rests].sum(axis=0) - time_left_s
        none_s = np.zeros(len(boxes))
        width_s = high_s - low_s
        near_s, far_s = width_s.copy(), width_s.copy()
        promise = np.full(len(boxes), np.inf)
        rounding_As = ROUNDING * self.terrain.battery.capacity_As
        limits = [*self._limits(boxes, legs, low_s, high_s)]
        sums = _levelled(limits, boxes)
        if overfull.any():
            sums += _against_full(limits, boxes.rests, width_s)
        for limit in (*limits, *sums):
            needs_s = (less_hover_s, none_s) if limit.full else (more_hover_s, less_rest_s)
            moves_s = far_s if limit.full else near_s
            groups = [(g, need_s) for g, need_s in zip((hovers, rests), needs_s, strict=True) if g]
            losses = [_cheapest(limit.price_A[g], width_s[g], need_s) for g, need_s in groups]
            room_As = limit.value_As + rounding_As - sum(losses)
            promise = np.minimum(promise, room_As)
            for (group, _), loss_As in zip(groups, losses, strict=True):
                price_A = limit.price_A[group]
                earned_As = np.minimum(price_A * width_s[group], 0.0).sum(axis=0)
                room_s = (room_As + loss_As - earned_As) / np.maximum(price_A, TINY)
                moves_s[group] = np.minimum(moves_s[group], np.maximum(room_s, 0.0))
        # Near moves start from long rests and short hovers, far moves from the other corner.
        low_s, high_s = (
            np.where(hover, np.maximum(low_s, high_s - far_s), high_s - near_s),
            np.where(hover, low_s + near_s, np.minimum(high_s, low_s + far_s)),
        )
        alive &= (promise >= 0.0) & (low_s <= high_s).all(axis=0)
        pulled = overfull | np.where(hover, more_hover_s > 0.0, less_rest_s > 0.0)
        cut = replace(boxes, low_s=low_s, high_s=high_s, promise=promise, pulled=pulled)
        return cut if alive.all() else cut.take(alive)

    def _enveloped(
        self, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats
    ) -> tuple[Booleans, Booleans]:
        """Whether the envelopes leave a box possible (box,).

        And whether they pass y1 = ωB at the end of a stay or of a later one (stop, box).
        """
        battery = self.terrain.battery
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
            current_A = self.terrain.stay_current_A[boxes.places[stop + 1]]
            times_s = low_s[stop], high_s[stop]
            total, available = self._farthest(most, current_A, times_s, np.maximum)
            alive &= available >= -rounding_As
            overfull[: stop + 1] |= available > full.available_As
            available = np.minimum(available, full.available_As)
            total = np.minimum(total, available + full.bound_As)
            most = total, available - share * total
            if self.terrain.tapers:
                least = np.zeros(len(boxes)), np.zeros(len(boxes))
                continue
            total, available = self._farthest(least, current_A, times_s, np.minimum)
            alive &= available <= full.available_As + rounding_As
            available = np.maximum(available, 0.0)
            total = np.maximum(total, available)
            least = total, available - share * total
        return alive & (most[0] >= self.terrain.least_charge_As - rounding_As), overfull

    def _farthest(
        self,
        state: tuple[Floats, Floats],
        current_A: Floats,
        times_s: tuple[Floats, Floats],
        pick: np.ufunc,
    ) -> tuple[Floats, Floats]:
        """Largest or least y and y1 [A s] after a stay of any duration between two."""
        battery = self.terrain.battery
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

    def _limits(self, boxes: Boxes, legs: Flown, low_s: Floats, high_s: Floats) -> Iterator[Limit]:
        """0 ≤ y1 after every leg, y1 ≤ ωB after every stay, and the charge left at the end."""
        battery, stops = self.terrain.battery, len(boxes.pattern)
        share, rate = battery.available_fraction, battery.rate_per_s
        hover = np.array(boxes.pattern)
        current_A = self.terrain.stay_current_A[boxes.places[1:-1]]
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
            if not self.terrain.tapers:
                room_As = battery.full.available_As - (share * short_total + short_tilt)
                yield Limit(room_As, prices(stop + 1), full=True)
        price_A = np.where(hover[:, None], -current_A, current_A)
        yield Limit(total - self.terrain.least_charge_As, price_A, full=False)


def _sum(one: Limit, other: Limit, weight: Floats) -> Limit:
    """A limit that follows from two with the same corner; the other counts with a weight ≥ 0."""
    return Limit(
        one.value_As + weight * other.value_As, one.price_A + weight * other.price_A, one.full
    )


def _weight(dear_A: Floats, price_A: Floats) -> Floats:
    """How often a price goes into another, 0 where either is none."""
    return np.maximum(dear_A, 0.0) * (price_A > TINY) / np.maximum(price_A, TINY)


def _levelled(limits: Sequence[Limit], boxes: Boxes) -> list[Limit]:
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


def _against_full(limits: Sequence[Limit], rests: Sequence[int], width_s: Floats) -> list[Limit]:
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


def _in_time(boxes: Boxes, time_left_s: Floats, hover_s: Floats) -> tuple[Floats, Floats, Booleans]:
    """Intervals cut by the deadline and the hover time to reach, and whether something is left."""
    low_s, high_s = boxes.low_s.copy(), boxes.high_s.copy()
    hovers = boxes.hovers
    stays_s = low_s.sum(axis=0)
    lacking_s = np.maximum(hover_s - low_s[hovers].sum(axis=0), 0.0)
    spare_s = time_left_s - stays_s
    for stop, hover in enumerate(boxes.pattern):
        more_s = spare_s if hover else spare_s - lacking_s
        high_s[stop] = np.minimum(high_s[stop], low_s[stop] + more_s)
    hovered_s = high_s[hovers].sum(axis=0)
    for stop in hovers:
        least_s = hover_s - (hovered_s - high_s[stop])
        low_s[stop] = np.maximum(low_s[stop], least_s)
    alive = (high_s >= low_s).all(axis=0) & (hovered_s >= hover_s) & (spare_s >= lacking_s)
    return low_s, np.maximum(low_s, high_s), alive


def _cheapest(price: Floats, width: Floats, need: Floats) -> Floats:
    """Least Σ price·d with 0 ≤ d ≤ width and Σ d ≥ need; all (stay, box), the need (box,)."""
    if len(price) == 1:
        taken = np.where(price < 0.0, width, np.clip(need, 0.0, width))
        only: Floats = (price * taken)[0]
        return only
    order = np.argsort(price, axis=0)
    price, width = (np.take_along_axis(each, order, axis=0) for each in (price, width))
    before = np.cumsum(width, axis=0) - width
    taken = np.where(price < 0.0, width, np.clip(need - before, 0.0, width))
    total: Floats = (price * taken).sum(axis=0)
    return total
