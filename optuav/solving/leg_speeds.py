"""The legs of a network at ground speeds that are chosen leg by leg, and their price of time."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission.flight_model import CruisingModel, flight_of
from optuav.network.legs import NO_LEG, Legs, legs_at, segment_ways
from optuav.network.network import Network
from optuav.network.routes import routes_along
from optuav.network.variants import stacked
from optuav.options import Perspective
from optuav.physics.flight import Loads
from optuav.physics.quantity import Vector
from optuav.solving.assemble import figures
from optuav.solving.balance import Balance, balance, longest_by_balance, shortest_by_balance

ROUNDS, PARTS = 13, 16  # A price is known to one part in 16¹³


class LegSpeeds:
    """The legs of a network, whose segments may be flown at any speed up to their largest.

    A bent leg stops at its waypoints, so that each of its segments is a leg with its own speed.
    """

    def __init__(self, network: Network) -> None:
        flight = flight_of(network.mission)
        assert isinstance(flight, CruisingModel)
        self.network, self.flight = network, flight
        self.ways_m = segment_ways(network.places, network.legs)  # (axis, segment, leg)

    def named(self, rule: str) -> Floats:
        """Speeds (segment, leg) [m/s] by a rule of ``flight.speed``."""
        return np.asarray(self.flight.named_speed_m_s(vector(self.ways_m), rule))

    def priced(self, price_A: float) -> Floats:
        """Speeds (segment, leg) [m/s] of the least charge at a price of a second [A], ±∞ too."""
        return np.asarray(self.flight.priced_speed_m_s(vector(self.ways_m), price_A))

    @cached_property
    def least(self) -> Floats:
        """Speeds (segment, leg) [m/s] below which a segment takes longer than the deadline."""
        x, y, _ = self.ways_m
        slow = np.hypot(x, y) / self.network.mission.limits.deadline_s
        return np.asarray(np.minimum(slow, self.priced(math.inf)))

    def at(self, speeds_m_s: Floats) -> Network:
        """The network with legs at speeds (segment, leg) [m/s]."""
        network = self.network
        return self.with_legs(legs_at(network.mission, network.places, network.legs, speeds_m_s))

    def with_legs(self, legs: Legs) -> Network:
        """The network with other figures of its legs."""
        routes_now = self.network.routes
        routes = routes_along(legs, routes_now.legs, routes_now.building, routes_now.rest_first)
        return replace(self.network, legs=legs, routes=routes)

    def only(self, route: int) -> LegSpeeds:
        """The same for one route, number 0."""
        return LegSpeeds(self.network.only([route]))

    @cached_property
    def fastest(self) -> Network:
        """The network with every leg at its largest speed."""
        return self.at(self.priced(math.inf))


class RoutePrices(NamedTuple):
    """The best price of a second for each of some routes; arrays with one entry a route."""

    price_A: Floats  # ∞ where only the deadline binds
    # The longest Δ (−∞ for none), its T' and flight, and an upper bound on Δ [s].
    hover_s: Floats
    rest_s: Floats
    flight_s: Floats
    bound_s: Floats


@np.errstate(divide="ignore", invalid="ignore")
def route_prices(speeds: LegSpeeds, routes: Integers, perspective: Perspective) -> RoutePrices:
    """The best prices by charge and deadline, for a perspective that checks only the end.

    With charge Q and time T of all legs at the price μ, and as currents the budget q, I_h of the
    hover and I_r of the rest, Q + I_h Δ − I_r T' ≤ q and T + Δ + T' ≤ T_max have the dual bound
    (q + μ T_max − Q − μ T)/(I_h + μ) for each μ ≥ max(0, I_r, −I_h), as every leg flies its least
    charge plus μ times time. It is met at the least such μ if charge is short there: charge
    binds without the deadline, or both bind with a rest. Otherwise it is met at the μ where charge
    and deadline bind without a rest. Without such a μ only the deadline binds, and all legs fly as
    fast as they can.
    """
    network, flight = speeds.fastest, speeds.flight
    legs = network.routes.legs[routes]
    ways_m = speeds.ways_m[:, :, legs]  # (axis, segment, route, leg)
    way_m = vector(np.where((legs == NO_LEG) | np.isnan(ways_m), 0.0, ways_m))
    stated, budget_As, share = _budget(network, routes, perspective)
    hover_A, rest_A = stated.drawn / share, np.maximum(stated.gained, 0.0) / share
    deadline_s = network.mission.limits.deadline_s
    least_A = np.maximum(rest_A, -hover_A)

    def totals(loads: Loads) -> tuple[Floats, Floats, Booleans]:
        """Time and charge of routes (…, route), and whether charge lasts a hover till the end."""
        T, Q = (values.sum(axis=(0, -1)) for values in (loads.duration_s, loads.charge_As))
        return T, Q, Q + hover_A * (deadline_s - T) <= budget_As

    def flown(price_A: Floats) -> tuple[Floats, Floats, Booleans]:
        """The totals at prices (…, route)."""
        own_m = vector([component[:, *(None,) * (price_A.ndim - 1)] for component in way_m])
        speeds_m_s = flight.priced_speed_m_s(own_m, price_A[..., None])
        return totals(flight.leg_at(own_m, speeds_m_s))

    fastest = flight.leg_at(way_m, flight.priced_speed_m_s(way_m, math.inf))
    scale_A, (*cap, in_time) = float(np.max(fastest.currents_A[0])), totals(fastest)
    *_, lasts = flown(least_A)
    low, high = np.zeros(len(routes)), np.where(lasts, 1.0, 0.0)
    parts = np.linspace(0.0, 1.0, PARTS + 1)[1:-1, None]
    for _ in range(ROUNDS):
        share_of = low + (high - low) * parts
        *_, lasts = flown(least_A + scale_A * share_of / (1.0 - share_of))
        step, passed = (high - low) / PARTS, lasts.sum(axis=0)
        low, high = low + step * passed, low + step * (passed + 1)
    price_A = least_A + scale_A * low / (1.0 - low)
    T, Q, _ = flown(price_A)
    bound_s = (budget_As + price_A * deadline_s - Q - price_A * T) / (hover_A + price_A)
    bound_s = np.where(hover_A + price_A > 0.0, bound_s, -np.inf)
    T, Q = (np.where(in_time, most, own) for most, own in zip(cap, (T, Q), strict=True))
    bound_s = np.where(in_time, deadline_s - T, bound_s)
    ends = share * (budget_As - Q), stated.drawn, stated.gained, deadline_s - T
    hover_s = longest_by_balance(*ends)
    rest_s = shortest_by_balance(hover_s, *ends)
    return RoutePrices(np.where(in_time, np.inf, price_A), hover_s, rest_s, T, bound_s)


def _budget(
    network: Network, routes: Integers, perspective: Perspective
) -> tuple[Balance, Floats, Floats]:
    """The balance of routes, the flight charge [A s] that it allows, and its share per A s."""
    table = figures(stacked(network))
    without = replace(table, flight_charge_As=0.0, flight_energy_J=0.0)

    def of_routes(some: Balance) -> Balance:
        columns = (np.broadcast_to(values, (len(network.routes), 1)) for values in some)
        return Balance(*(column[routes, 0] for column in columns))

    loaded, whole = (of_routes(balance(total, perspective)) for total in (table, without))
    share = (whole.spare - loaded.spare) / network.routes.flight_charge_As[routes]
    return loaded, whole.spare / share, share


def vector(ways_m: Floats | list[Floats]) -> Vector:
    """Ways by component."""
    x, y, z = ways_m
    return x, y, z
