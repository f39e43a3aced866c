"""What climbs after take-offs and descents to landings cost, which a plan does not count."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from math import ceil, floor, isfinite, nan
from typing import NamedTuple

import numpy as np

from optuav.export import waypoints
from optuav.flight.model import CruisingModel
from optuav.mission import Mission
from optuav.mission.messages import plural
from optuav.network import vehicle
from optuav.network.map_extent import scene
from optuav.network.timeline import Phase, PhaseStage, carry, steps
from optuav.physics.flight import Loads
from optuav.physics.kibam import Wells
from optuav.physics.quantity import TINY, Quantity
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.presentation.numbers import figure, percent, percent_apart, seconds, typed

EMPTY = "cannot be flown: the battery is empty on the way"
REPEAT = "that plan may have other flights, and need more"
MORE = 0.005  # Share added to a reserve, as another plan has another share in its available well
MOST_RESERVE = 0.95


class FlightCharge(NamedTuple):
    """The charge at the ends of a flight as exported, as shares of the capacity."""

    at_take_off: float
    at_landing: float
    dry: bool  # Whether the available well, or the last pack, is empty on the way
    planned: float  # At the landing without climbs, and what the available well then lacks
    start: Wells | None = (
        None  # In the wells at the take-off [A s]; None if full, or of packs in turn
    )


def vertical_legs(mission: Mission, climb_m: float) -> tuple[Loads, Loads]:
    """The climb after a take-off and the descent to a landing."""
    model = mission.flight_model
    return model.leg((0.0, 0.0, climb_m)), model.leg((0.0, 0.0, -climb_m))


def vertical_times_s(mission: Mission, climb_m: float) -> tuple[float, float]:
    """How long climb and descent last [s]; 0 where the UAV cannot fly so."""
    up_s, down_s = (float(leg.duration_s) for leg in vertical_legs(mission, climb_m))
    return (up_s, down_s) if isfinite(up_s + down_s) else (0.0, 0.0)


def with_climbs(
    mission: Mission, phases: Sequence[Phase], climb_m: float, *, on_time: bool
) -> Iterator[Phase]:
    """The phases with a climb and a descent in every flight; on time, rests between are shorter."""
    up, down = (_stages(leg) for leg in vertical_legs(mission, climb_m))
    spent_s = sum(vertical_times_s(mission, climb_m))
    names = [
        *dict.fromkeys(end for phase in phases for end in (phase.start_place, phase.end_place))
    ]
    places = dict(zip(names, map(tuple, scene(mission).positions(names).tolist()), strict=True))
    for rests, group in groupby(phases, key=lambda phase: phase.kind == "rest"):
        flown = [*group]
        if rests or not spent_s:
            yield from (_shorter(phase, spent_s * on_time) if rests else phase for phase in flown)
            continue
        last = len(flown) - 1
        for number, phase in enumerate(flown):
            above_m = climb_m * (number == 0), climb_m * (number == last)
            stages = _from_above(mission, phase, places, above_m)
            begin, end = up if number == 0 else (), down if number == last else ()
            yield replace(phase, stages=(*begin, *stages, *end))


def _from_above(
    mission: Mission,
    phase: Phase,
    places: Mapping[str, tuple[float, ...]],
    above_m: tuple[float, float],
) -> tuple[PhaseStage, ...]:
    """The stages of a phase; those of a leg begin and end so far above its places [m]."""
    if phase.kind != "flight" or phase.edited or not any(above_m):
        return phase.stages
    points_m = [places[phase.start_place], *phase.waypoints_m, places[phase.end_place]]
    at_m = np.array(points_m, dtype=float)
    at_m[[0, -1], 2] += above_m
    ways_m, model = np.diff(at_m, axis=0).tolist(), mission.flight_model
    if isinstance(model, CruisingModel):  # At the speeds of the plan, as its files state them
        speeds_m_s = level_speeds_m_s(mission, phase, places)
        legs = [
            model.leg_at((x, y, z), speed_m_s) if speed_m_s and (x or y) else model.leg((x, y, z))
            for (x, y, z), speed_m_s in zip(ways_m, speeds_m_s, strict=True)
        ]
    else:
        legs = [model.leg((x, y, z)) for x, y, z in ways_m]
    flyable = all(isfinite(float(leg.duration_s)) for leg in legs)
    return tuple(stage for leg in legs for stage in _stages(leg)) if flyable else phase.stages


def level_speeds_m_s(
    mission: Mission, phase: Phase, at_m: Mapping[str, Sequence[float]]
) -> tuple[float, ...]:
    """Horizontal speed of every piece of a leg where the model cruises, else its largest speed."""
    model, pieces = mission.flight_model, len(phase.waypoints_m) + 1
    if phase.kind != "flight":
        return ()
    if phase.edited or not isinstance(model, CruisingModel):
        return (phase.peak_speed_m_s,) * pieces
    if phase.speeds_m_s:
        return tuple(phase.speeds_m_s)
    ends_m = at_m[phase.start_place], *phase.waypoints_m, at_m[phase.end_place]
    ways_m = np.diff(np.array(ends_m, dtype=float), axis=0)
    peaks_m_s = [float(model.leg((x, y, z)).peak_speed_m_s) for x, y, z in ways_m.tolist()]
    lengths_m = np.maximum(np.linalg.norm(ways_m, axis=1), TINY)
    return tuple((peaks_m_s * np.hypot(*ways_m[:, :2].T) / lengths_m).tolist())


def flight_charges(
    mission: Mission, phases: Sequence[Phase], climb_m: float, *, on_time: bool = False
) -> list[FlightCharge]:
    """The charge at the ends of every flight, from a take-off to the next landing, as exported."""
    climbed = [*with_climbs(mission, phases, climb_m, on_time=on_time)]
    size_As = float(mission.pool.capacity_As)
    before, after, dry = [0.0] * len(climbed), [0.0] * len(climbed), [False] * len(climbed)
    planned, lacks = [nan] * len(climbed), [0.0] * len(climbed)
    wells: list[Wells | None] = [None] * len(climbed)
    if mission.battery.takes_turns:
        course = carry(mission, climbed)
        after = [_share(wells.total_As, size_As) for wells in course.wells]
        begin_As = vehicle.start(mission).wells(mission.pool).total_As
        before = [_share(begin_As, size_As), *after[:-1]]
        dry[-1] = course.ended_s is not None
    else:
        for number, pieces in groupby(steps(mission, climbed), key=lambda piece: piece[0]):
            pieces_of_phase = [*pieces]
            wells[number] = pieces_of_phase[0].before
            before[number] = _share(pieces_of_phase[0].before.total_As, size_As)
            after[number] = _share(pieces_of_phase[-1][4].total_As, size_As)
            least_As = min(float(wells.available_As) for *_, wells in pieces_of_phase)
            dry[number] = least_As < -JUDGE_TOLERANCE * size_As
            lacks[number] = max(-least_As / size_As, 0.0)
        for piece in steps(mission, phases):
            planned[piece[0]] = _share(piece[4].total_As, size_As)
    charges = list[FlightCharge]()
    kinds = enumerate(phase.kind == "rest" for phase in climbed)
    for rests, numbered in groupby(kinds, key=lambda pair: pair[1]):
        if not rests:
            first, *_ = numbers = [number for number, _ in numbered]
            *_, last = numbers
            empty, lack = any(dry[n] for n in numbers), max(lacks[n] for n in numbers)
            start = wells[first] if before[first] < 1.0 - JUDGE_TOLERANCE else None
            charges.append(
                FlightCharge(before[first], after[last], empty, planned[last] + lack, start)
            )
    return charges


def climbs(mission: Mission, flights: int, climb_m: float) -> Iterator[str]:
    """Yield what climbs and descents cost beside the plan, and a height that PX4 refuses."""
    time_s, charge_As = (
        flights * float(sum(figures))
        for figures in zip(
            *((leg.duration_s, leg.charge_As) for leg in vertical_legs(mission, climb_m)),
            strict=True,
        )
    )
    if isfinite(time_s + charge_As):
        share = charge_As / float(mission.pool.capacity_As)
        yield (
            f"Every flight climbs {figure(climb_m)} m before its first leg and descends "
            f"{figure(climb_m)} m after its last one. The plan does not count that: "
            f"{seconds(time_s, 1)} and {percent(share)} of the battery in "
            f"{plural(flights, 'flight')}."
        )
    if climb_m < waypoints.LEAST_CLIMB_M:
        yield (
            f"PX4 refuses a take-off to less than {figure(waypoints.LEAST_CLIMB_M)} m, unless its "
            "parameter NAV_ACC_RAD is below 10 m."
        )


def short(mission: Mission, charges: Sequence[FlightCharge], name: str) -> Iterator[str]:
    """Yield why flights cannot be flown as exported: an empty battery, or too little left."""
    least, always = mission.limits.min_soc, mission.limits.keep_soc == "always"
    landings = charges if always else charges[-1:]
    left = min((charge.at_landing for charge in landings), default=1.0)
    begin = f"WARNING: with its climbs, {name}"
    if any(charge.dry for charge in charges):
        yield f"{begin} {EMPTY}.{more_reserve(mission, charges)}"
    elif left < least - JUDGE_TOLERANCE:
        here, reserve = percent_apart(left, least)
        yield (
            f"{begin} lands with {here} of the battery; the reserve is {reserve}. Unless that "
            f"reserve already counts climbs, plan with {_reserve(2.0 * least - left)}; {REPEAT}."
        )


def more_reserve(mission: Mission, charges: Sequence[FlightCharge]) -> str:
    """A sentence on the reserve to plan with, so that no flight is without charge; or empty."""
    needed = max((charge.planned for charge in charges if charge.dry), default=nan)
    share = max(needed + MORE, mission.limits.min_soc)
    if not share <= MOST_RESERVE:  # NaN for packs in turn
        return ""
    early = any(charge.dry for charge in charges[:-1]) and mission.limits.keep_soc != "always"
    always = " and --set limits.keep_soc=always" if early else ""
    return f" Plan with {_reserve(share)}{always}; {REPEAT}."


def deadline_warning(mission: Mission, phases: Sequence[Phase], climb_m: float) -> Iterator[str]:
    """Yield that the deadline passes with climbs."""
    climbed = with_climbs(mission, phases, climb_m, on_time=False)
    time_s, deadline_s = sum(phase.duration_s for phase in climbed), mission.limits.deadline_s
    if time_s > deadline_s * (1.0 + JUDGE_TOLERANCE):
        earlier_s = floor(2.0 * deadline_s - time_s)
        yield f"WARNING: with its climbs, the plan takes {seconds(time_s, 1)}; the deadline is " + (
            f"{figure(deadline_s)} s. Unless that deadline already counts climbs, plan with "
            f"--set limits.deadline_s={earlier_s}."
            if earlier_s > 0
            else f"{figure(deadline_s)} s."
        )


def _reserve(share: float) -> str:
    """The option that states a reserve, rounded up to whole percent."""
    return f"--set limits.min_soc={typed(ceil(100.0 * share - 1e-9) / 100.0)}"


def taken_off_with(charge: FlightCharge) -> str:
    """What the battery must hold at a take-off, in words; nearly all is all."""
    return f"Take off with at least {percent(round(charge.at_take_off, 4))} of the battery."


def _stages(leg: Loads) -> tuple[PhaseStage, ...]:
    """The stages of a leg, which only draws."""
    rows = zip(leg.durations_s, leg.currents_A, leg.powers_W, strict=True)
    return tuple(PhaseStage(float(s), -float(A), -float(W)) for s, A, W in rows)


def _shorter(rest: Phase, spent_s: float) -> Phase:
    """A rest of one stage or several without its last seconds, as far as it lasts."""
    stages = list[PhaseStage]()
    left_s = max(rest.duration_s - spent_s, 0.0)
    for stage in rest.stages:
        stages.append(replace(stage, duration_s=min(stage.duration_s, left_s)))
        left_s -= stages[-1].duration_s
    return replace(rest, stages=tuple(stages))


def _share(total_As: Quantity, size_As: float) -> float:
    """A charge as a share of the capacity, of all packs."""
    return float(np.sum(total_As)) / size_As
