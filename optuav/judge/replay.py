"""A plan simulated again from its mission: events, faults, and its trace."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from optuav.arrays import Floats
from optuav.errors import NoPlanError
from optuav.flight.model import CruisingModel
from optuav.frames import DataFrame
from optuav.judge.clearance import too_near
from optuav.judge.flight_plan import FlightPlan
from optuav.judge.read import read
from optuav.judge.timeline import Itinerary, SimulatedPhase, moves, phases, places
from optuav.judge.wells_along import Course, pooled, scheduled, soc, trace
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR
from optuav.network.places import lands
from optuav.network.ways import way_limits_m
from optuav.options import LONGEST_HOVER
from optuav.physics import flight, link
from optuav.physics.flight import Loads
from optuav.physics.quantity import TINY
from optuav.plan import Plan
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.plan import refuse_contradictions
from optuav.plan.trace import FlightEvent, Trace
from optuav.presentation.blocks import Block, Facts, Fold, Heading, Picture, Table
from optuav.presentation.numbers import figure, percent, percent_apart, seconds
from optuav.presentation.presented import Presented

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

same = partial(math.isclose, rel_tol=JUDGE_TOLERANCE)  # Whether two figures differ by no more
MISMATCH = "mismatch"  # Kind of the event that a figure is wrong
SHARE_S = 1e-6  # By how much the hover over one of several devices may miss its share of Δ [s]
MOST_SHOWN = 20  # Events under one heading that are shown one by one
CAP = "max_speed_m_s"  # Key of [flight], an air speed where there is wind

BELOW_RESERVE = "below reserve"  # Kind of the remark that a landing leaves less than η0

OF_A_RELAY = ("altitude", "coverage", "no sight", "device", "share", "rests")
"""Kinds of events at hovers and rests that have a meaning for the relay of devices only."""

IN_SLOTS = ("P1", "P2", "P2-tight", "P3", "P4")
"""Problems whose stays are whole slots; a user's own may bound them otherwise."""


class Judged(Presented):
    """Base class for results with events, some making a plan not flyable."""

    events: tuple[FlightEvent, ...]

    @property
    def violations(self) -> tuple[FlightEvent, ...]:
        """The events that make the plan not flyable."""
        return tuple(event for event in self.events if event.violation)

    @property
    def flyable(self) -> bool:
        """True if the plan keeps every limit at every moment, and its figures are right."""
        return not self.violations

    @property
    def verdict(self) -> str:
        """The verdict in capitals."""
        return "FLYABLE" if self.flyable else "NOT FLYABLE"

    @property
    def by_kind(self) -> dict[str, list[FlightEvent]]:
        """The events under the headings of a page."""
        groups: dict[str, list[FlightEvent]] = {"Violated": [], "Contradicted": [], "To know": []}
        for event in self.events:
            wrong = "Contradicted" if event.kind == MISMATCH else "Violated"
            groups[wrong if event.violation else "To know"].append(event)
        return groups

    def event_blocks(self) -> Iterator[Block]:
        """Yield the events under their headings, violations first; HTML folds what is to know."""
        for heading, events in self.by_kind.items():
            rows = [(seconds(e.time_s), e.words + e.value_and_limit) for e in events[:MOST_SHOWN]]
            more = len(events) - len(rows)
            below = [f"and {more} more"] if more else []
            table = Table((), rows, words=0, last=1, above=heading, below=below)
            if rows:
                title = f"{heading} ({len(events)})"
                yield Fold(title, [table], is_open=heading != "To know")


@dataclass(frozen=True)
class Replay(Judged):
    """A simulated plan.

    Parameters
    ----------
    subject
        The plan or itinerary simulated.
    phases
        The phases, computed again; empty where the mission cannot be flown at all.
    course
        The packs over the phases; None where the mission cannot be flown at all.
    soc
        State of charge at the end by perspective [-].
    events
        Events and faults, in order of time.

    Examples
    --------
    >>> import optuav
    >>> result = optuav.replay(optuav.solve("paper", "P3", perspective="battery"))
    >>> result.flyable, round(result.first_s("empty"), 1), round(result.times_s["hover_time_s"], 1)
    (False, 660.3, 688.8)
    """

    subject: Plan | Itinerary
    phases: tuple[SimulatedPhase, ...]
    course: Course | None
    soc: Mapping[str, float]
    events: tuple[FlightEvent, ...]

    @property
    def mission(self) -> Mission:
        """The mission of the simulation."""
        return self.subject.mission

    @property
    def mission_time_s(self) -> float:
        """T [s]; 0 where the mission cannot be flown at all."""
        return self.phases[-1].end_s if self.phases else 0.0

    @property
    def route(self) -> list[str]:
        """Names of the places between which it flies; empty where the mission cannot be flown."""
        flights = (phase.end.name for phase in self.phases if phase.kind == "flight")
        return [*(phase.start.name for phase in self.phases[:1]), *flights]

    @property
    def times_s(self) -> dict[str, float]:
        """Durations of the mission and by kind [s]; empty where the mission cannot be flown."""
        if not self.phases:
            return {}
        times_s = {f"{kind}_time_s": 0.0 for kind in ("mission", "hover", "rest", "flight")}
        for phase in self.phases:
            times_s[f"{phase.kind}_time_s"] += phase.duration_s
        return {**times_s, "mission_time_s": self.mission_time_s}

    @property
    def facts(self) -> list[tuple[str, str]]:
        """Route, times and charge left, in words; empty where the mission cannot be flown."""
        if not self.phases:
            return []
        times = (f"{name.split('_')[0]} {seconds(time_s)}" for name, time_s in self.times_s.items())
        levels = (f"{name} {percent(level)}" for name, level in self.soc.items())
        charge = f"{', '.join(levels)} left"
        return [("Route", " → ".join(self.route)), ("Times", ", ".join(times)), ("Charge", charge)]

    def __repr__(self) -> str:
        name, count = self.mission.name, len(self.phases)
        return (
            f"<Replay for {name!r}: {count} phases, {seconds(self.mission_time_s)}, {self.verdict}>"
        )

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict, route and times, the wells, and the events."""
        yield Heading(f"{self.verdict}: {self.mission.name}", good=self.flyable)
        yield from self.flight_blocks()
        yield from self.event_blocks()

    def flight_blocks(self) -> Iterator[Block]:
        """Yield route, times and wells; nothing where the mission cannot be flown."""
        if not self.phases:
            return
        yield Facts(self.facts)
        if self.mission_time_s:
            yield Picture(self._wells)

    def _wells(self) -> Element:
        """Both wells over the trace."""
        from optuav.plan.display import Levels, picture

        wells_As = (well.sum(axis=1) for well in (self.trace.available_As, self.trace.bound_As))
        phases = ((phase.kind, phase.start_s, phase.end_s - phase.start_s) for phase in self.phases)
        full, passed_s = self.mission.pool.full, map(self.first_s, ("empty", "full"))
        return picture(Levels(self.trace.time_s, *wells_As), phases, full, *passed_s)

    def first_s(self, kind: str) -> float | None:
        """When an event of a kind first happens [s]; None if none does."""
        return next((event.time_s for event in self.events if event.kind == kind), None)

    @cached_property
    def trace(self) -> Trace:
        """The mission over time: position, speed, currents, wells; computed on first use.

        `NoPlanError` if nothing is flown.
        """
        if self.course is None or not any(phase.duration_s for phase in self.phases):
            raise NoPlanError("no table exists: nothing is flown")
        return trace(self.mission, self.phases, self.course)

    def to_frame(self) -> DataFrame:
        """The mission over time, one row per moment; needs pandas."""
        return self.trace.to_frame()


def replay(plan: Plan | Itinerary | Replay | str | Path) -> Replay:
    """Simulate a plan from its mission, by the closed form of the battery model.

    From the plan, it reads only the places, their order, the durations of stays, and figures that a
    graph sets. It computes everything else again, and compares it with every figure in the plan.

    Parameters
    ----------
    plan
        A plan, an itinerary, or the file of one, as for `optuav.audit`; a replay is returned
        unchanged.

    Returns
    -------
    Replay
        The simulation. Its verdict `flyable` allows charge to miss its limits by 1e-6 of the
        capacity, and other figures by 1e-6 of the limit.

    Raises
    ------
    InputError
        With everything that keeps a file from being read.
    NoPlanError
        Without a plan to simulate.

    Examples
    --------
    >>> import optuav
    >>> paper = optuav.load("paper")
    >>> direct = optuav.Itinerary(paper, (optuav.Stop("hover", "hover", 688.8),))
    >>> replayed = optuav.replay(direct)
    >>> replayed.flyable
    False
    >>> print(replayed.violations[0])
        660.26 s  the available well runs dry: −9425.68 at 764.59 s, at least 0 A s
    """
    if isinstance(plan, Replay):
        return plan
    source, plan, data = read(plan)
    if isinstance(plan, Plan):
        plan.route  # noqa: B018  (raises without a plan)
        refuse_contradictions(plan, data, source)
    mission, planned = plan.mission, tuple(moves(plan))
    at = places(mission, planned)
    events = list[FlightEvent]()
    if why := mission.flight_model.impossible():
        events.append(FlightEvent("impossible", 0.0, f"the UAV cannot fly: {why}"))
    for name in (name for name, place in at.items() if math.isnan(place.position_m[0])):
        words = f"there is no place {name}: the device is out of reach at limits.min_altitude_m"
        events.append(FlightEvent("impossible", 0.0, words))
    flown = () if events else phases(mission, at, planned)
    if isinstance(plan, FlightPlan) and flown:
        flown = tuple(plan.named(flown))
    for leg in (phase for phase in flown if math.isnan(phase.duration_s)):
        words = f"the leg {leg.start.name} → {leg.end.name} cannot be flown in this wind"
        events.append(FlightEvent("impossible", 0.0, words))
    if events:
        return Replay(plan, (), None, {}, tuple(events))
    course = (scheduled if mission.battery.takes_turns else pooled)(mission, flown)
    charges_As = [sum(float(pack.total_As) for pack in wells) for wells in course.ends]
    shares = np.array(charges_As) / float(mission.pool.capacity_As)
    levels = soc(mission, flown, np.array([flown[-1].end_s]), shares[-1:])
    left = {name: float(level[0]) for name, level in levels.items()}
    events = [*course.events, *_broken_limits(mission, flown)]
    if mission.devices:
        events += _unserved(mission, flown)
    if isinstance(plan, FlightPlan):  # It flies for no device
        events = [e for e in events if e.kind not in OF_A_RELAY]
    reserve = [*_reserve(mission, flown, shares.tolist())]
    if isinstance(plan, FlightPlan):  # Its waypoints are no landings
        landings_s = {flown[-1].end_s, *(p.start_s for p in flown if p.kind == "rest")}
        reserve = [event for event in reserve if event.time_s in landings_s]
    events += reserve
    if isinstance(plan, Plan):
        figures, broken = _figures(plan, flown, course, left), any(e.violation for e in events)
        events += _mismatches(plan, figures, broken)
    events.sort(key=lambda event: event.time_s)
    return Replay(plan, flown, course, left, tuple(events))


def _broken_limits(mission: Mission, flown: Sequence[SimulatedPhase]) -> Iterator[FlightEvent]:
    """Broken limits, except of the battery, and remarks."""
    end_s, deadline_s = flown[-1].end_s, mission.limits.deadline_s
    for place, due, time_s, verb in (
        (flown[0].start, "origin", 0.0, "begins"),
        (flown[-1].end, "destination", end_s, "ends"),
    ):
        if place.name != due:
            yield FlightEvent(
                "ends", time_s, f"the mission {verb} at {place.name}, not at the {due}"
            )
    for phase in flown:
        if phase.stated:
            where = "to" if phase.kind == "flight" else "at"
            words = f"the {phase.kind} {where} {phase.end.name} has figures that the user set"
            yield FlightEvent("stated", phase.start_s, words, violation=False)
        if phase.crosses != CLEAR:
            way = f"{phase.start.name} → {phase.end.name}"
            words = f"the leg {way} runs through building {mission.buildings.names[phase.crosses]}"
            yield FlightEvent("building", phase.start_s, words)
        if phase.waypoints_m and not phase.stated:
            yield from _bent(mission, phase)
        yield from _too_fast(mission, phase)
        if phase.kind != "flight" and phase.duration_s > 0.0:
            yield from _stay(mission, phase)
    model = mission.flight_model
    if legs := [phase for phase in flown if phase.kind == "flight"]:
        leg = max(legs, key=lambda each: each.peak_speed_m_s)
        speed_m_s, peak_s = leg.peak_speed_m_s, leg.start_s
        for part in leg.segments:
            if part.peak_speed_m_s == speed_m_s:
                peak_s += float(part.peak_s)
                break
            peak_s += float(part.duration_s)
        words = f"the peak speed is reached on the leg {leg.start.name} → {leg.end.name}"
        yield FlightEvent("peak speed", peak_s, words, speed_m_s, None, "m/s", violation=False)
        if warning := flight.speed_warning(speed_m_s, has_drag=model.has_drag):
            yield FlightEvent("no drag", peak_s, warning, violation=False)
    if end_s > deadline_s * (1.0 + JUDGE_TOLERANCE):
        words = "the deadline passes before the mission ends"
        yield FlightEvent("deadline", deadline_s, words, end_s, deadline_s, "s")


def _reserve(
    mission: Mission, flown: Sequence[SimulatedPhase], soc: Sequence[float]
) -> Iterator[FlightEvent]:
    """Too little charge at the end or at a landing, by the state of charge after phases [-]."""
    least, always = mission.limits.min_soc, mission.limits.keep_soc == "always"
    hovers = {device.name for device in mission.served}
    for phase, left in zip(flown[:-1], soc[:-1], strict=True):
        if phase.kind == "flight" and left < least - JUDGE_TOLERANCE:
            kind, allowed = "state of charge", ""
            if not always:
                kind, allowed = BELOW_RESERVE, "; allowed by limits.keep_soc = end"
            landing = lands(phase.end.name, hovers=phase.end.name in hovers)
            words = f"{landing} with {short_of(left, least)}{allowed}"
            yield FlightEvent(kind, phase.end_s, words, left, least, violation=always)
    if soc[-1] < least - JUDGE_TOLERANCE:
        words = f"the mission ends with {short_of(soc[-1], least)}"
        yield FlightEvent("state of charge", flown[-1].end_s, words, soc[-1], least)


def short_of(left: float, least: float) -> str:
    """A charge below the reserve, with the digits that tell them apart."""
    here, reserve = percent_apart(left, least)
    return f"{here} of the charge, below the reserve of {reserve}"


def _too_fast(mission: Mission, phase: SimulatedPhase) -> Iterator[FlightEvent]:
    """Yield where a leg is flown faster than the cap, or slower than the plan says."""
    if phase.kind != "flight" or phase.stated:
        return
    way, cap_m_s = f"{phase.start.name} → {phase.end.name}", vars(mission.flight).get(CAP)
    planned_m_s = phase.speeds_m_s or [0.0] * len(phase.segments)
    for part, least_m_s in zip(phase.segments, planned_m_s, strict=True):
        velocity_m_s = _peak_velocity_m_s(mission, part)
        speed_m_s = math.hypot(*velocity_m_s)
        if speed_m_s < least_m_s * (1.0 - JUDGE_TOLERANCE):
            words = f"the leg {way} cannot be flown as fast as the plan says"
            yield FlightEvent("speed", phase.start_s, words, least_m_s, speed_m_s, "m/s")
        air_speed_m_s = math.dist(velocity_m_s, mission.wind.velocity_m_s)
        if cap_m_s is not None and air_speed_m_s > cap_m_s * (1.0 + JUDGE_TOLERANCE):
            words = f"the leg {way} is flown faster than flight.{CAP}"
            yield FlightEvent("speed", phase.start_s, words, air_speed_m_s, cap_m_s, "m/s")


def _peak_velocity_m_s(mission: Mission, part: Loads) -> Floats:
    """Velocity over ground at the peak of a leg [m/s], level where the model's speeds are."""
    way_m = np.array(part.way_m)
    velocity_m_s = way_m * float(part.peak_speed_m_s) / max(math.hypot(*way_m), TINY)
    level = isinstance(mission.flight_model, CruisingModel)
    return np.asarray(velocity_m_s * [1.0, 1.0, not level])


def _bent(mission: Mission, phase: SimulatedPhase) -> Iterator[FlightEvent]:
    """Yield the broken limits of a bent leg."""
    keys, way = mission.flight, f"{phase.start.name} → {phase.end.name}"
    highest_m = max(z for _, _, z in phase.waypoints_m)
    apart_m, ceiling_m = map(float, way_limits_m(keys))
    if highest_m > ceiling_m * (1.0 + JUDGE_TOLERANCE):
        words = f"a waypoint of the leg {way} is above flight.max_altitude_m"
        yield FlightEvent("altitude", phase.start_s, words, highest_m, ceiling_m, "m")
    ends_on = phase.start.roof, phase.end.roof
    if keys.obstacle_rule != "ignore":
        near = too_near(mission, np.array(phase.points_m), ends_on, apart_m, JUDGE_TOLERANCE)
        least: dict[int, float] = {}
        for building, distance_m in near:
            least[building] = min(distance_m, least.get(building, math.inf))
        for building, distance_m in least.items():
            words = f"the leg {way} comes too near to building {mission.buildings.names[building]}"
            yield FlightEvent("clearance", phase.start_s, words, distance_m, apart_m, "m")


def _stay(mission: Mission, phase: SimulatedPhase) -> Iterator[FlightEvent]:
    """Yield the broken limits at the place of a stay, and whether the laser is out of sight."""
    place, start_s, limits = phase.end, phase.start_s, mission.limits
    z, low, high = place.position_m[2], limits.min_altitude_m, limits.max_altitude_m
    if phase.kind == "hover":
        if not low * (1.0 - JUDGE_TOLERANCE) <= z <= high * (1.0 + JUDGE_TOLERANCE):
            words = f"hovering at {place.name} leaves the altitude band"
            yield FlightEvent("altitude", start_s, words, z, low if z < low else high, "m")
        device = next((x for x in mission.served if x.name == place.name), mission.served[0])
        if mission.devices and device.name != place.name:
            return  # It serves none of them
        distance_m = math.dist(place.position_m, device.position_m)
        radius_m = vehicle.coverage_radius_m(mission)
        if distance_m > radius_m * (1.0 + JUDGE_TOLERANCE):
            outage = float(link.outage_probability(vehicle.channel(mission), distance_m))
            of_device = f"device {device.name}" if mission.devices else "the device"
            where = f"out of coverage of {of_device} (outage {figure(outage, 3)})"
            words = f"hovering at {place.name} is {where}"
            yield FlightEvent("coverage", start_s, words, distance_m, radius_m, "m")
    elif place.roof == CLEAR and z > 0.0:
        words = (
            f"nothing to rest on at {place.name}: no roof, and the ground is {figure(z)} m below"
        )
        yield FlightEvent("no roof", start_s, words)
    if mission.laser is not None and not place.sight and not phase.stated:
        words = f"no sight of the laser at {place.name}: nothing charges the battery there"
        yield FlightEvent("no sight", start_s, words, violation=False)


def _unserved(mission: Mission, flown: Sequence[SimulatedPhase]) -> Iterator[FlightEvent]:
    """Yield where several devices are not hovered over once each, for their shares, or rests."""
    hovers = [phase for phase in flown if phase.kind == "hover"]
    hover_s, end_s = sum(phase.duration_s for phase in hovers), flown[-1].end_s
    for device in mission.served:
        of_device = [phase for phase in hovers if phase.end.name == device.name]
        if len(of_device) != 1:
            often = f"{len(of_device)} times, not once" if of_device else "not at all"
            words = f"device {device.name} is hovered over {often}"
            yield FlightEvent("device", of_device[1].start_s if of_device else end_s, words)
            continue
        due_s, flown_s = device.share * hover_s, of_device[0].duration_s
        if abs(flown_s - due_s) > max(SHARE_S, JUDGE_TOLERANCE * due_s):
            words = (
                f"the hover over device {device.name} is not its share {figure(device.share)} of Δ"
            )
            yield FlightEvent("share", of_device[0].start_s, words, flown_s, due_s, "s")
    names = {device.name for device in mission.served}
    for phase in hovers:
        if phase.end.name not in names:
            words = f"hovering at {phase.end.name} serves no device"
            yield FlightEvent("device", phase.start_s, words)
    for phase in [phase for phase in flown if phase.kind == "rest" and phase.duration_s > 0.0][1:]:
        words = f"the rest at {phase.end.name} is one more; with several devices there is one"
        yield FlightEvent("rests", phase.start_s, words)


Figure = tuple[float, str, float, float, float, str]
"""Moment of a figure, its name, stated and simulated value, scale of its tolerance, and unit."""


def _figures(
    plan: Plan, flown: Sequence[SimulatedPhase], course: Course, soc: Mapping[str, float]
) -> Iterator[Figure]:
    """The figures that a plan and its simulation state."""
    capacity_As = float(plan.mission.pool.capacity_As)
    rows = zip(plan.phases, flown, course.ends, strict=True)
    for number, (stated, found, wells) in enumerate(rows):
        here, time_s = f"phases[{number}]", found.start_s
        for name, unit in (("start_s", "s"), ("distance_m", "m"), ("peak_speed_m_s", "m/s")):
            yield time_s, f"{here}.{name}", getattr(stated, name), getattr(found, name), 1.0, unit
        for k, (planned, simulated) in enumerate(zip(stated.stages, found.stages, strict=False)):
            stage, (net_A, net_W) = f"{here}.stages[{k}]", simulated.net
            # The scales are sums, as drawn and received cancel in part.
            flows = zip(simulated.drawn, simulated.received, strict=True)
            A, W = (float(out + back) for out, back in flows)
            yield time_s, f"{stage}.duration_s", planned.duration_s, simulated.duration_s, 1.0, "s"
            yield time_s, f"{stage}.current_A", planned.current_A, net_A, A, "A"
            yield time_s, f"{stage}.power_W", planned.power_W, net_W, W, "W"
        for name in ("available_As", "bound_As"):
            for pack, (level, well) in enumerate(zip(getattr(stated, name), wells, strict=False)):
                own_As = float(getattr(well, name))
                yield time_s, f"{here}.{name}[{pack}]", level, own_As, capacity_As, "A s"
        for name, few in (("stages", len(found.stages)), ("available_As", len(wells))):
            yield time_s, f"number of {here}.{name}", len(getattr(stated, name)), few, 0.0, ""
    for name in soc.keys() & (plan.soc or {}).keys():
        yield flown[-1].end_s, f"soc.{name}", (plan.soc or {})[name], soc[name], 1.0, ""


def _mismatches(plan: Plan, figures: Iterator[Figure], broken: bool) -> list[FlightEvent]:
    """Yield where figures, whole slots or the verdict of a plan contradict its simulation."""
    events = list[FlightEvent]()
    for time_s, name, stated, simulated, scale, unit in figures:
        if not same(stated, simulated, abs_tol=JUDGE_TOLERANCE * scale):
            words = (
                f"{name}: the plan says {figure(stated, 10)}, it is {figure(simulated, 10)} {unit}"
            )
            events.append(FlightEvent(MISMATCH, time_s, words.rstrip(), stated, simulated, unit))
    hover_s = plan.hover_time_s
    objective_s = hover_s if plan.objective is None else plan.objective  # As in older files
    states_hover = plan.problem in LONGEST_HOVER
    if states_hover and not same(objective_s, hover_s, abs_tol=JUDGE_TOLERANCE):
        words = (
            f"objective: the plan says {figure(objective_s, 10)} s, it hovers "
            f"{figure(hover_s, 10)} s"
        )
        events.append(FlightEvent(MISMATCH, plan.mission_time_s, words, objective_s, hover_s, "s"))
    slot_s = plan.slot_s if plan.problem in IN_SLOTS else None
    at_deadline = same(plan.mission_time_s, plan.mission.limits.deadline_s)
    stays = [(f"phases[{number}]", phase) for number, phase in enumerate(plan.phases)]
    for place, stay in stays if slot_s else ():
        name, duration_s = place, stay.duration_s
        if plan.mission.devices and stay.kind == "hover":  # Whole slots make up Δ, not its pieces
            name, duration_s = "the hover time", hover_s
        slots = duration_s / (slot_s or 1.0)
        # The deadline may cut a hover short.
        exempt = stay.kind == "flight" or (stay.kind == "hover" and at_deadline)
        if not exempt and not same(round(slots) * (slot_s or 1.0), duration_s):
            why = f"{name} is {figure(slots, 10)} slots"
            words = f"slot_s: the plan says {figure(slot_s or 1.0, 10)} s, but {why}"
            events.append(FlightEvent(MISMATCH, stay.start_s, words, slot_s, None, "s"))
    flies = not broken and (plan.flyable is True or not events)
    if plan.flyable not in (None, flies):
        says = "cannot be flown, it can" if flies else "can be flown, it cannot"
        words = f"flyable: the plan says that it {says}"
        events.append(FlightEvent(MISMATCH, plan.mission_time_s, words))
    return events
