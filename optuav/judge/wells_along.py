"""The charge in the packs and the energies over the phases of a plan, and its trace over time."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats, Number
from optuav.judge.timeline import SimulatedPhase, motion
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics import kibam, packs
from optuav.physics.kibam import Battery, Wells, held, holding_current
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.trace import FlightEvent, Trace

FULL = 1e-12  # Share of the capacity that rounding may cost a full well [-]

POINTS = 65  # Moments of a stretch in a trace, its ends among them


class WellStretch(NamedTuple):
    """A stretch of time without changes, with the wells of every pack before it.

    It has the numbers of its phase, and of its stage in that. Currents are positive while charging;
    a pack that is held full is offered its current and takes less.
    """

    phase: int
    stage: int
    start_s: float
    duration_s: float
    currents_A: tuple[float, ...]
    before: tuple[Wells, ...]
    held: bool = False

    @property
    def end_s(self) -> float:
        """End, counted from take-off [s]."""
        return self.start_s + self.duration_s

    def wells(self, pack: Battery, passed_s: Number) -> list[Wells]:
        """Wells of every pack [A s] at moments since the start [s].

        A well that is held full stays as it is: the charger makes up for what seeps away.
        """
        if not self.held:
            stages = [kibam.Stage(current_A, passed_s) for current_A in self.currents_A]
            return [kibam.step(pack, *pair) for pair in zip(self.before, stages, strict=True)]
        after = [held(pack, wells, passed_s) for wells in self.before]
        return [Wells(np.full_like(passed_s, level[0]), level[1]) for level in after]


class Course(NamedTuple):
    """The packs over a plan; packs used as one count as one."""

    pack: Battery  # One of them
    # In order of time; they end early where no pack is left to fly on.
    stretches: tuple[WellStretch, ...]
    ends: tuple[tuple[Wells, ...], ...]  # Wells of every pack at the end of every phase [A s]
    events: tuple[FlightEvent, ...]  # When packs are empty or full


def pooled(mission: Mission, phases: Sequence[SimulatedPhase]) -> Course:
    """All packs as one battery, which may pass empty and full; tapered, it is kept full at most."""
    pool, tapers = mission.pool, mission.battery.charging == "taper"
    wells = Wells(*map(float, vehicle.start(mission).wells(pool)))
    stretches, ends = list[WellStretch](), list[tuple[Wells, ...]]()
    for place, phase in enumerate(phases):
        for number, stage in enumerate(phase.stages):
            current_A, start_s, steady_s = stage.net.current_A, stage.start_s, stage.duration_s
            if tapers and current_A > 0.0:
                steady_s = min(_filled_s(pool, wells, current_A), steady_s)
            parts = [(steady_s, False), (stage.duration_s - steady_s, True)]
            for lasts_s, full in parts if steady_s < stage.duration_s else parts[:1]:
                stretch = WellStretch(place, number, start_s, lasts_s, (current_A,), (wells,), full)
                (after,) = stretch.wells(pool, lasts_s)
                wells = Wells(*map(float, after))
                stretches.append(stretch)
                start_s += lasts_s
        ends.append((wells,))
    # y1 leaves its bounds within a stretch only if it is outside at the end, so the ends decide
    # whether it does, and the first stretch that ends outside is searched for the moment.
    ends_As = np.array([*(stretch.before[0].available_As for stretch in stretches[1:]), wells[0]])
    full_As, slack_As = float(pool.full.available_As), JUDGE_TOLERANCE * float(pool.capacity_As)
    dry, over = "the available well runs dry", "charging drives the available well past full"
    events = list[FlightEvent]()
    for kind, crossing_s, beyond, limit_As, worst, words in (
        ("empty", kibam.time_to_empty, ends_As < -slack_As, 0.0, ends_As.argmin(), dry),
        ("full", kibam.time_to_full, ends_As > full_As + slack_As, full_As, ends_As.argmax(), over),
    ):
        if beyond.any():
            farthest, first = stretches[int(worst)], stretches[int(beyond.argmax())]
            passed_s = float(crossing_s(pool, first.before[0], first.currents_A[0]))
            time_s, worst_s = first.start_s + min(passed_s, first.duration_s), farthest.end_s
            figures = float(ends_As[worst]), limit_As, "A s"
            events.append(FlightEvent(kind, time_s, words, *figures, value_s=worst_s))
    return Course(pool, tuple(stretches), tuple(ends), tuple(events))


def _filled_s(pool: Battery, wells: Wells, current_A: float) -> float:
    """Return how long charging at constant current lasts, until y1 is full but for rounding [s]."""
    room_As = float(pool.full.available_As - wells.available_As)
    full = room_As <= FULL * float(pool.capacity_As)
    if full and holding_current(pool, wells) <= current_A:
        return 0.0
    return float(kibam.time_to_full(pool, wells, current_A))


def scheduled(mission: Mission, phases: Sequence[SimulatedPhase]) -> Course:
    """Packs that carry the phases under the mission's schedule; a phase is a job."""
    battery = mission.battery
    begin = vehicle.start(mission).wells(mission.pool)
    begin_of_pack = Wells(*(float(well) / battery.packs for well in begin))
    flown = packs.Packs(
        mission.pack, battery.packs, battery.schedule, battery.period_s, begin_of_pack
    )
    stretches, ends, events = list[WellStretch](), list[tuple[Wells, ...]](), list[FlightEvent]()
    for place, phase in enumerate(phases):
        before = _each(flown.wells)
        stage_ends_s = np.array([stage.end_s for stage in phase.stages])
        job = (
            packs.JobStage(float(stage.drawn[0]), float(stage.received[0]), stage.duration_s)
            for stage in phase.stages
        )
        for carried in flown.stretches(job):
            start_s, duration_s = float(carried.start_s[0]), float(carried.duration_s[0])
            if duration_s > 0.0:
                stage = int(np.searchsorted(stage_ends_s, start_s + 0.5 * duration_s))
                currents_A = tuple(map(float, carried.currents_A[0]))
                stretches.append(WellStretch(place, stage, start_s, duration_s, currents_A, before))
            before = _each(carried.wells)
            for state, ended, number in (
                ("empty", carried.emptied[0], carried.carrier[0]),
                ("full", carried.filled[0], carried.served[0]),
            ):
                if ended:
                    kind, words = f"pack {state}", f"pack {number + 1} is {state}"
                    events.append(FlightEvent(kind, start_s + duration_s, words, violation=False))
        ends.append(before)
    if flown.exhausted[0]:
        end_s, missing_As = float(flown.clock_s[0]), 0.0
        for simulated in (stage for phase in phases for stage in phase.stages):
            unflown_s = min(max(simulated.end_s - end_s, 0.0), simulated.duration_s)
            missing_As += float(simulated.drawn.current_A) * unflown_s
        if missing_As > JUDGE_TOLERANCE * float(mission.pool.capacity_As):
            words = "no pack is left to fly on"
            events.append(FlightEvent("empty", end_s, words, -missing_As, 0.0, "A s"))
    return Course(flown.pack, tuple(stretches), tuple(ends), tuple(events))


def _each(wells: Wells) -> tuple[Wells, ...]:
    """Wells of every pack."""
    return tuple(Wells(float(y1), float(y2)) for y1, y2 in zip(*(w[0] for w in wells), strict=True))


def soc(
    mission: Mission, flown: Sequence[SimulatedPhase], time_s: Floats, share: Floats
) -> dict[str, Floats]:
    """State of charge by perspective [-] at moments [s]; the share is (y1 + y2)/B [-].

    Energies are drawn in flight, drawn in hover, or gained: received in hover, and net at rest. The
    full battery has E_1, E_2 and E_0 [J] at the voltages of flight, of hover, and nominally.
    """
    times_s, energies_J, flown_As = [0.0], [(0.0, 0.0, 0.0)], 0.0
    for kind, stage in ((phase.kind, stage) for phase in flown for stage in phase.stages):
        flows = (stage.drawn, stage.received)
        drawn_J, received_J = (stage.duration_s * float(flow.power_W) for flow in flows)
        in_flight, in_hover = drawn_J * (kind == "flight"), drawn_J * (kind == "hover")
        energies_J.append((in_flight, in_hover, received_J - drawn_J * (kind == "rest")))
        flown_As += stage.duration_s * stage.drawn.current_A * (kind == "flight")
        times_s.append(stage.end_s)
    total_J = np.cumsum(energies_J, axis=0).T
    flight_J, hover_J, gained_J = (np.interp(time_s, times_s, energy_J) for energy_J in total_J)
    (hover_A, hover_W), battery = vehicle.hover_load(mission), mission.battery
    nominal_V, B = battery.nominal_voltage_V, float(mission.pool.capacity_As)
    E_0, begin = B * nominal_V, float(vehicle.start(mission).total_As) / B
    E_1 = battery.flight_energy_J or (B * (total_J[0, -1] / flown_As) if flown_As else E_0)
    E_2 = battery.hover_energy_J or (B * float(hover_W / hover_A) if hover_A else E_0)
    return {
        "battery": share,
        "energy": begin - (flight_J + hover_J - gained_J) / E_0,
        "adjusted": begin - flight_J / E_1 - hover_J / E_2 + gained_J / E_0,
    }


def trace(mission: Mission, flown: Sequence[SimulatedPhase], course: Course) -> Trace:
    """The table over time of phases and packs; some phase takes time."""
    lasting = [stretch for stretch in course.stretches if stretch.duration_s > 0.0]
    pieces = [_piece(mission, flown[stretch.phase], course.pack, stretch) for stretch in lasting]
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    levels_As = columns["available_As"] + columns["bound_As"]
    share = levels_As.mean(axis=1) / course.pack.capacity_As
    return Trace(**columns, soc=soc(mission, flown, columns["time_s"], share))


def _piece(
    mission: Mission, phase: SimulatedPhase, pack: Battery, stretch: WellStretch
) -> dict[str, Any]:
    """The columns of a stretch."""
    stage = phase.stages[stretch.stage]
    passed_s = np.linspace(0.0, stretch.duration_s, POINTS)
    # At the end of a stage the next one begins.
    begun_s = sum(stage_before.duration_s for stage_before in phase.stages[: stretch.stage])
    last_s = np.nextafter(begun_s + stage.duration_s, 0.0)
    since_s = np.clip(begun_s + (stretch.start_s - stage.start_s) + passed_s, begun_s, last_s)
    wells = stretch.wells(pack, passed_s)
    currents_A = [np.full(POINTS, current_A) for current_A in stretch.currents_A]
    if stretch.held:
        currents_A = [np.asarray(holding_current(pack, well)) for well in wells]
    available_As, bound_As = (np.stack(level, axis=1) for level in zip(*wells, strict=True))
    drawn_A, drawn_W = stage.drawn
    same = {
        **{"kind": phase.kind, "stage": stage.name, "phase": stretch.phase},
        **{"start_place": phase.start.name, "end_place": phase.end.name},
        **{"power_W": stage.net.power_W, "received_power_W": float(stage.received.power_W)},
        "voltage_V": drawn_W / drawn_A if drawn_A else mission.battery.nominal_voltage_V,
    }
    return {
        **{name: np.full(POINTS, value) for name, value in same.items()},
        **motion(mission, phase, since_s),
        **{"available_As": available_As, "bound_As": bound_As},
        "time_s": stretch.start_s + passed_s,
        "current_A": sum(currents_A, np.zeros(POINTS)),
    }
