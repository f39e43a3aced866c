"""Flight legs from rest to rest by the six-stage model.

The six stages are turn, accelerate, turn, brake, turn, hover [1]_. With the unit path vector u, the
external force F_e (gravity and wind), p = F_e·u and the full thrust F, the net force along the path
is A(u) = p + sqrt(p² − |F_e|² + F²) and the thrust points along f = (A u − F_e)/F. The UAV
accelerates with A(u)/m and brakes with A(−u)/m; while it turns, the model freezes its position.
Each turn speeds up for the first half of its time and slows down for the second; pitch comes before
roll. The model has no drag.

References
----------
.. [1] M. Mozaffari, W. Saad, M. Bennis, M. Debbah, "Communications and control for wireless
   drone-based antenna array", IEEE Transactions on Communications, 2019, eqs (25)-(51) and
   appendix D. Its eq (46) lacks a factor 1/√2, its eq (82) inverts A/m and the angles of its
   lemma 2 do not solve its own force balance; the forms used here do.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np

from optuav.physics import rotor
from optuav.physics.flight import LEVEL, Attitude, LegState, Loads
from optuav.physics.quantity import TINY, Quantity, Vector, kept, norm

STAGES = ("turn", "accelerate", "turn", "brake", "turn")
"""Stages of a leg in flight; how long the sixth, hovering, lasts is up to the mission."""

TURNING_SPEEDS = (0.0, 1.0 / math.sqrt(2.0), 1.0, 1.0 / math.sqrt(2.0))
"""Rotor speeds while a turn speeds up, in parts of v_max: rotor 3 pushes, rotor 1 is stopped."""


class Airframe(NamedTuple):
    """Mass and inertia of the UAV."""

    mass_kg: Quantity  # m [kg], > 0
    gravity_m_s2: Quantity  # g [m/s²], > 0
    arm_length_m: Quantity  # l from the centre to a rotor [m], > 0
    # I_x, I_y, I_z [kg m²], > 0; I_z has no part in the model (no yaw).
    inertia_x_kg_m2: Quantity
    inertia_y_kg_m2: Quantity
    inertia_z_kg_m2: Quantity

    @property
    def weight_N(self) -> Quantity:
        """Weight m g [N]."""
        return self.mass_kg * self.gravity_m_s2

    def external_force_N(self, wind_N: Vector) -> Vector:
        """F_e [N]: gravity and a wind force, components (x, y, z)."""
        x, y, z = wind_N
        return x, y, z - self.mass_kg * self.gravity_m_s2


class Leg(NamedTuple):
    """A leg of the six-stage model; every field may be an array over legs."""

    displacement_m: Vector  # Way from start to end [m], components (x, y, z)
    # a2 and a4 along the path [m/s²], and the speed a2 t2 at the end of stage 2 [m/s].
    acceleration_m_s2: Quantity
    braking_m_s2: Quantity
    peak_speed_m_s: Quantity
    # Attitude in stages 2 and 4.
    cruise: Attitude
    brake: Attitude
    # Durations [s] of the six turning movements: pitch and roll of stages 1, 3 and 5.
    turn_times_s: tuple[Quantity, ...]
    loads: Loads  # Durations, currents and powers of the five stages

    @property
    def distance_m(self) -> Quantity:
        """Length of the path [m]."""
        return norm(self.displacement_m)


@kept
def leg(
    airframe: Airframe, motor: rotor.Motor, displacement_m: Vector, wind_N: Vector = (0.0, 0.0, 0.0)
) -> Leg:
    """A leg from rest to rest by the six-stage model [1]_, for a wind force [N].

    The displacement is end minus start [m], components (x, y, z), each a scalar or an array over
    legs. Accelerations, attitudes and times are NaN where the thrust cannot carry weight and wind
    (`impossible` says why); a leg of no length takes no time.
    """
    force_N, thrust_N = airframe.external_force_N(wind_N), rotor.full_thrust(motor)
    distance = norm(displacement_m)
    x, y, z = (component / np.maximum(distance, TINY) for component in displacement_m)
    # A(u) = p + sqrt(p² + F² − |F_e|²); the reserve F² − |F_e|² is A(u) A(−u).
    external_N, along_N = norm(force_N), force_N[0] * x + force_N[1] * y + force_N[2] * z
    margin_N = thrust_N - external_N
    # NaN, which voids the leg, unless there is a margin.
    with np.errstate(invalid="ignore"):
        root = np.sqrt(margin_N)
        reserve = np.divide(root, root) * margin_N * (thrust_N + external_N)
    root_N = np.sqrt(along_N**2 + reserve)
    forward_N, backward_N = along_N + root_N, root_N - along_N
    attitudes = [LEVEL]
    for net_N, direction in ((forward_N, (x, y, z)), (backward_N, (-x, -y, -z))):
        fx, fy, fz = ((net_N * u - f) / thrust_N for u, f in zip(direction, force_N, strict=True))
        # asin(f_y) of a unit vector, without the rounding that makes f_y exceed 1.
        roll_rad = np.arctan2(fy, np.sqrt(fx * fx + fz * fz))
        attitudes.append(Attitude(pitch_rad=np.arctan2(fx, fz), roll_rad=roll_rad))
    _, cruise, brake = attitudes
    a2, a4 = forward_N / airframe.mass_kg, backward_N / airframe.mass_kg
    # sqrt(2 d (1/a2 + 1/a4)): the product a2 a4 is known better than its factors.
    a2_a4 = reserve / airframe.mass_kg**2
    displacement_time = np.sqrt(2.0 * distance * (a2 + a4) / a2_a4)
    t2 = displacement_time * a4 / (a2 + a4)
    # Turning in pitch and then in roll, each speeding up for half of its time and slowing down.
    v_max = motor.max_speed_rad_s
    torque_Nm = airframe.arm_length_m * motor.lift_coefficient_N_s2_rad2 * v_max**2
    turns, inertias = list[Quantity](), (airframe.inertia_y_kg_m2, airframe.inertia_x_kg_m2)
    for before, after in itertools.pairwise([*attitudes, LEVEL]):
        for start_rad, end_rad, inertia in zip(before, after, inertias, strict=True):
            turn_s = 2.0 * np.sqrt(np.abs(end_rad - start_rad) * inertia / torque_Nm)
            turns.append(np.sign(distance) * turn_s)
    # While turning, one rotor is at v_max and two at v_max/√2; else all are at v_max.
    draws = (rotor.current, rotor.power)
    turning = [sum(draw(motor, share * v_max) for share in TURNING_SPEEDS) for draw in draws]
    full = [rotor.ROTORS * draw(motor, v_max) for draw in draws]
    currents_A, powers_W = ((t, f, t, f, t) for t, f in zip(turning, full, strict=True))
    t1, t3, t5 = (turns[k] + turns[k + 1] for k in (0, 2, 4))
    durations_s = t1, t2, t3, displacement_time - t2, t5
    loads = Loads(displacement_m, STAGES, durations_s, currents_A, powers_W, a2 * t2, t1 + t2)
    return Leg(displacement_m, a2, a4, a2 * t2, cruise, brake, tuple(turns), loads)


def impossible(airframe: Airframe, motor: rotor.Motor, wind_N: Vector) -> str | None:
    """A sentence on why no leg can be flown; None where legs can be flown. Scalars only."""
    thrust_N = float(rotor.full_thrust(motor))
    external_N = float(norm(airframe.external_force_N(wind_N)))
    if thrust_N > external_N:
        return None
    return (
        f"the rotors give {thrust_N:.6g} N at full speed, "
        f"but weight and wind take {external_N:.6g} N"
    )


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
