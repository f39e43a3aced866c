"""Harvested energy and efficiency against distance: Fig. 10 of the paper."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics import laser


class Harvest(NamedTuple):
    """Energy harvested [J] and efficiency ζ [-] against the distance from the source [m]."""

    distance_m: Floats
    energy_J: Floats
    efficiency: Floats


def harvest(
    mission: Mission,
    source_power_W: float,
    distance_m: Floats,
    duration_s: float,
) -> Harvest:
    """What a source of some power gives in clear sight; the mission has a laser.

    The source is not turned down to what the battery takes, or its efficiency would tell of the
    battery.
    """
    share = laser.transmission(vehicle.attenuation_per_km(mission), distance_m)
    power_W = laser.unlimited_power(vehicle.conversion(mission), source_power_W, share)
    return Harvest(
        distance_m,
        duration_s * np.asarray(power_W, dtype=float),
        np.asarray(laser.efficiency(power_W, source_power_W), dtype=float),
    )


def source_power_for_full_charge_W(mission: Mission, distance_m: Floats) -> Floats:
    """Source power at which the battery takes its largest current, by distance [W]."""
    share = laser.transmission(vehicle.attenuation_per_km(mission), distance_m)
    most_W = mission.battery.charge_current_A * mission.battery.nominal_voltage_V
    return np.asarray(laser.source_limit(vehicle.conversion(mission), most_W, share), dtype=float)
