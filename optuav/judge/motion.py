"""Where the UAV is, how fast it moves and how it is tilted, within a phase."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.judge.phases import Phase, displacement_m
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics import flight
from optuav.physics.trajectory import regime_motion, state_at


class Motion(NamedTuple):
    """Position (moment, 3) [m], speed along the path [m/s], pitch and roll [rad]."""

    position_m: Floats
    speed_m_s: Floats
    pitch_rad: Floats
    roll_rad: Floats


def motion(mission: Mission, phase: Phase, passed_s: Floats) -> Motion:
    """Motion at moments since a phase began [s].

    A leg with figures of the user's own runs at constant speed; its attitude is not known.
    """
    start_m = np.array(phase.start.position_m)
    still, unknown = np.zeros_like(passed_s), np.full_like(passed_s, np.nan)
    if phase.kind != "flight":
        return Motion(np.tile(start_m, (len(passed_s), 1)), still, still, still)
    way_m = displacement_m(phase.start, phase.end)
    length_m = math.hypot(*way_m)
    if phase.stated:
        share = passed_s / phase.duration_s
        speed_m_s = np.full_like(passed_s, phase.distance_m / phase.duration_s)
        pitch_rad = roll_rad = unknown
    elif mission.flight.model == "regimes":
        given = mission.flight
        travelled_m, speed_m_s = regime_motion(
            length_m, given.acceleration_m_s2, phase.peak_speed_m_s, passed_s
        )
        share, pitch_rad, roll_rad = travelled_m / length_m, unknown, unknown
    else:
        airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
        wind_N = mission.wind.force_N
        leg = flight.leg(airframe, motor, way_m, wind_N)
        state = state_at(motor, airframe.external_force_N(wind_N), leg, passed_s)
        position_m = start_m + np.stack(state.position_m, axis=1)
        return Motion(
            position_m, state.speed_m_s, state.attitude.pitch_rad, state.attitude.roll_rad
        )
    return Motion(start_m + share[:, None] * np.array(way_m), speed_m_s, pitch_rad, roll_rad)
