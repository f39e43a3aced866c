"""(P1) with the hover point free: where to hover as well as where to rest and how long.

A turn of a leg costs time that has a cusp where the turn vanishes, charging stops where a building
hides the laser, and no leg may cross a building. So no derivatives are used: all routes are
evaluated at points all over the region, with the real geometry, and from the best of these points
ever smaller steps are tried.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NamedTuple, NoReturn

import numpy as np

from formulations.formulation import Given
from formulations.p1 import P1
from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER
from formulations.soc import PAPER
from optuav.arrays import Floats, Integers
from optuav.engines.registry import AUTO, Engine
from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.mission.beams import beam_of
from optuav.mission.flight_model import flight_of
from optuav.modelling import Model, Parameter
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.network.places import HOVER
from optuav.network.variants import Variants, stacked
from optuav.options import Perspective
from optuav.physics.kibam import Stage
from optuav.physics.quantity import TINY, Quantity, Vector, norm
from optuav.plan import Plan
from optuav.solving.assemble import quantities
from optuav.solving.best_plans import hover_times_s
from optuav.solving.outcome import best
from optuav.solving.parts import Part, allowed, groups
from optuav.solving.program import Program, declared_program
from optuav.solving.question import Question
from optuav.status import SAME_S, Status

REFUSED = (
    "hover_point = 'free' has no {}: use the mission of the plan that was found, whose "
    "route.hover_m is the point"
)
PROOF = "local: points all over the region, the best of them refined by ever smaller steps"
TRIED = "a feasible plan: the best of the hover points that were tried within the time limit"
LATE = "the search for a hover point did not end within the time limit"
AT_ONCE = 1 << 17
"""Itineraries that are evaluated together, in bounded memory. No result depends on it."""
WITHIN = 1.0 - 1e-12  # share of the coverage radius that is used, for rounding
SAMPLES = (60, 12, 4)  # angles, radii and heights of the points that are tried
NEAR, REACH = (7, 24, 9), 0.2
"""Distances, angles and slopes of the points around places; the largest distance as a share of the
coverage radius."""
PROMISING_S = 2.0  # starts that are worse than the best by more than this are left [s]
MOST_ROUTES, STARTS = 6, 2  # routes refined, and starts of each
APART = 0.1  # distance between such starts, as a share of the coverage radius
AROUND, ALONG = 120, 20
"""Points a round of refinement: all around, and along the way to each place before and after."""
FIRST_M, ROUGH_M, LAST_M, SHRINK = 20.0, 1.0, 1e-7, 0.6
"""First and last length of steps [m], factor after a round without a better point; at the one in
between, only the best start of each route is followed further."""
ROUGH_S = 0.1  # and that of no route which is worse than the best by more than this [s]
AGAIN, AGAIN_M = 8, 1.0
"""Most further refinements from near the best point, and how near [m]; one that agrees ends them:
small steps may be caught by a ridge that leads to no top."""
DESCRIPTIONS = {
    "flight_time_s": "time of all legs, two of them to w and from w",
    "flight_charge_As": "charge drawn on all legs",
    "flight_energy_J": "energy drawn on all legs",
    "flight_voltage_V": "mean voltage on all legs",
    "hover_current_A": "current drawn at w, less what the laser gives there",
    "hover_received_W": "power received from the laser at w",
}
"""Printed in place of formulas in w that would fill a page."""


def free_program(question: Question, mission: Mission) -> "FreeProgram":
    """(P1) with the hover point free, declared for the routes that some point may make flyable."""
    stated = replace(question, problem=replace(question.p1, hover_point="w_U"), engine=AUTO)
    own = declared_program(replace(stated, time_limit_s=None), build_network(mission))
    region, network, parts = Region(mission), own.network, list[Part]()
    if region.low_m <= region.high_m and not np.isnan(vehicle.hover_load(mission).current_A):
        legs, table = network.routes.legs, network.legs
        apart = (table.start[legs] != HOVER) & (table.end[legs] != HOVER) & (legs != NO_LEG)
        usable = (table.flyable[legs] | ~apart).all(axis=1)
        opened = replace(network, routes=replace(network.routes, flyable=usable))
        reached = np.flatnonzero(allowed(stacked(opened), question.problem)[0])
        for group, rests in groups(
            opened.routes, reached, ordered=question.perspective not in PAPER
        ):
            which = reached[group]
            parts.append(Part(_declared(network, which, rests, question.perspective), which))
    return FreeProgram(question, network, tuple(parts), () if parts else own.reasons, own)


@dataclass(frozen=True)
class FreeProgram(Program):
    """A program whose hover point is unknown: print it, check points, or solve it."""

    own: Program  # The same with the hover point of the mission itself

    def solve(self) -> Plan:
        """The best plan found; locally optimal, and never worse than hovering at w_U."""
        own, mission = self.own.solve(), self.network.mission
        if not self.parts:
            return own
        routes = np.concatenate([part.routes for part in self.parts])
        search = _PointSearch(self.question, mission)
        points_m = search.best_m(routes)
        plans = [own] if own else []
        for hover_m in (*([] if mission.route.hover_m is None else [None]), *points_m):
            moved = build_network(mission.replace({"route.hover_m": hover_m}))
            plan = declared_program(self.own.question, moved).solve()
            plans += [plan] if plan else []
        if not plans and search.ended:
            raise SolverError(f"{LATE}, without a plan or proof that there is none")
        if not plans:
            reasons = ("no hover point was found that has a plan", *own.reasons)
            return own.model_copy(update={"reasons": reasons})
        figures = [(each.hover_time_s, each.mission_time_s, len(each.route)) for each in plans]
        chosen = plans[best(*zip(*figures, strict=True)) or 0]
        notes = (_gain(chosen, own), *chosen.notes)
        known = {"proof": PROOF, "status": Status.LOCALLY_OPTIMAL, "notes": notes}
        if search.ended:
            known = {"proof": TRIED, "status": Status.FEASIBLE, "notes": (LATE, *notes)}
        return chosen.model_copy(update=known)

    def shadow_prices(self, solutions: Sequence[Solution] | None = None) -> NoReturn:
        """Refused: the plan's mission, which states the point found, has shadow prices."""
        raise InputError(REFUSED.format("shadow prices"))

    def compile(self, engine: str | Engine | None = None) -> NoReturn:
        """Refused: the models do not know which buildings are in the way."""
        raise InputError(REFUSED.format("compiled program"))


def _gain(plan: Plan, own: Plan) -> str:
    """A note on how much longer a plan hovers than that of the mission's own hover point."""
    hover_m = plan.mission.route.hover_m
    name = "w_U" if own.mission.route.hover_m is None else "route.hover_m"
    if plan is own:
        return f"hover point free: none was found that is better than {name}"
    point = "w_U" if hover_m is None else "({:.3f}, {:.3f}, {:.3f}) m".format(*hover_m)
    more_s = plan.hover_time_s - own.hover_time_s if own else 0.0
    found = f" gives {more_s:.4f} s more than {name}" if own else f"; at {name} there is no plan"
    return f"hover point free: {point}{found}"


def _declared(network: Network, which: Integers, rests: bool, perspective: Perspective) -> Model:
    """(P1) over w, which is taken to be in sight of the laser, Δ and T' for some routes."""
    mission, table, legs = network.mission, network.legs, network.routes.legs[which]
    beam = mission.laser and beam_of(mission)
    if why := flight_of(mission).needs_numbers or (beam and beam.needs_numbers):
        raise InputError(f"the program of a free hover point cannot be declared: {why}")
    flown = legs != NO_LEG
    to_w, from_w = (flown & (ends[legs] == HOVER) for ends in (table.end, table.start))
    other = flown & ~to_w & ~from_w
    known = replace(
        quantities(network, which, rests=rests, hover_open=True),
        flight_time_s=np.where(other, table.duration_s[legs], 0.0).sum(axis=1),
        flight_charge_As=np.where(other, table.charge_As[legs], 0.0).sum(axis=1),
        flight_energy_J=np.where(other, table.energy_J[legs], 0.0).sum(axis=1),
        hover_current_A=float(vehicle.hover_load(mission).current_A),
        hover_received_W=0.0,
    )
    model = Model("P1 with the hover point free: longest hover within reach of the device")
    w = [
        model.variable(f"hover_{axis}_m", f"{axis}_w", unit="m", lower=-math.inf) for axis in "xyz"
    ]
    given, places = Given.of(known, perspective), network.places.position_m
    before, after = (
        [
            Parameter(f"{name}_{axis}_m", f"{axis}_{name[0]}", "m", value)
            for axis, value in zip("xyz", places[end].T, strict=True)
        ]
        for name, end in (("before", table.start[legs[to_w]]), ("after", table.end[legs[from_w]]))
    )
    flight = flight_of(mission)
    arriving, leaving = flight.leg(_way(before, w)), flight.leg(_way(w, after))
    stages: dict[object, list[Stage | str]] = {
        name: [Stage(-i, t) for i, t in zip(leg.currents_A, leg.durations_s, strict=True)]
        for name, leg in ((TO_HOVER, arriving), (FROM_HOVER, leaving))
    }
    steps = [stages.get(s, [s]) if isinstance(s, str) else [s] for s in given.steps]
    charge_As = known.flight_charge_As + (arriving.charge_As + leaving.charge_As)
    energy_J = known.flight_energy_J + (arriving.energy_J + leaving.energy_J)
    at_w: dict[str, Quantity] = {
        "flight_time_s": known.flight_time_s + (arriving.duration_s + leaving.duration_s),
        "flight_charge_As": charge_As,
        "flight_energy_J": energy_J,
        "flight_voltage_V": energy_J / charge_As,
        "hover_distance_m": norm(_way(mission.link.device_m, w)),
        "hover_altitude_m": w[2],
    }
    if mission.laser is not None:
        lit = vehicle.charging(mission, (w[0], w[1], w[2]))
        at_w["hover_current_A"] = known.hover_current_A - lit.current_A
        at_w["hover_received_W"] = lit.power_W
    named: dict[str, Quantity] = {
        each.name: model.let(
            each.name,
            at_w[each.name],
            symbol=each.metadata["symbol"],
            unit=each.metadata["unit"],
            words=DESCRIPTIONS.get(each.name, ""),
        )
        for each in QUANTITIES
        if each.name in at_w
    }
    P1().declare(model, replace(given, **named, steps=list(chain.from_iterable(steps))))
    return model


def _way(start: Sequence[Quantity], end: Sequence[Quantity]) -> Vector:
    """The displacement from one point to another [m]."""
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])


class Region:
    """Where a UAV may hover: a ball around the device, cut by the altitude band."""

    def __init__(self, mission: Mission) -> None:
        limits, device_m = mission.limits, np.array(mission.link.device_m)
        self.centre_m, self.radius_m = device_m, WITHIN * vehicle.coverage_radius_m(mission)
        # In the ball and in the band; low > high where there is no such altitude.
        self.low_m = max(limits.min_altitude_m, float(device_m[2]) - self.radius_m)
        self.high_m = min(limits.max_altitude_m, float(device_m[2]) + self.radius_m)

    def inside(self, points_m: Floats) -> Floats:
        """Points (…, 3) [m] moved into the region: up or down, then level to the device."""
        z = np.clip(points_m[..., 2:], self.low_m, self.high_m)
        way_m = points_m[..., :2] - self.centre_m[:2]
        share = self._level_m(z) / np.maximum(np.linalg.norm(way_m, axis=-1, keepdims=True), TINY)
        return np.concatenate([self.centre_m[:2] + np.minimum(1.0, share) * way_m, z], axis=-1)

    def spread(self) -> Floats:
        """Points (point, 3) [m] all over the region, its rim, floor and ceiling included."""
        φ = np.linspace(0.0, 2.0 * np.pi, SAMPLES[0], endpoint=False)
        share = np.sqrt(np.linspace(1.0, 0.0, SAMPLES[1], endpoint=False))
        z = np.linspace(self.low_m, self.high_m, SAMPLES[2])
        φ, share, z = (each.ravel() for each in np.meshgrid(φ, share, z))
        way_m = (share * self._level_m(z))[:, None] * np.column_stack([np.cos(φ), np.sin(φ)])
        return np.column_stack([self.centre_m[:2] + way_m, z])

    def near(self, place_m: Floats) -> Floats:
        """Points (point, 3) [m] around a place, ever closer, as far as they are in the region."""
        reach_m = REACH * self.radius_m * 0.5 ** np.arange(NEAR[0])
        angles = np.linspace(0.0, 2.0 * np.pi, NEAR[1], endpoint=False)
        slopes = np.linspace(-0.5 * np.pi, 0.5 * np.pi, NEAR[2])
        r, φ, θ = (each.ravel() for each in np.meshgrid(reach_m, angles, slopes))
        way_m = np.column_stack([np.cos(θ) * np.cos(φ), np.cos(θ) * np.sin(φ), np.sin(θ)])
        return self.kept(place_m + r[:, None] * way_m)

    def kept(self, points_m: Floats) -> Floats:
        """Those of some points (point, 3) [m] that are in the region, but for rounding."""
        known_m = points_m[np.isfinite(points_m).all(axis=1)]
        inside_m = self.inside(known_m)
        found: Floats = inside_m[np.abs(inside_m - known_m).max(axis=1, initial=0.0) < 1e-7]
        return found

    def _level_m(self, altitude_m: Floats) -> Floats:
        """Radius of the disc at an altitude [m]."""
        height_m = altitude_m - self.centre_m[2]
        return np.asarray(np.sqrt(np.maximum(self.radius_m**2 - height_m**2, 0.0)))


class _Spot(NamedTuple):
    """A hover point (3,) [m] of a route, and the hover time Δ [s] there."""

    hover_s: float
    route: int
    point_m: Floats


class _PointSearch:
    """The search for the best hover point, with the battery charged at constant current."""

    def __init__(self, question: Question, mission: Mission) -> None:
        self.perspective, self.region = question.perspective, Region(mission)
        self.w_U_m = vehicle.hover_point_m(mission.replace({"route.hover_m": None}))
        # Any point is stated, as variants of the mission have others.
        anywhere_m = tuple(self.region.inside(self.region.centre_m).tolist())
        stated = {"route.hover_m": anywhere_m, "battery.charging": "constant"}
        self.network = build_network(mission.replace(stated))
        self.latest = time.monotonic() + (question.time_limit_s or math.inf)
        self.ended = False  # Whether the time limit ended it
        self.best = _Spot(-math.inf, 0, np.zeros(3))  # So far

    def best_m(self, routes: Integers) -> list[tuple[float, ...]]:
        """The best point found [m] over some routes; empty where none has a plan."""
        try:
            top = self._searched(routes)
        except TimeoutError:
            self.ended, top = True, self.best
        return [tuple(top.point_m.tolist())] if top.hover_s >= 0.0 else []

    def _searched(self, routes: Integers) -> _Spot:
        """The best point, if time allows."""
        rough = [self._refined(each, 0, FIRST_M, ROUGH_M) for each in self._starts(routes)]
        if not rough:
            return self.best
        rough.sort(key=lambda each: each.hover_s)
        least_s = rough[-1].hover_s - ROUGH_S
        near = {each.route: each for each in rough if each.hover_s >= least_s}
        found = [self._refined(each, 0, ROUGH_M, LAST_M) for each in near.values()]
        top = max(found, key=lambda each: each.hover_s)
        for seed in range(1, AGAIN + 1):
            step_m = AGAIN_M * np.random.default_rng(seed).normal(size=3)
            near_m = self.region.inside(top.point_m + step_m)
            again = self._refined(_Spot(-math.inf, top.route, near_m), seed, AGAIN_M, LAST_M)
            agrees = abs(again.hover_s - top.hover_s) <= SAME_S
            top = max(top, again, key=lambda each: each.hover_s)
            if agrees:
                break
        return top

    def _tried(
        self, network: Network, routes: Integers, points_m: Floats, least_s: float
    ) -> tuple[Floats, _Spot]:
        """Δ [s] at points by routes (point, route), as of `hover_times_s`, and the best of them."""
        if time.monotonic() > self.latest:
            raise TimeoutError
        columns = {f"route.hover_m[{axis}]": points_m[:, axis] for axis in range(3)}
        hover_s = hover_times_s(Variants(network, columns), self.perspective, least_s)
        point, route = divmod(int(hover_s.argmax()), len(routes))
        top = _Spot(float(hover_s[point, route]), int(routes[route]), points_m[point])
        self.best = max(self.best, top, key=lambda each: each.hover_s)
        return hover_s, top

    def _starts(self, routes: Integers) -> list[_Spot]:
        """The points from which to refine: the best of every promising route, apart from others."""
        region, found = self.region, list[_Spot]()
        network = replace(self.network, routes=self.network.routes.take(routes))
        flown = network.routes.legs[network.routes.legs != NO_LEG]
        ends = np.union1d(network.legs.start[flown], network.legs.end[flown])
        places_m = np.vstack([self.w_U_m, network.places.position_m[ends[ends != HOVER]]])
        near_m = [region.near(place_m) for place_m in places_m]
        points_m = np.concatenate([region.kept(places_m), region.spread(), *near_m])
        # Of each portion, hovers that are promising beside the best so far.
        sampled, least_s, at_once = list[Floats](), 0.0, max(1, AT_ONCE // len(routes))
        for begin in range(0, len(points_m), at_once):
            portion_m = points_m[begin : begin + at_once]
            hover_s, top = self._tried(network, routes, portion_m, least_s)
            least_s = max(top.hover_s - PROMISING_S, least_s)
            point, route = np.nonzero(hover_s >= least_s)
            sampled.append(np.array([begin + point, route, hover_s[point, route]]))
        point, route, hover_s = np.concatenate(sampled, axis=1)
        best_s = np.full(len(routes), -np.inf)
        np.maximum.at(best_s, route.astype(np.intp), hover_s)
        for k in np.argsort(-best_s, kind="stable")[:MOST_ROUTES].tolist():
            near_m, left_s = points_m[point[route == k].astype(np.intp)], hover_s[route == k]
            for _ in range(STARTS):
                if left_s.max(initial=-np.inf) < least_s:
                    break
                start = int(left_s.argmax())
                found.append(_Spot(float(left_s[start]), int(routes[k]), near_m[start]))
                close = np.linalg.norm(near_m - near_m[start], axis=1) <= APART * region.radius_m
                left_s[close] = -np.inf
        return found

    def _refined(self, spot: _Spot, seed: int, reach_m: float, last_m: float) -> _Spot:
        """The best point that ever smaller random steps lead to, from one length to another [m]."""
        # Hover times have ridges where a turn of a leg vanishes: lines through the place before or
        # after, in the plane of its x or its y without wind. A step that leaves a ridge loses, so
        # some steps keep to such lines and planes.
        random, routes = np.random.default_rng(seed), np.array([spot.route])
        network = self.network.only(spot.route)
        hover_legs = (network.legs.start == HOVER) | (network.legs.end == HOVER)
        ends = network.legs.start[hover_legs] + network.legs.end[hover_legs] - HOVER
        around_m = network.places.position_m[ends]
        while reach_m > last_m:
            ways_m = spot.point_m - around_m
            apart_m = np.linalg.norm(ways_m, axis=1)[:, None]
            steps_m = reach_m * random.normal(size=(AROUND, 3))
            steps_m[AROUND // 2 :] *= min(1.0, float(apart_m.min()) / reach_m)
            for axis in range(3):
                steps_m[axis::4, axis] = 0.0
            points_m = spot.point_m + steps_m
            for number, place_m in enumerate(around_m):
                for axis in range(2):
                    points_m[2 * number + axis :: 8, axis] = place_m[axis]
            share = np.minimum(reach_m / np.maximum(apart_m, LAST_M), 1.0)
            share = share * random.normal(size=(2, ALONG))
            along_m = spot.point_m + share[:, :, None] * ways_m[:, None]
            level_m = along_m.copy()
            level_m[..., 2] = spot.point_m[2]
            points_m = self.region.inside(np.concatenate([points_m, *along_m, *level_m]))
            _, top = self._tried(network, routes, points_m, max(spot.hover_s, 0.0))
            if top.hover_s > spot.hover_s:
                spot = top
            else:
                reach_m *= SHRINK
        return spot
