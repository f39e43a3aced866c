"""What a mission tells that was flown in a stated way: times, charge and energy left, voltages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from optuav.network import vehicle
from optuav.network.network import Network
from optuav.network.routes import ORDERS
from optuav.network.timeline import Phase, route_phases

QUANTITIES = {
    "flight_time_s": "s",
    "mission_time_s": "s",
    "battery_percent": "%",
    "energy_percent": "%",
    "adjusted_percent": "%",
    "flight_voltage_V": "V",
    "hover_voltage_V": "V",
}
"""What a row may tell, and its unit: times, what is left by perspective, mean voltages."""
KINDS = ("flight", "hover", "rest")
STAY = {
    "hover_time_s": 0.0,
    "rest_time_s": 0.0,
    "building": "",
    "order": "rest-first",
    "laser": True,
}
"""What a row may state of how it was flown; any other key is one of the mission."""


def quantities(worked_out: Network, stay: Mapping[str, Any]) -> dict[str, float]:
    """Each of `QUANTITIES` for a way of flying that states all of `STAY`."""
    hover_s, rest_s = stay["hover_time_s"], stay["rest_time_s"]
    flown = route_phases(worked_out, _itinerary(worked_out, stay), hover_s, rest_s)
    given, hover = worked_out.mission.battery, vehicle.hover_load(worked_out.mission)
    capacity_As = float(vehicle.pool(worked_out.mission).capacity_As)
    nominal_J = capacity_As * given.nominal_voltage_V
    charge_As = {kind: _total(flown, kind, "charge_As") for kind in KINDS}
    energy_J = {kind: _total(flown, kind, "energy_J") for kind in KINDS}
    flight_V, hover_V = energy_J["flight"] / charge_As["flight"], hover.power_W / hover.current_A
    hovering_J = hover.power_W * hover_s
    adjusted = (
        energy_J["flight"] / (given.flight_energy_J or capacity_As * flight_V)
        - hovering_J / (given.hover_energy_J or capacity_As * hover_V)
        + (energy_J["hover"] + hovering_J + energy_J["rest"]) / nominal_J
    )
    flight_s = float(sum(each.duration_s for each in flown if each.kind == "flight"))
    return {
        "flight_time_s": flight_s,
        "mission_time_s": flight_s + hover_s + rest_s,
        "battery_percent": 100.0 * (1.0 + sum(charge_As.values()) / capacity_As),
        "energy_percent": 100.0 * (1.0 + sum(energy_J.values()) / nominal_J),
        "adjusted_percent": 100.0 * (1.0 + adjusted),
        "flight_voltage_V": flight_V,
        "hover_voltage_V": hover_V,
    }


def _total(flown: Sequence[Phase], kind: str, amount: str) -> float:
    """Charge [A s] or energy [J] into the battery in all phases of a kind."""
    return float(sum(getattr(each, amount) for each in flown if each.kind == kind))


def _itinerary(worked_out: Network, stay: Mapping[str, Any]) -> int:
    names = [building.name for building in worked_out.mission.buildings]
    if not stay["building"]:
        return 0
    return 1 + 2 * names.index(stay["building"]) + ORDERS.index(stay["order"])
