"""Measurements of a size that no UAV has: most are in another unit than their column says.

Some are such by themselves, and some beside the battery of the mission that they are for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from optuav.calibration.data import UNITS, Column
from optuav.mission import Mission
from optuav.mission.quantities import short
from optuav.mission.words import printable
from optuav.network import vehicle


class Usual(NamedTuple):
    """Least and most that UAVs show, in SI units, and the column that it rests on."""

    least: float
    most: float
    unit: str
    column: Column


USUAL = {
    "current": Usual(0.01, 2e3, "A", Column("current", "current")),
    "voltage": Usual(1.0, 2e3, "V", Column("voltage", "voltage")),
    "speed": Usual(0.0, 300.0, "m/s", Column("speed", "speed")),
    "rotor speed": Usual(10.0, 5e3, "rad/s", Column("speed", "rotor speed")),
    "thrust per power": Usual(0.003, 0.5, "N/W", Column("thrust", "force")),
    "radius": Usual(0.005, 3.0, "m", Column("radius", "length")),
    "air density": Usual(0.1, 3.0, "kg/m3", Column("air_density", "density")),
    "resistance": Usual(1e-3, 20.0, "ohm", Column("resistance", "resistance")),
    "lifetime": Usual(60.0, 1e6, "s", Column("lifetime", "time")),
}
"""From those of some grams to those that carry people."""

LEAST_S = 120.0
"""How long a full battery keeps a UAV in the air at least, which is a load of 30 C."""


def doubts(of: str, sizes: Mapping[str, float]) -> Iterator[str]:
    """A sentence for every size, by a quantity of `USUAL` and in SI units, that no UAV has."""
    for quantity, size in sizes.items():
        usual = USUAL[quantity]
        if not usual.least <= size <= usual.most:
            yield (
                f"the {quantity} {of} is {size:.5g} {usual.unit}, where that of a UAV is "
                f"{short(usual.least)} to {short(usual.most)} {usual.unit}: look at the units in "
                f"the names of the columns{''.join(_meant(size, usual))}"
            )


def _meant(size: float, usual: Usual) -> Iterator[str]:
    """In which other units the number would be usual, if the column is in SI units."""
    units, name = UNITS[usual.column.kind], next(iter(usual.column.headings))
    likely = [unit for unit, worth in units.items() if usual.least <= size * worth <= usual.most]
    if likely:
        *others, last = likely
        listed = f"{', '.join(others)} or {last}" if others else last
        yield f"; under {name} it may be {listed} that is meant"


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
