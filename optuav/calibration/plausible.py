"""Measurements of a size that no UAV has: most are in another unit than their column says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

USUAL = {
    "current": (0.01, 2e3, "A"),
    "voltage": (1.0, 2e3, "V"),
    "speed": (0.0, 300.0, "m/s"),
    "rotor speed": (10.0, 5e3, "rad/s"),
}
"""Least and most of what UAVs show, from those of some grams to those that carry people."""


def doubts(of: str, sizes: Mapping[str, float]) -> Iterator[str]:
    """A sentence for every size, by a quantity of `USUAL` and in SI units, that no UAV has."""
    for quantity, size in sizes.items():
        least, most, unit = USUAL[quantity]
        if not least <= size <= most:
            yield (
                f"the {quantity} {of} is {size:.5g} {unit}, where that of a UAV is {least:g} to "
                f"{most:g} {unit}: look at the units in the names of the columns"
            )
