"""What a mission says of the UAV, its radio and its laser, in the terms of the physics."""

import numpy as np

from optuav.mission import Mission
from optuav.mission.flight_model import flight_of
from optuav.physics import kibam, laser, link
from optuav.physics.flight import Flow
from optuav.physics.quantity import Quantity, Vector


def channel(mission: Mission) -> link.Channel:
    """The radio channel to the device."""
    return mission.link.as_record(link.Channel)


def conversion(mission: Mission) -> laser.Conversion:
    """Fits of emitter and receiver; the mission has a laser."""
    assert mission.laser is not None
    return mission.laser.as_record(laser.Conversion)


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


def hover_load(mission: Mission) -> Flow:
    """Drawn while hovering, radio included; NaN where the UAV cannot hold its place."""
    flight, radio = flight_of(mission), mission.link
    drawn = flight.hover()
    if flight.radio_included:
        return drawn
    radio_A = radio.transmit_power_W / radio.transmit_voltage_V
    return Flow(drawn.current_A + radio_A, drawn.power_W + radio.transmit_power_W)


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
    given = mission.laser
    if given is None:
        return Flow(0.0, 0.0)
    if (stated := flight_of(mission).charging()) is not None:
        return stated
    voltage_V = mission.battery.nominal_voltage_V
    limit_W = mission.battery.charge_current_A * voltage_V if capped else np.inf
    light = conversion(mission), given.power_W, attenuation_per_km(mission)
    power_W = laser.received_power(*light, distance_m, limit_W)
    return Flow(power_W / voltage_V, power_W)
