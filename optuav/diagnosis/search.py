"""The nearest value of a key that repairs, and where such values end."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from optuav.diagnosis.keys import Key

NEAR = 0.1
"""Share of a value and of its change below which both are known well enough to round them."""
NEGLIGIBLE = 1e-9
"""Share of a change that is as good as none."""
MOST_DIGITS = 8
"""Digits that a small change may ask for; engines tell no smaller ones apart."""
TINY = 1e-300
"""Stands in for what is nearer to 0, so that its digits are numbers."""
FINER = 6
"""Digits that are added where the rounded value is not feasible."""

Asking: TypeAlias = Generator[list[float], list[bool], "Found | None"]
"""Yields values, is sent whether each of them repairs, and returns what was found."""
Edging: TypeAlias = Generator[list[float], list[bool], tuple[float, int] | None]


class Found(NamedTuple):
    """Values of a key that repair.

    Parameters
    ----------
    value
        The nearest one, rounded on the feasible side.
    up_to
        Where they end, if further on they do; None if they do not.
    resolution
        Digit to which the value is rounded: short of it by so much is infeasible.
    """

    value: float
    up_to: float | None
    resolution: float


def search(key: Key, sign: int) -> Asking:
    """The nearest value in a direction that repairs, and where such values end.

    Values further and further away are tried first, then the gap before the nearest of them that
    repairs is halved. What repairs only between two values that were tried is not seen.

    Parameters
    ----------
    key
        What is changed.
    sign
        1 for larger values, −1 for smaller ones.
    """
    values = [*key.further(sign)]
    repair = yield values
    if not any(repair):
        return None
    place = repair.index(True)
    nearest = yield from _edge(key, sign, (key.now, *values)[place], values[place])
    if nearest is None:
        return None
    value, digit = nearest
    further = [value, *replace(key, now=value).further(sign)]
    repair = yield further
    end = None
    if not all(repair):
        bad = repair.index(False)
        end = yield from _edge(key, -sign, further[bad], further[bad - 1])
    return Found(value, end[0] if end else None, 10.0**digit)


def _edge(key: Key, sign: int, bad: float, good: float) -> Edging:
    """The first value that repairs on the way from a bad to a good one, and its last digit.

    It is rounded away from the bad one, to three digits of itself and two of the change or finer
    where the rounded value does not repair; None if no rounded value does.
    """
    while not key.whole and abs(good - bad) > NEAR * _size(key, good):
        middle = _between(bad, good)
        if middle in (bad, good):
            break
        (repairs,) = yield [middle]
        bad, good = (bad, middle) if repairs else (middle, good)
    for digit in _digits(key, bad, good):
        unit = 10.0**digit
        low, high = math.floor(sign * bad / unit), math.ceil(sign * good / unit)
        (repairs,) = yield [_decimal(sign * high, digit)]
        if not repairs:
            continue
        while high - low > 1:
            middle = (low + high) // 2
            (repairs,) = yield [_decimal(sign * middle, digit)]
            low, high = (low, middle) if repairs else (middle, high)
        while sign * low * unit > sign * key.now:
            (repairs,) = yield [_decimal(sign * low, digit)]
            if not repairs:
                break
            low, high = low - 1, low
        return _decimal(sign * high, digit), digit
    return None


def _size(key: Key, value: float) -> float:
    """The smaller of a value and its distance from the present one; of zero, what is negligible."""
    change = abs(value - key.now)
    return min(change, abs(value)) if value else NEGLIGIBLE * change


def _between(one: float, other: float) -> float:
    """The geometric mean of values far apart, the arithmetic mean of others."""
    far = one * other > 0.0 and max(abs(one), abs(other)) > 4.0 * min(abs(one), abs(other))
    return math.copysign(math.sqrt(one * other), one) if far else 0.5 * (one + other)


def _digits(key: Key, bad: float, good: float) -> range:
    """Places of the last digit, the coarsest first."""
    if key.whole:
        return range(1)
    first = math.floor(math.log10(abs(good - key.now))) - 1
    if good:
        leading = math.floor(math.log10(max(min(abs(good), abs(bad) or math.inf), TINY)))
        first = min(max(first, leading - MOST_DIGITS + 1), leading - 2)
    return range(first, first - FINER, -1)


def _decimal(count: int, digit: int) -> float:
    """count · 10^digit as it is written."""
    return float(f"{count}e{digit}")
