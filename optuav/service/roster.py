"""Rosters of drones in turns whose charge lasts: a linear programme, and the wells after it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from threading import Thread
from typing import TypeAlias

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.physics.kibam import Battery, Stage, Wells, step, tapered
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.service.fleet import upwards
from optuav.service.visit import Visit
from optuav.silence import silent

Constraints: TypeAlias = tuple[Integers, Floats, Floats]
"""Columns and weights of unknowns (row, entry), and the largest sum of each row (row,)."""
SHARES_OF_LONGEST = (1.0, 0.99, 0.97, 0.95, 0.9, 0.8, 0.7, 0.6)
"""Shares of the longest hover from full wells to which hovers are kept, until a replay holds."""
RUN_SHARE = 0.75  # Share of all hovers that a run holds, beside the run of all
HOVERS_FOR_INTERIOR_POINT = (
    500  # Hovers from which an interior point is found sooner than by the simplex method
)
WAITED_S = 0.1  # Between looks at a programme that is solved
EXTRA_HOVERS = 2  # Hovers beyond the fewest that are tried, per drone


@dataclass(frozen=True)
class DroneRing:
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


def rosters_of(ring: DroneRing) -> Iterator[Roster]:
    """Yield rosters that keep charge, ever shorter hovers, and last the ring without an end."""
    for share in SHARES_OF_LONGEST:
        hovers_s = hovers_in_turns(ring, ring.longest_s("most_s", share))
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

    ring: DroneRing
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


def hovers_in_turns(ring: DroneRing, longest_s: Floats) -> Floats | None:
    """Hovers in ring order that cover a time if only charge counts [s]; None without any.

    None is longer than the drone's longest (drone,) [s]. A linear programme finds the hovers that
    keep most charge at the lowest landing. It tries at most two hovers per drone beyond the fewest
    possible: each costs two legs.
    """
    most_s, drones = float(longest_s.max()), ring.drones
    if most_s <= ring.overlap_s:
        return None
    fewest = math.ceil((ring.until_s - ring.overlap_s) / (most_s - ring.overlap_s) - 1e-9)
    scarce, small = ring, JUDGE_TOLERANCE * float(ring.cheapest.battery.capacity_As)
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


def _overdrawn_As(ring: DroneRing, longest_s: float, count: int, width: int) -> float:
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
def _programme(ring: DroneRing, longest_s: Floats, count: int) -> Floats | None:
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
