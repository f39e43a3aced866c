"""From the arrays of a mission to the quantities that formulations speak of."""

from __future__ import annotations

import numpy as np

from formulations.quantities import Quantities
from optuav.mission import vehicle
from optuav.mission.network import Network
from optuav.mission.phases import hover_net, rest_net
from optuav.mission.places import HOVER
from optuav.mission.sight import Numbers, Points


def quantities(worked_out: Network, which: Numbers) -> Quantities:
    """Quantities of some itineraries, arrays with one entry each.

    Parameters
    ----------
    worked_out
        Places, legs and itineraries.
    which
        Numbers of itineraries; all of them direct, or all by way of a building.
    """
    mission, routes = worked_out.mission, worked_out.itineraries.take(which)
    given = mission.battery
    hover = vehicle.hover_load(mission)
    rest = rest_net(worked_out, routes.building)
    resting = routes.building >= 0
    return Quantities(
        deadline_s=mission.limits.deadline_s,
        min_soc=mission.limits.min_soc,
        packs=float(given.packs),
        capacity_As=given.capacity_As,
        nominal_voltage_V=given.nominal_voltage_V,
        flight_time_s=routes.flight_time_s,
        flight_charge_As=routes.flight_charge_As,
        flight_energy_J=routes.flight_energy_J,
        hover_current_A=-hover_net(worked_out).current_A,
        hover_power_W=float(hover.power_W),
        hover_received_W=float(worked_out.places.received_power_W[HOVER]),
        rest_current_A=np.where(resting, rest.current_A, 0.0),
        rest_received_W=np.where(resting, rest.power_W, 0.0),
        flight_battery_J=_battery_energy(
            worked_out, given.flight_energy_J, routes.flight_energy_J, routes.flight_charge_As
        ),
        hover_battery_J=_battery_energy(
            worked_out, given.hover_energy_J, np.array(hover.power_W), np.array(hover.current_A)
        ),
    )


def _battery_energy(
    worked_out: Network, stated_J: float | None, energy_J: Points, charge_As: Points
) -> Points:
    """E_1 or E_2 [J]: as stated, or B times the voltage at which a load draws its charge."""
    if stated_J is not None:
        return np.full(np.shape(energy_J), stated_J)
    given = worked_out.mission.battery
    drawn = charge_As > 0.0
    voltage_V = np.where(drawn, energy_J / np.where(drawn, charge_As, 1.0), given.nominal_voltage_V)
    return given.packs * given.capacity_As * voltage_V
