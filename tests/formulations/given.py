"""Quantities with round numbers, and those of the paper's Table II, for tests to vary."""

from __future__ import annotations

from typing import Any

from formulations.parameters import Quantities

LINEAR = ("battery", "energy", "adjusted")
"""The perspectives of the paper, linear in Δ and T'."""

ROUND = {
    "deadline_s": 200.0,
    "min_soc": 0.1,
    "packs": 2.0,
    "capacity_As": 500.0,
    "nominal_voltage_V": 10.0,
    "flight_time_s": 50.0,
    "flight_charge_As": 100.0,
    "flight_energy_J": 1500.0,
    "hover_current_A": 10.0,
    "hover_power_W": 105.0,
    "hover_received_W": 15.0,
    "rest_current_A": 5.0,
    "rest_received_W": 50.0,
    "flight_battery_J": 15000.0,
    "hover_battery_J": 10500.0,
}
"""B = 1000 A s, E_0 = 10 kJ; 150 s are left for hovering (10 A) and resting (5 A)."""

TABLE_II = ROUND | {
    "min_soc": 0.05,
    "capacity_As": 36000.0,
    "flight_time_s": 59.35,
    "flight_charge_As": 93.658 * 59.35,
    "hover_current_A": 72.073 - 5.992,
    "rest_current_A": 5.992,
}
"""The direct flight of the mission ``paper-table2``."""


def quantities(base: dict[str, float] = ROUND, /, **changes: Any) -> Quantities:
    """The base with some of its numbers replaced, by arrays too."""
    return Quantities(**(base | changes))
