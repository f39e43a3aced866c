"""Fleets simulated again: wells of every drone, which one covers when, and where each rests."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from optuav.judge.replay import Judged, Replay, replay
from optuav.mission.messages import plural
from optuav.plan import Plan
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.trace import FlightEvent
from optuav.presentation.blocks import Block, Heading
from optuav.presentation.numbers import figure, fixed, seconds

Interval = tuple[float, float]


@dataclass(frozen=True)
class FleetReplay(Judged):
    """A fleet that was simulated."""

    drones: int
    courses: tuple[Replay, ...]  # Between exchanges of packs; equal ones are simulated once
    longest_gap_s: float  # With fewer hovering drones than requested
    events: tuple[FlightEvent, ...]  # Faults, in order of time

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict and the events."""
        every = "all " if self.flyable and self.drones > 1 else ""
        yield Heading(f"{self.verdict}: {every}{plural(self.drones, 'drone')}", good=self.flyable)
        yield from self.event_blocks()

    def __repr__(self) -> str:
        return f"<FleetReplay of {plural(self.drones, 'drone')}: {self.verdict}>"


def replay_fleet(
    plans: Sequence[Plan],
    offsets_s: Sequence[float],
    *,
    drones: int,
    share: float,
    until_s: float,
    places: int,
    overlap_s: float = 0.0,
    place_s: float = 0.0,
    beams: int | None = None,
    apart_m: float = 0.0,
    excused: Interval | None = None,
) -> FleetReplay:
    """Simulate the courses of drones that take off at their offsets [s].

    Until a moment [s], so many must hover on average as the share says, not counting the overlap
    [s] at the end of each hover, and its whole part at every moment; below 1, gaps are no longer
    than those of a ring that starts in a fixed rhythm. Each drone occupies one of the places to
    rest at for some time [s] after a landing. A beam, if these are counted, lights one drone that
    hovers or occupies a place. Drones whose hovers overlap or touch are so far apart [m]. Nobody
    needs to hover in an interval [s] that is excused.
    """
    replays = {id(plan): replay(plan) for plan in {id(plan): plan for plan in plans}.values()}
    courses = tuple(replays[id(plan)] for plan in plans)
    events, hovers, stays, lit = (
        list[FlightEvent](),
        list[Interval](),
        list[Interval](),
        list[Interval](),
    )
    for number, (course, offset_s) in enumerate(zip(courses, offsets_s, strict=True)):
        words = f"drone {number + 1}: "
        for event in course.violations:
            events.append(FlightEvent(event.kind, offset_s + event.time_s, words + event.words))
        assert course.course is not None
        least = course.mission.limits.min_soc - JUDGE_TOLERANCE
        size_As = float(course.mission.pool.capacity_As)
        for phase, (wells,) in zip(course.phases, course.course.ends, strict=True):
            begin_s, end_s = offset_s + phase.start_s, offset_s + phase.end_s
            if phase.kind == "hover":
                hovers.append((begin_s, end_s))
                lit += hovers[-1:] * any(stage.received.current_A > 0.0 for stage in phase.stages)
            elif phase.kind == "flight" and phase.start.name == "hover":
                stays.append((end_s, end_s + place_s))
                if float(wells.total_As) < least * size_As:
                    low = f"{words}too little charge is left at a landing"
                    events.append(FlightEvent("state of charge", end_s, low))
    rounding_s = JUDGE_TOLERANCE * until_s
    if excused is not None:
        hovers.append((excused[0] - overlap_s, excused[1] + overlap_s))
    gap_s, faults = _coverage_faults(sorted(hovers), share, overlap_s, until_s, rounding_s)
    events += faults
    events += _too_close(courses, offsets_s, apart_m, rounding_s)
    most, at_s = busiest(stays, rounding_s)
    if most > places:
        events.append(FlightEvent("place", at_s, f"{most} drones rest at {places} places"))
    most, at_s = busiest([*lit, *stays], rounding_s)
    if beams is not None and most > beams:
        events.append(FlightEvent("beam", at_s, f"{most} drones are lit by {beams} beams"))
    events.sort(key=lambda event: event.time_s)
    return FleetReplay(drones, courses, gap_s, tuple(events))


def _too_close(
    replays: Sequence[Replay], offsets_s: Sequence[float], apart_m: float, rounding_s: float
) -> Iterator[FlightEvent]:
    """Yield handovers at which two drones hover too close to each other."""
    hovers = sorted(
        (offset_s + phase.start_s, offset_s + phase.end_s, number, phase.start.position_m)
        for number, (course, offset_s) in enumerate(zip(replays, offsets_s, strict=True), start=1)
        for phase in course.phases
        if phase.kind == "hover"
    )
    for (_, end_s, one, at_m), (begin_s, _, other, next_m) in pairwise(hovers):
        away_m = math.dist(at_m, next_m)
        if begin_s <= end_s + rounding_s and one != other and away_m < apart_m - JUDGE_TOLERANCE:
            words = (
                f"drones {one} and {other} hover {fixed(away_m)} m apart, less than "
                f"{figure(apart_m)} m"
            )
            yield FlightEvent("separation", begin_s, words)


def _coverage_faults(
    hovers: Sequence[Interval], share: float, overlap_s: float, until_s: float, rounding_s: float
) -> tuple[float, list[FlightEvent]]:
    """The longest gap [s], and faults of hovers in order of their starts."""
    wanted, faults = max(1, math.floor(share * (1.0 + JUDGE_TOLERANCE))), list[FlightEvent]()
    first_s = hovers[wanted - 1][0] if wanted <= len(hovers) else until_s
    counted = [(begin_s, end_s - overlap_s) for begin_s, end_s in hovers]
    shortest_s = min((end_s - begin_s for begin_s, end_s in counted), default=0.0)
    allowed_s = max(shortest_s * (1.0 / share - 1.0) - overlap_s, 0.0) + rounding_s
    gap_s, at_s = longest_gap(hovers, wanted, first_s, until_s)
    if gap_s > allowed_s:
        faults.append(FlightEvent("gap", at_s, f"fewer than {wanted} hover for {seconds(gap_s)}"))
    elif share * (1.0 + JUDGE_TOLERANCE) >= 1.0:
        # The last hover hands over to nobody
        short_s, at_s = longest_gap(counted, wanted, first_s, min(until_s, hovers[-1][0]))
        if short_s > rounding_s:
            words = (
                f"hovers overlap by {seconds(overlap_s - short_s)}, less than {figure(overlap_s)} s"
            )
            faults.append(FlightEvent("overlap", at_s, words))
    passed_s = hovers[-1][0] - hovers[0][0] if hovers else 0.0
    if passed_s > 0.0:
        mean = math.fsum(end_s - begin_s for begin_s, end_s in counted[:-1]) / passed_s
        if mean < share * (1.0 - JUDGE_TOLERANCE) - rounding_s / passed_s:
            words = f"{figure(mean)} hover on average, less than {figure(share)}"
            faults.append(FlightEvent("share", hovers[0][0], words))
    return gap_s, faults


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
