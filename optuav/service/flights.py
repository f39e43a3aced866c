"""An event for pilots: files per visit, and a roster in clock times as table and calendar."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np

from optuav.errors import Fault, collected, refuse
from optuav.export import Flight, PlanOnEarth, Step, shapes
from optuav.mission.files import make_directory, refusal, write_files
from optuav.mission.messages import first_ten, misfits, path_of, shown
from optuav.network import vehicle
from optuav.plan.climbs import (
    FlightCharge,
    climbs,
    flight_charges,
    short,
    taken_off_with,
    vertical_times_s,
)
from optuav.plan.export import (
    CLIMB,
    CLIMB_M,
    MISSIONS,
    course_of,
    flight_files,
    start_of,
    system_on_earth,
    with_heights_told,
)
from optuav.presentation.numbers import figure, percent, seconds
from optuav.service.event_roster import (
    AT_ONE_POINT,
    MOMENT_ROUNDING_S,
    EventRoster,
    later,
    visits_of,
)
from optuav.studies.results import as_csv

ROUTE_ENDS = ("origin", "destination")
PLACES = {"laser": "beam", "pad": "pad", "exchange": "bay"}
"""Place on the roof, by how a battery is charged; every drone has a beam or a pad for itself."""
AUDITS = (
    "For an event, limits.deadline_s does not count, and charging tapers where the available well "
    "is full. Each .plan says so to optuav audit, and with which charge it takes off. For "
    '.waypoints and .kml, state limits.deadline_s = 1e7 and battery.charging = "taper" in the '
    "mission, and for .waypoints the charge at take-off by [start]."
)
YEARS = 1970, 9998  # of a start; calendars have four digits, and an event ends later
DARK_AUDITS = (
    "No laser lights the hover of this event: leave [laser] out of the mission for .waypoints and "
    ".kml. The rests of a .kml then charge nothing: audit each .plan for what is left at a landing."
)
"""Where a pad or an exchange charges, or the laser only the rests."""
FOLD = 74  # Octets of a calendar's line, without the space that continues one


class Clock(NamedTuple):
    """Moments of a visit."""

    take_off: datetime
    on_station: datetime
    leave: datetime | None
    landing: datetime | None  # None where the drone fails before
    failed: datetime | None = None

    @property
    def end(self) -> datetime:
        """The landing, or the failure."""
        return self.landing or self.failed or self.on_station

    def as_iso(self) -> dict[str, str]:
        """Each moment by its name, with its offset from UTC; empty where there is none."""
        return {
            name: at.isoformat(timespec="seconds") if at else ""
            for name, at in self._asdict().items()
        }


class PilotFiles(NamedTuple):
    """The files that were written, and what is to be told about them."""

    paths: tuple[Path, ...]
    notes: tuple[str, ...]


class PilotFlight(NamedTuple):
    """One visit of a drone to the hover point, in clock times."""

    drone: int
    visit: int
    flight: Flight
    clock: Clock
    charge: FlightCharge  # With the climbs

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"drone-{self.drone}-visit-{self.visit}"

    @property
    def fails(self) -> bool:
        """Whether the drone fails on it: then it has no files."""
        return self.clock.failed is not None


def save_flights(
    event: EventRoster, directory: str | Path, start: str | datetime, climb_m: float | None = None
) -> PilotFiles:
    """Write the files of an event for pilots; see `Event.save_flights`."""
    folder, begin = path_of(directory, "directory"), _moment(start)
    faults = [*faults_of_flights(start, climb_m)]
    with collected(faults):
        system_on_earth(event.mission)
    refuse(faults)
    assert begin is not None
    height_m = CLIMB_M if climb_m is None else climb_m
    verdict = f"The judge flew the whole roster of {event.drones} drones: {event.replay().verdict}."
    sentences = [*_lost(event, begin, height_m), *_told(event)]
    charged = event.plans[0]
    dark = event.charged_by != "laser" or any(phase.edited for phase in charged.phases)
    said_by_all = *sentences, AUDITS, *[DARK_AUDITS] * dark
    judged_with = {
        "limits.deadline_s": charged.mission.limits.deadline_s,
        "battery.charging": charged.mission.battery.charging,
        **({"laser": None} if dark else {}),
    }
    files, flights = dict[Path, bytes](), list[PilotFlight]()
    cost = [*climbs(event.plans[0].mission, 1, height_m)]
    for drone in dict.fromkeys(course.drone for course in event.courses):
        course, visits, warnings = _of_drone(event, drone, begin, height_m)
        sentences += warnings
        course = course._replace(notes=(*course.notes, verdict, *warnings, *said_by_all))
        flights += visits
        flown = [visit for visit in visits if not visit.fails]
        if not flown:
            continue
        files[folder / f"drone-{drone}.kml"] = shapes.kml(course).encode()
        files[folder / f"drone-{drone}.geojson"] = shapes.geojson(
            with_heights_told(course)
        ).encode()
        notes = *course.notes, *cost
        for visit in flown:
            title = f"{course.name}, drone {drone} of {event.drones}, visit {visit.visit} of "
            title += f"{len(visits)}: {visit.flight.words}"
            for suffix in MISSIONS:
                file = folder / f"{visit.name}{suffix}"
                said = (title, _in_words(visit), taken_off_with(visit.charge), *notes)
                files |= flight_files(
                    visit.flight, file, height_m, course.altitude_m, said,
                    {**start_of(charged.mission, visit.charge), **judged_with},
                )  # fmt: skip
    flights.sort(key=lambda flight: flight.clock.take_off)
    rows = [_row(event, flight) for flight in flights]
    files[folder / "roster.csv"] = as_csv(rows).encode()
    files[folder / "roster.ics"] = _calendar(event, flights).encode()
    stale = [file.name for file in folder.glob("drone-*") if file not in files]
    if stale:
        words = f"holds flights of another event: {first_ten(sorted(stale))}"
        raise refusal(folder, f"{words}; name another directory, or delete them")
    from optuav.plots.files import image

    files |= {folder / name: image(axes, Path(name)) for name, axes in event.pictures(begin)}
    make_directory(folder)
    write_files(files)
    return PilotFiles(tuple(files), (*sentences, *cost))


def faults_of_flights(start: object, climb_m: object) -> Iterator[Fault]:
    """Yield the faults of a start and of a climb."""
    if climb_m is not None:
        yield from misfits(("climb_m", climb_m, CLIMB))
    moment = _moment(start)
    if moment is None:
        words = 'a date and time with its offset from UTC, such as "2027-05-01T14:00+02:00"'
        yield Fault("start", shown(start), words)
    elif not YEARS[0] <= moment.year <= YEARS[1]:
        yield Fault("start", shown(f"{start}"), f"in the years {YEARS[0]} to {YEARS[1]}")


def _lost(event: EventRoster, begin: datetime, climb_m: float) -> Iterator[str]:
    """Yield which drone fails, and how long nobody hovers then."""
    if event.lost is None:
        return
    drone, at_s = event.lost
    at = later(begin, at_s).isoformat(timespec="seconds")
    yield f"WARNING: drone {drone} fails at {at}. The others cover the rest {event.gap}."
    counted_s, flown_s = (vertical_times_s(event.mission, high)[0] for high in (CLIMB_M, climb_m))
    if flown_s > counted_s:
        yield (
            f"WARNING: the roster counts on climbs of {figure(CLIMB_M)} m: with {figure(climb_m)} "
            f"m, a drone that is sent for the failed one is {seconds(flown_s - counted_s, 1)} late."
        )


def _told(event: EventRoster) -> Iterator[str]:
    """Yield how drones may come too near to each other, on their roof and at handovers."""
    if event.drones > 1:
        shared = " at the bay, which drones may share" * (event.charged_by == "exchange")
        place = f"landing place{shared}" if shared else PLACES[event.charged_by]
        yield (
            f"WARNING: the files of all drones take off and land at one point of {event.building}: "
            f"move those of each drone to its {place}, as far apart as your drones need."
        )
    points = [vehicle.hover_point_m(cycle.mission) for cycle in event.cycles]
    hovers = sorted(event.rows, key=lambda row: row["start_s"])
    if any(
        later["start_s"] <= one["start_s"] + one["hover_s"] + MOMENT_ROUNDING_S
        and one["drone"] != later["drone"]
        and np.allclose(points[one["drone"] - 1], points[later["drone"] - 1])
        for one, later in pairwise(hovers)
    ):
        yield f"WARNING: {AT_ONE_POINT}."


def _moment(start: object) -> datetime | None:
    """A moment with its offset from UTC; None if it is none."""
    if isinstance(start, str):
        try:
            start = datetime.fromisoformat(start)
        except ValueError:
            return None
    aware = isinstance(start, datetime) and start.utcoffset() is not None
    return start if isinstance(start, datetime) and aware else None


def _of_drone(
    event: EventRoster, drone: int, begin: datetime, climb_m: float
) -> tuple[PlanOnEarth, list[PilotFlight], list[str]]:
    """The course of a drone, its flights, and why these cannot be flown with their climbs."""
    steps, clocks, charges, back_s = list[Step](), list[Clock](), list[FlightCharge](), -inf
    warnings, (up_s, down_s) = list[str](), vertical_times_s(event.mission, climb_m)
    lost_s = event.lost.at_s if event.lost and event.lost.drone == drone else inf
    for _, offset_s, plan in (course for course in event.courses if course.drone == drone):
        course, visits = course_of(plan), [*visits_of(plan.phases)]
        if steps:  # Its pack was exchanged
            rest = Step("rest", event.building, (course.start,), offset_s - back_s, 0.0)
            steps.append(rest)
        for out, hover, *_, back in visits:
            moments_s = out.start_s - up_s, hover.start_s, hover.end_s, back.end_s + down_s
            take_off, station, leave, landing = (later(begin, offset_s + s) for s in moments_s)
            clock = Clock(take_off, station, leave, landing)
            if lost_s < offset_s + back.end_s + down_s:
                hovers = lost_s <= offset_s + hover.end_s + MOMENT_ROUNDING_S
                clock = Clock(
                    take_off, station, None if hovers else leave, None, later(begin, lost_s)
                )
            clocks.append(clock)
        charges_of_drone = flight_charges(plan.mission, plan.phases, climb_m, on_time=True)
        warnings += short(plan.mission, charges_of_drone, f"drone {drone}")
        charges += charges_of_drone
        back_s = offset_s + plan.phases[-1].end_s
        steps += (
            step._replace(place=event.building) if step.place in ROUTE_ENDS else step
            for step in course.steps
        )
    course = course._replace(steps=tuple(steps), start_place=event.building)
    rows = zip(course.flights, clocks, charges, strict=True)
    if clocks[-1].failed is not None:  # Only the last visit can fail
        left = len(clocks) - 1
        rests = [number for number, step in enumerate(steps) if step.kind == "rest"]
        steps = steps[: rests[left - 1]] if left else []
    return (
        course._replace(steps=tuple(steps)),
        [
            PilotFlight(drone, number, flight, clock, charge)
            for number, (flight, clock, charge) in enumerate(rows, start=1)
        ],
        [*dict.fromkeys(warnings)],
    )


def _place(event: EventRoster, flight: PilotFlight) -> str:
    """The place on the roof where a drone's battery is charged or exchanged."""
    number = f" {flight.drone}" * (event.charged_by != "exchange")
    return f"{PLACES[event.charged_by]}{number}"


def _row(event: EventRoster, flight: PilotFlight) -> dict[str, object]:
    """A row of the roster."""
    moments, fails = flight.clock.as_iso(), flight.fails
    if event.lost is None:
        del moments["failed"]
    return {
        "drone": flight.drone,
        "visit": flight.visit,
        **moments,
        "roof": event.building,
        "place": _place(event, flight),
        "battery_at_take_off_percent": round(100.0 * flight.charge.at_take_off, 1),
        "battery_left_percent": "" if fails else round(100.0 * flight.charge.at_landing, 1),
        "files": "" if fails else flight.name,
    }


def _in_words(flight: PilotFlight) -> str:
    """The moments of a flight, and the charge at its landing."""
    moments = flight.clock.as_iso().items()
    words = ", ".join(f"{name.replace('_', ' ')} {at}" for name, at in moments if at)
    if flight.fails:
        return f"{words}: the drone fails on this flight."
    return f"{words}; {percent(flight.charge.at_landing)} of the battery left."


def _calendar(event: EventRoster, flights: Sequence[PilotFlight]) -> str:
    """The roster as a calendar of one entry per flight (RFC 5545)."""
    lines = ["BEGIN:VCALENDAR", "VERSION:2.0", "PRODID:-//optuav//event//EN"]
    for flight in flights:
        begin, end = (_utc(moment) for moment in (flight.clock.take_off, flight.clock.end))
        fails = ", fails" * flight.fails
        title = f"Drone {flight.drone}, visit {flight.visit}{fails}: {event.mission.name}"
        lines += [
            "BEGIN:VEVENT",
            f"UID:{flight.name}-{begin}@optuav",
            f"DTSTAMP:{_utc(flights[0].clock.take_off)}",
            f"DTSTART:{begin}",
            f"DTEND:{end}",
            f"SUMMARY:{_escaped(title)}",
            f"LOCATION:{_escaped(f'{event.building}, {_place(event, flight)}')}",
            f"DESCRIPTION:{_escaped(_in_words(flight))}",
            "END:VEVENT",
        ]
    return "".join(map(_folded, [*lines, "END:VCALENDAR"]))


def _utc(moment: datetime) -> str:
    """A moment as calendars state it."""
    return moment.astimezone(UTC).strftime("%Y%m%dT%H%M%SZ")


def _escaped(text: str) -> str:
    """A text as a value of a calendar."""
    return re.sub(r"([\\;,])", r"\\\1", text).replace("\n", "\\n")


def _folded(line: str) -> str:
    """A line of a calendar, broken into lines of at most 75 octets."""
    parts = [""]
    for sign in line:
        if len((parts[-1] + sign).encode()) > FOLD:
            parts.append("")
        parts[-1] += sign
    return "\r\n ".join(parts) + "\r\n"
