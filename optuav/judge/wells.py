"""The charge in the packs over the phases of a plan: packs used as one, or under a schedule."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from optuav.arrays import Floats
from optuav.judge.timeline import Phase, Stage
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics import kibam, packs
from optuav.physics.charging import held, holding_current
from optuav.physics.kibam import Battery, Wells
from optuav.plan.trace import Event

Method = Literal["exact", "solve_ivp"]
METHODS: tuple[Method, ...] = get_args(Method)

TOLERANCE = 1e-6
"""Share of the capacity, of a limit or of a figure by which it may be missed [-]."""

RELATIVE, ABSOLUTE = 1e-11, 1e-12
"""Error that `solve_ivp` may make in a step, relative and as a share of the capacity [-]."""

FULL = 1e-12
"""Share of the capacity by which rounding may leave a full well short [-]."""


def wells_at(
    method: Method, pool: Battery, wells: Wells, current_A: float | None, passed_s: Floats
) -> Wells:
    """Wells [A s] at moments since the start [s], which rise from 0.

    Without a current the available well is held full: the charger makes up for what seeps away.
    """
    if method == "exact" and current_A is None:
        available_As, bound_As = held(pool, wells, passed_s)
        return Wells(np.full_like(passed_s, available_As), bound_As)
    if method == "exact":
        return kibam.step(pool, wells, kibam.Stage(current_A, passed_s))
    end_s = float(passed_s[-1])
    # Moments of a stay of no time coincide; SciPy's must not.
    shares, place = np.unique(passed_s / (end_s or 1.0), return_inverse=True)
    _, levels = _integrated(pool, wells, current_A, end_s, shares)
    return Wells(*levels[:, place])


def crossing_s(
    method: Method,
    pool: Battery,
    wells: Wells,
    current_A: float,
    duration_s: float,
    *,
    full: bool,
) -> float:
    """When y1 rises above ωB, or else falls below 0 [s]; ``inf`` if not within the duration."""
    if method == "exact":
        crossing = kibam.time_to_full if full else kibam.time_to_empty
        moment_s = float(crossing(pool, wells, current_A))
        return moment_s if moment_s <= duration_s else np.inf
    level_As, direction = (float(pool.full.available_As), 1.0) if full else (0.0, -1.0)

    def beyond(_: float, y: Floats) -> float:
        return float(y[0] - level_As)

    beyond.direction = direction  # type: ignore[attr-defined]
    moments, _ = _integrated(pool, wells, current_A, duration_s, None, beyond)
    return float(moments[0]) * duration_s if len(moments) else np.inf


def _integrated(
    pool: Battery,
    wells: Wells,
    current_A: float | None,
    end_s: float,
    shares: Floats | None,
    *events: Callable[[float, Floats], float],
) -> tuple[Floats, Floats]:
    """(11)-(12) of the paper by SciPy: when an event comes, and the wells, by share of a duration.

    Over seconds instead of shares LSODA does not end where there are next to none.
    """
    from scipy.integrate import solve_ivp

    share, rate = pool.available_fraction, pool.flow_rate_per_s

    def slope(_: float, y: Floats) -> list[float]:
        seeping_A = rate * (y[0] / share - y[1] / (1.0 - share))
        net_A = 0.0 if current_A is None else current_A - seeping_A
        return [end_s * net_A, end_s * seeping_A]

    found = solve_ivp(
        slope,
        (0.0, 1.0),
        np.array(wells, dtype=float),
        method="LSODA",
        t_eval=shares,
        events=events,
        rtol=RELATIVE,
        atol=ABSOLUTE * pool.capacity_As,
    )
    return np.concatenate([np.array([]), *(found.t_events or ())]), found.y


class Stretch(NamedTuple):
    """A stretch of time in which nothing changes, with the wells of every pack before it.

    It has the numbers of its phase, and of its stage counted over all phases. Currents are positive
    while charging; a pack that is held full is offered its current and takes less.
    """

    phase: int
    stage: int
    start_s: float
    duration_s: float
    currents_A: tuple[float, ...]
    before: tuple[Wells, ...]
    held: bool = False


@dataclass(frozen=True)
class Course:
    """The packs over a plan; packs used as one count as one."""

    pack: Battery  # One of them
    # In order of time; they end early where no pack is left to fly on.
    stretches: tuple[Stretch, ...]
    ends: tuple[tuple[Wells, ...], ...]  # Wells of every pack at the end of every phase [A s]
    events: tuple[Event, ...]  # When packs are empty or full


def pooled(mission: Mission, phases: Sequence[Phase], method: Method) -> Course:
    """All packs as one battery, whose wells may pass empty and full.

    Where charging tapers it takes no more than keeps it full.
    """
    pool, tapers = vehicle.pool(mission), mission.battery.charging == "taper"
    wells, stretches, ends = pool.full, list[Stretch](), list[tuple[Wells, ...]]()
    number = 0
    for place, phase in enumerate(phases):
        for stage in phase.stages:
            current_A, start_s, duration_s = stage.current_A, stage.start_s, stage.duration_s
            steady_s = duration_s
            if tapers and current_A > 0.0:
                steady_s = _steady_s(pool, wells, current_A, duration_s, method)
            parts = [(steady_s, False)]
            if steady_s < duration_s:
                parts.append((duration_s - steady_s, True))
            for part_s, is_held in parts:
                stretches.append(
                    Stretch(place, number, start_s, part_s, (current_A,), (wells,), is_held)
                )
                moments_s = np.array([0.0, part_s])
                after = wells_at(method, pool, wells, None if is_held else current_A, moments_s)
                wells = Wells(float(after.available_As[-1]), float(after.bound_As[-1]))
                start_s += part_s
            number += 1
        ends.append((wells,))
    events = tuple(_passed(pool, stretches, wells, method))
    return Course(pool, tuple(stretches), tuple(ends), events)


def _steady_s(
    pool: Battery, wells: Wells, current_A: float, duration_s: float, method: Method
) -> float:
    """How long a stage goes on at constant current, until y1 is full [s].

    Rounding may leave y1 short of full or past it: then the current decides whether it rises.
    """
    room_As = float(pool.full.available_As - wells.available_As)
    full = room_As <= FULL * float(pool.capacity_As)
    if full and holding_current(pool, wells) <= current_A:
        return 0.0
    return min(crossing_s(method, pool, wells, current_A, duration_s, full=True), duration_s)


def _passed(
    pool: Battery, stretches: Sequence[Stretch], last: Wells, method: Method
) -> Iterator[Event]:
    """When the available well first runs dry and is first driven past full, if ever.

    y1 leaves its bounds within a stretch only if it is outside at the end, so the ends decide
    whether it does, and the first stretch that ends outside is searched for the moment.
    """
    ends_As = np.array([*(each.before[0].available_As for each in stretches[1:]), last[0]])
    full_As, slack_As = float(pool.full.available_As), TOLERANCE * float(pool.capacity_As)
    dry, over = "the available well runs dry", "charging drives the available well past full"
    for kind, beyond, limit_As, worst_As, words in (
        ("empty", ends_As < -slack_As, 0.0, ends_As.min(), dry),
        ("full", ends_As > full_As + slack_As, full_As, ends_As.max(), over),
    ):
        if beyond.any():
            found = stretches[int(beyond.argmax())]
            ((current_A,), (before,)) = found.currents_A, found.before
            passed_s = crossing_s(
                method, pool, before, current_A, found.duration_s, full=kind == "full"
            )
            time_s = found.start_s + min(passed_s, found.duration_s)
            yield Event(kind, time_s, words, float(worst_As), limit_As, "A s")


def scheduled(mission: Mission, phases: Sequence[Phase]) -> Course:
    """Packs that carry the phases under the mission's schedule; a phase is a job."""
    given = mission.battery
    pack = Battery(given.capacity_As, given.available_fraction, given.flow_rate_per_s)
    flown = packs.Packs(pack, given.packs, given.schedule, given.period_s)
    stretches, ends, events = list[Stretch](), list[tuple[Wells, ...]](), list[Event]()
    first = 0
    for place, phase in enumerate(phases):
        before = _each(flown.wells)
        stage_ends_s = np.array([stage.start_s + stage.duration_s for stage in phase.stages])
        for carried in flown.job(map(_job_stage, phase.stages)):
            start_s, duration_s = float(carried.start_s[0]), float(carried.duration_s[0])
            if duration_s > 0.0:
                stage = first + int(np.searchsorted(stage_ends_s, start_s + 0.5 * duration_s))
                currents_A = tuple(map(float, carried.currents_A[0]))
                stretches.append(Stretch(place, stage, start_s, duration_s, currents_A, before))
            before = _each(carried.wells)
            events += _reached(carried)
        ends.append(before)
        first += len(phase.stages)
    if flown.exhausted[0]:
        events += _exhausted(mission, phases, float(flown.clock_s[0]))
    return Course(flown.pack, tuple(stretches), tuple(ends), tuple(events))


def _job_stage(stage: Stage) -> packs.JobStage:
    drawn_A, received_A = stage.drawn.current_A, stage.received.current_A
    return packs.JobStage(float(drawn_A), float(received_A), stage.duration_s)


def _each(wells: Wells) -> tuple[Wells, ...]:
    """Wells of every pack."""
    return tuple(Wells(float(y1), float(y2)) for y1, y2 in zip(*(w[0] for w in wells), strict=True))


def _reached(carried: packs.Stretch) -> Iterator[Event]:
    """A pack that hands over because it is empty, or takes no more because it is full."""
    end_s = float(carried.start_s[0] + carried.duration_s[0])
    for state, ended, pack in (
        ("empty", carried.emptied[0], carried.carrier[0]),
        ("full", carried.filled[0], carried.served[0]),
    ):
        if ended:
            yield Event(f"pack {state}", end_s, f"pack {pack + 1} is {state}", violation=False)


def _exhausted(mission: Mission, phases: Sequence[Phase], end_s: float) -> Iterator[Event]:
    """The event that the last pack is empty before everything is drawn that the plan needs."""
    missing_As = sum(
        float(stage.drawn.current_A)
        * min(max(stage.start_s + stage.duration_s - end_s, 0.0), stage.duration_s)
        for phase in phases
        for stage in phase.stages
    )
    if missing_As > TOLERANCE * float(vehicle.pool(mission).capacity_As):
        yield Event("empty", end_s, "no pack is left to fly on", -missing_As, 0.0, "A s")
