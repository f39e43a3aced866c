"""Drones that cover some hours without a gap, all full at the start."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias, TypedDict

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.errors import Fault, NoPlanError, printable, refuse
from optuav.fields import Range
from optuav.judge.fleets import FleetReplay, replay_fleet
from optuav.mission.messages import misfits, plural, shown
from optuav.network.timeline import Phase
from optuav.physics.kibam import Battery, Stage, Wells, step, tapered
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Heading
from optuav.service.calm_air import calm_facts
from optuav.service.endless import EndlessCycle
from optuav.service.fleet import OVERLAP, need_handover, repeated, turns_table, upwards
from optuav.service.visit import Visit
from optuav.silence import silent
from optuav.studies.results import Pictures, Result

if TYPE_CHECKING:
    from optuav.service.failure import Failure

Constraints: TypeAlias = tuple[Integers, Floats, Floats]
"""Columns and weights of unknowns (row, entry), and the largest sum of each row (row,)."""
Progress: TypeAlias = Callable[[int, int | None, str], None]

HOURS = Range("h", gt=0.0, le=240.0)
MOST = 100
DRONES = Range("-", ge=1, le=MOST, whole=True)
UNITS = {"drone": "-", "start_s": "s", "hover_s": "s", "rest_s": "s"}
SHARES_OF_LONGEST = (1.0, 0.99, 0.97, 0.95, 0.9, 0.8, 0.7, 0.6)
"""Shares of the longest hover from full wells to which hovers are kept, until a replay holds."""
ROUNDING = 1e-6  # Share of the capacity
RUN_SHARE = 0.75  # Share of all hovers that a run holds, beside the run of all
HOVERS_FOR_INTERIOR_POINT = (
    500  # Hovers from which an interior point is found sooner than by the simplex method
)
WAITED_S = 0.1  # Between looks at a programme that is solved
AT_LEAST = "in turns from one roof, charge requires at least"
BUILDINGS = 20  # Buildings that are tried although others beat them
EXTRA_HOVERS = 2  # Hovers beyond the fewest that are tried, per drone


class EventHover(TypedDict):
    """A row of an event: a hover of one of the drones, and its rest after it."""

    drone: int
    start_s: float
    hover_s: float
    rest_s: float


class Course(NamedTuple):
    """A drone's flights without an exchange of its pack."""

    drone: int
    offset_s: float  # First take-off, counted from the start of the event [s]
    plan: Plan


@dataclass(frozen=True, kw_only=True, repr=False)
class Event(Result):
    """A roster of drones in ring order, one row per hover.

    Parameters
    ----------
    hours, drones, building
        Time covered [h], the number of drones, and where all of them rest.
    least_drones
        The fewest that can hover in turns from any one building if only charge counts, with at
        most two hovers per drone more than the charge of full batteries requires.
    longest_hover_s
        Longest hover of the roster [s].
    overlap_s, separation_m
        For how long two drones hover at a handover [s], and the step from the hover point of one
        to that of the next (x, y, z) [m], or None.
    calm_drones, in_calm_air
        If the hover depends on the wind, the number of drones in calm air, None without a roster
        there, and the same in words; else None.

    Examples
    --------
    >>> import optuav
    >>> event = optuav.coverage("matrice350").event(1)
    >>> event.drones, event.building, len(event.rows)
    (2, 'b4', 2)
    """

    kind = "optuav event"
    units = UNITS
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
    ring: Ring = field(repr=False)
    cycles: tuple[Plan, ...] = field(repr=False)  # A visit of each drone
    courses: tuple[Course, ...] = field(repr=False)  # Of drones; of hovers with exchanges
    excused: tuple[float, float] | None = field(default=None, repr=False)  # After a failure [s]

    @property
    def plans(self) -> tuple[Plan, ...]:
        """The plan of each course."""
        return tuple(course.plan for course in self.courses)

    @property
    def offsets_s(self) -> tuple[float, ...]:
        """Take-off of each course, counted from the start of the event [s]."""
        return tuple(course.offset_s for course in self.courses)

    def without(self, drone: int, at_s: float) -> Failure:
        """Find what a failure of a drone means, and whether the others can cover the rest.

        Parameters
        ----------
        drone
            Which one fails, 1 for the first.
        at_s
            When, counted from the start of the event [s], ≥ 0 and before its end. A drone that
            hovers then is gone at once.

        Returns
        -------
        Failure
            The gap that it makes if the others keep to the roster, a row for each of them with
            when it can be on station and how long it can hover, and the roster of the others with
            the shortest gap that was found, flown by the judge, or why there is none.

        Raises
        ------
        InputError
            If there is no such drone, or the moment is outside the event.

        Examples
        --------
        >>> import optuav
        >>> failure = optuav.coverage("matrice350").event(4, 5).without(1, 600)
        >>> round(failure.gap_s), failure.roster is not None
        (3000, True)
        """
        from optuav.service.failure import failure_of

        return failure_of(self, drone, at_s)

    def replay(self) -> FleetReplay:
        """Simulate every drone by the judge alone; each has a place of its own."""
        apart_m = 0.0 if self.separation_m is None else math.hypot(*self.separation_m)
        return replay_fleet(
            self.plans,
            self.offsets_s,
            share=1.0,
            until_s=3600.0 * self.hours,
            places=len(self.plans),
            overlap_s=self.overlap_s,
            apart_m=apart_m,
            excused=self.excused,
        )

    def save_flights(
        self, directory: str | Path, start: str | datetime, *, climb_m: float | None = None
    ) -> tuple[Path, ...]:
        """Write what pilots and their ground stations need; needs pyproj and matplotlib.

        Parameters
        ----------
        directory
            Where the files go; made if it is missing. It must hold no flights of another event.
        start
            When the first drone hovers: a date and time with its offset from UTC, such as
            ``"2027-05-01T14:00+02:00"``.
        climb_m
            Height of every take-off above its place, see `Plan.export`.

        Returns
        -------
        tuple of Path
            The files that were written: per drone and visit ``drone-1-visit-2.plan`` and
            ``.waypoints`` with its notes in ``.txt``; per drone ``.kml`` and ``.geojson``;
            ``roster.csv`` and the calendar ``roster.ics`` with take-off, arrival on station,
            departure and landing in clock times, the roof, the drone's pad, beam or bay, and the
            battery left; and ``event.png``. They carry the judge's verdict.

        Raises
        ------
        InputError
            If the start has no offset, the climb is out of range, the mission has no place on
            Earth, or a file cannot be written.

        Examples
        --------
        >>> import optuav, tempfile
        >>> place = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4}
        >>> event = optuav.coverage(optuav.load("matrice350").replace(place)).event(1)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     files = event.save_flights(folder, "2027-05-01T14:00+02:00")
        >>> [file.name for file in files if file.suffix == ".plan"]
        ['drone-1-visit-1.plan', 'drone-2-visit-1.plan']
        """
        from optuav.service.flights import save_flights

        return save_flights(self, directory, start, climb_m)

    def blocks(self) -> Iterator[Block]:
        """Yield the number of drones, and the hovers."""
        yield Heading(f"{self.hours:g} h without a gap: {printable(self.mission.name)}")
        out_s = self.plans[0].phases[0].duration_s
        rest = f"on {printable(self.building)}; take off {out_s:.2f} s before a hover"
        yield Facts(
            [
                ("Drones", f"{self.drones}; {AT_LEAST} {self.least_drones}"),
                ("Hovers", f"{len(self.rows)}, up to {self.longest_hover_s:.2f} s"),
                ("Rest", rest),
                *self._handover(),
                *calm_facts(self.in_calm_air),
            ]
        )
        yield turns_table(["drone", "from [s]", "hover [s]", "rest [s]"], self.rows)

    def _handover(self) -> Iterator[tuple[str, str]]:
        """Yield for how long two drones hover at a handover, and how far apart."""
        if self.overlap_s or self.separation_m:
            words = f"{self.overlap_s:g} s of overlap"
            if self.separation_m:
                words += f", next drone {_step_in_words(self.separation_m)}"
            yield "Handover", words

    def pictures(self) -> Pictures:
        """Yield a bar per drone, and below when one is on station."""
        from optuav.plots.fleets import Turn, courses_drawn

        out, _, back, *_ = self.plans[0].phases
        flight_s = out.duration_s + back.duration_s
        turns = [
            Turn(row["start_s"], flight_s, row["hover_s"], row["rest_s"], 0.0) for row in self.rows
        ]
        end_s = turns[-1].offset_s + turns[-1].round_s
        words = f"{self.hours:g} h without a gap, {plural(self.drones, 'drone')}"
        title = f"{words}: {printable(self.mission.name)}"
        courses = [
            [turn for turn, row in zip(turns, self.rows, strict=True) if row["drone"] == number]
            for number in range(1, self.drones + 1)
        ]
        yield "event.png", courses_drawn(courses, end_s, title)


def _step_in_words(step_m: tuple[float, ...]) -> str:
    """A step from one hover point to the next, in words."""
    if any(step_m[:2]):
        return f"({', '.join(f'{metres:g}' for metres in step_m)}) m away"
    return f"{abs(step_m[2]):g} m {'higher' if step_m[2] > 0.0 else 'lower'}"


def event_of(
    cycles: Sequence[EndlessCycle],
    hours: float,
    drones: int | None,
    overlap_s: float = 0.0,
    separation_m: tuple[float, ...] | None = None,
    progress: Progress | None = None,
) -> Event:
    """The roster of the fewest drones on one of the buildings, or of so many.

    See `Coverage.event`. The first cycle is that at the hover point, others are those at points
    apart from it, one step and two. The visit of the first cycle comes first.
    """
    cycle, *apart = cycles
    faults = [*misfits(("hours", hours, HOURS), ("overlap_s", overlap_s, OVERLAP))]
    faults += misfits(*([] if drones is None else [("drones", drones, DRONES)]))
    visits = _promising([cycle.finite_cycle(), *cycle.visits])
    if cycle.perspective != "available":
        faults.append(Fault("perspective", shown(cycle.perspective), "must be 'available' here"))
    refuse(faults)
    longest_s = max((visit.most_s for visit in visits), default=0.0)
    need_handover(overlap_s, longest_s, "the longest hover")
    spots = [{each.building: each for each in (c.finite_cycle(), *c.visits)} for c in apart]
    until_s, least, able = 3600.0 * hours, 0, list[Ring]()
    tried, tell = itertools.count(), progress or (lambda *_: None)
    for count in range(1, MOST + 1):
        number = plural(count, "drone")
        tell(next(tried), None, number)
        before, able = {ring.building for ring in able}, []
        for visit in visits:
            if (ring := _ring(visit, spots, count, until_s, overlap_s)) is not None and (
                ring.building in before or _hovers(ring, ring.longest_s("balanced_s")) is not None
            ):
                able.append(ring)
        least = least or count * bool(able)
        if count == drones and len(spots) == 1 and max(spots_of(count, 2)) > 1:
            words = f"{number} need a third hover point, twice separation_m away, which cannot be"
            raise NoPlanError(f"{words} served; an even number needs two")
        if not able or count < (drones or least):
            continue
        if drones is not None and drones < least:
            number = plural(drones, "drone")
            raise NoPlanError(f"{number} cannot cover {hours:g} h: {AT_LEAST} {least}")
        for roster in (roster for ring in able for roster in _rosters(ring)):
            tell(next(tried), None, f"{number} on {printable(roster.ring.building)}")
            if roster.lowest_As >= -ROUNDING * float(roster.battery.capacity_As):
                event = _event(cycles, hours, least, roster, separation_m)
                if event.replay().flyable:
                    return judged(event)
        if drones is not None:
            words = f"charge allows {number} for {hours:g} h, but every roster that optuav tried "
            words += "empties an available well: allow more drones, or leave their number open"
            raise NoPlanError(words)
    if not least:
        raise NoPlanError(f"even {MOST} drones cannot cover {hours:g} h by charge")
    words = f"charge allows {plural(least, 'drone')} for {hours:g} h, but every roster that optuav"
    raise NoPlanError(f"{words} tried, of up to {MOST} drones, empties an available well")


def spots_of(drones: int, spots: int) -> list[int]:
    """Number of the hover point of each drone in a ring, such that neighbours have two."""
    if spots == 1:
        return [0] * drones
    numbers = [drone % 2 for drone in range(drones)]
    return [*numbers[:-1], 2] if drones > 1 and drones % 2 else numbers


def _ring(
    visit: Visit,
    spots: Sequence[Mapping[str, Visit]],
    drones: int,
    until_s: float,
    overlap_s: float,
) -> Ring | None:
    """Drones that rest on the building of a visit; None if one of them cannot hover."""
    at = [{visit.building: visit}, *spots]
    spotted = spots_of(drones, len(at))
    visits = [at[n].get(visit.building) for n in spotted if n < len(at)]
    able = [each for each in visits if each and each.from_full_s is not None and each.longest_s]
    return Ring(tuple(able), until_s, overlap_s) if len(able) == drones else None


def _promising(visits: Sequence[Visit]) -> list[Visit]:
    """The first visit, those that none beats in legs and charging current, and some of the rest.

    In charge, no visit needs fewer drones than one that beats it. Through the wells it may, as the
    rosters that are tried are not all that there are.
    """
    kept, beaten = [*visits[:1]], list[Visit]()
    for visit in sorted(visits[1:], key=lambda visit: (visit.flight_s, visit.flight_As)):
        better = any(
            each.flight_s <= visit.flight_s
            and each.flight_As <= visit.flight_As
            and (each.rest_A >= visit.rest_A or visit.swap_s is not None)
            for each in kept
        )
        (beaten if better else kept).append(visit)
    kept += beaten[: max(BUILDINGS - len(kept), 0)]
    return [visit for visit in kept if visit.from_full_s is not None and visit.longest_s]


@dataclass(frozen=True)
class Ring:
    """Drones in ring order, and the time that they cover, with an overlap at handovers [s].

    The hovers of a drone have one point, and so one visit.
    """

    visits: tuple[Visit, ...]
    until_s: float
    overlap_s: float

    @property
    def building(self) -> str:
        """Where all of them rest."""
        return self.visits[0].building

    @property
    def drones(self) -> int:
        """Their number."""
        return len(self.visits)

    @property
    def rest_A(self) -> float:
        """Current into a resting battery [A]."""
        return self.visits[0].rest_A

    @property
    def swap_s(self) -> float | None:
        """Duration of an exchange of the pack [s]."""
        return self.visits[0].swap_s

    @property
    def handover_s(self) -> float:
        """Time by which a rest is shorter than other hovers last: the overlaps of a turn [s]."""
        return self.drones * self.overlap_s

    @cached_property
    def cheapest(self) -> Visit:
        """A visit that takes no more time and charge than those of any drone."""
        first, *others = self.visits
        if all(visit is first for visit in others):
            return first
        flight_s, flight_As, hover_A = (
            min(getattr(visit, name) for visit in self.visits)
            for name in ("flight_s", "flight_As", "hover_A")
        )
        legs = (Stage(-flight_As / flight_s, flight_s),)
        return replace(first, out=legs, back=(), hover_A=hover_A)

    def column(self, name: str, count: int) -> Floats:
        """A figure of the visits of so many hovers."""
        return np.resize([float(getattr(visit, name)) for visit in self.visits], count)

    def longest_s(self, name: str, share: float = 1.0) -> Floats:
        """A share of a duration of the hovers of each drone (drone,) [s]."""
        return share * self.column(name, self.drones)

    def total_s(self, count: int) -> float:
        """Duration of so many hovers together [s]."""
        return self.until_s + (count - 1) * self.overlap_s

    def least_s(self, count: int) -> Floats:
        """Shortest hovers in which no third drone hovers [s]."""
        hovers = np.arange(count)
        return self.overlap_s * (1.0 * (hovers > 0) + 1.0 * (hovers < count - 1))


def _rosters(ring: Ring) -> Iterator[Roster]:
    """Yield rosters that keep charge, ever shorter hovers, and last the ring without an end."""
    for share in SHARES_OF_LONGEST:
        hovers_s = _hovers(ring, ring.longest_s("most_s", share))
        if hovers_s is not None:
            yield Roster(ring, hovers_s)
    hover_s = min(visit.longest_s or 0.0 for visit in ring.visits)
    every_s, drones = hover_s - ring.overlap_s, ring.drones
    period_s = max(visit.period_s(hover_s) for visit in ring.visits)
    if every_s > ring.overlap_s and drones >= upwards(period_s / every_s):
        count = upwards((ring.until_s - ring.overlap_s) / every_s)
        hovers_s = np.full(count, hover_s)
        hovers_s[-1] = ring.until_s - (count - 1) * every_s
        yield Roster(ring, hovers_s)


@dataclass(frozen=True, eq=False)
class Roster:
    """Hovers of some drones in ring order [s]."""

    ring: Ring
    hovers_s: Floats

    @property
    def battery(self) -> Battery:
        """That of each drone."""
        return self.ring.visits[0].battery

    @property
    def drones(self) -> int:
        """Those that hover."""
        return min(self.ring.drones, len(self.hovers_s))

    @cached_property
    def starts_s(self) -> Floats:
        """Start of every hover [s]."""
        return np.concatenate([[0.0], np.cumsum(self.hovers_s - self.ring.overlap_s)[:-1]])

    @cached_property
    def rests_s(self) -> Floats:
        """Rest after every hover [s]; 0 after the last one of a drone."""
        rests_s, drones = np.zeros(len(self.hovers_s)), self.drones
        away_s = self.starts_s[drones:] - (self.starts_s + self.hovers_s)[:-drones]
        rests_s[:-drones] = away_s - self.ring.column("flight_s", len(away_s))
        return rests_s

    @property
    def courses(self) -> int:
        """Number of courses from full wells: with exchanges every hover is one, else a drone."""
        return self.drones if self.ring.swap_s is None else len(self.hovers_s)

    @property
    def lowest_As(self) -> float:
        """Least y1 of all drones [A s], simulated turn by turn for all of them at once."""
        battery, count, lowest_As = self.battery, self.courses, math.inf
        out, back = (
            [*_together([getattr(visit, leg) for visit in self.ring.visits], count)]
            for leg in ("out", "back")
        )
        hover_A = self.ring.column("hover_A", count)
        wells = Wells(*(np.full(count, float(well)) for well in battery.full))
        for first in range(0, len(self.hovers_s), count):
            turn = slice(first, first + count)
            hovers_s, some = self.hovers_s[turn], slice(len(self.hovers_s[turn]))
            wells = Wells(*(well[some] for well in wells))
            for current_A, duration_s in (*out, Stage(-hover_A, hovers_s), *back):
                stage = Stage(current_A[some], duration_s[some])
                wells = step(battery, wells, stage)
                lowest_As = min(lowest_As, float(np.min(wells.available_As)))
            rests = Stage(np.full(len(hovers_s), self.ring.rest_A), self.rests_s[turn])
            wells = tapered(battery, wells, rests)
        return lowest_As


def _together(legs: Sequence[tuple[Stage, ...]], count: int) -> Iterator[Stage]:
    """Yield stages of legs flown at once, so many in turns; a shorter leg waits at its end."""
    for stages in itertools.zip_longest(*legs, fillvalue=Stage(0.0, 0.0)):
        currents_A, durations_s = zip(*stages, strict=True)
        yield Stage(np.resize(currents_A, count), np.resize(durations_s, count))


def _hovers(ring: Ring, longest_s: Floats) -> Floats | None:
    """Hovers in ring order that cover a time if only charge counts [s]; None without any.

    None is longer than the drone's longest (drone,) [s]. A linear programme finds the hovers that
    keep most charge at the lowest landing. It tries at most two hovers per drone beyond the fewest
    possible: each costs two legs.
    """
    most_s, drones = float(longest_s.max()), ring.drones
    if most_s <= ring.overlap_s:
        return None
    fewest = math.ceil((ring.until_s - ring.overlap_s) / (most_s - ring.overlap_s) - 1e-9)
    scarce, small = ring, ROUNDING * float(ring.cheapest.battery.capacity_As)
    if ring.swap_s is not None:  # Time on the ground is scarce, not charge: 1 A s for 1 s
        away = (Stage(0.0, ring.cheapest.flight_s + ring.swap_s),)
        whole_As = float(ring.cheapest.battery.capacity_As)
        waiting = replace(
            ring.cheapest, out=away, back=(), hover_A=0.0, rest_A=1.0, least_As=whole_As
        )
        scarce = replace(ring, visits=(waiting,) * drones)
    for count in range(max(fewest, 1), max(fewest, 1) + EXTRA_HOVERS * drones + 1):
        runs = (count, math.ceil(RUN_SHARE * count))
        # Sums of rows refuse most programmes without an answer, and take no time.
        if max(_overdrawn_As(scarce, most_s, count, width) for width in runs) > small:
            continue
        hovers_s = _programme(ring, longest_s, count)
        if hovers_s is not None:
            return hovers_s
        if drones == 1:
            break
    return None


def _overdrawn_As(ring: Ring, longest_s: float, count: int, width: int) -> float:
    """Least charge that drones lack in all runs of `width` hovers in a row [A s]: a sum of rows.

    In a run, every drone has at most full wells at first, and rests while others hover, but for the
    legs and overlaps; the run begins and ends anywhere. Hovers are long where that costs least, and
    else 0.
    """
    visit, drones = ring.cheapest, ring.drones
    number, runs = np.arange(count), count - width + 1
    holding = np.minimum(number, runs - 1) - np.maximum(number - width + 1, 0) + 1
    again, turns = number[: max(count - drones, 0)], max(width - drones, 0)
    resting = np.minimum(again, runs - 1) - np.maximum(again + drones - width + 1, 0) + 1
    before = np.concatenate([[0], np.cumsum(np.maximum(resting, 0))])
    others = before[np.minimum(number, len(again))]
    others -= before[np.clip(number - drones + 1, 0, len(again))]
    drawn_A = np.sort(visit.hover_A * holding - visit.rest_A * others)
    lengths_s = np.clip(ring.total_s(count) - longest_s * number, 0.0, longest_s)
    away_s = visit.flight_s + ring.handover_s
    flights_As = width * visit.flight_As + turns * visit.rest_A * away_s
    spare_As = min(drones, width) * visit.spare_As
    return float(drawn_A @ lengths_s) + runs * (flights_As - spare_As)


@silent()
def _programme(ring: Ring, longest_s: Floats, count: int) -> Floats | None:
    """Hovers of a given number [s]; the unknowns are hovers, charges at departure, and a margin."""
    drones, least_s = ring.drones, ring.least_s(count)
    longest_s = np.resize(longest_s, count)
    if (drones == 1 and count > 1) or (longest_s < least_s).any():
        return None
    visit, rest_A = ring.cheapest, ring.rest_A
    size_As, number, again = float(visit.battery.capacity_As), np.arange(count), count - drones
    hover_A, flight_As = ring.column("hover_A", count), ring.column("flight_As", count)
    landing = np.stack([number, count + number, 0 * number + 2 * count], axis=1)
    ones = np.ones((count, 1))
    drawn = np.hstack([hover_A[:, None], -ones, ones])
    rows: list[Constraints] = [(landing, drawn, -flight_As - visit.least_As)]
    if again > 0:
        first = number[:again, None]
        between = first + np.arange(1, drones)  # The others' hovers while a drone is away
        others, ones = np.ones((again, drones - 1)), ones[:again]
        away_s = ring.column("flight_s", again) + ring.handover_s
        rows.append((between, -others, -away_s - (ring.swap_s or 0.0)))
        if ring.swap_s is None:  # Else every pack is full
            both = np.hstack([first, between, count + first + drones, count + first])
            gained = np.hstack([hover_A[:again, None], -rest_A * others, ones, -ones])
            rows.append((both, gained, -flight_As[:again] - rest_A * away_s))
    least = np.append(least_s, np.zeros(count + 1))
    highest = np.concatenate([longest_s, np.full(count + 1, size_As)])
    answer = solved(rows, ring.total_s(count), least, highest)
    return None if answer is None else answer[:count]


def solved(
    rows: Sequence[Constraints], total_s: float, least: Floats, highest: Floats
) -> Floats | None:
    """The largest last unknown under rows whose weights at some columns keep limits.

    The first unknowns, of a half of the others each, add up to a time. HiGHS runs beside this
    thread, which so ends at Ctrl-C.
    """
    import highspy

    count = len(highest) // 2
    columns = [*(table for table, _, _ in rows), np.arange(count)[None]]
    weights = [*(row.ravel() for _, row, _ in rows), np.ones(count)]
    limits = [limit for _, _, limit in rows]
    lengths = np.concatenate([np.full(*table.shape) for table in columns])
    programme = highspy.HighsLp()
    programme.num_col_, programme.num_row_ = len(highest), len(lengths)
    programme.col_cost_ = -np.eye(1, len(highest), len(highest) - 1)[0]
    programme.col_lower_, programme.col_upper_ = least, highest
    programme.row_upper_ = np.concatenate([*limits, [total_s]])
    programme.row_lower_ = np.append(np.full(len(lengths) - 1, -highspy.kHighsInf), total_s)
    programme.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    programme.a_matrix_.start_ = np.concatenate([[0], np.cumsum(lengths)])
    programme.a_matrix_.index_ = np.concatenate([table.ravel() for table in columns])
    programme.a_matrix_.value_ = np.concatenate(weights)
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("solver", "simplex" if count < HOVERS_FOR_INTERIOR_POINT else "ipm")
    solver.HandleUserInterrupt = True
    solver.passModel(programme)
    running = Thread(target=solver.run, daemon=True)
    running.start()
    try:
        while running.is_alive():
            running.join(WAITED_S)
    finally:
        solver.cancelSolve()  # type: ignore[no-untyped-call]
    if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
        return None
    return np.asarray(solver.getSolution().col_value)


def _event(
    cycles: Sequence[EndlessCycle],
    hours: float,
    least: int,
    roster: Roster,
    separation_m: tuple[float, ...] | None,
) -> Event:
    """The roster as a table, with the plan of every course."""
    figures = np.stack([roster.starts_s, roster.hovers_s, roster.rests_s], axis=1).tolist()
    rows = tuple(
        EventHover(drone=k % roster.drones + 1, start_s=start_s, hover_s=hover_s, rest_s=rest_s)
        for k, (start_s, hover_s, rest_s) in enumerate(figures)
    )
    ring, spots = roster.ring, spots_of(roster.ring.drones, len(cycles))
    at = {spots[n]: cycles[spots[n]].on(visit).plan for n, visit in enumerate(ring.visits)}
    visited = tuple(at[spot] for spot in spots)
    return Event(
        mission=cycles[0].mission,
        rows=rows,
        hours=hours,
        drones=roster.drones,
        least_drones=least,
        longest_hover_s=float(roster.hovers_s.max()),
        building=ring.building,
        overlap_s=ring.overlap_s,
        separation_m=separation_m,
        charged_by=cycles[0].charged_by,
        ring=ring,
        cycles=visited,
        courses=courses_of(ring, visited, rows),
    )


def courses_of(
    ring: Ring, cycles: Sequence[Plan], rows: Sequence[EventHover]
) -> tuple[Course, ...]:
    """The courses of some hovers, of drones with a cycle each."""
    numbers = dict.fromkeys(row["drone"] for row in rows)
    several = [[row for row in rows if row["drone"] == number] for number in numbers]
    if ring.swap_s is not None:
        several = [[row] for row in rows]
    return tuple(
        Course(
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


def judged(event: Event) -> Event:
    """The event with plans that carry the judge's verdict, which is that they can be flown."""
    courses = (
        course._replace(plan=course.plan.model_copy(update={"flyable": True}))
        for course in event.courses
    )
    return replace(event, courses=tuple(courses))
