"""Random missions over all combinations of options: solved, flown again, and broken on purpose.

A few in the suite, any number in the campaign (``make soak EXAMPLES=…``), which draws fresh ones. A
number draws the options and the mission; every pair of options that go together occurs.
"""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import optuav
from optuav import Mission, Plan, SolverError
from optuav.engines.registry import engine
from optuav.network.legs import NO_LEG
from optuav.network.network import build_network
from optuav.network.vehicle import coverage_radius_m
from optuav.status import Status
from tests.examples import few
from tests.solving import by_forces
from tests.solving.all_options import OPTIONS, TURNING, Choice, choice_of, mission_of, together
from tests.solving.by_forces import Array, Part
from tests.solving.delivered import longer, rests

CLOSE, SAME_S = 1e-6, 2e-5  # Of figures, relative, and of hover times that are one
INTEGRATED = 2e-5  # Of what is integrated, as a share of its size
OUTSIDE = 1e-8  # Share of the capacity that is more than rounding of the oracle
GRID, BROKEN = 200, 3  # Slots of a deadline, and ways in which each plan is broken
SAMPLED = 12  # Speeds of legs that are tried beside chosen ones
FACTORS = {
    "limits.deadline_s": 0.9,
    "flight.max_speed_m_s": 0.8,
    "flight.clearance_m": 0.5,
    "flight.max_altitude_m": 1.1,
    "body.drag_area_m2": 1.3,
    "start.soc": 0.95,
    "start.available_As": 0.97,
    "laser.power_W": 0.8,
    "laser.jitter_rad": 1.5,
    "laser.turbulence_cn2": 2.0,
    "laser.divergence_rad": 1.2,
    "receiver.max_power_W": 0.5,
    "receiver.max_irradiance_W_m2": 0.5,
}
"""By how much a batch changes what a mission states."""


def test_each_pair_of_options_occurs() -> None:
    """In two thousand missions all pairs that go together."""
    choices = (choice_of(np.random.default_rng(number)).values() for number in range(2000))
    seen = {frozenset(pair) for each in choices for pair in itertools.combinations(each, 2)}
    kinds = itertools.combinations(OPTIONS.values(), 2)
    pairs = (pair for one, other in kinds for pair in itertools.product(one, other))
    assert seen == {frozenset(pair) for pair in pairs if together(*pair)}


def problem_of(rng: np.random.Generator, choice: Choice) -> Any:
    """The problem of a choice."""
    speed: Any = "free" if choice["flight"] == "free" else "mission"
    order: Any = [None, "rest-first", "hover-first"][rng.integers(3)]
    return {
        "P1": optuav.P1(speed=speed, order=order),
        "P3": optuav.P3(speed=speed),
        "P4": optuav.P4("b1", speed=speed, order=order),
        "two stops": optuav.P1(stops=2),
    }[choice["problem"]]


# Figures of a mission


class Route(NamedTuple):
    """A route: parts of its legs and names of its stays, in order, and net current by stay [A]."""

    steps: tuple[Part | str, ...]
    net_A: dict[str, float]

    @property
    def flown(self) -> tuple[float, float]:
        """Time [s] and charge [A s] of its legs."""
        parts = [step for step in self.steps if isinstance(step, Part)]
        return sum(p.duration_s for p in parts), sum(p.duration_s * p.drawn_A for p in parts)


class Figures:
    """The figures of a mission's places and legs, those of the network held against the tests'."""

    def __init__(self, mission: Mission) -> None:
        self.mission, self.network = mission, build_network(mission)
        self.names = [str(name) for name in self.network.places.names]
        self.at_m = dict(zip(self.names, self.network.places.position_m, strict=True))
        self.gain_A = {name: self._gain_A(name) for name in self.names}
        self.hover_A = by_forces.hover_A(mission)
        self.rest_A = float(vars(mission.flight).get("rest_current_A", 0.0))
        for k in range(len(self.network.legs.start)):
            self._check_leg(k)

    def _gain_A(self, name: str) -> float:
        """Current by the laser at a place [A], as the network has it, which is right."""
        places, number, lit = self.network.places, self.names.index(name), False
        stated_A = float(places.charge_current_A[number])
        if self.mission.laser is not None:
            lit = bool(places.laser_sight[number])
            assert lit in by_forces.sights(self.mission, name, self.at_m[name]), name
        own_A = by_forces.charging_A(self.mission, self.at_m[name]) if lit else 0.0
        assert stated_A == pytest.approx(own_A, rel=CLOSE, abs=CLOSE), name
        return stated_A

    def _check_leg(self, k: int) -> None:
        """Hold time, charge and energy of a leg, and whether it is blocked."""
        legs, points_m = self.network.legs, self.points_m(k)
        parts = [part for segment in self.along(points_m) for part in segment]
        rows = [(p.duration_s, p.duration_s * p.drawn_A, p.duration_s * p.drawn_W) for p in parts]
        own = np.sum(rows, axis=0) if rows else np.full(3, np.nan)
        told = [float(each[k]) for each in (legs.duration_s, legs.charge_As, legs.energy_J)]
        assert told == pytest.approx(own.tolist(), rel=CLOSE, nan_ok=True), points_m
        if self.mission.flight.obstacle_rule == "refuse" and rows:
            ends = self.names[legs.start[k]], self.names[legs.end[k]]
            blocked = by_forces.too_near(self.mission, ends, points_m, 0.0)
            assert not (blocked and legs.flyable[k]), blocked

    def points_m(self, k: int) -> Array:
        """Start, waypoints and end of a leg of the network [m]."""
        legs, at_m = self.network.legs, self.network.places.position_m
        bent_m = legs.waypoints_m[..., k]
        bent_m = bent_m[np.isfinite(bent_m[:, 0])]
        return np.concatenate([at_m[[legs.start[k]]], bent_m, at_m[[legs.end[k]]]])

    def along(self, points_m: Array, speeds_m_s: Any = ()) -> list[list[Part]]:
        """The segments of a way by points [m]."""
        ways_m = np.diff(points_m, axis=0)
        speeds = speeds_m_s or [None] * len(ways_m)
        return [by_forces.leg(self.mission, *each) for each in zip(ways_m, speeds, strict=True)]

    def net_A(self, kind: str, place: str) -> float:
        """Into the battery while it stays at a place [A]."""
        return self.gain_A[place] - (self.hover_A if kind == "hover" else self.rest_A)

    def routes(self, problem: Any, share: float = 0.0) -> Iterator[Route]:
        """The routes that a problem may fly, at their speeds or a share of the largest."""
        network, limits, hover_m = self.network, self.mission.limits, self.at_m["hover"]
        reach_m = float(coverage_radius_m(self.mission)) * (1 + 1e-9)
        in_band = limits.min_altitude_m <= hover_m[2] <= limits.max_altitude_m
        if not in_band or math.dist(hover_m, self.mission.link.device_m) > reach_m:
            return
        table = network.routes
        for k, building in enumerate(table.building.tolist()):
            if building < 0:
                asked = not isinstance(problem, optuav.P4)
            else:
                only = getattr(problem, "building", None)
                asked = only in (None, self.mission.buildings.names[building])
                asked &= not isinstance(problem, optuav.P3)
                asked &= problem.order in (None, table.order(k))
            if asked and table.flyable[k]:
                yield self._route([int(leg) for leg in table.legs[k] if leg != NO_LEG], share)

    def _route(self, legs: list[int], share: float) -> Route:
        steps, net_A = list[Part | str](), dict[str, float]()
        for k in legs:
            points_m, end = self.points_m(k), self.names[self.network.legs.end[k]]
            ways_m = np.diff(points_m, axis=0) if share else ()
            speeds = [share * by_forces.named_m_s(self.mission, way_m, "max") for way_m in ways_m]
            steps += itertools.chain(*self.along(points_m, speeds))
            if end != "destination":
                kind = "hover" if end == "hover" else "rest"
                net_A[kind] = self.net_A(kind, end)
                steps.append(kind)
        return Route(tuple(steps), net_A)


# Plans flown again


def fly(plan: Plan, figures: Figures) -> None:
    """Position, speed, wells, lengths and clearances of a plan, by SciPy and points along ways."""
    battery, trace = plan.mission.battery, optuav.replay(plan).trace
    state, begun_s = [0.0, 0.0, *by_forces.start_As(plan.mission)], 0.0
    off_As = INTEGRATED * battery.packs * battery.capacity_As
    for phase in plan.phases:
        points_m = points_of(phase, figures)
        flies = phase.kind == "flight"
        segments = figures.along(points_m, phase.speeds_m_s)
        if flies:
            lengths_m = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
            peak = max(part.peak_m_s for segment in segments for part in segment)
            assert phase.distance_m == pytest.approx(lengths_m.sum(), rel=CLOSE)
            assert phase.peak_speed_m_s == pytest.approx(peak, rel=INTEGRATED)
            check_clearance(plan.mission, phase, points_m)
        else:
            segments = [[Part(phase.duration_s, frozen=True)]]
        for start_m, end_m, segment in zip(points_m, points_m[1:], segments, strict=False):
            way_m = end_m - start_m
            length_m = float(np.linalg.norm(way_m))
            upright = flies and len(segment) == 1  # At one speed from its start to its end
            state[:2] = 0.0, segment[0].peak_m_s if upright else 0.0
            for part in segment:
                inside = np.abs(trace.time_s - begun_s - 0.5 * part.duration_s)
                at = np.flatnonzero(inside < 0.5 * part.duration_s - 1e-7)
                moments_s = np.append(trace.time_s[at] - begun_s, part.duration_s)
                net_A = -part.drawn_A if flies else figures.net_A(phase.kind, phase.end_place)
                course = by_forces.integrate(plan.mission, part, net_A, state, moments_s)
                state = [float(each[-1]) for each in course]
                begun_s += part.duration_s
                along, speed, *wells = (each[:-1] for each in course)
                on_way_m = start_m + np.outer(along / (length_m or 1.0), way_m)
                near(trace.position_m[at], on_way_m, INTEGRATED * (1.0 + length_m))
                speed = speed if flies and not part.frozen else 0.0 * speed
                near(trace.speed_m_s[at], speed, INTEGRATED * (1.0 + part.peak_m_s))
                if not battery.takes_turns:
                    near(trace.available_As[at, 0], wells[0], off_As)
                    near(trace.bound_As[at, 0], wells[1], off_As)
            if flies:
                assert state[0] == pytest.approx(length_m, rel=CLOSE)
                assert upright or state[1] == pytest.approx(0.0, abs=1e-3)
        assert phase.end_s == pytest.approx(begun_s, rel=CLOSE, abs=CLOSE)
        if not battery.takes_turns:
            assert [*phase.available_As, *phase.bound_As] == pytest.approx(state[2:], abs=off_As)


def near(told: Array, own: Array, within: float) -> None:
    assert np.abs(told - own).max(initial=0.0) <= within


def points_of(phase: Any, figures: Figures) -> Array:
    """Start, waypoints and end of a phase [m]."""
    start_m, end_m = figures.at_m[phase.start_place], figures.at_m[phase.end_place]
    return np.array([start_m, *phase.waypoints_m, end_m])


def apart_m(mission: Mission) -> float:
    """The clearance of bent ways [m]."""
    return 5.0 if mission.flight.clearance_m is None else mission.flight.clearance_m


def check_clearance(mission: Mission, phase: Any, points_m: Array) -> None:
    """A leg runs through no building, and a bent one keeps its clearance and its ceiling."""
    ends, bent = (phase.start_place, phase.end_place), len(points_m) > 2
    if mission.flight.obstacle_rule == "ignore":
        assert not bent
        return
    assert not by_forces.too_near(mission, ends, points_m, apart_m(mission) if bent else 0.0)
    if bent and mission.flight.max_altitude_m is not None:
        assert points_m[1:-1, 2].max() <= mission.flight.max_altitude_m + CLOSE


# The best of all plans


def by_charge_s(mission: Mission, route: Route) -> float:
    """The longest hover by charge and deadline; −∞ for none."""
    if mission.limits.keep_soc == "always":
        return by_landings_s(mission, route)
    (time_s, charge_As), battery = route.flown, mission.battery
    whole_As = battery.packs * battery.capacity_As
    spare_As = sum(by_forces.start_As(mission)) - mission.limits.min_soc * whole_As - charge_As
    left_s = mission.limits.deadline_s - time_s
    drawn_A, gain_A = -route.net_A["hover"], max(route.net_A.get("rest", 0.0), 0.0)
    # Δ needs drawn·Δ ≤ spare + gain·T' with Δ + T' ≤ left.
    if left_s < 0.0 or drawn_A + gain_A <= 0.0:
        return left_s if left_s >= 0.0 and spare_As >= drawn_A * left_s else -math.inf
    most_s = min(left_s, (spare_As + gain_A * left_s) / (drawn_A + gain_A))
    return most_s if most_s >= 0.0 else -math.inf


def by_landings_s(mission: Mission, route: Route) -> float:
    """The same with the reserve at the end of every leg, by HiGHS; −∞ for none."""
    (time_s, _), battery, drawn_As = route.flown, mission.battery, 0.0
    whole_As = battery.packs * battery.capacity_As
    spare_As = sum(by_forces.start_As(mission)) - mission.limits.min_soc * whole_As
    kinds, before = [*route.net_A], dict.fromkeys(route.net_A, 0.0)
    rows, limits = [[1.0] * len(kinds)], [mission.limits.deadline_s - time_s]
    for step in [*route.steps, "end"]:
        if isinstance(step, Part):
            drawn_As += step.duration_s * step.drawn_A
            continue
        rows.append([-before[kind] for kind in kinds])
        limits.append(spare_As - drawn_As)
        before[step] = route.net_A.get(step, 0.0)
    found = linprog([-float(kind == "hover") for kind in kinds], A_ub=rows, b_ub=limits)
    return -float(found.fun) if found.status == 0 else -math.inf


def slack(mission: Mission, route: Route, hover_s: Any, rest_s: Any) -> Any:
    """By how much the wells keep their limits, as a share of the capacity; −1 after the end."""
    battery, wells = mission.battery, by_forces.kibam(mission)
    tapers, stays_s = battery.charging == "taper", {"hover": hover_s, "rest": rest_s}
    landed: Any = math.inf
    for step in route.steps:
        part = isinstance(step, Part)
        if not part and mission.limits.keep_soc == "always":
            landed = np.minimum(landed, wells.soc - mission.limits.min_soc)
        net_A, time_s = (
            (-step.drawn_A, step.duration_s) if part else (route.net_A[step], stays_s[step])
        )
        (wells.taper if tapers and net_A > 0.0 else wells.spend)(net_A, time_s)
    past = 1e-12 if tapers else 0.0
    kept = np.minimum(wells.least, battery.available_fraction - wells.most + past)
    kept = np.minimum(np.minimum(kept, landed), wells.soc - mission.limits.min_soc)
    used_s = route.flown[0] + hover_s + (rest_s if "rest" in route.net_A else 0.0)
    return np.where(used_s <= mission.limits.deadline_s, kept, -1.0)


def check_best(plan: Plan, figures: Figures, problem: Any, rng: np.random.Generator) -> None:
    """No route has a longer hover: by charge in closed form, by wells on a grid of stays."""
    mission, hover_s = figures.mission, plan.hover_time_s if plan else -math.inf
    free, several = getattr(problem, "speed", "") == "free", getattr(problem, "stops", 1) > 1
    asked = optuav.P1() if several else problem
    routes = list(figures.routes(asked))
    for share in rng.uniform(0.3, 1.0, SAMPLED) if free else ():
        routes += figures.routes(asked, float(share))
    if plan.perspective == "battery":
        longest_s = max((by_charge_s(mission, route) for route in routes), default=-math.inf)
        assert hover_s >= longest_s - SAME_S
        assert free or several or hover_s <= longest_s + SAME_S
        assert plan.status in (Status.OPTIMAL, Status.INFEASIBLE)
        return
    proved = plan.status in (Status.OPTIMAL, Status.INFEASIBLE)
    most_s = hover_s if proved else math.inf if plan.bound is None else plan.bound
    assert most_s >= hover_s - SAME_S
    horizon_s = mission.limits.deadline_s
    if most_s > horizon_s:
        return
    hovers_s = longer(most_s, horizon_s, 1e-5 * (1.0 + max(most_s, 0.0)))[:, None]
    for route in routes:
        rests_s = rests([plan.rest_time_s] if plan else [], horizon_s)
        rests_s = rests_s if "rest" in route.net_A else np.zeros(1)
        better = (slack(mission, route, hovers_s, rests_s) > OUTSIDE).any(axis=1)
        assert not better.any(), (most_s, hovers_s[better][-1], route)


# Other engines, and batches


def check_engines(plan: Plan, problem: Any, rng: np.random.Generator) -> None:
    """Engines that take the problem too find as much, or no more than what is proved."""
    mission, hover_s = plan.mission, plan.hover_time_s if plan else 0.0
    asked, tapers = {"perspective": plan.perspective}, mission.battery.charging == "taper"
    most_s = hover_s if plan.bound is None else plan.bound
    if getattr(problem, "stops", 1) > 1:
        return
    if getattr(problem, "speed", "") == "free":
        program = optuav.formulate(mission, problem, **asked)
        for part in program.parts if not tapers and rng.random() < 0.3 else ():
            local = engine("casadi").solve(part.model, len(part.routes))
            assert np.nanmax(np.append(local.objective, 0.0)) <= most_s + 1e-3
        return
    slot_s = mission.limits.deadline_s / GRID
    searched = optuav.solve(mission, problem, engine="grid", slot_s=slot_s, **asked)
    found_s = searched.hover_time_s if searched else 0.0
    assert found_s <= most_s + SAME_S
    others = {"casadi": 1e-3} if not tapers and rng.random() < 0.15 else {}
    if plan.perspective == "battery":
        drains = any(phase.current_A < 0.0 for phase in plan.phases if phase.kind == "rest")
        assert drains or found_s >= hover_s - 2 * slot_s
        others |= {"closed-form": SAME_S} | ({"cvxpy": 1e-3} if rng.random() < 0.03 else {})
    for name, within_s in others.items():
        other = optuav.solve(mission, problem, engine=name, **asked)
        other_s = other.hover_time_s if other else 0.0
        assert other_s <= most_s + within_s, name
        assert plan.perspective != "battery" or other_s >= hover_s - within_s, name


def check_batch(mission: Mission, problem: Any, perspectives: list[Any]) -> None:
    """A batch over the numbers that a mission states has the hover times of single missions."""
    document, changes = mission.to_dict(), {}
    for key, factor in FACTORS.items():
        table, name = key.split(".")
        if value := document.get(table, {}).get(name):
            changes[key] = value * factor
    columns = {key: [mission_value(document, key), changes[key]] for key in changes}
    asked: dict[str, Any] = {"problem": problem, "perspective": perspectives}
    table = optuav.batch_arrays(mission, columns, paired=True, **asked)["hover_time_s"]
    for row, perspective in zip(table, perspectives, strict=True):
        for batched_s, other in zip(row, (mission, mission.replace(changes)), strict=True):
            alone = solved(other, problem, perspective)
            alone_s = alone.hover_time_s if alone else math.nan
            assert batched_s == pytest.approx(alone_s, abs=SAME_S, nan_ok=True), perspective


def mission_value(document: dict[str, Any], key: str) -> float:
    table, name = key.split(".")
    return float(document[table][name])


# Plans that are broken on purpose


def broken(plan: Plan, figures: Figures) -> Iterator[tuple[str, dict[str, Any]]]:
    """Kinds of events, with files of the plan in which a limit is broken."""
    mission, hover_m = plan.mission, figures.at_m["hover"].tolist()

    def file(number: int = 0, phase: dict[str, Any] | None = None, **tables: Any) -> dict[str, Any]:
        document = copy.deepcopy(plan.to_dict())
        document["phases"][number] |= phase or {}
        for table, keys in tables.items():
            document["mission"].setdefault(table, {}).update(keys)
        return document

    yield "deadline", file(limits={"deadline_s": 0.99 * plan.mission_time_s})
    hovers = plan.hover_time_s > 0.0  # Else the drone passes by, and serves nobody
    if hovers:
        yield "coverage", file(route={"hover_m": [hover_m[0] + 5e3, *hover_m[1:]]})
    if 0.0 < (soc := (plan.soc or {})["battery"]) < 0.98:  # None above what a battery holds
        yield "state of charge", file(limits={"min_soc": soc + 0.01})
    if hovers and hover_m[2] > 2.0:
        band = {"min_altitude_m": 0.0, "max_altitude_m": hover_m[2] - 1.0}
        yield "altitude", file(limits=band, route={"hover_m": hover_m})
    for number, phase in enumerate(plan.phases):
        if phase.kind == "flight":
            yield from broken_leg(mission, number, phase, points_of(phase, figures), file)
    lit = [
        figures.gain_A[phase.end_place]
        for phase in plan.phases
        if phase.kind != "flight" and phase.duration_s and figures.gain_A[phase.end_place] > 1e-3
    ]
    if lit and mission.receiver is not None and mission.receiver.radius_m is not None:
        dc_W = 0.5 * min(lit) * mission.battery.nominal_voltage_V
        area_m2 = math.pi * mission.receiver.radius_m**2
        yield "mismatch", file(receiver={"max_power_W": dc_W})
        yield "mismatch", file(receiver={"max_irradiance_W_m2": dc_W / area_m2})


def broken_leg(
    mission: Mission, number: int, phase: Any, points_m: Array, file: Any
) -> Iterator[tuple[str, dict[str, Any]]]:
    """The same for a leg: its speed, its ceiling, its clearance, and the building on its way."""
    cap, peak = mission.flight.max_speed_m_s, phase.peak_speed_m_s
    yield "mismatch", file(number, {"peak_speed_m_s": 1.01 * peak})
    if speeds := phase.speeds_m_s:
        faster = max(3.0 * speeds[0], cap + 10.0)
        yield "speed", file(number, {"speeds_m_s": [faster, *speeds[1:]]})
    elif mission.flight.model != "rotary-wing":
        yield "mismatch", file(flight={"max_speed_m_s": 0.9 * peak})
    if not phase.waypoints_m:
        return
    ends, top_m = (phase.start_place, phase.end_place), points_m[1:-1, 2].max()
    yield "altitude", file(flight={"max_altitude_m": max(float(top_m) - 1.0, 0.0)})
    wider_m = apart_m(mission) + 1.0
    if by_forces.too_near(mission, ends, points_m, wider_m):
        yield "clearance", file(flight={"clearance_m": wider_m})
    if by_forces.too_near(mission, ends, points_m[[0, -1]], 0.0):
        yield "building", file(number, {"waypoints_m": [], "speeds_m_s": list(speeds[:1])})


def solved(mission: Mission, problem: Any, perspective: Any) -> Plan | None:
    """The answer; None where a search says that it found neither a plan nor proof of none."""
    try:
        return optuav.solve(mission, problem, perspective=perspective)
    except SolverError as error:
        if "neither a plan nor proof" not in str(error):
            raise
        return None


def check(number: int) -> str:
    """Hold the plans of one mission against all oracles; a word for what came of it."""
    rng = np.random.default_rng(number)
    choice = choice_of(rng)
    mission, problem = mission_of(rng, choice), problem_of(rng, choice)
    figures, plans = Figures(mission), list[Plan]()
    turns, tapers = choice["battery"] in TURNING, choice["battery"] == "taper"
    for perspective in ("battery", "available"):
        if (plan := solved(mission, problem, perspective)) is None:
            return "unknown"
        plans.append(plan)
    for plan in plans:
        if not turns or plan.perspective == "battery":
            check_best(plan, figures, problem, rng)
            check_engines(plan, problem, rng)
        if plan:
            fly(plan, figures)
            # The end alone does not show an empty well, nor a full one that takes no more.
            blind = {"empty", "full", *(["state of charge"] if turns or tapers else [])}
            kinds = {event.kind for event in optuav.audit(plan).violations}
            assert kinds <= (blind if plan.perspective == "battery" else set()), kinds
            assert {event.kind for event in optuav.audit(plan.to_dict()).violations} == kinds
            cases = list(broken(plan, figures))
            for case in rng.permutation(len(cases))[:BROKEN]:
                kind, document = cases[case]
                assert kind in {event.kind for event in optuav.audit(document).violations}, kind
    if all(plans):
        assert plans[1].hover_time_s <= plans[0].hover_time_s + SAME_S
        if choice["flight"] == "free" and plans[1].bound is not None:
            assert plans[1].bound <= plans[0].hover_time_s + SAME_S
    if rng.random() < 0.5:
        slow = turns or choice["flight"] == "free" or choice["problem"] == "two stops"
        both = not slow or rng.random() < 0.2
        check_batch(mission, problem, ["battery", "available"][: 1 + both])
    return ("none", "one", "both")[sum(map(bool, plans))]


@settings(few(3), phases=[Phase.explicit, Phase.generate])
@pytest.mark.campaign
@given(st.integers(0, 10**9))
def test_all_options_go_together(number: int) -> None:
    """Engines, batch, replay, audit and the tests' own formulas agree."""
    check(number)
