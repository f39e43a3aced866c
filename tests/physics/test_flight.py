"""Legs of both flight models: known numbers, the laws of motion, loads, arrays and symbols."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import bang_bang, rotor
from optuav.physics import six_stages as flight
from optuav.physics.flight import LegState, Loads, speed_warning
from optuav.physics.quantity import Quantity
from optuav.physics.six_stages import state_at
from tests.examples import few
from tests.physics.reference import (
    AIRFRAME,
    DESTINATION_M,
    HOVER_M,
    MOTOR,
    ORIGIN_M,
    THRUST_N,
    WEIGHT_N,
    power_coefficients,
    printed,
)

Triple = tuple[float, float, float]
CALM = (0.0, 0.0, 0.0)
LIFT, V_MAX = 3.8305e-6, 1060.0

TO_HOVER_M: Triple = (1000.0, 2501.0152, 0.0)
PAPER = flight.leg(AIRFRAME, MOTOR, TO_HOVER_M)

FIVE_NEWTON = MOTOR._replace(lift_coefficient_N_s2_rad2=0.3125, max_speed_rad_s=2.0)
FOUR_NEWTON = AIRFRAME._replace(mass_kg=4.0, gravity_m_s2=1.0)


class Case(NamedTuple):
    """A leg that can be flown, and what it is made of."""

    airframe: flight.Airframe
    wind_N: Triple
    displacement_m: Triple

    @property
    def leg(self) -> flight.Leg:
        return flight.leg(self.airframe, MOTOR, self.displacement_m, self.wind_N)

    @property
    def force_N(self) -> np.ndarray:
        """Gravity and wind."""
        return np.array(self.wind_N) - [0.0, 0.0, self.airframe.mass_kg * 9.8]

    @property
    def unit(self) -> np.ndarray:
        return np.array(self.displacement_m) / math.hypot(*self.displacement_m)

    def at(self, time_s: object) -> LegState:
        return state_at(self.leg, time_s)


COMPONENT = st.floats(-1.0, 1.0)
DIRECTIONS = st.builds(
    lambda way: tuple(np.array(way) / math.hypot(*way)),
    st.tuples(COMPONENT, COMPONENT, COMPONENT).filter(lambda way: math.hypot(*way) > 1e-3)
    | st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, -1)]),
)
AIRFRAMES = st.builds(
    flight.Airframe,
    mass_kg=st.floats(0.3, 5.0),
    gravity_m_s2=st.just(9.8),
    arm_length_m=st.floats(0.05, 0.5),
    inertia_x_kg_m2=st.floats(0.01, 0.5),
    inertia_y_kg_m2=st.floats(0.01, 0.5),
    inertia_z_kg_m2=st.just(0.142),
)


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Gravity and wind together in any direction, up to almost the full thrust."""
    airframe = draw(AIRFRAMES)
    force = np.array(draw(DIRECTIONS)) * draw(st.floats(0.0, 0.999)) * THRUST_N
    wind = np.add(force, (0.0, 0.0, airframe.mass_kg * 9.8))
    way = np.array(draw(DIRECTIONS)) * draw(st.floats(0.01, 1e5))
    return Case(airframe, tuple(wind.tolist()), tuple(way.tolist()))


def thrust_direction(pitch: float, roll: float) -> np.ndarray:
    """Level points up; pitching leans it to +x, rolling to +y."""
    return np.array(
        [math.cos(roll) * math.sin(pitch), math.sin(roll), math.cos(roll) * math.cos(pitch)]
    )


def over_stages(case: Case, quantity: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Integral of a quantity of the moments over each stage, by Gauss and Legendre."""
    begin, end = np.array(list(itertools.pairwise(stage_ends(case.leg)))).T[:, :, np.newaxis]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    half = 0.5 * (end - begin)
    return (half * weights * quantity(begin + half * (1.0 + nodes))).sum(axis=1)


def switching_times_s(leg: flight.Leg) -> tuple[float, ...]:
    """τ1…τ14 at which the control input changes: each turn speeds up and then slows down."""
    pitch1, roll1, pitch3, roll3, pitch5, roll5 = (0.5 * each for each in leg.turn_times_s)
    _, t2, _, t4, _ = leg.loads.durations_s
    parts = (*(pitch1, pitch1, roll1, roll1, t2, pitch3, pitch3, roll3, roll3, t4),)
    return tuple(itertools.accumulate((*parts, pitch5, pitch5, roll5, roll5)))


def rotor_speeds_rad_s(case: Case, time_s: np.ndarray) -> np.ndarray:
    """Speeds of rotors 1 (+x), 2 (+y), 3 (−x) and 4 (−y) (rotor, moment) that fly a leg.

    Pitch works on rotors 1 and 3, roll on 2 and 4; to slow down, the opposite rotor pushes.
    """
    shares = list[np.ndarray]()
    attitudes = (flight.LEVEL, case.leg.accelerate, case.leg.brake, flight.LEVEL)
    for before, after in itertools.pairwise(attitudes):
        for axis, (old_rad, new_rad) in enumerate(zip(before, after, strict=True)):
            push = np.roll(flight.TURNING_SPEEDS, axis if new_rad >= old_rad else axis + 2)
            shares += [push, np.roll(push, 2)]
        shares.append(np.ones(4))
    part = np.searchsorted(switching_times_s(case.leg), time_s, side="right")
    return V_MAX * np.array(shares).T[:, part]


def stage_ends(leg: flight.Leg) -> list[float]:
    return [0.0, *itertools.accumulate(float(t) for t in leg.loads.durations_s)]


# The paper's UAV


def test_leg_of_the_paper() -> None:
    """From the origin to the hover point: time, of it turning, charge, energy, peak speed."""
    t1, _, t3, _, t5 = PAPER.loads.durations_s
    assert PAPER.loads.duration_s == printed("37.8961")
    assert t1 + t3 + t5 == printed("3.1165")
    assert PAPER.loads.charge_As == printed("3921.555")
    assert PAPER.loads.energy_J == printed("63533")
    assert PAPER.peak_speed_m_s == printed("154.89")
    assert PAPER.peak_speed_m_s == pytest.approx(154.9, abs=0.11)


def test_both_legs_of_the_direct_route_are_alike() -> None:
    """The hover point lies half-way between origin and destination."""
    there, back = (
        flight.leg(AIRFRAME, MOTOR, tuple(np.subtract(end, start)))
        for start, end in ((ORIGIN_M, HOVER_M), (HOVER_M, DESTINATION_M))
    )
    assert there.loads.charge_As == pytest.approx(back.loads.charge_As, rel=1e-14)


def test_turning_and_full_speed_loads_of_the_paper() -> None:
    """Current and power of all rotors together."""
    turning_A, full_A, *_ = PAPER.loads.currents_A
    turning_W, full_W, *_ = PAPER.loads.powers_W
    assert turning_A == printed("65.7454")
    assert turning_W == printed("892.664")
    assert full_A / 4 == printed("26.7158")
    assert full_W == printed("1746.744")


def test_energy_is_the_papers_polynomial() -> None:
    """Energy of every stage with the coefficients of Table I, as the paper prints its sums."""
    c1, c2, c3, c4, c5, *_ = power_coefficients(MOTOR)
    v, root2 = V_MAX, math.sqrt(2.0)
    turning_W = (
        *(3 * c1, (1 + root2) * c2 * v, 2 * c3 * v**2),
        *((1 + 1 / root2) * c4 * v**3, 1.5 * c5 * v**4),
    )
    moving_W = (c1, c2 * v, c3 * v**2, c4 * v**3, c5 * v**4)
    τ = (0.0, *switching_times_s(PAPER))
    energy_J = sum(τ[(5 * s + 3) // 2] - τ[5 * (s - 1) // 2] for s in (1, 3, 5)) * sum(turning_W)
    energy_J += sum(τ[5 * s // 2] - τ[5 * s // 2 - 1] for s in (2, 4)) * 4 * sum(moving_W)
    assert PAPER.loads.energy_J == pytest.approx(energy_J, rel=1e-13)


# Motion


@given(cases())
def test_forces_balance_while_moving(case: Case) -> None:
    """F f + F_e = m a u in stages 2 and 4, for any wind and direction."""
    leg = case.leg
    for attitude, acceleration, direction in (
        (leg.accelerate, leg.acceleration_m_s2, case.unit),
        (leg.brake, leg.braking_m_s2, -case.unit),
    ):
        assert acceleration > 0.0
        thrust = THRUST_N * thrust_direction(attitude.pitch_rad, attitude.roll_rad)
        net = case.airframe.mass_kg * acceleration * direction
        np.testing.assert_allclose(thrust + case.force_N, net, rtol=0, atol=1e-12 * THRUST_N)


@given(AIRFRAMES, st.floats(0.0, 2 * math.pi), st.floats(0.0, 2 * math.pi), st.floats(0.0, 0.99))
def test_level_leg_lifts_the_weight(
    airframe: flight.Airframe, heading: float, from_where: float, strength: float
) -> None:
    """On a level path, in a level wind too, the thrust carries m g: no more, no less."""
    weight_N = airframe.mass_kg * 9.8
    assume(weight_N < 0.99 * THRUST_N)
    wind_N = strength * math.sqrt(THRUST_N**2 - weight_N**2)
    leg = flight.leg(
        airframe,
        MOTOR,
        (800 * math.cos(heading), 800 * math.sin(heading), 0.0),
        (wind_N * math.cos(from_where), wind_N * math.sin(from_where), 0.0),
    )
    for attitude in (leg.accelerate, leg.brake):
        lift_N = THRUST_N * math.cos(attitude.roll_rad) * math.cos(attitude.pitch_rad)
        assert lift_N == pytest.approx(weight_N, rel=1e-11)


@pytest.mark.campaign
@given(cases())
@example(Case(AIRFRAME, CALM, TO_HOVER_M))
@example(Case(AIRFRAME, CALM, (0.0, 0.0, -40.0)))
@settings(few(8))
def test_rotors_fly_the_leg(case: Case) -> None:
    """The equations of motion, integrated with nothing but the rotor speeds, end at the end.

    Between two switching times the rotors turn steadily. Their lifts, ϱ v², accelerate the turn
    by l ϱ (v3² − v1²) in pitch and l ϱ (v4² − v2²) in roll. The turning stages carry half the
    thrust, and in them the model freezes position and velocity.
    """
    airframe, leg = case.airframe, case.leg
    switching = (0.0, *switching_times_s(leg))
    ends = stage_ends(leg)
    inertia = (airframe.inertia_y_kg_m2, airframe.inertia_x_kg_m2)
    motion = np.zeros(10)  # position, velocity, angles, their rates
    for begin, end in itertools.pairwise(switching):
        if end - begin <= 1e-12 * switching[-1]:
            continue
        middle = np.array(0.5 * (begin + end))
        lifts = LIFT * rotor_speeds_rad_s(case, middle) ** 2
        pitch_Nm, roll_Nm = airframe.arm_length_m * (lifts[2:] - lifts[:2])
        frozen = case.at(middle).stage % 2 == 1
        share = 0.5 if frozen else 1.0
        assert lifts.sum() == pytest.approx(share * THRUST_N, rel=1e-12)

        def rates(
            _: float,
            motion: np.ndarray,
            lift: float = lifts.sum(),
            turn: tuple[float, float] = (pitch_Nm / inertia[0], roll_Nm / inertia[1]),
            frozen: bool = frozen,
        ) -> np.ndarray:
            force = lift * thrust_direction(*motion[6:8]) + case.force_N
            moving = np.zeros(6) if frozen else [*motion[3:6], *(force / airframe.mass_kg)]
            return np.array([*moving, *motion[8:], *turn])

        moments = (end - begin) * np.array([0.0, 0.3, 1.0])
        course = solve_ivp(
            rates, moments[[0, -1]], motion, "DOP853", moments, rtol=1e-10, atol=1e-10
        ).y
        reached = case.at(begin + moments)
        distance = leg.loads.distance_m
        np.testing.assert_allclose(course[:3], reached.position_m, rtol=0, atol=1e-6 * distance)
        np.testing.assert_allclose(course[6], reached.attitude.pitch_rad, rtol=0, atol=1e-7)
        np.testing.assert_allclose(course[7], reached.attitude.roll_rad, rtol=0, atol=1e-7)
        motion = course[:, -1]
        if any(abs(end - each) <= 1e-12 * end for each in ends):
            np.testing.assert_allclose(motion[8:], 0.0, atol=1e-6)
    np.testing.assert_allclose(motion[:3], case.displacement_m, rtol=0, atol=1e-6 * distance)
    np.testing.assert_allclose(motion[3:6], 0.0, atol=1e-6 * leg.peak_speed_m_s)
    np.testing.assert_allclose(motion[6:8], 0.0, atol=1e-7)


@given(cases())
def test_distance_is_the_integral_of_speed(case: Case) -> None:
    """Speed from the accelerations, and speed of the states, integrate to the length of the way."""
    leg = case.leg
    _, t2, _, t4, _ = leg.loads.durations_s
    a2, a4 = leg.acceleration_m_s2, leg.braking_m_s2
    covered = quad(lambda t: a2 * t, 0.0, t2)[0] + quad(lambda t: a4 * (t4 - t), 0.0, t4)[0]
    length = math.hypot(*case.displacement_m)
    assert covered == pytest.approx(length, rel=1e-9)
    assert a2 * t2 == pytest.approx(a4 * t4, rel=1e-9)
    states = over_stages(case, lambda time_s: case.at(time_s).speed_m_s)
    assert states.sum() == pytest.approx(length, rel=1e-9)
    assert states[1] == pytest.approx(0.5 * leg.peak_speed_m_s * t2, rel=1e-9)


@given(cases())
def test_there_and_back(case: Case) -> None:
    """Same time, charge and energy both ways; accelerating and braking change places."""
    there = case.leg
    back = case._replace(displacement_m=tuple(-x for x in case.displacement_m)).leg
    for name in ("duration_s", "charge_As", "energy_J"):
        assert getattr(there.loads, name) == pytest.approx(getattr(back.loads, name), rel=1e-12)
    assert there.loads.durations_s == pytest.approx(back.loads.durations_s[::-1], rel=1e-12)
    assert there.acceleration_m_s2 == back.braking_m_s2
    assert there.accelerate == back.brake
    assert there.peak_speed_m_s == pytest.approx(back.peak_speed_m_s, rel=1e-9)


@given(cases())
def test_time_of_the_displacement(case: Case) -> None:
    """T_d = sqrt(2 d (1/a2 + 1/a4)), shared in proportion to the other acceleration."""
    leg = case.leg
    a2, a4 = leg.acceleration_m_s2, leg.braking_m_s2
    T_d = math.sqrt(2 * math.hypot(*case.displacement_m) * (1 / a2 + 1 / a4))
    assert leg.loads.durations_s[1] == pytest.approx(T_d * a4 / (a2 + a4), rel=1e-9)
    assert leg.loads.durations_s[3] == pytest.approx(T_d * a2 / (a2 + a4), rel=1e-9)


# Switching times and states


@given(cases())
def test_switching_times(case: Case) -> None:
    """τ1 to τ14 never fall and end the stages: τ4, τ5, τ9, τ10, τ14; turns are halved."""
    leg = case.leg
    τ = (0.0, *switching_times_s(leg))
    assert len(τ) == 15
    assert all(earlier <= later for earlier, later in itertools.pairwise(τ))
    assert [τ[k] for k in (4, 5, 9, 10, 14)] == pytest.approx(stage_ends(leg)[1:], rel=1e-13)
    for first in (0, 2, 5, 7, 10, 12):
        movement = τ[first + 1] - τ[first], τ[first + 2] - τ[first + 1]
        assert movement[0] == pytest.approx(movement[1], abs=1e-13 * τ[-1])


def test_switching_times_rise_strictly_in_general() -> None:
    """A leg that needs pitch and roll, as in the paper, has fourteen different ones."""
    τ = switching_times_s(PAPER)
    assert all(earlier < later for earlier, later in itertools.pairwise((0.0, *τ)))
    assert τ[-1] == pytest.approx(PAPER.loads.duration_s, rel=1e-15)


@given(cases())
def test_states_are_continuous(case: Case) -> None:
    """Position and attitude do not jump at any switching time."""
    leg = case.leg
    times = np.array(switching_times_s(leg))
    step_s = 1e-9 * times[-1]
    before, after = case.at(np.maximum(times - step_s, 0.0)), case.at(times + step_s)
    way = np.subtract(after.position_m, before.position_m)
    assert np.abs(way).max() <= 2.01 * step_s * leg.peak_speed_m_s + 1e-12 * leg.loads.distance_m
    torque_Nm = case.airframe.arm_length_m * LIFT * V_MAX**2
    inertia = min(case.airframe.inertia_x_kg_m2, case.airframe.inertia_y_kg_m2)
    fastest = torque_Nm / inertia * 0.5 * max(leg.turn_times_s)
    for angle in ("pitch_rad", "roll_rad"):
        turned = getattr(after.attitude, angle) - getattr(before.attitude, angle)
        assert np.abs(turned).max() <= 2.01 * step_s * fastest + 1e-9


@pytest.mark.campaign
@given(cases())
@settings(few(10))
def test_charge_and_energy_are_integrals(case: Case) -> None:
    """Current and power of the rotors, integrated, are charge and energy of the leg."""
    charge_As, energy_J = (
        over_stages(case, lambda time_s, of=of: of(MOTOR, rotor_speeds_rad_s(case, time_s)).sum(0))
        for of in (rotor.current, rotor.power)
    )
    assert charge_As.sum() == pytest.approx(case.leg.loads.charge_As, rel=1e-12)
    assert energy_J.sum() == pytest.approx(case.leg.loads.energy_J, rel=1e-12)


@given(cases())
@example(Case(AIRFRAME, CALM, (50.0, 0.0, 0.0)))  # Along an axis, level: turning takes least
def test_no_leg_of_a_length_draws_less(case: Case) -> None:
    """Nor is there one that takes less time, wherever it leads and whatever the wind."""
    leg, length_m = case.leg, math.dist(case.displacement_m, CALM)
    least = flight.least_loads(case.airframe, MOTOR, length_m, case.wind_N)
    rounding = 1.0 + 1e-9
    assert least.duration_s <= rounding * leg.loads.duration_s
    assert least.charge_As <= rounding * leg.loads.charge_As
    assert least.energy_J <= rounding * leg.loads.energy_J
    assert least.currents_A == leg.loads.currents_A[:2]


def test_states_of_the_paper() -> None:
    """One moment in every stage: number, speed and position."""
    ends = stage_ends(PAPER)
    middle = [0.5 * (begin + end) for begin, end in itertools.pairwise(ends)]
    states = state_at(PAPER, [*middle, ends[-1] + 100.0])
    np.testing.assert_array_equal(states.stage, [1, 2, 3, 4, 5, 6])
    assert states.speed_m_s[[0, 2, 4, 5]].tolist() == [0.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(states.speed_m_s[[1, 3]], 154.89 / 2, rtol=1e-4)
    np.testing.assert_allclose(np.array(states.position_m)[:, 2], np.array(TO_HOVER_M) / 2)
    np.testing.assert_allclose(np.array(states.position_m)[:, 5], TO_HOVER_M)


def test_states_outside_the_leg() -> None:
    """Before it, and on a leg that cannot be flown, there is none: stage 0 and NaN."""
    gone = flight.leg(AIRFRAME, MOTOR, TO_HOVER_M, (30.0, 0.0, 0.0))
    for leg, time_s in ((PAPER, -1e-9), (PAPER, math.nan), (gone, 0.0), (gone, 10.0)):
        state = state_at(leg, time_s)
        assert state.stage == 0
        numbers = (
            *state.position_m,
            state.speed_m_s,
            *(state.attitude.pitch_rad, state.attitude.roll_rad),
        )
        assert all(math.isnan(number) for number in numbers)


# Edges


def test_leg_of_no_length_takes_no_time() -> None:
    """Nothing moves, turns or flows; the UAV hovers at once."""
    leg = flight.leg(AIRFRAME, MOTOR, CALM, (1.0, 2.0, 0.5))
    assert leg.loads.durations_s == (0.0,) * 5
    assert (leg.loads.charge_As, leg.loads.energy_J, leg.peak_speed_m_s) == (0.0, 0.0, 0.0)
    state = state_at(leg, 0.0)
    assert state.stage == 6
    assert state.position_m == CALM


def test_shortest_legs_cost_little() -> None:
    """Moving takes no time in the limit; the turns do not shrink with the distance."""
    short = flight.leg(AIRFRAME, MOTOR, (1e-9, 2e-9, 0.0))
    long = flight.leg(AIRFRAME, MOTOR, (1e3, 2e3, 0.0))
    assert short.turn_times_s == pytest.approx(long.turn_times_s, rel=1e-12)
    assert short.loads.durations_s[1] == pytest.approx(1e-6 * long.loads.durations_s[1], rel=1e-12)


def test_arrays_are_scalars_element_by_element() -> None:
    """Over displacements and over winds, with NaN where that one wind is too strong."""
    ways = np.array([(1000, 2501.0152, 0), (0, 0, 0), (0, 0, -30), (-40, 5, 60)], dtype=float)
    winds = np.array([(0, 0, 0), (3, -2, 1), (30, 0, 0), (0, 0, 35)], dtype=float)
    table = flight.leg(AIRFRAME, MOTOR, tuple(ways.T[:, np.newaxis]), tuple(winds.T[:, :, None]))
    for row, wind in enumerate(winds):
        for column, way in enumerate(ways):
            leg = flight.leg(AIRFRAME, MOTOR, tuple(way), tuple(wind))
            assert np.isnan(leg.loads.duration_s) == (row >= 2)
            for pair in (
                (table.loads.charge_As, leg.loads.charge_As),
                (table.loads.energy_J, leg.loads.energy_J),
                (table.peak_speed_m_s, leg.peak_speed_m_s),
                (table.turn_times_s[3], leg.turn_times_s[3]),
                *zip(table.loads.durations_s, leg.loads.durations_s, strict=True),
            ):
                np.testing.assert_allclose(pair[0][row, column], pair[1], rtol=1e-13)


@given(AIRFRAMES, DIRECTIONS, st.floats(0.0, 2.0), DIRECTIONS)
@example(AIRFRAME, (0.0, 0.0, 1.0), 1.3, (0.0, 0.0, 1.0))
def test_impossible_says_why_exactly_where_legs_are_nan(
    airframe: flight.Airframe, way: Triple, strength: float, direction: Triple
) -> None:
    """Wind along the path that exceeds the thrust does not make a leg easy: it ends nowhere."""
    force_N = strength * THRUST_N * np.array(direction)
    wind_N = tuple(np.add(force_N, (0.0, 0.0, airframe.mass_kg * 9.8)).tolist())
    leg = flight.leg(airframe, MOTOR, tuple(100.0 * x for x in way), wind_N)
    why = flight.impossible(airframe, MOTOR, wind_N)
    assume(abs(strength - 1.0) > 1e-9)
    assert (why is not None) == (strength > 1.0)
    times = (leg.loads.duration_s, leg.loads.charge_As, leg.loads.energy_J, *leg.turn_times_s)
    assert {math.isnan(each) for each in times} == {why is not None}


def test_impossible_states_both_forces() -> None:
    why = flight.impossible(AIRFRAME, MOTOR, (30.0, 0.0, 0.0))
    assert why is not None
    assert "17.2158 N" in why
    assert f"{math.hypot(30.0, WEIGHT_N):.6g} N" in why


@pytest.mark.parametrize("wind_N", [(3.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 0.0, 9.0)])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), CALM])
def test_force_equal_to_the_thrust_is_impossible(wind_N: Triple, way: Triple) -> None:
    """F = |F_e| to the last digit: the UAV hovers, but has nothing left to move with."""
    assert math.isnan(flight.leg(FOUR_NEWTON, FIVE_NEWTON, way, wind_N).loads.duration_s)
    assert flight.impossible(FOUR_NEWTON, FIVE_NEWTON, wind_N) is not None
    assert rotor.hover_speed(FIVE_NEWTON, FOUR_NEWTON.external_force_N(wind_N)) == 2.0


@pytest.mark.parametrize("wind_N", [(0.0, 0.0, -1.0 + 1e-15), (0.0, 0.0, 9.0 - 1e-15)])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_force_just_below_the_thrust_is_possible(wind_N: Triple, way: Triple) -> None:
    """The next number below F leaves a leg, however long it takes."""
    duration_s = flight.leg(FOUR_NEWTON, FIVE_NEWTON, way, wind_N).loads.duration_s
    assert 10.0 < duration_s < 1e9
    assert flight.impossible(FOUR_NEWTON, FIVE_NEWTON, wind_N) is None


# Symbols


def test_symbols_give_what_floats_give() -> None:
    """The whole leg as a tree over position, wind, airframe and motor."""

    def symbols(constants: flight.Airframe | rotor.Motor) -> dict[str, Parameter]:
        stated = constants._asdict()
        return {name: Parameter(name, "", "1", value) for name, value in stated.items()}

    x, y = (Variable(name, name, "m", 0.0, 1e4, "", 0) for name in "xy")
    gust = Parameter("gust", "F_w", "N", 0.0)
    airframe, motor = flight.Airframe(**symbols(AIRFRAME)), rotor.Motor(**symbols(MOTOR))
    leg = flight.leg(airframe, motor, (x, y, 10.0), (gust, 0.0, 0.0))
    given_values = {"x": 300.0, "y": -500.0, "gust": 2.5}
    number = flight.leg(AIRFRAME, MOTOR, (300.0, -500.0, 10.0), (2.5, 0.0, 0.0))
    for tree, value in (
        (leg.loads.charge_As, number.loads.charge_As),
        (leg.loads.energy_J, number.loads.energy_J),
        (leg.loads.duration_s, number.loads.duration_s),
        (leg.peak_speed_m_s, number.peak_speed_m_s),
        (leg.brake.pitch_rad, number.brake.pitch_rad),
        (leg.turn_times_s[3], number.turn_times_s[3]),
    ):
        assert evaluate(tree, given_values) == value


# Legs of constant load


def regime_leg(distance_m: Quantity, *figures: Quantity) -> tuple[Loads, Quantity]:
    loads = bang_bang.leg((distance_m, 0.0 * distance_m, 0.0), *figures)
    return loads, loads.peak_speed_m_s


def test_regime_legs_of_the_papers_results() -> None:
    """The fitted acceleration gives the flight time that every row of Table II shares."""
    loads, _ = regime_leg(math.hypot(1000.0, 2501.0152), 12.2349, 93.658, 1443.05)
    assert 2 * loads.duration_s == printed("59.35")
    assert loads.charge_As == pytest.approx(93.658 * 59.35 / 2, rel=1e-4)
    assert loads.energy_J == pytest.approx(1443.05 * 59.35 / 2, rel=1e-4)


@given(st.floats(0.01, 1e5), st.floats(0.1, 50.0), st.floats(0.5, 300.0))
@example(100.0, 4.0, 20.0)
def test_regime_leg_covers_its_distance(distance: float, acceleration: float, cap: float) -> None:
    """The speed rises, stays below the cap and falls: its integral is the way."""
    loads, peak = regime_leg(distance, acceleration, 90.0, 1400.0, cap)
    T = loads.duration_s
    ramp = peak / acceleration
    assert peak <= cap

    def speed(t: float) -> float:
        return min(acceleration * t, cap, acceleration * (T - t))

    breaks = [0.0, ramp, T - ramp, T]
    covered = sum(quad(speed, *stretch)[0] for stretch in itertools.pairwise(breaks))
    assert covered == pytest.approx(distance, rel=1e-9)
    assert max(speed(ramp), speed(T / 2)) == pytest.approx(peak, rel=1e-9)
    assert loads.charge_As == pytest.approx(90.0 * T)
    assert loads.energy_J == pytest.approx(1400.0 * T)


@given(st.floats(0.1, 50.0), st.floats(0.5, 300.0), st.floats(0.0, 1.0))
def test_regime_leg_in_closed_form(acceleration: float, cap: float, share: float) -> None:
    """2 sqrt(d/a) up to d = v²/a, d/v + v/a from there on, with no step between."""
    reach = cap**2 / acceleration
    for distance, expected in (
        (share * reach, 2 * math.sqrt(share * reach / acceleration)),
        (reach, 2 * cap / acceleration),
        ((1 + share) * reach, (1 + share) * reach / cap + cap / acceleration),
    ):
        loads, _ = regime_leg(distance, acceleration, 1.0, 1.0, cap)
        assert loads.duration_s == pytest.approx(expected, rel=1e-12)
        free, peak = regime_leg(distance, acceleration, 1.0, 1.0)
        assert free.duration_s == pytest.approx(2 * math.sqrt(distance / acceleration), rel=1e-12)
        assert peak == pytest.approx(math.sqrt(distance * acceleration), rel=1e-12)


def test_regime_legs_in_arrays() -> None:
    """Element by element; no way takes no time."""
    distances = np.array([0.0, 1e-6, 30.0, 32.0, 33.0, 1e4])
    loads, peak = regime_leg(distances, 2.0, 93.0, 1440.0, 8.0)
    one_by_one = [regime_leg(d, 2.0, 93.0, 1440.0, 8.0) for d in distances]
    np.testing.assert_array_equal(loads.duration_s, [each.duration_s for each, _ in one_by_one])
    np.testing.assert_array_equal(loads.charge_As, [each.charge_As for each, _ in one_by_one])
    np.testing.assert_array_equal(peak, [each for _, each in one_by_one])
    assert (loads.duration_s[0], loads.energy_J[0], peak[0]) == (0.0, 0.0, 0.0)


def test_regime_legs_take_symbols() -> None:
    """The leg as a tree over its length and its current."""
    x = Variable("x", "x", "m", 0.0, 1e4, "", 0)
    current = Parameter("current", "I", "A", 0.0)
    given_values = {"x": 300.0, "current": 2.5}
    loads, peak = regime_leg(x, 12.0, current, 1400.0, 50.0)
    loads_there, peak_there = regime_leg(300.0, 12.0, 2.5, 1400.0, 50.0)
    assert evaluate(loads.charge_As, given_values) == loads_there.charge_As
    assert evaluate(peak, given_values) == peak_there


# Speeds without drag


def test_only_speeds_above_40_m_s_are_warned_of() -> None:
    """The paper's legs peak at 154.89 m/s; a leg that does not exist has no speed to warn of."""
    assert [speed_warning(speed) for speed in (0.0, 40.0, math.nan)] == [None] * 3
    warning = speed_warning(float(PAPER.peak_speed_m_s))
    assert warning is not None
    assert "154.9 m/s" in warning
    assert "no drag" in warning
