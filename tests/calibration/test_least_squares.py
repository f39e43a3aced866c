"""Least squares over transformed parameters: long records, and directions the data do not see."""

from __future__ import annotations

import math

import numpy as np
import pytest

from optuav.arrays import Floats
from optuav.calibration.least_squares import estimate


def test_a_long_record_needs_no_square_of_its_length() -> None:
    """A mean of 100 000 samples; its standard error is s over the root of their number."""
    samples = np.random.default_rng(1).normal(5.0, 0.1, 100_000)
    found = estimate(["mean"], lambda x: x - samples, [(1.0,)])
    assert found.intervals is not None
    (interval,) = found.intervals
    reach = 1.959964 * np.std(samples, ddof=1) / math.sqrt(len(samples))
    assert found.values[0] == pytest.approx(np.mean(samples), rel=1e-9)
    assert (interval.high - interval.low) / 2.0 == pytest.approx(reach, rel=1e-4)


def test_what_is_not_seen_takes_no_freedom() -> None:
    """Of a product only one parameter counts: three numbers leave two to tell their scatter."""
    observed = np.log([2.0, 3.0, 6.0])

    def residuals(values: Floats) -> Floats:
        return np.log(values[0] * values[1]) - observed

    found = estimate(["a", "b"], residuals, [(1.0, 1.0)])
    assert found.undetermined == ("a", "b")
    assert found.spread == pytest.approx(np.std(observed, ddof=1), rel=1e-9)


def test_parameters_that_are_eliminated_take_their_freedom() -> None:
    """The slope through ten points, their level taken out before: eight are left, not nine."""
    random = np.random.default_rng(2)
    place = np.arange(10.0) - 4.5
    observed = 3.0 + 0.5 * place + random.normal(0.0, 0.1, 10)
    level = np.mean(observed)

    found = estimate(
        ["slope"],
        lambda values: level + values[0] * place - observed,
        [(1.0,)],
        eliminated=1,
    )
    slope = place @ observed / (place @ place)
    left = observed - level - slope * place
    assert found.spread == pytest.approx(math.sqrt(left @ left / 8.0), rel=1e-6)


def test_of_equally_good_optima_none_is_stated_unless_another_measure_decides() -> None:
    """(x − 1)(x − 3) = 0 from either side; rounding alone would choose."""

    def residuals(values: Floats) -> Floats:
        return (values - 1.0) * (values - 3.0)

    starts = [(0.9,), (3.2,)]
    both = estimate(["x"], residuals, starts, spread=1e-3)
    assert both.undetermined == ("x",)
    assert both.values == pytest.approx([3.0])
    found = estimate(["x"], residuals, starts, spread=1e-3, miss=lambda x: abs(float(x[0]) - 1.1))
    assert found.undetermined == ()
    assert found.values == pytest.approx([1.0])
