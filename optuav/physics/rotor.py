"""Electrical model of a rotor, and what four of them can lift.

A rotor turning at v [rad/s] draws the current i = (T_f + κ0 v² + D_f v + J v̇)/κ_T at the voltage
e = R i + κ_E v ([1]_, [2]_). A stopped rotor is switched off and draws nothing.

References
----------
.. [1] F. Morbidi, R. Cano, D. Lara, "Minimum-energy path generation for a quadrotor UAV",
   IEEE ICRA 2016.
.. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, eqs (1)-(5).
"""

from typing import NamedTuple

import numpy as np

from optuav.physics.quantity import Quantity, Vector, norm, one_where_not_negative

ROTORS = 4

RPM_PER_RAD_S = 9.5493
"""60/(2π) to the digits of the paper's Table I, which its numbers are computed with."""


class Motor(NamedTuple):
    """Constants of one rotor with its motor and propeller (four equal ones make a quadrotor)."""

    lift_coefficient_N_s2_rad2: Quantity  # ϱ, thrust over squared speed [N s²/rad²], > 0
    # κ0, aerodynamic drag torque over squared speed [N m s²/rad²], > 0.
    drag_coefficient_Nm_s2_rad2: Quantity
    friction_torque_Nm: Quantity  # T_f, motor friction [N m], ≥ 0
    viscous_damping_Nm_s_rad: Quantity  # D_f [N m s/rad], ≥ 0
    # κ_V [rpm/V], > 0; it fixes κ_E = κ_T = 9.5493/κ_V [V s/rad], [N m/A].
    velocity_constant_rpm_V: Quantity
    resistance_ohm: Quantity  # R of the winding [Ω], ≥ 0
    inertia_kg_m2: Quantity  # J of the turning parts [kg m²], ≥ 0
    max_speed_rad_s: Quantity  # v_max [rad/s], > 0

    @property
    def torque_constant_Nm_A(self) -> Quantity:
        """κ_T [N m/A], equal to the voltage constant κ_E [V s/rad]."""
        return RPM_PER_RAD_S / self.velocity_constant_rpm_V


def current(motor: Motor, speed_rad_s: Quantity, acceleration_rad_s2: Quantity = 0.0) -> Quantity:
    """Current of one rotor [A] at v [rad/s] ≥ 0 and v̇ [rad/s²], [2]_ eq (3); 0 at standstill."""
    torque_Nm = (
        motor.friction_torque_Nm
        + motor.drag_coefficient_Nm_s2_rad2 * speed_rad_s**2
        + motor.viscous_damping_Nm_s_rad * speed_rad_s
        + motor.inertia_kg_m2 * acceleration_rad_s2
    )
    return np.sign(speed_rad_s) * torque_Nm / motor.torque_constant_Nm_A


def voltage(motor: Motor, speed_rad_s: Quantity, acceleration_rad_s2: Quantity = 0.0) -> Quantity:
    """Voltage across one rotor [V], [2]_ eq (2); arguments as in `current`."""
    current_A = current(motor, speed_rad_s, acceleration_rad_s2)
    return motor.resistance_ohm * current_A + motor.torque_constant_Nm_A * speed_rad_s


def power(motor: Motor, speed_rad_s: Quantity, acceleration_rad_s2: Quantity = 0.0) -> Quantity:
    """Electrical power of one rotor [W], voltage times current; arguments as in `current`.

    Written out it is the polynomial [2]_ eq (5), but for c9: it is (κ0/T_f) c6, not (κ_T/T_f) c6.
    """
    current_A = current(motor, speed_rad_s, acceleration_rad_s2)
    return (motor.resistance_ohm * current_A + motor.torque_constant_Nm_A * speed_rad_s) * current_A


def full_thrust(motor: Motor) -> Quantity:
    """F = 4 ϱ v_max² [N], thrust of the four rotors at full speed."""
    return ROTORS * motor.lift_coefficient_N_s2_rad2 * motor.max_speed_rad_s**2


def steady_speed(motor: Motor, thrust_N: Quantity) -> Quantity:
    """Speed of each rotor sqrt(T/(4ϱ)) [rad/s] when the four give a thrust T [N] ≥ 0."""
    return np.sqrt(thrust_N / (ROTORS * motor.lift_coefficient_N_s2_rad2))


def hover_speed(motor: Motor, external_force_N: Vector) -> Quantity:
    """Speed of each rotor v_h = sqrt(|F_e|/(4ϱ)) [rad/s] that holds the UAV against a force.

    F_e is gravity plus wind [N]. NaN where v_h exceeds v_max: the UAV cannot hold its place.
    """
    external_N = norm(external_force_N)
    can_hover = one_where_not_negative(full_thrust(motor) - external_N)
    return can_hover * steady_speed(motor, external_N)


def largest_wind(motor: Motor, weight_N: Quantity, direction: Vector) -> Quantity:
    """Largest wind force along a direction [N] that lets the UAV just hold its place.

    It solves |weight + wind| = F; NaN where even the weight [N] exceeds the full thrust. The
    direction is where the wind pushes, any length but zero; z points up.
    """
    length = norm(direction)
    weight_along = -weight_N * direction[2] / length
    thrust_N = full_thrust(motor)
    margin_N = thrust_N - weight_N
    reserve = one_where_not_negative(margin_N) * margin_N * (thrust_N + weight_N)
    return np.sqrt(weight_along**2 + reserve) - weight_along
