"""How many examples are drawn of properties that take long: fewer in the suite alone."""

from __future__ import annotations

from hypothesis import settings

SUITE = 16
"""How many examples the suite draws of a property; other profiles draw as many as they say."""


def few(count: int, most: int | None = None) -> settings:
    """Settings with so many examples in the suite, and the profile's own number otherwise.

    That number may be bounded, for properties that are cheap to get wrong once and slow to draw.
    """
    drawn = settings.default.max_examples
    if drawn == SUITE:
        return settings(max_examples=count)
    return settings(max_examples=drawn if most is None else min(drawn, most))
