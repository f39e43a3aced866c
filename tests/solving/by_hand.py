"""The longest hover worked out anew from a mission and the figures of its graph, without optuav.

Every route leaves a programme in Δ and T': max Δ with a Δ − c T' ≤ b and Δ + T' ≤ H. A few lines
solve it at its corners.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from optuav.mission import Mission

if TYPE_CHECKING:
    from optuav.network.graph import Graph

ROUNDING = 1e-9
SAME_S = 1e-7


@dataclass(frozen=True)
class Load:
    """Current [A] and power [W]."""

    current_A: float
    power_W: float


@dataclass(frozen=True)
class Way:
    """A route with what it costs and what the laser gives on its building."""

    places: tuple[str, ...]
    time_s: float
    charge_As: float
    energy_J: float
    received_W: float
    charging_A: float


@dataclass(frozen=True)
class Stay:
    """Hovering and resting on a route [s]."""

    way: Way
    hover_s: float
    rest_s: float

    @property
    def mission_s(self) -> float:
        return self.way.time_s + self.hover_s + self.rest_s


def hovering(mission: Mission) -> Load:
    """What hovering draws: as stated, or SPEC 1 from the rotor's constants, radio included."""
    given = mission.flight
    if given.model == "regimes":
        return Load(given.hover_current_A, given.hover_power_W)
    assert mission.rotor
    assert mission.body
    x, y, z = mission.wind.force_N
    force_N = math.hypot(x, y, z - mission.body.mass_kg * mission.body.gravity_m_s2)
    motor, link = mission.rotor, mission.link
    v = math.sqrt(force_N / (4 * motor.lift_coefficient_N_s2_rad2))
    κ = 9.5493 / motor.velocity_constant_rpm_V  # the paper's digits of 60/(2π)
    torque_Nm = (
        motor.friction_torque_Nm
        + motor.drag_coefficient_Nm_s2_rad2 * v**2
        + motor.viscous_damping_Nm_s_rad * v
    )
    i = torque_Nm / κ
    radio_A = link.transmit_power_W / link.transmit_voltage_V
    return Load(4 * i + radio_A, 4 * i * (motor.resistance_ohm * i + κ * v) + link.transmit_power_W)


def resting(mission: Mission) -> Load:
    """What resting draws."""
    given = mission.flight
    if given.model == "regimes":
        return Load(given.rest_current_A, given.rest_power_W)
    return Load(0.0, 0.0)


def charging_A(mission: Mission, received_W: float) -> float:
    """Current that a received power charges with; one stated in the mission goes with its power."""
    given = mission.flight
    if given.model == "regimes" and received_W == given.charge_power_W:
        return given.charge_current_A or 0.0
    return received_W / mission.battery.nominal_voltage_V


def ways(mission: Mission, graph: Graph) -> Iterator[Way]:
    """All routes with at most one stop over the edges there are, in the order of ties."""
    names = [building.name for building in mission.buildings]
    routes: list[tuple[str, ...]] = [("origin", "hover", "destination")]
    for name in names:
        routes += [
            ("origin", name, "hover", "destination"),
            ("origin", "hover", name, "destination"),
        ]
    for places in routes:
        pairs = list(itertools.pairwise(places))
        if not all(graph.has_edge(*pair) for pair in pairs):
            continue
        time_s, charge_As, energy_J = (
            sum(float(graph.edges[pair][figure]) for pair in pairs)
            for figure in ("duration_s", "charge_As", "energy_J")
        )
        stops = [graph.nodes[name] for name in places if name in names]
        received_W = sum(float(at["received_power_W"]) for at in stops if at["laser_sight"])
        yield Way(places, time_s, charge_As, energy_J, received_W, charging_A(mission, received_W))


def longest(mission: Mission, graph: Graph, way: Way, perspective: str) -> Stay | None:
    """The longest hover on a route with the shortest rest for it; None if there is none."""
    a, b, c = programme(mission, graph, way, perspective)
    horizon_s = mission.limits.deadline_s - way.time_s
    rests = len(way.places) == 4
    rows = [(a, -c, b), (1.0, 1.0, horizon_s), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)]
    if not rests:
        rows.append((0.0, 1.0, 0.0))
    scale = max(1.0, abs(horizon_s))
    corners = []
    for (p, q, e), (r, s, f) in itertools.combinations(rows, 2):
        determinant = p * s - q * r
        if determinant == 0.0:
            continue
        x, y = (e * s - q * f) / determinant, (p * f - e * r) / determinant
        if all(
            u * x + v * y <= w + ROUNDING * max(abs(w), abs(u) * scale, abs(v) * scale)
            for u, v, w in rows
        ):
            corners.append((x, y))
    if not corners:
        return None
    hover_s = max(x for x, _ in corners)
    return Stay(way, hover_s, min(y for x, y in corners if x >= hover_s - SAME_S))


def programme(
    mission: Mission, graph: Graph, way: Way, perspective: str
) -> tuple[float, float, float]:
    """Coefficients a, b and c of the state of charge, SPEC 2, as shares of the full battery."""
    given = mission.battery
    B = given.packs * given.capacity_As
    E_0 = B * given.nominal_voltage_V
    hover, rest = hovering(mission), resting(mission)
    at = graph.nodes["hover"]
    received_W = float(at["received_power_W"]) if at["laser_sight"] else 0.0
    net_A, net_W = way.charging_A - rest.current_A, way.received_W - rest.power_W
    spare = 1.0 - mission.limits.min_soc
    if perspective == "battery":
        drawn_A = hover.current_A - charging_A(mission, received_W)
        return drawn_A / B, spare - way.charge_As / B, net_A / B
    E_1 = E_2 = E_0
    if perspective == "adjusted":
        voltage_V = way.energy_J / way.charge_As if way.charge_As else given.nominal_voltage_V
        E_1 = given.flight_energy_J or B * voltage_V
        E_2 = given.hover_energy_J or B * hover.power_W / hover.current_A
    drawn = hover.power_W / E_2 - received_W / E_0
    return drawn, spare - way.energy_J / E_1, net_W / E_0


def longest_of_all(mission: Mission, graph: Graph, perspective: str = "battery") -> Stay | None:
    """The best of all routes by the tie rule of SPEC 3; None if none is feasible."""
    stays = [longest(mission, graph, way, perspective) for way in ways(mission, graph)]
    found = [stay for stay in stays if stay is not None]
    if not found:
        return None
    hover_s = max(stay.hover_s for stay in found)
    tied = [stay for stay in found if stay.hover_s >= hover_s - 1e-6]
    mission_s = min(stay.mission_s for stay in tied)
    tied = [stay for stay in tied if stay.mission_s <= mission_s + 1e-6]
    return min(tied, key=lambda stay: len(stay.way.places))
