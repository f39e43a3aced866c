"""A drone that fails in an event: the gap it makes, who can cover it, and the new roster."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise, permutations
from typing import Literal, NamedTuple, TypedDict

import numpy as np

from optuav.arrays import Floats
from optuav.errors import printable, refuse
from optuav.fields import Range
from optuav.mission.messages import misfits, plural
from optuav.physics.kibam import Stage, Tilted, Wells, tapered
from optuav.physics.roots import bisect_largest
from optuav.plan.climbs import vertical_times_s
from optuav.plan.export import CLIMB_M
from optuav.presentation.blocks import Block, Facts, Heading, Table
from optuav.presentation.numbers import figure, fixed, seconds
from optuav.service.event_roster import (
    AT_ONE_POINT,
    MOMENT_ROUNDING_S,
    EventHover,
    EventRoster,
    Lost,
    courses_of,
    judged,
    visits_of,
)
from optuav.service.fleet import turns_table
from optuav.service.roster import EXTRA_HOVERS, SHARES_OF_LONGEST, Constraints, solved
from optuav.service.visit import Visit
from optuav.silence import silent
from optuav.studies.results import Pictures, Result

MOST_ORDERS = 720  # Orders of drones that are looked at
ORDERS = 24  # Orders of drones that are tried to keep them apart, where some roster was found
NONE_FOUND = "none was found: the drones that are left cannot cover the rest"
COVER_UNITS = {"drone": "-", "state": "", "ready_s": "s", "hover_s": "s"}
State = Literal["rests", "flies out", "hovers", "flies back"]


class Cover(TypedDict):
    """A row of a failure: a drone that is left, when it can hover, and for how long."""

    drone: int
    state: State
    ready_s: float
    hover_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Failure(Result):
    """What a drone that fails means for an event, with one row per drone that is left.

    Moments count from the start of the event. A drone that is sent for the failed one takes off
    after the failure, and first climbs 12 m, as the files of `Event.save_flights` do.

    Parameters
    ----------
    drone, at_s
        Which one fails, and when [s].
    gaps_s
        When nobody hovers if the others keep to the roster (begin, end) [s], counted from the
        start of the event.
    gap_s, gap_from_s
        How long nobody hovers if the others keep to the roster, all gaps together, and when the
        first gap begins [s].
    roster, new_gap_s
        The roster of the others for the rest of the event and how long nobody hovers in it [s];
        None if none was found.
    reason
        Why there is no such roster, or what it cannot keep; or None.

    Examples
    --------
    >>> import optuav
    >>> event = optuav.coverage("matrice350").event(4, 5)
    >>> failure = event.without(2, at_s=2000)
    >>> [row["state"] for row in failure.rows], round(failure.new_gap_s)
    (['rests', 'rests', 'rests', 'rests'], 44)
    """

    kind = "optuav event failure"
    units = COVER_UNITS
    rows: tuple[Cover, ...]
    drone: int
    at_s: float
    gaps_s: tuple[tuple[float, float], ...]
    gap_s: float
    gap_from_s: float | None
    new_gap_s: float | None
    reason: str | None
    roster: EventRoster | None = field(repr=False)

    def blocks(self) -> Iterator[Block]:
        """Yield the gap, who can cover it, and the new roster."""
        lost = f"Without drone {self.drone} from {figure(self.at_s)} s on"
        yield Heading(f"{lost}: {printable(self.mission.name)}")
        gap = "none"
        if self.gap_from_s is not None:
            gap = f"{seconds(self.gap_s)}, from {seconds(self.gap_from_s)} on"
        if len(self.gaps_s) > 1:
            gaps = ", ".join(f"{fixed(begin)} to {seconds(end)}" for begin, end in self.gaps_s)
            gap = f"{seconds(self.gap_s)} in {len(self.gaps_s)} gaps, {gaps}"
        words = [] if self.reason is None else [self.reason]
        if self.roster is not None:
            words[:0] = [f"{plural(len(self.rows), 'drone')}, {self.roster.gap}"]
        yield Facts([("Gap", f"{gap}, if nothing changes"), ("New roster", "; ".join(words))])
        cells = [
            [str(row["drone"]), row["state"], fixed(row["ready_s"]), fixed(row["hover_s"])]
            for row in self.rows
        ]
        yield Table(["drone", "state", "on station from [s]", "can hover [s]"], cells)
        if self.roster is not None:
            yield turns_table(["drone", "from [s]", "hover [s]", "rest [s]"], self.roster.rows)

    def pictures(self) -> Pictures:
        """Yield the new roster, if there is one."""
        if self.roster is not None:
            yield from self.roster.pictures()


class Duty(NamedTuple):
    """A drone that is left: its legs, and its battery at its last landing before a new visit."""

    drone: int
    visit: Visit
    out_s: float
    climb_s: float  # Before that leg
    landed_s: float  # −inf for one that has not flown
    charge: Wells  # At the landing

    def rested(self, at_s: float) -> Wells:
        """Both wells at a take-off [A s]."""
        visit, battery = self.visit, self.visit.battery
        if visit.swap_s is not None or self.landed_s == -math.inf:
            return battery.full
        return tapered(battery, self.charge, Stage(visit.rest_A, at_s - self.landed_s))

    def ready_s(self, at_s: float) -> float:
        """Earliest arrival at the hover point, if it may take off from a moment on [s]."""
        landed_s = self.landed_s + (self.visit.swap_s or 0.0)
        return max(at_s + self.climb_s, landed_s) + self.out_s

    def hover_s(self, ready_s: float) -> float:
        """Longest hover from an arrival on [s]; 0 without any."""
        charge = Tilted.of(self.visit.battery, self.rested(ready_s - self.out_s))
        longest = bisect_largest(
            lambda hover_s: self.visit.lasts(charge, hover_s), self.visit.most_s
        )
        return 0.0 if longest is None else longest[0]


class Current(NamedTuple):
    """The visit of a drone in the air that goes on, as long as is planned: the last that began."""

    duty: Duty  # Before this visit
    row: EventHover


class Succession(NamedTuple):
    """Drones in the order in which they hover after a failure, the current one first, if any."""

    current: Current | None
    order: tuple[Duty, ...]  # Repeated without end
    at_s: float  # When the failure is
    begin_s: float  # When the first one hovers
    pause_s: float  # Between the current hover's handover and the next hover

    @property
    def apart(self) -> bool:
        """Whether neighbours have two hover points."""
        hovers = [self.duty(number) for number in range(len(self.order) + 2)]
        return all(one.visit is not other.visit for one, other in pairwise(hovers))

    def duty(self, number: int) -> Duty:
        """The drone of a hover, as it is after the failure."""
        if self.current is not None:
            if number == 0:
                return self.current.duty
            number -= 1
        return self.order[number % len(self.order)]


class Failing(NamedTuple):
    """An event in which a drone fails."""

    event: EventRoster
    drone: int
    at_s: float
    climb_s: float  # After every take-off, before the leg that is planned

    def takes_off_s(self, row: EventHover) -> float:
        """The take-off before a hover, with its climb [s]."""
        leg_s = self.event.cycles[row["drone"] - 1].phases[0].duration_s
        return row["start_s"] - leg_s - self.climb_s

    def flown(self) -> Iterator[EventHover]:
        """Yield the hovers that began before the failure; the failed drone's ends with it."""
        for row in self.event.rows:
            if row["drone"] != self.drone and self.takes_off_s(row) < self.at_s:
                yield row
            elif row["drone"] == self.drone and row["start_s"] < self.at_s:
                hover_s = min(row["hover_s"], self.at_s - row["start_s"])
                yield EventHover({**row, "hover_s": hover_s})


def failure_of(event: EventRoster, drone: int, at_s: float) -> Failure:
    """Return what a failure means; see `Event.without`."""
    until_s = 3600.0 * event.hours
    drones, moments = Range("-", ge=1, le=event.drones, whole=True), Range("s", ge=0, lt=until_s)
    refuse(misfits(("drone", drone, drones), ("at_s", at_s, moments)))
    at_s = float(at_s)
    failing = Failing(event, drone, at_s, vertical_times_s(event.mission, CLIMB_M)[0])
    gaps = _gaps((row for row in event.rows if row["drone"] != drone), at_s, until_s)
    left = [number for number in range(1, event.drones + 1) if number != drone]
    duties = [_duty(failing, number, at_s) for number in left]
    if gaps:
        roster, reason, gap_s = _new_roster(failing, duties)
    else:
        roster, reason, gap_s = _as_planned(failing), None, 0.0
    return Failure(
        mission=event.mission,
        rows=tuple(_cover(failing, duty) for duty in duties),
        drone=drone,
        at_s=at_s,
        gaps_s=tuple(gaps),
        gap_s=sum(end_s - begin_s for begin_s, end_s in gaps),
        gap_from_s=gaps[0][0] if gaps else None,
        new_gap_s=gap_s,
        reason=reason,
        roster=roster,
    )


def _gaps(rows: Iterable[EventHover], from_s: float, until_s: float) -> list[tuple[float, float]]:
    """Return when nobody hovers (begin, end) [s]."""
    gaps, covered_s = list[tuple[float, float]](), from_s
    for row in sorted(rows, key=lambda row: row["start_s"]):
        if row["start_s"] > covered_s + MOMENT_ROUNDING_S:
            gaps.append((covered_s, row["start_s"]))
        covered_s = max(covered_s, row["start_s"] + row["hover_s"])
    return gaps + [(covered_s, until_s)] * (until_s > covered_s + MOMENT_ROUNDING_S)


def _duty(failing: Failing, drone: int, before_s: float) -> Duty:
    """A drone as it is after the last of its visits that took off before a moment [s]."""
    event, climb_s = failing.event, failing.climb_s
    visit, out = event.ring.visits[drone - 1], event.cycles[drone - 1].phases[0]
    landed_s, charge = -math.inf, visit.battery.full
    for course in (course for course in event.courses if course.drone == drone):
        for first, *_, back in visits_of(course.plan.phases):
            if course.offset_s + first.start_s - climb_s < before_s - MOMENT_ROUNDING_S:
                landed_s = course.offset_s + back.end_s
                charge = Wells(back.available_As[0], back.bound_As[0])
    return Duty(drone, visit, out.duration_s, climb_s, landed_s, charge)


def _in_the_air(failing: Failing, drone: int) -> Current | None:
    """The visit of a drone that is under way at the failure and has not left the hover point."""
    for row in failing.event.rows:
        takes_off_s, leaves_s = failing.takes_off_s(row), row["start_s"] + row["hover_s"]
        if row["drone"] == drone and takes_off_s < failing.at_s < leaves_s:
            return Current(_duty(failing, drone, takes_off_s), row)
    return None


def _cover(failing: Failing, duty: Duty) -> Cover:
    """When a drone can be on station, and for how long."""
    at_s = failing.at_s
    if (current := _in_the_air(failing, duty.drone)) is not None:
        start_s = current.row["start_s"]
        hover_s = current.duty.hover_s(start_s) - max(at_s - start_s, 0.0)
        state: State = "hovers" if start_s <= at_s else "flies out"
        ready_s = max(at_s, start_s)
    else:
        ready_s = duty.ready_s(at_s)
        state, hover_s = "flies back" if duty.landed_s > at_s else "rests", duty.hover_s(ready_s)
    return Cover(drone=duty.drone, state=state, ready_s=ready_s, hover_s=max(hover_s, 0.0))


def _new_roster(
    failing: Failing, duties: list[Duty]
) -> tuple[EventRoster | None, str | None, float | None]:
    """The roster of the drones that are left, what is to be said of it, and its gap [s]."""
    event, at_s = failing.event, failing.at_s
    flying = [in_the_air for duty in duties if (in_the_air := _in_the_air(failing, duty.drone))]
    current = max(flying, key=lambda drone: drone.row["start_s"], default=None)
    under_way = None if current is None else (current.row["drone"], current.row["start_s"])
    kept = [row for row in failing.flown() if (row["drone"], row["start_s"]) != under_way]
    best: tuple[EventRoster | None, str | None, float | None] = (None, NONE_FOUND, None)
    for succession in _successions(event, at_s, duties, current):
        if best[0] is not None and not succession.apart:
            continue
        for share in SHARES_OF_LONGEST:
            hovers_s = _hovers_left(event, succession, share)
            if hovers_s is None:
                break
            roster = _roster(failing, kept, succession, hovers_s)
            if roster is not None and roster.replay().flyable:
                begin_s, end_s = roster.excused or (at_s, at_s)
                close = bool(event.separation_m) and not roster.separation_m
                best = judged(roster), AT_ONE_POINT if close else None, end_s - begin_s
                if not close:
                    return best
                break
    return best


def _successions(
    event: EventRoster, at_s: float, duties: list[Duty], current: Current | None
) -> list[Succession]:
    """Return orders of drones that may follow, those with the shortest gap first.

    At first they keep the ring; then neighbours have two points, if the event asks for that.
    """
    successions = list[tuple[float, Succession]]()
    rings = [(*duties[number:], *duties[:number]) for number in range(len(duties))]
    others = permutations(duties) if event.separation_m else ()
    mixed = [order for order in islice(others, MOST_ORDERS) if order not in rings]
    for order in (*rings, *mixed):
        duty, *_ = order
        ready_s = duty.ready_s(at_s)
        if current is None:
            successions.append((ready_s, Succession(None, order, at_s, ready_s, 0.0)))
        elif duty.drone != current.duty.drone:
            begin_s = current.row["start_s"]
            successions.append((0.0, Succession(current, order, at_s, begin_s, 0.0)))
            leaves_s = begin_s + current.duty.hover_s(begin_s)
            if (pause_s := ready_s - leaves_s + event.overlap_s) > event.overlap_s:
                paused = Succession(current, order, at_s, begin_s, pause_s)
                successions.append((pause_s, paused))

    ordered = [succession for _, succession in sorted(successions, key=lambda pair: pair[0])]
    first = [succession for succession in ordered if succession.order in rings]
    apart = (succession for succession in ordered if succession.apart)
    return [*first, *islice(apart, ORDERS)]


def _as_planned(failing: Failing) -> EventRoster:
    """The event where nobody misses the drone that fails: only its later rest is left out."""
    lost, kept = failing.drone, [*failing.flown()]
    rows = [row for row in failing.event.rows if row["drone"] != lost]
    rows += [row for row in kept if row["drone"] == lost]
    rows.sort(key=lambda row: row["start_s"])
    return judged(_with_rows(failing, rows, []))  # The others fly what the judge has flown


def _roster(
    failing: Failing, kept: list[EventHover], succession: Succession, hovers_s: Floats
) -> EventRoster | None:
    """The event with hovers after a failure, if it has one gap at most."""
    event = failing.event
    rows, start_s = [*kept], succession.begin_s
    for number, hover_s in enumerate(hovers_s.tolist()):
        drone = succession.duty(number).drone
        if hover_s > MOMENT_ROUNDING_S:  # Else its turn is left out
            rows.append(EventHover(drone=drone, start_s=start_s, hover_s=hover_s, rest_s=0.0))
        start_s += hover_s - event.overlap_s + succession.pause_s * (number == 0)
    rows.sort(key=lambda row: row["start_s"])
    gaps = _gaps(rows, 0.0, 3600.0 * event.hours)
    return None if len(gaps) > 1 else _with_rows(failing, rows, gaps)


def _with_rows(
    failing: Failing, hovers: list[EventHover], gaps: list[tuple[float, float]]
) -> EventRoster:
    """The event with other hovers in order of time, the rests between them, and a gap or none."""
    event, rows, at_s = failing.event, [*hovers], failing.at_s
    for number, row in enumerate(rows):
        later = (after for after in rows[number + 1 :] if after["drone"] == row["drone"])
        rest_s = 0.0
        if (after := next(later, None)) is not None:
            away_s = after["start_s"] - row["start_s"] - row["hover_s"]
            rest_s = away_s - event.ring.visits[row["drone"] - 1].flight_s
        rows[number] = EventHover({**row, "rest_s": rest_s})
    apart = all(
        event.ring.visits[row["drone"] - 1] is not event.ring.visits[after["drone"] - 1]
        for row, after in pairwise(rows)
        if after["start_s"] <= row["start_s"] + row["hover_s"] + MOMENT_ROUNDING_S
    )
    return replace(
        event,
        rows=tuple(rows),
        longest_hover_s=max(row["hover_s"] for row in rows),
        separation_m=event.separation_m if apart else None,
        courses=courses_of(event.ring, event.cycles, rows),
        excused=gaps[0] if gaps else (at_s, at_s),
        lost=Lost(failing.drone, at_s),
    )


def _hovers_left(event: EventRoster, succession: Succession, share: float) -> Floats | None:
    """Hovers of a succession until the end of the event if only charge counts [s], or None.

    None is longer than a share of what full wells allow, but the current one.
    """
    most_s = max(duty.visit.most_s for duty in succession.order)
    begin_s, overlap_s = succession.begin_s, event.overlap_s
    left_s = 3600.0 * event.hours - begin_s - overlap_s - succession.pause_s
    fewest = max(math.ceil(left_s / (most_s - overlap_s) - 1e-9), 1)
    for count in range(fewest, fewest + EXTRA_HOVERS * len(succession.order) + 1):
        hovers_s = _programme_left(event, succession, share, count)
        if hovers_s is not None:
            return hovers_s
    return None


@silent()
def _programme_left(
    event: EventRoster, succession: Succession, share: float, count: int
) -> Floats | None:
    """Hovers of a given number [s]; see `optuav.service.roster._programme`.

    Drones have the charge and the place that the failure left them with, and need not take turns
    from the start.
    """
    overlap_s, current, until_s = event.overlap_s, succession.current, 3600.0 * event.hours
    climbs_s = sum(vertical_times_s(event.mission, CLIMB_M))
    paused_s = succession.pause_s * (count > 1)
    rows, last, margin = list[Constraints](), dict[int, int](), 2 * count
    shift_s = [succession.begin_s - k * overlap_s + paused_s * (k > 0) for k in range(count)]
    hovers = event.ring.least_s(count)
    least = np.concatenate([hovers, np.zeros(count + 1)])
    highest = np.empty(2 * count + 1)

    def add(weights: Mapping[int, float], limit: float) -> None:
        columns, values = np.array([[*weights]]), np.array([[*weights.values()]])
        rows.append((columns, values, np.array([limit])))

    for k in range(count):
        duty = succession.duty(k)
        visit, charge = duty.visit, count + k
        rest_A, swap_s = visit.rest_A, visit.swap_s or 0.0
        highest[[k, charge, -1]] = share * visit.most_s, *2 * [float(visit.battery.capacity_As)]
        add({k: visit.hover_A, charge: -1.0, margin: 1.0}, -visit.flight_As - visit.least_As)
        before = last.get(duty.drone)
        between = dict.fromkeys(range(0 if before is None else before + 1, k), -1.0)
        gained = {charge: 1.0} | dict.fromkeys(between, -rest_A)
        last[duty.drone] = k
        if k == 0 and current is not None:
            highest[0], least[0] = visit.most_s, max(least[0], succession.at_s - succession.begin_s)
            highest[charge] = duty.rested(succession.begin_s - duty.out_s).total_As
            continue
        if before is not None:
            spare_s = shift_s[k] - shift_s[before] - visit.flight_s
            gained |= {before: visit.hover_A, count + before: -1.0}
            limit_As = -visit.flight_As + rest_A * spare_s
            spare_s -= swap_s or climbs_s  # The files take climbs from the rests
        else:
            spare_s = shift_s[k] - duty.ready_s(succession.at_s)
            flown = duty.landed_s > -math.inf
            rested_s = shift_s[k] - duty.out_s - duty.landed_s if flown else 0.0
            limit_As = float(duty.charge.total_As) + rest_A * rested_s
            gained = gained if flown else {charge: 1.0}
        if between:
            add(between, spare_s)
        elif spare_s < -MOMENT_ROUNDING_S:
            return None
        if visit.swap_s is None:  # Else every pack is full
            add(gained, limit_As)
    if (highest < least).any():
        return None
    total_s = until_s - succession.begin_s + (count - 1) * overlap_s - paused_s
    answer = solved(rows, total_s, least, highest)
    return None if answer is None else answer[:count]
