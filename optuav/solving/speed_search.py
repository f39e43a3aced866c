"""The speeds of legs under `available`: searched from several starts, with a bound above them."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import lru_cache

import numpy as np

from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats, Integers
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import HOVER
from optuav.network.variants import stacked
from optuav.options import Perspective
from optuav.physics.kibam import Stage, falls_throughout
from optuav.solving.assemble import entries, legs_and_stays, quantities
from optuav.solving.balance import balance, longest_by_balance
from optuav.solving.best_plans import bracketed, hover_bounds_s
from optuav.solving.leg_speeds import LegSpeeds, route_prices, vector
from optuav.solving.maximise import Lengths, Point, maximise
from optuav.status import SAME_S

RULES = ("best-range", "best-endurance", "max")
LENGTHS, SLOWEST = Lengths(0.1, 0.01, 1e-8), 1e-6  # Shares of the largest speed of a segment
PROMISING_S, MOST_ROUTES = 2.0, 4  # Routes that are searched: not worse than the best by more [s]


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
    falls = falls_throughout(vehicle.pool(mission), -drawn_A).all()
    hover_A = vehicle.hover_load(mission).current_A - fastest.places.charge_current_A[HOVER]
    tilted = hover_A < 0.0 or vehicle.start(mission).tilt_As > 0.0
    perspective = AVAILABLE if falls and not tilted else "battery"
    return hover_bounds_s(stacked(replace(best, routes=routes)), perspective)[:, 0]


class SpeedSearch:
    """The search for the best speeds, with the battery charged at constant current."""

    def __init__(self, speeds: LegSpeeds, routes: Integers, time_limit_s: float | None) -> None:
        mission = speeds.network.mission.replace({"battery.charging": "constant"})
        self.speeds = LegSpeeds(replace(speeds.network, mission=mission))
        # What is proved by charge and deadline alone holds for the wells too.
        priced = route_prices(self.speeds, routes, "battery")
        bounds_s = np.minimum(hover_bounds_at_any_speed_s(speeds)[routes], priced.bound_s)
        order = np.argsort(-bounds_s, kind="stable")
        self.routes, self.bounds_s = routes[order], bounds_s[order]
        self.prices_A = priced.price_A[order]
        self.latest = time.monotonic() + (time_limit_s or math.inf)
        self.ended = False  # Whether the time limit ended it
        self.best = Point(-math.inf, 0, np.zeros(0))  # So far
        self.tried = list[Point]()  # Named and priced speeds
        self.of_route = lru_cache(maxsize=None)(lambda route: RouteSpeeds(self.speeds.only(route)))

    def starts(self) -> list[Point]:
        """Named and priced speeds of the promising routes, and their hovers."""
        starts = list[Point]()
        for number, route in enumerate(self.routes.tolist()):
            if self.bounds_s[number] < max(self.best.value - SAME_S, 0.0):
                break
            points = self.of_route(route).starts(float(self.prices_A[number]))
            hover_s = self._tried(route, points, 0.0).tolist()
            starts += [Point(each, route, at) for each, at in zip(hover_s, points, strict=True)]
        return [point for point in starts if point.value >= 0.0]

    def top(self) -> Point:
        """The best speeds found, as shares of the largest; the value is −∞ without any."""
        try:
            self.tried = starts = self.starts()
            best_s = dict[int, float]()
            for start in starts:
                best_s[start.branch] = max(start.value, best_s.get(start.branch, 0.0))
            able = sorted(best_s, key=best_s.__getitem__, reverse=True)[:MOST_ROUTES]
            able = [k for k in able if best_s[k] >= self.best.value - PROMISING_S]
            starts = [start for start in starts if start.branch in able]
            if starts:
                maximise(starts, self._tried, LENGTHS, _inside)
        except TimeoutError:
            self.ended = True
        return self.best

    def _tried(self, route: int, points: Floats, least_s: float) -> Floats:
        """The longest hovers at points (point, segment) of a route [s], −∞ for none."""
        if time.monotonic() > self.latest:
            raise TimeoutError
        hover_s = self.of_route(route).hover_times_s(points, max(least_s, 0.0))
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
        self.given = entries(quantities(network, one, rests=rests, steps=False), 0)
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
        steps = list[Stage | str]()
        for leg, stay in zip(self.legs, self.stays, strict=True):
            segments = np.flatnonzero(self.leg == leg).tolist()
            steps += [Stage(-current_A[:, k], duration_s[:, k]) for k in segments]
            steps += [stay] if stay else []
        charge_As = (duration_s * current_A).sum(axis=1)
        values = replace(
            self.given,
            flight_time_s=duration_s.sum(axis=1),
            flight_charge_As=charge_As,
            flight_energy_J=charge_As * self.given.nominal_voltage_V,
            steps=steps,
        )
        if perspective in PAPER:
            return longest_by_balance(*balance(values, perspective))
        hover_s, *_ = bracketed(values, len(points), shortest_rest=False, least_s=least_s)
        return np.asarray(np.nan_to_num(hover_s, nan=-np.inf))
