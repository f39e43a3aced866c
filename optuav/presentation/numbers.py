"""Numbers as a reader sees them: digits that tell something, a true minus sign, a unit."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fractions import Fraction

NONE = "none"
DIGITS = 15  # Decimal digits that every float holds
DUST = 1e-9  # Share of its scale below which a number is rounding
FINEST, SURE = 0.01, 1e-9  # Last percent that is shown, and what counts as all or nothing [%]


def percent(share: float) -> str:
    """A share in percent, such as ``"9.45 %"``: two decimals at most, and none that are zero.

    What is nearly nothing or nearly all is written as less or more than the last decimal shows.
    """
    value = 100.0 * share
    if SURE < abs(value) < 0.5 * FINEST:
        return f"{'−' if value < 0.0 else ''}<{FINEST} %"
    if 100.0 - 0.5 * FINEST < value < 100.0 - SURE:
        return f">{100.0 - FINEST} %"
    digits = f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".")
    return f"{digits} %".replace("-", "−")


def percent_apart(one: float, other: float) -> tuple[str, str]:
    """Two shares in percent, with as many decimals as tell them apart."""
    if percent(one) != percent(other):
        return percent(one), percent(other)
    first, second = (f"{share} %" for share in figures_apart(100.0 * one, 100.0 * other, 5))
    return first, second


def figure(value: float | Fraction, digits: int = 6, *, beside: float = 0.0) -> str:
    """A number with a minus sign; infinity as its sign, and a dash for NaN.

    What is rounding `beside` a scale is 0.
    """
    if abs(number := float(value)) < DUST * beside:
        return "0"
    text = f"{number + 0.0:.{digits}g}".replace("-", "−").replace("inf", "∞")
    return "–" if "nan" in text else text


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
    # Adding 0 turns a negative zero into zero.
    rounded = round(value, decimals) + 0.0
    text = f"{rounded:{sign}.{decimals}f}" if abs(value) < less_than else f"{value:{sign}.2g}"
    return text.replace("-", "−")


def all_digits(value: float) -> str:
    """A number with all its digits and no power of ten; rounding errors are not digits."""
    return f"{Decimal(f'{value:.{DIGITS}g}'):f}"


def figures_apart(one: float, other: float, digits: int) -> tuple[str, str]:
    """Two numbers with so many digits, or with as many as tell them apart."""
    for count in range(digits, 18):
        texts = f"{one:.{count}g}", f"{other:.{count}g}"
        if texts[0] != texts[1] or one == other:
            break
    return texts
