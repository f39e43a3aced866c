"""As many digits of a value as its intervals make worth telling."""

from __future__ import annotations

import math
from collections.abc import Iterable

LARGEST, LEAST = 1e6, 1e-4
"""From which size on, and below which, a number has an exponent."""
FINEST = 1e-9
"""Least distance of an end from the value that is shown, relative to the value."""


def digits(value: float, ends: Iterable[float]) -> str:
    """How to format a value and the ends of its intervals: all with the same decimals.

    There are so many that the end nearest to the value differs from it by two digits.

    Parameters
    ----------
    value, ends
        In one unit.

    Returns
    -------
    str
        A format specification: ``".1f"`` for 662.4 between 656.6 and 668.3.
    """
    ends = tuple(ends)
    size = max(map(abs, (value, *ends)))
    apart = [gap for end in ends if (gap := abs(end - value)) > FINEST * size]
    if not apart:
        return ".6g"
    decimals = 1 - math.floor(math.log10(min(apart)))
    if LEAST <= size < LARGEST:
        return f".{max(decimals, 0)}f"
    return f".{max(decimals + math.floor(math.log10(size)), 1)}e"
