"""Large missions: the routes that bounds leave out change nothing in the plan."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.arrays import Floats, Integers
from optuav.mission import Mission
from optuav.network import obstacles as sight
from optuav.network import ways
from optuav.network.network import build_network
from optuav.network.variants import Variants
from optuav.solving import promising_buildings as promising
from optuav.solving.program import best_plan, declared_program
from optuav.solving.question import Question, checked_question
from optuav.studies.scenarios import Scenarios
from tests.examples import few

KINDS: list[dict[str, Any]] = [{"perspective": each} for each in ("available", "battery", "energy")]
KINDS += [{"problem": optuav.P3()}, {"problem": optuav.P4("b2")}, {"perspective": "wells"}]
KINDS += [{"problem": optuav.P1(trajectory="direct")}, {"problem": optuav.P1(trajectory="traj1")}]
KINDS += [{"problem": optuav.P1(order="hover-first")}]


def town(seed: int) -> Mission:
    """Some 40 buildings, with walls or without; the deadline may be too short for any."""
    draw = np.random.default_rng(seed)
    count, turns = int(draw.integers(3, 40)), seed == 6
    count = 2 if turns else count
    table = {"name": [f"b{k}" for k in range(count)], "z_m": draw.uniform(20, 90, count)}
    table |= {"x_m": draw.uniform(0, 2000, count), "y_m": draw.uniform(0, 2500, count)}
    if walls := seed % 3:
        table |= dict.fromkeys(("width_m", "depth_m"), np.full(count, 40.0 * walls))
    return (
        optuav.load("paper")
        .replace(
            {
                "limits.deadline_s": float(draw.uniform(60, 2400)),
                "limits.min_soc": float(draw.choice([0.05, 0.3, 0.7])),
                "laser.power_W": float(draw.choice([0, 500, 3000])),
                "battery.charging": "taper" if seed % 5 == 4 else "constant",
                "battery.schedule": "sequential" if turns else "pooled",
                "flight.through_buildings": seed % 2 == 0,
                "link.transmit_power_W": 1e-6 if seed == 3 else 5.0,  # Out of reach
                "body.mass_kg": 100.0 if seed == 5 else 1.3,  # Too heavy
            }
        )
        .with_buildings(table)
    )


@pytest.mark.parametrize(
    "seed", [*range(8), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(8, 14))]
)
def test_the_plan_is_that_of_all_routes(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last digit and note, whatever the question, with bounds in small pieces."""
    mission = town(seed)
    kinds = KINDS[:2] if mission.battery.charging == "taper" else KINDS
    kinds = KINDS[:1] if mission.battery.takes_turns else kinds
    plans = [optuav.solve(mission, **kind).to_dict() for kind in kinds]
    monkeypatch.setattr(import_module("optuav.solving.solve"), "MANY", 0)
    monkeypatch.setattr(promising, "FIRST_ROUTES", 2)
    monkeypatch.setattr(promising, "BUILDINGS_AT_ONCE", 7)
    assert [optuav.solve(mission, **kind).to_dict() for kind in kinds] == plans


def test_walls_in_the_way_of_the_best_roofs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounds know of no walls between places: towns where few routes, some or none are free.

    Also where the leg that all routes of an order share is blocked.
    """
    monkeypatch.setattr(promising, "FIRST_ROUTES", 1)
    shared, phases = set[tuple[bool, ...]](), set[int]()
    for seed in (*range(20), 39, 72, 79, 224):  # The last four need more than the first roofs
        draw = np.random.default_rng([7, seed])
        count = 25
        table = {"name": [f"b{k}" for k in range(count)], "z_m": draw.uniform(20, 110, count)}
        table |= {"x_m": draw.uniform(0, 2000, count), "y_m": draw.uniform(200, 2400, count)}
        table |= dict.fromkeys(
            ("width_m", "depth_m"), draw.uniform(20, 60.0 + 10 * (seed % 24), count)
        )
        deadline_s = float(draw.choice([70, 75, 90, 1200, 2400]))
        mission = optuav.load("paper").replace({"limits.deadline_s": deadline_s})
        mission = mission.with_buildings(table)
        for perspective in ("available", "battery"):
            with monkeypatch.context() as patch:
                patch.setattr(import_module("optuav.solving.solve"), "MANY", 0)
                found = optuav.solve(mission, perspective=perspective)
            assert found.to_dict() == optuav.solve(mission, perspective=perspective).to_dict()
            phases.add(len(found.phases))
        legs = build_network(mission).legs
        shared.add(tuple(legs.flyable[:2].tolist()))
    assert phases == {0, 3, 5}
    assert shared >= {(True, True), (True, False), (False, True)}


@pytest.mark.parametrize("rule", ["over", "around"])
def test_bent_legs_of_routes_in_question_only(rule: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Plans, notes and reasons of towns whose walls bend most legs, or close some or all routes.

    Also in a wind, and where no route is in time.
    """
    phases = set[int]()
    for seed in range(6):
        draw = np.random.default_rng([46, seed])
        count = 14
        table = {"name": [f"b{k}" for k in range(count)], "z_m": draw.uniform(20, 110, count)}
        table |= {"x_m": draw.uniform(0, 2000, count), "y_m": draw.uniform(200, 2400, count)}
        table |= dict.fromkeys(("width_m", "depth_m"), draw.uniform(40, 250, count))
        keys: dict[str, Any] = {
            "flight.obstacles": rule,
            "flight.max_altitude_m": float(draw.choice([70.0, 150.0])),
            "limits.deadline_s": float(draw.choice([90, 1200, 2400])),
            "wind.force_N": [float(draw.uniform(-1, 1)), float(draw.uniform(-1, 1)), 0.0],
        }
        mission = optuav.load("paper").replace(keys).with_buildings(table)
        for perspective in ("available", "battery"):
            with monkeypatch.context() as patch:
                patch.setattr(import_module("optuav.solving.solve"), "MANY_BENT", 0)
                patch.setattr(promising, "FIRST_BENT", 1)
                found = optuav.solve(mission, perspective=perspective)
            plan = optuav.solve(mission, perspective=perspective)
            phases.add(len(found.phases))
            for name in ("status", "notes", "reasons", "proof"):
                assert getattr(found, name) == getattr(plan, name)
            if not plan:
                continue
            assert found.route == plan.route
            times_s = found.hover_time_s, found.rest_time_s, found.flight_time_s
            whole_s = plan.hover_time_s, plan.rest_time_s, plan.flight_time_s
            assert times_s == pytest.approx(whole_s, abs=1e-9)
    assert phases >= {0, 5}


def test_few_legs_of_a_town_are_bent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Less than half of the lines that walls block, with the same plan."""
    draw, count = np.random.default_rng(1), 200
    table = {"name": [f"b{k}" for k in range(count)], "z_m": draw.uniform(30, 100, count)}
    table |= {"x_m": draw.uniform(0, 2000, count), "y_m": draw.uniform(0, 2000, count)}
    table |= dict.fromkeys(("width_m", "depth_m"), np.full(count, 30.0))
    mission = optuav.load("paper").replace({"flight.obstacles": "around"}).with_buildings(table)
    bent, around = list[int](), ways.Fences.around

    def counted(fences: ways.Fences, *line: Any) -> Any:
        bent.append(1)
        return around(fences, *line)

    monkeypatch.setattr(ways.Fences, "around", counted)
    found, some = optuav.solve(mission, perspective="battery"), len(bent)
    network = build_network(mission)
    assert some < 0.4 * (len(bent) - some)
    plan = declared_program(checked_question(mission, perspective="battery"), network).solve()
    assert (found.route, found.hover_time_s) == (plan.route, plan.hover_time_s)


@pytest.mark.parametrize(
    ("name", "changes", "expected"),
    [
        ("paper", {"wind.force_N": [3.0, 1.0, 0.0]}, True),
        ("matrice350", {}, True),
        ("relay-today", {"wind.velocity_m_s": [12.0, 0.0, 0.0]}, True),
        ("relay-today", {"flight.speed": "max"}, False),
        ("paper-drag", {}, False),
    ],
)
def test_straight_legs_bound_bent_ones(name: str, changes: Any, expected: bool) -> None:
    """Where a model says so, a stop costs time and charge; else towns bend every leg.

    At the largest speed, a stop saves up to 16 % of the charge, as it keeps the drone slower.
    """
    mission = optuav.load(name).replace({"flight.obstacles": "around", **changes})
    model, draw = mission.flight_model, np.random.default_rng(7)
    assert model.straight_is_least == expected
    way_m, stop_m = draw.uniform(-1500.0, 1500.0, (2, 2, 2000))
    straight, first, second = (
        model.leg((x, y, 0.0 * x)) for x, y in (way_m, stop_m, way_m - stop_m)
    )
    if expected:
        for figure in ("charge_As", "duration_s"):
            both = getattr(first, figure) + getattr(second, figure)
            assert (both >= getattr(straight, figure)).all()
    else:
        assert promising.promising_network(mission, checked_question(mission)) is None


def test_most_routes_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """And routes that bounds do not exclude are added to the first ones until none is open."""
    mission = optuav.load("paper").replace({"limits.deadline_s": 2000})
    question = checked_question(mission)
    monkeypatch.setattr(promising, "FIRST_ROUTES", 1)
    network = promising.promising_network(mission, question)
    assert network is not None
    assert len(network.routes) < 21
    assert best_plan(question, network).phases == optuav.solve(mission).phases
    shared = np.zeros(20)
    monkeypatch.setattr(
        promising, "_bounds_s", lambda *_: np.stack([shared + np.inf, *3 * [shared]])
    )
    everything = promising.promising_network(mission, question)
    assert everything is not None
    assert len(everything.routes) == 21


@pytest.mark.campaign
@few(4, 100)
@given(seed=st.integers(0, 10_000))
def test_few_routes_give_the_plans_of_all_routes(seed: int) -> None:
    """In every variant, whatever varies: no route that is left out is the best in any of them."""
    draw, count = np.random.default_rng(seed), 24
    roofs = {"x_m": (200.0, 2000.0), "y_m": (800.0, 2900.0), "z_m": (20.0, 90.0)}
    table = {name: draw.uniform(*ends, 30) for name, ends in roofs.items()}
    if seed % 2:
        table |= dict.fromkeys(("width_m", "depth_m"), np.full(30, 60.0))
    names = [f"b{k}" for k in range(30)]
    mission = optuav.load("paper").with_buildings({"name": names, **table})
    values = {
        "limits.deadline_s": draw.uniform(300.0, 2400.0, count),
        "battery.capacity_As": draw.uniform(10e3, 45e3, count),
        "battery.available_fraction": draw.uniform(0.3, 0.9, count),
        "battery.flow_rate_per_s": draw.choice([0.0, 4.5e-5, 1e-3, 1e-2], count),
        "body.mass_kg": draw.uniform(1.0, 1.5, count),
        "body.inertia_x_kg_m2": draw.uniform(0.001, 0.3, count),
        "wind.force_N[0]": draw.uniform(-2.0, 2.0, count),
        "laser.power_W": draw.uniform(0.0, 3000.0, count),
        "link.device_m[0]": draw.uniform(500.0, 1500.0, count),
        "link.transmit_power_W": draw.uniform(0.5, 8.0, count),
    }
    known = optuav.batch_arrays(mission, values, paired=True)
    with pytest.MonkeyPatch.context() as patched:
        for name, value in {
            "FIRST_ROUTES": 4,
            "RARE": 1.0,
            "BUILDINGS_AT_ONCE": 40,
            "BOUNDED": 100,
        }.items():
            patched.setattr(promising, name, value)
        patched.setattr(import_module("optuav.studies.batch"), "TRIED", 7)
        patched.setattr(import_module("optuav.studies.scenarios"), "ITINERARIES_AT_ONCE", 80)
        found = optuav.batch_arrays(mission, values, paired=True)
    for name, each in known.items():
        np.testing.assert_array_equal(found[name], each, err_msg=name)


def anywhere(seed: int, count: int = 40) -> tuple[Mission, dict[str, Floats]]:
    """A mission among random buildings, and variants whose device and laser are elsewhere."""
    draw, variants = np.random.default_rng([11, seed]), 12
    mission = optuav.load(("paper", "relay-today", "paper-drag")[seed % 3])
    assert mission.laser is not None
    device_m, laser_m = mission.link.device_m, mission.laser.position_m
    middle_m = {"x_m": device_m[0], "y_m": device_m[1]}
    table = {name: at_m + draw.uniform(-900.0, 900.0, count) for name, at_m in middle_m.items()}
    table |= {name: draw.uniform(5.0, 60.0, count) for name in ("width_m", "depth_m", "z_m")}
    values = {
        "link.device_m[0]": device_m[0] + draw.uniform(-200.0, 200.0, variants),
        "laser.position_m[0]": laser_m[0] + draw.uniform(-400.0, 400.0, variants),
        "laser.position_m[1]": laser_m[1] + draw.uniform(-400.0, 400.0, variants),
        "limits.deadline_s": draw.choice([200.0, 900.0, 2400.0], variants),
        "battery.flow_rate_per_s": draw.choice([4.5e-5, 4.5e-5, 1e-2], variants),
    }
    return mission.with_buildings({"name": [f"b{k}" for k in range(count)], **table}), values


@pytest.mark.parametrize(
    ("seed", "tried", "share"), [(0, 5, 0.5), (1, 64, 1.0), (2, 5, 1.0), (3, 64, 0.5)]
)
def test_variants_in_a_town_have_the_plans_of_a_loop(seed: int, tried: int, share: float) -> None:
    """Whatever moves: those of single solves, and to the last bit those over all routes."""
    mission, values = anywhere(seed)
    known = optuav.batch_arrays(mission, values, paired=True)
    with pytest.MonkeyPatch.context() as patched:
        small = {
            "FIRST_ROUTES": 2,
            "MANY_BUILDINGS": 0,
            "BUILDINGS_AT_ONCE": 40,
            "BOUNDED": 100,
            "SHARE": share,
        }
        for name, value in small.items():
            patched.setattr(promising, name, value)
        patched.setattr(import_module("optuav.studies.batch"), "TRIED", tried)
        found = optuav.batch_arrays(mission, values, paired=True)
    for name, each in known.items():
        np.testing.assert_array_equal(found[name], each, err_msg=name)
    for row in range(0, 12, 5):
        one = {key: each[row : row + 1] for key, each in values.items()}
        (alone,) = Scenarios(mission, one).missions(0, 1)
        assert isinstance(alone, Mission)
        plan = optuav.solve(alone)
        hover_s = plan.hover_time_s if plan else math.nan
        assert found["hover_time_s"][row] == pytest.approx(hover_s, abs=2e-6, nan_ok=True)


def test_bounds_leave_few_buildings_to_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 60 lasers by 300 buildings, less than a fifth of all routes and of all lines of sight."""
    town, _ = anywhere(0, 300)
    lines, routes, solve, crossed = list[int](), list[int](), promising._numbered, sight.crossed

    def counted(*each: Any) -> Integers:
        lines.append(len(each[1]))
        return crossed(*each)

    def numbered(variants: Variants, question: Question) -> dict[str, Any]:
        routes.append(variants.count * len(variants.network.routes))
        return solve(variants, question)

    draw, places = np.random.default_rng(5), build_network(town).places
    lasers_m = {f"laser.position_m[{axis}]": draw.uniform(0.0, 2000.0, 60) for axis in (0, 1)}
    monkeypatch.setattr(promising, "_numbered", numbered)
    monkeypatch.setattr(sight, "crossed", counted)
    few = promising.few_near(town, places, 10)
    best = promising.best_plans_or_all(Variants(few, lasers_m), places, checked_question(town))
    assert (best.route > 0).all()
    assert sum(routes) < 0.2 * 60 * 601
    assert sum(lines) < 0.2 * 60 * 303
