"""Figures that follow from a mission: what its hover draws, how far its link reaches, and so on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.places import HOVER
from optuav.network.timeline import hover_net
from optuav.physics import rotor


@dataclass(frozen=True)
class Figure:
    """A derived value.

    Parameters
    ----------
    name
        What it is.
    value
        A number or a position; None where it does not exist.
    unit
        Its unit.
    """

    name: str
    value: float | tuple[float, ...] | None
    unit: str

    @property
    def text(self) -> str:
        """The value as a reader wants it."""
        if self.value is None:
            return "none"
        if isinstance(self.value, tuple):
            return "(" + ", ".join(f"{each:.2f}" for each in self.value) + ")"
        return f"{self.value:.6g}"


@dataclass(frozen=True)
class BuildingFigures:
    """What follows for a building.

    Parameters
    ----------
    name, position_m, footprint_m
        As the mission states them.
    laser_sight
        Whether the laser is in clear sight.
    received_power_W
        What the laser delivers there [W].
    rest_first_s, hover_first_s
        Flight time by way of it, resting or hovering first [s]; None where it cannot be flown.
    """

    name: str
    position_m: tuple[float, float, float]
    footprint_m: tuple[float, float] | tuple[tuple[float, float], ...] | None
    laser_sight: bool
    received_power_W: float
    rest_first_s: float | None
    hover_first_s: float | None


def derived(mission: Mission) -> tuple[Figure, ...]:
    """Derived figures of a mission, in the order of the physics.

    Parameters
    ----------
    mission
        Any valid mission.
    """
    network = build_network(mission)
    return tuple(
        Figure(name, _known(value), unit)
        for name, value, unit in (
            *_vehicle(mission),
            *_link(network),
            *_charging(network),
        )
    )


def building_figures(mission: Mission) -> tuple[BuildingFigures, ...]:
    """Derived figures of every building, in the mission's order."""
    network = build_network(mission)
    where, routes = network.places, network.routes
    flight_s = np.where(routes.flyable, routes.flight_time_s, np.nan)[1:].reshape(-1, 2)
    return tuple(
        BuildingFigures(
            building.name,
            building.position_m,
            building.footprint_m,
            bool(where.laser_sight[place]),
            float(where.received_power_W[place]),
            *(float(time_s) if math.isfinite(time_s) else None for time_s in times_s),
        )
        for building, place, times_s in zip(
            mission.buildings, where.buildings, flight_s, strict=True
        )
    )


Row = tuple[str, float | tuple[float, ...], str]


def _known(value: float | tuple[float, ...]) -> float | tuple[float, ...] | None:
    numbers = value if isinstance(value, tuple) else (value,)
    return value if all(math.isfinite(each) for each in numbers) else None


def _vehicle(mission: Mission) -> Iterator[Row]:
    pool = vehicle.pool(mission)
    yield "battery capacity B", float(pool.capacity_As), "A s"
    nominal_J = float(pool.capacity_As) * mission.battery.nominal_voltage_V
    yield "nominal battery energy E_0", nominal_J, "J"
    if mission.flight.model == "rotors":
        motor, airframe = vehicle.motor(mission), vehicle.airframe(mission)
        force_N = airframe.external_force_N(mission.wind.force_N)
        yield "full thrust", float(rotor.full_thrust(motor)), "N"
        yield "weight", float(airframe.weight_N), "N"
        yield "rotor speed in hover", float(rotor.hover_speed(motor, force_N)), "rad/s"
        level_N = rotor.largest_wind(motor, airframe.weight_N, (1.0, 0.0, 0.0))
        yield "largest level wind", float(level_N), "N"
    load = vehicle.hover_load(mission)
    yield "hover power, radio included", float(load.power_W), "W"
    yield "hover current, radio included", float(load.current_A), "A"


def _link(network: Network) -> Iterator[Row]:
    yield "coverage radius d_max", vehicle.coverage_radius_m(network.mission), "m"
    yield "hover point", tuple(network.places.position_m[HOVER].tolist()), "m"
    direct_s = network.routes.flight_time_s[0]
    flyable = network.routes.flyable[0]
    yield "direct flight", float(direct_s) if flyable else math.nan, "s"


def _charging(network: Network) -> Iterator[Row]:
    where = network.places
    if network.mission.laser is None:
        return
    yield "net current in hover", hover_net(network).current_A, "A"
    sight = "" if where.laser_sight[HOVER] else " (no sight)"
    yield f"power received at hover{sight}", float(where.received_power_W[HOVER]), "W"
