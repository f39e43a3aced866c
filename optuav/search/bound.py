"""Rules that drop or cut boxes which hold no plan that hovers longer than a given time.

Every rule is valid without conditions on currents and wells: it drops only times that no plan
within 0 ≤ y1 ≤ ωB can have. They are

1. *Time.* The stays and the flight fit into the deadline, and the hovers last the given time.
2. *Envelopes* (`optuav.search.limits`). The largest and the least that the wells may hold leave
   the box possible.
3. *Trading* (`optuav.search.limits`). One corner of a box has the longest rests and the shortest
   hovers. The time rule makes a plan give up at least s_R of these rests and add at least s_H to
   these hovers. So a limit, or a sum of limits, loses against the corner at least the cheapest way
   to do so by its prices (a knapsack of fractions), and no stay is further from the corner than its
   own loss allows, which cuts the box.

Where charging tapers, all this is said of plans that may go past full instead: a plan that tapers
holds no more than the one of the same times that does not (`optuav.physics.charging`), so no hover
that is ruled out for those is possible. The limits y1 ≤ ωB and the least (y, y1) are left out then;
the cuts to y1 ≤ ωB hold for it, and go on as they are.

"More charge is better" is used nowhere: near full it is false, as charging at constant current
may then pass y1 = ωB.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.physics.quantity import TINY
from optuav.search.boxes import Boxes
from optuav.search.limits import against_full, enveloped, levelled, limits
from optuav.search.terrain import ROUNDING, Flown, Terrain


@dataclass(frozen=True)
class BoxBound:
    """Rules that drop or cut boxes that hold no better plan, with whole legs (start, end)."""

    terrain: Terrain
    legs: Flown

    @classmethod
    def over(cls, terrain: Terrain) -> BoxBound:
        """The test over a terrain."""
        maps = terrain.leg_maps()
        whole = (maps.charge_As[-1], maps.remaining[-1], maps.tilt_As[-1])
        return cls(terrain, Flown(terrain.duration_s, *whole))

    def possible(self, boxes: Boxes, hover_s: Floats) -> Boxes:
        """The boxes that may hold plans that hover at least so long, each cut to where these are.

        The boxes are of one pattern, the total hover time to reach is (box,) [s].
        """
        way = boxes.places[:-1], boxes.places[1:]
        legs = Flown(*(table[way] for table in self.legs))
        time_left_s = self.terrain.deadline_s - legs.duration_s.sum(axis=0)
        low_s, high_s, alive = _in_time(boxes, time_left_s, hover_s)
        within, overfull = enveloped(self.terrain, boxes, legs, low_s, high_s)
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
        found = [*limits(self.terrain, boxes, legs, low_s, high_s)]
        sums = levelled(found, boxes)
        if overfull.any():
            sums += against_full(found, boxes.rests, width_s)
        for limit in (*found, *sums):
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
