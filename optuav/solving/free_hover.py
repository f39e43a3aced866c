"""(P1) with the hover point free: where to hover as well as where to rest and how long.

A turn of a leg costs time that has a cusp where the turn vanishes, charging stops where a building
hides the laser, and no leg may cross a building. So no derivatives are used: routes are evaluated
at points all over the region, with the real geometry, and from the best of these points ever
smaller steps are tried. Bounds leave out points that are too far from the building of a route, and
points where the hover would be too short even if nothing were in the way.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from typing import NoReturn

import numpy as np

from formulations.formulation import Given
from formulations.p1 import P1
from formulations.parameters import FROM_HOVER, QUANTITIES, TO_HOVER, Landing, Quantities
from formulations.soc import PAPER
from optuav.arrays import Floats, Integers
from optuav.engines.registry import AUTO, Engine
from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.modelling import Model, Parameter
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network, build_network
from optuav.network.places import FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.variants import Variants, as_variants
from optuav.options import Perspective
from optuav.physics.flight import Flow, Loads
from optuav.physics.kibam import Stage, gentlest
from optuav.physics.quantity import TINY, Quantity, Vector, norm
from optuav.plan import Plan
from optuav.presentation.numbers import coordinates, seconds
from optuav.solving.assemble import quantities
from optuav.solving.best_plans import hover_bounds_s, hover_times_s
from optuav.solving.maximise import AROUND, Lengths, Point, all_around, maximise
from optuav.solving.program import Program, best_plan, declared_program
from optuav.solving.question import Question
from optuav.solving.ranking import best
from optuav.solving.route_models import RouteModel, permitted_routes, routes_by_kind
from optuav.status import Status

POINTS_AT_ONCE = 1 << 13
"""Points that are evaluated together, in bounded memory. No result depends on it."""
RINGS = (0.1, 3000.0, 40)  # First and last radius of rings around buildings [m], and how many
WITHIN = 1.0 - 1e-12  # share of the coverage radius that is used, for rounding
SAMPLES = (60, 12, 4)  # angles, radii and heights of the points that are tried
POINTS_AROUND, REACH = (7, 24, 9), 0.2
"""Distances, angles and slopes of the points around places; the largest distance as a share of the
coverage radius."""
PROMISING_S = 2.0  # starts that are worse than the best by more than this are left [s]
MOST_ROUTES, STARTS = 6, 2  # routes refined, and starts of each
APART = 0.1  # distance between such starts, as a share of the coverage radius
ALONG = 20  # Points of a round of steps on the way to each place before and after
LENGTHS_M = Lengths(first=20.0, rough=1.0, last=1e-7)
REFUSED = (
    "hover_point = 'free' has no {}: use the mission of the plan that was found, whose "
    "route.hover_m is the point"
)
PROOF = "local: points all over the region, the best of them refined by ever smaller steps"
TRIED = "a feasible plan: the best of the hover points that were tried within the time limit"
LATE = "the search for a hover point did not end within the time limit"
DESCRIPTIONS = {
    "flight_time_s": "time of all legs, two of them to w and from w",
    "flight_charge_As": "charge drawn on all legs",
    "flight_energy_J": "energy drawn on all legs",
    "flight_voltage_V": "mean voltage on all legs",
    "hover_current_A": "current drawn at w, less the current from the laser there",
    "hover_received_W": "power received from the laser at w",
}
"""Printed in place of formulas in w that would fill a page."""


class HoverRegion:
    """Region where a UAV may hover: a ball around the device, cut by the altitude band."""

    def __init__(self, mission: Mission) -> None:
        limits, device_m = mission.limits, np.array(mission.device_m)
        self.centre_m, self.radius_m = device_m, WITHIN * vehicle.coverage_radius_m(mission)
        # In the ball and in the band; low > high if no such altitude exists.
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
        φ, share, z = (axis.ravel() for axis in np.meshgrid(φ, share, z))
        way_m = (share * self._level_m(z))[:, None] * np.column_stack([np.cos(φ), np.sin(φ)])
        return np.column_stack([self.centre_m[:2] + way_m, z])

    def near(self, place_m: Floats) -> Floats:
        """Points (point, 3) [m] around a place, ever closer, as far as they are in the region."""
        reach_m = REACH * self.radius_m * 0.5 ** np.arange(POINTS_AROUND[0])
        angles = np.linspace(0.0, 2.0 * np.pi, POINTS_AROUND[1], endpoint=False)
        slopes = np.linspace(-0.5 * np.pi, 0.5 * np.pi, POINTS_AROUND[2])
        r, φ, θ = (axis.ravel() for axis in np.meshgrid(reach_m, angles, slopes))
        way_m = np.column_stack([np.cos(θ) * np.cos(φ), np.cos(θ) * np.sin(φ), np.sin(θ)])
        return self.in_region(place_m + r[:, None] * way_m)

    def in_region(self, points_m: Floats) -> Floats:
        """Return the points (point, 3) [m] that are in the region, but for rounding."""
        inside_m = self.inside(points_m)
        found: Floats = inside_m[np.abs(inside_m - points_m).max(axis=1, initial=0.0) < 1e-7]
        return found

    def _level_m(self, altitude_m: Floats) -> Floats:
        """Radius of the disc at an altitude [m]."""
        height_m = altitude_m - self.centre_m[2]
        return np.asarray(np.sqrt(np.maximum(self.radius_m**2 - height_m**2, 0.0)))


class PointSearch:
    """The search for the best hover point, with the battery charged at constant current."""

    def __init__(
        self, perspective: Perspective, mission: Mission, latest: float = math.inf
    ) -> None:
        self.perspective, self.region, self.latest = perspective, HoverRegion(mission), latest
        self.w_U_m = vehicle.hover_point_m(mission.replace({"route.hover_m": None}))
        # Any point is stated, as variants of the mission have others.
        anywhere_m = tuple(self.region.inside(self.region.centre_m).tolist())
        changes = {"route.hover_m": anywhere_m, "battery.charging": "constant"}
        self.network = build_network(mission.replace(changes))
        self.clear = self.network.mission.replace({"flight.obstacles": "ignore"})
        self.ended = False  # Whether the time limit ended it
        self.best_s, self.best_at_m = -math.inf, np.zeros(3)  # So far

    def best_m(self, routes: Integers) -> list[tuple[float, ...]]:
        """Return the best point found [m] over some routes; none if no point has a plan."""
        try:
            if starts := self._starts(routes):
                inside, around = self.region.inside, self._around_m
                top = maximise(starts, self._hovers_s, LENGTHS_M, inside, around)
                self.best_s, self.best_at_m = top.value, top.at
        except TimeoutError:
            self.ended = True
        return [tuple(self.best_at_m.tolist())] if self.best_s >= 0.0 else []

    def _check_time(self) -> None:
        """End the search if its time is over."""
        if time.monotonic() > self.latest:
            raise TimeoutError

    def _tried(self, network: Network, points_m: Floats, least_s: float) -> Floats:
        """Return Δ [s] at points on routes (point, route), like `hover_times_s`; keep the best.

        Buildings only count where Δ without them reaches the least of interest.
        """
        self._check_time()
        clear = self._clear(network, points_m)
        (open_,) = np.nonzero((hover_bounds_s(clear, self.perspective) >= least_s).any(axis=0))
        hover_s = np.full((len(points_m), len(network.routes)), -np.inf)
        if not len(open_):
            return hover_s
        columns = {key: values[open_] for key, values in clear.columns.items()}
        hover_s[open_] = hover_times_s(Variants(network, columns), self.perspective, least_s)
        if (top_s := float(hover_s.max())) > self.best_s:
            self.best_s, self.best_at_m = top_s, points_m[int(hover_s.max(axis=1).argmax())]
        return hover_s

    def _clear(self, network: Network, points_m: Floats) -> Variants:
        """Return variants by hover point without obstacles; only roofs may be out of sight."""
        columns = {f"route.hover_m[{axis}]": points_m[:, axis] for axis in range(3)}
        variants = Variants(replace(network, mission=self.clear), columns)
        vars(variants)["received"] = self._received(network, points_m)
        return variants

    def _received(self, network: Network, points_m: Floats) -> Flow:
        """Return current [A] and power [W] (point, place), with all hover points in sight."""
        places, lit = network.places, vehicle.charging(network.mission, (*points_m.T,))
        tables = list[Floats]()
        at_places = places.charge_current_A, places.received_power_W
        for of_places, at_hover in zip(at_places, lit, strict=True):
            tables.append(np.tile(of_places, (len(points_m), 1)))
            tables[-1][:, HOVER] = at_hover
        return Flow(*tables)

    def _starts(self, routes: Integers) -> list[Point]:
        """Starting points for refinement: the best of each promising route, apart from others."""
        region = self.region
        network = replace(self.network, routes=self.network.routes.take(routes))
        flown = network.routes.legs[network.routes.legs != NO_LEG]
        ends = np.union1d(network.legs.start[flown], network.legs.end[flown])
        places_m = np.vstack([self.w_U_m, network.places.position_m[ends[ends != HOVER]]])
        near_m = [region.near(place_m) for place_m in places_m]
        points_m = np.concatenate([region.in_region(places_m), region.spread(), *near_m])
        sampled = [np.zeros((3, 0)), *self._sampled(network, points_m)]
        point, route, hover_s = np.concatenate(sampled, axis=1)
        least_s = max(self.best_s - PROMISING_S, 0.0)
        best_s, starts = np.full(len(routes), -np.inf), list[Point]()
        np.maximum.at(best_s, route.astype(np.intp), hover_s)
        for k in np.argsort(-best_s, kind="stable")[:MOST_ROUTES].tolist():
            near_m, left_s = points_m[point[route == k].astype(np.intp)], hover_s[route == k]
            for _ in range(STARTS):
                if left_s.max(initial=-np.inf) < least_s:
                    break
                start = int(left_s.argmax())
                starts.append(Point(float(left_s[start]), int(routes[k]), near_m[start]))
                close = np.linalg.norm(near_m - near_m[start], axis=1) <= APART * region.radius_m
                left_s[close] = -np.inf
        return starts

    def _sampled(self, network: Network, points_m: Floats) -> Iterator[Floats]:
        """Yield hovers that are promising beside the best so far: point, route and Δ [s].

        Buildings come in the order of their bounds, and the routes of each are tried at the points
        that are as near to it as the bounds allow.
        """
        routes, least_s = network.routes, 0.0
        rings_m, most_s = self._bounds_s(network, points_m)
        order = np.argsort(-most_s.max(axis=1), kind="stable")
        for building in dict.fromkeys(routes.building[order].tolist()):
            (ways,) = np.nonzero(routes.building == building)
            (open_,) = np.nonzero(most_s[ways].max(axis=0) >= least_s)
            promising = network.only(ways)
            away_m = np.linalg.norm(points_m - promising.places.position_m[-1], axis=1)
            (near,) = np.nonzero(away_m <= rings_m[open_ + 1].max(initial=-1.0))
            for begin in range(0, len(near), POINTS_AT_ONCE):
                batch = near[begin : begin + POINTS_AT_ONCE]
                hover_s = self._tried(promising, points_m[batch], least_s)
                least_s = max(self.best_s - PROMISING_S, least_s)
                point, route = np.nonzero(hover_s >= least_s)
                yield np.array([batch[point], ways[route], hover_s[point, route]])

    def _bounds_s(self, network: Network, points_m: Floats) -> tuple[Floats, Floats]:
        """Return the radii [m] of rings around a building, and bounds of Δ (route, ring) [s].

        At a hover point in a ring around the building of a route, Δ is no longer than the bound:
        nothing is in the way of legs or the laser, and a leg draws the least for its length. The
        bound is infinite if the flight model does not know that least.
        """
        mission, routes, places = network.mission, network.routes, network.places
        rings_m = np.concatenate([[0.0], np.geomspace(*RINGS), [np.inf]])
        most_s = np.full((len(routes), len(rings_m) - 1), np.inf)
        if (flight := mission.flight_model).least(0.0) is None:
            return rings_m, most_s
        count, at_m = len(routes), places.position_m
        start, end = (ends[routes.legs] for ends in (network.legs.start, network.legs.end))
        hovers, other = (start == HOVER) | (end == HOVER), start + end - HOVER
        known_m = np.linalg.norm(at_m[start] - at_m[end], axis=-1)
        beside_m = [
            np.linalg.norm(points_m - roof_m, axis=1).min() for roof_m in at_m[:FIRST_BUILDING]
        ]
        outer = hovers & (other < FIRST_BUILDING)
        nearest_m = np.where(outer, np.take(beside_m, other, mode="clip"), 0.0)
        roof_m = at_m[places.on(routes.building)][:, None]
        apart_m = np.linalg.norm(at_m[np.where(outer, other, ORIGIN)] - roof_m, axis=-1)
        apart_m[routes.building < 0] = 0.0
        brightest = vehicle.charging(mission, (*points_m.T,)).current_A
        brightest_m = points_m[np.argmax(brightest) if np.ndim(brightest) else 0]
        received = self._received(network, brightest_m[None])
        legs = np.where(routes.legs == NO_LEG, NO_LEG, np.arange(3 * count).reshape(count, 3))
        separate = replace(network, routes=replace(routes, legs=legs))
        able = np.ones((1, count), bool)
        for ring, (near_m, far_m) in enumerate(pairwise(rings_m)):
            self._check_time()
            open_m = np.where(outer, np.maximum(nearest_m, apart_m - far_m), near_m)
            loads = flight.least(np.where(hovers, open_m, known_m).reshape(1, -1))
            variants = Variants(separate, {"route.hover_m[2]": points_m[:1, 2]})
            assert loads is not None
            leg = gentlest(mission.pool, loads.charge_As, loads.least_current_A)
            vars(variants).update(loads=loads, received=received, shifts=[leg], able=able)
            most_s[:, ring] = hover_bounds_s(variants, self.perspective)[:, 0]
        return rings_m, most_s

    def _hovers_s(self, route: int, points_m: Floats, least_s: float) -> Floats:
        """Return Δ [s] at points on one route, −∞ if it is shorter than the least of interest."""
        return self._tried(self.network.only([route]), points_m, max(least_s, 0.0))[:, 0]

    def _around_m(
        self, route: int, at_m: Floats, reach_m: float, random: np.random.Generator
    ) -> Floats:
        """Return points (point, 3) [m] around one of a route, and on its ridges."""
        # Hover times have ridges where a turn of a leg vanishes: lines through the place before or
        # after, in the plane of its x or its y without wind. A step that leaves a ridge loses, so
        # some steps keep to such lines and planes.
        network = self.network.only([route])
        hover_legs = (network.legs.start == HOVER) | (network.legs.end == HOVER)
        ends = network.legs.start[hover_legs] + network.legs.end[hover_legs] - HOVER
        around_m = network.places.position_m[ends]
        ways_m = at_m - around_m
        apart_m = np.linalg.norm(ways_m, axis=1)[:, None]
        steps_m = all_around(route, np.zeros(3), reach_m, random)
        steps_m[AROUND // 2 :] *= min(1.0, float(apart_m.min()) / reach_m)
        points_m = at_m + steps_m
        for number, place_m in enumerate(around_m):
            for axis in range(2):
                points_m[2 * number + axis :: 8, axis] = place_m[axis]
        share = np.minimum(reach_m / np.maximum(apart_m, LENGTHS_M.last), 1.0)
        share = share * random.normal(size=(2, ALONG))
        along_m = at_m + share[:, :, None] * ways_m[:, None]
        level_m = along_m.copy()
        level_m[..., 2] = at_m[2]
        return np.concatenate([points_m, *along_m, *level_m])


def free_program(question: Question, mission: Mission) -> FreeProgram:
    """(P1) with the hover point free, for the routes that some point may make flyable."""
    network = build_network(mission)
    reached, parts = _reached(question, network), list[RouteModel]()
    ordered = question.perspective not in PAPER or mission.limits.keep_soc == "always"
    for group, rests in routes_by_kind(network.routes, reached, ordered=ordered):
        which = reached[group]
        parts.append(RouteModel(_declared(network, which, rests, question.perspective), which))
    reasons = () if len(reached) else declared_program(_at_mission(question), network).reasons
    return FreeProgram(question, network, tuple(parts), reasons)


def _at_mission(question: Question) -> Question:
    """The question with the hover point of the mission itself."""
    problem = replace(question.p1, hover_point="w_U")
    return replace(question, problem=problem, engine=AUTO, time_limit_s=None)


def _reached(question: Question, network: Network) -> Integers:
    """Numbers of the routes that some hover point may make flyable."""
    mission, region = network.mission, HoverRegion(network.mission)
    if region.low_m > region.high_m or np.isnan(vehicle.hover_load(mission).current_A):
        return np.zeros(0, dtype=np.intp)
    legs, table = network.routes.legs, network.legs
    apart = (table.start[legs] != HOVER) & (table.end[legs] != HOVER) & (legs != NO_LEG)
    usable = (table.flyable[legs] | ~apart).all(axis=1)
    opened = replace(network, routes=replace(network.routes, flyable=usable))
    return np.flatnonzero(permitted_routes(as_variants(opened), question.problem)[0])


def longest_anywhere(question: Question, mission: Mission) -> Plan:
    """The best plan found, wherever it hovers; locally optimal, never worse than at w_U.

    A search needs no declaration, which not every flight model and beam has.
    """
    begin, network = time.monotonic(), build_network(mission)
    at_mission, reached = _at_mission(question), _reached(question, network)
    stated_plan = best_plan(at_mission, network)
    if not len(reached):
        return stated_plan
    others = [] if mission.route.hover_m is None else [None]
    # The plan at each point takes about as long as that at the mission's own.
    last_s = (1 + len(others)) * (time.monotonic() - begin)
    latest = begin + (question.time_limit_s or math.inf)
    search = PointSearch(question.perspective, mission, latest - last_s)
    points_m = search.best_m(reached)
    plans = [stated_plan] if stated_plan else []
    for hover_m in (*others, *points_m):
        moved = build_network(mission.replace({"route.hover_m": hover_m}))
        plan = best_plan(at_mission, moved)
        plans += [plan] if plan else []
    if not plans and search.ended:
        raise SolverError(f"{LATE}, without a plan or proof that none exists")
    if not plans:
        reasons = ("no hover point was found that has a plan", *stated_plan.reasons)
        return stated_plan.model_copy(update={"reasons": reasons})
    figures = [(plan.hover_time_s, plan.mission_time_s, len(plan.route)) for plan in plans]
    chosen = plans[best(*zip(*figures, strict=True)) or 0]
    notes = (_gain(chosen, stated_plan), *chosen.notes)
    changes = {"proof": PROOF, "status": Status.LOCALLY_OPTIMAL, "notes": notes}
    if search.ended:
        changes = {"proof": TRIED, "status": Status.FEASIBLE, "notes": (LATE, *notes)}
    return chosen.model_copy(update=changes)


@dataclass(frozen=True)
class FreeProgram(Program):
    """A program whose hover point is unknown: print it, check points, or solve it."""

    def solve(self) -> Plan:
        """The best plan found; see `longest_anywhere`."""
        return longest_anywhere(self.question, self.network.mission)

    def shadow_prices(self, solutions: Sequence[Solution] | None = None) -> NoReturn:
        """Refused: the plan's mission, which states the point found, has shadow prices."""
        raise InputError(REFUSED.format("shadow prices"))

    def compile(self, engine: str | Engine | None = None) -> NoReturn:
        """Refused: the models do not know which buildings are in the way."""
        raise InputError(REFUSED.format("compiled program"))


def _gain(plan: Plan, own: Plan) -> str:
    """Note how much longer a plan hovers than one at the mission's own hover point."""
    hover_m = plan.mission.route.hover_m
    name = "w_U" if own.mission.route.hover_m is None else "route.hover_m"
    if plan is own:
        return f"hover point free: none was found that is better than {name}"
    point = "w_U" if hover_m is None else f"{coordinates(hover_m, 7)} m"
    if not own:
        return f"hover point free: {point}; at {name} no plan exists"
    more_s = round(plan.hover_time_s - own.hover_time_s, 4)
    gain = f"{seconds(more_s, 4)} more than" if more_s > 0.0 else "no longer hover than"
    return f"hover point free: {point} gives {gain} {name}"


def _declared(network: Network, which: Integers, rests: bool, perspective: Perspective) -> Model:
    """(P1) over w, which is taken to be in sight of the laser, Δ and T' for some routes."""
    mission, table, legs = network.mission, network.legs, network.routes.legs[which]
    beam = mission.laser and mission.beam
    if why := mission.flight_model.needs_numbers or (beam and beam.needs_numbers):
        raise InputError(f"the program of a free hover point cannot be declared: {why}")
    flown = legs != NO_LEG
    to_w, from_w = (flown & (ends[legs] == HOVER) for ends in (table.end, table.start))
    other = flown & ~to_w & ~from_w
    shared = replace(
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
    values, places = Given.of(shared, perspective), network.places.position_m
    before, after = (
        [
            Parameter(f"{name}_{axis}_m", f"{axis}_{name[0]}", "m", value)
            for axis, value in zip("xyz", places[end].T, strict=True)
        ]
        for name, end in (("before", table.start[legs[to_w]]), ("after", table.end[legs[from_w]]))
    )
    flight = mission.flight_model
    arriving, leaving = flight.leg(_way(before, w)), flight.leg(_way(w, after))
    stages: dict[object, list[Stage | str]] = {
        name: [Stage(-i, t) for i, t in zip(leg.currents_A, leg.durations_s, strict=True)]
        for name, leg in ((TO_HOVER, arriving), (FROM_HOVER, leaving))
    }
    steps = [stages.get(s, [s]) if isinstance(s, str) else [s] for s in values.steps]
    charge_As = shared.flight_charge_As + (arriving.charge_As + leaving.charge_As)
    energy_J = shared.flight_energy_J + (arriving.energy_J + leaving.energy_J)
    at_w: dict[str, Quantity] = {
        "flight_time_s": shared.flight_time_s + (arriving.duration_s + leaving.duration_s),
        "flight_charge_As": charge_As,
        "flight_energy_J": energy_J,
        "flight_voltage_V": energy_J / charge_As,
        "hover_distance_m": norm(_way(mission.device_m, w)),
        "hover_altitude_m": w[2],
    }
    if mission.laser is not None:
        lit = vehicle.charging(mission, (w[0], w[1], w[2]))
        at_w["hover_current_A"] = shared.hover_current_A - lit.current_A
        at_w["hover_received_W"] = lit.power_W
    named: dict[str, Quantity] = {}
    for name, known_as in ((q.name, q.metadata) for q in QUANTITIES if q.name in at_w):
        words = {k: known_as[k] for k in ("symbol", "unit")}
        named[name] = model.let(name, at_w[name], **words, words=DESCRIPTIONS.get(name, ""))
    legs_of = {TO_HOVER: arriving, FROM_HOVER: leaving}
    landings = tuple(_landings(values, shared, legs_of)) if shared.landings else ()
    flat = list(chain.from_iterable(steps))
    P1().declare(model, replace(values, **named, steps=flat, landings=landings))
    return model


def _landings(values: Given, known: Quantities, legs_of: Mapping[str, Loads]) -> Iterator[Landing]:
    """The ends of all legs but the last; the leg that does not touch the hover point is known."""
    flown_As: Quantity = 0.0
    flown_J: Quantity = 0.0
    stays, number, other = tuple[str, ...](), 0, False
    for step in values.steps:
        if step in legs_of:
            leg = legs_of[step]
            flown_As, flown_J = flown_As + leg.charge_As, flown_J + leg.energy_J
            number += len(leg.currents_A)
        elif isinstance(step, Stage):
            if not other:
                flown_As = flown_As + known.flight_charge_As
                flown_J = flown_J + known.flight_energy_J
            number, other = number + 1, True
        else:
            yield Landing(flown_As, flown_J, stays, number - 1)
            stays, number = (*stays, step), number + 1


def _way(start: Sequence[Quantity], end: Sequence[Quantity]) -> Vector:
    """The displacement from one point to another [m]."""
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])
