"""Legs of constant load: accelerate, cruise at the speed cap if it is reached, brake."""

import math

import numpy as np

from optuav.physics.flight import Attitude, LegState, Loads
from optuav.physics.quantity import TINY, Quantity, Vector, norm


def leg(
    way_m: Vector,
    acceleration_m_s2: Quantity,
    current_A: Quantity,
    power_W: Quantity,
    max_speed_m_s: Quantity = math.inf,
) -> Loads:
    """A leg in a single stage; its way [m] has components (x, y, z).

    For a length d [m] ≥ 0, an acceleration a [m/s²] > 0 and a cap v [m/s]: T = 2 sqrt(d/a), or
    d/v + v/a [s] where the cap is reached.
    """
    distance = norm(way_m)
    peak = np.minimum(np.sqrt(distance * acceleration_m_s2), max_speed_m_s)
    rise_s = peak / acceleration_m_s2
    duration = distance / np.maximum(peak, TINY) + rise_s
    return Loads(way_m, ("flight",), (duration,), (current_A,), (power_W,), peak, rise_s)


def motion(
    peak_speed_m_s: Quantity, rise_s: Quantity, duration_s: Quantity, time_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Way travelled [m] and speed [m/s] at moments [s] between the start and the end.

    Speed rises evenly from rest to its peak, stays there, and falls for as long as it rose, at most
    half of the duration [s]; with a rise of 0 s it is constant.
    """
    ramp = np.maximum(rise_s, TINY)
    up, down = np.minimum(time_s / ramp, 1.0), np.minimum((duration_s - time_s) / ramp, 1.0)
    cruised_s = np.clip(time_s - rise_s, 0.0, duration_s - 2.0 * rise_s)
    travelled_s = 0.5 * rise_s * (up**2 + 1.0 - down**2) + cruised_s
    return peak_speed_m_s * travelled_s, peak_speed_m_s * np.minimum(up, down)


def state_at(leg: Loads, time_s: Quantity) -> LegState:
    """State on one leg of positive length at moments between its start and its end [s]."""
    distance, peak, rise_s = leg.distance_m, leg.peak_speed_m_s, leg.peak_s
    travelled, speed = motion(peak, rise_s, leg.duration_s, np.asarray(time_s, dtype=float))
    x, y, z = (travelled / distance * component for component in leg.way_m)
    unknown, stage = np.full_like(speed, np.nan), np.ones_like(speed)
    for end_s in np.cumsum(leg.durations_s)[:-1]:
        stage += time_s >= end_s
    return LegState(stage, (x, y, z), speed, Attitude(unknown, unknown))
