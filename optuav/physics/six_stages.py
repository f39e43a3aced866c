"""Flight legs from rest to rest by the six-stage model.

The six stages are turn, accelerate, turn, brake, turn, hover [1]_. With the unit path vector u, the
external force F_e (gravity and wind), p = F_e·u and the full thrust F, the net force along the path
is A(u) = p + sqrt(p² − |F_e|² + F²) and the thrust points along f = (A u − F_e)/F. The UAV
accelerates with A(u)/m and brakes with A(−u)/m; while it turns, the model freezes its position.
Each turn speeds up for the first half of its time and slows down for the second; pitch comes before
roll.

Drag c v² acts against the velocity over ground, so it leaves thrust direction and turns as they are
(`optuav.physics.drag`). A leg whose speed is capped cruises between accelerating and braking, at
the thrust |c v² u − F_e|, and turns once more.

References
----------
.. [1] M. Mozaffari, W. Saad, M. Bennis, M. Debbah, "Communications and control for wireless
   drone-based antenna array", IEEE Transactions on Communications, 2019, eqs (25)-(51) and
   appendix D. Its eq (46) misses a factor 1/√2, its eq (82) inverts A/m and the angles of its
   lemma 2 do not solve its own force balance; the forms used here do.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from optuav.physics import drag, rotor
from optuav.physics.flight import LEVEL, Attitude, LegState, Loads
from optuav.physics.quantity import TINY, Quantity, Vector, is_number, memoised, norm
from optuav.presentation.numbers import figure

STAGES = ("turn", "accelerate", "turn", "brake", "turn")
"""Stages of a leg in flight; how long the sixth, hovering, lasts is up to the mission."""

CAPPED_STAGES = ("turn", "accelerate", "turn", "cruise", "turn", "brake", "turn")
"""Stages where speed is capped; on a leg that does not reach the cap, the cruise and the turn after
it last 0 s."""

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

    # a2 and a4 along the path without drag [m/s²], and the largest speed [m/s].
    acceleration_m_s2: Quantity
    braking_m_s2: Quantity
    peak_speed_m_s: Quantity
    drag_per_m: Quantity  # c/m [1/m]
    # Attitudes while accelerating, cruising (None where no speed is capped) and braking.
    accelerate: Attitude
    cruise: Attitude | None
    brake: Attitude
    turn_times_s: tuple[Quantity, ...]  # Durations [s] of pitch and roll in each turn, in order
    loads: Loads  # Durations, currents and powers of the stages

    @property
    def attitudes(self) -> tuple[Attitude, ...]:
        """Attitudes between the turns, from level to level."""
        cruise = () if self.cruise is None else (self.cruise,)
        return LEVEL, self.accelerate, *cruise, self.brake, LEVEL

    @property
    def distance_m(self) -> Quantity:
        """Length of the path [m]."""
        return self.loads.distance_m


@memoised
def leg(
    airframe: Airframe,
    motor: rotor.Motor,
    displacement_m: Vector,
    wind_N: Vector = (0.0, 0.0, 0.0),
    drag_kg_m: Quantity = 0.0,
    max_speed_m_s: Quantity = math.inf,
) -> Leg:
    """A leg from rest to rest by the six-stage model [1]_, for a wind force [N].

    The displacement is end minus start [m], components (x, y, z), each a scalar or an array over
    legs. Drag is c = ½ρC_dA [kg/m] ≥ 0 and the cap of the speed over ground is > 0 [m/s]; with
    either, legs there and back differ. A cap adds stages (`CAPPED_STAGES`), and the turn after the
    cruise takes time however short the cruise is. Accelerations, attitudes and times are NaN where
    the thrust cannot carry weight and wind (`impossible` says why); a leg of no length takes no
    time.
    """
    force_N, thrust_N = airframe.external_force_N(wind_N), rotor.full_thrust(motor)
    distance = norm(displacement_m)
    x, y, z = along = tuple(part / np.maximum(distance, TINY) for part in displacement_m)
    # A(u) = p + sqrt(p² + F² − |F_e|²); the reserve F² − |F_e|² is A(u) A(−u).
    external_N, along_N = norm(force_N), force_N[0] * x + force_N[1] * y + force_N[2] * z
    margin_N = thrust_N - external_N
    # NaN, which voids the leg, unless there is a margin.
    with np.errstate(invalid="ignore"):
        root = np.sqrt(margin_N)
        reserve = np.divide(root, root) * margin_N * (thrust_N + external_N)
    root_N = np.sqrt(along_N**2 + reserve)
    forward_N, backward_N = along_N + root_N, root_N - along_N
    accelerate, brake = (
        _attitude([(net_N * u - f) / thrust_N for u, f in zip(direction, force_N, strict=True)])
        for net_N, direction in ((forward_N, along), (backward_N, (-x, -y, -z)))
    )
    a2, a4 = forward_N / airframe.mass_kg, backward_N / airframe.mass_kg
    # sqrt(2 d (1/a2 + 1/a4)): the product a2 a4 is known better than its factors.
    a2_a4 = reserve / airframe.mass_kg**2
    displacement_time = np.sqrt(2.0 * distance * (a2 + a4) / a2_a4)
    t2 = displacement_time * a4 / (a2 + a4)
    t4, peak, drag_per_m = displacement_time - t2, a2 * t2, drag_kg_m / airframe.mass_kg
    has_cap, cruise = not is_number(max_speed_m_s, math.inf), None
    if has_cap or not is_number(drag_kg_m, 0.0):
        moved = drag.run(distance, (a2, a4), (t2, t4), drag_per_m, max_speed_m_s)
        t2, cruise_s, t4, peak, capped = moved
    turning, full = zip(*_draws(motor), strict=True)
    moving = [(t2, *full), (t4, *full)]
    if has_cap:
        steady_N = tuple(drag_kg_m * peak**2 * u - f for u, f in zip(along, force_N, strict=True))
        # Where nothing cruises, one turn leads from accelerating to braking.
        turned = zip(_attitude(steady_N), brake, strict=True)
        cruise = Attitude(*(capped * own + (1.0 - capped) * other for own, other in turned))
        speed = rotor.steady_speed(motor, norm(steady_N))
        drawn = (rotor.ROTORS * draw(motor, speed) for draw in (rotor.current, rotor.power))
        moving.insert(1, (cruise_s, *drawn))
    # Turning in pitch and then in roll, each speeding up for half of its time and slowing down.
    torque_Nm = airframe.arm_length_m * motor.lift_coefficient_N_s2_rad2
    torque_Nm = torque_Nm * motor.max_speed_rad_s**2
    turns, inertias = list[Quantity](), (airframe.inertia_y_kg_m2, airframe.inertia_x_kg_m2)
    attitudes = LEVEL, accelerate, *([cruise] if cruise else []), brake, LEVEL
    for before, after in itertools.pairwise(attitudes):
        for start_rad, end_rad, inertia in zip(before, after, inertias, strict=True):
            turn_s = 2.0 * np.sqrt(np.abs(end_rad - start_rad) * inertia / torque_Nm)
            turns.append(np.sign(distance) * turn_s)
    rows = [(turns[0] + turns[1], *turning)]
    for k, stage in enumerate(moving, 1):
        rows += [stage, (turns[2 * k] + turns[2 * k + 1], *turning)]
    stages, peak_s = CAPPED_STAGES if has_cap else STAGES, rows[0][0] + t2
    durations_s, currents_A, powers_W = zip(*rows, strict=True)
    loads = Loads(displacement_m, stages, durations_s, currents_A, powers_W, peak, peak_s)
    figures = a2, a4, peak, drag_per_m, accelerate, cruise, brake
    return Leg(*figures, tuple(turns), loads)


def least_loads(
    airframe: Airframe, motor: rotor.Motor, distance_m: Quantity, wind_N: Vector
) -> Loads:
    """Return the least charge of any leg of some length [m], in the turns and between them.

    Without drag and cap. With |F_e| = F cos θ, both accelerations of `leg` are at most F sin θ / m
    where they are equal, and else take longer. Their thrusts differ by 2 F sin θ or more: stage 3
    turns the thrust by 2θ or more, and so do stages 1 and 5 together. A turn by γ takes
    2 sqrt(γ I/M) or more.
    """
    external_N, thrust_N = norm(airframe.external_force_N(wind_N)), rotor.full_thrust(motor)
    with np.errstate(invalid="ignore"):  # NaN where the thrust does not carry
        lean_rad = np.arccos(external_N / thrust_N)
    flown_s = 2.0 * np.sqrt(distance_m * (airframe.mass_kg / (thrust_N * np.sin(lean_rad))))
    inertia = np.minimum(airframe.inertia_x_kg_m2, airframe.inertia_y_kg_m2)
    torque_Nm = airframe.arm_length_m * thrust_N / rotor.ROTORS
    turning_s = np.sign(distance_m) * (4.0 * np.sqrt(2.0 * lean_rad * inertia / torque_Nm))
    way_m, stages = (distance_m, 0.0, 0.0), ("turn", "accelerate")
    currents_A, powers_W = _draws(motor)
    return Loads(way_m, stages, (turning_s, flown_s), currents_A, powers_W, np.nan, np.nan)


def _draws(motor: rotor.Motor) -> tuple[tuple[Quantity, Quantity], ...]:
    """Currents [A] and powers [W] during a turn and at full thrust.

    While turning, one rotor is at v_max and two at v_max/√2; at full thrust all are at v_max.
    """
    v_max = motor.max_speed_rad_s
    return tuple(
        (
            sum(draw(motor, share * v_max) for share in TURNING_SPEEDS),
            rotor.ROTORS * draw(motor, v_max),
        )
        for draw in (rotor.current, rotor.power)
    )


def _attitude(thrust: Sequence[Quantity]) -> Attitude:
    """Attitude that points the thrust along a vector of any length."""
    x, y, z = thrust
    # asin(f_y) of a unit vector, without the rounding that makes f_y exceed 1.
    return Attitude(np.arctan2(x, z), np.arctan2(y, np.sqrt(x * x + z * z)))


def impossible(airframe: Airframe, motor: rotor.Motor, wind_N: Vector) -> str | None:
    """A sentence on why no leg can be flown; None where legs can be flown. Scalars only."""
    thrust_N = float(rotor.full_thrust(motor))
    external_N = float(norm(airframe.external_force_N(wind_N)))
    if thrust_N > external_N:
        return None
    return (
        f"the rotors give {figure(thrust_N)} N at full speed, "
        f"but weight and wind take {figure(external_N)} N"
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
    moving_s, whole = leg.loads.durations_s[1::2], leg.loads.distance_m
    push, hold = (leg.acceleration_m_s2, leg.drag_per_m), (leg.braking_m_s2, leg.drag_per_m)
    (gained, rising), (halfway, _) = (drag.accelerated(*push, t) for t in (in_stage, moving_s[0]))
    left, falling = drag.braked(*hold, moving_s[-1] - in_stage)
    # Way travelled and speed in each stage, and in the hover after the last one.
    motion = [(0.0, 0.0), (gained, rising), (halfway, 0.0)]
    if leg.cruise is not None:
        peak = leg.peak_speed_m_s
        motion += [(halfway + peak * in_stage, peak), (halfway + peak * moving_s[1], 0.0)]
    motion += [(whole - left, falling), (whole, 0.0), (whole, 0.0)]
    by_stage = [stage == number for number in range(1, len(motion) + 1)]
    travelled, speed = (np.select(by_stage, choice, np.nan) for choice in zip(*motion, strict=True))
    x, y, z = (travelled / np.maximum(whole, TINY) * way for way in leg.loads.way_m)
    return LegState(stage[()], (x, y, z), speed[()], _attitude_at(leg, stage, in_stage))


def _turn_share(in_movement_s: Quantity, duration_s: Quantity) -> Quantity:
    """Share of a turn done [-] when it speeds up for one half of its time and slows down after."""
    done = np.clip(in_movement_s / np.maximum(duration_s, TINY), 0.0, 1.0)
    return np.where(done < 0.5, 2.0 * done**2, 1.0 - 2.0 * (1.0 - done) ** 2)


def _attitude_at(leg: Leg, stage: Quantity, in_stage: Quantity) -> Attitude:
    """Attitude in a stage, by the turns of the odd stages: pitch first, then roll."""
    pitch = roll = np.full(np.shape(stage), np.nan)
    turns = itertools.pairwise(leg.attitudes)
    for number, (before, after) in zip(itertools.count(1, 2), turns, strict=False):
        pitch_s, roll_s = leg.turn_times_s[number - 1 : number + 1]
        # The stage after a turn keeps the attitude the turn leads to.
        turning, turned = stage == number, stage == number + 1
        pitched = np.where(turned, 1.0, _turn_share(in_stage, pitch_s))
        rolled = np.where(turned, 1.0, _turn_share(in_stage - pitch_s, roll_s))
        here = turning | turned
        pitch = np.where(here, (1 - pitched) * before.pitch_rad + pitched * after.pitch_rad, pitch)
        roll = np.where(here, (1 - rolled) * before.roll_rad + rolled * after.roll_rad, roll)
    return Attitude(pitch[()], roll[()])
