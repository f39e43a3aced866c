"""Numbers as a reader sees them, all in one place."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.presentation.numbers import (
    all_digits,
    figure,
    figures_apart,
    fixed,
    percent,
    percent_apart,
    with_unit,
)


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.09448002, "9.45 %"),
        (0.2, "20 %"),
        (0.20000000000000004, "20 %"),
        (0.255, "25.5 %"),
        (-0.0568, "−5.68 %"),
        (-1e-15, "0 %"),
        (0.0, "0 %"),
        (1.0, "100 %"),
        (1.0 - 1e-15, "100 %"),
        (1.028, "102.8 %"),
        (3e-5, "<0.01 %"),
        (-3e-5, "−<0.01 %"),
        (0.99999, ">99.99 %"),
    ],
)
def test_percent(share: float, words: str) -> None:
    """Two decimals at most; nearly nothing is not nothing, and nearly all is not all."""
    assert percent(share) == words


@given(st.floats(-20.0, 20.0))
def test_percent_says_no_other_number(share: float) -> None:
    """What it says lies within half of the last decimal, or on the side that it names."""
    words = percent(share).removesuffix(" %").replace("−", "-")
    if "<" in words or ">" in words:
        assert abs(100.0 * share) < 0.005 or 99.995 < 100.0 * share < 100.0
    else:
        assert math.isclose(float(words), 100.0 * share, abs_tol=0.005000001)


def test_shares_that_two_decimals_do_not_tell_apart_get_more() -> None:
    """A charge just below the reserve is not said to be the reserve."""
    assert percent_apart(0.779, 0.9) == ("77.9 %", "90 %")
    here, reserve = percent_apart(0.8999999, 0.9)
    assert here != reserve
    assert (here, reserve) == ("89.99999 %", "90 %")


def test_figures() -> None:
    """Six digits with a true minus sign; units behind, none for a ratio."""
    assert figure(-0.0) == "0"
    assert figure(Fraction(1, 3)) == "0.333333"
    assert (figure(math.inf), figure(-math.inf), figure(math.nan)) == ("∞", "−∞", "–")
    assert figure(1e-12, beside=1.0) == "0"
    assert with_unit(-2.5, "A s") == "−2.5 A s"
    assert with_unit(0.2, "1") == with_unit(0.2, "-") == "0.2"
    assert all_digits(0.1 + 0.2) == "0.3"
    assert all_digits(1e-7) == "0.0000001"
    assert figures_apart(1.0000001, 1.0000002, 3) == ("1.0000001", "1.0000002")
    assert figures_apart(2.0, 2.0, 3) == ("2", "2")


def test_fixed_decimals() -> None:
    """No negative zero, a word for None, two digits and an exponent beyond a size."""
    assert fixed(-0.001) == "0.00"
    assert fixed(None) == "none"
    assert fixed(None, otherwise="–") == "–"
    assert fixed(3.14159, 3, sign="+") == "+3.142"
    assert fixed(250_000.0) == "250000.00"
    assert fixed(250_000.0, less_than=1e5) == "2.5e+05"
