"""Drones that cover some hours without a gap, all full at the start."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, NoPlanError, printable, refuse
from optuav.judge.fleets import FleetReplay, replay_fleet
from optuav.mission.messages import counted, misfits, shown
from optuav.mission.schema import Number
from optuav.physics.kibam import Stage, Wells, step, tapered
from optuav.plan import Plan
from optuav.service.fleet import repeated, turns_shown
from optuav.service.visit import Visit
from optuav.silence import silent
from optuav.studies.results import Pictures, Results, ResultsWithFacts, labelled_rows

if TYPE_CHECKING:
    from optuav.service.cycle import Coverage

HOURS = Number("h", gt=0.0, le=240.0)
MOST = 100
DRONES = Number("-", ge=1, le=MOST, whole=True)
UNITS = {"drone": "-", "start_s": "s", "hover_s": "s", "rest_s": "s"}
SHORTER = (1.0, 0.99, 0.97, 0.95, 0.9, 0.8, 0.7, 0.6)
"""Shares of the longest hover from full wells to which hovers are kept, until a replay holds."""
ROUNDING = 1e-6  # Share of the capacity
RUN = 0.75  # Share of all hovers that a run holds, beside the run of all
LARGE = 500  # Hovers from which an interior point is found sooner than by the simplex method
MORE = 2  # Hovers beyond the fewest that are tried, per drone


@dataclass(frozen=True)
class Event(ResultsWithFacts):
    """A roster of drones in ring order, one row per hover.

    Parameters
    ----------
    hours, drones, least_drones
        Time covered [h], the number of drones, and the fewest if only charge counts.
    longest_hover_s
        Longest hover of the roster [s].
    """

    plans: tuple[Plan, ...] = field(kw_only=True, repr=False)  # Of drones; of hovers with exchanges
    offsets_s: tuple[float, ...] = field(kw_only=True, repr=False)

    def replay(self) -> FleetReplay:
        """Simulate every drone by the judge alone; each has a place of its own."""
        flight_s = self.plans[0].phases[0].duration_s
        until_s, places = flight_s + 3600.0 * self.facts["hours"], len(self.plans)
        limits: dict[str, Any] = {"wanted": 1, "allowed_gap_s": 1e-6, "place_s": 0.0}
        return replay_fleet(self.plans, self.offsets_s, until_s=until_s, places=places, **limits)


def event_of(coverage: Coverage, visit: Visit, hours: float, drones: int | None) -> Event:
    """The roster of the fewest drones, or of so many, see `Coverage.event`."""
    faults = [*misfits(("hours", hours, HOURS))]
    faults += misfits(*([] if drones is None else [("drones", drones, DRONES)]))
    if coverage.perspective != "available":
        faults.append(Fault("perspective", shown(coverage.perspective), "must be 'available' here"))
    refuse(faults)
    until_s, least = 3600.0 * hours, 1
    while _hovers(visit, least, until_s, visit.balanced_s) is None:
        least += 1
        if least > MOST:
            raise NoPlanError(f"even {MOST} drones cannot cover {hours:g} h by charge")
    if drones is not None and drones < least:
        number = counted(drones, "drone")
        raise NoPlanError(f"{number} cannot cover {hours:g} h: charge requires at least {least}")
    for count in range(least, MOST + 1) if drones is None else [drones]:
        for share in SHORTER:
            hovers_s = _hovers(visit, count, until_s, share * visit.most_s)
            if hovers_s is None:
                continue
            roster = Roster(visit, hovers_s, min(count, len(hovers_s)))
            if roster.lowest_As < -ROUNDING * float(visit.battery.capacity_As):
                continue
            event = _event(coverage, hours, least, roster)
            if event.replay().flyable:
                return event
    words = f"charge allows {counted(count, 'drone')} for {hours:g} h, but every roster that optuav"
    words += " tried empties an available well"
    raise NoPlanError(words if drones is None else f"{words}: allow one more drone")


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
    from scipy import sparse
    from scipy.optimize import linprog

    if drones == 1 and count > 1:
        return None
    size_As, one = float(visit.battery.capacity_As), sparse.eye(count)
    blocks: list[list[Any]] = [[visit.hover_A * one, -one, np.ones((count, 1))]]
    limits = [np.full(count, -visit.flight_As - visit.least_As)]
    if (again := count - drones) > 0:
        before, after = sparse.eye(again, count), sparse.eye(again, count, k=drones)
        offsets = range(1, drones)  # Of the others' hovers while a drone is away
        between = sparse.diags([1.0] * len(offsets), offsets, shape=(again, count))
        blocks.append([-between, None, None])
        limits.append(np.full(again, -visit.flight_s - (visit.swap_s or 0.0)))
        if visit.swap_s is None:  # Else every pack is full
            charge = visit.hover_A * before - visit.rest_A * between
            blocks.append([charge, after - before, None])
            limits.append(np.full(again, -visit.flight_As - visit.rest_A * visit.flight_s))
    total = np.repeat([[1.0, 0.0]], [count, count + 1], axis=1)
    bounds = [(0.0, longest_s)] * count + [(0.0, size_As)] * (count + 1)
    objective = np.append(np.zeros(2 * count), -1.0)
    rows: Any = sparse.bmat(blocks, format="csc")
    method: Literal["highs-ds", "highs-ipm"] = "highs-ds" if count < LARGE else "highs-ipm"
    inequalities = rows, np.concatenate(limits)
    answer = linprog(objective, *inequalities, total, [until_s], bounds, method=method)
    return None if answer.x is None else np.asarray(answer.x)[:count]


def _event(coverage: Coverage, hours: float, least: int, roster: Roster) -> Event:
    """The roster as a table, with the plan of every course."""
    figures = np.stack([roster.starts_s, roster.hovers_s, roster.rests_s], axis=1).tolist()
    numbered = ((k % roster.drones + 1, *times) for k, times in enumerate(figures))
    facts = {
        **{"hours": hours, "drones": roster.drones, "least_drones": least},
        **{"longest_hover_s": float(roster.hovers_s.max()), "building": coverage.building},
    }
    rows, courses = labelled_rows(UNITS, numbered), roster.courses
    stays_s = [(hover_s, rest_s) for _, hover_s, rest_s in figures]
    return Event(
        *("optuav event", coverage.mission, facts, UNITS, rows, _show, _draw),
        plans=tuple(repeated(coverage.plan, stays_s[number::courses]) for number in range(courses)),
        offsets_s=tuple(roster.starts_s[:courses].tolist()),
    )


def _show(event: Results) -> Iterator[str]:
    assert isinstance(event, Event)
    facts = event.facts
    yield f"{facts['hours']:g} h without a gap: {printable(event.mission.name)}"
    yield f"Drones      {facts['drones']}; charge requires at least {facts['least_drones']}"
    yield f"Hovers      {len(event.rows)}, up to {facts['longest_hover_s']:.2f} s"
    out_s = event.plans[0].phases[0].duration_s
    yield f"Rest        on {printable(facts['building'])}; take off {out_s:.2f} s before a hover\n"
    yield from turns_shown(["drone", "from [s]", "hover [s]", "rest [s]"], event.rows)


def _draw(event: Results) -> Pictures:
    """A bar per drone, and below who covers."""
    from optuav.plots.fleets import Turn, courses_drawn

    assert isinstance(event, Event)
    drones, flight_s = event.facts["drones"], event.plans[0].phases[0].duration_s
    flight_s += event.plans[0].phases[2].duration_s
    turns = [
        Turn(row["start_s"], flight_s, row["hover_s"], row["rest_s"], 0.0) for row in event.rows
    ]
    end_s = turns[-1].offset_s + turns[-1].round_s
    words = f"{event.facts['hours']:g} h without a gap, {counted(drones, 'drone')}"
    title = f"{words}: {printable(event.mission.name)}"
    yield "event.png", courses_drawn([turns[k::drones] for k in range(drones)], end_s, title)
