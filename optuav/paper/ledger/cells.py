"""Table II as it is printed, and what `paper-table2` was fitted to."""

from __future__ import annotations

import math
from typing import NamedTuple

NOMINAL_J, FLIGHT_J, HOVER_J = 2 * 36000 * 11.1, 2 * 36000 * 15.4, 2 * 36000 * 14.33
"""E_0, E_1, E_2 as the paper composes them [J]."""


class Row(NamedTuple):
    """A row of the table: deadline [s], perspective, and its cells as printed."""

    deadline_s: int
    perspective: str
    hover: str
    mission: str
    soc: tuple[str, str, str]


class Cell(NamedTuple):
    """A state of charge in the table: η number, hover time [s] and percent as printed."""

    number: int
    hover_s: float
    stated: str


ROWS = (
    Row(800, "battery", "740.65", "800", ("24.27", "-12.79", "24.27")),
    Row(800, "energy", "697", "756.35", ("28.31", "5.01", "28.30")),
    Row(800, "adjusted", "740.65", "800", ("24.27", "-12.79", "24.27")),
    Row(1200, "battery", "950", "1009.35", ("5.09", "-25.58", "11.71")),
    Row(1200, "energy", "697", "756.35", ("28.31", "5.01", "33.17")),
    Row(1200, "adjusted", "950", "1009.35", ("5.09", "-25.58", "5.09")),
)
FITTED = {(1, 697.0), (1, 950.0), (2, 697.0), (2, 950.0)}
"""η number and hover time [s] of the cells that `paper-table2` was fitted to."""
IMPOSSIBLE = {(2, "-12.79"), (3, "11.71"), (3, "33.17")}
"""η number and printed cell of the four that other cells rule out."""
SHOW_ALL_W = {"flight.flight_power_W": 1443.8, "flight.hover_power_W": 1032.77}
"""Powers near those of `paper-table2` with which all other cells show their printed digits [W]."""
FREE_PARAMETERS = (
    "acceleration",
    "flight current",
    "flight power",
    "hover current",
    "hover power",
    "charging current (its power follows at 11.1 V)",
)
FIT_DATA = (
    "T − Δ = 59.35 s in every row",
    "η1 of the rows Δ = 697 s and 950 s",
    "η2 of the rows Δ = 697 s and 950 s",
    "the crossing at 39 000 A s, Δ = 951 s, of the figure on battery size",
)
FIT_NUMBERS = 6
"""Different numbers in the data of the fit."""


def whole_slots(hover: str) -> float:
    """Hover time [s] for which a row prints its states of charge: 740.65 s fills 741 slots."""
    return float(math.ceil(float(hover)))


def consistent_cells() -> tuple[Cell, ...]:
    """The different states of charge in the table, without the four impossible ones."""
    return tuple(
        dict.fromkeys(
            Cell(eta, whole_slots(row.hover), stated)
            for row in ROWS
            for eta, stated in enumerate(row.soc, start=1)
            if (eta, stated) not in IMPOSSIBLE
        )
    )
