"""Drones that cover some hours without a gap, all full at the start."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TypeAlias

import numpy as np

from optuav.errors import Fault, NoPlanError, printable, refuse
from optuav.fields import Range
from optuav.mission.messages import misfits, plural, shown
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.presentation.numbers import figure
from optuav.service.endless import EndlessCycle
from optuav.service.event_roster import AT_LEAST, EventHover, EventRoster, courses_of, judged
from optuav.service.failure import Failure, failure_of
from optuav.service.fleet import OVERLAP, need_handover
from optuav.service.flights import save_flights
from optuav.service.roster import DroneRing, Roster, hovers_in_turns, rosters_of
from optuav.service.visit import Visit

Progress: TypeAlias = Callable[[int, int | None, str], None]
HOURS = Range("h", gt=0.0, le=240.0)
MOST_EVENT_DRONES = 100
DRONES = Range("-", ge=1, le=MOST_EVENT_DRONES, whole=True)
BUILDINGS = 20  # Buildings that are tried although others beat them


@dataclass(frozen=True, kw_only=True, repr=False)
class Event(EventRoster):
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
        return failure_of(self, drone, at_s)

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
            ``"2027-05-01T14:00+02:00"``, in the years 1970 to 9998.
        climb_m
            Height of every take-off above its place, see `Plan.export`.

        Returns
        -------
        tuple of Path
            The files that were written: per drone and visit ``drone-1-visit-2.plan`` and
            ``.waypoints`` with its notes in ``.txt``; per drone ``.kml`` and ``.geojson``;
            ``roster.csv`` and the calendar ``roster.ics`` with take-off, arrival on station,
            departure and landing in clock times, with climb and descent; the roof, the drone's
            pad, beam or bay, and the battery at take-off and left; and ``event.png``. They carry
            the judge's verdict, and a warning where climbs leave less than the reserve.

        Raises
        ------
        InputError
            If the start has no offset, start or climb is out of range, the mission has no place
            on Earth, or a file cannot be written; then none is.

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
        return save_flights(self, directory, start, climb_m).paths


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
    spots = [{visit.building: visit for visit in (c.finite_cycle(), *c.visits)} for c in apart]
    until_s, least, able = 3600.0 * hours, 0, list[DroneRing]()
    tried, tell = itertools.count(), progress or (lambda *_: None)
    for count in range(1, MOST_EVENT_DRONES + 1):
        number = plural(count, "drone")
        tell(next(tried), None, number)
        before, able = {ring.building for ring in able}, []
        for visit in visits:
            if (ring := _ring(visit, spots, count, until_s, overlap_s)) is not None and (
                ring.building in before
                or hovers_in_turns(ring, ring.longest_s("balanced_s")) is not None
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
            raise NoPlanError(f"{number} cannot cover {figure(hours)} h: {AT_LEAST} {least}")
        for roster in (roster for ring in able for roster in rosters_of(ring)):
            tell(next(tried), None, f"{number} on {printable(roster.ring.building)}")
            if roster.lowest_As >= -JUDGE_TOLERANCE * float(roster.battery.capacity_As):
                event = _event(cycles, hours, least, roster, separation_m)
                if event.replay().flyable:
                    return judged(event)
        if drones is not None:
            words = (
                f"charge allows {number} for {figure(hours)} h, but every roster that optuav tried "
            )
            words += "empties an available well: allow more drones, or leave their number open"
            raise NoPlanError(words)
    if not least:
        raise NoPlanError(
            f"even {MOST_EVENT_DRONES} drones cannot cover {figure(hours)} h by charge"
        )
    words = (
        f"charge allows {plural(least, 'drone')} for {figure(hours)} h, but every roster that "
        "optuav"
    )
    raise NoPlanError(
        f"{words} tried, of up to {MOST_EVENT_DRONES} drones, empties an available well"
    )


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
) -> DroneRing | None:
    """Drones that rest on the building of a visit; None if one of them cannot hover."""
    at = [{visit.building: visit}, *spots]
    spotted = spots_of(drones, len(at))
    visits = [at[n].get(visit.building) for n in spotted if n < len(at)]
    able = [
        visit for visit in visits if visit and visit.from_full_s is not None and visit.longest_s
    ]
    return DroneRing(tuple(able), until_s, overlap_s) if len(able) == drones else None


def _promising(visits: Sequence[Visit]) -> list[Visit]:
    """The first visit, those that none beats in legs and charging current, and some of the rest.

    In charge, no visit needs fewer drones than one that beats it. Through the wells it may, as the
    rosters that are tried are not all that there are.
    """
    kept, beaten = [*visits[:1]], list[Visit]()
    for visit in sorted(visits[1:], key=lambda visit: (visit.flight_s, visit.flight_As)):
        better = any(
            other.flight_s <= visit.flight_s
            and other.flight_As <= visit.flight_As
            and (other.rest_A >= visit.rest_A or visit.swap_s is not None)
            for other in kept
        )
        (beaten if better else kept).append(visit)
    kept += beaten[: max(BUILDINGS - len(kept), 0)]
    return [visit for visit in kept if visit.from_full_s is not None and visit.longest_s]


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
