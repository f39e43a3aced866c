"""A plan simulated again from its mission, by code that knows nothing of how it was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, NoPlanError
from optuav.judge import table
from optuav.judge.course import Course, pooled, scheduled
from optuav.judge.energies import energies, states_of_charge
from optuav.judge.figures import contradicted_verdict, mismatches
from optuav.judge.itinerary import Itinerary, moves
from optuav.judge.limits import impossible, kept
from optuav.judge.phases import Phase, Site, phases
from optuav.judge.wells import FOLLOWERS, Method
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics.kibam import Wells
from optuav.plan import Plan
from optuav.plan.trace import Event, Trace

if TYPE_CHECKING:
    import pandas


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
        The phases as they will be; empty where the mission cannot be flown at all.
    course
        What the phases do to the packs; None where the mission cannot be flown at all.
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
        """The events that keep the plan from being flown as it stands."""
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
        """The mission over time: position, speed, currents, wells; worked out when asked for."""
        if self.course is None:
            raise NoPlanError("there is no table: nothing is flown")
        return table.trace(self.mission, self.phases, self.course, FOLLOWERS[self.method])

    def to_frame(self) -> pandas.DataFrame:
        """The mission over time, one row a moment; needs pandas."""
        return self.trace.to_frame()


def replay(plan: Plan | Itinerary, *, method: Method = "exact") -> Replay:
    """Simulate a plan from its mission.

    Of the plan only the places, their order and the times of the stays are taken, and what the user
    stated in a graph: figures of legs, sight and power at places. All else is worked out again, and
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
    What happens. Its verdict `flyable` allows charge to miss its limits by 1e-6 of the capacity,
    and other figures by 1e-6 of the limit.

    Raises
    ------
    InputError
        If there is no such method, or it does not go with the schedule of the packs.
    NoPlanError
        If there is no plan to simulate.
    """
    if method not in FOLLOWERS:
        raise InputError([Fault("method", repr(method), f"one of {', '.join(FOLLOWERS)}")])
    if isinstance(plan, Plan):
        plan.route  # noqa: B018  (raises where there is no plan)
    site, asked = Site(plan.mission), moves(plan)
    events = list(impossible(site, asked))
    if events:
        return Replay(plan, method, (), None, {}, tuple(events))
    flown = phases(site, asked)
    course = _course(plan.mission, flown, method)
    soc = _soc_at_end(plan.mission, flown, course.ends[-1])
    events = [*course.events, *kept(plan.mission, flown, soc["battery"])]
    if isinstance(plan, Plan):
        events += mismatches(plan, flown, course.ends, soc)
        events += contradicted_verdict(plan, events)
    events.sort(key=lambda event: event.time_s)
    return Replay(plan, method, flown, course, soc, tuple(events))


def _course(mission: Mission, flown: tuple[Phase, ...], method: Method) -> Course:
    if not mission.battery.takes_turns:
        return pooled(mission, flown, FOLLOWERS[method])
    if method != "exact":
        words = f'exact: {method} goes with battery.schedule = "pooled" only'
        raise InputError([Fault("method", repr(method), words)])
    return scheduled(mission, flown)


def _soc_at_end(
    mission: Mission, flown: tuple[Phase, ...], end: tuple[Wells, ...]
) -> dict[str, float]:
    told = energies(mission, flown)
    left_As = sum(float(pack.total_As) for pack in end)
    share: Floats = np.array([left_As / float(vehicle.pool(mission).capacity_As)])
    found = states_of_charge(told.batteries_J, told.starts_J[-1:], share)
    return {name: float(level[0]) for name, level in found.items()}
