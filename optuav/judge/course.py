"""What the phases of a plan do to the battery: packs used as one, or under a schedule."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.judge.phases import Phase, Stage
from optuav.judge.tolerance import TOLERANCE
from optuav.judge.wells import Follower
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.timeline import full_packs
from optuav.physics.charging import holding_current
from optuav.physics.kibam import Battery, Wells
from optuav.physics.packs import JobStage
from optuav.physics.packs import Stretch as Carried
from optuav.plan.trace import Event

RUNS_DRY = "the available well runs dry"
PAST_FULL = "charging drives the available well past full"
NO_PACK = "no pack is left to fly on"
FULL = 1e-12
"""Share of the capacity by which rounding may leave a full well short [-]."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of time in which nothing changes.

    Parameters
    ----------
    phase
        Number of its phase.
    stage
        Number of its stage, counted over all phases.
    start_s, duration_s
        When, counted from take-off, and for how long [s].
    currents_A
        Into every pack [A], positive while charging; what is offered to one that is held full.
    before
        Wells of every pack at its start [A s].
    held
        Whether the packs, used as one, are held full.
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
    """The packs over a plan; packs used as one count as one.

    Parameters
    ----------
    pack
        One of them.
    stretches
        In order of time; they end early where no pack is left to fly on.
    ends
        Wells of every pack at the end of every phase [A s].
    events
        When packs are empty or full.
    """

    pack: Battery
    stretches: tuple[Stretch, ...]
    ends: tuple[tuple[Wells, ...], ...]
    events: tuple[Event, ...]


def pooled(mission: Mission, phases: Sequence[Phase], follower: Follower) -> Course:
    """All packs as one battery, which takes what it is given, beyond empty and full too.

    Where charging tapers it takes no more than keeps it full.
    """
    pool, tapers = vehicle.pool(mission), mission.battery.charging == "taper"
    wells, stretches, ends = pool.full, list[Stretch](), list[tuple[Wells, ...]]()
    number = 0
    for place, phase in enumerate(phases):
        for stage in phase.stages:
            parts: tuple[tuple[float, bool], ...] = ((stage.duration_s, False),)
            if tapers and stage.current_A > 0.0:
                parts = _steady_and_held(pool, wells, stage, follower)
            start_s = stage.start_s
            for duration_s, held in parts:
                stretch = Stretch(
                    place, number, start_s, duration_s, (stage.current_A,), (wells,), held
                )
                wells = _after(pool, stretch, follower)
                stretches.append(stretch)
                start_s += duration_s
            number += 1
        ends.append((wells,))
    events = tuple(_passed(pool, stretches, wells, follower))
    return Course(pool, tuple(stretches), tuple(ends), events)


def _steady_and_held(
    pool: Battery, wells: Wells, stage: Stage, follower: Follower
) -> tuple[tuple[float, bool], ...]:
    """The part of a stage at constant current, until y1 is full, and the part that holds it.

    Rounding may leave y1 short of full, or past it: then the current tells whether it rises.
    """
    room_As = float(pool.full.available_As - wells.available_As)
    full = room_As <= FULL * float(pool.capacity_As)
    if full and holding_current(pool, wells) <= stage.current_A:
        return ((0.0, False), (stage.duration_s, True))
    full_s = follower.full_s(pool, wells, stage.current_A, stage.duration_s)
    if full_s >= stage.duration_s:
        return ((stage.duration_s, False),)
    return ((full_s, False), (stage.duration_s - full_s, True))


def _after(pool: Battery, stretch: Stretch, follower: Follower) -> Wells:
    """Wells at the end of a stretch of packs used as one."""
    moments_s = np.array([0.0, stretch.duration_s])
    ((current_A,), (before,)) = stretch.currents_A, stretch.before
    if stretch.held:
        after = follower.held(pool, before, moments_s)
    else:
        after = follower.at(pool, before, current_A, moments_s)
    return Wells(float(after.available_As[-1]), float(after.bound_As[-1]))


def _passed(
    pool: Battery, stretches: Sequence[Stretch], last: Wells, follower: Follower
) -> Iterator[Event]:
    """When the available well first runs dry and is first driven past full, if ever.

    y1 leaves its bounds within a stretch only if it is outside at the end, so the ends tell whether
    it does, and the stretch that ends outside first is searched for the moment.
    """
    ends_As = np.array([*(each.before[0].available_As for each in stretches[1:]), last[0]])
    full_As, slack_As = float(pool.full.available_As), TOLERANCE * float(pool.capacity_As)
    for kind, beyond, limit_As, worst_As, moment_s, words in (
        ("empty", ends_As < -slack_As, 0.0, ends_As.min(), follower.empty_s, RUNS_DRY),
        ("full", ends_As > full_As + slack_As, full_As, ends_As.max(), follower.full_s, PAST_FULL),
    ):
        if beyond.any():
            found = stretches[int(beyond.argmax())]
            ((current_A,), (before,)) = found.currents_A, found.before
            passed_s = moment_s(pool, before, current_A, found.duration_s)
            time_s = found.start_s + min(passed_s, found.duration_s)
            yield Event(kind, time_s, words, float(worst_As), limit_As, "A s")


def scheduled(mission: Mission, phases: Sequence[Phase]) -> Course:
    """Packs that carry the phases under the mission's schedule, a phase being a job."""
    flown = full_packs(mission)
    stretches, ends, events = list[Stretch](), list[tuple[Wells, ...]](), list[Event]()
    first = 0
    for place, phase in enumerate(phases):
        before = _each(flown.wells)
        stage_ends_s = np.array([stage.start_s + stage.duration_s for stage in phase.stages])
        for carried in flown.job(map(_load, phase.stages)):
            start_s, duration_s = float(carried.start_s[0]), float(carried.duration_s[0])
            if duration_s > 0.0:
                stage = int(np.searchsorted(stage_ends_s, start_s + 0.5 * duration_s))
                currents_A = tuple(map(float, carried.currents_A[0]))
                stretches.append(
                    Stretch(place, first + stage, start_s, duration_s, currents_A, before)
                )
            before = _each(carried.wells)
            events += _reached(carried)
        ends.append(before)
        first += len(phase.stages)
    if flown.exhausted[0]:
        events += _exhausted(mission, phases, float(flown.clock_s[0]))
    return Course(flown.pack, tuple(stretches), tuple(ends), tuple(events))


def _load(stage: Stage) -> JobStage:
    drawn_A, received_A = stage.drawn.current_A, stage.received.current_A
    return JobStage(float(drawn_A), float(received_A), stage.duration_s)


def _each(wells: Wells) -> tuple[Wells, ...]:
    """Wells of every pack."""
    return tuple(Wells(float(y1), float(y2)) for y1, y2 in zip(*(w[0] for w in wells), strict=True))


def _reached(carried: Carried) -> Iterator[Event]:
    """A pack that hands over because it is empty, or takes no more because it is full."""
    end_s = float(carried.start_s[0] + carried.duration_s[0])
    for kind, ended, pack in (
        ("pack empty", carried.emptied[0], carried.carrier[0]),
        ("pack full", carried.filled[0], carried.served[0]),
    ):
        if ended:
            words = f"pack {int(pack) + 1} is {kind.removeprefix('pack ')}"
            yield Event(kind, end_s, words, violation=False)


def _exhausted(mission: Mission, phases: Sequence[Phase], end_s: float) -> Iterator[Event]:
    """That the last pack is empty before everything is drawn that the plan needs."""
    stages = [stage for phase in phases for stage in phase.stages]
    missing_As = sum(
        float(stage.drawn.current_A)
        * min(max(stage.start_s + stage.duration_s - end_s, 0.0), stage.duration_s)
        for stage in stages
    )
    if missing_As > TOLERANCE * float(vehicle.pool(mission).capacity_As):
        yield Event("empty", end_s, NO_PACK, -missing_As, 0.0, "A s")
