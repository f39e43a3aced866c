"""Why a mission cannot be flown at all, and what is unwise in it: no battery simulated yet."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav.mission import Mission
from optuav.mission.messages import listed
from optuav.network import vehicle
from optuav.network.network import NO_LEG, Network, build_network
from optuav.network.places import HOVER
from optuav.physics import flight, link

TOLERANCE = 1e-9
"""Relative; a hover point on the rim of the coverage is covered."""

SECONDS_PER_HOUR = 3600.0


def impossibilities(network: Network) -> tuple[str, ...]:
    """Reasons for which no route can be flown; empty if there are none."""
    reasons = never_flyable(network)
    if not reasons and not network.routes.flyable.any():
        reasons = tuple(blocked_legs(network, 0))
    return reasons


def never_flyable(network: Network) -> tuple[str, ...]:
    """Reasons for which no route can be flown, with any number of stops."""
    return (*_too_heavy(network.mission), *_out_of_reach(network))


def _too_heavy(mission: Mission) -> Iterator[str]:
    if mission.flight.model == "rotors":
        why = flight.impossible(
            vehicle.airframe(mission), vehicle.motor(mission), mission.wind.force_N
        )
        if why is not None:
            yield f"the UAV cannot fly: {why} (body.mass_kg, wind.force_N, rotor.max_speed_rad_s)"


def _out_of_reach(network: Network) -> Iterator[str]:
    mission, limits = network.mission, network.mission.limits
    radius_m = vehicle.coverage_radius_m(mission)
    device_m = np.array(mission.link.device_m)
    point_m = network.places.position_m[HOVER]
    if np.isnan(point_m).any():
        height_m = abs(limits.min_altitude_m - mission.link.device_m[2])
        yield (
            f"the device is out of reach: its link covers {radius_m:.6g} m, but hovering at "
            f"limits.min_altitude_m = {limits.min_altitude_m:g} m means {height_m:.6g} m at least "
            "(link.device_m, link.transmit_power_W, limits.outage_probability)"
        )
        return
    if mission.route.hover_m is None:
        return
    distance_m = float(np.sqrt(((point_m - device_m) ** 2).sum()))
    if distance_m > radius_m * (1.0 + TOLERANCE):
        outage = float(link.outage_probability(vehicle.channel(mission), distance_m))
        yield (
            f"P1.a outage: route.hover_m is {distance_m:.6g} m from the device, its link covers "
            f"{radius_m:.6g} m (outage {outage:.3g}, limits.outage_probability = "
            f"{limits.outage_probability:g})"
        )
    if not limits.min_altitude_m <= point_m[2] <= limits.max_altitude_m:
        yield (
            f"P1.e altitude: route.hover_m is at {point_m[2]:g} m, outside "
            f"[{limits.min_altitude_m:g}, {limits.max_altitude_m:g}] m "
            "(limits.min_altitude_m, limits.max_altitude_m)"
        )


def blocked_legs(network: Network, route: int) -> list[str]:
    """Which legs of a route cannot be flown, and why."""
    legs, names = network.legs, network.places.names
    reasons = []
    for leg in network.routes.legs[route]:
        if leg == NO_LEG or legs.flyable[leg]:
            continue
        way = f"the leg {names[legs.start[leg]]} → {names[legs.end[leg]]}"
        if legs.crosses[leg] >= 0:
            building = network.mission.buildings[legs.crosses[leg]].name
            reasons.append(
                f"{way} crosses building {building} (flight.through_buildings = true allows it)"
            )
        else:
            reasons.append(f"{way} is not in the graph")
    return reasons


def advice(mission: Mission) -> tuple[str, ...]:
    """Warnings about a valid mission; empty if there is nothing to say."""
    network = build_network(mission)
    found = list(impossibilities(network))
    if not found:
        found += _deadline(network)
    found += _fast(network)
    found += _charging(mission)
    found += _dark(network)
    return tuple(found)


def _deadline(network: Network) -> Iterator[str]:
    shortest_s = float(network.routes.flight_time_s[network.routes.flyable].min())
    deadline_s = network.mission.limits.deadline_s
    if shortest_s > deadline_s:
        yield (
            f"limits.deadline_s = {deadline_s:g} s is shorter than the flight alone, "
            f"{shortest_s:.2f} s"
        )


def _fast(network: Network) -> Iterator[str]:
    """A sentence on the fastest leg that a route may use, where it is too fast for the model."""
    legs, names = network.legs, network.places.names
    speeds_m_s = np.where(legs.flyable & ~legs.edited, legs.peak_speed_m_s, 0.0)
    fastest = int(speeds_m_s.argmax())
    warning = flight.speed_warning(float(speeds_m_s[fastest]))
    if warning is not None:
        yield f"on the leg {names[legs.start[fastest]]} → {names[legs.end[fastest]]}, {warning}"


def _charging(mission: Mission) -> Iterator[str]:
    given = mission.battery
    recommended_A = given.packs * given.capacity_As / SECONDS_PER_HOUR
    if given.charge_current_A > recommended_A:
        yield (
            f"battery.charge_current_A = {given.charge_current_A:g} A is above 1 C of the battery, "
            f"{recommended_A:g} A"
        )


def _dark(network: Network) -> Iterator[str]:
    places = network.places
    if network.mission.laser is None:
        return
    dark = places.exists & ~places.laser_sight
    names = [places.names[place] for place in (HOVER, *places.buildings) if dark[place]]
    if names:
        yield f"the laser does not see {listed(names)}: no charging there"
