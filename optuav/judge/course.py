"""The charge in the packs and the energies over the phases of a plan, and its trace over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.judge.timeline import Phase, motion
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics import kibam, packs
from optuav.physics.charging import held, holding_current
from optuav.physics.kibam import Battery, Wells
from optuav.plan.trace import Event, Trace

TOLERANCE = 1e-6
"""Share of the capacity, of a limit or of a figure by which it may be missed [-]."""

FULL = 1e-12
"""Share of the capacity by which rounding may leave a full well short [-]."""

POINTS = 65
"""Moments of a stretch in a trace, its ends among them."""


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

    def wells(self, pack: Battery, passed_s: Floats) -> list[Wells]:
        """Wells of every pack [A s] at moments since the start [s].

        A well that is held full stays as it is: the charger makes up for what seeps away.
        """
        if not self.held:
            stages = [kibam.Stage(current_A, passed_s) for current_A in self.currents_A]
            return [kibam.step(pack, *each) for each in zip(self.before, stages, strict=True)]
        after = [held(pack, each, passed_s) for each in self.before]
        return [Wells(np.full_like(passed_s, each[0]), each[1]) for each in after]


@dataclass(frozen=True)
class Course:
    """The packs over a plan; packs used as one count as one."""

    pack: Battery  # One of them
    # In order of time; they end early where no pack is left to fly on.
    stretches: tuple[Stretch, ...]
    ends: tuple[tuple[Wells, ...], ...]  # Wells of every pack at the end of every phase [A s]
    events: tuple[Event, ...]  # When packs are empty or full


def pooled(mission: Mission, phases: Sequence[Phase]) -> Course:
    """All packs as one battery, whose wells may pass empty and full.

    Where charging tapers it takes no more than keeps it full.
    """
    pool, tapers = vehicle.pool(mission), mission.battery.charging == "taper"
    wells, stretches, ends, number = pool.full, list[Stretch](), list[tuple[Wells, ...]](), 0
    for place, phase in enumerate(phases):
        for stage in phase.stages:
            current_A, start_s, steady_s = stage.net.current_A, stage.start_s, stage.duration_s
            if tapers and current_A > 0.0:
                steady_s = min(_filled_s(pool, wells, current_A), steady_s)
            parts = [(steady_s, False)]
            if steady_s < stage.duration_s:
                parts.append((stage.duration_s - steady_s, True))
            for part in parts:
                each = Stretch(place, number, start_s, part[0], (current_A,), (wells,), part[1])
                ((available_As, bound_As),) = each.wells(pool, np.array([part[0]]))
                wells = Wells(float(available_As[0]), float(bound_As[0]))
                stretches.append(each)
                start_s += part[0]
            number += 1
        ends.append((wells,))
    return Course(pool, tuple(stretches), tuple(ends), tuple(_passed(pool, stretches, wells)))


def _filled_s(pool: Battery, wells: Wells, current_A: float) -> float:
    """How long charging goes on at constant current, until y1 is full [s].

    Rounding may leave y1 short of full or past it: then the current decides whether it rises.
    """
    room_As = float(pool.full.available_As - wells.available_As)
    full = room_As <= FULL * float(pool.capacity_As)
    if full and holding_current(pool, wells) <= current_A:
        return 0.0
    return float(kibam.time_to_full(pool, wells, current_A))


def _passed(pool: Battery, stretches: Sequence[Stretch], last: Wells) -> Iterator[Event]:
    """When the available well first runs dry and is first driven past full, if ever.

    y1 leaves its bounds within a stretch only if it is outside at the end, so the ends decide
    whether it does, and the first stretch that ends outside is searched for the moment.
    """
    ends_As = np.array([*(each.before[0].available_As for each in stretches[1:]), last[0]])
    full_As, slack_As = float(pool.full.available_As), TOLERANCE * float(pool.capacity_As)
    dry, over = "the available well runs dry", "charging drives the available well past full"
    for kind, crossing_s, beyond, limit_As, worst_As, words in (
        ("empty", kibam.time_to_empty, ends_As < -slack_As, 0.0, ends_As.min(), dry),
        ("full", kibam.time_to_full, ends_As > full_As + slack_As, full_As, ends_As.max(), over),
    ):
        if beyond.any():
            found = stretches[int(beyond.argmax())]
            passed_s = float(crossing_s(pool, found.before[0], found.currents_A[0]))
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
        for carried in flown.job(
            packs.JobStage(float(each.drawn[0]), float(each.received[0]), each.duration_s)
            for each in phase.stages
        ):
            start_s, duration_s = float(carried.start_s[0]), float(carried.duration_s[0])
            if duration_s > 0.0:
                stage = first + int(np.searchsorted(stage_ends_s, start_s + 0.5 * duration_s))
                currents_A = tuple(map(float, carried.currents_A[0]))
                stretches.append(Stretch(place, stage, start_s, duration_s, currents_A, before))
            before = _each(carried.wells)
            for state, ended, number in (
                ("empty", carried.emptied[0], carried.carrier[0]),
                ("full", carried.filled[0], carried.served[0]),
            ):
                if ended:
                    words = f"pack {number + 1} is {state}"
                    events.append(
                        Event(f"pack {state}", start_s + duration_s, words, violation=False)
                    )
        ends.append(before)
        first += len(phase.stages)
    if flown.exhausted[0]:
        end_s = float(flown.clock_s[0])
        missing_As = sum(
            float(stage.drawn.current_A)
            * min(max(stage.start_s + stage.duration_s - end_s, 0.0), stage.duration_s)
            for phase in phases
            for stage in phase.stages
        )
        if missing_As > TOLERANCE * float(vehicle.pool(mission).capacity_As):
            words = "no pack is left to fly on"
            events.append(Event("empty", end_s, words, -missing_As, 0.0, "A s"))
    return Course(flown.pack, tuple(stretches), tuple(ends), tuple(events))


def _each(wells: Wells) -> tuple[Wells, ...]:
    """Wells of every pack."""
    return tuple(Wells(float(y1), float(y2)) for y1, y2 in zip(*(w[0] for w in wells), strict=True))


class Energies:
    """Energies drawn in flight, drawn in hover, and gained otherwise, over the stages of a plan.

    Gained is what is received in hover, and net at rest. The full battery has E_1, E_2 and E_0 [J]
    at the voltages of flight, of hover, and nominally.
    """

    def __init__(self, mission: Mission, flown: Sequence[Phase]) -> None:
        stages = [(phase.kind, each) for phase in flown for each in phase.stages]
        kind = np.array([name for name, _ in stages])
        flows_W = [(each.drawn.power_W, each.received.power_W) for _, each in stages]
        drawn_W, received_W = np.array(flows_W, dtype=float).T
        in_flight_W, in_hover_W, at_rest_W = (
            np.where(kind == name, drawn_W, 0.0) for name in ("flight", "hover", "rest")
        )
        self.gains_W = np.stack([in_flight_W, in_hover_W, received_W - at_rest_W], axis=1)
        gains_J = np.array([[each.duration_s] for _, each in stages]) * self.gains_W
        # (stage + 1, 3): before every stage and after the last.
        self.starts_J = np.concatenate([np.zeros((1, 3)), np.cumsum(gains_J, axis=0)])
        flown_As = sum(s.duration_s * s.drawn.current_A for name, s in stages if name == "flight")
        hover, given = vehicle.hover_load(mission), mission.battery
        B = float(vehicle.pool(mission).capacity_As)
        self.E_0 = B * given.nominal_voltage_V
        mean_V = self.starts_J[-1, 0] / flown_As if flown_As else given.nominal_voltage_V
        self.E_1 = given.flight_energy_J or B * mean_V
        hover_V = hover.power_W / hover.current_A if hover.current_A else given.nominal_voltage_V
        self.E_2 = given.hover_energy_J or B * float(hover_V)

    def soc(self, stage: int, since_s: Floats, share: Floats) -> dict[str, Floats]:
        """State of charge by perspective [-] at moments since a stage began [s].

        The `share` is (y1 + y2)/B over all packs [-].
        """
        energies_J = self.starts_J[stage] + since_s[:, None] * self.gains_W[stage]
        flight_J, hover_J, gained_J = np.moveaxis(energies_J, -1, 0)
        return {
            "battery": share,
            "energy": 1.0 - (flight_J + hover_J - gained_J) / self.E_0,
            "adjusted": 1.0 - flight_J / self.E_1 - hover_J / self.E_2 + gained_J / self.E_0,
        }


def trace(mission: Mission, flown: Sequence[Phase], course: Course) -> Trace:
    """The table over time of phases and packs; some phase takes time."""
    energies = Energies(mission, flown)
    pieces = [
        _piece(mission, flown, course.pack, each, energies)
        for each in course.stretches
        if each.duration_s > 0.0
    ]
    names = [name for name in Trace.__dataclass_fields__ if name != "soc"]
    columns = {name: np.concatenate([getattr(each, name) for each in pieces]) for name in names}
    soc = {name: np.concatenate([each.soc[name] for each in pieces]) for name in pieces[0].soc}
    return Trace(**columns, soc=soc)


def _piece(
    mission: Mission, flown: Sequence[Phase], pack: Battery, stretch: Stretch, energies: Energies
) -> Trace:
    """The rows of a stretch."""
    phase = flown[stretch.phase]
    first = sum(len(each.stages) for each in flown[: stretch.phase])
    stage = phase.stages[stretch.stage - first]
    passed_s = np.linspace(0.0, stretch.duration_s, POINTS)
    since_s = stretch.start_s - stage.start_s + passed_s
    # At the end of a stage the next one begins.
    begun_s = sum(each.duration_s for each in phase.stages[: stretch.stage - first])
    last_s = np.nextafter(begun_s + stage.duration_s, 0.0)
    wells = stretch.wells(pack, passed_s)
    currents_A = [np.full(POINTS, each) for each in stretch.currents_A]
    if stretch.held:
        currents_A = [np.asarray(holding_current(pack, each)) for each in wells]
    available_As, bound_As = (np.stack(level, axis=1) for level in zip(*wells, strict=True))
    share = (available_As + bound_As).sum(axis=1) / (len(wells) * pack.capacity_As)
    drawn_A, drawn_W = stage.drawn
    return Trace(
        time_s=stretch.start_s + passed_s,
        **motion(mission, phase, np.clip(begun_s + since_s, begun_s, last_s)),
        kind=np.full(POINTS, phase.kind),
        stage=np.full(POINTS, stage.name),
        phase=np.full(POINTS, stretch.phase),
        start_place=np.full(POINTS, phase.start.name),
        end_place=np.full(POINTS, phase.end.name),
        current_A=sum(currents_A, np.zeros(POINTS)),
        power_W=np.full(POINTS, stage.net.power_W),
        received_power_W=np.full(POINTS, float(stage.received.power_W)),
        voltage_V=np.full(
            POINTS, drawn_W / drawn_A if drawn_A else mission.battery.nominal_voltage_V
        ),
        available_As=available_As,
        bound_As=bound_As,
        soc=energies.soc(stretch.stage, since_s, share),
    )
