"""The longest hover by charge and time, in closed form: η at the end is affine in Δ and T'."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from formulations.parameters import Quantities
from formulations.soc import PERSPECTIVES, hovered_before
from optuav.arrays import Booleans, Floats, Integers
from optuav.modelling.check import CONSTRAINT_TOLERANCE
from optuav.modelling.forms import CONSTANT, Exponential, Monomial
from optuav.network.network import Network
from optuav.network.variants import Variants, as_variants
from optuav.options import Perspective
from optuav.physics.quantity import Quantity
from optuav.solving.assemble import route_quantities, transpose

TIMES = ("hover_time_s", "rest_time_s")  # Unknowns that make a plan; a formulation may have others
NOTHING = 1e-11  # Relative gain in hover that counts as none, as in the closed form


class Balance(NamedTuple):
    """The state of charge above η0; each a number or (route or 1, variant or 1).

    NumPy is fastest along many variants. The last three keep η0 at the landings.
    """

    spare: Quantity  # Left at the end without stays [-]
    drawn: Quantity  # By hovering [1/s]
    gained: Quantity  # By resting [1/s]
    left_s: Quantity  # Time for both
    least_rest_s: Quantity = 0.0
    least_hover_s: Quantity = 0.0
    most_hover_s: Quantity = math.inf
    # Of several devices, spare and drawn at landings after a rest and some hovers; drawn is
    # infinite where there is no such landing.
    after_both: tuple[tuple[Quantity, Quantity], ...] = ()

    def take(self, which: Integers) -> Balance:
        """Spare, drawn, gained and time left of some routes."""
        spare, drawn, gained, left_s = (np.asarray(figure)[which] for figure in self[:4])
        return Balance(spare, drawn, gained, left_s)

    def map(self, take: Callable[[Any], Any]) -> Balance:
        """The balance with other arrays in place of its own."""
        taken = tuple((take(spare), take(drawn)) for spare, drawn in self.after_both)
        figures: tuple[Any, ...] = self[:-1]
        return Balance._make([*map(take, figures), taken])


@lru_cache(maxsize=1)
def balance(variants: Variants, perspective: Perspective) -> Balance:
    """The balance of all routes of all variants; the last one is kept."""
    columns, routes = transpose(route_quantities(variants)), variants.network.routes
    whole = Balance(*affine_charge(columns, perspective), columns.time_left)
    if variants.mission.limits.keep_soc == "end":
        return whole
    rests, last = routes.building >= 0, routes.devices.shape[1]
    charge_As, energy_J = (np.zeros((1, 1)) for _ in range(2))
    for number, legs in enumerate(routes.legs.T[: last + 1]):
        charge, energy = (table.T[legs] for table in variants.of_legs[1:])
        charge_As, energy_J = charge_As + charge, energy_J + energy
        upto = replace(columns, flight_charge_As=charge_As, flight_energy_J=energy_J)
        rested = rests & (number > routes.rest_after)
        hovers = number - rested
        if last > 1:
            upto = _hovered(variants, upto, hovers)
        landing = Landed((hovers > 0)[:, None], rested[:, None])
        applies = (rests | (number < last))[:, None]  # The last leg of a direct route ends it
        whole = _kept(whole, upto, perspective, landing, applies)
    return whole


def _hovered(variants: Variants, columns: Quantities, hovers: Integers) -> Quantities:
    """The quantities of the first hovers of every route over several devices, as those of Δ."""
    points, order = variants.network.places.hovers, variants.network.routes.devices
    flown = np.arange(order.shape[1]) < hovers[:, None]
    share = np.array([device.share for device in variants.mission.served])
    weights = np.zeros(order.shape)
    np.put_along_axis(weights, order, flown * share[order], axis=1)
    received_A, received_W = (table[:, points].T for table in variants.received)
    return replace(
        columns,
        hover_current_A=weights @ (variants.hover_load.current_A.T - received_A),
        hover_power_W=columns.hover_power_W * weights.sum(axis=1, keepdims=True),
        hover_received_W=weights @ received_W,
    )


def balance_along(given: Quantities, perspective: Perspective) -> Balance:
    """The balance of itineraries that stay in one order."""
    whole = Balance(*affine_charge(given, perspective), given.time_left)
    for charge_As, energy_J, stays, _ in given.landings:
        upto = replace(given, flight_charge_As=charge_As, flight_energy_J=energy_J)
        if given.hovers:
            upto = replace(upto, **hovered_before(given, stays.count("hover")))
        whole = _kept(whole, upto, perspective, Landed("hover" in stays, "rest" in stays))
    return whole


def affine_charge(
    given: Quantities, perspective: Perspective
) -> tuple[Quantity, Quantity, Quantity]:
    """State of charge above η0 after all legs [-], what a hover draws and a rest gains [1/s]."""
    keys: list[Monomial] = [frozenset({(name, "time")}) for name in TIMES]
    hover, rest = keys
    times = (Exponential({key: 1.0}) for key in (hover, rest))
    terms = (PERSPECTIVES[perspective](given, *times) - given.min_soc).terms
    return terms[CONSTANT], -terms.get(hover, 0.0), terms.get(rest, 0.0)


class Landed(NamedTuple):
    """The stays before a landing that is not the last; both only with several devices."""

    hovered: Booleans | bool
    rested: Booleans | bool


@np.errstate(divide="ignore", invalid="ignore")
def _kept(
    routes: Balance,
    upto: Quantities,
    perspective: Perspective,
    landed: Landed,
    applies: Booleans | bool = True,
) -> Balance:
    """The balance that also keeps η0 at a landing; with an endless least rest where it cannot."""
    spare, drawn, gained = map(np.asarray, affine_charge(upto, perspective))
    spare = np.where(np.abs(spare) <= CONSTRAINT_TOLERANCE, 0.0, spare)
    hovered, rested = landed
    if np.any(both := np.logical_and(hovered, rested)):
        endless = np.where(applies & both, drawn, np.inf)
        routes = routes._replace(after_both=(*routes.after_both, (spare, endless)))
        applies = applies & ~both
    short = applies & (spare < 0.0)
    void = short & ~((hovered & (drawn != 0.0)) | (rested & (gained > 0.0)))
    rest_s = np.where(void, np.inf, np.where(short & rested, -spare / gained, 0.0))
    least_s = np.where(short & hovered & (drawn < 0.0), spare / drawn, 0.0)
    most_s = np.where(applies & hovered & (drawn > 0.0), spare / drawn, np.inf)
    return routes._replace(
        least_rest_s=np.maximum(routes.least_rest_s, rest_s),
        least_hover_s=np.maximum(routes.least_hover_s, least_s),
        most_hover_s=np.minimum(routes.most_hover_s, most_s),
    )


@lru_cache(maxsize=1)
def by_balance(network: Network) -> tuple[Floats, Floats]:
    """The longest Δ of all routes, −∞ for none, and the least T' for it [s]; the last are kept.

    By charge and time.
    """
    routes = balance(as_variants(network), "battery")
    hover_s = longest_by_balance(routes)
    return hover_s[:, 0], shortest_by_balance(hover_s, routes)[:, 0]


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def longest_by_balance(routes: Balance) -> Floats:
    """The longest Δ [s] with drawn · Δ ≤ spare + gained · T' and Δ + T' ≤ left; −∞ for none."""
    spare, drawn, gained, left_s, _, least_s, top_s, _ = moved = _without_least_rest(routes)
    # Resting for all the time that is left; a rest that takes charge is useless.
    gained = gained if np.all(np.asarray(gained) >= 0.0) else np.maximum(gained, 0.0)
    both = drawn + gained
    most_s = (spare + gained * left_s) / both
    if not np.all(np.asarray(drawn) > 0.0):
        charges = np.where(spare >= drawn * left_s, np.inf, -np.inf)
        most_s = np.where(both > 0.0, most_s, charges)
    hover_s = np.minimum(np.minimum(left_s, most_s), top_s)
    for row in moved.after_both:
        most_s, least_of_row_s = _with_both(moved, *row)
        hover_s, least_s = np.minimum(hover_s, most_s), np.maximum(least_s, least_of_row_s)
    possible = hover_s >= least_s
    return hover_s if np.all(possible) else np.where(possible, hover_s, -np.inf)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def shortest_by_balance(hover_s: Floats, routes: Balance) -> Floats:
    """The least T' [s] for the Δ that `longest_by_balance` finds: none, or all that is left.

    Where a landing caps Δ, only what the end needs.
    """
    spare, drawn, gained, left_s, _, _, top_s, _ = beyond = _without_least_rest(routes)
    # The gain of a rest with almost no charging current is rounding.
    without_s = longest_by_balance(beyond._replace(gained=0.0))
    gains = without_s < hover_s - NOTHING * np.maximum(hover_s, 1.0)
    rests = gains & (np.asarray(gained) > 0.0) & (hover_s >= 0.0)
    needed_s = np.where(hover_s < top_s, np.inf, (drawn * hover_s - spare) / gained)
    rest_s = routes.least_rest_s + np.where(rests, np.minimum(left_s - hover_s, needed_s), 0.0)
    for spare_As, drawn_A in routes.after_both:
        applies = np.isfinite(drawn_A) & (np.asarray(gained) > 0.0)
        needed_s = np.where(applies, (drawn_A * hover_s - spare_As) / gained, 0.0)
        rest_s = np.maximum(rest_s, needed_s)
    return np.where(hover_s >= 0.0, rest_s, 0.0)


@np.errstate(divide="ignore", invalid="ignore")
def flight_and_rest_bounds_s(variants: Variants, hover_s: float) -> Floats:
    """Lower bounds of T_fl + T' for a hover of at least Δ (route, variant) [s], by charge.

    A hover that charges may need no rest, however long it lasts.
    """
    spare, drawn, gained, *_ = balance(variants, "battery")
    short = np.where(np.asarray(drawn) > 0.0, drawn * hover_s - spare, 0.0)
    rest_s = np.where(np.asarray(gained) > 0.0, np.maximum(short, 0.0) / gained, 0.0)
    return np.asarray(variants.flight[0].T + rest_s)


def _with_both(routes: Balance, spare: Quantity, drawn: Quantity) -> tuple[Floats, Floats]:
    """The most and the least Δ [s] with drawn · Δ ≤ spare + gained · T', with any T' in time."""
    gained = np.maximum(routes.gained, 0.0)
    slope, level = drawn + gained, spare + gained * routes.left_s
    ends_s, applies = level / slope, np.isfinite(drawn)
    most_s = np.where(
        slope > 0.0, ends_s, np.where((slope < 0.0) | (level >= 0.0), np.inf, -np.inf)
    )
    least_s = np.where(slope < 0.0, ends_s, 0.0)
    return np.where(applies, most_s, np.inf), np.where(applies, least_s, 0.0)


def _without_least_rest(routes: Balance) -> Balance:
    """The balance in the rest beyond the least one."""
    least_s = routes.least_rest_s
    if not np.any(least_s):
        return routes
    gain = routes.gained * least_s
    moved = tuple((spare + gain, drawn) for spare, drawn in routes.after_both)
    spare, left_s = routes.spare + gain, routes.left_s - least_s
    return routes._replace(spare=spare, left_s=left_s, least_rest_s=0.0, after_both=moved)
