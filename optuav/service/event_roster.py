"""The roster of an event as data: its hovers, the plans of its drones, and what the judge says."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Literal, NamedTuple, TypedDict, TypeVar

from optuav.errors import printable
from optuav.judge.fleets import FleetReplay, replay_fleet
from optuav.mission.messages import plural
from optuav.network.timeline import Phase
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Heading
from optuav.presentation.numbers import coordinates, figure, fixed, seconds
from optuav.service.calm_air import calm_facts
from optuav.service.fleet import repeated, turns_table
from optuav.service.roster import DroneRing
from optuav.studies.results import Pictures, Result

Some = TypeVar("Some", bound="EventRoster")
AT_ONE_POINT = "at some handovers both drones are at one hover point: keep them apart by hand"
EVENT_HOVER_UNITS = {"drone": "-", "start_s": "s", "hover_s": "s", "rest_s": "s"}
MOMENT_ROUNDING_S = 1e-6  # Difference of two moments of a roster that is rounding
AT_LEAST = "in turns from one roof, charge requires at least"


class EventHover(TypedDict):
    """A row of an event: a hover of one of the drones, and its rest after it."""

    drone: int
    start_s: float
    hover_s: float
    rest_s: float


class DroneCourse(NamedTuple):
    """A drone's flights without an exchange of its pack."""

    drone: int
    offset_s: float  # First take-off, counted from the start of the event [s]
    plan: Plan


class Lost(NamedTuple):
    """A drone that fails, and when, counted from the start of the event [s]."""

    drone: int
    at_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class EventRoster(Result):
    """A roster of drones in ring order, one row per hover; `Event` explains its figures."""

    kind = "optuav event"
    units = EVENT_HOVER_UNITS
    rows: tuple[EventHover, ...]
    hours: float
    drones: int
    least_drones: int
    longest_hover_s: float
    building: str
    overlap_s: float = 0.0
    separation_m: tuple[float, ...] | None = None
    calm_drones: int | None = None
    in_calm_air: str | None = None
    charged_by: Literal["laser", "pad", "exchange"] = field(repr=False)
    ring: DroneRing = field(repr=False)
    cycles: tuple[Plan, ...] = field(repr=False)  # A visit of each drone
    courses: tuple[DroneCourse, ...] = field(repr=False)  # Of drones; of hovers with exchanges
    excused: tuple[float, float] | None = field(default=None, repr=False)  # After a failure [s]
    lost: Lost | None = field(default=None, repr=False)

    @property
    def plans(self) -> tuple[Plan, ...]:
        """The plan of each course."""
        return tuple(course.plan for course in self.courses)

    @property
    def offsets_s(self) -> tuple[float, ...]:
        """Take-off of each course, counted from the start of the event [s]."""
        return tuple(course.offset_s for course in self.courses)

    @property
    def gap(self) -> str:
        """How long nobody hovers, in words."""
        begin_s, end_s = self.excused or (0.0, 0.0)
        gap_s = fixed(end_s - begin_s)
        return "without a gap" if gap_s == "0.00" else f"with a gap of {gap_s} s"

    def replay(self) -> FleetReplay:
        """Simulate every drone by the judge alone; each has a place of its own."""
        apart_m = 0.0 if self.separation_m is None else math.hypot(*self.separation_m)
        return replay_fleet(
            self.plans,
            self.offsets_s,
            drones=self.drones,
            share=1.0,
            until_s=3600.0 * self.hours,
            places=len(self.plans),
            overlap_s=self.overlap_s,
            apart_m=apart_m,
            excused=self.excused,
        )

    def blocks(self) -> Iterator[Block]:
        """Yield the number of drones, and the hovers."""
        yield Heading(f"{figure(self.hours)} h {self.gap}: {printable(self.mission.name)}")
        out_s = self.plans[0].phases[0].duration_s
        rest = f"on {printable(self.building)}; take off {seconds(out_s)} before a hover"
        yield Facts(
            [
                ("Drones", f"{self.drones}; {AT_LEAST} {self.least_drones}"),
                ("Hovers", f"{len(self.rows)}, up to {seconds(self.longest_hover_s)}"),
                ("Rest", rest),
                *self._failed(),
                *self._handover(),
                *calm_facts(self.in_calm_air),
            ]
        )
        yield turns_table(["drone", "from [s]", "hover [s]", "rest [s]"], self.rows)

    def _failed(self) -> Iterator[tuple[str, str]]:
        """Yield the drone that fails, if one does."""
        if self.lost is not None:
            yield "Failed", f"drone {self.lost.drone}, at {figure(self.lost.at_s)} s"

    def _handover(self) -> Iterator[tuple[str, str]]:
        """Yield for how long two drones hover at a handover, and how far apart."""
        if self.overlap_s or self.separation_m:
            words = f"{figure(self.overlap_s)} s of overlap"
            if self.separation_m:
                words += f", next drone {step_in_words(self.separation_m)}"
            yield "Handover", words

    def pictures(self, begin: datetime | None = None) -> Pictures:
        """Yield a bar per drone, and below when one is on station; in clock times from a begin."""
        from optuav.plots.fleets import Turn, courses_drawn
        from optuav.plots.style import titled

        out, _, back, *_ = self.plans[0].phases
        flight_s = out.duration_s + back.duration_s
        turns = [
            Turn(row["start_s"] - 0.5 * flight_s, flight_s, row["hover_s"], row["rest_s"], 0.0)
            for row in self.rows
        ]
        end_s = turns[-1].offset_s + turns[-1].round_s
        words = f"{figure(self.hours)} h {self.gap}", plural(self.drones, "drone")
        title = titled(self.mission.name, *words)
        courses = [
            [turn for turn, row in zip(turns, self.rows, strict=True) if row["drone"] == number]
            for number in range(1, self.drones + 1)
        ]
        clock = None if begin is None else partial(later, begin)
        yield "event.png", courses_drawn(courses, end_s, title, clock=clock, lost=self.lost)


def courses_of(
    ring: DroneRing, cycles: Sequence[Plan], rows: Sequence[EventHover]
) -> tuple[DroneCourse, ...]:
    """The courses of some hovers, of drones with a cycle each."""
    numbers = dict.fromkeys(row["drone"] for row in rows)
    several = [[row for row in rows if row["drone"] == number] for number in numbers]
    if ring.swap_s is not None:
        several = [[row] for row in rows]
    return tuple(
        DroneCourse(
            first["drone"],
            first["start_s"] - cycles[first["drone"] - 1].phases[0].duration_s,
            repeated(
                cycles[first["drone"] - 1],
                [(row["hover_s"], row["rest_s"]) for row in (first, *others)],
            ),
        )
        for first, *others in several
    )


def visits_of(phases: Sequence[Phase]) -> Iterator[list[Phase]]:
    """Yield the legs and the hover of each visit."""
    for flies, visit in itertools.groupby(phases, key=lambda phase: phase.kind != "rest"):
        if flies:
            yield [*visit]


def later(begin: datetime, passed_s: float) -> datetime:
    """A moment to the second, also where clocks are put forward or back in between."""
    return (begin.astimezone(UTC) + timedelta(seconds=round(passed_s))).astimezone(begin.tzinfo)


def judged(event: Some) -> Some:
    """The event with plans that carry the judge's verdict, which is that they can be flown."""
    courses = (
        course._replace(plan=course.plan.model_copy(update={"flyable": True}))
        for course in event.courses
    )
    return replace(event, courses=tuple(courses))


def step_in_words(step_m: tuple[float, ...]) -> str:
    """A step from one hover point to the next, in words."""
    if any(step_m[:2]):
        return f"{coordinates(step_m)} m away"
    return f"{figure(abs(step_m[2]))} m {'higher' if step_m[2] > 0.0 else 'lower'}"
