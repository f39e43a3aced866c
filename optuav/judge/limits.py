"""What a plan must keep besides the battery: the limits of the mission, and its own figures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from optuav.judge.timeline import Move, Phase, Place, Site
from optuav.judge.wells import TOLERANCE
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR
from optuav.physics import flight, link
from optuav.physics.kibam import Wells
from optuav.plan import Phase as Planned
from optuav.plan import Plan
from optuav.plan.trace import Event

MISMATCH = "mismatch"
"""Kind of the event that a figure is not what it should be."""

IN_SLOTS = ("P1", "P2", "P2-tight", "P3", "P4")
"""Problems whose stays are whole slots; a user's own may bound them otherwise."""

Figure = tuple[str, float, float, str, float]
"""Name of a figure, its stated and simulated values, its unit, and the scale of its tolerance."""


def impossible(site: Site, moves: Sequence[Move]) -> Iterator[Event]:
    """Why some moves cannot be simulated at all."""
    mission = site.mission
    if mission.flight.model == "rotors":
        airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
        why = flight.impossible(airframe, motor, mission.wind.force_N)
        if why is not None:
            yield Event("impossible", 0.0, f"the UAV cannot fly: {why}")
    names = dict.fromkeys(name for move in moves for name in (move.start_place, move.end_place))
    for name in names:
        if math.isnan(site.place(name).position_m[0]):
            words = f"there is no place {name}: the device is out of reach at limits.min_altitude_m"
            yield Event("impossible", 0.0, words)


def broken_limits(mission: Mission, phases: Sequence[Phase], soc: float) -> Iterator[Event]:
    """What breaks a limit of the mission other than those of the wells, and what to know.

    The state of charge at the end is that of the packs [-].
    """
    end_s, deadline_s = phases[-1].end_s, mission.limits.deadline_s
    for place, due, time_s, verb in (
        (phases[0].start, "origin", 0.0, "begins"),
        (phases[-1].end, "destination", end_s, "ends"),
    ):
        if place.name != due:
            yield Event("ends", time_s, f"the mission {verb} at {place.name}, not at the {due}")
    for phase in phases:
        if phase.stated:
            where = "to" if phase.kind == "flight" else "at"
            words = f"the {phase.kind} {where} {phase.end.name} has figures that the user stated"
            yield Event("stated", phase.start_s, words, violation=False)
        if phase.crosses != CLEAR:
            way = f"{phase.start.name} → {phase.end.name}"
            words = f"the leg {way} runs through building {mission.buildings[phase.crosses].name}"
            yield Event("building", phase.start_s, words)
        if phase.kind != "flight" and phase.duration_s > 0.0:
            yield from _stay(mission, phase)
    yield from _fastest(mission, [phase for phase in phases if phase.kind == "flight"])
    if end_s > deadline_s * (1.0 + TOLERANCE):
        words = "the deadline passes before the mission ends"
        yield Event("deadline", deadline_s, words, end_s, deadline_s, "s")
    least = mission.limits.min_soc
    if soc < least - TOLERANCE:
        words = "too little charge is left at the end"
        yield Event("state of charge", end_s, words, soc, least)


def _stay(mission: Mission, phase: Phase) -> Iterator[Event]:
    place, start_s = phase.end, phase.start_s
    height_m = place.position_m[2]
    if phase.kind == "hover":
        yield from _hover(mission, place, start_s)
    elif place.building == CLEAR and height_m > 0.0:
        words = (
            f"nothing to rest on at {place.name}: no roof, and the ground is {height_m:g} m below"
        )
        yield Event("no roof", start_s, words)
    if mission.laser is not None and not place.sight and not phase.stated:
        words = f"no sight of the laser at {place.name}: nothing charges the battery there"
        yield Event("no sight", start_s, words, violation=False)


def _hover(mission: Mission, place: Place, start_s: float) -> Iterator[Event]:
    z, limits = place.position_m[2], mission.limits
    low, high = limits.min_altitude_m, limits.max_altitude_m
    if not low * (1.0 - TOLERANCE) <= z <= high * (1.0 + TOLERANCE):
        words = f"hovering at {place.name} leaves the altitude band"
        yield Event("altitude", start_s, words, z, low if z < low else high, "m")
    distance_m = math.dist(place.position_m, mission.link.device_m)
    radius_m = vehicle.coverage_radius_m(mission)
    if distance_m > radius_m * (1.0 + TOLERANCE):
        outage = float(link.outage_probability(vehicle.channel(mission), distance_m))
        words = f"hovering at {place.name} is out of coverage of the device (outage {outage:.3g})"
        yield Event("coverage", start_s, words, distance_m, radius_m, "m")


def _fastest(mission: Mission, legs: Sequence[Phase]) -> Iterator[Event]:
    """The peak speed and when it is reached, with a warning where drag would matter."""
    if not legs:
        return
    leg = max(legs, key=lambda each: each.peak_speed_m_s)
    speed_m_s, peak_s = leg.peak_speed_m_s, leg.start_s
    if not leg.stated and mission.flight.model == "regimes":
        peak_s += speed_m_s / mission.flight.acceleration_m_s2
    elif not leg.stated:
        peak_s += sum(stage.duration_s for stage in leg.stages[:2])
    words = f"the peak speed is reached on the leg {leg.start.name} → {leg.end.name}"
    yield Event("peak speed", peak_s, words, speed_m_s, None, "m/s", violation=False)
    warning = flight.speed_warning(speed_m_s)
    if warning is not None:
        yield Event("no drag", peak_s, warning, violation=False)


def same(stated: float, found: float, scale: float = 0.0) -> bool:
    """Whether two figures differ by no more than the tolerance, of the scale or of the figure."""
    return abs(stated - found) <= TOLERANCE * max(scale, abs(found))


def mismatches(
    plan: Plan, phases: Sequence[Phase], ends: Sequence[tuple[Wells, ...]], soc: Mapping[str, float]
) -> Iterator[Event]:
    """Figures of a plan that are not those of its simulation.

    That has the same phases, the wells of the packs at the end of each [A s], and the state of
    charge at the end by perspective [-].
    """
    capacity_As = float(vehicle.pool(plan.mission).capacity_As)
    for number, (stated, found, wells) in enumerate(zip(plan.phases, phases, ends, strict=True)):
        here, start_s = f"phases[{number}]", found.start_s
        yield from _differing(here, start_s, _figures(stated, found, wells, capacity_As))
        for name, many, few in (
            ("stages", len(stated.stages), len(found.stages)),
            ("available_As", len(stated.available_As), len(wells)),
        ):
            if many != few:
                words = f"{here}.{name}: the plan has {many}, the simulation {few}"
                yield Event(MISMATCH, start_s, words, many, few)
    levels = (
        (name, stated_soc, soc[name], "", 1.0)
        for name, stated_soc in (plan.soc or {}).items()
        if name in soc
    )
    yield from _differing("soc", phases[-1].end_s, levels)
    if plan.slot_s is not None and plan.problem in IN_SLOTS:
        yield from _broken_slots(plan, plan.slot_s)


def contradicted_verdict(plan: Plan, events: Sequence[Event]) -> Iterator[Event]:
    """The verdict that a plan states, where the events of its simulation have another."""
    violations = [event for event in events if event.violation]
    broken = [event for event in violations if event.kind != MISMATCH]
    end_s = plan.mission_time_s
    if plan.flyable is True and broken:
        yield Event(MISMATCH, end_s, "flyable: the plan says that it can be flown, it cannot")
    if plan.flyable is False and not violations:
        yield Event(MISMATCH, end_s, "flyable: the plan says that it cannot be flown, it can")


def _broken_slots(plan: Plan, slot_s: float) -> Iterator[Event]:
    """Stays of no whole slots, other than a hover that the deadline cuts short."""
    at_deadline = same(plan.mission_time_s, plan.mission.limits.deadline_s)
    for number, stay in enumerate(plan.phases):
        cut_short = stay.kind == "hover" and at_deadline
        if stay.kind == "flight" or cut_short:
            continue
        slots = stay.duration_s / slot_s
        if not same(round(slots) * slot_s, stay.duration_s):
            words = (
                f"slot_s: the plan says {slot_s:.10g} s, but phases[{number}] is {slots:.10g} slots"
            )
            yield Event(MISMATCH, stay.start_s, words, slot_s, None, "s")


def _figures(
    stated: Planned, found: Phase, wells: Sequence[Wells], capacity_As: float
) -> Iterator[Figure]:
    for name, unit in (("start_s", "s"), ("distance_m", "m"), ("peak_speed_m_s", "m/s")):
        yield name, getattr(stated, name), getattr(found, name), unit, 1.0
    for k, (mine, theirs) in enumerate(zip(stated.stages, found.stages, strict=False)):
        A, W = (sum(pair) for pair in zip(theirs.drawn, theirs.received, strict=True))
        for name, unit, scale in (
            ("duration_s", "s", 1.0),
            ("current_A", "A", A),
            ("power_W", "W", W),
        ):
            yield f"stages[{k}].{name}", getattr(mine, name), getattr(theirs, name), unit, scale
    for name in ("available_As", "bound_As"):
        for pack, (level, well) in enumerate(zip(getattr(stated, name), wells, strict=False)):
            yield f"{name}[{pack}]", level, float(getattr(well, name)), "A s", capacity_As


def _differing(here: str, time_s: float, figures: Iterator[Figure]) -> Iterator[Event]:
    for name, stated, found, unit, scale in figures:
        if not same(stated, found, scale):
            words = f"{here}.{name}: the plan says {stated:.10g}, it is {found:.10g} {unit}"
            yield Event(MISMATCH, time_s, words.rstrip(), stated, found, unit)
