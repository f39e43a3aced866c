"""Plans along sequences of stops: their distances to the limits, and the longest in a box."""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.physics.kibam import (
    Battery,
    Stage,
    Tilted,
    Wells,
    held,
    holding_current,
    tapered,
    tilted_after,
    time_to_full,
)
from optuav.physics.quantity import TINY
from optuav.search.terrain import HOVER, Boxes, Terrain

HOVER_HALVINGS = 40  # Halvings of a hover time; some 1e-9 s are left


@dataclass(frozen=True)
class Stops:
    """A plan: numbers of the places, both ends included (stop + 2,), and stays (stop,) [s].

    With its hover time, and the rank of its sequence for breaking ties.
    """

    places: Integers
    stays_s: Floats
    hover_s: float
    rank: int


def margins(
    terrain: Terrain, places: Integers, stays_s: Floats, held_s: Floats | None = None
) -> Floats:
    """Distances of plans to the limits of the wells (limit, plan) [A s]; < 0 if violated.

    At the ends of stages: y1 is least or largest there. Where charging tapers, none passes full.
    Places (stop + 2, plan), stays (stop, plan) [s]. With times to hold y1 after each stay
    (stop, plan) [s] charging does not taper by itself, and all distances are smooth in the times.
    """
    battery, maps = terrain.battery, terrain.leg_maps
    share, full_As = battery.available_fraction, battery.full.available_As
    current_A = terrain.stay_current_A[places]
    count = places.shape[1]
    total, tilt = (np.full(count, charge_As) for charge_As in terrain.charge_at(places[0]))
    rows = list[Floats]()
    for stop, (start, end) in enumerate(itertools.pairwise(places)):
        totals = total - maps.charge_As[:, start, end]
        tilts = tilt * maps.remaining[:, start, end] + maps.tilt_As[:, start, end]
        rows += [*(share * totals + tilts)]
        total, tilt = totals[-1], tilts[-1]
        if stop == len(stays_s):
            break
        if terrain.least_on_landing_As > -math.inf:
            rows.append(total - terrain.least_on_landing_As)
        stay, before = Stage(current_A[stop + 1], stays_s[stop]), Tilted(total, tilt)
        if held_s is None:
            total, tilt = _after_stay(terrain, before, stay)
        else:
            total, tilt = tilted_after(battery, before, stay)
        rows.append(share * total + tilt)
        if held_s is not None or not terrain.tapers:
            rows.append(full_As - rows[-1])
        if held_s is not None:
            total, tilt = _after_hold(
                battery, Tilted(total, tilt), Stage(stay.current_A, held_s[stop])
            )
    return np.array([*rows, total - terrain.least_charge_As])


def slack(terrain: Terrain, places: Integers, stays_s: Floats) -> Floats:
    """Smallest distance of plans to a limit of the wells (plan,) [A s]; < 0 if one is violated."""
    return np.asarray(margins(terrain, places, stays_s).min(axis=0))


def _after_stay(terrain: Terrain, before: Tilted, stay: Stage) -> Tilted:
    """Charge (plan,) after a stay."""
    battery = terrain.battery
    after = tilted_after(battery, before, stay)
    if terrain.tapers:
        over = after.wells(battery).available_As > battery.full.available_As
        if over.any():
            start = Wells(*(well[over] for well in before.wells(battery)))
            end = tapered(battery, start, Stage(*(values[over] for values in stay)))
            after.total_As[over], after.tilt_As[over] = Tilted.of(battery, end)
    return after


def steady_s(terrain: Terrain, places: Integers, stays_s: Floats) -> Floats:
    """Part of each stay before it tapers (stop, plan) [s]."""
    battery, maps = terrain.battery, terrain.leg_maps
    count, parts_s = places.shape[1], list[Floats]()
    charge = Tilted(*(np.full(count, x) for x in terrain.charge_at(places[0])))
    for leg, time_s in zip(itertools.pairwise(places[:-1]), stays_s, strict=True):
        drawn_As, remaining, tilt_As = (table[-1][leg] for table in maps[1:])
        charge = Tilted(charge.total_As - drawn_As, charge.tilt_As * remaining + tilt_As)
        current_A = terrain.stay_current_A[leg[1]]
        full_s = time_to_full(battery, charge.wells(battery), current_A)
        parts_s.append(np.minimum(time_s, full_s))
        charge = _after_stay(terrain, charge, Stage(current_A, time_s))
    return np.array(parts_s)


def _after_hold(battery: Battery, before: Tilted, hold: Stage) -> Tilted:
    """Charge (plan,) after y1 was held where the current of a stage allows it, else after that."""
    wells = before.wells(battery)
    enough = holding_current(battery, wells) <= hold.current_A
    end = Tilted.of(battery, held(battery, wells, hold.duration_s))
    return Tilted(
        *(
            np.where(enough, *both)
            for both in zip(end, tilted_after(battery, before, hold), strict=True)
        )
    )


def longest(terrain: Terrain, boxes: Boxes, hover_s: Floats) -> tuple[Booleans, Floats]:
    """Find plans in boxes that hover at least a given time.

    Two ways lead through a box: hovers grow from the shortest, and rests are as long or as short as
    they may be. Halving finds where the wells end each. Returns whether one was found (box,), and
    the stays of those found (stop, found) [s].
    """
    hover = np.array(boxes.pattern)[:, None]
    short = replace(boxes, high_s=np.where(hover, boxes.high_s, boxes.low_s))
    found_any, stays_s = _along(terrain, boxes, hover_s)
    found_short, short_s = _along(terrain, short, hover_s)
    hovers = boxes.hovers
    longer = short_s[hovers].sum(axis=0) > stays_s[hovers].sum(axis=0)
    take = found_short & (longer | ~found_any)
    found_any = found_any | found_short
    return found_any, np.where(take, short_s, stays_s)[:, found_any]


def _along(terrain: Terrain, boxes: Boxes, hover_s: Floats) -> tuple[Booleans, Floats]:
    """Like `longest`, with the long rests of a box only; stays of all boxes (stop, box)."""
    hovers, rests = boxes.hovers, boxes.rests
    legs_s = terrain.duration_s[boxes.places[:-1], boxes.places[1:]]
    left_s = terrain.deadline_s - legs_s.sum(axis=0)
    low_s = np.maximum(boxes.low_s[hovers].sum(axis=0), hover_s)
    stays_s = _stays(boxes, low_s, left_s)
    held = _holds(terrain, boxes, stays_s, left_s) & (stays_s[hovers].sum(axis=0) >= hover_s)
    if not held.any():
        return held, stays_s
    chosen, low_s, left_s = boxes.take(held), low_s[held], left_s[held]
    high_s = left_s - chosen.low_s[rests].sum(axis=0)
    high_s = np.maximum(low_s, np.minimum(high_s, chosen.high_s[hovers].sum(axis=0)))
    best_s = stays_s[:, held]
    for _ in range(HOVER_HALVINGS):
        middle_s = 0.5 * (low_s + high_s)
        tried_s = _stays(chosen, middle_s, left_s)
        good = _holds(terrain, chosen, tried_s, left_s)
        best_s = np.where(good, tried_s, best_s)
        low_s, high_s = np.where(good, middle_s, low_s), np.where(good, high_s, middle_s)
    stays_s[:, held] = best_s
    return held, stays_s


def feasible(terrain: Terrain, boxes: Boxes, stays_s: Floats) -> Booleans:
    """Test whether deadline and wells allow stays (stop, box) [s]."""
    legs_s = terrain.duration_s[boxes.places[:-1], boxes.places[1:]]
    return _holds(terrain, boxes, stays_s, terrain.deadline_s - legs_s.sum(axis=0))


def _holds(terrain: Terrain, boxes: Boxes, stays_s: Floats, left_s: Floats) -> Booleans:
    """Test whether deadline and wells allow stays."""
    in_time = stays_s.sum(axis=0) <= left_s
    return np.asarray(in_time & (slack(terrain, boxes.places, stays_s) >= 0.0))


def with_short_rests(terrain: Terrain, stops: Stops) -> Stops:
    """The same plan with every rest, one after another, as short as the wells allow."""
    places, stays_s = stops.places[:, None], stops.stays_s[:, None].copy()
    for stop in np.flatnonzero(stops.places[1:-1] != HOVER):
        low_s, high_s = 0.0, float(stays_s[stop, 0])
        for time_s in (low_s, *[None] * HOVER_HALVINGS):
            tried_s = stays_s.copy()
            tried_s[stop] = 0.5 * (low_s + high_s) if time_s is None else time_s
            if slack(terrain, places, tried_s)[0] >= 0.0:
                high_s, stays_s = float(tried_s[stop, 0]), tried_s
            else:
                low_s = float(tried_s[stop, 0])
    return replace(stops, stays_s=stays_s[:, 0])


def _stays(boxes: Boxes, hover_s: Floats, left_s: Floats) -> Floats:
    """Stays (stop, box) of a given total hover, with rests for the other time, within the boxes."""
    stays_s = np.empty_like(boxes.low_s)
    for group, sum_s in ((boxes.hovers, hover_s), (boxes.rests, left_s - hover_s)):
        low_s, width_s = boxes.low_s[group], boxes.high_s[group] - boxes.low_s[group]
        most_s = np.maximum(width_s.sum(axis=0), TINY)
        stays_s[group] = low_s + np.clip((sum_s - low_s.sum(axis=0)) / most_s, 0.0, 1.0) * width_s
    return stays_s
