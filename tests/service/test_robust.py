"""Robust plans: known figures, every corner and sample flown by Euler steps, refusals."""

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

import optuav
from optuav.errors import InputError, NoPlanError

LIT_A = 10.0
"""What the laser gives in `paper` at the hover point, as at the roofs: the cap. A rest draws 0."""


def flown(plan: optuav.Plan, drain: float, charge: float, **changes: float) -> tuple[float, ...]:
    """Least y1, largest y1/(ωB) at rest and the last charge share, by Euler steps of the KiBaM."""
    mission = plan.mission
    size = changes.get("size", 1.0)
    B, ω = size * mission.battery.packs * mission.battery.capacity_As, 0.8
    assert mission.battery.available_fraction == ω
    k_F = changes.get("flow", mission.battery.flow_rate_per_s)
    y1, y2 = ω * B, (1 - ω) * B
    least, fullest = math.inf, 0.0
    for phase in plan.phases:
        for stage in phase.stages:
            received_A = {"hover": LIT_A, "rest": stage.current_A}.get(phase.kind, 0.0)
            current_A = drain * (stage.current_A - received_A) + charge * received_A
            count = max(1, math.ceil(stage.duration_s / 0.02))
            dt = stage.duration_s / count
            for _ in range(count):
                flow = k_F * (y2 / (1 - ω) - y1 / ω)
                y1, y2 = y1 + dt * (flow + current_A), y2 - dt * flow
            least = min(least, y1)
        if phase.kind == "rest":
            fullest = max(fullest, y1 / (ω * B))
    return least, fullest, (y1 + y2) / B


def test_known_figures() -> None:
    """Those that independent code found; one vertex alone says 502.491 s and would overfill."""
    box = {"drain": {"percent": 5}, "charge": {"percent": 10}}
    assert optuav.robust("paper", box).hover_s == pytest.approx(555.810, abs=5e-4)
    box = {"drain": {"percent": 10}, "charge": {"percent": 20}}
    found = optuav.robust("paper", box, optuav.P4("b1", order="rest-first"))
    assert found.hover_s == pytest.approx(495.355, abs=5e-4)
    assert [*found.plot()] == ["robust.png"]


@pytest.mark.parametrize("problem", ["P1", "P3", optuav.P4("b1", order="rest-first")])
def test_the_plan_holds_at_every_corner_and_is_tight(problem: Any) -> None:
    """Neither dry nor overfull nor too low at four corners; at one of them a limit is reached."""
    box = {"drain": {"percent": 10}, "charge": {"percent": 20}}
    found = optuav.robust("paper", box, problem)
    assert found.flyable == 1.0
    ends = [flown(found.plan, *each) for each in itertools.product((0.9, 1.1), (0.8, 1.2))]
    assert min(least for least, _, _ in ends) == pytest.approx(0.0, abs=30.0)
    assert max(fullest for _, fullest, _ in ends) <= 1.0 + 1e-3
    assert min(left for _, _, left in ends) >= 0.05
    if not isinstance(problem, str):
        assert max(fullest for _, fullest, _ in ends) == pytest.approx(1.0, abs=1e-3)


def test_keys_and_factors_together_hold_at_random_points() -> None:
    """A plan for capacity, flow rate and both factors, flown at random points of the box."""
    box = {
        **{"drain": {"low": 0.97, "high": 1.08}, "charge": {"percent": 10}},
        "battery.capacity_As": {"percent": 5},
        "battery.flow_rate_per_s": {"percent": 40},
    }
    found = optuav.robust("paper", box, optuav.P4("b9", order="hover-first"), samples=200)
    assert found.flyable == 1.0
    random = np.random.default_rng(0)
    for _ in range(6):
        drain, charge = random.uniform(0.97, 1.08), random.uniform(0.9, 1.1)
        size, flow = random.uniform(0.95, 1.05), 4.5e-5 * random.uniform(0.6, 1.4)
        least, fullest, left = flown(found.plan, drain, charge, size=size, flow=flow)
        assert least >= -30.0
        assert fullest <= 1.0 + 1e-3
        assert left >= 0.05
    assert all(row["gain_s"] >= -1e-3 for row in found.rows)


def test_no_doubt_costs_nothing_and_more_doubt_more() -> None:
    """A box that shrinks to a point gives the plan of `solve`; prices grow with the box."""
    prices = [
        optuav.robust("paper", {"drain": {"percent": percent}}, "P3").price_s
        for percent in (1e-6, 2.0, 6.0)
    ]
    assert prices[0] == pytest.approx(0.0, abs=1e-4)
    assert prices[0] < prices[1] < prices[2]


def test_charge_alone_by_hand() -> None:
    """In `battery` the direct hover is what the most drain leaves: (0.95 B − d Q)/(d I)."""
    found = optuav.robust("paper", {"drain": {"percent": 20}}, "P3", perspective="battery")
    nominal = optuav.solve("paper", "P3", perspective="battery")
    hover = next(phase for phase in nominal.phases if phase.kind == "hover")
    Q = -sum(phase.charge_As for phase in nominal.phases if phase.kind == "flight")
    expected_s = (0.95 * 72_000 - 1.2 * Q) / (1.2 * (LIT_A - hover.current_A) - LIT_A)
    assert found.hover_s == pytest.approx(expected_s, rel=1e-9)


def test_a_chance_by_hand() -> None:
    """A direct hover fails exactly above the drain it is declared for: θ = 2·0.95 − 1 = 0.9."""
    box = {"drain": {"percent": 20}}
    found = optuav.robust("paper", box, "P3", perspective="battery", chance=0.95)
    assert found.reach_share == pytest.approx(0.9, abs=0.02)
    assert found.flyable == pytest.approx((1.0 + found.reach_share) / 2.0, abs=0.01)
    nominal = optuav.solve("paper", "P3", perspective="battery")
    hover = next(phase for phase in nominal.phases if phase.kind == "hover")
    Q = -sum(phase.charge_As for phase in nominal.phases if phase.kind == "flight")
    most = 1.0 + 0.2 * found.reach_share
    expected_s = (0.95 * 72_000 - most * Q) / (most * (LIT_A - hover.current_A) - LIT_A)
    assert found.hover_s == pytest.approx(expected_s, rel=1e-9)


@pytest.mark.parametrize(
    ("seeds", "most"),
    # With a share of 10 % more come once in 60 times.
    [pytest.param(8, 3, id="few"), pytest.param(40, 8, id="many", marks=pytest.mark.soak)],
)
def test_the_confidence_is_kept_over_seeds(seeds: int, most: int) -> None:
    """The true risk, (1 − θ)/2, exceeds 10 % for about 1 of 10 seeds at most."""
    box, over = {"drain": {"percent": 20}}, 0
    for seed in range(seeds):
        options: Any = {"chance": 0.9, "confidence": 0.9, "samples": 60, "seed": seed}
        found = optuav.robust("paper", box, "P3", perspective="battery", **options)
        over += (1.0 - found.reach_share) / 2.0 > 0.1
    assert over <= most


def test_the_risk_bound_is_that_of_clopper_and_pearson() -> None:
    """By another implementation of the interval, from the share that was flown."""
    box = {"drain": {"percent": 5}, "charge": {"percent": 10}}
    found = optuav.robust("paper", box, chance=0.9, samples=500)
    failures = round((1.0 - found.flyable) * 500)
    test = stats.binomtest(failures, 500, alternative="less")
    expected = test.proportion_ci(confidence_level=0.99, method="exact").high
    assert found.risk_bound == pytest.approx(expected, rel=1e-9)


def test_a_chance_finds_a_plan_where_the_whole_box_has_none() -> None:
    """The part of the box is then what few enough samples fail, not the error of the whole."""
    box = {"drain": {"low": 0.2, "high": 9.0}}
    with pytest.raises(NoPlanError, match="whole box"):
        optuav.robust("paper", box, "P1", samples=100)
    found = optuav.robust("paper", box, "P1", chance=0.3, samples=200)
    assert 0.0 < found.reach_share < 1.0
    assert found.flyable > 0.3


def test_a_larger_box_allows_no_longer_hover() -> None:
    """From 0.1 % of the places in the larger box the laser does not see b1: easily missed."""
    mission = optuav.load("paper").replace({"laser.position_m": [50.0, 300.0, 50.0]})
    rest_first = optuav.P4("b1", order="rest-first")
    boxes = [
        {
            f"laser.position_m[{k}]": {"low": x - 5.0 * reach, "high": x + 3.0 * reach}
            for k, x in ((0, 50.0), (1, 300.0))
        }
        for reach in (600.0, 1200.0)
    ]
    smaller, larger = (optuav.robust(mission, box, rest_first) for box in boxes)
    assert larger.hover_s <= smaller.hover_s + 1e-6
    assert smaller.flyable == larger.flyable == 1.0
    assert min(row["gain_s"] for row in larger.rows) > -1e-6


def test_a_box_beside_the_mission_has_a_plan_that_the_mission_may_not_fly() -> None:
    """A rest that fills the battery in the stated corner overfills it as the mission is."""
    box = {"drain": {"low": 1.09, "high": 1.1}, "charge": {"low": 0.8, "high": 0.81}}
    found = optuav.robust("paper", box, optuav.P4("b1", order="rest-first"))
    assert found.flyable == 1.0
    assert not found.plan.flyable
    assert {event.kind for event in optuav.replay(found.plan).violations} == {"full"}
    assert "cannot be flown with the mission's own numbers" in " ".join(str(found).split())


def test_a_range_without_the_mission_s_number_is_told() -> None:
    """With its value: beside a plan, and where there is none."""
    words = "battery.capacity_As = 36000 of the mission is not in"
    found = optuav.robust(
        "paper", {"battery.capacity_As": {"low": 37e3, "high": 38e3}}, samples=500
    )
    assert f"{words} 37000 to 38000" in str(found)
    assert not optuav.robust("paper", {"drain": {"percent": 1}}, samples=500).outside
    with pytest.raises(NoPlanError, match=f"{words} 100 to 200"):
        optuav.robust("paper", {"battery.capacity_As": {"low": 100, "high": 200}}, samples=500)


def test_a_wind_is_told_with_its_component_and_what_calm_air_gives() -> None:
    """Along y; the range that the advice names is accepted, and a vector's name leads to one."""
    still = optuav.load("relay-today")
    windy = still.replace({"wind.velocity_m_s": [0.0, 12.0, 0.0]})
    box = {"drain": {"percent": 5}}
    found, calm = (optuav.robust(each, box, samples=9) for each in (windy, still))
    assert found.calm_hover_s == pytest.approx(calm.hover_s)
    words = " ".join(str(found).split())
    assert f"in calm air: {calm.hover_s:.2f} s of hover" in words
    assert "set a range of wind.velocity_m_s[1] that contains 0" in words
    both = {**box, "wind.velocity_m_s[1]": {"low": 0, "high": 12}}
    assert optuav.robust(windy, both, samples=9).in_calm_air is calm.in_calm_air is None
    with pytest.raises(InputError, match=r"did you mean 'wind\.velocity_m_s\[0\]'"):
        optuav.robust(windy, {"wind.velocity_m_s": {"low": 0, "high": 12}})


def test_positions_and_rates_of_wells_are_uncertain_together() -> None:
    """Points where the laser is nearest level out at rates of their own: a raw ValueError before.

    The plan is flown again with the other ends of the rates, through the judge.
    """
    keys = ("battery.flow_rate_per_s", "laser.position_m[0]", "charge")
    box = {key: {"percent": 40} for key in keys}
    found = optuav.robust("paper-table2", box, samples=500)
    assert found.flyable == 1.0
    assert found.price_s > 0.0
    times_s = {"hover": ("hover", found.hover_s)}
    order = [(at, *times_s.get(at, ("rest", found.rest_s))) for at in found.route[1:-1]]
    mission, keys = optuav.load("paper-table2"), ("battery.flow_rate_per_s", "laser.position_m")
    hover_m = list(optuav.graph(mission).nodes["hover"]["position_m"])
    flow_per_s, (_, *laser_m) = mission.battery.flow_rate_per_s, mission.laser.position_m
    for flow, x in itertools.product((0.6, 1.4), (600.0, 1000.0, 1400.0)):
        moved = dict(zip(keys, (flow * flow_per_s, [x, *laser_m]), strict=True))
        flight = optuav.Itinerary(
            mission.replace({**moved, "route.hover_m": hover_m}),
            [optuav.Stop(*stop) for stop in order],
        )
        assert optuav.replay(flight).flyable


def test_a_chance_keeps_the_mission_s_own_numbers() -> None:
    """Shrunk about the middle, the box had left 36 000 A s out: 10.8 s of hover not to be flown."""
    box = {"battery.capacity_As": {"low": 36_000.0, "high": 42_000.0}}
    found = optuav.robust("paper", box, chance=0.9, samples=500)
    assert found.price_s == pytest.approx(0.0, abs=1e-3)
    assert found.plan.flyable
    assert not found.outside
    beside = {"battery.capacity_As": {"low": 37_000.0, "high": 42_000.0}}
    told = " ".join(str(optuav.robust("paper", beside, chance=0.9, samples=500)).split())
    assert "is not in 37000 to 42000" in told
    assert "range shrinks about its middle" in told


def test_the_mission_s_own_numbers_are_a_point_of_every_box() -> None:
    """Neither an end nor the middle of their ranges: the plan can be flown as the mission is."""
    spread = {"battery.flow_rate_per_s": {"low": 4.4e-5, "high": 9e-5}}
    spread |= {"laser.position_m[0]": {"low": 990.0, "high": 1100.0}}
    for chance in (None, 0.8):
        found = optuav.robust("paper-table2", spread, chance=chance, samples=300)
        assert found.plan.flyable
        assert found.price_s >= -1e-6


def test_an_altitude_that_is_not_allowed_everywhere_holds_no_plan() -> None:
    """The hover at 50 m is below what some points of the box allow."""
    box = {"limits.min_altitude_m": {"low": 40.0, "high": 90.0}}
    with pytest.raises(NoPlanError, match="whole box"):
        optuav.robust("paper", box, samples=8)
    box["limits.min_altitude_m"]["high"] = 50.0
    assert optuav.robust("paper", box, samples=8).price_s == pytest.approx(0.0, abs=1e-3)


def test_explain_names_the_number_that_costs_most() -> None:
    """By a robust plan without that number: on the same route its hover is that much longer."""
    found = optuav.robust("paper", {"drain": {"percent": 5}, "charge": {"percent": 10}})
    explained = optuav.explain(found)
    costliest, gain_s = next(iter(explained.doubt_costs_s.items()))
    assert (costliest, len(explained.doubt_costs_s)) == ("drain", 2)
    certain = optuav.robust("paper", {"charge": {"percent": 10}}, optuav.P4(found.plan.building))
    assert gain_s == pytest.approx(certain.hover_s - found.hover_s, abs=1e-3)
    assert "drain costs most: 34.6" in str(explained)
    assert explained.plan.hover_time_s == pytest.approx(found.nominal_hover_s, abs=1e-3)
    assert explained.to_dict()["doubt_costs_s"] == explained.doubt_costs_s
    with pytest.raises(InputError, match=r"problem: a robust plan has its own options"):
        optuav.explain(found, "P3")


def test_a_deviation_has_a_box_that_its_samples_do_not_leave() -> None:
    """Two deviations to either side; a normal sample is beyond in one case of twenty-two."""
    found = optuav.robust("paper", {"battery.capacity_As": {"deviation": 1000.0}}, "P3")
    ends = found.rows[0]["low"], found.rows[0]["high"]
    assert ends == pytest.approx((34_000.0, 38_000.0))
    assert found.flyable == 1.0
    small = optuav.load("paper").replace({"battery.capacity_As": 34_000.0})
    assert found.hover_s == pytest.approx(optuav.solve(small, "P3").hover_time_s, abs=1e-6)


def test_a_plan_that_fresh_samples_break_says_so() -> None:
    """Without a chance the word is the whole box; no such plan is known, so facts are changed."""
    found = optuav.robust("paper", {"drain": {"percent": 5}}, "P3", samples=50)
    assert "Beware" not in str(found)
    assert "not in the whole box" in str(replace(found, flyable=0.98))


@pytest.mark.parametrize(
    ("name", "aged_s", "cells_s"),
    [("paper", 431.34, 589.04), ("matrice350", 1484.93, None), ("relay-today", 1846.41, 2355.66)],
)
def test_boxes_of_lithium_packs(name: str, aged_s: float, cells_s: float | None) -> None:
    """An aged pack, and cells whose lag is 70 to 150 s, with the wells of `lipo`: known figures."""
    flow = 0.16 / 30.0
    wells = {"battery.available_fraction": 0.2, "battery.flow_rate_per_s": flow}
    mission = optuav.load(name).replace({**wells, "limits.keep_soc": "end"})
    full_As = mission.battery.capacity_As
    aged: dict[str, Any] = {
        "battery.capacity_As": {"low": 0.8 * full_As, "high": full_As},
        "battery.flow_rate_per_s": {"low": flow / 1.2, "high": flow},
    }
    cells: dict[str, Any] = {"battery.flow_rate_per_s": {"low": 0.64 / 150.0, "high": 0.64 / 70.0}}
    assert optuav.robust(mission, aged).hover_s == pytest.approx(aged_s, abs=5e-3)
    if cells_s is not None:
        assert optuav.robust(mission, cells).hover_s == pytest.approx(cells_s, abs=5e-3)


def test_bad_input(tmp_path: Path) -> None:
    """One clear error, with all that is wrong."""
    wrong: Any
    for wrong, words in (
        ({"drain": {"percent": -5}}, "drain"),
        ({"drain": {"percent": 100}}, "drain"),
        ({"charge": {"low": 2, "high": 1}}, "charge"),
        ({"drain": 5, "charge": {"percent": 0}}, "drain = 5"),
        ({"battery.capacity": {"percent": 5}}, "battery.capacity"),
        ({"drian": {"percent": 5}}, "drian.*did you mean .drain"),
        ({}, "at least one"),
    ):
        with pytest.raises(InputError, match=words):
            optuav.robust("paper", wrong)
    box = {"drain": {"percent": 5}}
    with pytest.raises(InputError, match="samples"):
        optuav.robust("paper", box, samples=0)
    with pytest.raises(InputError, match=r"at least 459 for a chance of 0\.99"):
        optuav.robust("paper", box, chance=0.99, samples=458)
    assert optuav.robust("paper", box, "P3", perspective="battery", chance=0.99, samples=459)
    with pytest.raises(InputError, match=r"at least 299 for a chance of 0\.99"):
        optuav.robust("paper", box, chance=0.99, confidence=0.95, samples=298)
    # As many samples as are allowed: 0.99999539… to the power of a million is 0.01.
    most = r"chance = 0\.999999999: must be at most 0\.9999953 at a confidence of 0\.99"
    with pytest.raises(InputError, match=most):
        optuav.robust("paper", box, chance=0.999999999)
    assert 0.9999953**1_000_000 <= 0.01 < 0.9999954**1_000_000
    with pytest.raises(InputError, match=r"at least 460515 for a chance of 0\.99999 "):
        optuav.robust("paper", box, chance=0.99999)
    for chance in (0.0, 1.0, math.nan, "much"):
        with pytest.raises(InputError, match="chance"):
            optuav.robust("paper", box, chance=chance)
    with pytest.raises(InputError, match="perspective"):
        optuav.robust("paper", box, perspective="energy")
    with pytest.raises(InputError, match="problem"):
        optuav.robust("paper", box, "P2")
    with pytest.raises(InputError, match=r"battery\.charging"):
        optuav.robust(optuav.load("paper").replace({"battery.charging": "taper"}), box)
    with pytest.raises(NoPlanError, match="whole box"):
        optuav.robust("paper", {"drain": {"low": 0.5, "high": 20.0}})
    many = {f"battery.{key}": {"percent": 1} for key in ("available_fraction", "flow_rate_per_s")}
    many |= {"body.mass_kg": {"percent": 1}, "battery.capacity_As": {"percent": 1}}
    many |= {"limits.min_soc": {"percent": 1}}
    with pytest.raises(InputError, match="corners"):
        optuav.robust("paper", many)


def test_a_number_that_was_typed_lies_in_its_box() -> None:
    """0.16/30 is no decimal: seven digits of it are its own, and one of the third is not."""
    mission = optuav.load("matrice350")
    for high, outside in ((0.005333333, False), (0.00533, True)):
        box = {"battery.flow_rate_per_s": {"low": 0.00444444, "high": high}}
        found = optuav.robust(mission, box, samples=100)
        assert ("of the mission is not in" in str(found)) == outside
