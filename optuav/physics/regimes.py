"""One flight leg from rest to rest at constant load: speed up, cruise, brake along a line."""

from __future__ import annotations

import math

import numpy as np

from optuav.physics.loads import Loads
from optuav.physics.quantity import TINY, Quantity


def regime_leg(
    distance_m: Quantity,
    acceleration_m_s2: Quantity,
    current_A: Quantity,
    power_W: Quantity,
    max_speed_m_s: Quantity = math.inf,
) -> tuple[Loads, Quantity]:
    """A leg of constant load: accelerate, cruise at the speed cap if it is reached, brake.

    Parameters
    ----------
    distance_m
        d [m], ≥ 0.
    acceleration_m_s2
        a of speeding up and of braking [m/s²], > 0.
    current_A, power_W
        Drawn in flight [A], [W].
    max_speed_m_s
        v, speed cap [m/s], > 0; none by default.

    Returns
    -------
    Loads of its single stage, T = 2 sqrt(d/a) or d/v + v/a [s] where the cap is reached, and the
    peak speed [m/s].
    """
    peak = np.minimum(np.sqrt(distance_m * acceleration_m_s2), max_speed_m_s)
    duration = distance_m / np.maximum(peak, TINY) + peak / acceleration_m_s2
    return Loads((duration,), (current_A,), (power_W,)), peak


def regime_motion(
    distance_m: Quantity, acceleration_m_s2: Quantity, peak_speed_m_s: Quantity, time_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Way travelled [m] and speed [m/s] on a leg of constant load at moments after its start.

    Parameters
    ----------
    distance_m
        d [m], > 0.
    acceleration_m_s2
        a of speeding up and of braking [m/s²], > 0.
    peak_speed_m_s
        As `regime_leg` gives it [m/s], > 0.
    time_s
        Since the leg began [s], from 0 to its end.
    """
    rise_s = peak_speed_m_s / acceleration_m_s2
    end_s = distance_m / peak_speed_m_s + rise_s
    rising, left = np.minimum(time_s, rise_s), np.minimum(end_s - time_s, rise_s)
    speed = acceleration_m_s2 * np.minimum(rising, left)
    cruised_s = np.clip(time_s - rise_s, 0.0, end_s - 2.0 * rise_s)
    braked = 0.5 * acceleration_m_s2 * (rise_s**2 - left**2)
    return 0.5 * acceleration_m_s2 * rising**2 + peak_speed_m_s * cruised_s + braked, speed
