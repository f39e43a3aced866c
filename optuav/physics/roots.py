"""Roots of functions that fall, by doubling and halving: numbers and arrays, no symbols."""

from collections.abc import Callable

import numpy as np

from optuav.physics.quantity import Quantity

DOUBLINGS = 200
"""Doublings after which a function that is still above 0 is taken to stay there."""
ROOT_HALVINGS = 60  # Halvings of an interval that holds a root
MOST_HALVINGS = 100  # Halvings after which neighbouring floats are reached


def last_nonnegative(falling: Callable[[Quantity], Quantity], scale: Quantity) -> Quantity:
    """The largest x ≥ 0 where a function that falls with x is not below 0.

    It is 0 where the function is below 0 at once, infinite where it stays at or above 0, and NaN
    where the function is. The search begins at a scale > 0.
    """
    value = np.asarray(falling(scale), dtype=float)
    low, high, void = np.zeros_like(value), np.broadcast_to(scale, value.shape), np.isnan(value)
    for _ in range(DOUBLINGS):
        beyond = falling(high) >= 0.0
        if not beyond.any():
            break
        low, high = np.where(beyond, high, low), np.where(beyond, 2.0 * high, high)
    endless = falling(high) >= 0.0
    for _ in range(ROOT_HALVINGS):
        middle = 0.5 * (low + high)
        beyond = falling(middle) >= 0.0
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    return np.where(void, np.nan, np.where(endless, np.inf, low))[()]


def bisect_largest(holds: Callable[[float], bool], high: float) -> tuple[float, float] | None:
    """Return the largest number from 0 to `high` that holds, and one beyond; None without any.

    If a number holds, all smaller ones do. Both are `high` if that holds.
    """
    if holds(high):
        return high, high
    if not holds(low := 0.0):
        return None
    for _ in range(MOST_HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high
