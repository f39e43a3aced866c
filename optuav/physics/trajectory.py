"""Position, speed and attitude on a leg at any moment.

Each turning movement speeds up for the first half of its time and slows down for the second; pitch
comes before roll [1]_.

References
----------
.. [1] M. Mozaffari, W. Saad, M. Bennis, M. Debbah, "Communications and control for wireless
   drone-based antenna array", IEEE Transactions on Communications, 2019, appendix D.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from optuav.physics.flight import LEVEL, Attitude, Leg
from optuav.physics.quantity import TINY, Quantity, Vector


class LegState(NamedTuple):
    """Where the UAV is on a leg, and what it does, at some moments.

    Where there is no state, on a leg that cannot be flown or before the leg begins, the stage is 0
    and everything else NaN.
    """

    stage: Quantity  # 1 to 5 in flight, 6 once it hovers at the end
    position_m: Vector  # From the start of the leg [m], components
    # Along the path [m/s]: the rate of change of the position, so 0 in the turn of stage 3, in
    # which the model freezes the position and keeps the speed for stage 4.
    speed_m_s: Quantity
    attitude: Attitude  # Pitch and roll [rad]


def state_at(leg: Leg, time_s: Quantity) -> LegState:
    """State of the UAV on one leg (scalar fields) at moments since it began [s] ≥ 0.

    The moments are a scalar or an array.
    """
    time = np.asarray(time_s, dtype=float)
    ends = np.cumsum([float(t) for t in leg.loads.durations_s])
    exists = (time >= 0.0) & ~np.isnan(ends[-1])
    stage = np.where(exists, np.searchsorted(ends, time, side="right") + 1, 0)
    in_stage = time - np.concatenate([[0.0], ends])[np.maximum(stage, 1) - 1]
    _, t2, _, t4, _ = leg.loads.durations_s
    a2, a4, whole = leg.acceleration_m_s2, leg.braking_m_s2, leg.distance_m
    accelerated, halfway = 0.5 * a2 * in_stage**2, 0.5 * a2 * t2**2
    braked = halfway + leg.peak_speed_m_s * in_stage - 0.5 * a4 * in_stage**2
    by_stage = [stage == number for number in range(1, 7)]
    travelled = np.select(by_stage, [0.0, accelerated, halfway, braked, whole, whole], np.nan)
    speed = np.select(by_stage, [0.0, a2 * in_stage, 0.0, a4 * (t4 - in_stage), 0.0, 0.0], np.nan)
    x, y, z = (travelled / np.maximum(whole, TINY) * way for way in leg.displacement_m)
    return LegState(stage[()], (x, y, z), speed[()], _attitude_at(leg, stage, in_stage))


def _turn_share(in_movement_s: Quantity, duration_s: Quantity) -> Quantity:
    """Share of a turn done [-] when it speeds up for one half of its time and slows down after."""
    done = np.clip(in_movement_s / np.maximum(duration_s, TINY), 0.0, 1.0)
    return np.where(done < 0.5, 2.0 * done**2, 1.0 - 2.0 * (1.0 - done) ** 2)


def _attitude_at(leg: Leg, stage: Quantity, in_stage: Quantity) -> Attitude:
    """Attitude in a stage, by the turns of stages 1, 3 and 5: pitch first, then roll."""
    pitch = roll = np.full(np.shape(stage), np.nan)
    attitudes = itertools.pairwise((LEVEL, leg.cruise, leg.brake, LEVEL))
    for number, (before, after) in zip((1, 3, 5), attitudes, strict=True):
        pitch_s, roll_s = leg.turn_times_s[number - 1 : number + 1]
        # The stage after a turn keeps the attitude the turn leads to.
        turning, turned = stage == number, stage == number + 1
        pitched = np.where(turned, 1.0, _turn_share(in_stage, pitch_s))
        rolled = np.where(turned, 1.0, _turn_share(in_stage - pitch_s, roll_s))
        here = turning | turned
        pitch = np.where(here, (1 - pitched) * before.pitch_rad + pitched * after.pitch_rad, pitch)
        roll = np.where(here, (1 - rolled) * before.roll_rad + rolled * after.roll_rad, roll)
    return Attitude(pitch[()], roll[()])


def regime_motion(
    distance_m: Quantity, acceleration_m_s2: Quantity, peak_speed_m_s: Quantity, time_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Way travelled [m] and speed [m/s] on a leg of constant load at moments since its start [s].

    Length d [m], acceleration a [m/s²] and the peak speed of `regime_leg` [m/s] are > 0; the
    moments lie between 0 and its end.
    """
    rise_s = peak_speed_m_s / acceleration_m_s2
    end_s = distance_m / peak_speed_m_s + rise_s
    rising, left = np.minimum(time_s, rise_s), np.minimum(end_s - time_s, rise_s)
    speed = acceleration_m_s2 * np.minimum(rising, left)
    cruised_s = np.clip(time_s - rise_s, 0.0, end_s - 2.0 * rise_s)
    braked = 0.5 * acceleration_m_s2 * (rise_s**2 - left**2)
    return 0.5 * acceleration_m_s2 * rising**2 + peak_speed_m_s * cruised_s + braked, speed
