"""Long missions: hover to the last moment, rest until full, and again; with an upper bound."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import Battery, Stage, Tilted, start, tilted_after, time_to_full
from optuav.physics.roots import bisect_largest
from optuav.search.plans import Stops
from optuav.search.terrain import (
    DESTINATION,
    FIRST_BUILDING,
    HOVER,
    ORIGIN,
    Terrain,
    least_sums,
)

TIME_HALVINGS = 60  # Halvings of a stay
LIKELIEST = 3  # Buildings that are tried


def greedy(terrain: Terrain, rests: int, hovers: int) -> Stops | None:
    """The longest of the plans that return to one building each time; None without any.

    Every hover lasts to the last moment and every rest until the available well is full, except the
    last rest, which is as short as the last hover needs.
    """
    if terrain.stay_current_A[HOVER] >= 0.0 or min(rests, hovers) < 1:
        return None
    most = min(rests, hovers - 1)
    tried = (_by_way_of(terrain, place, most) for place in _likeliest(terrain))
    plans = itertools.chain.from_iterable(tried)
    return max(plans, key=lambda plan: plan.hover_s, default=None)


def _likeliest(terrain: Terrain) -> list[int]:
    """Buildings with the largest share of hovering in a cycle, counting only charge."""
    gained_A, roofs = terrain.stay_current_A[FIRST_BUILDING:], slice(FIRST_BUILDING, None)
    drawn_A, size_As = -terrain.stay_current_A[HOVER], float(terrain.battery.capacity_As)
    figures = terrain.duration_s, _charges(terrain)
    flight_s, flight_As = (figure[HOVER, roofs] + figure[roofs, HOVER] for figure in figures)
    with np.errstate(divide="ignore", invalid="ignore"):
        hover_s = (size_As - flight_As) / drawn_A
        share = hover_s / (hover_s + flight_s + size_As / gained_A)
    able = np.isfinite(flight_s) & (gained_A > 0.0) & (hover_s > 0.0)
    order = np.argsort(np.where(able, -share, np.inf), kind="stable")[: min(LIKELIEST, able.sum())]
    return [FIRST_BUILDING + number for number in order.tolist()]


def _by_way_of(terrain: Terrain, building: int, most: int) -> list[Stops]:
    """Plans of 0 to `most` rests on one building."""
    battery, drawn_A = terrain.battery, -float(terrain.stay_current_A[HOVER])
    gained_A, least_As = float(terrain.stay_current_A[building]), terrain.least_charge_As
    to_hover, home = _stages(terrain, ORIGIN, HOVER), _stages(terrain, HOVER, DESTINATION)
    back, out = _stages(terrain, HOVER, building), _stages(terrain, building, HOVER)
    flights = (ORIGIN, HOVER), (HOVER, DESTINATION), (HOVER, building), (building, HOVER)
    there_s, home_s, back_s, out_s = (float(terrain.duration_s[flight]) for flight in flights)
    charge = Tilted(*map(float, terrain.begin or start(battery)))
    if not math.isfinite(there_s + home_s) or _lowest_As(battery, charge, to_hover) < 0.0:
        return []
    charge, plans, stays_s = tilted_after(battery, charge, *to_hover), list[Stops](), list[float]()
    left_s = terrain.deadline_s - there_s - home_s

    def planned(*last_s: float) -> None:
        if last_s[-1] >= 0.0:
            every_s = np.array([*stays_s, *last_s])
            ways = [HOVER, building] * (len(every_s) // 2)
            places = np.array([ORIGIN, *ways, HOVER, DESTINATION])
            plans.append(Stops(places, every_s, float(every_s[::2].sum()), 0))

    for number in range(most + 1):
        planned(min(_longest_s(battery, charge, drawn_A, home, least_As), left_s))
        hover_s = _longest_s(battery, charge, drawn_A, back, terrain.least_on_landing_As)
        left_s -= hover_s + back_s + out_s
        if number == most or hover_s < 0.0 or left_s < 0.0:
            break
        landed = tilted_after(battery, charge, Stage(-drawn_A, hover_s), *back)
        full_s = float(time_to_full(battery, landed.wells(battery), gained_A))
        rest_s, last_s = 0.0, left_s
        low_s, high_s = 0.0, min(full_s, left_s)
        for middle_s in itertools.chain([high_s], [None] * TIME_HALVINGS):
            # A longer rest allows a longer last hover and leaves less time for it.
            rest_s = 0.5 * (low_s + high_s) if middle_s is None else middle_s
            rested = Stage(gained_A, rest_s), *out
            last_s = -math.inf
            if _lowest_As(battery, landed, rested) >= 0.0:
                again = tilted_after(battery, landed, *rested)
                last_s = _longest_s(battery, again, drawn_A, home, least_As)
            if last_s <= left_s - rest_s:
                if middle_s is not None:
                    break
                low_s = rest_s
            else:
                high_s = rest_s
        planned(hover_s, rest_s, min(last_s, left_s - rest_s))
        charge = tilted_after(battery, landed, Stage(gained_A, full_s), *out)
        stays_s += [hover_s, full_s]
        left_s -= full_s
        if left_s < 0.0 or _lowest_As(battery, landed, (Stage(gained_A, full_s), *out)) < 0.0:
            break
    return plans


def hover_bound_s(terrain: Terrain, rests: int, hovers: int) -> float:
    """A hover time [s] that no plan exceeds, by charge, time, and the longest hover from full.

    Between two hovers lies a rest, with flights no shorter and no cheaper than the least there and
    back; no hover is longer than from full wells at the hover point to the nearest landing.
    """
    drawn_A = -float(terrain.stay_current_A[HOVER])
    if drawn_A <= 0.0:
        return math.inf
    gained_A = max(0.0, float(terrain.stay_current_A[FIRST_BUILDING:].max(initial=0.0)))
    begin = terrain.begin or start(terrain.battery)
    spare_As = float(begin.total_As) - terrain.least_charge_As
    (once_s, trip_s), (once_As, trip_As) = map(_flights, (terrain.duration_s, _charges(terrain)))
    full_s, bound_s = _longest_from_full_s(terrain, drawn_A), -math.inf
    for pieces in range(1, min(hovers, rests + 1) + 1):
        more = pieces - 1
        flight_s = once_s + more * trip_s if more else once_s
        flight_As = once_As + more * trip_As if more else once_As
        time_s = terrain.deadline_s - flight_s
        by_charge_s = (spare_As - flight_As + gained_A * time_s) / (drawn_A + gained_A)
        bound_s = max(bound_s, min(time_s, by_charge_s, pieces * full_s))
    return bound_s


def _flights(figures: Floats) -> tuple[float, float]:
    """Least figures from the origin by the hover point to the destination, and there and back."""
    from_hover, to_hover = least_sums(figures, HOVER), least_sums(figures.T, HOVER)
    trips = from_hover[FIRST_BUILDING:] + to_hover[FIRST_BUILDING:]
    return float(to_hover[ORIGIN] + from_hover[DESTINATION]), float(trips.min(initial=math.inf))


def _charges(terrain: Terrain) -> Floats:
    """Charge that legs draw (start, end) [A s]; inf without a leg."""
    drawn_As = (terrain.stage_currents_A * terrain.stage_durations_s).sum(axis=0)
    return np.where(np.isfinite(terrain.duration_s), drawn_As, np.inf)


def _longest_from_full_s(terrain: Terrain, drawn_A: float) -> float:
    """Longest hover from full wells that ends with y1 ≥ 0 at some landing [s]."""
    battery, reached = terrain.battery, np.isfinite(terrain.duration_s[HOVER])
    landings = terrain.stage_currents_A[:, HOVER], terrain.stage_durations_s[:, HOVER]
    stages = [Stage(-amps, lasts_s) for amps, lasts_s in zip(*landings, strict=True)]
    low_s = np.zeros(len(reached))
    high_s = np.full(len(reached), float(battery.capacity_As) / drawn_A)
    for _ in range(TIME_HALVINGS):
        middle_s = 0.5 * (low_s + high_s)
        end = tilted_after(battery, start(battery), Stage(-drawn_A, middle_s), *stages)
        holds = np.asarray(end.wells(battery).available_As) >= 0.0
        low_s, high_s = np.where(holds, middle_s, low_s), np.where(holds, high_s, middle_s)
    return float(high_s[reached].max(initial=0.0))


def _stages(terrain: Terrain, place: int, end: int) -> tuple[Stage, ...]:
    """The stages of a leg."""
    figures = terrain.stage_currents_A[:, place, end], terrain.stage_durations_s[:, place, end]
    pairs = zip(*figures, strict=True)
    return tuple(Stage(-float(amps), float(lasts_s)) for amps, lasts_s in pairs if lasts_s > 0.0)


def _lowest_As(battery: Battery, charge: Tilted, stages: Sequence[Stage]) -> float:
    """Least y1 at the ends of stages [A s]."""
    lowest_As = math.inf
    for stage in stages:
        charge = tilted_after(battery, charge, stage)
        lowest_As = min(lowest_As, float(charge.wells(battery).available_As))
    return lowest_As


def _longest_s(
    battery: Battery, charge: Tilted, drawn_A: float, way: Sequence[Stage], least_As: float
) -> float:
    """Longest hover that keeps y1 ≥ 0 to the end of a leg and a charge there [s]; −inf for none."""
    drawn_As = -sum(stage.current_A * stage.duration_s for stage in way)
    high_s = (charge.total_As - drawn_As - max(least_As, 0.0)) / drawn_A

    def holds(hover_s: float) -> bool:
        return _lowest_As(battery, charge, (Stage(-drawn_A, hover_s), *way)) >= 0.0

    longest = bisect_largest(holds, float(high_s)) if high_s >= 0.0 else None
    return -math.inf if longest is None else longest[0]
