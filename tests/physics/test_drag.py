"""Drag and a capped speed: check numbers, equations of motion, limits, stages, states, arrays."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import drag, rotor
from optuav.physics import six_stages as flight
from tests.physics.reference import (
    AIRFRAME,
    DESTINATION_M,
    HOVER_M,
    MOTOR,
    ORIGIN_M,
    THRUST_N,
    printed,
)
from tests.physics.test_flight import Case, cases, stage_ends, thrust_direction

TO_HOVER_M = tuple(np.subtract(HOVER_M, ORIGIN_M).tolist())
DRAG_KG_M = drag.coefficient(0.03, 1.225)
EXPONENTS = st.floats(-12.0, 4.0).map(lambda power: 10.0**power)
"""x = 2cd/m, from no drag that matters to a speed that is reached at once."""


def paper(**options: Any) -> flight.Leg:
    return flight.leg(AIRFRAME, MOTOR, TO_HOVER_M, **options)


def run(
    a2: float, a4: float, distance_m: float, drag_per_m: float, cap_m_s: float = math.inf
) -> drag.Run:
    """A run, with the times without drag by T_d = sqrt(2 d (1/a2 + 1/a4))."""
    T_d = math.sqrt(2.0 * distance_m * (1.0 / a2 + 1.0 / a4))
    free_s = T_d * a4 / (a2 + a4), T_d * a2 / (a2 + a4)
    return drag.run(distance_m, (a2, a4), free_s, drag_per_m, cap_m_s)


def integrated(
    acceleration: float, drag_per_m: float, speed: float, duration_s: float
) -> tuple[float, float]:
    """Way [m] and speed [m/s] after a time by v' = a − k v², or v' = −a − k v² with −a."""
    scale = max(
        speed, min(abs(acceleration) * duration_s, math.sqrt(abs(acceleration) / drag_per_m))
    )
    course = solve_ivp(
        lambda _, state: [state[1], acceleration - drag_per_m * state[1] ** 2],
        (0.0, duration_s),
        [0.0, speed],
        "LSODA",
        rtol=1e-11,
        atol=[1e-12 * scale * duration_s, 1e-12 * scale],
    )
    return course.y[0, -1], course.y[1, -1]


# Check numbers


def test_the_papers_leg_with_drag() -> None:
    """0.03 m² from the hover point to the destination: 37.9 s become 113.6 s."""
    way = tuple(np.subtract(DESTINATION_M, HOVER_M).tolist())
    leg = flight.leg(AIRFRAME, MOTOR, way, drag_kg_m=DRAG_KG_M)
    assert leg.loads.duration_s == printed("113.60610")
    assert leg.loads.charge_As == printed("12012.163")
    assert leg.peak_speed_m_s == printed("25.10292")
    assert leg.loads.stages == flight.STAGES


def test_a_cap_just_below_the_peak_costs_a_turn() -> None:
    """0.535 s and 35.16 A s without drag: two turns by way of level flight are longer than one."""
    free, capped = paper(), paper(max_speed_m_s=float(paper().peak_speed_m_s) * (1.0 - 1e-9))
    assert capped.loads.duration_s - free.loads.duration_s == pytest.approx(0.535, abs=5e-4)
    assert capped.loads.charge_As - free.loads.charge_As == pytest.approx(35.16, abs=5e-3)
    free = paper(drag_kg_m=DRAG_KG_M)
    cap = float(free.peak_speed_m_s) * (1.0 - 1e-9)
    capped = paper(drag_kg_m=DRAG_KG_M, max_speed_m_s=cap)
    assert capped.loads.duration_s - free.loads.duration_s < 1e-3


# Motion


@pytest.mark.campaign
@given(
    st.floats(0.1, 30.0), st.floats(0.1, 30.0), st.floats(0.1, 1e4), EXPONENTS, st.floats(0.05, 2)
)
@example(9.0, 0.1, 100.0, 1e4, 0.999)
@example(8.9, 8.9, 2693.0, 1e-12, 0.5)
def test_the_equations_of_motion_end_at_the_end(
    a2: float, a4: float, distance_m: float, x: float, share: float
) -> None:
    """m v' = A − c v² up to the peak, a cruise, m v' = −A_b − c v² to rest: that is the way."""
    drag_per_m = x / (2.0 * distance_m)
    peak = float(run(a2, a4, distance_m, drag_per_m).peak_speed_m_s)
    for cap in (math.inf, share * peak):
        t2, cruise_s, t4, top, capped = run(a2, a4, distance_m, drag_per_m, cap)
        assert top == pytest.approx(min(peak, cap), rel=1e-14)
        assert capped == (cap < peak)
        x2, reached = integrated(a2, drag_per_m, 0.0, t2)
        assert reached == pytest.approx(top, rel=1e-8)
        x4, left = integrated(-a4, drag_per_m, top, t4)
        assert left == pytest.approx(0.0, abs=1e-7 * top)
        assert x2 + top * cruise_s + x4 == pytest.approx(distance_m, rel=1e-7)


@given(st.floats(0.1, 30.0), st.floats(0.1, 30.0), st.floats(0.1, 1e4), EXPONENTS)
def test_peak_speed_by_the_energy_balance(
    a2: float, a4: float, distance_m: float, x: float
) -> None:
    """v² = A A_b (1 − e⁻ˣ)/(c (A e⁻ˣ + A_b)), as the ways to the peak and from it are the whole."""
    k = x / (2.0 * distance_m)
    peak = run(a2, a4, distance_m, k).peak_speed_m_s
    expected = -a2 * a4 * math.expm1(-x) / (k * (a2 * math.exp(-x) + a4))
    assert peak**2 == pytest.approx(expected, rel=1e-12)


@given(st.floats(0.1, 30.0), st.floats(0.1, 30.0), st.floats(0.1, 1e4), EXPONENTS)
def test_a_cap_at_the_peak_changes_nothing_at_once(
    a2: float, a4: float, distance_m: float, x: float
) -> None:
    """Time moved is continuous where the cap meets the peak, and grows as the cap falls."""
    k = x / (2.0 * distance_m)
    free = run(a2, a4, distance_m, k)
    whole = sum(free[:3])
    times = [
        sum(run(a2, a4, distance_m, k, share * float(free.peak_speed_m_s))[:3])
        for share in (2.0, 1.0, 1.0 - 1e-15, 1.0 - 1e-9, 0.9, 0.5)
    ]
    assert times[:2] == [whole] * 2
    assert times[2:4] == pytest.approx([whole] * 2, rel=1e-8)
    assert all(b >= a * (1.0 - 1e-9) for a, b in itertools.pairwise(times))
    assert times[-1] > times[0]


# Without drag or cap


@given(cases())
@example(Case(AIRFRAME, (0.0, 0.0, 0.0), TO_HOVER_M))
def test_no_drag_and_no_cap_are_todays_legs_in_every_digit(case: Case) -> None:
    """A table with c = 0 and a cap that is not reached has the digits of the leg without."""
    free, given_leg = case.leg, (case.airframe, MOTOR, case.displacement_m, case.wind_N)
    none = np.zeros(2)
    for options in ({"drag_kg_m": none}, {"drag_kg_m": none, "max_speed_m_s": np.full(2, 1e9)}):
        table = flight.leg(*given_leg, **options)
        for name in ("duration_s", "charge_As", "energy_J"):
            np.testing.assert_array_equal(getattr(table.loads, name), getattr(free.loads, name))
        np.testing.assert_array_equal(table.peak_speed_m_s, free.peak_speed_m_s)


@given(cases())
def test_less_and_less_drag_leads_to_none(case: Case) -> None:
    """x = 1e-9 changes a leg by about as much."""
    distance = math.hypot(*case.displacement_m)
    c = 1e-9 * case.airframe.mass_kg / (2.0 * distance)
    given_leg = case.airframe, MOTOR, case.displacement_m, case.wind_N
    slowed = flight.leg(*given_leg, drag_kg_m=c)
    balance = case.leg.braking_m_s2 / case.leg.acceleration_m_s2
    bound = 1e-9 * (1.0 + balance + 1.0 / balance)
    assert slowed.loads.duration_s == pytest.approx(case.leg.loads.duration_s, rel=bound)
    assert slowed.peak_speed_m_s == pytest.approx(case.leg.peak_speed_m_s, rel=bound)


# Stages and states


@given(cases(), EXPONENTS, st.floats(0.05, 0.999))
def test_the_cruise_balances_drag_gravity_and_wind(case: Case, x: float, share: float) -> None:
    """T f + F_e = c v² u, at the rotor speed of that thrust, which is never above the full one."""
    c = x * case.airframe.mass_kg / (2.0 * math.hypot(*case.displacement_m))
    given_leg = case.airframe, MOTOR, case.displacement_m, case.wind_N
    peak = float(flight.leg(*given_leg, drag_kg_m=c).peak_speed_m_s)
    leg = flight.leg(*given_leg, drag_kg_m=c, max_speed_m_s=share * peak)
    assert leg.loads.stages == flight.CAPPED_STAGES
    assert leg.cruise is not None
    thrust = c * (share * peak) ** 2 * case.unit - case.force_N
    size = np.linalg.norm(thrust)
    assert size <= THRUST_N * (1.0 + 1e-12)
    direction = thrust_direction(leg.cruise.pitch_rad, leg.cruise.roll_rad)
    np.testing.assert_allclose(size * direction, thrust, rtol=0, atol=1e-9 * THRUST_N)
    speed = math.sqrt(size / (4.0 * MOTOR.lift_coefficient_N_s2_rad2))
    assert leg.loads.currents_A[3] == pytest.approx(4.0 * rotor.current(MOTOR, speed), rel=1e-9)
    assert leg.loads.powers_W[3] == pytest.approx(4.0 * rotor.power(MOTOR, speed), rel=1e-9)
    assert all(t >= 0.0 for t in leg.loads.durations_s)


def test_turns_of_a_capped_leg_pass_the_attitude_of_the_cruise() -> None:
    """Level, accelerate, cruise, brake, level: four turns, each as long as its angles ask."""
    leg = paper(drag_kg_m=DRAG_KG_M, max_speed_m_s=15.0)
    torque = AIRFRAME.arm_length_m * THRUST_N / 4.0
    expected = [
        2.0 * math.sqrt(abs(b - a) * AIRFRAME.inertia_x_kg_m2 / torque)
        for before, after in itertools.pairwise(leg.attitudes)
        for a, b in zip(before, after, strict=True)
    ]
    assert len(expected) == 8
    assert leg.turn_times_s == pytest.approx(expected, rel=1e-12)
    pairs = [expected[k] + expected[k + 1] for k in range(0, 8, 2)]
    assert leg.loads.durations_s[::2] == pytest.approx(pairs, rel=1e-12)
    assert leg.loads.currents_A[::2] == pytest.approx([65.7454] * 4, rel=1e-6)


@given(cases(), EXPONENTS, st.floats(0.05, 2.0))
def test_states_move_at_their_speed(case: Case, x: float, share: float) -> None:
    """Position is the integral of speed, does not jump, and ends at the end."""
    distance = math.hypot(*case.displacement_m)
    c = x * case.airframe.mass_kg / (2.0 * distance)
    given_leg = case.airframe, MOTOR, case.displacement_m, case.wind_N
    peak = float(flight.leg(*given_leg, drag_kg_m=c).peak_speed_m_s)
    leg = flight.leg(*given_leg, drag_kg_m=c, max_speed_m_s=share * peak)
    ends = stage_ends(leg)
    whole, nodes = 0.0, np.polynomial.legendre.leggauss(8)
    for number, (begin, end) in enumerate(itertools.pairwise(ends), 1):
        if not end - begin > 1e-9 * ends[-1]:
            continue
        # The speed changes within m/√(Ac) of either end: panels that shorten towards both.
        edges = np.concatenate([[0.0], np.geomspace(1e-5, 0.5, 30)])
        edges = begin + (end - begin) * np.concatenate([edges, 1.0 - edges[-2::-1]])
        low, half = edges[:-1, np.newaxis], 0.5 * np.diff(edges)[:, np.newaxis]
        state = flight.state_at(leg, low + half * (1.0 + nodes[0]))
        assert np.all(state.stage == number)
        assert np.all(state.speed_m_s <= min(peak, share * peak) * (1.0 + 1e-9))
        whole += (half * nodes[1] * state.speed_m_s).sum()
        at_end = flight.state_at(leg, end - 1e-13 * (end - begin))
        assert np.linalg.norm(at_end.position_m) == pytest.approx(whole, abs=1e-6 * distance)
    np.testing.assert_allclose(
        flight.state_at(leg, ends[-1] + 1.0).position_m, case.displacement_m, rtol=1e-12
    )


@given(st.floats(0.1, 30.0), EXPONENTS, st.floats(0.01, 1.0))
def test_states_on_the_way_are_those_of_the_equations(
    acceleration: float, drag_per_m: float, share: float
) -> None:
    """Some moments of accelerating, and of braking seen from its end."""
    rate = math.sqrt(acceleration * drag_per_m)
    time_s = share * min(10.0, 1.5 / rate)
    way, speed = drag.accelerated(acceleration, drag_per_m, time_s)
    assert (way, speed) == pytest.approx(
        integrated(acceleration, drag_per_m, 0.0, time_s), rel=1e-8
    )
    left, before = drag.braked(acceleration, drag_per_m, time_s)
    assert (left, 0.0) == pytest.approx(
        integrated(-acceleration, drag_per_m, float(before), time_s), rel=1e-6, abs=1e-7 * before
    )


# Arrays and symbols


def test_arrays_are_scalars_element_by_element() -> None:
    """Legs with and without drag, capped, not capped, of no length and impossible, in one table."""
    ways = np.array([TO_HOVER_M, (0.0, 0.0, 0.0), (0.0, 0.0, -30.0), (-40.0, 5.0, 60.0)])
    drags, caps = np.array([0.0, DRAG_KG_M, 10.0]), np.array([3.0, 20.0, 1e6])
    winds = np.array([2.0, 30.0])
    table = flight.leg(
        AIRFRAME,
        MOTOR,
        tuple(ways.T),
        (winds[:, None, None, None], 0.0, 0.0),
        drags[:, None, None],
        caps[:, None],
    )
    for (i, wind), (j, c), (k, cap), (m, way) in itertools.product(
        *map(enumerate, (winds, drags, caps, ways))
    ):
        one = flight.leg(AIRFRAME, MOTOR, tuple(way), (wind, 0.0, 0.0), c, cap)
        assert np.isnan(one.loads.duration_s) == (i == 1)
        for pair in (
            (table.loads.charge_As, one.loads.charge_As),
            (table.loads.energy_J, one.loads.energy_J),
            *zip(table.loads.durations_s, one.loads.durations_s, strict=True),
        ):
            whole = np.broadcast_to(pair[0], (2, 3, 3, 4))
            np.testing.assert_allclose(whole[i, j, k, m], pair[1], rtol=1e-12)
    assert np.all(np.broadcast_to(table.loads.duration_s, (2, 3, 3, 4))[0, :, :, 1] == 0.0)


def test_there_and_back_differ_with_drag() -> None:
    """In a wind, accelerating and braking take different ways, and drag tells them apart."""
    there, back = (
        flight.leg(AIRFRAME, MOTOR, (side * 300.0, 0.0, 0.0), (3.0, 0.0, 0.0), DRAG_KG_M)
        for side in (1.0, -1.0)
    )
    assert abs(there.loads.duration_s - back.loads.duration_s) > 0.1


def test_symbols_give_what_floats_give() -> None:
    """The leg as a tree over position, drag and cap."""
    x = Variable("x", "x", "m", 0.0, 1e4, "", 0)
    c, cap = Parameter("c", "c", "kg/m", 0.0), Parameter("cap", "v", "m/s", 0.0)
    leg = flight.leg(AIRFRAME, MOTOR, (x, 40.0, 10.0), (2.0, 0.0, 0.0), c, cap)
    for values in ({"x": 800.0, "c": 0.02, "cap": 12.0}, {"x": 3.0, "c": 0.0, "cap": 90.0}):
        way = (values["x"], 40.0, 10.0)
        one = flight.leg(AIRFRAME, MOTOR, way, (2.0, 0.0, 0.0), values["c"], values["cap"])
        for name in ("duration_s", "charge_As", "energy_J"):
            tree, number = getattr(leg.loads, name), getattr(one.loads, name)
            assert evaluate(tree, values) == pytest.approx(number, rel=1e-13)
