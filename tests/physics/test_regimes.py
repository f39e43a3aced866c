"""Legs of constant load: known numbers, the laws of motion, arrays and symbols."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import quad

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics.regimes import regime_leg
from tests.physics.reference import printed


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


def test_symbols_give_what_floats_give() -> None:
    """The leg as a tree over its length and its current."""
    x = Variable("x", "x", "m", 0.0, 1e4, "", 0)
    current = Parameter("current", "I", "A", 0.0)
    given_values = {"x": 300.0, "current": 2.5}
    loads, peak = regime_leg(x, 12.0, current, 1400.0, 50.0)
    loads_there, peak_there = regime_leg(300.0, 12.0, 2.5, 1400.0, 50.0)
    assert evaluate(loads.charge_As, given_values) == loads_there.charge_As
    assert evaluate(peak, given_values) == peak_there
