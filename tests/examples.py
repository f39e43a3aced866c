"""How many examples are drawn of properties that take long: fewer in the suite alone."""

from __future__ import annotations

from hypothesis import settings

SUITE = 50
"""Of a property, in the profile of the suite; other profiles draw as many as they say."""


def few(count: int) -> settings:
    """Settings with so many examples in the suite, and the profile's own number otherwise."""
    drawn = settings.default.max_examples
    return settings(max_examples=count if drawn == SUITE else drawn)
