"""The UAV, radio and laser of a mission, in the terms of the physics."""

import numpy as np

from optuav.arrays import Booleans
from optuav.mission import Mission
from optuav.mission.validation import START_ROUNDING
from optuav.physics import kibam, link
from optuav.physics.flight import Flow
from optuav.physics.quantity import Quantity, Vector, distance
from optuav.tables import Wind

SAVED = 1e-9  # Share of the current in wind that calm air must add to count


def channel(mission: Mission) -> link.Channel:
    """The radio channel to the device."""
    return mission.link.as_record(link.Channel)


def start(mission: Mission) -> kibam.Tilted:
    """Charge of all packs at the start; full where none is stated (NaN in columns)."""
    battery = mission.pool
    charge, at_start = kibam.start(battery), mission.start
    if at_start is None:
        return charge
    if at_start.available_As is not None and at_start.bound_As is not None:
        levels = zip((at_start.available_As, at_start.bound_As), battery.full, strict=True)
        clipped = kibam.Wells(*(np.clip(level, 0.0, most) for level, most in levels))
        none = np.isnan(at_start.available_As)
        charge = _chosen(none, charge, kibam.Tilted.of(battery, clipped))
    if at_start.soc is not None:
        level = kibam.Tilted(at_start.soc * battery.capacity_As, 0.0)
        charge = _chosen(np.isnan(at_start.soc), charge, level)
    return charge


def starts_beyond(mission: Mission) -> Booleans:
    """Return where the wells at the start exceed their sizes by more than rounding."""
    exceeds, at_start = np.zeros((), bool), mission.start
    if at_start is not None and at_start.available_As is not None:
        battery = mission.pool
        assert at_start.bound_As is not None
        for level, most in zip(
            (at_start.available_As, at_start.bound_As), battery.full, strict=True
        ):
            rounding = START_ROUNDING * battery.capacity_As
            exceeds = exceeds | (level < -rounding) | (level > most + rounding)
    return exceeds


def _chosen(condition: Booleans, one: kibam.Tilted, other: kibam.Tilted) -> kibam.Tilted:
    """The charge of one where a condition holds, else of the other."""
    return kibam.Tilted(*(np.where(condition, a, b)[()] for a, b in zip(one, other, strict=True)))


def coverage_radius_m(mission: Mission) -> Quantity:
    """d_max [m] of the mission's outage limit."""
    return link.coverage_radius(channel(mission), mission.limits.outage_probability)


def hover_point_m(mission: Mission) -> Vector:
    """Return the hover point of the one device [m]; NaN where nothing is in reach.

    `InputError` if there are several devices.
    """
    mission.device_m  # noqa: B018  (raises with several)
    (point_m,) = hover_points_m(mission)
    return point_m


def hover_points_m(mission: Mission, radius_m: Quantity | None = None) -> list[Vector]:
    """Return the hover point of every device [m]: as stated, or w_U; NaN where it has no reach."""
    route, points_m = mission.route, list[Vector]()
    laser_m = mission.laser.position_m if mission.laser else route.origin_m
    for device in mission.served:
        if device.hover_m is not None:
            points_m.append(device.hover_m)
            continue
        if radius_m is None:
            radius_m = coverage_radius_m(mission)
        places_m = route.origin_m, route.destination_m, device.position_m
        low_m = mission.limits.min_altitude_m
        points_m.append(link.hover_point(*places_m, radius_m, low_m, laser_m))
    return points_m


def hover_load(mission: Mission) -> Flow:
    """Drawn while hovering, radio included; NaN where the UAV cannot hold its place."""
    flight, radio = mission.flight_model, mission.link
    drawn = flight.hover()
    if flight.radio_included:
        return drawn
    radio_A = radio.transmit_power_W / radio.transmit_voltage_V
    return Flow(drawn.current_A + radio_A, drawn.power_W + radio.transmit_power_W)


def in_calm_air(mission: Mission) -> Mission | None:
    """The mission without its wind, if that saves charge while hovering; else None."""
    if mission.wind == Wind():
        return None
    calm = mission.model_copy(update={"wind": Wind()})  # Not validated, as it may not count
    drawn_A, calm_A = (float(hover_load(air).current_A) for air in (mission, calm))
    counts = np.isfinite(drawn_A) and not calm_A <= drawn_A * (1.0 + SAVED)
    return mission.replace({"wind": None}) if counts else None


def laser_distance_m(mission: Mission, place_m: Vector) -> Quantity:
    """Distance of a place from the laser [m]."""
    assert mission.laser is not None
    return distance(mission.laser.position_m, place_m)


def charging_limit_W(mission: Mission) -> Quantity:
    """Largest power that the battery takes [W]."""
    return mission.battery.charge_current_A * mission.battery.nominal_voltage_V


def charging(mission: Mission, place_m: Vector, *, capped: bool = True) -> Flow:
    """Current into the battery and power received in clear sight of the laser, at a place [m].

    Without the cap, as if the battery took any current.
    """
    if (beam := mission.beam) is None:
        return Flow(0.0, 0.0)
    if (stated := mission.flight_model.charging()) is not None:
        return stated
    voltage_V = mission.battery.nominal_voltage_V
    most_W = charging_limit_W(mission) if capped else np.inf
    power_W = beam.received_W(laser_distance_m(mission, place_m), most_W)
    return Flow(power_W / voltage_V, power_W)
