"""Rules that drop or cut boxes which hold no plan that hovers longer than a given time.

Every rule is valid without conditions on currents and wells: it drops only times that no plan
within 0 ≤ y1 ≤ ωB can have. They are

1. *Time.* The stays and the flight fit into the deadline, and the hovers last the given time.
2. *Envelopes.* With durations t ≥ 0, every leg and stay maps (y, y1) to
   e^(−k't) y1 + ω (1 − e^(−k't)) y + a constant for y1 and to y + a constant for y: more of either
   never leads to less of either. So the largest and the least (y, y1) of a box, carried from phase
   to phase with the duration that is best or worst for each, enclose all its plans. A box is
   dropped where the largest y1 is below 0, the least above ωB, or the largest y below η0 B at the
   end, or at any landing if η0 holds there. Between phases the envelopes are cut back to
   0 ≤ y1 ≤ ωB, y1 ≤ y ≤ y1 + y2, which all its plans keep, with the largest y2: that of wells
   which both are the largest, and hold y1 = ωB once it is reached.
3. *Trading.* One corner of a box has the longest rests and the shortest hovers. The time rule makes
   a plan give up at least s_R of these rests and add at least s_H to these hovers. A second of stay
   i more or less changes y1 after a later phase, by τ, by
   ∂y1/∂t_i = ωI_i + e^(−k'τ) ((1−ω) I_i − k'z_i), where z_i is the tilt at the end of the stay;
   interval arithmetic bounds that price over the box. The charge at the end is a limit as well,
   where a second of a stay is worth its current. So a limit loses against the corner at least the
   cheapest way to do so by its prices (a knapsack of fractions), and no stay is further from the
   corner than its own loss allows, which cuts the box.

Where charging tapers, all this is said of plans that may go past full instead: a plan that tapers
holds no more than the one of the same times that does not (`optuav.physics.kibam`), so no hover
that is ruled out for those is possible. The limits y1 ≤ ωB are left out then; the cuts to y1 ≤ ωB
hold for it, and go on as they are. Where the corner of rule 3 would pass full, y1 counts from the
largest wells after that rest, and the stays before it have no price. The least (y1, y2) after a
stay are those of tapering stages.

"More charge is better" is used nowhere: near full it is false, as charging at constant current
may then pass y1 = ωB.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.physics.kibam import (
    Battery,
    Shift,
    Stage,
    Tilted,
    Wells,
    levelling,
    tapered_from,
    tilted_after,
    time_to_full,
)
from optuav.physics.quantity import TINY
from optuav.search.terrain import LEAST_VIOLATION, ORIGIN, Boxes, Flown, Terrain


class AfterStay(NamedTuple):
    """Wells after a stay that may taper (box,)."""

    most: Wells
    least: Wells
    total_As: Floats  # Largest y
    soonest_As: Floats  # Largest y2 after the shortest stay
    landed: Wells  # Before the stay, in the middle of the least and the most

    def tilts_As(self, battery: Battery) -> tuple[Floats, Floats]:
        """The range of the tilt after the stay [A s]."""
        share, rest = battery.available_fraction, battery.bound_fraction
        low, high = self.least, self.most
        return (
            rest * low.available_As - share * high.bound_As,
            rest * high.available_As - share * low.bound_As,
        )

    def take(self, which: Booleans) -> "AfterStay":
        """Those of some boxes."""
        wells = (Wells(*(x[which] for x in part)) for part in (self.most, self.least, self.landed))
        most, least, landed = wells
        return AfterStay(most, least, self.total_As[which], self.soonest_As[which], landed)


class Envelopes(NamedTuple):
    """What the envelopes of boxes say."""

    alive: Booleans  # Whether they leave a box possible (box,)
    overfull: Booleans  # Whether they pass y1 = ωB after a stay, or later (stop, box)
    after: list[AfterStay]  # The charge after each stay, where charging tapers

    def take(self, which: Booleans) -> "Envelopes":
        """Those of some boxes."""
        after = [one.take(which) for one in self.after]
        return Envelopes(self.alive[which], self.overfull[:, which], after)


def possible(terrain: Terrain, boxes: Boxes, hover_s: Floats) -> Boxes:
    """The boxes that may hold plans with such hover times (box,) [s], each cut to these."""
    boxes, legs, hover_s, envelopes = passable(terrain, boxes, hover_s)
    time_left_s = terrain.deadline_s - legs.duration_s.sum(axis=0)
    low_s, high_s = boxes.low_s, boxes.high_s
    hovers, rests = boxes.hovers, boxes.rests
    hover = np.array(boxes.pattern)[:, None]
    hovered_s = np.maximum(hover_s, low_s[hovers].sum(axis=0))
    more_hover_s = hovered_s - low_s[hovers].sum(axis=0)
    less_rest_s = high_s[rests].sum(axis=0) + hovered_s - time_left_s
    less_hover_s = high_s[hovers].sum(axis=0) + low_s[rests].sum(axis=0) - time_left_s
    none_s = np.zeros(len(boxes))
    width_s = high_s - low_s
    near_s, far_s = width_s.copy(), width_s.copy()
    spare_As = np.full(len(boxes), np.inf)
    rounding_As = LEAST_VIOLATION * terrain.battery.capacity_As
    for limit in _limits(terrain, boxes, legs, envelopes.after):
        needs_s = (less_hover_s, none_s) if limit.full else (more_hover_s, less_rest_s)
        moves_s = far_s if limit.full else near_s
        groups = [(g, need_s) for g, need_s in zip((hovers, rests), needs_s, strict=True) if g]
        losses = [_cheapest(limit.price_A[g], width_s[g], need_s) for g, need_s in groups]
        room_As = limit.value_As + rounding_As - sum(losses)
        spare_As = np.minimum(spare_As, room_As)
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
    alive = (spare_As >= 0.0) & (low_s <= high_s).all(axis=0)
    pulled = envelopes.overfull | np.where(hover, more_hover_s > 0.0, less_rest_s > 0.0)
    cut = replace(boxes, low_s=low_s, high_s=high_s, pulled=pulled)
    return cut if alive.all() else cut.take(alive)


def passable(
    terrain: Terrain, boxes: Boxes, hover_s: Floats
) -> tuple[Boxes, Flown, Floats, Envelopes]:
    """The boxes that time and envelopes leave, cut, their legs, hovers and envelopes.

    They may be of parts of sequences that have all hovers: the first place is left with full wells
    at most then, and behind the last there may be more stops. Envelopes look at what time leaves.
    """
    legs = Flown(*(table[-1][boxes.places[:-1], boxes.places[1:]] for table in terrain.leg_maps))
    time_left_s = terrain.deadline_s - legs.duration_s.sum(axis=0)
    low_s, high_s, alive = _in_time(boxes, time_left_s, hover_s)
    boxes = replace(boxes, low_s=low_s, high_s=high_s).take(alive)
    legs, hover_s = Flown(*(leg[:, alive] for leg in legs)), hover_s[alive]
    envelopes = enveloped(terrain, boxes, legs)
    alive = envelopes.alive
    legs = Flown(*(leg[:, alive] for leg in legs))
    return boxes.take(alive), legs, hover_s[alive], envelopes.take(alive)


def _in_time(boxes: Boxes, time_left_s: Floats, hover_s: Floats) -> tuple[Floats, Floats, Booleans]:
    """Intervals cut by the deadline and the hover time to reach, and whether something is left."""
    low_s, high_s = boxes.low_s.copy(), boxes.high_s.copy()
    hovers = boxes.hovers
    lacking_s = np.maximum(hover_s - low_s[hovers].sum(axis=0), 0.0)
    spare_s = time_left_s - low_s.sum(axis=0)
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
    order = np.argsort(price, axis=0)
    price, width = (np.take_along_axis(column, order, axis=0) for column in (price, width))
    before = np.cumsum(width, axis=0) - width
    taken = np.where(price < 0.0, width, np.clip(need - before, 0.0, width))
    return np.asarray((price * taken).sum(axis=0))


def enveloped(terrain: Terrain, boxes: Boxes, legs: Flown) -> Envelopes:
    """The envelopes of boxes, carried along their legs."""
    battery = terrain.battery
    full, share = battery.full, battery.available_fraction
    rounding_As = LEAST_VIOLATION * battery.capacity_As
    # Total charge and tilt.
    from_full = (boxes.places[0] == ORIGIN).all()
    most = tuple(np.full(len(boxes), charge_As) for charge_As in terrain.charge_at(boxes.places[0]))
    bound = Tilted(*most).wells(battery).bound_As
    least = most if from_full else (np.full(len(boxes), -np.inf), most[1])
    least_bound = bound if from_full else np.zeros(len(boxes))
    alive, overfull = np.ones(len(boxes), bool), np.zeros(boxes.low_s.shape, bool)
    after = list[AfterStay]()
    for stop, leg in enumerate(Flown(*values) for values in zip(*legs, strict=True)):
        wells = Wells(share * most[0] + most[1], bound)
        shift = Shift(-leg.charge_As, leg.remaining, leg.tilt_As)
        landed = tilted_after(battery, Tilted.of(battery, wells), shift)
        bound = landed.wells(battery).bound_As
        if terrain.tapers:
            low = Wells(np.maximum(share * least[0] + least[1], 0.0), least_bound)
            low = tilted_after(battery, Tilted.of(battery, low), shift).wells(battery)
            low = Wells(*(np.maximum(well, 0.0) for well in low))
        most = most[0] - leg.charge_As, most[1] * leg.remaining + leg.tilt_As
        least = least[0] - leg.charge_As, least[1] * leg.remaining + leg.tilt_As
        alive &= share * most[0] + most[1] >= -rounding_As
        if stop == len(boxes.pattern):
            alive &= most[0] >= terrain.least_charge_As - rounding_As
            break
        alive &= most[0] >= terrain.least_on_landing_As - rounding_As
        current_A = terrain.stay_current_A[boxes.places[stop + 1]]
        stay = current_A, boxes.low_s[stop], boxes.high_s[stop]
        total, available = _farthest(battery, most, *stay, np.maximum)
        alive &= available >= -rounding_As
        overfull[: stop + 1] |= available > full.available_As
        high = Wells(share * most[0] + most[1], bound)
        bounds = _bounds_tapering(battery, high, *stay)
        bound = np.maximum.reduce(bounds)
        available = np.minimum(available, full.available_As)
        total = np.minimum(total, available + bound)
        most = total, available - share * total
        upper = Wells(available, bound)
        if terrain.tapers:
            _, available = _farthest(battery, Tilted.of(battery, low), *stay, np.minimum)
            least_bound = np.minimum.reduce(_bounds_tapering(battery, low, *stay))
            lower = Wells(np.clip(available, 0.0, full.available_As), least_bound)
            least = Tilted.of(battery, lower)
            halfway = (0.5 * (one + other) for one, other in zip(low, high, strict=True))
            middle = Wells(*map(np.minimum, halfway, full))
            after.append(AfterStay(upper, lower, total, bounds[0], middle))
        else:
            available = np.maximum(share * least[0] + least[1], 0.0)
            total = np.maximum(least[0], available)
            least = total, available - share * total
            total, available = _farthest(battery, least, *stay, np.minimum)
            alive &= available <= full.available_As + rounding_As
            available = np.maximum(available, 0.0)
            total = np.maximum(total, available)
            least = total, available - share * total
    return Envelopes(alive, overfull, after)


def _bounds_tapering(
    battery: Battery, most: Wells, current_A: Floats, low_s: Floats, high_s: Floats
) -> list[Floats]:
    """y2 [A s] after stays of two durations and one between, the least and largest among them.

    The stay tapers once y1 = ωB.

    While the current is constant, y2' = k'z; the tilt z is monotonic then, and positive later on.
    """
    full, rate = battery.full, battery.rate_per_s
    most = Wells(*(np.minimum(well, top) for well, top in zip(most, full, strict=True)))
    charging_A = battery.bound_fraction * current_A
    slope = charging_A - rate * Tilted.of(battery, most).tilt_As
    turn = charging_A / np.where(slope == 0.0, TINY, slope)
    turn_s = -np.log(np.clip(turn, TINY, 1.0)) / rate
    times_s = low_s, high_s, np.clip(turn_s, low_s, high_s)
    charges = np.any(current_A > 0.0)
    full_s = time_to_full(battery, most, current_A) if charges else np.inf
    ends = (tapered_from(battery, most, Stage(current_A, time_s), full_s) for time_s in times_s)
    return [end.bound_As for end in ends]


def _farthest(
    battery: Battery,
    state: tuple[Floats, Floats],
    current_A: Floats,
    low_s: Floats,
    high_s: Floats,
    pick: np.ufunc,
) -> tuple[Floats, Floats]:
    """Largest or least y and y1 [A s] after a stay of any duration between two."""
    share, (total, tilt) = battery.available_fraction, state

    def available(time_s: Floats) -> Floats:
        """y1 after a duration."""
        total_As, tilt_As = tilted_after(battery, Tilted(total, tilt), Stage(current_A, time_s))
        return np.asarray(share * total_As + tilt_As)

    # dy1/dt = I − k'z vanishes where e^(−k't) = ω I / (k'z − (1−ω) I).
    rate = battery.rate_per_s
    slope = rate * tilt - (1.0 - share) * current_A
    turn = share * current_A / np.where(slope == 0.0, TINY, slope)
    turn_s = -np.log(np.clip(turn, TINY, 1.0)) / rate
    lowest = pick(available(low_s), available(high_s))
    inside = (low_s < turn_s) & (turn_s < high_s)
    if inside.any():
        lowest = pick(lowest, available(np.where(inside, turn_s, low_s)))
    return np.asarray(total + pick(current_A * low_s, current_A * high_s)), lowest


class Limit(NamedTuple):
    """A quantity that must not be negative, at the corner that is best for it (box,) [A s].

    A price is its least loss per second of a stay away from that corner (stop, box) [A].
    If it is `full`, it keeps y1 ≤ ωB, and its corner is the one of short rests and long hovers.
    """

    value_As: Floats
    price_A: Floats
    full: bool


def _limits(
    terrain: Terrain, boxes: Boxes, legs: Flown, after: Sequence[AfterStay]
) -> Iterator[Limit]:
    """0 ≤ y1 after every leg, y1 ≤ ωB after every stay, and the charge left at the end.

    Then the charge left at the landings before, where some must be.
    """
    battery, stops = terrain.battery, len(boxes.pattern)
    share, rate = battery.available_fraction, battery.rate_per_s
    hover, number = np.array(boxes.pattern)[:, None], np.arange(stops)[:, None]
    current_A = terrain.stay_current_A[boxes.places[1:-1]]
    worth_A, landings = np.where(hover, -current_A, current_A), list[Limit]()
    low_s, high_s = boxes.low_s, boxes.high_s
    remaining, integral_s = levelling(battery, np.stack([low_s, high_s]))
    # Total charge at the corner and at the opposite one; tilt at both, and its bounds in the box.
    begin = zip((2, 4), terrain.charge_at(boxes.places[0]), strict=True)
    total_As, tilt_As = (np.full((rows, len(boxes)), value) for rows, value in begin)
    # Where a stay may have tapered, y1 counts from the largest wells after it.
    since_As, counts = total_As[0], np.ones(low_s.shape, bool)
    # For every stay that is over, bounds of (1−ω) I − k'z at its end, and of e^(−k'τ) since.
    weakest_A, strongest_A = np.zeros_like(low_s), np.zeros_like(low_s)
    least, most = np.ones_like(low_s), np.ones_like(low_s)

    def price_A(past: int) -> Floats:
        """Prices of y1 for the stays that are over, 0 for the others."""
        push_A = np.where(hover, strongest_A, weakest_A)
        fade = np.where((push_A > 0.0) == hover, most, least)
        price_A = share * current_A + push_A * fade
        return np.where(counts & (number < past), np.where(hover, -price_A, price_A), 0.0)

    for stop, leg in enumerate(Flown(*columns) for columns in zip(*legs, strict=True)):
        total_As, since_As = total_As - leg.charge_As, since_As - leg.charge_As
        tilt_As = tilt_As * leg.remaining + leg.tilt_As
        least[:stop] *= leg.remaining
        most[:stop] *= leg.remaining
        yield Limit(share * since_As + tilt_As[0], price_A(stop), full=False)
        if stop == stops:
            break
        if stop and terrain.least_on_landing_As > -math.inf:
            past = np.where(number < stop, worth_A, 0.0)
            landings.append(Limit(total_As[0] - terrain.least_on_landing_As, past, full=False))
        long = 1 - int(boxes.pattern[stop])  # where the corner has the longest stay
        times_s = np.stack([low_s[stop], high_s[stop]])[[long, 1 - long]]
        total_As = total_As + current_A[stop] * times_s
        since_As = since_As + current_A[stop] * times_s[0]
        charging_A = (1.0 - share) * current_A[stop]
        after_As = tilt_As[:, None] * remaining[:, stop] + charging_A * integral_s[:, stop]
        corners = after_As[0, long], after_As[1, 1 - long]
        tilt_As = np.stack([*corners, after_As[2].min(axis=0), after_As[3].max(axis=0)])
        weakest_A[stop] = charging_A - rate * tilt_As[3]
        strongest_A[stop] = charging_A - rate * tilt_As[2]
        least[:stop] *= remaining[1, stop]
        most[:stop] *= remaining[0, stop]
        if terrain.tapers:
            wells, full = after[stop], battery.full.available_As
            over = (current_A[stop] > 0.0) & (share * since_As + tilt_As[0] > full)
            corner = Tilted.of(battery, wells.most)
            tilts_As = corner.tilt_As, tilt_As[1], *wells.tilts_As(battery)
            tilt_As = np.where(over, tilts_As, tilt_As)
            since_As = np.where(over, corner.total_As, since_As)
            counts[: stop + 1] &= ~over
        else:
            room_As = battery.full.available_As - (share * total_As[1] + tilt_As[1])
            yield Limit(room_As, price_A(stop + 1), full=True)
    yield Limit(total_As[0] - terrain.least_charge_As, worth_A, full=False)
    yield from landings
