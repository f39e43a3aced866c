"""`solve` as a whole: options, ties, monotony, odd missions, and plans worked out anew by hand."""

from __future__ import annotations

import itertools
import json
import math
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import optuav
from formulations.formulation import Formulation, Given
from optuav import InputError, Mission, Plan
from optuav.modelling import Model
from tests.asking import solve
from tests.examples import few
from tests.mission.strategies import missions
from tests.solving.by_hand import hovering, longest_of_all, programme, ways

PAPER = optuav.load("paper")
TABLE_2 = optuav.load("paper-table2")
PERSPECTIVES = ("battery", "energy", "adjusted")
perspective_names = st.sampled_from(PERSPECTIVES)


def hover_s(mission: Mission, **options: Any) -> float:
    """Δ [s], −1 without a plan, so that no plan counts as less than any."""
    plan = optuav.solve(mission, **{"perspective": "battery", **options})
    return plan.hover_time_s if plan else -1.0


def within(mission: Mission, plan: Plan, perspective: str) -> None:
    """The constraints of the plan, from its phases alone."""
    assert plan.hover_time_s >= 0.0
    assert plan.rest_time_s >= 0.0
    assert plan.mission_time_s <= mission.limits.deadline_s * (1 + 1e-9)
    given = mission.battery
    B = given.packs * given.capacity_As
    net = (
        sum(p.current_A * p.duration_s for p in plan.phases),
        sum(p.power_W * p.duration_s for p in plan.phases),
    )
    levels = {"battery": 1 + net[0] / B, "energy": 1 + net[1] / (B * given.nominal_voltage_V)}
    if perspective in levels:
        assert levels[perspective] >= mission.limits.min_soc - 1e-8 * max(
            1.0, 1 - min(levels.values())
        )
    hover_m = optuav.graph(mission).nodes["hover"]["position_m"]
    assert mission.limits.min_altitude_m <= hover_m[2] <= mission.limits.max_altitude_m


# Against plans made by hand


@few(4, most=1000)
@pytest.mark.campaign
@given(missions(), perspective_names)
def test_the_optimum_is_the_one_worked_out_by_hand(mission: Mission, perspective: str) -> None:
    """Random missions: Δ, mission time and route by the tie rule, feasibility from the phases."""
    plan = optuav.solve(mission, perspective=perspective)
    view = optuav.graph(mission)
    expected = None
    if "hover" in view and not any("P1." in reason for reason in plan.reasons):
        expected = longest_of_all(mission, view, perspective)
    if not plan:
        told = " ".join(plan.reasons)
        assert expected is None or any(word in told for word in ("P1.a", "P1.e", "cannot fly"))
        return
    assert expected is not None
    assert plan.status == "optimal"
    assert plan.hover_time_s == pytest.approx(expected.hover_s, rel=1e-9, abs=1e-6)
    assert plan.mission_time_s == pytest.approx(expected.mission_s, rel=1e-9, abs=1e-5)
    assert plan.route == expected.way.places
    within(mission, plan, perspective)


@pytest.mark.parametrize("engine", ["closed-form", "cvxpy", "casadi", "grid"])
@pytest.mark.parametrize("trajectory", ["optimal", "traj1"])
def test_p2_as_printed_prefers_the_shortest_mission(engine: str, trajectory: str) -> None:
    """Any Δ is optimal; every engine returns the one of the shortest mission, 0, and says so."""
    plan = optuav.solve(
        SMALL, optuav.P2(trajectory=trajectory), engine=engine, perspective="battery"
    )
    assert plan.hover_time_s == pytest.approx(0.0, abs=1e-9)
    assert plan.rest_time_s == pytest.approx(0.0, abs=1e-9)
    assert any("has no Δ" in note for note in plan.notes)


def test_p2_tight_in_slots_says_that_the_slots_are_in_the_way() -> None:
    """1200 s − 75.79 s of flight are no whole slots, and a mission without slots has a plan."""
    plan = optuav.solve("paper", "P2-tight", slot_s=1.0, perspective="battery")
    assert plan.status == "infeasible"
    assert plan.reasons == (
        "no whole slots of 1 s satisfy all constraints together; without slots there are times "
        "that do",
        "deadline tight: exactly 1124.21 s are asked for",
    )
    no_charge = optuav.load("paper").replace({"battery.capacity_As": 1000})
    plan = optuav.solve(no_charge, "P3", slot_s=1.0, perspective="battery")
    assert plan.reasons
    assert plan.reasons[0].startswith("charge left: ")


@few(4, most=1000)
@pytest.mark.campaign
@given(missions(), perspective_names)
def test_p2_takes_the_shortest_way_that_is_feasible(mission: Mission, perspective: str) -> None:
    """min T_fl + T', Δ free: the least rest that the charge for flying needs."""
    plan = optuav.solve(mission, "P2", perspective=perspective)
    if not plan:
        assert not optuav.solve(mission, perspective=perspective)
        return
    view, least_s = optuav.graph(mission), math.inf
    for way in ways(mission, view):
        a, b, c = programme(mission, view, way, perspective)
        horizon_s = mission.limits.deadline_s - way.time_s
        assume(a > 0.0)
        rest_s = max(0.0, -b / c) if len(way.places) == 4 and c > 0.0 else 0.0
        if rest_s <= horizon_s and c * rest_s >= -b - 1e-12:
            least_s = min(least_s, way.time_s + rest_s)
    assert plan.flight_time_s + plan.rest_time_s == pytest.approx(least_s, rel=1e-6, abs=1e-6)


@few(4, most=1000)
@pytest.mark.campaign
@given(missions(), perspective_names, st.sampled_from([1.0, 10.0, 33.3]))
def test_slots_lose_less_than_two_of_them(
    mission: Mission, perspective: str, slot_s: float
) -> None:
    """0 ≤ Δ_continuous − Δ_grid < 2 slots, over all routes, where resting does not discharge."""
    given = mission.flight
    assume(given.model == "rotors" or given.rest_current_A == given.rest_power_W == 0.0)
    assume(mission.limits.deadline_s / slot_s < 1000)
    continuous = hover_s(mission, perspective=perspective)
    slotted = hover_s(mission, perspective=perspective, slot_s=slot_s)
    assert slotted <= continuous + 1e-6
    if continuous >= 2 * slot_s:
        assert slotted > continuous - 2 * slot_s - 1e-6


@few(4, most=1000)
@pytest.mark.campaign
@given(missions(), perspective_names, st.sampled_from([0.5, 1.0, 7.0]))
def test_slotted_p3_is_a_floor(mission: Mission, perspective: str, slot_s: float) -> None:
    """min(T_max − T_fl, ⌊charge limit⌋): the deadline is not rounded."""
    plan = optuav.solve(mission, "P3", perspective=perspective, slot_s=slot_s)
    if not plan:
        assert not optuav.solve(mission, "P3", perspective=perspective)
        return
    view = optuav.graph(mission)
    direct = next(ways(mission, view))
    a, b, _ = programme(mission, view, direct, perspective)
    horizon_s = mission.limits.deadline_s - direct.time_s
    slots = b / a / slot_s if a > 0.0 else math.inf
    assume(abs(slots - round(slots)) > 1e-6 if math.isfinite(slots) else True)
    expected_s = min(horizon_s, math.floor(slots) * slot_s if math.isfinite(slots) else math.inf)
    assert plan.hover_time_s == pytest.approx(expected_s, rel=1e-9, abs=1e-6)


# Monotony and scaling


@few(4, most=1000)
@pytest.mark.campaign
@given(missions(), perspective_names, st.floats(1.0, 3.0))
def test_more_of_anything_never_hurts(mission: Mission, perspective: str, factor: float) -> None:
    """A later deadline, a larger battery, less charge to be left, more charging current."""
    given, limits = mission.battery, mission.limits
    changes: list[dict[str, Any]] = [
        {"limits.deadline_s": limits.deadline_s * factor},
        {"limits.min_soc": limits.min_soc / factor},
        {"battery.charge_current_A": given.charge_current_A * factor},
    ]
    if given.flight_energy_J is None:
        changes.append({"battery.capacity_As": given.capacity_As * factor})
    before_s = hover_s(mission, perspective=perspective)
    for change in changes:
        assert hover_s(mission.replace(change), perspective=perspective) >= before_s - 1e-6, change


@few(4, most=1000)
@pytest.mark.campaign
@given(missions("regimes"), perspective_names, st.floats(0.1, 10.0))
def test_scaling_battery_currents_and_powers_changes_nothing(
    mission: Mission, perspective: str, factor: float
) -> None:
    """Δ and T' are ratios of charge to current; the laser's figures are stated here."""
    assume(mission.laser is None or mission.flight.model == "rotors" or _is_stated(mission))
    given = mission.battery
    names = [
        *(
            f"flight.{kind}_{what}"
            for kind in ("flight", "hover", "rest", "charge")
            for what in ("current_A", "power_W")
        ),
        *("battery.capacity_As", "battery.flight_energy_J", "battery.hover_energy_J"),
    ]
    values = {
        name: getattr(getattr(mission, name.partition(".")[0]), name.partition(".")[2])
        for name in names
    }
    scaled = mission.replace({name: x * factor for name, x in values.items() if x is not None})
    assert given.packs == scaled.battery.packs
    plans = [optuav.solve(each, perspective=perspective) for each in (mission, scaled)]
    assert bool(plans[0]) == bool(plans[1])
    if plans[0]:
        assert plans[1].hover_time_s == pytest.approx(plans[0].hover_time_s, rel=1e-9, abs=1e-6)
        assert plans[1].mission_time_s == pytest.approx(plans[0].mission_time_s, rel=1e-9, abs=1e-5)


def _is_stated(mission: Mission) -> bool:
    return mission.flight.model == "regimes" and mission.flight.charge_current_A is not None


# Options


SMALL = PAPER.replace(
    {
        "buildings": [each.model_dump(exclude_none=True) for each in PAPER.buildings[:1]],
        "limits.slot_s": 200,
    }
)
ROUTED = ("P1", "P2", "P2-tight")


@pytest.mark.parametrize("problem", [*ROUTED, "P3", "P4"])
def test_every_pair_of_options_is_answered_or_refused(problem: str) -> None:
    """The table of the documentation, row by row."""
    for trajectory, building, order, slot_s, engine in itertools.product(
        (None, "direct", "traj1", "traj2"),
        (None, "b1"),
        (None, "rest-first", "hover-first"),
        (None, 100.0),
        ("auto", "closed-form", "grid"),
    ):
        options: dict[str, Any] = {
            "trajectory": trajectory,
            "building": building,
            "order": order,
            "slot_s": slot_s,
            "engine": engine,
        }
        refused = {
            "trajectory": problem not in ROUTED and trajectory is not None,
            "building": (building is not None) != (problem == "P4"),
            "order": order is not None
            and (problem == "P3" or (trajectory == "direct" and problem in ROUTED)),
        }
        if refused["building"] or refused["trajectory"]:
            refused["order"] = problem == "P3" and order is not None
        if any(refused.values()):
            with pytest.raises(InputError) as raised:
                solve(SMALL, problem, **{"perspective": "battery", **options})
            assert [fault.key for fault in raised.value.faults] == [
                name for name, is_refused in refused.items() if is_refused
            ]
        elif engine == "closed-form" and slot_s is not None:
            with pytest.raises(InputError, match="only continuous times"):
                solve(SMALL, problem, **{"perspective": "battery", **options})
        else:
            plan = solve(SMALL, problem, **{"perspective": "battery", **options})
            assert plan.slot_s == (200.0 if engine == "grid" and slot_s is None else slot_s)
            assert plan.engine == ("grid" if plan.slot_s else "closed-form") or not plan
            assert (plan.building, plan.order) == (building, order)
            if plan and building:
                assert building in plan.route
            if plan and plan.slot_s and problem != "P3" and plan.rest_time_s:
                assert plan.rest_time_s % plan.slot_s == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"problem": "P5"}, "problem = 'P5'"),
        ({"problem": None}, "problem = None"),
        ({"problem": Formulation}, "must be an instance, such as Formulation"),
        ({"trajectory": "traj3"}, "did you mean 'traj1'|'traj2'"),
        ({"problem": "P4"}, "P4 with the name of a building"),
        ({"problem": "P4", "building": "b99"}, "the mission's buildings are: b1, b2"),
        ({"problem": "P4", "building": "hover"}, "building = 'hover'"),
        ({"order": "first"}, "order = 'first'"),
        ({"perspective": "batery"}, "did you mean 'battery'"),
        ({"engine": "closed"}, "engine = 'closed'"),
        ({"slot_s": 0}, "slot_s = 0"),
        ({"slot_s": -1.0}, "slot_s"),
        ({"slot_s": math.nan}, "slot_s"),
        ({"slot_s": math.inf}, "slot_s"),
        ({"slot_s": 1e-6}, "0.001 <= x <= 1e7"),
        ({"slot_s": True}, "slot_s"),
        ({"slot_s": "1"}, "slot_s"),
        ({"time_limit_s": 0}, "time_limit_s"),
        ({"time_limit_s": -1}, "time_limit_s"),
    ],
)
def test_options_that_do_not_exist_are_refused(options: dict[str, Any], words: str) -> None:
    """With what there is instead."""
    with pytest.raises(InputError) as raised:
        solve(PAPER, **{"perspective": "battery", **options})
    assert any(word in str(raised.value) for word in words.split("|"))


def test_all_wrong_options_are_told_at_once() -> None:
    """One message, a line each."""
    with pytest.raises(InputError) as raised:
        optuav.solve(
            PAPER,
            optuav.P1(trajectory="x", order="x", hover_point="x", stops=-1, hovers=0),  # type: ignore
            perspective="y",
            engine="z",
            slot_s=0,
            time_limit_s=0,
        )
    keys = {fault.key for fault in raised.value.faults}
    assert keys == {
        *("trajectory", "order", "hover_point", "stops", "hovers"),
        *("perspective", "engine", "slot_s", "time_limit_s"),
    }


def test_a_slot_longer_than_the_mission() -> None:
    """P3 may be cut short to nothing or all; P4 has no whole slot and says so."""
    late = optuav.solve(PAPER, optuav.P4("b1"), slot_s=5000, perspective="battery")
    assert not late
    assert late.reasons == (
        "no whole slots of 5000 s satisfy all constraints together; "
        "without slots there are times that do",
    )
    assert optuav.solve(PAPER, "P3", slot_s=5000, perspective="battery").hover_time_s == 0.0


def test_too_many_slots_are_refused_before_they_fill_the_memory() -> None:
    """A year of milliseconds."""
    ample = PAPER.replace({"limits.deadline_s": 1e7, "battery.capacity_As": 1e9})
    with pytest.raises(InputError, match=r"slots of 0\.001 s are too short"):
        optuav.solve(ample, "P3", slot_s=1e-3, perspective="battery")


def test_the_grid_takes_the_slot_of_the_mission() -> None:
    """limits.slot_s, unless another is stated."""
    mission = TABLE_2.replace({"limits.slot_s": 7})
    assert optuav.solve(mission, "P3", engine="grid", perspective="battery").slot_s == 7.0
    assert optuav.solve(mission, "P3", engine="grid", perspective="battery").hover_time_s % 7 == 0.0
    assert optuav.solve(mission, "P3", slot_s=2.0, perspective="battery").slot_s == 2.0


def test_a_mission_goes_by_name_by_path_or_as_itself(tmp_path: Path) -> None:
    """The same plan three ways."""
    PAPER.save(tmp_path / "paper.toml")
    by_path = [tmp_path / "paper.toml", str(tmp_path / "paper.toml")]
    assert [optuav.solve(each, perspective="battery") for each in ("paper", *by_path)] == [
        optuav.solve(PAPER, perspective="battery")
    ] * 3


# Ties


def test_of_equal_plans_the_shortest_mission_is_taken() -> None:
    """Two roofs alike but for their height above the way; hovering all the deadline leaves ties."""
    mission = PAPER.replace({"limits.deadline_s": 300})
    for trajectory in ("optimal", "direct"):
        plan = optuav.solve(mission, optuav.P1(trajectory=trajectory), perspective="battery")
        assert plan.route == ("origin", "hover", "destination")
        assert plan.rest_time_s == 0.0


def test_of_equal_plans_the_fewest_stops_then_the_first_building_then_rest_first() -> None:
    """A building on the straight line, at the hover point itself: all ways take the same time."""
    line = {
        "route.origin_m": [0, 2800, 50],
        "route.destination_m": [2000, 2800, 50],
        "route.hover_m": [1000, 2800, 50],
        "flight.acceleration_m_s2": 10,
        "flight.max_speed_m_s": 1e-2,
        "limits.deadline_s": 1e6,
        "battery.capacity_As": 1e9,
        "flight.charge_current_A": 0,
        "flight.charge_power_W": 0,
    }
    spots = [{"name": name, "position_m": [1000, 2800, 50]} for name in ("second", "first")]
    mission = TABLE_2.replace(line | {"buildings": spots})
    assert optuav.solve(mission, perspective="battery").route == ("origin", "hover", "destination")
    assert (
        optuav.solve(mission, optuav.P1(trajectory="traj1"), perspective="battery").route[1]
        == "second"
    )
    assert optuav.solve(mission, optuav.P1(trajectory="traj2"), perspective="battery").route[
        1:3
    ] == (
        "second",
        "hover",
    )
    swapped = mission.replace({"buildings": spots[::-1]})
    assert optuav.solve(swapped, optuav.P1(trajectory="traj2"), perspective="battery").route[
        1:3
    ] == (
        "first",
        "hover",
    )
    hover_first = optuav.solve(
        mission, optuav.P1(trajectory="traj2", order="hover-first"), perspective="battery"
    )
    assert hover_first.route[1:3] == ("hover", "second")


@pytest.mark.campaign
@settings(few(3, most=300), suppress_health_check=[HealthCheck.filter_too_much])
@given(missions(), perspective_names)
def test_the_rest_is_the_shortest_that_its_hover_admits(mission: Mission, perspective: str) -> None:
    """A second less of it, and the state of charge falls short."""
    assume(mission.laser is not None and mission.buildings)
    plan = optuav.solve(mission, perspective=perspective)
    assume(bool(plan) and plan.rest_time_s > 1.0)
    view = optuav.graph(mission)
    way = next(each for each in ways(mission, view) if each.places == plan.route)
    a, b, c = programme(mission, view, way, perspective)
    assert a * plan.hover_time_s - c * (plan.rest_time_s - 1.0) > b


# Odd missions


def test_wind_costs_hover_time() -> None:
    """Any level wind; a little lift from below helps."""
    calm = hover_s(PAPER)
    for x, y in ((3, 0), (-3, 0), (0, 3), (2, -2)):
        windy = PAPER.replace({"wind.force_N": [x, y, 0]})
        assert hover_s(windy) < calm - 1
        assert hovering(windy).current_A > hovering(PAPER).current_A
    assert hover_s(PAPER.replace({"wind.force_N": [0, 0, 1]})) > calm + 1


def test_without_a_laser_no_rest_pays() -> None:
    """Direct, on what the battery holds."""
    plan = optuav.solve(PAPER.replace({"laser": None}), perspective="battery")
    assert plan.route == ("origin", "hover", "destination")
    expected_s = (0.95 * 72000 - 2 * 3921.555) / (4 * 23.2276 + 5)
    assert plan.hover_time_s == pytest.approx(expected_s, abs=2e-3)


def test_without_buildings_there_is_the_direct_way_only() -> None:
    """traj1 and traj2 say that there is nothing to go by way of."""
    mission = PAPER.replace({"buildings": []})
    assert optuav.solve(mission, perspective="battery").hover_time_s == pytest.approx(
        688.848, abs=5e-4
    )
    for trajectory in ("traj1", "traj2"):
        plan = optuav.solve(mission, optuav.P1(trajectory=trajectory), perspective="battery")
        assert plan.reasons == ("the mission has no building to go by way of",)


def test_one_building_and_no_other() -> None:
    """b7 alone: what P4 gives, or the direct flight."""
    mission = PAPER.replace({"buildings": [PAPER.buildings[6].model_dump()]})
    rest = optuav.solve(mission, optuav.P4("b7"), perspective="battery").hover_time_s
    assert hover_s(mission) == max(
        rest, optuav.solve(mission, "P3", perspective="battery").hover_time_s
    )


def test_a_round_trip_from_the_hover_point() -> None:
    """Origin, hover point and destination are one place: legs of no length, no time in flight."""
    place = [1000, 2800, 60]
    keys = ("route.origin_m", "route.hover_m", "route.destination_m")
    mission = PAPER.replace(dict.fromkeys(keys, place))
    plan = optuav.solve(mission, "P3", perspective="battery")
    assert plan.flight_time_s == 0.0
    expected_s = 0.95 * 72000 / (4 * 23.2276 + 5 - 10)
    assert plan.hover_time_s == pytest.approx(expected_s, abs=2e-3)
    assert optuav.solve(mission, perspective="battery").hover_time_s >= plan.hover_time_s


@few(4, most=1000)
@pytest.mark.campaign
@given(missions())
def test_a_round_trip_home(mission: Mission) -> None:
    """Origin is destination: either order of rest and hover takes the same time."""
    home = mission.replace({"route.destination_m": list(mission.route.origin_m)})
    for building in home.buildings:
        there, back = (
            optuav.solve(home, optuav.P4(building.name, order=order), perspective="battery")
            for order in ("rest-first", "hover-first")
        )
        assert bool(there) == bool(back)
        if there:
            assert there.hover_time_s == pytest.approx(back.hover_time_s, rel=1e-9, abs=1e-6)


def test_a_hover_that_charges_lasts_as_long_as_the_deadline() -> None:
    """The laser gives more than hovering takes."""
    strong = {"laser.power_W": 1e5, "battery.charge_current_A": 200}
    plan = optuav.solve(PAPER.replace(strong), perspective="battery")
    assert plan.mission_time_s == pytest.approx(1200, abs=1e-9)
    assert plan.rest_time_s == 0.0
    assert plan.phases[1].current_A > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("buildings", [2_000, pytest.param(10_000, marks=pytest.mark.soak)])
def test_thousands_of_buildings(buildings: int) -> None:
    """A town of low houses with walls: the plan made by hand from its graph."""
    houses = [
        {
            "name": f"n{k}",
            "position_m": [60.0 * (k % 100) - 2000, 60.0 * (k // 100) - 2000, 20 + k * 7 % 25],
            "footprint_m": [40, 40],
        }
        for k in range(buildings)
    ]
    mission = PAPER.replace({"buildings": houses, "route.origin_m": [0, 0, 70]})
    plan = optuav.solve(mission, perspective="battery")
    expected = longest_of_all(mission, optuav.graph(mission))
    assert expected is not None
    assert plan.hover_time_s == pytest.approx(expected.hover_s, abs=1e-6)
    assert plan.mission_time_s == pytest.approx(expected.mission_s, abs=1e-5)


# Formulations of one's own


class WithoutRest(Formulation):
    """Hover until the deadline, whatever the battery says."""

    def declare(self, model: Model, given: Given) -> None:
        """One unknown."""
        hover = model.variable("hover_time_s", "Δ", unit="s", upper=given.time_left)
        model.maximise(hover)


class OfOtherThings(Formulation):
    """An unknown that is no time of the mission."""

    def declare(self, model: Model, given: Given) -> None:
        """As long as it is bounded."""
        model.maximise(model.variable("number", "n", unit="1", upper=5.0))


class WithoutEnd(Formulation):
    """Nothing bounds the hover time."""

    def declare(self, model: Model, given: Given) -> None:
        """One unknown, no constraint."""
        model.maximise(model.variable("hover_time_s", "Δ", unit="s"))


def test_formulations_of_ones_own() -> None:
    """They go the direct way; by way of a building only if they declare a rest."""
    plan = optuav.solve(PAPER, WithoutRest(), perspective="battery")
    assert plan.problem == "WithoutRest"
    assert plan.mission_time_s == pytest.approx(1200)
    plan = optuav.solve(PAPER, WithoutRest(building="b1"), perspective="battery")
    words = "WithoutRest declares no rest_time_s, which a route by way of a building needs"
    assert plan.reasons == (words,)
    assert optuav.solve(PAPER, OfOtherThings(), perspective="battery").hover_time_s == 0.0
    endless = optuav.solve(PAPER, WithoutEnd(), perspective="battery")
    assert endless.status == "unbounded"
    assert "given.keep_deadline" in endless.reasons[0]
    assert not endless


# Determinism


def test_the_same_question_has_the_same_answer() -> None:
    """Twice in one process, to the last bit."""
    for mission, options in itertools.product(
        (PAPER, TABLE_2), ({}, {"trajectory": "traj2"}, {"slot_s": 20.0})
    ):
        twice = [
            solve(mission, **{"perspective": "battery", **options}).to_dict() for _ in range(2)
        ]
        assert json.dumps(twice[0]) == json.dumps(twice[1])


def test_another_process_has_the_same_answer() -> None:
    """Whatever the seed of Python's hashes."""
    script = (
        "import json, optuav\n"
        "for name in ('paper', 'paper-table2'):\n"
        "    for way in ('optimal', 'traj2'):\n"
        "        print(json.dumps(optuav.solve(name, optuav.P1(trajectory=way)).to_dict()))"
    )
    here = [
        json.dumps(optuav.solve(name, optuav.P1(trajectory=way)).to_dict())
        for name in ("paper", "paper-table2")
        for way in ("optimal", "traj2")
    ]
    seed = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    printed = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert printed.stdout.splitlines() == here


@pytest.mark.parametrize("perspective", ["available", "wells"])
@pytest.mark.parametrize("seed", [3, 14, 29, 32, 55, 60, 61, 62])
def test_routes_that_a_bound_excludes_change_nothing(seed: int, perspective: Any) -> None:
    """The plan is that of the answers to all routes, also where the best bound is not the best."""
    draw, base = random.Random(seed), TABLE_2 if seed % 2 else optuav.load("matrice350")
    assert base.laser is not None
    (town,) = optuav.layouts(base, 1, "uniform", buildings=10, seed=seed)
    mission = town.replace(
        {
            "limits.deadline_s": draw.uniform(300.0, 3500.0),
            "battery.capacity_As": base.battery.capacity_As * draw.uniform(0.5, 2.0),
            "battery.flow_rate_per_s": 10.0 ** draw.uniform(-5.0, -2.5),
            "laser.power_W": base.laser.power_W * draw.uniform(0.2, 20.0),
        }
    )
    program = optuav.formulate(mission, perspective=perspective)
    assert program.parts
    assert program.solve() == program.plan(program.answers())
