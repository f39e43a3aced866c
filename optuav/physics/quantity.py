"""`Quantity`, the type that formulas take and give, and the functions that many of them share."""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeAlias, TypeVar

import numpy as np

Quantity: TypeAlias = Any
"""A float, a NumPy array (arguments broadcast) or a symbol of the modelling layer.

The physics uses only Python's operators and NumPy's ufuncs, so that one formula serves simulation,
grids and optimisers.
"""

Vector: TypeAlias = tuple[Quantity, Quantity, Quantity]
"""Three components (x, y, z), each a `Quantity`."""

TINY = 1e-200
"""A positive number whose products with physical quantities neither vanish nor overflow.

It stands in for zero where a quotient has a limit: ``f(max(x, TINY)) / max(x, TINY)``.
"""


Formula = TypeVar("Formula", bound=Callable[..., Any])


def memoised(formula: Formula) -> Formula:
    """A formula whose last results are kept where it is called with numbers."""
    remembered = lru_cache(maxsize=1000)(formula)

    @wraps(formula)
    def result(*figures: Any, **named: Any) -> Any:
        try:
            return remembered(*figures, **named)
        except TypeError:  # arrays, which have no hash
            return formula(*figures, **named)

    return result  # type: ignore[return-value]


def is_number(quantity: Quantity, number: float) -> bool:
    """Return whether a quantity is this number, not an array or a symbol that may equal it."""
    return isinstance(quantity, int | float) and quantity == number


@np.errstate(invalid="ignore")
def one_where_not_negative(margin: Quantity) -> Quantity:
    """1 where the margin is 0 or above, NaN elsewhere: a factor that voids impossible values."""
    doubled = np.sign(margin) + 1.0
    return np.divide(doubled, doubled)


def norm(vector: Vector) -> Quantity:
    """Euclidean length of a vector given by its components."""
    x, y, z = vector
    return np.sqrt(x * x + y * y + z * z)


def distance(one: Vector, other: Vector) -> Quantity:
    """Distance of two points given by their components."""
    x, y, z = (b - a for a, b in zip(one, other, strict=True))
    return norm((x, y, z))
