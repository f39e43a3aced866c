"""Numbers as a reader sees them: digits that tell something, a true minus sign, a unit.

A number that the user stated has the digits of `figure`. For a computed one the function of its
unit knows the digits: `seconds`, `amperes`, `watts`, `percent`.
"""

from __future__ import annotations

import math
from decimal import Decimal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable
    from fractions import Fraction

NONE = "none"
DIGITS = 15  # Decimal digits that every float holds
COMPUTED = 4  # Digits of a computed current or power
DUST = 1e-9  # Share of its scale below which a number is rounding
SURE = 1e-9  # What counts as all or nothing [%]


def percent(share: float, decimals: int = 2) -> str:
    """A share in percent, such as ``"9.45 %"``: decimals as stated at most, and none that are zero.

    What is nearly nothing or nearly all is written as less or more than the last decimal shows.
    """
    value, finest = 100.0 * share, 10.0**-decimals
    if SURE < abs(value) < 0.5 * finest:
        return f"{'−' if value < 0.0 else ''}<{figure(finest)} %"
    if 100.0 - 0.5 * finest < value < 100.0 - SURE:
        return f">{figure(100.0 - finest)} %"
    digits = fixed(value, decimals)
    return f"{digits.rstrip('0').rstrip('.') if decimals else digits} %"


def percent_apart(one: float, other: float) -> tuple[str, str]:
    """Two shares in percent, with as many decimals as tell them apart."""
    if percent(one) != percent(other):
        return percent(one), percent(other)
    first, second = (f"{share} %" for share in figures_apart(100.0 * one, 100.0 * other, 5))
    return first, second


def seconds(time_s: float, decimals: int = 2) -> str:
    """A computed time, such as ``"597.27 s"``."""
    return f"{fixed(time_s, decimals)} s"


def amperes(current_A: float) -> str:
    """A computed current, such as ``"80.65 A"``."""
    return with_unit(current_A, "A", COMPUTED)


def watts(power_W: float) -> str:
    """A computed power, such as ``"1790 W"``."""
    return with_unit(power_W, "W", COMPUTED)


def figure(value: float | Fraction, digits: int = 6, *, sign: str = "", beside: float = 0.0) -> str:
    """A number with a minus sign; infinity as its sign, and a dash for NaN.

    What is rounding `beside` a scale is 0.
    """
    if abs(number := float(value)) < DUST * beside:
        return "0"
    return _signed(f"{number + 0.0:{sign}.{digits}g}")


def with_unit(value: float | Fraction, unit: str, digits: int = 6) -> str:
    """A number and its unit, none for a ratio."""
    return figure(value, digits) if unit in ("1", "-", "") else f"{figure(value, digits)} {unit}"


def fixed(
    value: float | None,
    decimals: int = 2,
    *,
    sign: str = "",
    otherwise: str = NONE,
    less_than: float = math.inf,
) -> str:
    """A number with so many decimals and a minus sign; beyond a size two digits and an exponent.

    A word for None.
    """
    if value is None:
        return otherwise
    number = float(value)
    if abs(number) < less_than:
        return _signed(f"{number:{sign}z.{decimals}f}")  # z: no sign of a negative zero
    return _signed(f"{number:{sign}.2g}")


def coordinates(at_m: Iterable[float], digits: int = 6) -> str:
    """A point, such as ``"(10, 20.5, 40)"``."""
    return f"({', '.join(figure(component, digits) for component in at_m)})"


def all_digits(value: float) -> str:
    """A number with all its digits and no power of ten; rounding errors are not digits."""
    return f"{Decimal(typed(value)):f}"


def typed(value: float, digits: int = DIGITS) -> str:
    """A number as files and command lines take it, for a user who typed it or copies it."""
    return f"{value:.{digits}g}"


def in_format(value: float, form: str) -> str:
    """A number in one of Python's formats, such as ``"12.5 %"`` in ``".1%"``."""
    return _signed(format(value, form)).replace("%", " %")


def short(number: float) -> str:
    """A bound as a person writes it: ``1e6``, not ``1e+06``, and ``2**63``."""
    if isinstance(number, int) and float(f"{number:g}") != number:  # Whole, to the last digit
        return f"2**{number.bit_length() - 1}" if number.bit_count() == 1 else str(number)
    mantissa, _, exponent = f"{number:g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def significant(value: float, digits: int) -> float:
    """A number rounded to so many significant digits."""
    return float(typed(value, digits))


def figures_apart(one: float, other: float, digits: int) -> tuple[str, str]:
    """Two numbers with so many digits, or with as many as tell them apart."""
    for count in range(digits, 18):
        texts = figure(one, count), figure(other, count)
        if texts[0] != texts[1] or one == other:
            break
    return texts


def minus(text: str) -> str:
    """A number with a minus sign in place of a hyphen."""
    return text.replace("-", "−")


def _signed(text: str) -> str:
    """Python's number with a minus sign, the sign of infinity, and a dash for NaN."""
    return "–" if "nan" in text else minus(text).replace("inf", "∞")
