"""What a plan must keep to beside the battery: limits of the mission, held against a simulation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from optuav.judge.itinerary import Move
from optuav.judge.phases import Phase, Place, Site
from optuav.judge.tolerance import TOLERANCE
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR
from optuav.physics import flight, link
from optuav.plan.trace import Event


def impossible(site: Site, moves: Sequence[Move]) -> Iterator[Event]:
    """Why some moves cannot be simulated at all."""
    mission = site.mission
    if mission.flight.model == "rotors":
        why = flight.impossible(
            vehicle.airframe(mission), vehicle.motor(mission), mission.wind.force_N
        )
        if why is not None:
            yield Event("impossible", 0.0, f"the UAV cannot fly: {why}")
    names = dict.fromkeys(name for move in moves for name in (move.start_place, move.end_place))
    for name in names:
        if math.isnan(site.place(name).position_m[0]):
            words = f"there is no place {name}: the device is out of reach at limits.min_altitude_m"
            yield Event("impossible", 0.0, words)


def kept(mission: Mission, phases: Sequence[Phase], soc: float) -> Iterator[Event]:
    """What breaks a limit of the mission other than those of the wells, and what to know."""
    yield from _ends(phases)
    for phase in phases:
        if phase.stated:
            where = "to" if phase.kind == "flight" else "at"
            words = f"the {phase.kind} {where} {phase.end.name} has figures that the user stated"
            yield Event("stated", phase.start_s, words, violation=False)
        if phase.kind == "flight":
            yield from _leg(mission, phase)
        elif phase.duration_s > 0.0:
            yield from _stay(mission, phase)
    yield from _fastest(mission, phases)
    end_s, deadline_s = phases[-1].end_s, mission.limits.deadline_s
    if end_s > deadline_s * (1.0 + TOLERANCE):
        words = "the deadline passes before the mission ends"
        yield Event("deadline", deadline_s, words, end_s, deadline_s, "s")
    least = mission.limits.min_soc
    if soc < least - TOLERANCE:
        words = "too little charge is left at the end"
        yield Event("state of charge", end_s, words, soc, least)


def _ends(phases: Sequence[Phase]) -> Iterator[Event]:
    for place, due, time_s, verb in (
        (phases[0].start, "origin", 0.0, "begins"),
        (phases[-1].end, "destination", phases[-1].end_s, "ends"),
    ):
        if place.name != due:
            yield Event("ends", time_s, f"the mission {verb} at {place.name}, not at the {due}")


def _leg(mission: Mission, phase: Phase) -> Iterator[Event]:
    way = f"{phase.start.name} → {phase.end.name}"
    if phase.crosses != CLEAR:
        building = mission.buildings[phase.crosses].name
        words = f"the leg {way} runs through building {building}"
        yield Event("building", phase.start_s, words)


def _stay(mission: Mission, phase: Phase) -> Iterator[Event]:
    place, start_s = phase.end, phase.start_s
    if phase.kind == "hover":
        yield from _altitude(mission, place, start_s)
        yield from _coverage(mission, place, start_s)
    elif place.building == CLEAR and place.position_m[2] > 0.0:
        height_m = place.position_m[2]
        words = (
            f"nothing to rest on at {place.name}: no roof, and the ground is {height_m:g} m below"
        )
        yield Event("no roof", start_s, words)
    if mission.laser is not None and not place.sight and not phase.stated:
        words = f"no sight of the laser at {place.name}: nothing charges the battery there"
        yield Event("no sight", start_s, words, violation=False)


def _altitude(mission: Mission, place: Place, start_s: float) -> Iterator[Event]:
    z, limits = place.position_m[2], mission.limits
    low, high = limits.min_altitude_m, limits.max_altitude_m
    if low * (1.0 - TOLERANCE) <= z <= high * (1.0 + TOLERANCE):
        return
    words = f"hovering at {place.name} leaves the altitude band"
    yield Event("altitude", start_s, words, z, low if z < low else high, "m")


def _coverage(mission: Mission, place: Place, start_s: float) -> Iterator[Event]:
    distance_m = math.dist(place.position_m, mission.link.device_m)
    radius_m = vehicle.coverage_radius_m(mission)
    if distance_m <= radius_m * (1.0 + TOLERANCE):
        return
    outage = float(link.outage_probability(vehicle.channel(mission), distance_m))
    words = f"hovering at {place.name} is out of coverage of the device (outage {outage:.3g})"
    yield Event("coverage", start_s, words, distance_m, radius_m, "m")


def _fastest(mission: Mission, phases: Sequence[Phase]) -> Iterator[Event]:
    legs = [phase for phase in phases if phase.kind == "flight"]
    if not legs:
        return
    leg = max(legs, key=lambda each: each.peak_speed_m_s)
    words = f"the peak speed is reached on the leg {leg.start.name} → {leg.end.name}"
    peak_s = leg.start_s + _speeding_up_s(mission, leg)
    yield Event("peak speed", peak_s, words, leg.peak_speed_m_s, None, "m/s", violation=False)


def _speeding_up_s(mission: Mission, leg: Phase) -> float:
    """How long after its start a leg reaches its peak speed [s]; 0 where nobody knows."""
    if leg.stated:
        return 0.0
    if mission.flight.model == "regimes":
        return leg.peak_speed_m_s / mission.flight.acceleration_m_s2
    return sum(stage.duration_s for stage in leg.stages[:2])
