"""Fleets of equal drones that take turns at the hover point, and the power of their pads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal, NamedTuple, TypedDict

from optuav.errors import MOST_SHOWN, Fault, InputError, NoPlanError, printable, refuse
from optuav.fields import Range
from optuav.judge.fleets import FleetReplay, replay_fleet
from optuav.mission import Mission
from optuav.mission.messages import misfits, plural, shown
from optuav.network.timeline import Phase, simulated
from optuav.physics.roots import bisect_largest
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Heading, Table
from optuav.presentation.numbers import amperes, figure, fixed, percent, seconds, watts
from optuav.service.calm_air import calm_facts
from optuav.service.endless import EndlessCycle
from optuav.service.visit import Visit
from optuav.studies.results import Pictures, Result

SHARE = Range("-", gt=0, le=1000, note=", where 1 is all of the time")
OVERLAP = Range("s", ge=0, le=1e7)
COUNT = Range("-", ge=1, le=10_000, whole=True)
FLEET_DRONE_UNITS = {"drone": "-", "offset_s": "s", "flight_s": "s", "hover_s": "s", "rest_s": "s"}
FLEET_DRONE_UNITS |= {"wait_s": "s"}
DAY_S = 86_400.0
ROUNDED_COUNT = 1e-9  # Relative, by which a count may be above a whole number
MOST_FLEET_DRONES = 100_000  # Drones of a fleet
MOST_A = 1e9  # Current of a pad beyond which none is strong enough [A]


class FleetDrone(TypedDict):
    """A row of a fleet: when a drone takes off first, and its times in every turn."""

    drone: int
    offset_s: float
    flight_s: float
    hover_s: float
    rest_s: float
    wait_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Fleet(Result):
    """Identical drones that take turns in a ring, one row per drone.

    Parameters
    ----------
    drones, places, beams
        Numbers of drones, of places to rest (pads, or bays where packs are exchanged) and of beams.
    offsets_s, starts_every_s
        (drone,) first take-off of each drone, and the time between two departures [s].
    share, asked_share, longest_gap_s
        Mean number of drones that hover, the requested number, and the longest time with fewer
        drones than requested [s].
    overlap_s, hover_s, rest_s
        Time that two drones hover together at a handover; hover and rest of a cycle [s].
    building, charged_by
        Where the drones rest, and ``"laser"``, ``"pad"`` or ``"exchange"``.
    calm_drones, in_calm_air
        If the hover depends on the wind, the number of drones in calm air, None without a fleet
        there, and the same in words; else None.

    Examples
    --------
    >>> import optuav
    >>> fleet = optuav.coverage("matrice350").fleet()
    >>> fleet.drones, fleet.places, fleet.beams
    (4, 3, 4)
    """

    kind = "optuav fleet"
    units = FLEET_DRONE_UNITS
    rows: tuple[FleetDrone, ...]
    drones: int
    places: int
    beams: int
    offsets_s: tuple[float, ...]
    starts_every_s: float
    share: float
    asked_share: float
    overlap_s: float
    longest_gap_s: float
    hover_s: float
    rest_s: float
    building: str
    charged_by: Literal["laser", "pad", "exchange"]
    calm_drones: int | None = None
    in_calm_air: str | None = None
    plan: Plan = field(repr=False)
    visit: Visit = field(repr=False)

    def replay(self, days: float = 4.0) -> FleetReplay:
        """Simulate the fleet for some days with the judge; all drones start with full batteries.

        A charger stays on while its drone waits, until the next drone needs the place. Days are > 0
        and up to 30 [d]; otherwise it raises `InputError`.
        """
        refuse(misfits(("days", days, Range("d", gt=0, le=30))))
        visit, until_s = self.visit, days * DAY_S
        turn_s = self.starts_every_s * self.drones
        ground_s = turn_s - self.hover_s - visit.flight_s
        turns = math.ceil(until_s / turn_s) + 1
        # An exchange fills the wells, so that every visit is a course of its own.
        visits, courses = (turns, 1) if visit.swap_s is None else (1, turns)
        plan = repeated(self.plan, [(self.hover_s, ground_s)] * visits)
        starts_s = [s + turn_s * turn for turn in range(courses) for s in self.offsets_s]
        return replay_fleet(
            [plan] * len(starts_s),
            starts_s,
            drones=self.drones,
            share=self.asked_share,
            overlap_s=self.overlap_s,
            until_s=until_s,
            places=self.places,
            place_s=ground_s if visit.swap_s is None else visit.swap_s,
            beams=self.beams if self.charged_by == "laser" else None,
        )

    def blocks(self) -> Iterator[Block]:
        """Yield the counts, and the times of the drones."""
        words = covering(self.asked_share, self.overlap_s)
        yield Heading(f"Fleet {words}: {printable(self.mission.name)}")
        places = f"{self.places} on {printable(self.building)}, {self.beams} beams"
        gap = f"{seconds(self.longest_gap_s)} at most; {figure(self.share, 4)} hover on average"
        yield Facts(
            [
                ("Drones", f"{self.drones}, a start every {seconds(self.starts_every_s)}"),
                ("Places", places),
                ("Gap", gap),
                *calm_facts(self.in_calm_air),
            ]
        )
        yield turns_table([name.replace("_s", " [s]") for name in FLEET_DRONE_UNITS], self.rows)

    def pictures(self) -> Pictures:
        """Yield a bar per drone."""
        from optuav.plots.fleets import Turn, fleet_turns
        from optuav.plots.style import titled

        turns = [
            Turn(row["offset_s"], row["flight_s"], row["hover_s"], row["rest_s"], row["wait_s"])
            for row in self.rows
        ]
        words = covering(self.asked_share, self.overlap_s)
        title = titled(self.mission.name, f"{plural(self.drones, 'drone')} {words}")
        yield "fleet.png", fleet_turns(turns, title=title)


def repeated(cycle: Plan, stays_s: Sequence[tuple[float, float]]) -> Plan:
    """A plan of visits with hovers and rests [s] but the last, from full, that charges tapering."""
    mission = cycle.mission.replace(
        {"start": None, "battery.charging": "taper", "limits.deadline_s": 1e7}
    )
    out, hover, back, *rest = cycle.phases
    phases = list[Phase]()
    for hover_s, rest_s in stays_s:
        phases += [replace(out, start_place=str(cycle.building)), lasting(hover, hover_s), back]
        phases += [lasting(stay, rest_s) for stay in rest[:1]]
    if rest:
        phases.pop()
    phases[0], phases[-1] = out, replace(back, end_place="destination")
    flown = simulated(mission, phases)
    return cycle.model_copy(
        update={"mission": mission, "phases": flown, "soc": {}, "flyable": None}
    )


def faults_of_fleet(share: float, overlap_s: float) -> Iterator[Fault]:
    """Faults of a share of the time [-] and of an overlap [s]."""
    return misfits(("share", share, SHARE), ("overlap_s", overlap_s, OVERLAP))


def lasting(stay: Phase, duration_s: float) -> Phase:
    """A stay of another duration [s]."""
    (stage,) = stay.stages
    return replace(stay, stages=(replace(stage, duration_s=duration_s),))


def fleet_of(cycle: EndlessCycle, share: float, overlap_s: float) -> Fleet:
    """The smallest ring of equal drones that hover for a share of the time, see `Coverage.fleet`.

    By Little's law: mean numbers in the air and on the ground are the rate of starts times the
    durations, and a ring attains the next whole numbers.
    """
    visit, hover_s, rest_s = cycle.finite_cycle(), cycle.hover_s, cycle.rest_s
    refuse(faults_of_fleet(share, overlap_s))
    need_handover(overlap_s, hover_s)
    every_s = (hover_s - overlap_s) / share
    drones = upwards(cycle.period_s / every_s)
    if drones > MOST_FLEET_DRONES:
        raise NoPlanError(
            f"{drones} drones would have to take turns, more than {MOST_FLEET_DRONES}: ask for a "
            "smaller share"
        )
    wait_s = max(drones * every_s - cycle.period_s, 0.0)
    places = upwards((rest_s if visit.swap_s is not None else rest_s + wait_s) / every_s)
    # One for each place and each drone that hovers at once, but each lights one drone
    lit = upwards(hover_s / every_s) if cycle.lit_hover else 0
    offsets_s = tuple(every_s * number for number in range(drones))
    rows = (
        FleetDrone(
            drone=number,
            offset_s=offset_s,
            flight_s=visit.flight_s,
            hover_s=hover_s,
            rest_s=rest_s,
            wait_s=wait_s,
        )
        for number, offset_s in enumerate(offsets_s, start=1)
    )
    return Fleet(
        mission=cycle.mission,
        rows=tuple(rows),
        drones=drones,
        places=places,
        beams=min(places + lit, drones) if cycle.charged_by == "laser" else 0,
        offsets_s=offsets_s,
        starts_every_s=every_s,
        share=hover_s / every_s,
        asked_share=share,
        overlap_s=overlap_s,
        longest_gap_s=0.0 if share >= 1.0 else max(every_s - hover_s, 0.0),
        hover_s=hover_s,
        rest_s=rest_s,
        building=visit.building,
        charged_by=cycle.charged_by,
        plan=cycle.plan,
        visit=visit,
    )


def need_handover(overlap_s: float, hover_s: float, noun: str = "the hover of a cycle") -> None:
    """Refuse an overlap in which a third drone would hover."""
    if overlap_s > 0.5 * hover_s:
        words = f"must be at most half of {noun}, {figure(0.5 * hover_s)} s"
        words += "; a larger share lets more drones hover at once" * noun.endswith("cycle")
        raise InputError([Fault("overlap_s", shown(overlap_s), words)])


def covering(share: float, overlap_s: float) -> str:
    """Words for what a fleet covers: a part of the time, or several devices."""
    overlap = f", {figure(overlap_s)} s of overlap" * (overlap_s > 0.0)
    if share <= 1.0:
        return f"for {percent(share)} of the time{overlap}"
    noun = "devices" if share % 1.0 == 0.0 else "drones that hover on average"
    return f"for {figure(share)} {noun}{overlap}"


def upwards(count: float) -> int:
    """Return the next whole number, but for rounding; at least 1."""
    return max(1, math.ceil(count * (1.0 - ROUNDED_COUNT)))


class PadPower(NamedTuple):
    """Power that every drone's pad must deliver for a fleet with dark hovers.

    Parameters
    ----------
    power_W, current_A
        Of the pad, at the nominal voltage of the battery [W], [A].
    hover_s, c_rate
        Hover of a cycle [s], and the charging current over the capacity in an hour [1/h].
    building
        The best one for pads.
    accepted
        Whether the current is at most ``battery.charge_current_A``.
    in_calm_air
        If the hover depends on the wind, the same in calm air, in words; else None.

    Examples
    --------
    >>> import optuav
    >>> pads = optuav.coverage("matrice350", perspective="battery").watts(3)
    >>> round(pads.power_W), pads.accepted
    (619, False)
    """

    power_W: float
    current_A: float
    hover_s: float
    c_rate: float
    building: str
    accepted: bool
    in_calm_air: str | None = None

    def __str__(self) -> str:
        words = f"{watts(self.power_W)} on {printable(self.building)}, "
        words += f"{amperes(self.current_A)}, {figure(self.c_rate, 3)} C"
        words += "" if self.accepted else ": more than battery.charge_current_A allows"
        if self.in_calm_air is not None:
            words += f"; this holds while the wind blows; in calm air: {self.in_calm_air}"
        return words


def pad_power(
    mission: Mission, visits: Sequence[Visit], drones: int, share: float, overlap_s: float
) -> PadPower:
    """The least power of pads with which so many drones cover a share, see `Coverage.watts`.

    The visits are those of dark hovers from all buildings in reach.
    """
    refuse([*misfits(("drones", drones, COUNT)), *faults_of_fleet(share, overlap_s)])

    def too_weak(visit: Visit, rest_A: float) -> bool:
        """Return whether a current into the resting battery needs more drones.

        What N drones cover more than a share c, N (Δ − o) − c P(Δ), is affine in the hover.
        """
        if rest_A <= 0.0 or (most_s := visit.from_full_s) is None:
            return True
        resting = replace(visit, rest_A=rest_A)
        none, most = (
            drones * (hover_s - overlap_s) - share * resting.period_s(hover_s)
            for hover_s in (0.0, most_s[1])
        )
        if most < 0.0:
            return True
        least_s = most_s[1] * none / (none - most)
        return not resting.lasts(resting.periodic(least_s), least_s)

    visits, best, rest_A = sorted(visits, key=lambda visit: visit.flight_s), None, 1.0
    while all(too_weak(visit, rest_A) for visit in visits):
        rest_A *= 2.0
        if rest_A > MOST_A:
            words = f"no pad is strong enough for {plural(drones, 'drone')}"
            raise NoPlanError(f"{words}: even without rests too little is covered")
    for visit in visits:
        below_A = rest_A * (
            1.0 - ROUNDED_COUNT * (best is not None)
        )  # Of equal buildings the first
        if not too_weak(visit, below_A):
            weak = bisect_largest(partial(too_weak, visit), below_A)
            assert weak is not None  # Without current every pad is too weak
            best, rest_A = visit, weak[1]
    assert best is not None
    current_A = rest_A + float(mission.flight_model.rest().current_A)
    c_rate = 3600.0 * current_A / float(best.battery.capacity_As)
    power_W = current_A * mission.battery.nominal_voltage_V
    accepted = current_A <= mission.battery.charge_current_A
    hover_s = replace(best, rest_A=rest_A).longest_s or 0.0
    need_handover(overlap_s, hover_s)
    return PadPower(power_W, current_A, hover_s, c_rate, best.building, accepted)


def turns_table(heads: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> Table:
    """A table of drones and times [s], as many rows as fit a page."""
    cells = [
        [str(number), *(fixed(time_s) for time_s in times_s)]
        for number, *times_s in (row.values() for row in rows[:MOST_SHOWN])
    ]
    more = len(rows) - MOST_SHOWN
    return Table(heads, cells, below=[f"and {more} more"] if more > 0 else [])
