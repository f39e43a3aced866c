"""Figures that follow from a mission: what its hover draws, how far its link reaches, and so on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from optuav.mission import vehicle
from optuav.mission.itineraries import NO_LEG
from optuav.mission.network import Network, network
from optuav.mission.phases import hover_net
from optuav.mission.places import HOVER
from optuav.mission.schema import Mission
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


def derived(mission: Mission) -> tuple[Figure, ...]:
    """Derived figures of a mission, in the order of the physics.

    Parameters
    ----------
    mission
        Any valid mission.
    """
    worked_out = network(mission)
    return tuple(
        Figure(name, _known(value), unit)
        for name, value, unit in (
            *_vehicle(mission),
            *_link(worked_out),
            *_charging(worked_out),
            *_flights(worked_out),
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


def _link(worked_out: Network) -> Iterator[Row]:
    yield "coverage radius d_max", vehicle.coverage_radius_m(worked_out.mission), "m"
    yield "hover point", tuple(worked_out.places.position_m[HOVER].tolist()), "m"


def _charging(worked_out: Network) -> Iterator[Row]:
    where = worked_out.places
    if worked_out.mission.laser is None:
        return
    yield "net current in hover", hover_net(worked_out).current_A, "A"
    for place in (HOVER, *where.buildings):
        sight = "" if where.laser_sight[place] else " (no sight)"
        name = f"power received at {where.names[place]}{sight}"
        yield name, float(where.received_power_W[place]), "W"


def _flights(worked_out: Network) -> Iterator[Row]:
    routes, table, names = worked_out.itineraries, worked_out.legs, worked_out.places.names
    for index in range(len(routes)):
        if not routes.flyable[index]:
            continue
        flown = routes.legs[index][routes.legs[index] != NO_LEG]
        places = [names[table.start[flown[0]]], *(names[end] for end in table.end[flown])]
        yield f"flight {' → '.join(places)}", float(routes.flight_time_s[index]), "s"
