"""What a mission says of the UAV, its radio and its laser, in the terms of the physics."""

from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np

from optuav.mission import Mission
from optuav.physics import flight, kibam, laser, link, rotor
from optuav.physics.flight import Loads, regime_leg
from optuav.physics.quantity import Quantity, Vector, norm

Model = TypeVar("Model", rotor.Motor, flight.Airframe, link.Channel, laser.Conversion)


def _of(model: type[Model], table: str, mission: Mission) -> Model:
    """A model of the physics from the keys of the same names in a table of the mission."""
    return model(*map(vars(getattr(mission, table)).__getitem__, model._fields))


motor = partial(_of, rotor.Motor, "rotor")
"""Constants of a rotor; the mission's flight model is "rotors"."""
airframe = partial(_of, flight.Airframe, "body")
"""Mass and inertia; the mission's flight model is "rotors"."""
channel = partial(_of, link.Channel, "link")  # The radio channel to the device
conversion = partial(_of, laser.Conversion, "laser")
"""Fits of emitter and receiver; the mission has a laser."""


class Flow(NamedTuple):
    """Current [A] and power [W]."""

    current_A: Quantity
    power_W: Quantity


def pool(mission: Mission) -> kibam.Battery:
    """All packs as one battery."""
    given = mission.battery
    return kibam.Battery(
        given.packs * given.capacity_As, given.available_fraction, given.flow_rate_per_s
    )


def coverage_radius_m(mission: Mission) -> Quantity:
    """d_max [m] of the mission's outage limit."""
    return link.coverage_radius(channel(mission), mission.limits.outage_probability)


def hover_point_m(mission: Mission, radius_m: Quantity | None = None) -> Vector:
    """Where the mission hovers [m]: `route.hover_m`, or w_U; NaN where nothing is in reach."""
    route = mission.route
    if route.hover_m is not None:
        return route.hover_m
    if radius_m is None:
        radius_m = coverage_radius_m(mission)
    laser_m = mission.laser.position_m if mission.laser else route.origin_m
    places_m = route.origin_m, route.destination_m, mission.link.device_m
    return link.hover_point(*places_m, radius_m, mission.limits.min_altitude_m, laser_m)


def impossible(mission: Mission) -> str | None:
    """Why the UAV cannot fly at all; None if it can, or its loads are by regime."""
    if mission.flight.model == "regimes":
        return None
    return flight.impossible(airframe(mission), motor(mission), mission.wind.force_N)


def hover_load(mission: Mission) -> Flow:
    """Drawn while hovering, radio included; NaN where the UAV cannot hold its place."""
    given, radio = mission.flight, mission.link
    if given.model == "regimes":
        return Flow(given.hover_current_A, given.hover_power_W)
    turning = motor(mission)
    speed = rotor.hover_speed(turning, airframe(mission).external_force_N(mission.wind.force_N))
    radio_A = radio.transmit_power_W / radio.transmit_voltage_V
    return Flow(
        rotor.ROTORS * rotor.current(turning, speed) + radio_A,
        rotor.ROTORS * rotor.power(turning, speed) + radio.transmit_power_W,
    )


def rest_load(mission: Mission) -> Flow:
    """Drawn while resting on a roof with the rotors stopped."""
    given = mission.flight
    if given.model == "regimes":
        return Flow(given.rest_current_A, given.rest_power_W)
    return Flow(0.0, 0.0)


def leg_loads(mission: Mission, displacement_m: Vector) -> tuple[Loads, Quantity]:
    """What a leg draws by the mission's flight model, and its peak speed [m/s]."""
    given = mission.flight
    if given.model == "regimes":
        cap_m_s = np.inf if given.max_speed_m_s is None else given.max_speed_m_s
        drawn = given.flight_current_A, given.flight_power_W
        return regime_leg(norm(displacement_m), given.acceleration_m_s2, *drawn, cap_m_s)
    leg = flight.leg(airframe(mission), motor(mission), displacement_m, mission.wind.force_N)
    return leg.loads, leg.peak_speed_m_s


def least_loads(mission: Mission, distance_m: Quantity) -> Loads:
    """What any leg of some length [m] draws at least."""
    if mission.flight.model == "regimes":
        return leg_loads(mission, (distance_m, 0.0, 0.0))[0]
    return flight.least_loads(airframe(mission), motor(mission), distance_m, mission.wind.force_N)


def attenuation_per_km(mission: Mission) -> Quantity:
    """α [1/km] as stated, or from the visibility."""
    given = mission.laser
    assert given is not None
    if given.attenuation_per_km is not None:
        return given.attenuation_per_km
    assert given.visibility_km is not None
    return laser.attenuation(given.wavelength_nm, given.visibility_km)


def charging(mission: Mission, distance_m: Quantity, *, capped: bool = True) -> Flow:
    """Current into the battery and power received in clear sight of the laser, by distance [m].

    Without the cap, as if the battery took any current.
    """
    given, stated = mission.laser, mission.flight
    if given is None:
        return Flow(0.0, 0.0)
    if stated.model == "regimes" and stated.charge_current_A is not None:
        return Flow(stated.charge_current_A, stated.charge_power_W)
    voltage_V = mission.battery.nominal_voltage_V
    limit_W = mission.battery.charge_current_A * voltage_V if capped else np.inf
    light = conversion(mission), given.power_W, attenuation_per_km(mission)
    power_W = laser.received_power(*light, distance_m, limit_W)
    return Flow(power_W / voltage_V, power_W)
