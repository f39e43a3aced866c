"""The longest hover by charge and time, in closed form: η at the end is affine in Δ and T'."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from formulations.parameters import Quantities
from formulations.soc import PERSPECTIVES
from optuav.arrays import Floats
from optuav.modelling.forms import CONSTANT, Exponential, Monomial
from optuav.network.network import Network
from optuav.network.variants import stacked
from optuav.options import Perspective
from optuav.physics.quantity import Quantity
from optuav.solving.assemble import figures, turned

TIMES = ("hover_time_s", "rest_time_s")  # Unknowns that make a plan; a formulation may have others
NOTHING = 1e-11  # Relative gain in hover that counts as none, as in the closed form


class Balance(NamedTuple):
    """The state of charge above η0; each a number or (route or 1, variant or 1).

    NumPy is fastest along many variants.
    """

    spare: Quantity  # Left at the end without stays [-]
    drawn: Quantity  # By hovering [1/s]
    gained: Quantity  # By resting [1/s]
    left_s: Quantity  # Time for both


def balance(table: Quantities, perspective: Perspective) -> Balance:
    """The balance of all routes of all variants, from their `figures`."""
    columns = turned(table)
    keys: list[Monomial] = [frozenset({(name, "time")}) for name in TIMES]
    hover, rest = keys
    times = (Exponential({key: 1.0}) for key in (hover, rest))
    terms = (PERSPECTIVES[perspective](columns, *times) - columns.min_soc).terms
    return Balance(terms[CONSTANT], -terms[hover], terms[rest], columns.time_left)


def by_balance(network: Network) -> tuple[Floats, Floats]:
    """The longest Δ of all routes, −∞ for none, and the least T' for it [s], by charge and time."""
    routes = balance(figures(stacked(network)), "battery")
    hover_s = longest_by_balance(*routes)
    return hover_s[:, 0], shortest_by_balance(hover_s, *routes)[:, 0]


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def longest_by_balance(
    spare: Quantity, drawn: Quantity, gained: Quantity, left_s: Quantity
) -> Floats:
    """The longest Δ [s] with drawn · Δ ≤ spare + gained · T' and Δ + T' ≤ left; −∞ for none."""
    # Resting for all the time that is left; a rest that takes charge is useless.
    gained = gained if np.all(np.asarray(gained) >= 0.0) else np.maximum(gained, 0.0)
    both = drawn + gained
    most_s = (spare + gained * left_s) / both
    if not np.all(np.asarray(drawn) > 0.0):
        charges = np.where(spare >= drawn * left_s, np.inf, -np.inf)
        most_s = np.where(both > 0.0, most_s, charges)
    hover_s = np.minimum(left_s, most_s)
    possible = hover_s >= 0.0
    return hover_s if np.all(possible) else np.where(possible, hover_s, -np.inf)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def shortest_by_balance(
    hover_s: Floats, spare: Quantity, drawn: Quantity, gained: Quantity, left_s: Quantity
) -> Floats:
    """The least T' [s] for the Δ that `longest_by_balance` finds: none, or all that is left."""
    # The gain of a rest with almost no charging current is rounding.
    without_s = longest_by_balance(spare, drawn, 0.0, left_s)
    gains = without_s < hover_s - NOTHING * np.maximum(hover_s, 1.0)
    rests = gains & (np.asarray(gained) > 0.0) & (hover_s >= 0.0)
    return np.where(rests, left_s - hover_s, 0.0)
