"""A value and its interval are told with the digits that matter."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.calibration.estimation import Interval
from optuav.calibration.fit import Value


@pytest.mark.parametrize(
    ("value", "low", "high", "words"),
    [
        (37726.86, 37405.1, 38051.2, ["37727", "37405 – 38051"]),
        (20000.476, 20000.4, 20000.552, ["20000.476", "20000.400 – 20000.552"]),
        (662.419, 656.6, 668.3, ["662.4", "656.6 – 668.3"]),
        (2.7985e-4, 2.759e-4, 2.838e-4, ["0.0002798", "0.0002759 – 0.0002838"]),
        (3.817e-6, 3.8e-6, 3.835e-6, ["3.817e-06", "3.800e-06 – 3.835e-06"]),
        (4.400105e8, 4.400088e8, 4.400122e8, ["4.400105e+08", "4.400088e+08 – 4.400122e+08"]),
        (20.0, 20.0, 20.0, ["20", "20 – 20"]),
        (0.0, 0.0, 0.0, ["0", "0 – 0"]),
    ],
)
def test_value_and_ends_have_the_same_decimals(
    value: float, low: float, high: float, words: list[str]
) -> None:
    assert Value("a.b", value, "", Interval(low, high)).written(" – ") == words


@given(st.floats(1e-9, 1e8), st.floats(1e-6, 0.9), st.floats(1e-6, 9.0))
def test_the_ends_always_differ_from_the_value(value: float, below: float, above: float) -> None:
    """And below a million nothing has an exponent, down to a ten thousandth."""
    interval = Interval(value * (1.0 - below), value * (1.0 + above))
    told, span = Value("a.b", value, "", interval).written(" ")
    low, high = span.split()
    assert float(low) < float(told) < float(high)
    assert ("e" in told) == (not 1e-4 <= interval.high < 1e6)
