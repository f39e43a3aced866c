"""Figures that follow from a mission: what its hover draws, how far its link reaches, and so on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import build_network
from optuav.network.places import HOVER
from optuav.network.timeline import hover_net
from optuav.physics import rotor


@dataclass(frozen=True)
class Figure:
    """A derived value."""

    name: str
    value: float | tuple[float, ...] | None  # A number or a position; None where it does not exist
    unit: str

    @property
    def text(self) -> str:
        """The value to six digits, a position to the centimetre."""
        if self.value is None:
            return "none"
        if isinstance(self.value, tuple):
            return "(" + ", ".join(f"{each:.2f}" for each in self.value) + ")"
        return f"{self.value:.6g}"


@dataclass(frozen=True)
class BuildingFigures:
    """What follows for a building."""

    # As the mission states them.
    name: str
    position_m: tuple[float, float, float]
    footprint_m: tuple[float, float] | tuple[tuple[float, float], ...] | None
    laser_sight: bool  # Whether the laser is in clear sight
    received_power_W: float  # What the laser delivers there [W]
    # Flight time with a stop there, resting or hovering first [s]; None where it cannot be flown.
    rest_first_s: float | None
    hover_first_s: float | None


def derived(mission: Mission) -> tuple[Figure, ...]:
    """Derived figures of a mission, in the order of the physics."""
    return tuple(Figure(name, _known(value), unit) for name, value, unit in _figures(mission))


def _known(value: float | tuple[float, ...]) -> float | tuple[float, ...] | None:
    numbers = value if isinstance(value, tuple) else (value,)
    return value if all(map(math.isfinite, numbers)) else None


def _figures(mission: Mission) -> Iterator[tuple[str, float | tuple[float, ...], str]]:
    """Names, values, which are NaN where there is none, and units."""
    network = build_network(mission)
    places, routes = network.places, network.routes
    capacity_As = float(vehicle.pool(mission).capacity_As)
    yield "battery capacity B", capacity_As, "A s"
    yield "nominal battery energy E_0", capacity_As * mission.battery.nominal_voltage_V, "J"
    if mission.flight.model == "rotors":
        motor, airframe = vehicle.motor(mission), vehicle.airframe(mission)
        force_N = airframe.external_force_N(mission.wind.force_N)
        level_N = rotor.largest_wind(motor, airframe.weight_N, (1.0, 0.0, 0.0))
        yield "full thrust", float(rotor.full_thrust(motor)), "N"
        yield "weight", float(airframe.weight_N), "N"
        yield "rotor speed in hover", float(rotor.hover_speed(motor, force_N)), "rad/s"
        yield "largest level wind", float(level_N), "N"
    drawn = vehicle.hover_load(mission)
    yield "hover power, radio included", float(drawn.power_W), "W"
    yield "hover current, radio included", float(drawn.current_A), "A"
    yield "coverage radius d_max", vehicle.coverage_radius_m(mission), "m"
    yield "hover point", tuple(places.position_m[HOVER].tolist()), "m"
    direct_s = float(routes.flight_time_s[0]) if routes.flyable[0] else math.nan
    yield "direct flight", direct_s, "s"
    if mission.laser is not None:
        yield "net current in hover", hover_net(network).current_A, "A"
        sight = "" if places.laser_sight[HOVER] else " (no sight)"
        yield f"power received at hover{sight}", float(places.received_power_W[HOVER]), "W"


def building_figures(mission: Mission) -> tuple[BuildingFigures, ...]:
    """Derived figures of every building, in the mission's order."""
    network = build_network(mission)
    places, routes = network.places, network.routes
    flight_s = np.where(routes.flyable, routes.flight_time_s, np.nan)[1:].reshape(-1, 2)
    return tuple(
        BuildingFigures(
            building.name,
            building.position_m,
            building.footprint_m,
            bool(places.laser_sight[place]),
            float(places.received_power_W[place]),
            *(float(time_s) if math.isfinite(time_s) else None for time_s in times_s),
        )
        for building, place, times_s in zip(
            mission.buildings, places.buildings, flight_s, strict=True
        )
    )
