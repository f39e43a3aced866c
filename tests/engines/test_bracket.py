"""The engine bracket against dense grids, against integration, and where monotony ends."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import optuav
from formulations.p4 import P4
from optuav.engines import bracket
from optuav.engines.bracket import WIDTH_S
from optuav.modelling import check
from optuav.physics.kibam import Battery, Stage
from optuav.solving.longest import Hovers, longest_hovers
from tests.examples import few
from tests.formulations.given import quantities
from tests.kibam import Floats, Kibam

PAPER = optuav.load("paper")
INSIDE = 1e-9
"""Share of the capacity that the oracle forgives."""


def solve(mission: optuav.Mission, problem: str = "P1", **options: Any) -> optuav.Plan:
    return optuav.solve(mission, problem, perspective="available", **options)


@pytest.mark.parametrize("deadline_s", [800.0, 1200.0])
def test_direct_flight_of_paper(deadline_s: float) -> None:
    """577.524 s: what the available well admits, at both deadlines."""
    plan = solve(PAPER.replace({"limits.deadline_s": deadline_s}), "P3")
    assert plan.engine == "bracket"
    assert plan.hover_time_s == pytest.approx(577.524, abs=5e-4)


@pytest.mark.parametrize("building", ["b9", "b10"])
def test_best_single_rest_of_paper(building: str) -> None:
    """597.270 s, hover first by b9 and b10 alike; the mission's own optimum is this."""
    plan = solve(PAPER, optuav.P4(building, order="hover-first"))
    assert plan.hover_time_s == pytest.approx(597.270, abs=5e-4)
    assert solve(PAPER).hover_time_s == pytest.approx(plan.hover_time_s, abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "longest_s", "shortest_s"),
    [
        (
            {
                "battery.charge_current_A": 90,
                "laser.power_W": 12000,
                "battery.available_fraction": 0.09,
                "battery.flow_rate_per_s": 2.815e-4,
            },
            678.1,
            327.5,
        ),
        (
            {"battery.charge_current_A": 120, "laser.power_W": 12000, "limits.min_soc": 0.9},
            176.4,
            29.1,
        ),
    ],
    ids=["recovery", "charging in the air"],
)
def test_longer_hovers_may_be_feasible_where_shorter_ones_are_not(
    keys: dict[str, Any], longest_s: float, shortest_s: float
) -> None:
    """Direct: from 327.5 to 678.3 s, and from 29.1 to 176.5 s; what halving from 0 would miss."""
    mission = PAPER.replace(keys)
    plan = solve(mission, "P3")
    assert plan.status == "optimal"
    seconds = np.arange(0.0, 1124.0, 0.05)
    holds = direct(mission, seconds)
    assert plan.hover_time_s == pytest.approx(float(seconds[holds].max()), abs=0.05 + 1e-6)
    assert plan.hover_time_s == pytest.approx(longest_s, abs=0.25)
    assert seconds[holds].min() == pytest.approx(shortest_s, abs=0.25)
    assert not holds[0]


def test_the_shortest_rest_may_be_the_best() -> None:
    """Rest first on b9, where hovering charges: 106.0 s at T' = 0, 48.7 s at 20 s, none at 30 s."""
    mission = PAPER.replace({"battery.charge_current_A": 150, "laser.power_W": 15000})
    plan = solve(mission, optuav.P4("b9", order="rest-first"))
    assert (plan.rest_time_s, plan.status) == (0.0, "optimal")
    assert plan.hover_time_s == pytest.approx(106.0, abs=0.05)
    (part,) = optuav.formulate(
        mission, optuav.P4("b9", order="rest-first"), perspective="available"
    ).parts
    seconds = np.arange(0.0, 1100.0, 0.01)
    for rest_s, expected_s in ((20.0, 48.7), (30.0, None)):
        rows = keeps_all(part, seconds, rest_s)
        found = seconds[rows].max() if rows.any() else None
        assert found == (None if expected_s is None else pytest.approx(expected_s, abs=0.05))


def keeps_all(part: Any, hover_s: Floats, rest_s: float) -> Any:
    """Which hovers satisfy every declared constraint at a rest time."""
    point = {**part.model.row(0), "hover_time_s": hover_s, "rest_time_s": rest_s}
    holds = np.ones(hover_s.shape, bool)
    for row in check(part.model, point):
        holds &= row.satisfied
    return holds


def direct(mission: optuav.Mission, hover_s: Floats) -> Any:
    """Which hovers of the direct flight the battery delivers, with 40 looks a stretch."""
    plan = optuav.solve(mission, "P3", perspective="battery")
    battery = mission.battery
    wells = Kibam(
        battery.packs * battery.capacity_As, battery.available_fraction, battery.flow_rate_per_s
    )
    flown_s = 0.0
    for phase in plan.phases:
        for stage in phase.stages:
            hovering = phase.kind == "hover"
            wells.spend(stage.current_A, hover_s if hovering else stage.duration_s, 40)
            flown_s += 0.0 if hovering else stage.duration_s
    full = battery.available_fraction
    kept = (wells.least >= -INSIDE) & (wells.most <= full + INSIDE)
    enough = wells.soc >= mission.limits.min_soc - INSIDE
    return kept & enough & (hover_s <= mission.limits.deadline_s - flown_s)


# Random itineraries


def figures(rng: np.random.Generator) -> dict[str, Any]:
    """Legs, stays and battery of one itinerary, from hopeless to plenty."""
    stays = rng.choice(["hover", "rest-first", "hover-first"])
    hover_A = rng.uniform(5.0, 120.0) * rng.choice([1.0, 1.0, 1.0, 0.02, -0.3])
    horizon_s = 10.0 ** rng.uniform(1.0, 3.6)
    legs = [
        [
            Stage(-rng.uniform(0.2, 1.5) * max(abs(hover_A), 5.0), 0.02 * horizon_s * rng.random())
            for _ in range(rng.integers(1, 4))
        ]
        for _ in range(2 if stays == "hover" else 3)
    ]
    return {
        "legs": legs,
        "stays": str(stays),
        "deadline_s": horizon_s,
        "min_soc": float(rng.choice([0.0, 0.05, rng.uniform(0.0, 0.98)])),
        "capacity_As": max(abs(hover_A), 5.0) * horizon_s * 10.0 ** rng.uniform(-2.0, 0.5),
        "available_fraction": rng.uniform(0.05, 0.95),
        "flow_rate_per_s": 10.0 ** rng.uniform(-7.0, -1.5),
        "hover_current_A": hover_A,
        "rest_current_A": float(rng.choice([0.0, rng.uniform(0.0, 1.5) * abs(hover_A), -0.5])),
    }


def delivered(case: dict[str, Any], hover_s: Floats, rest_s: Floats, looks: int = 1) -> Any:
    """Which pairs of times the battery delivers within the deadline, by the tests' own wells."""
    wells = Kibam(case["capacity_As"], case["available_fraction"], case["flow_rate_per_s"])
    wells.y1 = wells.y1 + np.zeros(np.broadcast(hover_s, rest_s).shape)
    times = {"hover": (-case["hover_current_A"], hover_s), "rest": (case["rest_current_A"], rest_s)}
    used_s = hover_s + (0.0 if case["stays"] == "hover" else rest_s)
    for leg, stay in zip(case["legs"], [*ORDERS[case["stays"]], None], strict=True):
        for phase in leg:
            wells.spend(phase.current_A, phase.duration_s, looks)
            used_s = used_s + phase.duration_s
        if stay:
            wells.spend(*times[stay], looks)
    kept = (wells.least >= -INSIDE) & (wells.most <= case["available_fraction"] + INSIDE)
    in_time = used_s <= case["deadline_s"] * (1.0 + 1e-11) + 1e-9
    return kept & in_time & (wells.soc >= case["min_soc"] - INSIDE)


ORDERS = {"hover": ["hover"], "rest-first": ["rest", "hover"], "hover-first": ["hover", "rest"]}


def longest(case: dict[str, Any]) -> Hovers:
    """The answer to a case with legs and an order of stays, or with steps that it states."""
    cells = ("capacity_As", "available_fraction", "flow_rate_per_s")
    others = {k: v for k, v in case.items() if k not in (*cells, "legs", "stays", "steps")}
    pairs = zip(case["legs"], [*([each] for each in ORDERS[case["stays"]]), []], strict=True)
    steps = case.get("steps") or [step for leg, stay in pairs for step in (*leg, *stay)]
    battery = Battery(*(case[name] for name in cells))
    return longest_hovers(steps, **others, battery=battery, shortest_rest=True)


def agree(case: dict[str, Any]) -> bool:
    """The bracket of a case holds against a dense grid; whether there is an answer."""
    found = longest(case)
    hover_s, rest_s, beyond_s = (float(each) for each in found)
    horizon_s = case["deadline_s"]
    if not math.isnan(hover_s):
        assert delivered(case, np.array(hover_s), np.array(rest_s), 50), case
        assert beyond_s >= hover_s
    shares = np.concatenate([[0.0], np.geomspace(1e-4, 1.0, 60), np.linspace(0.01, 1.0, 120)])
    rests = np.array([0.0]) if case["stays"] == "hover" else horizon_s * np.sort(shares)
    beyond = max(beyond_s, 0.0) if beyond_s > -math.inf else -1e-9
    margin_s = 1e-6 * horizon_s
    longer = np.linspace(beyond + margin_s, max(horizon_s, beyond + 2.0 * margin_s), 150)
    assert not delivered(case, longer[:, None], rests[None]).any(), case
    return not math.isnan(hover_s)


@settings(few(10), suppress_health_check=[HealthCheck.too_slow])
@pytest.mark.campaign
@given(seed=st.integers(0, 2**32 - 1))
def test_both_ends_of_the_bracket(seed: int) -> None:
    """The answer is delivered, looked at 50 times a stretch; nothing beyond the other end is."""
    agree(figures(np.random.default_rng(seed)))


def test_cases_are_neither_all_hopeless_nor_all_easy() -> None:
    """Of 40 random itineraries a third at least have an answer, a tenth have none; all proved."""
    cases = [figures(np.random.default_rng(seed)) for seed in range(40)]
    found = [longest(case) for case in cases]
    answered = np.array([not math.isnan(each.hover_time_s) for each in found])
    assert 0.33 < answered.mean() < 0.9
    assert all(each.proved for each in found)


def test_a_rest_that_costs_next_to_nothing() -> None:
    """2e-309 A, found by the campaign: the bound that it puts on T' overflows, and is none."""
    leg = Stage(-5.0, 10.0)
    steps = (leg, "hover", leg, "rest", leg)
    wells = {"available_fraction": 0.9, "flow_rate_per_s": 1.0}
    given = quantities(rest_current_A=-2.2e-309, steps=steps, **wells)
    found = bracket.solve(P4("b1").model(given, "available"), 1)
    nothing = bracket.solve(P4("b1").model(replace(given, rest_current_A=0.0), "available"), 1)
    assert found.point(0) == nothing.point(0)


@pytest.mark.parametrize("seed", [3764, pytest.param(1372, marks=pytest.mark.soak)])
def test_a_narrow_gap_between_two_limits(seed: int) -> None:
    """Charged enough and not past full, with next to no room between: still answered and proved."""
    case = figures(np.random.default_rng(seed))
    assert agree(case)
    assert longest(case).proved


def test_many_at_once_are_each_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Arrays over legs and stays, in chunks, give to the last bit what each entry gives.

    Some are charged and some drained while they rest, and while they hover.
    """
    monkeypatch.setattr("optuav.solving.longest.ITINERARIES_AT_ONCE", 100)
    case = figures(np.random.default_rng(7)) | {"stays": "hover-first", "min_soc": 0.1}
    rng = np.random.default_rng(1)
    case["legs"] = [[Stage(-30.0, 20.0 * rng.random(150))] for _ in range(3)]
    stays_A = {"hover_current_A": (-5.0, 40.0), "rest_current_A": (-5.0, 10.0)}
    case |= {name: rng.uniform(*ends, 150) for name, ends in stays_A.items()}
    case |= {"capacity_As": 20000.0, "deadline_s": 900.0, "available_fraction": 0.5}
    case["flow_rate_per_s"] = 1e-4
    found = longest(case)
    assert found.proved.all()
    for index in (*range(12), 99, 100, 149):
        alone = case | {name: case[name][index] for name in stays_A}
        alone["legs"] = [[Stage(-30.0, leg[0].duration_s[index])] for leg in case["legs"]]
        assert longest(alone).hover_time_s == found.hover_time_s[index]


@pytest.mark.parametrize("legs", [[[], []], [[], [], []]])
def test_hovering_where_one_takes_off(legs: list[list[Stage]]) -> None:
    """Without a single stage of flight: 10 000 A s at 10 A, and no gain by resting at 0 A."""
    case = {"legs": legs, "stays": "hover" if len(legs) == 2 else "rest-first", "min_soc": 0.5}
    case |= {"deadline_s": 1e4, "capacity_As": 20000.0, "available_fraction": 0.9}
    case |= {"flow_rate_per_s": 1.0, "hover_current_A": np.full(2, 10.0)}
    found = longest(case)
    assert found.proved.all()
    assert found.hover_time_s == pytest.approx([1000.0, 1000.0], abs=WIDTH_S)


def test_legs_that_charge_are_refused() -> None:
    """Whether they pass full on the way is not asked, so an answer with them was no proof."""
    case = figures(np.random.default_rng(3)) | {"stays": "hover"}
    case["legs"] = [[Stage(-10.0, 10.0), Stage(20.0, 300.0)], [Stage(-10.0, 100.0)]]
    with pytest.raises(optuav.InputError, match=r"current of step 2 = 20: .*<= 0"):
        longest(case)


def test_faults_of_the_arrays_are_told_at_once() -> None:
    case = figures(np.random.default_rng(3)) | {"deadline_s": math.nan}
    case["steps"] = [Stage(np.array([-1.0, -2.0]), np.ones(3)), "rest"]
    with pytest.raises(optuav.InputError) as error:
        longest(case)
    assert {fault.key for fault in error.value.faults} >= {"steps", "shapes", "deadline_s"}


def test_figures_out_of_range_are_told_at_once() -> None:
    """An endless deadline, or one of 1e28 s, ended in a false proof."""
    case = figures(np.random.default_rng(3))
    case["steps"] = [Stage(-1.0, np.array([1.0, -2.0])), "hover", Stage(math.inf, 1.0)]
    case |= {"deadline_s": 1e28, "min_soc": 1.5, "available_fraction": 1.0}
    case |= {"capacity_As": np.array([1.0, 0.0]), "flow_rate_per_s": -1.0}
    case |= {"rest_current_A": np.array([1e15, 0.0]), "hover_current_A": -math.inf}
    with pytest.raises(optuav.InputError) as error:
        longest(case)
    assert {fault.key: fault.value for fault in error.value.faults} == {
        "deadline_s": "1e+28",
        "min_soc": "1.5",
        "capacity_As": "0",
        "available_fraction": "1",
        "flow_rate_per_s": "-1",
        "hover_current_A": "-inf",
        "rest_current_A": "1e+15",
        "steps: duration of step 1": "-2",
        "steps: current of step 3": "inf",
    }


def test_a_single_stage_out_of_range_among_many_is_named() -> None:
    case = figures(np.random.default_rng(3))
    case["steps"] = [Stage(-1.0, np.append(np.ones(9000), -3.0)), "hover"]
    with pytest.raises(optuav.InputError, match="duration of step 1 = -3: must be a number, 0 <"):
        longest(case)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"deadline_s": "soon"}, "deadline_s = 'soon': must be a number, or an array of numbers"),
        ({"steps": ["hover", Stage("fast", 1.0)]}, "current of step 2 = 'fast': must be a number"),
        (
            {"deadline_s": np.ones(2), "min_soc": np.zeros(3)},
            r"\(2,\) of deadline_s, \(3,\) of min_s",
        ),
        (
            {"min_soc": np.array([]), "capacity_As": -1.0},
            "capacity_As = -1: must be a number, 0.001 <= x",
        ),
    ],
)
def test_what_cannot_be_read_is_named(keys: dict[str, Any], words: str) -> None:
    steps = [Stage(-1.0, 1.0), "hover", Stage(-1.0, 1.0)]
    case = figures(np.random.default_rng(3)) | {"steps": steps, "deadline_s": 100.0} | keys
    with pytest.raises(optuav.InputError, match=words):
        longest(case)


@pytest.mark.parametrize(
    "steps",
    [["loiter"], ["rest"], [Stage(-1.0, 1.0)], ["hover", "hover"], ["hover", "rest", "rest"], [[]]],
)
def test_steps_are_stages_one_hover_and_at_most_one_rest(steps: list[Any]) -> None:
    with pytest.raises(optuav.InputError, match='stages of flight, one "hover" and at most one'):
        longest(figures(np.random.default_rng(3)) | {"steps": steps})


def test_no_itineraries_have_no_answers() -> None:
    case = figures(np.random.default_rng(3)) | {"deadline_s": np.array([])}
    assert all(each.shape == (0,) for each in longest(case))


# What the constraints are reduced to


@pytest.mark.parametrize("seed", range(12))
def test_ends_of_phases_suffice(seed: int) -> None:
    """Within a phase that starts in range, y1 leaves its range at the end or not at all."""
    rng = np.random.default_rng(seed)
    share, rate = rng.uniform(0.05, 0.95), 10.0 ** rng.uniform(-5, -1)
    y1, y2 = rng.random() * share, rng.random() * (1.0 - share)
    current = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-5, -2)

    def wells(_time: float, y: Floats) -> list[float]:
        flow = rate * (y[1] / (1.0 - share) - y[0] / share)
        return [current + flow, -flow]

    found = solve_ivp(wells, (0.0, 200.0), [y1, y2], rtol=1e-10, atol=1e-12, dense_output=True)
    times = np.linspace(0.0, 200.0, 4001)
    level = found.sol(times)[0]
    dry, past_full = level < -1e-9, level > share + 1e-9
    for outside in (dry, past_full):
        if outside.any():
            assert outside[np.argmax(outside) :].all()
    if current > 0.0:
        assert not dry.any()
    else:
        assert not past_full.any()
