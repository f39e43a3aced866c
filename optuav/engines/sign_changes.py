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
import numpy.typing as npt

Numbers: TypeAlias = npt.NDArray[np.intp]
Floats: TypeAlias = npt.NDArray[np.float64]
Margin: TypeAlias = Callable[[Floats, Any], Floats]
"""Values at one point of each of the intervals with the given numbers."""

MOST_STEPS = 200


def close_in(margin: Margin, holds: Floats, fails: Floats, width: float) -> tuple[Floats, Floats]:
    """Neighbours at most a width apart, of which one holds (margin ≥ 0) and the other does not.

    Inverse quadratic interpolation where three points allow it, else halving: [1]_.

    Parameters
    ----------
    margin
        Changes sign between the two ends of every interval.
    holds, fails
        The ends, in either order.
    width
        Largest distance of the ends that are returned.
    """
    new, other = holds.copy(), fails.copy()
    at_new, at_other = margin(new, slice(None)), margin(other, slice(None))
    share = at_new / (at_new - at_other)
    for _ in range(MOST_STEPS):
        wide = np.flatnonzero(np.abs(other - new) > width)
        if not len(wide):
            break
        x1, x2, f1, f2 = new[wide], other[wide], at_new[wide], at_other[wide]
        least = 0.5 * width / np.abs(x2 - x1)
        x = x1 + np.clip(share[wide], least, 1.0 - least) * (x2 - x1)
        f = margin(x, wide)
        same = (f >= 0.0) == (f1 >= 0.0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same, x2, x1), np.where(same, f2, f1)
        new[wide], other[wide] = x, x2
        at_new[wide], at_other[wide] = f, f2
        share[wide] = _share(x, x2, x3, f, f2, f3)
    held = at_new >= 0.0
    return np.where(held, new, other), np.where(held, other, new)


@np.errstate(divide="ignore", invalid="ignore")
def _share(x1: Floats, x2: Floats, x3: Floats, f1: Floats, f2: Floats, f3: Floats) -> Floats:
    """Where to look next, as a share of the way from x1 to x2."""
    xi, phi = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
    quadratic = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
    share = f1 / (f2 - f1) * f3 / (f2 - f3)
    share = share + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
    return np.where(quadratic, share, 0.5)
