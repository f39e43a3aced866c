"""How much a plan may miss."""

from __future__ import annotations

TOLERANCE = 1e-6
"""Share of the capacity, of a limit or of a figure by which it may be missed [-]."""


def same(stated: float, found: float, scale: float = 0.0) -> bool:
    """Whether two figures differ by no more than the tolerance, of the scale or of the figure."""
    return abs(stated - found) <= TOLERANCE * max(scale, abs(found))
