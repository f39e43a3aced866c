"""Trials of plans: whether the battery can deliver them, and how long they can hover."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.physics.kibam import Stage, Wells, levelling, tapered
from optuav.physics.quantity import TINY
from optuav.search.terrain import HOVER, Boxes, Terrain

HALVINGS = 40  # Of a hover time; what is left is some 1e-9 s


@dataclass(frozen=True)
class Stops:
    """A plan: numbers of the places, both ends included (stop + 2,), and stays (stop,) [s].

    With its hover time, and the rank of its sequence in the order in which ties are broken.
    """

    places: Integers
    stays_s: Floats
    hover_s: float
    rank: int


@dataclass(frozen=True)
class Trial:
    """Plans over one terrain."""

    terrain: Terrain

    def slack(self, places: Integers, stays_s: Floats) -> Floats:
        """Smallest distance of plans to a limit of the wells [A s]; < 0 where one is violated.

        Every stage of constant current is looked at where it ends: y1 is least at an end while it
        drains and largest at an end while it charges, if it begins within the wells. Where charging
        tapers, nothing passes full. Places (stop + 2, plan), stays (stop, plan) [s].
        """
        battery, maps = self.terrain.battery, self.terrain.leg_maps
        share, full_As = battery.available_fraction, battery.full.available_As
        current_A = self.terrain.stay_current_A[places]
        total, tilt = np.full(places.shape[1], battery.capacity_As), np.zeros(places.shape[1])
        slack = np.full(places.shape[1], np.inf)
        for stop, (start, end) in enumerate(itertools.pairwise(places)):
            totals = total - maps.charge_As[:, start, end]
            tilts = tilt * maps.remaining[:, start, end] + maps.tilt_As[:, start, end]
            slack = np.minimum(slack, (share * totals + tilts).min(axis=0))
            total, tilt = totals[-1], tilts[-1]
            if stop == len(stays_s):
                break
            total, tilt = self._after_stay(total, tilt, Stage(current_A[stop + 1], stays_s[stop]))
            available = share * total + tilt
            room_As = np.inf if self.terrain.tapers else full_As - available
            slack = np.minimum(slack, np.minimum(available, room_As))
        least: Floats = np.minimum(slack, total - self.terrain.least_charge_As)
        return least

    def _after_stay(self, total: Floats, tilt: Floats, phase: Stage) -> tuple[Floats, Floats]:
        """Total charge and tilt (plan,) [A s] after a stay."""
        battery = self.terrain.battery
        share, (current_A, time_s) = battery.available_fraction, phase
        remaining, integral_s = levelling(battery, time_s)
        total_after = total + current_A * time_s
        tilt_after = tilt * remaining + (1.0 - share) * current_A * integral_s
        if self.terrain.tapers:
            over = share * total_after + tilt_after > battery.full.available_As
            if over.any():
                before = Wells(share * total + tilt, (1.0 - share) * total - tilt)
                at_start = Wells(*(well[over] for well in before))
                available, bound = tapered(battery, at_start, Stage(*(f[over] for f in phase)))
                total_after[over] = available + bound
                tilt_after[over] = (1.0 - share) * available - share * bound
        return total_after, tilt_after

    def longest(self, boxes: Boxes, hover_s: Floats) -> tuple[Booleans, Floats]:
        """Find plans in boxes that hover at least so long.

        Two ways lead through a box: the hovers grow from the shortest on, and the rests are as long
        as the deadline lets them be, or as short as they may. Along each, halving finds where the
        wells set an end. Returns whether one was found (box,), and the stays of those found
        (stop, found) [s].
        """
        hover = np.array(boxes.pattern)[:, None]
        short = replace(boxes, high_s=np.where(hover, boxes.high_s, boxes.low_s))
        (found, stays_s), (found_short, short_s) = (
            self._along(each, hover_s) for each in (boxes, short)
        )
        hovers = boxes.hovers
        longer = short_s[hovers].sum(axis=0) > stays_s[hovers].sum(axis=0)
        take = found_short & (longer | ~found)
        found = found | found_short
        return found, np.where(take, short_s, stays_s)[:, found]

    def _along(self, boxes: Boxes, hover_s: Floats) -> tuple[Booleans, Floats]:
        """As `longest`, with the long rests of a box only; stays of all boxes (stop, box)."""
        hovers, rests = boxes.hovers, boxes.rests
        legs_s = self.terrain.duration_s[boxes.places[:-1], boxes.places[1:]]
        left_s = self.terrain.deadline_s - legs_s.sum(axis=0)
        low_s = np.maximum(boxes.low_s[hovers].sum(axis=0), hover_s)
        stays_s = _stays(boxes, low_s, left_s)
        found = self._holds(boxes, stays_s, left_s) & (stays_s[hovers].sum(axis=0) >= hover_s)
        if not found.any():
            return found, stays_s
        chosen, low_s, left_s = boxes.take(found), low_s[found], left_s[found]
        high_s = left_s - chosen.low_s[rests].sum(axis=0)
        high_s = np.maximum(low_s, np.minimum(high_s, chosen.high_s[hovers].sum(axis=0)))
        best_s = stays_s[:, found]
        for _ in range(HALVINGS):
            middle_s = 0.5 * (low_s + high_s)
            tried_s = _stays(chosen, middle_s, left_s)
            good = self._holds(chosen, tried_s, left_s)
            best_s = np.where(good, tried_s, best_s)
            low_s, high_s = np.where(good, middle_s, low_s), np.where(good, high_s, middle_s)
        stays_s[:, found] = best_s
        return found, stays_s

    def _holds(self, boxes: Boxes, stays_s: Floats, left_s: Floats) -> Booleans:
        """Whether deadline and wells admit stays."""
        in_time: Booleans = stays_s.sum(axis=0) <= left_s
        return in_time & (self.slack(boxes.places, stays_s) >= 0.0)

    def with_short_rests(self, stops: Stops) -> Stops:
        """The same plan with every rest, one after another, as short as the wells admit."""
        places, stays_s = stops.places[:, None], stops.stays_s[:, None].copy()
        for stop in np.flatnonzero(stops.places[1:-1] != HOVER):
            low_s, high_s = 0.0, float(stays_s[stop, 0])
            for time_s in (low_s, *[None] * HALVINGS):
                tried_s = stays_s.copy()
                tried_s[stop] = 0.5 * (low_s + high_s) if time_s is None else time_s
                if self.slack(places, tried_s)[0] >= 0.0:
                    high_s, stays_s = float(tried_s[stop, 0]), tried_s
                else:
                    low_s = float(tried_s[stop, 0])
        return replace(stops, stays_s=stays_s[:, 0])


def _stays(boxes: Boxes, hover_s: Floats, left_s: Floats) -> Floats:
    """Stays (stop, box) that hover so long in total and rest for what is left, within the boxes."""
    found = np.empty_like(boxes.low_s)
    for group, sum_s in ((boxes.hovers, hover_s), (boxes.rests, left_s - hover_s)):
        low_s, width_s = boxes.low_s[group], boxes.high_s[group] - boxes.low_s[group]
        most_s = np.maximum(width_s.sum(axis=0), TINY)
        found[group] = low_s + np.clip((sum_s - low_s.sum(axis=0)) / most_s, 0.0, 1.0) * width_s
    return found
