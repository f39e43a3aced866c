"""A plan simulated again from its mission: its events, its state of charge and its trace."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, NoPlanError
from optuav.judge.limits import broken_limits, contradicted_verdict, impossible, mismatches
from optuav.judge.timeline import Itinerary, Phase, Site, Stage, motion, moves, phases
from optuav.judge.wells import METHODS, Course, Method, Stretch, pooled, scheduled, wells_at
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics.charging import holding_current
from optuav.physics.kibam import Battery
from optuav.plan import Plan
from optuav.plan.trace import Event, Trace

if TYPE_CHECKING:
    import pandas

POINTS = 65
"""Moments of a stretch in a trace, its ends among them."""


@dataclass(frozen=True)
class Replay:
    """A simulated plan.

    Parameters
    ----------
    subject
        What was simulated.
    method
        How the wells were followed.
    phases
        The phases, computed again; empty where the mission cannot be flown at all.
    course
        The packs over the phases; None where the mission cannot be flown at all.
    soc
        State of charge at the end by perspective [-].
    events
        What happens and what is wrong, in order of time.
    """

    subject: Plan | Itinerary
    method: Method
    phases: tuple[Phase, ...]
    course: Course | None
    soc: Mapping[str, float]
    events: tuple[Event, ...]

    @property
    def mission(self) -> Mission:
        """The mission in which it was simulated."""
        return self.subject.mission

    @property
    def violations(self) -> tuple[Event, ...]:
        """The events because of which the plan cannot be flown."""
        return tuple(event for event in self.events if event.violation)

    @property
    def flyable(self) -> bool:
        """Whether the plan keeps every limit at every moment, and its figures are right."""
        return not self.violations

    @property
    def mission_time_s(self) -> float:
        """T [s]; 0 where the mission cannot be flown at all."""
        return self.phases[-1].end_s if self.phases else 0.0

    def time_s(self, kind: str) -> float:
        """Total duration [s] of the phases of a kind: ``"flight"``, ``"hover"`` or ``"rest"``."""
        return sum((phase.duration_s for phase in self.phases if phase.kind == kind), 0.0)

    def first_s(self, kind: str) -> float | None:
        """When an event of a kind first happens [s]; None if none does."""
        return next((event.time_s for event in self.events if event.kind == kind), None)

    @cached_property
    def trace(self) -> Trace:
        """The mission over time: position, speed, currents, wells; computed on first use.

        Raises
        ------
        NoPlanError
            If nothing is flown.
        """
        if self.course is None or not any(phase.duration_s for phase in self.phases):
            raise NoPlanError("there is no table: nothing is flown")
        return _trace(self.mission, self.phases, self.course, self.method)

    def to_frame(self) -> pandas.DataFrame:
        """The mission over time, one row per moment; needs pandas."""
        return self.trace.to_frame()


def replay(plan: Plan | Itinerary, *, method: Method = "exact") -> Replay:
    """Simulate a plan from its mission.

    Of the plan only the places, their order and the times of the stays are read, and what the user
    stated in a graph: figures of legs, and power at places. Everything else is computed again, and
    every figure that the plan states is compared with it.

    Parameters
    ----------
    plan
        A plan, or an itinerary.
    method
        ``"exact"``, the closed form of the battery model; or ``"solve_ivp"``, its differential
        equations integrated by SciPy (packs used as one only).

    Returns
    -------
    Replay
        Its verdict `flyable` allows charge to miss its limits by 1e-6 of the capacity, and other
        figures by 1e-6 of the limit.

    Raises
    ------
    InputError
        If there is no such method, or it does not suit the schedule of the packs.
    NoPlanError
        If there is no plan to simulate.

    Examples
    --------
    >>> import optuav
    >>> from optuav.judge import Stop
    >>> paper = optuav.load("paper")
    >>> direct = optuav.Itinerary(paper, (Stop("hover", "hover", 688.8),))
    >>> found = optuav.replay(direct)
    >>> found.flyable
    False
    >>> print(found.violations[0])
        660.26 s  the available well runs dry: -9425.68, at least 0 A s
    """
    if method not in METHODS:
        raise InputError([Fault("method", repr(method), f"one of {', '.join(METHODS)}")])
    if isinstance(plan, Plan):
        plan.route  # noqa: B018  (raises where there is no plan)
    mission, site, planned = plan.mission, Site(plan.mission), tuple(moves(plan))
    events = list(impossible(site, planned))
    if events:
        return Replay(plan, method, (), None, {}, tuple(events))
    flown = phases(site, planned)
    if not mission.battery.takes_turns:
        course = pooled(mission, flown, method)
    elif method == "exact":
        course = scheduled(mission, flown)
    else:
        words = f'exact: {method} goes with battery.schedule = "pooled" only'
        raise InputError([Fault("method", repr(method), words)])
    drawn = energies(mission, flown)
    left_As = sum(float(pack.total_As) for pack in course.ends[-1])
    share = np.array([left_As / float(vehicle.pool(mission).capacity_As)])
    levels = drawn.states_of_charge(drawn.starts_J[-1:], share)
    soc = {name: float(level[0]) for name, level in levels.items()}
    events = [*course.events, *broken_limits(mission, flown, soc["battery"])]
    if isinstance(plan, Plan):
        events += mismatches(plan, flown, course.ends, soc)
        events += contradicted_verdict(plan, events)
    events.sort(key=lambda event: event.time_s)
    return Replay(plan, method, flown, course, soc, tuple(events))


class Energies(NamedTuple):
    """Power drawn in flight, drawn in hover, and gained otherwise (stage, 3), and its integrals.

    Gained is what is received in hover, and net at rest. The integrals (stage + 1, 3) begin every
    stage and end the last. The full battery has E_1, E_2 and E_0 [J] at the voltages of flight, of
    hover, and nominally.
    """

    gains_W: Floats
    starts_J: Floats
    batteries_J: tuple[float, float, float]

    def states_of_charge(self, energies_J: Floats, share: Floats) -> dict[str, Floats]:
        """State of charge by perspective [-].

        Of (moment, 3) integrals of `gains_W` [J], and the share (y1 + y2)/B over all packs [-].
        """
        flight_J, hover_J, gained_J = np.moveaxis(energies_J, -1, 0)
        E_1, E_2, E_0 = self.batteries_J
        return {
            "battery": share,
            "energy": 1.0 - (flight_J + hover_J - gained_J) / E_0,
            "adjusted": 1.0 - flight_J / E_1 - hover_J / E_2 + gained_J / E_0,
        }


def energies(mission: Mission, flown: Sequence[Phase]) -> Energies:
    """Energies over the phases of a plan."""
    stages = [(phase.kind, stage) for phase in flown for stage in phase.stages]
    gains_W = np.array(
        [_gains_W(kind, stage.drawn[1], stage.received[1]) for kind, stage in stages]
    )
    durations_s = np.array([stage.duration_s for _, stage in stages])
    starts_J = np.concatenate([np.zeros((1, 3)), np.cumsum(durations_s[:, None] * gains_W, axis=0)])
    flown_As = sum(
        stage.duration_s * stage.drawn.current_A for kind, stage in stages if kind == "flight"
    )
    hover, given = vehicle.hover_load(mission), mission.battery
    B = float(vehicle.pool(mission).capacity_As)
    E_0 = B * given.nominal_voltage_V
    E_1 = given.flight_energy_J or (B * starts_J[-1, 0] / flown_As if flown_As else E_0)
    E_2 = given.hover_energy_J or (B * hover.power_W / hover.current_A if hover.current_A else E_0)
    return Energies(gains_W, starts_J, (float(E_1), float(E_2), E_0))


def _gains_W(kind: str, drawn_W: float, received_W: float) -> tuple[float, float, float]:
    if kind == "flight":
        return drawn_W, 0.0, received_W
    return (0.0, drawn_W, received_W) if kind == "hover" else (0.0, 0.0, received_W - drawn_W)


def _trace(mission: Mission, flown: Sequence[Phase], course: Course, method: Method) -> Trace:
    drawn = energies(mission, flown)
    stages = [stage for phase in flown for stage in phase.stages]
    pieces = [
        _piece(mission, flown[each.phase], stages[each.stage], each, course.pack, drawn, method)
        for each in course.stretches
        if each.duration_s > 0.0
    ]
    columns = {name: np.concatenate([getattr(each, name) for each in pieces]) for name in COLUMNS}
    soc = {name: np.concatenate([each.soc[name] for each in pieces]) for name in pieces[0].soc}
    return Trace(**columns, soc=soc)


COLUMNS = tuple(name for name in Trace.__dataclass_fields__ if name != "soc")


def _piece(
    mission: Mission,
    phase: Phase,
    stage: Stage,
    stretch: Stretch,
    pack: Battery,
    drawn: Energies,
    method: Method,
) -> Trace:
    """The rows of a stretch."""
    passed_s = np.linspace(0.0, stretch.duration_s, POINTS)
    followed = [None if stretch.held else current_A for current_A in stretch.currents_A]
    wells = [
        wells_at(method, pack, before, current_A, passed_s)
        for before, current_A in zip(stretch.before, followed, strict=True)
    ]
    currents_A = [
        np.asarray(holding_current(pack, each)) if current_A is None else np.full(POINTS, current_A)
        for each, current_A in zip(wells, followed, strict=True)
    ]
    available_As = np.stack([each.available_As for each in wells], axis=1)
    bound_As = np.stack([each.bound_As for each in wells], axis=1)
    share = (available_As + bound_As).sum(axis=1) / (len(wells) * pack.capacity_As)
    since_stage_s = stretch.start_s - stage.start_s + passed_s
    energies_J = (
        drawn.starts_J[stretch.stage] + since_stage_s[:, None] * drawn.gains_W[stretch.stage]
    )
    drawn_A, drawn_W = stage.drawn
    voltage_V = drawn_W / drawn_A if drawn_A else mission.battery.nominal_voltage_V
    return Trace(
        time_s=stretch.start_s + passed_s,
        **motion(mission, phase, _since_phase(phase, stage, stretch))._asdict(),
        kind=np.full(POINTS, phase.kind),
        stage=np.full(POINTS, stage.name),
        phase=np.full(POINTS, stretch.phase),
        start_place=np.full(POINTS, phase.start.name),
        end_place=np.full(POINTS, phase.end.name),
        current_A=sum(currents_A, np.zeros(POINTS)),
        power_W=np.full(POINTS, stage.power_W),
        received_power_W=np.full(POINTS, float(stage.received.power_W)),
        voltage_V=np.full(POINTS, voltage_V),
        available_As=available_As,
        bound_As=bound_As,
        soc=drawn.states_of_charge(energies_J, share),
    )


def _since_phase(phase: Phase, stage: Stage, stretch: Stretch) -> Floats:
    """Moments of a stretch since its phase began [s]: at the end of a stage the next one begins."""
    begun_s = 0.0
    for each in phase.stages:
        if each is stage:
            break
        begun_s += each.duration_s
    last_s = np.nextafter(begun_s + stage.duration_s, 0.0)
    start_s = begun_s + (stretch.start_s - stage.start_s)
    return np.clip(start_s + np.linspace(0.0, stretch.duration_s, POINTS), begun_s, last_s)
