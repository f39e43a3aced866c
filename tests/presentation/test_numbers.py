"""Numbers as a reader sees them, all in one place."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.presentation.numbers import (
    all_digits,
    amperes,
    coordinates,
    figure,
    figures_apart,
    fixed,
    percent,
    percent_apart,
    seconds,
    short,
    significant,
    typed,
    watts,
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


def test_shares_in_whole_percent() -> None:
    """Nearly nothing and nearly all are named; whole tens keep their zero."""
    shown = [percent(share, 0) for share in (0.004, 0.2, 0.996, 1.0)]
    assert shown == ["<1 %", "20 %", ">99 %", "100 %"]


def test_computed_quantities() -> None:
    """The digits belong to the quantity: a hundredth of a second, four digits of a load."""
    assert (seconds(597.2696), seconds(-0.001, 1)) == ("597.27 s", "0.0 s")
    assert (amperes(80.6487), watts(1789.96)) == ("80.65 A", "1790 W")
    assert coordinates((10.0, -20.5, 1e-12)) == "(10, −20.5, 1e−12)"


def test_numbers_to_copy() -> None:
    """Files and command lines know no minus sign but the hyphen."""
    assert (typed(-0.1), typed(1e9), typed(math.nan)) == ("-0.1", "1000000000", "nan")
    assert (short(1e6), short(1e-6), short(2**63)) == ("1e6", "1e-6", "2**63")
    assert significant(123456.0, 2) == 120000.0


def test_fixed_decimals() -> None:
    """No negative zero, a word for None, two digits and an exponent beyond a size."""
    assert fixed(-0.001) == "0.00"
    assert fixed(None) == "none"
    assert fixed(None, otherwise="–") == "–"
    assert fixed(3.14159, 3, sign="+") == "+3.142"
    assert fixed(250_000.0) == "250000.00"
    assert fixed(250_000.0, less_than=1e5) == "2.5e+05"
