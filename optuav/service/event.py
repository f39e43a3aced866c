"""Drones that cover some hours without a gap, all full at the start."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Thread
from typing import Any, TypeAlias, TypedDict

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.errors import Fault, NoPlanError, printable, refuse
from optuav.fields import Range
from optuav.judge.fleets import FleetReplay, replay_fleet
from optuav.mission.messages import counted, misfits, shown
from optuav.physics.kibam import Stage, Wells, step, tapered
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Heading
from optuav.service.checks import calm_facts
from optuav.service.endless import EndlessCycle
from optuav.service.fleet import repeated, turns_table, upwards
from optuav.service.visit import Visit
from optuav.silence import silent
from optuav.studies.results import Pictures, Result

Constraints: TypeAlias = tuple[Integers, Sequence[float] | Floats, float]
"""Columns of unknowns (row, entry), the weight of each entry, and the largest sum of a row."""
Progress: TypeAlias = Callable[[int, int | None, str], None]

HOURS = Range("h", gt=0.0, le=240.0)
MOST = 100
DRONES = Range("-", ge=1, le=MOST, whole=True)
UNITS = {"drone": "-", "start_s": "s", "hover_s": "s", "rest_s": "s"}
SHORTER = (1.0, 0.99, 0.97, 0.95, 0.9, 0.8, 0.7, 0.6)
"""Shares of the longest hover from full wells to which hovers are kept, until a replay holds."""
ROUNDING = 1e-6  # Share of the capacity
RUN = 0.75  # Share of all hovers that a run holds, beside the run of all
LARGE = 500  # Hovers from which an interior point is found sooner than by the simplex method
WAITED_S = 0.1  # Between looks at a programme that is solved
AT_LEAST = "in turns from one roof, charge requires at least"
BUILDINGS = 20  # Buildings that are tried although others beat them
MORE = 2  # Hovers beyond the fewest that are tried, per drone


class EventHover(TypedDict):
    """A row of an event: a hover of one of the drones, and its rest after it."""

    drone: int
    start_s: float
    hover_s: float
    rest_s: float


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
    calm_drones: int | None = None
    in_calm_air: str | None = None
    plans: tuple[Plan, ...] = field(repr=False)  # Of drones; of hovers with exchanges
    offsets_s: tuple[float, ...] = field(repr=False)

    def replay(self) -> FleetReplay:
        """Simulate every drone by the judge alone; each has a place of its own."""
        flight_s = self.plans[0].phases[0].duration_s
        until_s, places = flight_s + 3600.0 * self.hours, len(self.plans)
        limits: dict[str, Any] = {"share": 1.0, "until_s": until_s, "places": places}
        return replay_fleet(self.plans, self.offsets_s, **limits)

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
                *calm_facts(self.in_calm_air),
            ]
        )
        yield turns_table(["drone", "from [s]", "hover [s]", "rest [s]"], self.rows)

    def pictures(self) -> Pictures:
        """Yield a bar per drone, and below when one is on station."""
        from optuav.plots.fleets import Turn, courses_drawn

        out, _, back, *_ = self.plans[0].phases
        flight_s = out.duration_s + back.duration_s
        turns = [
            Turn(row["start_s"], flight_s, row["hover_s"], row["rest_s"], 0.0) for row in self.rows
        ]
        end_s = turns[-1].offset_s + turns[-1].round_s
        words = f"{self.hours:g} h without a gap, {counted(self.drones, 'drone')}"
        title = f"{words}: {printable(self.mission.name)}"
        courses = [turns[number :: self.drones] for number in range(self.drones)]
        yield "event.png", courses_drawn(courses, end_s, title)


def event_of(
    cycle: EndlessCycle,
    hours: float,
    drones: int | None,
    progress: Progress | None = None,
) -> Event:
    """The roster of the fewest drones on one of the buildings, or of so many.

    See `Coverage.event`. The visit of the cycle comes first.
    """
    faults = [*misfits(("hours", hours, HOURS))]
    faults += misfits(*([] if drones is None else [("drones", drones, DRONES)]))
    visits = _promising([cycle.ending(), *cycle.visits])
    if cycle.perspective != "available":
        faults.append(Fault("perspective", shown(cycle.perspective), "must be 'available' here"))
    refuse(faults)
    until_s, least, able = 3600.0 * hours, 0, list[Visit]()
    tried, tell = itertools.count(), progress or (lambda *_: None)
    for count in range(1, MOST + 1):
        number = counted(count, "drone")
        tell(next(tried), None, number)
        able = [
            visit
            for visit in visits
            if visit in able or _hovers(visit, count, until_s, visit.balanced_s) is not None
        ]
        least = least or count * bool(able)
        if not able or count < (drones or least):
            continue
        if drones is not None and drones < least:
            number = counted(drones, "drone")
            raise NoPlanError(f"{number} cannot cover {hours:g} h: {AT_LEAST} {least}")
        for roster in (roster for visit in able for roster in _rosters(visit, count, until_s)):
            tell(next(tried), None, f"{number} on {printable(roster.visit.building)}")
            if roster.lowest_As >= -ROUNDING * float(roster.visit.battery.capacity_As):
                event = _event(cycle.on(roster.visit), hours, least, roster)
                if event.replay().flyable:
                    return event
        if drones is not None:
            words = f"charge allows {number} for {hours:g} h, but every roster that optuav tried "
            words += "empties an available well: allow more drones, or leave their number open"
            raise NoPlanError(words)
    if not least:
        raise NoPlanError(f"even {MOST} drones cannot cover {hours:g} h by charge")
    words = f"charge allows {counted(least, 'drone')} for {hours:g} h, but every roster that optuav"
    raise NoPlanError(f"{words} tried, of up to {MOST} drones, empties an available well")


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


def _rosters(visit: Visit, drones: int, until_s: float) -> Iterator[Roster]:
    """Yield rosters that keep charge, ever shorter hovers, and last the ring without an end."""
    for share in SHORTER:
        hovers_s = _hovers(visit, drones, until_s, share * visit.most_s)
        if hovers_s is not None:
            yield Roster(visit, hovers_s, min(drones, len(hovers_s)))
    hover_s = visit.longest_s
    assert hover_s
    if drones >= upwards(visit.period_s(hover_s) / hover_s):
        count = upwards(until_s / hover_s)
        hovers_s = np.full(count, hover_s)
        hovers_s[-1] = until_s - (count - 1) * hover_s
        yield Roster(visit, hovers_s, min(drones, count))


@dataclass(frozen=True, eq=False)
class Roster:
    """Hovers of some drones in ring order [s]."""

    visit: Visit
    hovers_s: Floats
    drones: int

    @cached_property
    def starts_s(self) -> Floats:
        """Start of every hover [s]."""
        return np.concatenate([[0.0], np.cumsum(self.hovers_s)[:-1]])

    @cached_property
    def rests_s(self) -> Floats:
        """Rest after every hover [s]; 0 after the last one of a drone."""
        rests_s, drones = np.zeros(len(self.hovers_s)), self.drones
        away_s = self.starts_s[drones:] - (self.starts_s + self.hovers_s)[:-drones]
        rests_s[:-drones] = away_s - self.visit.flight_s
        return rests_s

    @property
    def courses(self) -> int:
        """Number of courses from full wells: with exchanges every hover is one, else a drone."""
        return self.drones if self.visit.swap_s is None else len(self.hovers_s)

    @property
    def lowest_As(self) -> float:
        """Least y1 of all drones [A s], simulated turn by turn for all of them at once."""
        visit, lowest_As = self.visit, math.inf
        wells = Wells(*(np.full(self.courses, float(well)) for well in visit.battery.full))
        for first in range(0, len(self.hovers_s), self.courses):
            turn = slice(first, first + self.courses)
            hovers_s = self.hovers_s[turn]
            wells = Wells(*(well[: len(hovers_s)] for well in wells))
            for stage in (*visit.out, Stage(-visit.hover_A, hovers_s), *visit.back):
                wells = step(visit.battery, wells, stage)
                lowest_As = min(lowest_As, float(np.min(wells.available_As)))
            rests = Stage(np.full(len(hovers_s), visit.rest_A), self.rests_s[turn])
            wells = tapered(visit.battery, wells, rests)
        return lowest_As


def _hovers(visit: Visit, drones: int, until_s: float, longest_s: float) -> Floats | None:
    """Hovers in ring order that cover a time if only charge counts [s]; None without any.

    A linear programme finds the hovers that keep most charge at the lowest landing. It tries at
    most two hovers per drone beyond the fewest possible: each costs two legs.
    """
    fewest = math.ceil(until_s / longest_s - 1e-9)
    scarce, small = visit, ROUNDING * float(visit.battery.capacity_As)
    if visit.swap_s is not None:  # Time on the ground is scarce, not charge: 1 A s for 1 s
        away = (Stage(0.0, visit.flight_s + visit.swap_s),)
        whole_As = float(visit.battery.capacity_As)
        scarce = replace(visit, out=away, back=(), hover_A=0.0, rest_A=1.0, least_As=whole_As)
    for count in range(fewest, fewest + MORE * drones + 1):
        runs = (count, math.ceil(RUN * count))
        # Sums of rows refuse most programmes without an answer, and take no time.
        if max(_overdrawn_As(scarce, drones, until_s, longest_s, count, w) for w in runs) > small:
            continue
        hovers_s = _programme(visit, drones, until_s, longest_s, count)
        if hovers_s is not None:
            return hovers_s
        if drones == 1:
            break
    return None


def _overdrawn_As(
    visit: Visit, drones: int, until_s: float, longest_s: float, count: int, width: int
) -> float:
    """Least charge that drones lack in all runs of `width` hovers in a row [A s]: a sum of rows.

    In a run, every drone has at most full wells at first, and rests while others hover, but for the
    legs; the run begins and ends anywhere. Hovers are long where that costs least, and else 0.
    """
    number, runs = np.arange(count), count - width + 1
    holding = np.minimum(number, runs - 1) - np.maximum(number - width + 1, 0) + 1
    again, turns = number[: max(count - drones, 0)], max(width - drones, 0)
    resting = np.minimum(again, runs - 1) - np.maximum(again + drones - width + 1, 0) + 1
    before = np.concatenate([[0], np.cumsum(np.maximum(resting, 0))])
    others = before[np.minimum(number, len(again))]
    others -= before[np.clip(number - drones + 1, 0, len(again))]
    drawn_A = np.sort(visit.hover_A * holding - visit.rest_A * others)
    lengths_s = np.clip(until_s - longest_s * number, 0.0, longest_s)
    flights_As = width * visit.flight_As + turns * visit.rest_A * visit.flight_s
    spare_As = min(drones, width) * visit.spare_As
    return float(drawn_A @ lengths_s) + runs * (flights_As - spare_As)


@silent()
def _programme(
    visit: Visit, drones: int, until_s: float, longest_s: float, count: int
) -> Floats | None:
    """Hovers of a given number [s]; the unknowns are hovers, charges at departure, and a margin."""
    if drones == 1 and count > 1:
        return None
    size_As, number, again = float(visit.battery.capacity_As), np.arange(count), count - drones
    landing = np.stack([number, count + number, 0 * number + 2 * count], axis=1)
    rows: list[Constraints] = [
        (landing, [visit.hover_A, -1.0, 1.0], -visit.flight_As - visit.least_As)
    ]
    if again > 0:
        first = number[:again, None]
        between = first + np.arange(1, drones)  # The others' hovers while a drone is away
        ones = np.ones(drones - 1)
        rows.append((between, -ones, -visit.flight_s - (visit.swap_s or 0.0)))
        if visit.swap_s is None:  # Else every pack is full
            both = np.hstack([first, between, count + first + drones, count + first])
            gained = [visit.hover_A, *(-visit.rest_A * ones), 1.0, -1.0]
            rows.append((both, gained, -visit.flight_As - visit.rest_A * visit.flight_s))
    highest = np.append(np.repeat([longest_s, size_As], count), size_As)
    answer = _solved(rows, count, until_s, highest)
    return None if answer is None else answer[:count]


def _solved(
    rows: Sequence[Constraints],
    count: int,
    until_s: float,
    highest: Floats,
) -> Floats | None:
    """The largest last unknown under rows whose weights at some columns keep a limit.

    The first unknowns, so many, add up to a time. HiGHS runs beside this thread, which so ends at
    Ctrl-C.
    """
    import highspy

    columns = [*(table for table, _, _ in rows), np.arange(count)[None]]
    weights = [*(np.tile(row, len(table)) for table, row, _ in rows), np.ones(count)]
    limits = [np.full(len(table), limit) for table, _, limit in rows]
    lengths = np.concatenate([np.full(*table.shape) for table in columns])
    programme = highspy.HighsLp()
    programme.num_col_, programme.num_row_ = len(highest), len(lengths)
    programme.col_cost_ = -np.eye(1, len(highest), len(highest) - 1)[0]
    programme.col_lower_, programme.col_upper_ = np.zeros(len(highest)), highest
    programme.row_upper_ = np.concatenate([*limits, [until_s]])
    programme.row_lower_ = np.append(np.full(len(lengths) - 1, -highspy.kHighsInf), until_s)
    programme.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    programme.a_matrix_.start_ = np.concatenate([[0], np.cumsum(lengths)])
    programme.a_matrix_.index_ = np.concatenate([table.ravel() for table in columns])
    programme.a_matrix_.value_ = np.concatenate(weights)
    solver = highspy.Highs()  # type: ignore[no-untyped-call]
    solver.setOptionValue("output_flag", False)
    solver.setOptionValue("solver", "simplex" if count < LARGE else "ipm")
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


def _event(cycle: EndlessCycle, hours: float, least: int, roster: Roster) -> Event:
    """The roster as a table, with the plan of every course."""
    figures = np.stack([roster.starts_s, roster.hovers_s, roster.rests_s], axis=1).tolist()
    rows = (
        EventHover(drone=k % roster.drones + 1, start_s=start_s, hover_s=hover_s, rest_s=rest_s)
        for k, (start_s, hover_s, rest_s) in enumerate(figures)
    )
    stays_s, courses = [(hover_s, rest_s) for _, hover_s, rest_s in figures], roster.courses
    return Event(
        mission=cycle.mission,
        rows=tuple(rows),
        hours=hours,
        drones=roster.drones,
        least_drones=least,
        longest_hover_s=float(roster.hovers_s.max()),
        building=roster.visit.building,
        plans=tuple(repeated(cycle.plan, stays_s[number::courses]) for number in range(courses)),
        offsets_s=tuple(roster.starts_s[:courses].tolist()),
    )
