"""Fleets simulated again: wells of every drone, who covers when, and who rests where."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from optuav.judge.course import TOLERANCE
from optuav.judge.replay import Judged, Replay, replay
from optuav.network import vehicle
from optuav.plan import Plan
from optuav.plan.trace import Event

Interval = tuple[float, float]


@dataclass(frozen=True)
class FleetReplay(Judged):
    """A fleet that was simulated."""

    courses: tuple[Replay, ...]  # Between exchanges of packs; equal ones are simulated once
    longest_gap_s: float  # With fewer hovering drones than requested
    events: tuple[Event, ...]  # Faults, in order of time

    def _repr_html_(self) -> str:
        return self._html(f"{self.verdict}: {len(self.courses)} courses")

    def __repr__(self) -> str:
        return f"<FleetReplay of {len(self.courses)} courses: {self.verdict}>"


def replay_fleet(
    plans: Sequence[Plan],
    offsets_s: Sequence[float],
    *,
    wanted: int,
    allowed_gap_s: float,
    until_s: float,
    places: int,
    place_s: float,
) -> FleetReplay:
    """Simulate the courses of drones that take off at their offsets [s].

    As many as wanted must hover at once, from their arrival until a moment [s], but for an allowed
    gap [s]. Each occupies one of the places to rest at for some time [s] after a landing.
    """
    replays = {id(plan): replay(plan) for plan in {id(plan): plan for plan in plans}.values()}
    courses = tuple(replays[id(plan)] for plan in plans)
    events, hovers, stays = list[Event](), list[Interval](), list[Interval]()
    for number, (course, offset_s) in enumerate(zip(courses, offsets_s, strict=True)):
        words = f"drone {number + 1}: "
        for event in course.violations:
            events.append(Event(event.kind, offset_s + event.time_s, words + event.words))
        assert course.course is not None
        least = course.mission.limits.min_soc - TOLERANCE
        size_As = float(vehicle.pool(course.mission).capacity_As)
        for phase, (wells,) in zip(course.phases, course.course.ends, strict=True):
            begin_s, end_s = offset_s + phase.start_s, offset_s + phase.end_s
            if phase.kind == "hover":
                hovers.append((begin_s, end_s))
            elif phase.kind == "flight" and phase.start.name == "hover":
                stays.append((end_s, end_s + place_s))
                if float(wells.total_As) < least * size_As:
                    low = f"{words}too little charge is left at a landing"
                    events.append(Event("state of charge", end_s, low))
    first_s = sorted(begin_s for begin_s, _ in hovers)[wanted - 1 :][:1] or [until_s]
    gap_s, at_s = longest_gap(hovers, wanted, first_s[0], until_s)
    if gap_s > allowed_gap_s + TOLERANCE * until_s:
        events.append(Event("gap", at_s, f"fewer than {wanted} hover for {gap_s:.2f} s"))
    most, at_s = busiest(stays, TOLERANCE * until_s)
    if most > places:
        events.append(Event("place", at_s, f"{most} drones rest at {places} places"))
    events.sort(key=lambda event: event.time_s)
    return FleetReplay(courses, gap_s, tuple(events))


def longest_gap(
    intervals: Iterable[Interval], wanted: int, from_s: float, until_s: float
) -> Interval:
    """Longest time with fewer than so many intervals at once [s], and when it begins [s]."""
    changes = Counter({until_s: 0})  # Changes at one moment count together: touching is no gap
    for begin_s, end_s in intervals:
        changes[begin_s] += 1
        changes[end_s] -= 1
    longest, count, since = (0.0, from_s), 0, from_s
    for moment_s in sorted(changes):
        time_s = min(max(moment_s, from_s), until_s)
        if count < wanted:
            longest = max(longest, (time_s - since, since))
        before, count = count, count + changes[moment_s]
        since = time_s if count < wanted <= before else since
    return longest


def busiest(intervals: Iterable[Interval], rounding_s: float) -> tuple[int, float]:
    """Largest number of intervals at once, and when it is first reached [s]."""
    steps = [change for begin, end in intervals for change in ((begin, 1), (end - rounding_s, -1))]
    most, count, at_s = 0, 0, 0.0
    for time_s, change in sorted(steps):
        count += change
        if count > most:
            most, at_s = count, time_s
    return most, at_s
