"""The UAV of the paper (Table I, with the airframe of Morbidi et al.), and its mission."""

from __future__ import annotations

from decimal import Decimal

import pytest

from optuav.physics.kibam import Battery
from optuav.physics.laser import Conversion
from optuav.physics.link import Channel
from optuav.physics.rotor import Motor
from optuav.physics.six_stages import Airframe

MOTOR = Motor(
    lift_coefficient_N_s2_rad2=3.8305e-6,
    drag_coefficient_Nm_s2_rad2=2.2518e-8,
    friction_torque_Nm=0.04,
    viscous_damping_Nm_s_rad=2e-4,
    velocity_constant_rpm_V=920.0,
    resistance_ohm=0.2,
    inertia_kg_m2=4.1904e-5,
    max_speed_rad_s=1060.0,
)
AIRFRAME = Airframe(
    mass_kg=1.3,
    gravity_m_s2=9.8,
    arm_length_m=0.175,
    inertia_x_kg_m2=0.081,
    inertia_y_kg_m2=0.081,
    inertia_z_kg_m2=0.142,
)
BATTERY = Battery(capacity_As=72_000.0, available_fraction=0.8, flow_rate_per_s=4.5e-5)
CHANNEL = Channel(
    noise_power_W=1e-4,
    transmit_power_W=5.0,
    rice_factor=20.0,
    snr_threshold_dB=-11.0,
    path_loss_exponent=2.0,
)
CONVERSION = Conversion(
    emitter_slope=0.34,
    emitter_offset_W=-1.1,
    receiver_slope=0.5434,
    receiver_offset_W=-0.2761,
)

WEIGHT_N = 12.74
THRUST_N = 4 * 3.8305e-6 * 1060.0**2
COMMUNICATION_A = 5.0 / 1.0
CHARGE_A = 10.0
NOMINAL_V = 11.1
OUTAGE_LIMIT = 0.01
MIN_ALTITUDE_M = 50.0

ORIGIN_M = (0.0, 0.0, 50.0)
DESTINATION_M = (2000.0, 0.0, 50.0)
LASER_M = (1000.0, 0.0, 50.0)
DEVICE_M = (1000.0, 3000.0, 0.0)
HOVER_M = (1000.0, 2501.0152, 50.0)


def printed(number: str) -> object:
    """The number as printed: within half a unit of its last digit."""
    exponent = Decimal(number).as_tuple().exponent
    assert isinstance(exponent, int)
    return pytest.approx(float(number), rel=0, abs=0.5 * 10.0**exponent)


def power_coefficients(motor: Motor) -> tuple[float, ...]:
    """Coefficients (c1, …, c9) of the power of a turning rotor as a polynomial, eq (5).

    p = c1 + c2 v + c3 v² + c4 v³ + c5 v⁴ + v̇ (c6 + c7 v̇ + c8 v + c9 v²) [W], v in [rad/s]. The
    paper prints c9 = (κ_T/T_f) c6; the power of `rotor.power` needs (κ0/T_f) c6. Written without
    the quotients by T_f, so that a motor without friction has coefficients too.
    """
    (_, κ0, T_f, D_f, _, R, J, _), κ = motor, motor.torque_constant_Nm_A
    back_emf_and_damping = (κ + 2.0 * R * D_f / κ) / κ
    c1 = R * T_f**2 / κ**2
    c2 = T_f * back_emf_and_damping
    c3 = D_f / κ * (R * D_f / κ + κ) + 2.0 * R * T_f * κ0 / κ**2
    c4 = κ0 * back_emf_and_damping
    c5 = R * κ0**2 / κ**2
    c6 = 2.0 * R * T_f * J / κ**2
    c7 = R * J**2 / κ**2
    c8 = J * back_emf_and_damping
    c9 = 2.0 * R * κ0 * J / κ**2
    return (c1, c2, c3, c4, c5, c6, c7, c8, c9)
