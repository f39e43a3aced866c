"""Power against airspeed, the speeds that follow from it, and legs at constant power."""

from __future__ import annotations

import itertools
import math
from functools import partial

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import bang_bang, rotary_wing
from optuav.physics.rotary_wing import PowerCoefficients, best_endurance, best_range, power
from tests.physics.reference import printed

ZENG = PowerCoefficients(79.85628, 88.62794, 4.028543, 120.0, 0.00924263)
"""The UAV of 20 N of Zeng, Xu and Zhang."""
CALM = (0.0, 0.0, 0.0)
AHEAD = (1.0, 0.0, 0.0)

WINGS = st.builds(
    PowerCoefficients,
    st.floats(5.0, 500.0),
    st.floats(5.0, 500.0),
    st.floats(1.0, 12.0),
    st.floats(50.0, 250.0),
    st.floats(1e-4, 0.1),
)
Array = npt.NDArray[np.float64]
ANGLES = st.floats(0.0, 2.0 * math.pi)


def level(length: float, angle: float) -> tuple[float, float, float]:
    return length * math.cos(angle), length * math.sin(angle), 0.0


def printed_power(wing: PowerCoefficients, V: float) -> float:
    """Eq (12) as it is printed, which cancels at speed."""
    v_0 = wing.induced_speed_m_s
    lift = math.sqrt(math.sqrt(1.0 + V**4 / (4.0 * v_0**4)) - V**2 / (2.0 * v_0**2))
    blades = wing.blade_power_W * (1.0 + 3.0 * V**2 / wing.tip_speed_m_s**2)
    return blades + wing.induced_power_W * lift + wing.parasite_W_s3_m3 * V**3


# Power and speeds


def test_check_numbers() -> None:
    """Hover, best endurance and best range of the UAV of 20 N, its coefficients not rounded."""
    wing = rotary_wing.coefficients(0.503, 0.05, 0.4 * 300.0, 20.0, 0.6)
    assert power(wing, 0.0) == printed("168.48422")
    endurance, far = best_endurance(wing), best_range(wing)
    assert endurance == printed("10.21169")
    assert power(wing, endurance) == printed("125.99078")
    assert far == printed("18.29448")
    assert power(wing, far) == printed("161.50995")
    assert power(ZENG, 10.0) == pytest.approx(126.0, abs=0.05)


def test_coefficients_of_a_datasheet() -> None:
    """R = 0.4 m, Ω = 300 rad/s, s = 0.05, W = 20 N, d_0 = 0.6, with the paper's A = 0.503 m²."""
    wing = rotary_wing.coefficients(0.503, 0.05, 0.4 * 300.0, 20.0, 0.6)
    assert wing == pytest.approx(ZENG, rel=1e-6)
    wing = rotary_wing.coefficients(math.pi * 0.4**2, 0.05, 0.4 * 300.0, 20.0, 0.6)
    assert wing[:2] == (printed("79.80"), printed("88.66"))


@given(WINGS, st.floats(0.0, 40.0))
def test_power_is_the_printed_formula(wing: PowerCoefficients, V: float) -> None:
    """As far as that does not cancel."""
    assert power(wing, V) == pytest.approx(printed_power(wing, V), rel=1e-9)


def test_power_does_not_cancel_at_speed() -> None:
    """Lift alone, at 10⁵ v_0: P_i v_0/V, where the printed formula gives nothing."""
    lift = PowerCoefficients(0.0, 100.0, 1.0, 1.0, 0.0)
    assert power(lift, 1e5) == pytest.approx(100.0 / 1e5, rel=1e-12)
    assert printed_power(lift, 1e5) == 0.0


@given(WINGS, st.floats(0.5, 60.0))
def test_rise_is_the_derivative(wing: PowerCoefficients, V: float) -> None:
    """dP/d(V²) by central differences, and it grows with V."""
    step = 1e-4 * V**2
    up, down = (power(wing, math.sqrt(V**2 + side * step)) for side in (1.0, -1.0))
    at = rotary_wing.rise(wing, V)
    size = power(wing, V) / V**2
    assert at == pytest.approx((up - down) / (2.0 * step), rel=1e-6, abs=1e-6 * size)
    assert rotary_wing.rise(wing, V * 1.01) > at


@given(WINGS)
@example(ZENG)
def test_best_endurance_is_the_least_power(wing: PowerCoefficients) -> None:
    """By SciPy from a grid, and no speed of the grid needs less."""
    V = best_endurance(wing)
    speeds = np.linspace(0.0, 200.0, 2001)
    assert power(wing, V) <= power(wing, speeds).min() * (1.0 + 1e-12)
    coarse = speeds[power(wing, speeds).argmin()]
    bounds = max(coarse - 0.2, 0.0), coarse + 0.2
    best = minimize_scalar(lambda v: power(wing, v), bounds=bounds, method="bounded")
    assert power(wing, V) == pytest.approx(best.fun, rel=1e-9)
    assert best_endurance(wing, 3.0) == min(V, 3.0)


@given(WINGS, st.floats(0.0, 18.0), ANGLES, ANGLES, st.floats(5.0, 60.0))
@example(ZENG, 0.0, 0.0, 0.0, 60.0)
@example(ZENG, 15.0, 0.0, 0.0, 60.0)
@example(ZENG, 10.0, math.pi, 0.0, 60.0)
def test_best_range_takes_least_per_metre(
    wing: PowerCoefficients, wind: float, blows: float, heading: float, cap: float
) -> None:
    """Over a grid of ground speeds, in any wind, also those slower than a tail wind."""
    wind_m_s, direction = level(wind, blows), level(1.0, heading)
    for top in (math.inf, cap):
        g = best_range(wing, top, wind_m_s, direction)
        speeds = np.linspace(0.01, 150.0, 15_000)
        air = rotary_wing.air_speed(speeds, wind_m_s, direction)
        each = np.where(air <= top, power(wing, air) / speeds, np.inf)
        if not np.isfinite(each).any():
            assert math.isnan(g) or g < 0.01
            continue
        assert rotary_wing.air_speed(g, wind_m_s, direction) <= top * (1.0 + 1e-12)
        own = power(wing, rotary_wing.air_speed(g, wind_m_s, direction)) / g
        assert own <= each.min() * (1.0 + 1e-12)
        assert own >= each.min() * (1.0 - 1e-2)


def test_hover_is_best_where_power_grows_at_once() -> None:
    """Heavy blades and hardly any lift: flying saves nothing."""
    assert best_endurance(PowerCoefficients(500.0, 1.0, 12.0, 50.0, 0.01)) == 0.0


@given(st.floats(0.0, 20.0), ANGLES, ANGLES, st.floats(0.5, 40.0))
def test_ground_speed_and_air_speed_are_inverse(
    wind: float, blows: float, heading: float, V: float
) -> None:
    """The faster of two ground speeds at an air speed; NaN where the wind leaves no way forward."""
    wind_m_s, direction = level(wind, blows), level(1.0, heading)
    g = rotary_wing.ground_speed(V, wind_m_s, direction)
    along = wind * math.cos(blows - heading)
    across = wind * math.sin(blows - heading)
    assume(abs(V - abs(across)) > 1e-9 and abs(V - wind) > 1e-9)
    possible = abs(across) < V and along + math.sqrt(V**2 - across**2) > 0.0
    assert math.isnan(g) != possible
    if possible:
        assert rotary_wing.air_speed(g, wind_m_s, direction) == pytest.approx(V, rel=1e-9)
        assert rotary_wing.air_speed(1.01 * g + 0.01, wind_m_s, direction) > V * (1.0 - 1e-9)


def test_wind_as_strong_as_the_cap_leaves_no_leg() -> None:
    assert math.isnan(rotary_wing.ground_speed(10.0, (-10.0, 0.0, 0.0), AHEAD))
    assert math.isnan(best_range(ZENG, 10.0, (-10.0, 0.0, 0.0), AHEAD))
    assert rotary_wing.ground_speed(math.inf, (-10.0, 0.0, 0.0), AHEAD) == math.inf


# Legs


LEGS = st.tuples(
    *[st.floats(-2000.0, 2000.0).map(lambda x: round(x, 9))] * 2,
    st.floats(-300.0, 300.0).map(lambda x: round(x, 9)) | st.just(0.0),
)


def flown(way: tuple[float, float, float], wind: tuple[float, float, float] = CALM) -> object:
    return rotary_wing.leg(ZENG, way, 18.0, 2.0, (3.0, 2.0), 20.0, wind)


def test_legs_by_hand() -> None:
    """Cruise, triangle, climb that sets the pace, climb on the spot, and no way at all."""
    cruise, triangle = flown((300.0, 400.0, 0.0)), flown((30.0, 40.0, 0.0))
    assert cruise.duration_s == pytest.approx(500.0 / 18.0 + 9.0)
    assert cruise.power_W == power(ZENG, 18.0)
    assert triangle.duration_s == pytest.approx(2.0 * math.sqrt(50.0 / 2.0))
    assert triangle.power_W == pytest.approx(power(ZENG, 10.0))
    climb = flown((300.0, 400.0, 200.0))
    slow = climb.air_speed_m_s
    assert climb.duration_s == pytest.approx(200.0 / 3.0)
    assert 500.0 / slow + slow / 2.0 == pytest.approx(200.0 / 3.0)
    assert slow < 18.0
    assert climb.power_W == pytest.approx(power(ZENG, slow) + 20.0 * 3.0)
    lift, sink = flown((0.0, 0.0, 30.0), (6.0, 8.0, 0.0)), flown((0.0, 0.0, -30.0))
    assert (lift.duration_s, sink.duration_s) == (10.0, 15.0)
    assert lift.power_W == pytest.approx(power(ZENG, 10.0) + 60.0)
    assert sink.power_W == pytest.approx(power(ZENG, 0.0))
    nothing = flown((0.0, 0.0, 0.0))
    assert (nothing.duration_s, nothing.peak_speed_m_s) == (0.0, 0.0)
    assert math.isnan(
        rotary_wing.leg(ZENG, (9.0, 0.0, 0.0), math.nan, 2.0, (3.0, 2.0), 20.0).duration_s
    )


@given(LEGS, st.floats(0.5, 40.0), st.floats(0.1, 10.0))
@example((1e-9, 0.0, 30.0), 18.0, 2.0)
def test_motion_along_a_leg(
    way: tuple[float, float, float], ground_speed: float, acceleration: float
) -> None:
    """Speed rises, stays and falls; its integral is the way, within the vertical speeds."""
    leg = rotary_wing.leg(ZENG, way, ground_speed, acceleration, (3.0, 2.0), 20.0)
    T, length, height = float(leg.duration_s), math.hypot(*way), way[2]
    motion = partial(bang_bang.motion, leg.peak_speed_m_s, leg.rise_s, leg.duration_s)
    if length == 0.0:
        assert T == 0.0
        return
    assert max(height / 3.0, -height / 2.0) * (1.0 - 1e-12) <= T
    ends = [0.0, float(leg.rise_s), T - float(leg.rise_s), T]
    assert ends == sorted(ends) or T - 2.0 * leg.rise_s > -1e-9 * T
    covered = sum(quad(lambda t: float(motion(t)[1]), a, b)[0] for a, b in itertools.pairwise(ends))
    assert covered == pytest.approx(length, rel=1e-7)
    moments = T * np.array([0.0, 0.2, 0.5, 0.9, 1.0])
    along, speed = motion(moments)
    np.testing.assert_allclose(along[[0, -1]], [0.0, length], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(along[2], 0.5 * length, rtol=1e-9)
    assert speed.max() <= leg.peak_speed_m_s * (1.0 + 1e-12)
    # The horizontal speed stays within the stated one.
    horizontal = leg.peak_speed_m_s * math.hypot(*way[:2]) / length
    assert horizontal <= ground_speed * (1.0 + 1e-9)
    assert horizontal == pytest.approx(leg.air_speed_m_s, rel=1e-6, abs=1e-9)


def test_arrays_are_scalars_element_by_element() -> None:
    """Legs in several winds, with one against which there is no way."""
    ways = np.array([(300.0, 400.0, 20.0), (0.0, 0.0, -9.0), (-8.0, 1.0, 0.0), (0.0, 0.0, 0.0)])
    winds = np.array([(0.0, 0.0, 0.0), (5.0, -3.0, 0.0), (-30.0, 0.0, 0.0)])
    way, wind = tuple(ways.T), tuple(winds.T[:, :, np.newaxis])
    g = best_range(ZENG, 15.0, wind, rotary_wing.level_direction(way))
    table = rotary_wing.leg(ZENG, way, g, 2.0, (3.0, 2.0), 20.0, wind)
    for i, j in np.ndindex(3, 4):
        one = tuple(ways[j]), tuple(winds[i])
        g_one = best_range(ZENG, 15.0, one[1], rotary_wing.level_direction(one[0]))
        np.testing.assert_allclose(g[i, j], g_one, rtol=1e-12)
        leg = rotary_wing.leg(ZENG, one[0], g_one, 2.0, (3.0, 2.0), 20.0, one[1])
        for name in ("duration_s", "power_W", "peak_speed_m_s"):
            whole = np.broadcast_to(getattr(table, name), (3, 4))
            np.testing.assert_allclose(whole[i, j], getattr(leg, name), rtol=1e-12)
    assert np.isnan(g[2, 0])


def test_symbols_give_what_floats_give() -> None:
    """A leg as a tree over the end of its way and over the power of the blades."""
    x = Variable("x", "x", "m", -1e4, 1e4, "", 0)
    blades = Parameter("blades", "P_0", "W", 0.0)
    leg = rotary_wing.leg(
        ZENG._replace(blade_power_W=blades), (x, 30.0, 8.0), 18.0, 2.0, (3.0, 2.0), 20.0
    )
    for values in ({"x": 400.0, "blades": 70.0}, {"x": -3.0, "blades": 90.0}):
        wing = ZENG._replace(blade_power_W=values["blades"])
        way = (values["x"], 30.0, 8.0)
        one = rotary_wing.leg(wing, way, 18.0, 2.0, (3.0, 2.0), 20.0)
        for tree, number in ((leg.duration_s, one.duration_s), (leg.power_W, one.power_W)):
            assert evaluate(tree, values) == pytest.approx(number, rel=1e-14)


# Speeds by the price of a second

LENGTHS = st.floats(20.0, 5000.0)
ACCELERATIONS = st.floats(0.5, 5.0)
PRICES = st.floats(0.0, 5000.0)


def drawn(
    wing: PowerCoefficients, d: float, a: float, V: Array, wind: tuple[float, float]
) -> tuple[Array, Array]:
    """Time [s] and energy [J] of level legs at ground speeds, by the printed formula."""
    along, across = wind
    power_W = [printed_power(wing, math.hypot(v - along, across)) for v in V]
    return d / V + V / a, (d / V + V / a) * np.array(power_W)


def test_a_leg_of_a_kilometre_is_best_below_best_range() -> None:
    """SPEC-FLIGHT: 16.5 m/s for 1000 m at 2 m/s², where best range is 18.3."""
    speeds = best_range(ZENG), best_endurance(ZENG)
    assert speeds[0] == pytest.approx(18.3, abs=0.05)
    found = rotary_wing.priced_speed(ZENG, 1000.0, 2.0, 0.0, 23.0, speeds[1])
    assert found == pytest.approx(16.5, abs=0.05)


@given(WINGS, LENGTHS, ACCELERATIONS, PRICES, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_no_speed_is_cheaper_than_the_priced_one(
    wing: PowerCoefficients, d: float, a: float, price: float, along: float, across: float
) -> None:
    """Against a dense grid of all speeds; the price comes back where no cap binds."""
    most = min(float(rotary_wing.ground_speed(25.0, (along, across, 0.0), AHEAD)), math.sqrt(a * d))
    wind = (along, across, 0.0)
    easiest = best_endurance(wing, 25.0)
    best = float(rotary_wing.priced_speed(wing, d, a, price, most, easiest, wind, AHEAD))
    assert 0.0 < best <= most
    every = np.linspace(most / 1000, most, 1000)
    time_s, energy_J = drawn(wing, d, a, np.append(every, best), (along, across))
    cost = energy_J + price * time_s
    # The printed formula cancels at speed.
    assert cost[-1] <= cost[:-1].min() * (1.0 + 1e-9)
    if best < most * (1.0 - 1e-9):
        again = float(rotary_wing.price(wing, d, a, best, wind, AHEAD))
        assert again == pytest.approx(price, rel=1e-6, abs=1e-6 * energy_J[-1] / time_s[-1])


@given(WINGS, LENGTHS, ACCELERATIONS, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_energy_is_convex_in_the_time_of_a_leg(
    wing: PowerCoefficients, d: float, a: float, along: float, across: float
) -> None:
    """Above the speed of the least power, by divided differences of the printed formula."""
    wind = (along, across, 0.0)
    most = min(float(rotary_wing.ground_speed(25.0, wind, AHEAD)), math.sqrt(a * d))
    easiest = best_endurance(wing, 25.0)
    low = float(rotary_wing.priced_speed(wing, d, a, -math.inf, most, easiest, wind, AHEAD))
    assume(most - low > 0.1)
    t, E = drawn(wing, d, a, np.linspace(max(low, 0.05 * most), most * 0.999, 60), (along, across))
    slope = np.diff(E) / np.diff(t)
    assert (np.diff(slope) / np.diff(t[1:]) >= -1e-6 * np.abs(slope).max()).all()
