"""Motors: known numbers of the paper's UAV, energy balance, hovering in any wind."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import rotor
from optuav.physics.quantity import Quantity
from tests.physics.reference import (
    AIRFRAME,
    MOTOR,
    THRUST_N,
    WEIGHT_N,
    power_coefficients,
    printed,
)

MOTORS = st.builds(
    rotor.Motor,
    lift_coefficient_N_s2_rad2=st.floats(1e-7, 1e-4),
    drag_coefficient_Nm_s2_rad2=st.floats(1e-9, 1e-6),
    friction_torque_Nm=st.floats(1e-3, 0.1),
    viscous_damping_Nm_s_rad=st.floats(0.0, 1e-3),
    velocity_constant_rpm_V=st.floats(100.0, 3000.0),
    resistance_ohm=st.floats(0.0, 1.0),
    inertia_kg_m2=st.floats(0.0, 1e-3),
    max_speed_rad_s=st.floats(100.0, 3000.0),
)
SPEEDS = st.floats(1e-3, 3000.0)
ACCELERATIONS = st.floats(-1e4, 1e4)
COMPONENTS = st.floats(-25.0, 25.0)
VECTORS = st.tuples(COMPONENTS, COMPONENTS, COMPONENTS)


def test_hovering_of_the_paper() -> None:
    """Speed, current, voltage and power that hold 1.3 kg in still air."""
    speed = rotor.hover_speed(MOTOR, (0.0, 0.0, -WEIGHT_N))
    assert speed == printed("911.8575")
    assert rotor.current(MOTOR, speed) == printed("23.2276")
    assert rotor.voltage(MOTOR, speed) == printed("14.1103")
    assert 4 * rotor.power(MOTOR, speed) == printed("1310.994")


def test_full_speed_of_the_paper() -> None:
    """Current, voltage and power at v_max."""
    assert rotor.current(MOTOR, 1060.0) == printed("26.7158")
    assert rotor.voltage(MOTOR, 1060.0) == printed("16.3456")
    assert 4 * rotor.power(MOTOR, 1060.0) == printed("1746.744")


@pytest.mark.parametrize(
    ("direction", "force_N"),
    [
        ((1, 0, 0), "11.5791"),
        ((0, -1, 0), "11.5791"),
        ((0, 0, -1), "4.4758"),
        ((0, 0, 1), "29.9558"),
    ],
)
def test_largest_wind_of_the_paper(direction: tuple[int, int, int], force_N: str) -> None:
    """Level from any side, downwards, and upwards."""
    assert rotor.largest_wind(MOTOR, WEIGHT_N, direction) == printed(force_N)


def test_coefficients_come_from_the_propeller() -> None:
    """Lift and drag of Table I follow from the coefficients of the propeller in air."""
    radius_m, air_kg_m3 = 0.12, 1.225
    disc_m2 = math.pi * radius_m**2
    lift = 0.0048 * air_kg_m3 * disc_m2 * radius_m**2
    drag = 2.3515e-4 * air_kg_m3 * disc_m2 * radius_m**3
    assert pytest.approx(lift, rel=2e-5) == MOTOR.lift_coefficient_N_s2_rad2
    assert pytest.approx(drag, rel=2e-5) == MOTOR.drag_coefficient_Nm_s2_rad2


def test_paper_prints_the_polynomial_with_another_last_coefficient() -> None:
    """c1 to c8 as printed; the printed c9 = (κ_T/T_f) c6 should read (κ0/T_f) c6."""
    R, T_f, κ0, D_f, J = 0.2, 0.04, 2.2518e-8, 2e-4, 4.1904e-5
    κ_E = κ_T = 9.5493 / 920
    c1 = R * T_f**2 / κ_T**2
    c2 = T_f / κ_T * (κ_E + 2 * R * D_f / κ_T)
    c3 = D_f / κ_T * (R * D_f / κ_T + κ_E) + 2 * R * T_f * κ0 / κ_T**2
    c6 = 2 * J / T_f * c1
    paper = (c1, c2, c3, κ0 / T_f * c2, κ0**2 / T_f**2 * c1, c6, J**2 / T_f**2 * c1, J / T_f * c2)
    coefficients = power_coefficients(MOTOR)
    assert coefficients[:8] == pytest.approx(paper, rel=1e-14)
    assert coefficients[8] == pytest.approx(κ0 / T_f * c6, rel=1e-14)
    assert coefficients[8] != pytest.approx(κ_T / T_f * c6, rel=0.5)


def polynomial_power(motor: rotor.Motor, v: Quantity, acceleration: float = 0.0) -> Quantity:
    """The power of a turning rotor by the coefficients of eq (5)."""
    *steady, c6, c7, c8, c9 = power_coefficients(motor)
    rising = c6 + c7 * acceleration + c8 * v + c9 * v**2
    return sum(c * v**k for k, c in enumerate(steady)) + acceleration * rising


@given(MOTORS, SPEEDS, ACCELERATIONS)
def test_polynomial_is_the_power(motor: rotor.Motor, v: float, acceleration: float) -> None:
    """c1 to c9 give the power of the motor constants, also while the rotor speeds up."""
    # Of a rotor that brakes, the terms nearly cancel: they set the scale of the rounding.
    scale = polynomial_power(motor, v, abs(acceleration))
    assert polynomial_power(motor, v, acceleration) == pytest.approx(
        rotor.power(motor, v, acceleration), rel=1e-12, abs=1e-12 * scale
    )


def test_polynomial_of_a_motor_without_friction() -> None:
    """T_f = 0 divides nothing."""
    motor = MOTOR._replace(friction_torque_Nm=0.0)
    assert polynomial_power(motor, 900.0, 10.0) == pytest.approx(
        rotor.power(motor, 900.0, 10.0), rel=1e-13
    )


@given(MOTORS, SPEEDS, ACCELERATIONS)
def test_energy_is_conserved(motor: rotor.Motor, v: float, acceleration: float) -> None:
    """Electrical power = heat in the winding + torque × speed; the torque overcomes four others."""
    current = rotor.current(motor, v, acceleration)
    torque = (
        motor.friction_torque_Nm
        + motor.drag_coefficient_Nm_s2_rad2 * v * v
        + motor.viscous_damping_Nm_s_rad * v
        + motor.inertia_kg_m2 * acceleration
    )
    heat = motor.resistance_ohm * current**2
    assert rotor.power(motor, v, acceleration) == pytest.approx(
        heat + torque * v, rel=1e-12, abs=1e-12 * (heat + abs(torque) * v)
    )


@given(MOTORS)
def test_stopped_rotor_draws_nothing(motor: rotor.Motor) -> None:
    assert rotor.current(motor, 0.0) == 0.0
    assert rotor.power(motor, 0.0) == 0.0


@given(VECTORS)
@example((0.0, 0.0, 0.0))
def test_hover_speed_balances_the_force(force_N: tuple[float, float, float]) -> None:
    """Four rotors lift |F_e|, whatever its direction; NaN where that takes more than v_max."""
    speed = rotor.hover_speed(MOTOR, force_N)
    external_N = math.hypot(*force_N)
    if external_N > THRUST_N:
        assert np.isnan(speed)
    else:
        assert 4 * 3.8305e-6 * speed**2 == pytest.approx(external_N, rel=1e-12, abs=1e-100)
        assert speed <= 1060.0


def test_hovering_takes_the_full_thrust_at_most() -> None:
    """At |F_e| = F exactly the UAV hovers with v_max; one float above it cannot."""
    motor = MOTOR._replace(lift_coefficient_N_s2_rad2=0.3125, max_speed_rad_s=2.0)
    assert rotor.hover_speed(motor, (3.0, 0.0, -4.0)) == 2.0
    down_N = np.array([5.0, math.nextafter(5.0, 0.0), math.nextafter(5.0, 6.0)])
    speeds = rotor.hover_speed(motor, (0.0, 0.0, -down_N))
    np.testing.assert_array_equal(np.isnan(speeds), [False, False, True])


@given(VECTORS.filter(lambda way: math.hypot(*way) > 1e-3), st.floats(0.0, THRUST_N))
@example((0.0, 0.0, 1.0), THRUST_N)
@example((0.0, 1.0, 0.0), 0.0)
def test_largest_wind_uses_the_whole_thrust(
    direction: tuple[float, float, float], weight_N: float
) -> None:
    """Weight and the largest wind together are as strong as F, and no less wind is."""
    wind_N = rotor.largest_wind(MOTOR, weight_N, direction)
    unit = np.array(direction) / math.hypot(*direction)
    weight = np.array([0.0, 0.0, -weight_N])
    assert wind_N >= 0.0
    assert np.linalg.norm(weight + wind_N * unit) == pytest.approx(THRUST_N, rel=1e-12)
    assert np.linalg.norm(weight + 0.5 * wind_N * unit) <= THRUST_N * (1 + 1e-12)


def test_largest_wind_does_not_ask_how_long_the_direction_is() -> None:
    short = rotor.largest_wind(MOTOR, WEIGHT_N, (1e-3, 2e-3, -1e-3))
    long = rotor.largest_wind(MOTOR, WEIGHT_N, (1e3, 2e3, -1e3))
    assert short == pytest.approx(long, rel=1e-14)


def test_largest_wind_is_nan_where_the_weight_alone_is_too_much() -> None:
    """Also for a wind that would lift: in still air the UAV is on the ground."""
    weights = np.array([THRUST_N, math.nextafter(THRUST_N, math.inf), 20.0])
    for direction in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
        np.testing.assert_array_equal(
            np.isnan(rotor.largest_wind(MOTOR, weights, direction)), [False, True, True]
        )


def test_arrays_are_scalars_element_by_element() -> None:
    speeds, accelerations = np.linspace(0.0, 1060.0, 12), np.linspace(-5.0, 5.0, 3)[:, np.newaxis]
    for function in (rotor.current, rotor.voltage, rotor.power):
        together = function(MOTOR, speeds, accelerations)
        one_by_one = [[function(MOTOR, v, a) for v in speeds] for (a,) in accelerations]
        np.testing.assert_array_equal(together, one_by_one)
    x, z = np.linspace(-15.0, 15.0, 7), np.linspace(-20.0, 5.0, 6)[:, np.newaxis]
    np.testing.assert_array_equal(
        rotor.hover_speed(MOTOR, (x, 1.0, z)),
        [[rotor.hover_speed(MOTOR, (each, 1.0, down)) for each in x] for (down,) in z],
    )


def test_symbols_give_what_floats_give() -> None:
    """The functions build a tree whose value is theirs."""
    symbols = (Parameter(name, "", "1", value) for name, value in MOTOR._asdict().items())
    motor = rotor.Motor(*symbols)
    v = Variable("v", "v", "rad/s", 0.0, 1060.0, "", 0)
    for function in (rotor.current, rotor.power, polynomial_power):
        found = evaluate(function(motor, v), {"v": 800.0})
        assert found == pytest.approx(function(MOTOR, 800.0), rel=1e-13)
    wind = Variable("wind", "F_w", "N", -20.0, 20.0, "", 0)
    hover = rotor.hover_speed(motor, AIRFRAME.external_force_N((wind, 0.0, 0.0)))
    floats = rotor.hover_speed(MOTOR, (6.0, 0.0, -WEIGHT_N))
    assert evaluate(hover, {"wind": 6.0}) == pytest.approx(floats, rel=1e-13)
    assert evaluate(rotor.largest_wind(motor, WEIGHT_N, (1.0, 0.0, 0.0)), {}) == rotor.largest_wind(
        MOTOR, WEIGHT_N, (1.0, 0.0, 0.0)
    )
