"""Where margins change sign: many intervals at once, closed in from both ends.

References
----------
.. [1] T. R. Chandrupatla, "A new hybrid quadratic/bisection algorithm for finding the zero of a
   nonlinear function without using derivatives", Advances in Engineering Software, 1997.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats, Integers

Margin: TypeAlias = Callable[[Floats], Floats]
"""Values at one point of each interval."""
Margins: TypeAlias = Callable[[Any], Margin]
"""The margin of some of the intervals, told by their numbers or a slice."""
Ends: TypeAlias = tuple[Floats, Floats]
"""A point of each interval, and the margins there."""

MOST_STEPS = 200


@np.errstate(divide="ignore", invalid="ignore")
def close_in(margins: Margins, holds: Ends, fails: Ends, width: float) -> tuple[Floats, Floats]:
    """Neighbours at most a width apart, of which one holds (margin ≥ 0) and the other does not.

    Inverse quadratic interpolation where three points allow it, else halving: [1]_. What is found
    of an interval does not depend on the others.

    Parameters
    ----------
    margins
        Change sign between the two ends of every interval.
    holds, fails
        The ends, in either order, with the margins there.
    width
        Largest distance of the ends that are returned.
    """
    (x1, f1), (x2, f2) = holds, fails
    held, failed = x1.copy(), x2.copy()
    number, open_ = np.arange(len(x1)), np.ones(len(x1), bool)
    margin = margins(slice(None))
    x3, f3 = x2, f2
    for step in range(MOST_STEPS):
        span = x2 - x1
        size = np.abs(span)
        wide = size > width
        if (done := open_ & ~wide).any():
            _store(held, failed, number, done, x1, x2, f1)
        open_ = wide
        count = np.count_nonzero(wide)
        if not count:
            break
        if 2 * count < len(wide):  # until then, those that are done go along, to no effect
            number = number[wide]
            margin = margins(number)
            open_ = open_[wide]
            every = (x1, x2, x3, f1, f2, f3, span, size)
            x1, x2, x3, f1, f2, f3, span, size = (each[wide] for each in every)
        share = _share(span, x3 - x1, f1, f2, f3) if step else f1 / (f1 - f2)
        least = np.minimum(0.5 * width / size, 0.5)
        x = x1 + np.minimum(np.maximum(share, least), 1.0 - least) * span
        f = margin(x)
        same = (f >= 0.0) == (f1 >= 0.0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same, x2, x1), np.where(same, f2, f1)
        x1, f1 = x, f
    _store(held, failed, number, open_, x1, x2, f1)
    return held, failed


def _store(
    held: Floats,
    failed: Floats,
    number: Integers,
    which: Booleans,
    x1: Floats,
    x2: Floats,
    f1: Floats,
) -> None:
    """Put the ends of some intervals where they belong."""
    x1, x2, holds = x1[which], x2[which], f1[which] >= 0.0
    held[number[which]] = np.where(holds, x1, x2)
    failed[number[which]] = np.where(holds, x2, x1)


def _share(x21: Floats, x31: Floats, f1: Floats, f2: Floats, f3: Floats) -> Floats:
    """Where to look next, as a share of the way x21 from point 1 to point 2.

    Numbers that are none count as no interpolation.
    """
    f21, f31 = f2 - f1, f3 - f1
    f23 = f21 - f31
    xi, phi = x21 / (x21 - x31), f21 / f23
    quadratic = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
    share = f1 / f23 * (f3 / f21 - x31 / x21 * f2 / f31)
    return np.where(quadratic, share, 0.5)
