"""The speeds of legs as unknowns: against grids, named speeds, CasADi and the judge."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav import Mission
from optuav.engines.registry import engine
from tests.examples import few
from tests.mission.test_flights import WINGED
from tests.solving.by_speed import balanced_s, delivered_s, grid, route, winged

RULES = ("best-range", "best-endurance", "max")
ANY, DIRECT = optuav.P1(speed="free"), optuav.P3(speed="free")
ROUTES = [(None, False), ("b1", True), ("b1", False), ("b2", True), ("b2", False)]


def ways(mission: Mission) -> list[tuple[str | None, bool]]:
    """The routes of (P1) with at most one building."""
    known = (None, *mission.buildings.names)
    return [each for each in ROUTES if each[0] in known]


def refined(mission: Mission, way: tuple[str | None, bool], hover_s: Any, count: int) -> float:
    """The longest hover on a route over all speeds, by grids ever closer around the best."""
    points = grid(mission, route(mission, *way), count)
    low, high = points.min(axis=1), points.max(axis=1)
    top, best = points.max(axis=1), high
    found = -math.inf
    for _ in range(7):
        values = hover_s(mission, *way, points)
        if values.max() > found:
            found, best = float(values.max()), points[:, values.argmax()]
        step = (high - low) / (count - 1)
        low, high = np.maximum(best - 1.5 * step, 0.05 * top), np.minimum(best + 1.5 * step, top)
        axes = np.meshgrid(*map(np.linspace, low, high, [count] * len(low)))
        points = np.array([axis.ravel() for axis in axes])
    return found


def free(mission: Mission, problem: Any = ANY, **options: Any) -> optuav.Plan:
    """The plan with free speeds, which the judge flies to the same place, speed and charge."""
    plan = optuav.solve(mission, problem, **options)
    if not plan:
        return plan
    audited = optuav.audit(plan)
    allowed = {"empty", "full"}  # Other perspectives do not see the available well, nor charge
    allowed |= {"state of charge"} if plan.perspective in ("energy", "adjusted") else set()
    assert {event.kind for event in audited.replay.violations} <= allowed
    for phase, flown in zip(plan.phases, audited.replay.phases, strict=True):
        assert flown.speeds_m_s == phase.speeds_m_s
        assert flown.duration_s == pytest.approx(phase.duration_s, rel=1e-12)
    return plan


@few(200)
@given(winged())
def test_no_speed_of_a_grid_is_better(mission: Mission) -> None:
    """(P1) under `battery` is proved optimal, and no speeds of any route hover longer."""
    plan = free(mission, perspective="battery")
    truth = -math.inf
    for way in ways(mission):
        points = grid(mission, route(mission, *way), 15 if way[0] is None else 6)
        truth = max(truth, float(balanced_s(mission, *way, points).max()))
    if plan:
        assert plan.status == "optimal"
        assert plan.proof.startswith("priced")
        assert plan.hover_time_s >= truth - 1e-6
    else:
        assert truth == -math.inf


@few(10)
@given(winged())
def test_as_good_as_all_speeds_and_better_than_named_ones(mission: Mission) -> None:
    """The same as grids ever closer around the best, and never worse than a rule."""
    plan = free(mission, perspective="battery")
    truth = max(refined(mission, w, balanced_s, 15 if w[0] is None else 7) for w in ways(mission))
    assert (plan.hover_time_s if plan else -math.inf) == pytest.approx(truth, abs=0.02)
    for rule in RULES:
        named = optuav.solve(mission.replace({"flight.speed": rule}), perspective="battery")
        assert not named or plan.hover_time_s >= named.hover_time_s - 1e-6


@few(10)
@given(winged(), st.sampled_from(["energy", "adjusted"]))
def test_the_argument_holds_in_power(mission: Mission, perspective: Any) -> None:
    """Charge at the nominal voltage is energy; against a stated energy it counts more."""
    plan = free(mission, DIRECT, perspective=perspective)
    for rule in RULES:
        named = optuav.solve(mission.replace({"flight.speed": rule}), "P3", perspective=perspective)
        assert not named or plan.hover_time_s >= named.hover_time_s - 1e-6
    own = mission.battery.packs * mission.battery.capacity_As * mission.battery.nominal_voltage_V
    stated = mission.replace({"battery.flight_energy_J": 0.9 * own})
    less = free(stated, DIRECT, perspective="adjusted")
    if less and plan:
        assert less.status == "optimal"
        assert less.hover_time_s <= plan.hover_time_s + 1e-9


@few(12)
@given(winged())
def test_under_available_the_search_is_between_grid_and_bound(mission: Mission) -> None:
    """No named speed and no speed of a grid hovers longer, by wells of the tests' own."""
    plan = free(mission)
    named = [optuav.solve(mission.replace({"flight.speed": rule})) for rule in RULES]
    longest = max((each.hover_time_s for each in named if each), default=-math.inf)
    truth = delivered_s(mission, None, False, grid(mission, [0, 1, 2], 12)).max()
    for way in ways(mission)[1:]:
        points = grid(mission, route(mission, *way), 4)
        truth = max(truth, delivered_s(mission, *way, points).max())
    if not plan:
        assert longest == truth == -math.inf
        return
    assert plan.flyable
    assert plan.hover_time_s >= max(longest, truth) - 1e-6
    if plan.status == "optimal":
        assert plan.bound is None
    else:
        assert plan.status == "locally_optimal"
        assert plan.bound is not None
        assert plan.bound >= plan.hover_time_s


@few(4)
@given(winged())
def test_under_available_the_direct_route_is_as_good_as_all_speeds(mission: Mission) -> None:
    """Within 0.01 s of grids ever closer around the best, and the bound is above them."""
    plan = free(mission, DIRECT)
    truth = refined(mission, (None, False), delivered_s, 15)
    assert (plan.hover_time_s if plan else -math.inf) == pytest.approx(truth, abs=0.01)
    assert not plan or plan.bound is None or plan.bound >= truth - 1e-6


@pytest.mark.parametrize("perspective", ["battery", "available"])
@pytest.mark.parametrize(
    ("deadline_s", "capacity_As", "problem"),
    [
        (700.0, 9000.0, optuav.P3(speed="free")),
        (3000.0, 9000.0, optuav.P3(speed="free")),
        (900.0, 5000.0, optuav.P4("b1", speed="free")),
        (900.0, 5000.0, optuav.P4("b1", order="hover-first", speed="free")),
    ],
)
def test_casadi_solves_the_declared_program(
    perspective: Any, deadline_s: float, capacity_As: float, problem: Any
) -> None:
    """One program with a speed a leg, which CasADi takes as it is."""
    mission = WINGED.replace({"limits.deadline_s": deadline_s, "flight.through_buildings": True})
    mission = mission.replace({"battery.capacity_As": capacity_As})
    plan = free(mission, problem, perspective=perspective)
    program = optuav.formulate(mission, problem, perspective=perspective)
    assert program.engines == ("casadi",)
    found = [engine("casadi").solve(part.model, len(part.routes)) for part in program.parts]
    best = max(float(np.nanmax(each.objective)) for each in found)
    assert plan.hover_time_s == pytest.approx(best, abs=1e-4)


def test_the_program_is_printed_as_mathematics() -> None:
    text = str(optuav.formulate(WINGED, DIRECT, perspective="battery"))
    assert "V_j ∈ [V^min_j, V^max_j] m/s" in text
    assert "d_j/V_j + V_j/2" in text
    assert "√(√(1 + " in text
    assert r"\sqrt" in optuav.formulate(WINGED, DIRECT).to_latex()


def test_prices_of_a_second() -> None:
    """μ is 0 where charge alone binds, the rest current with a rest, and else between."""
    from optuav.network.network import build_network
    from optuav.solving.leg_speeds import LegSpeeds, route_prices

    mission = WINGED.replace({"battery.capacity_As": 5000.0, "flight.through_buildings": True})
    ample_s = free(mission.replace({"limits.deadline_s": 1e4}), DIRECT, perspective="battery")
    for share, low, high in ((2.0, 0.0, 0.0), (0.97, 1e-3, 1e3), (0.6, math.inf, math.inf)):
        limited = mission.replace({"limits.deadline_s": share * ample_s.mission_time_s})
        found = route_prices(LegSpeeds(build_network(limited)), np.array([0]), "battery")
        assert low <= found.price_A[0] <= high
    network = build_network(mission.replace({"limits.deadline_s": 1e4}))
    found = route_prices(LegSpeeds(network), np.array([1]), "battery")
    assert found.price_A[0] == pytest.approx(network.places.charge_current_A[3], rel=1e-12)
    assert found.price_A[0] > 0.5
