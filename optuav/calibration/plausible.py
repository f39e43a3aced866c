"""Measurements of a size that no UAV has: most are in another unit than their column says.

Some are such by themselves, and some beside the battery of the mission that they are for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from optuav.mission import Mission, vehicle
from optuav.mission.words import printable

USUAL = {
    "current": (0.01, 2e3, "A"),
    "voltage": (1.0, 2e3, "V"),
    "speed": (0.0, 300.0, "m/s"),
    "rotor speed": (10.0, 5e3, "rad/s"),
}
"""Least and most of what UAVs show, from those of some grams to those that carry people."""

LEAST_S = 120.0
"""How long a full battery keeps a UAV in the air at least, which is a load of 30 C."""


def doubts(of: str, sizes: Mapping[str, float]) -> Iterator[str]:
    """A sentence for every size, by a quantity of `USUAL` and in SI units, that no UAV has."""
    for quantity, size in sizes.items():
        least, most, unit = USUAL[quantity]
        if not least <= size <= most:
            yield (
                f"the {quantity} {of} is {size:.5g} {unit}, where that of a UAV is {least:g} to "
                f"{most:g} {unit}: look at the units in the names of the columns"
            )


def doubts_beside(mission: Mission, currents_A: Mapping[str, float]) -> Iterator[str]:
    """A sentence for every load in the air, by name, that the mission's battery hardly holds."""
    capacity_As = float(vehicle.pool(mission).capacity_As)
    for name, current_A in currents_A.items():
        lasts_s = capacity_As / current_A
        if lasts_s < LEAST_S:
            yield (
                f"{name} = {current_A:.5g} would empty the full battery of the mission "
                f"{printable(mission.name)}, {capacity_As:.5g} A s, in {lasts_s:.3g} s: look at "
                "the units in the names of the columns, and at the mission that is extended"
            )
