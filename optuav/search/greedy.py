"""Long missions: hover to the last moment, rest until full, and again; with an upper bound."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from optuav.arrays import Floats
from optuav.physics.kibam import Battery, Stage, Tilted, start, tilted_after, time_to_full
from optuav.physics.roots import largest
from optuav.search.branch import Stops
from optuav.search.terrain import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN, Terrain, least_sums

HALVINGS = 60  # Halvings of a bisection
LIKELIEST = 3  # Buildings that are tried


def greedy(
    terrain: Terrain, rests: int, hovers: int, least_at_rests_As: float = -math.inf
) -> Stops | None:
    """The longest of the plans that return to one building each time; None without any.

    Every hover lasts to the last moment and every rest until the available well is full, except the
    last rest, which is as short as the last hover needs. At least `least_at_rests_As` [A s] is left
    at every rest, and the terrain's least charge at the end.
    """
    if terrain.stay_current_A[HOVER] >= 0.0 or min(rests, hovers) < 1:
        return None
    most = min(rests, hovers - 1)
    tried = (_by_way_of(terrain, place, most, least_at_rests_As) for place in _likeliest(terrain))
    plans = itertools.chain.from_iterable(tried)
    return max(plans, key=lambda plan: plan.hover_s, default=None)


def _likeliest(terrain: Terrain) -> list[int]:
    """Buildings with the largest share of hovering in a cycle, counting only charge."""
    gained_A, roofs = terrain.stay_current_A[FIRST_BUILDING:], slice(FIRST_BUILDING, None)
    drawn_A, size_As = -terrain.stay_current_A[HOVER], float(terrain.battery.capacity_As)
    figures = terrain.duration_s, _charges(terrain)
    flight_s, flight_As = (each[HOVER, roofs] + each[roofs, HOVER] for each in figures)
    with np.errstate(divide="ignore", invalid="ignore"):
        hover_s = (size_As - flight_As) / drawn_A
        share = hover_s / (hover_s + flight_s + size_As / gained_A)
    able = np.isfinite(flight_s) & (gained_A > 0.0) & (hover_s > 0.0)
    order = np.argsort(np.where(able, -share, np.inf), kind="stable")[: min(LIKELIEST, able.sum())]
    return [FIRST_BUILDING + number for number in order.tolist()]


def _by_way_of(terrain: Terrain, building: int, most: int, least_at_rests_As: float) -> list[Stops]:
    """Plans of 0 to `most` rests on one building."""
    battery, drawn_A = terrain.battery, -float(terrain.stay_current_A[HOVER])
    gained_A, least_As = float(terrain.stay_current_A[building]), terrain.least_charge_As
    flights = (ORIGIN, HOVER), (HOVER, DESTINATION), (HOVER, building), (building, HOVER)
    to_hover, home, back, out = (_stages(terrain, *flight) for flight in flights)
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

    def last_s(landed: Tilted, rest_s: float) -> float:
        """Longest last hover after a rest; a longer rest allows more, and leaves less time."""
        rested = Stage(gained_A, rest_s), *out
        if _lowest_As(battery, landed, rested) < 0.0:
            return -math.inf
        again = tilted_after(battery, landed, *rested)
        return _longest_s(battery, again, drawn_A, home, least_As)

    for number in range(most + 1):
        planned(min(_longest_s(battery, charge, drawn_A, home, least_As), left_s))
        hover_s = _longest_s(battery, charge, drawn_A, back, least_at_rests_As)
        left_s -= hover_s + back_s + out_s
        if number == most or hover_s < 0.0 or left_s < 0.0:
            break
        landed = tilted_after(battery, charge, Stage(-drawn_A, hover_s), *back)
        full_s = float(time_to_full(battery, landed.wells(battery), gained_A))
        low_s, rest_s = 0.0, min(full_s, left_s)
        if last_s(landed, high_s := rest_s) > left_s - rest_s:
            for _ in range(HALVINGS):
                rest_s = 0.5 * (low_s + high_s)
                short = last_s(landed, rest_s) <= left_s - rest_s
                low_s, high_s = (rest_s, high_s) if short else (low_s, rest_s)
        planned(hover_s, rest_s, min(last_s(landed, rest_s), left_s - rest_s))
        full = Stage(gained_A, full_s), *out
        charge = tilted_after(battery, landed, *full)
        stays_s += [hover_s, full_s]
        left_s -= full_s
        if left_s < 0.0 or _lowest_As(battery, landed, full) < 0.0:
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
    flights = [_flights(figures) for figures in (terrain.duration_s, _charges(terrain))]
    full_s, bounds_s = _longest_from_full_s(terrain, drawn_A), [-math.inf]
    for more in range(min(hovers, rests + 1)):
        flight_s, flight_As = (once + (more * trip if more else 0.0) for once, trip in flights)
        time_s = terrain.deadline_s - flight_s
        by_charge_s = (spare_As - flight_As + gained_A * time_s) / (drawn_A + gained_A)
        bounds_s.append(min(time_s, by_charge_s, (more + 1) * full_s))
    return max(bounds_s)


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
    stages = [*map(Stage, -terrain.stage_currents_A[:, HOVER], terrain.stage_durations_s[:, HOVER])]
    low_s = np.zeros(len(reached))
    high_s = np.full(len(reached), float(battery.capacity_As) / drawn_A)
    for _ in range(HALVINGS):
        middle_s = 0.5 * (low_s + high_s)
        end = tilted_after(battery, start(battery), Stage(-drawn_A, middle_s), *stages)
        holds = np.asarray(end.wells(battery).available_As) >= 0.0
        low_s, high_s = np.where(holds, middle_s, low_s), np.where(holds, high_s, middle_s)
    return float(high_s[reached].max(initial=0.0))


def _stages(terrain: Terrain, place: int, end: int) -> tuple[Stage, ...]:
    """The stages of a leg."""
    figures = -terrain.stage_currents_A[:, place, end], terrain.stage_durations_s[:, place, end]
    stages = map(Stage, *(column.tolist() for column in figures))
    return tuple(stage for stage in stages if stage.duration_s > 0.0)


def _lowest_As(battery: Battery, charge: Tilted, stages: Sequence[Stage]) -> float:
    """Least y1 at the ends of stages [A s]."""
    _, *ends = itertools.accumulate(stages, partial(tilted_after, battery), initial=charge)
    return min((float(end.wells(battery).available_As) for end in ends), default=math.inf)


def _longest_s(
    battery: Battery, charge: Tilted, drawn_A: float, way: Sequence[Stage], least_As: float
) -> float:
    """Longest hover that keeps y1 ≥ 0 to the end of a leg and a charge there [s]; −inf for none."""
    drawn_As = -sum(stage.current_A * stage.duration_s for stage in way)
    high_s = (charge.total_As - drawn_As - max(least_As, 0.0)) / drawn_A

    def holds(hover_s: float) -> bool:
        return _lowest_As(battery, charge, (Stage(-drawn_A, hover_s), *way)) >= 0.0

    longest = largest(holds, float(high_s)) if high_s >= 0.0 else None
    return -math.inf if longest is None else longest[0]
