"""The speeds of legs: priced by charge and deadline, or searched for under `available`."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from formulations.parameters import Landing, Quantities
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Booleans, Floats, Integers
from optuav.flight.model import CruisingModel
from optuav.network import vehicle
from optuav.network.legs import NO_LEG, Legs, legs_at, segment_ways
from optuav.network.network import Network
from optuav.network.places import HOVER
from optuav.network.routes import routes_along
from optuav.network.variants import as_variants
from optuav.options import Perspective
from optuav.physics.kibam import Stage, falls_throughout
from optuav.physics.quantity import Quantity, Vector
from optuav.solving.assemble import legs_and_stays, quantities, route_quantities, subset, transpose
from optuav.solving.balance import (
    Balance,
    affine_charge,
    balance_along,
    longest_by_balance,
    shortest_by_balance,
)
from optuav.solving.best_plans import bracketed, hover_bounds_s
from optuav.solving.maximise import Lengths, Point, maximise
from optuav.status import SAME_S

REFINEMENTS, PARTS = 13, 16  # A price is known to one part in 16¹³
FIRST = 32  # Routes that are priced at first: as fast as one
RULES = ("best-range", "best-endurance", "max")
LENGTHS, SLOWEST = Lengths(0.1, 0.01, 1e-8), 1e-6  # Shares of the largest speed of a segment


class LegSpeeds:
    """The legs of a network, whose segments may be flown at any speed up to their largest.

    A bent leg stops at its waypoints, so that each of its segments is a leg with its own speed.
    """

    def __init__(self, network: Network) -> None:
        flight = network.mission.flight_model
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
        routes = routes_along(
            legs,
            routes_now.legs,
            routes_now.building,
            routes_now.rest_after,
            routes_now.devices,
        )
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


@dataclass(frozen=True)
class RoutePricing:
    """What decides the best prices of routes, for a perspective that checks only the end.

    With charge Q and time T of all legs at the price μ, and as currents the budget q, I_h of the
    hover and I_r of the rest, Q + I_h Δ − I_r T' ≤ q and T + Δ + T' ≤ T_max have the dual bound
    (q + μ T_max − Q − μ T)/(I_h + μ) for each μ ≥ max(0, I_r, −I_h), as every leg flies its least
    charge plus μ times time. It is met at the least such μ if charge is short there: charge
    binds without the deadline, or both bind with a rest. Otherwise it is met at the μ where charge
    and deadline bind without a rest. Without such a μ only the deadline binds, and all legs fly as
    fast as they can.
    """

    flight: CruisingModel
    ways_m: Floats  # (axis, segment, route, leg); 0 for missing segments
    stated: Balance
    budget_As: Floats
    share: Floats  # State of charge per A s
    deadline_s: float
    scale_A: float  # Of prices

    @classmethod
    def of(cls, speeds: LegSpeeds, routes: Integers, perspective: Perspective) -> RoutePricing:
        """What decides the prices of some routes."""
        network, flight = speeds.fastest, speeds.flight
        legs = network.routes.legs[routes]
        ways_m = speeds.ways_m[:, :, legs]
        ways_m = np.where((legs == NO_LEG) | np.isnan(ways_m), 0.0, ways_m)
        way_m, deadline_s = vector(ways_m), network.mission.limits.deadline_s
        fastest = flight.leg_at(way_m, flight.priced_speed_m_s(way_m, math.inf))
        scale_A = float(np.max(fastest.currents_A[0], initial=0.0))
        return cls(flight, ways_m, *_budget(network, routes, perspective), deadline_s, scale_A)

    def take(self, which: Integers) -> RoutePricing:
        """The same for some of the routes."""
        return replace(
            self,
            ways_m=self.ways_m[:, :, which],
            stated=self.stated.take(which),
            budget_As=self.budget_As[which],
            share=self.share[which],
        )

    @property
    def hover_A(self) -> Floats:
        """Charge that a second of hover takes [A]."""
        return np.asarray(self.stated.drawn / self.share)

    @property
    def least_A(self) -> Floats:
        """The least prices that give a bound [A]."""
        rest_A = np.maximum(self.stated.gained, 0.0) / self.share
        return np.asarray(np.maximum(rest_A, -self.hover_A))

    def flown(self, price_A: Quantity) -> tuple[Floats, Floats]:
        """Time and charge of all legs at prices (…, route) [A], or at the price ∞."""
        own_m = vector(self.ways_m)
        if isinstance(price_A, np.ndarray):
            own_m = vector([component[:, *(None,) * (price_A.ndim - 1)] for component in own_m])
            price_A = price_A[..., None]
        loads = self.flight.leg_at(own_m, self.flight.priced_speed_m_s(own_m, price_A))
        T, Q = (values.sum(axis=(0, -1)) for values in (loads.duration_s, loads.charge_As))
        return T, Q

    def lasts(self, T: Floats, Q: Floats) -> Booleans:
        """Whether charge lasts for a hover till the end, after flights of a time and charge."""
        return Q + self.hover_A * (self.deadline_s - T) <= self.budget_As

    def bound_s(self, price_A: Floats, T: Floats, Q: Floats) -> Floats:
        """The dual bound of Δ by route [s] at prices [A], with the time and charge flown there."""
        spare_As = self.budget_As + price_A * self.deadline_s - Q - price_A * T
        beside_A, endless = self.hover_A + price_A, np.where(spare_As < 0.0, -np.inf, np.inf)
        return np.where(beside_A > 0.0, spare_As / beside_A, endless)

    @np.errstate(divide="ignore", invalid="ignore")
    def quick_bounds_s(self, price_A: float) -> Floats:
        """Bounds of Δ by route [s] at one price, or the least above it, and by the least flight."""
        prices_A = np.maximum(self.least_A, price_A)
        T, _ = self.flown(math.inf)
        return np.minimum(self.bound_s(prices_A, *self.flown(prices_A)), self.deadline_s - T)

    @np.errstate(divide="ignore", invalid="ignore")
    def prices(self) -> RoutePrices:
        """The best prices, and the longest hovers, of all routes."""
        least_A, scale_A, (*cap,) = self.least_A, self.scale_A, self.flown(math.inf)
        in_time, lasts = self.lasts(*cap), self.lasts(*self.flown(least_A))
        low, high = np.zeros(len(lasts)), np.where(lasts, 1.0, 0.0)
        parts = np.linspace(0.0, 1.0, PARTS + 1)[1:-1, None]
        for _ in range(REFINEMENTS):
            share_of = low + (high - low) * parts
            lasts = self.lasts(*self.flown(least_A + scale_A * share_of / (1.0 - share_of)))
            step, passed = (high - low) / PARTS, lasts.sum(axis=0)
            low, high = low + step * passed, low + step * (passed + 1)
        price_A = least_A + scale_A * low / (1.0 - low)
        flown = self.flown(price_A)
        bound_s = self.bound_s(price_A, *flown)
        T, Q = (np.where(in_time, most, own) for most, own in zip(cap, flown, strict=True))
        bound_s = np.where(in_time, self.deadline_s - T, bound_s)
        spare = self.share * (self.budget_As - Q)
        ends = Balance(spare, self.stated.drawn, self.stated.gained, self.deadline_s - T)
        hover_s = longest_by_balance(ends)
        rest_s = shortest_by_balance(hover_s, ends)
        return RoutePrices(np.where(in_time, np.inf, price_A), hover_s, rest_s, T, bound_s)


def best_first(
    pricing: RoutePricing, most_s: Quantity = math.inf
) -> Iterator[tuple[int, RoutePrices]]:
    """Each route by number with its prices, from the largest bound of Δ on.

    No bound is above `most_s` (route,) [s]. Only routes that quick bounds leave in question are
    priced, twice as many each time.
    """
    bounds_s, at_once = np.minimum(pricing.quick_bounds_s(0.0), most_s), FIRST
    left, priced = np.ones(len(bounds_s), bool), np.zeros(len(bounds_s), bool)
    table = RoutePrices(*np.full((len(RoutePrices._fields), len(bounds_s)), np.nan))
    while left.any():
        number = int(np.flatnonzero(left)[bounds_s[left].argmax()])
        if priced[number]:
            yield number, RoutePrices(*(column[[number]] for column in table))
            left[number] = False
            continue
        new = np.flatnonzero(~priced)
        new = new[np.argsort(-bounds_s[new], kind="stable")[:at_once]]
        for column, values in zip(table, pricing.take(new).prices(), strict=True):
            column[new] = values
        bounds_s[new] = table.bound_s[new] = np.minimum(table.bound_s, most_s)[new]
        priced[new], at_once = True, 2 * at_once
        if not priced.all() and math.isfinite(price_A := float(table.price_A[new[0]])):
            closer_s = pricing.quick_bounds_s(price_A)
            bounds_s = np.where(priced, bounds_s, np.minimum(bounds_s, closer_s))


def _budget(
    network: Network, routes: Integers, perspective: Perspective
) -> tuple[Balance, Floats, Floats]:
    """The balance of routes, the flight charge [A s] that it allows, and its share per A s."""
    table = transpose(route_quantities(as_variants(network)))
    without = replace(table, flight_charge_As=0.0, flight_energy_J=0.0)

    def of_routes(given: Quantities) -> Balance:
        values = (*affine_charge(given, perspective), given.time_left)
        columns = (np.broadcast_to(value, (len(network.routes), 1)) for value in values)
        return Balance(*(column[routes, 0] for column in columns))

    loaded, whole = map(of_routes, (table, without))
    share = (whole.spare - loaded.spare) / network.routes.flight_charge_As[routes]
    return loaded, whole.spare / share, share


def vector(ways_m: Floats | list[Floats]) -> Vector:
    """Ways by component."""
    x, y, z = ways_m
    return x, y, z


def hover_bounds_at_any_speed_s(speeds: LegSpeeds) -> Floats:
    """Upper bounds of Δ by route [s], by legs that have every figure at its best at once.

    A leg takes its least time, draws its least charge, and does that slowly: so it adds the most to
    the tilt z = y1 − ωy and leaves the least of it, which is not above 0 before a leg. Slowly is
    at the least power: slower still, a leg empties the wells more, where y1 falls throughout. Where
    it may not, where hovering charges, and where the stated start has a tilt above 0, the bound is
    the one from charge and deadline.
    """
    mission, fastest = speeds.network.mission, speeds.fastest
    easiest = np.maximum(speeds.priced(-math.inf), speeds.least)
    cheapest, slow = (speeds.at(price).legs for price in (speeds.priced(0.0), easiest))
    charge_As, t = cheapest.durations_s * cheapest.currents_A, slow.durations_s
    current_A = np.divide(charge_As, t, out=np.zeros_like(t), where=t > 0.0)
    best = speeds.with_legs(replace(slow, currents_A=current_A))
    routes = replace(best.routes, flight_time_s=fastest.routes.flight_time_s)
    drawn_A = np.where(t > 0.0, slow.currents_A, math.inf)
    falls = falls_throughout(mission.pool, -drawn_A).all()
    hover_A = vehicle.hover_load(mission).current_A - fastest.places.charge_current_A[HOVER]
    tilted = hover_A < 0.0 or vehicle.start(mission).tilt_As > 0.0
    perspective = AVAILABLE if falls and not tilted else "battery"
    bounds_s = hover_bounds_s(as_variants(replace(best, routes=routes)), perspective)[:, 0]
    return np.minimum(bounds_s, _bounds_from_full_s(best, hover_A)) if hover_A > 0.0 else bounds_s


def _bounds_from_full_s(network: Network, hover_A: Quantity) -> Floats:
    """Upper bounds of Δ by route [s]: a rest before the hover leaves no more than all charge."""
    limits, routes = network.mission.limits, network.routes
    flown_As = np.append(network.legs.charge_As, 0.0)[routes.legs[:, 1:]].sum(axis=1)  # 0: NO_LEG
    stored_As = network.mission.pool.capacity_As * (1.0 - limits.min_soc)
    most_s = (stored_As - flown_As) / hover_A
    return np.where(routes.rest_first, np.where(most_s >= 0.0, most_s, -np.inf), np.inf)


class SpeedSearch:
    """The search for the best speeds, with the battery charged at constant current."""

    def __init__(
        self,
        speeds: LegSpeeds,
        routes: Integers,
        time_limit_s: float | None,
        perspective: Perspective = AVAILABLE,
    ) -> None:
        mission = speeds.network.mission.replace({"battery.charging": "constant"})
        self.speeds = LegSpeeds(replace(speeds.network, mission=mission))
        # What is proved by charge and deadline alone holds for the wells too.
        self.perspective = perspective
        counted: Perspective = perspective if perspective in PAPER else "battery"
        most_s: Quantity = math.inf
        if perspective == AVAILABLE:
            most_s = hover_bounds_at_any_speed_s(speeds)[routes]
        self.routes = routes
        self.ranked = best_first(RoutePricing.of(self.speeds, routes, counted), most_s)
        self.bounds_s = dict[int, float]()  # Of the promising routes
        self.latest = time.monotonic() + (time_limit_s or math.inf)
        self.ended = False  # Whether the time limit ended it
        self.best = Point(-math.inf, 0, np.zeros(0))  # So far
        self.tried = list[Point]()  # Named and priced speeds
        self.of_route = lru_cache(maxsize=None)(lambda route: RouteSpeeds(self.speeds.only(route)))

    def starts(self) -> list[Point]:
        """Named and priced speeds of the promising routes, and their hovers."""
        starts = list[Point]()
        for number, prices in self.ranked:
            route, bound_s = int(self.routes[number]), float(prices.bound_s[0])
            self.bounds_s[route] = bound_s
            if bound_s < max(self.best.value - SAME_S, 0.0):
                break
            points = self.of_route(route).starts(float(prices.price_A[0]))
            hover_s = self._tried(route, points, 0.0).tolist()
            starts += [Point(time_s, route, at) for time_s, at in zip(hover_s, points, strict=True)]
        return [point for point in starts if point.value >= 0.0]

    def tops(self) -> list[Point]:
        """The best speeds found of each route that may be the best, as shares of the largest.

        A route is left out only where its bound is no better than the best speeds of others.
        """
        tops = list[Point]()
        try:
            self.tried = self.starts()
            by_value = sorted(self.tried, key=lambda start: start.value, reverse=True)
            for route in dict.fromkeys(start.branch for start in by_value):
                starts = [start for start in self.tried if start.branch == route]
                if not tops or self.bounds_s[route] > self.best.value + SAME_S:
                    tops.append(maximise(starts, self._tried, LENGTHS, _inside))
        except TimeoutError:
            self.ended = True
            tops.append(self.best)
        return tops

    def _tried(self, route: int, points: Floats, least_s: float) -> Floats:
        """The longest hovers at points (point, segment) of a route [s], −∞ for none."""
        if time.monotonic() > self.latest:
            raise TimeoutError
        of_route = self.of_route(route)
        hover_s = of_route.hover_times_s(points, max(least_s, 0.0), self.perspective)
        number = int(hover_s.argmax())
        top = Point(float(hover_s[number]), route, points[number])
        self.best = max(self.best, top, key=lambda each: each.value)
        return hover_s


def _inside(points: Floats) -> Floats:
    """Points moved to where every segment is flown, at most at its largest speed."""
    return np.clip(points, SLOWEST, 1.0)


class RouteSpeeds:
    """The segments of one route, in order, and its hover times by their speeds.

    A point has the speed of each segment as a share of its largest.
    """

    def __init__(self, speeds: LegSpeeds) -> None:
        self.speeds, network = speeds, speeds.fastest
        self.most_m_s = speeds.priced(math.inf)
        (legs,) = network.routes.legs
        self.legs = legs[legs != NO_LEG]  # In flight order
        flown, self.segment = np.nonzero(np.isfinite(self.most_m_s.T[self.legs]))
        self.leg = self.legs[flown]
        self.way_m = vector(speeds.ways_m[:, self.segment, self.leg])
        one, rests = np.zeros(1, np.intp), bool(network.routes.building[0] >= 0)
        self.given = subset(quantities(network, one, rests=rests, steps=False), 0)
        self.stays = [stay for _, stay in legs_and_stays(network, one, rests)]

    def starts(self, price_A: float) -> Floats:
        """Points (point, segment) of the named speeds and of a price of a second [A]."""
        speeds = [*map(self.speeds.named, RULES), self.speeds.priced(price_A)]
        points = np.array([self.point(speed) for speed in speeds])
        return np.asarray(points[np.isfinite(points).all(axis=1)])

    def point(self, speeds_m_s: Floats) -> Floats:
        """The point of speeds (segment, leg) [m/s]."""
        speed, most = (speeds[self.segment, self.leg] for speeds in (speeds_m_s, self.most_m_s))
        return np.asarray(np.divide(speed, most, out=np.ones_like(most), where=most > 0.0))

    @property
    def largest_m_s(self) -> Floats:
        """The largest speeds of its segments (segment,) [m/s]."""
        return np.asarray(self.most_m_s[self.segment, self.leg])

    def at(self, speeds_m_s: Floats) -> Network:
        """The network with this route, its segments at speeds (segment,) [m/s]."""
        all_m_s = np.full_like(self.most_m_s, np.nan)
        all_m_s[self.segment, self.leg] = speeds_m_s
        return self.speeds.at(all_m_s)

    def hover_times_s(
        self, points: Floats, least_s: float = 0.0, perspective: Perspective = AVAILABLE
    ) -> Floats:
        """The longest hovers [s] at points (point, segment), −∞ for none."""
        loads = self.speeds.flight.leg_at(self.way_m, points * self.largest_m_s)
        (current_A,), (duration_s,) = loads.currents_A, loads.durations_s
        steps, landings, voltage_V = list[Stage | str](), [], self.given.nominal_voltage_V
        charge_As = np.zeros(len(points))
        for leg, stay in zip(self.legs, self.stays, strict=True):
            segments = np.flatnonzero(self.leg == leg)
            steps += [Stage(-current_A[:, k], duration_s[:, k]) for k in segments.tolist()]
            if stay:
                charge_As = charge_As + (duration_s * current_A)[:, segments].sum(axis=1)
                before = tuple(step for step in steps if isinstance(step, str))
                landings.append(Landing(charge_As, charge_As * voltage_V, before, len(steps) - 1))
                steps.append(stay)
        charge_As = (duration_s * current_A).sum(axis=1)
        values = replace(
            self.given,
            flight_time_s=duration_s.sum(axis=1),
            flight_charge_As=charge_As,
            flight_energy_J=charge_As * voltage_V,
            steps=steps,
            landings=landings if self.given.landings else (),
        )
        if perspective in PAPER:
            return longest_by_balance(balance_along(values, perspective))
        hover_s, *_ = bracketed(values, len(points), shortest_rest=False, least_s=least_s)
        return np.asarray(np.nan_to_num(hover_s, nan=-np.inf))
