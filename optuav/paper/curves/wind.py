"""Energy of a hover against wind, and the largest wind along an axis: Fig. 9 of the paper."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics import rotor
from optuav.physics.quantity import Vector

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
POINTS = 401


class Curve(NamedTuple):
    """Energy of a hover [J], radio included, against the wind along an axis [N]."""

    force_N: Floats
    energy_J: Floats


def limits_N(mission: Mission, direction: Vector) -> tuple[float, float]:
    """Least and largest wind along a unit vector in which the UAV holds its place [N].

    The mission's flight model is "rotors".
    """
    motor, weight_N = vehicle.motor(mission), vehicle.airframe(mission).weight_N
    against = (-direction[0], -direction[1], -direction[2])
    return (
        -float(rotor.largest_wind(motor, weight_N, against)),
        float(rotor.largest_wind(motor, weight_N, direction)),
    )


def hover_energy(mission: Mission, direction: Vector, duration_s: float) -> Curve:
    """The curve along a unit vector between its limits, 0 N and the weight among its points."""
    low, high = limits_N(mission, direction)
    weight_N = float(vehicle.airframe(mission).weight_N)
    inner = [force for force in (0.0, weight_N) if low < force < high]
    force_N = np.union1d(np.linspace(low, high, POINTS), inner)
    # The limits themselves are held but for rounding, which must not void them.
    inside = np.clip(force_N, low * (1.0 - 1e-12), high * (1.0 - 1e-12))
    x, y, z = (inside * component for component in direction)
    load = vehicle.hover_load(mission, (x, y, z))
    return Curve(force_N, duration_s * np.asarray(load.power_W, dtype=float))


def calmest_N(curve: Curve) -> float:
    """Wind of the least energy [N]."""
    return float(curve.force_N[np.argmin(curve.energy_J)])
