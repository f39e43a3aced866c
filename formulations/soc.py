"""How the state of charge at the end of the mission is written: by name of the perspective.

Each is a function of the quantities, the hover time Δ [s] and the rest time T' [s].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TypeAlias

from formulations.parameters import Quantities
from formulations.wells import state_of_charge_of_wells
from optuav.modelling import Expression, Let
from optuav.modelling.expression import Operand
from optuav.options import Perspective

StateOfCharge: TypeAlias = Callable[[Quantities, Operand, Operand], Operand]


def battery(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """η1 = (y1 + y2)/B, by charge balance: [1] eq (19), exact for KiBaM."""
    drawn = given.flight_charge_As + given.hover_current_A * hover - given.rest_current_A * rest
    return 1.0 - drawn / given.battery_As


def energy(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """η2 = 1 − (E_fl + E_hv − E_harv)/E_0, radio included: [1] eq (20)."""
    harvested = given.hover_received_W * hover + given.rest_received_W * rest
    drawn = given.flight_energy_J + given.hover_power_W * hover - harvested
    return 1.0 - drawn / given.nominal_battery_J


def adjusted(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """η3 = 1 − E_fl/E_1 − E_hv/E_2 + E_harv/E_0; the paper prints the last two signs flipped."""
    harvested = given.hover_received_W * hover + given.rest_received_W * rest
    return (
        1.0
        - given.flight_energy_J / given.battery_in_flight_J
        - given.hover_power_W * hover / given.battery_in_hover_J
        + harvested / given.nominal_battery_J
    )


def stepwise(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """(y1 + y2)/B through both wells, which take all that they are given, as in `battery`."""
    return state_of_charge_of_wells(replace(given, tapers=False), hover, rest)


def delivered(given: Quantities, hover: Operand, rest: Operand) -> Operand:
    """(y1 + y2)/B: charge balance, unless the battery takes less once it is full."""
    if not given.tapers:
        return battery(given, hover, rest)
    end = state_of_charge_of_wells(given, hover, rest)
    return Let("state of charge at the end", "η", "1", end) if isinstance(end, Expression) else end


PAPER: tuple[Perspective, ...] = ("battery", "energy", "adjusted")
"""The perspectives of the paper."""

AVAILABLE: Perspective = "available"
"""Charge balance as in `battery`, and a battery that never runs dry nor is overcharged."""

PERSPECTIVES: Mapping[Perspective, StateOfCharge] = {
    "battery": battery,
    "energy": energy,
    "adjusted": adjusted,
    "wells": stepwise,
    AVAILABLE: delivered,
}
