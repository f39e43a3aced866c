"""Repairs repair, a little less does not, and none is missed where the answer is known."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import optuav
from optuav.diagnosis import Repair
from optuav.diagnosis.repair import TABLES, outward, searched
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.mission.keys import Key, stated_keys
from tests.diagnosis.missions import PAPER, SMALL, InTime, infeasible, only, repairs


def by_key(mission: Mission, **options: Any) -> dict[tuple[str, str], Repair]:
    return {
        (each.key, each.comparison): each
        for each in repairs(mission, **{"perspective": "battery", **options})
    }


def solved(mission: Mission, options: dict[str, Any], key: str, value: float) -> bool:
    try:
        return bool(
            optuav.solve(mission.replace({key: value}), **{"perspective": "battery", **options})
        )
    except InputError:
        return False


def check(mission: Mission, options: dict[str, Any], repair: Repair) -> None:
    """It repairs; one digit less does not; it lies on the side that it says."""
    assert solved(mission, options, repair.key, repair.value), f"{repair} does not repair"
    if repair.comparison == "==":
        assert repair.value in (True, "over", "ignore")
        return
    sign = 1 if repair.comparison == ">=" else -1
    assert sign * (repair.value - repair.now) > 0
    short = repair.value - sign * repair.resolution
    short = int(short) if isinstance(repair.value, int) else float(f"{short:.12g}")
    assert not solved(mission, options, repair.key, short), f"{repair}: {short} would do"
    tenth = 0.1 * abs(repair.value - repair.now) * (1.0 + 1e-9)
    assert repair.resolution <= max(tenth, isinstance(short, int))
    if repair.up_to is not None:
        assert sign * repair.up_to >= sign * repair.value
        assert solved(mission, options, repair.key, repair.up_to)


# Known answers ----------------------------------------------------------------------------------


def test_a_deadline_shorter_than_the_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice 37.8961 s of flight: 75.7922 s, rounded up."""
    only(monkeypatch, "limits", "laser", "body")
    mission = SMALL.replace({"limits.deadline_s": 60})
    found = by_key(mission, problem="P3")
    repair = found["limits.deadline_s", ">="]
    assert (repair.value, repair.up_to, repair.now) == (75.8, None, 60)
    assert str(repair) == "limits.deadline_s >= 75.8"
    assert not [key for key, _ in found if key.startswith("laser.")]
    for each in found.values():
        check(mission, {"problem": "P3"}, each)


def test_too_heavy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Full thrust 4 ϱ v_max² = 17.2158 N carries 1.7567 kg; 1.75 kg can be flown on the charge."""
    only(monkeypatch, "body", "rotor")
    mission = SMALL.replace({"body.mass_kg": 2.5})
    found = by_key(mission)
    assert found["body.mass_kg", "<="].value == 1.75
    assert 4 * found["rotor.lift_coefficient_N_s2_rad2", ">="].value * 1060**2 > 2.5 * 9.8
    assert 4 * 3.8305e-6 * found["rotor.max_speed_rad_s", ">="].value ** 2 > 2.5 * 9.8
    assert found["rotor.max_speed_rad_s", ">="].up_to is not None, "ever faster rotors drain it"
    assert found["body.gravity_m_s2", "<="].value * 2.5 < 17.2158
    sizes = [each.size for (key, _), each in found.items() if key.startswith("rotor.")]
    assert sizes == sorted(sizes), "the smallest change comes first"
    for each in found.values():
        check(mission, {}, each)


def test_out_of_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """The link covers 501.4836 m, so the device on the ground is reached from 501 m."""
    only(monkeypatch, "limits", "link", "laser")
    mission = SMALL.replace({"limits.min_altitude_m": 600, "limits.max_altitude_m": 700})
    found = by_key(mission)
    assert found["limits.min_altitude_m", "<="].value == 501
    power_W = 5 * (600 / 501.4836) ** 2
    assert found["link.transmit_power_W", ">="].value == pytest.approx(power_W, rel=2e-3)
    noise_dB = -11 - 20 * math.log10(600 / 501.4836)
    assert found["link.snr_threshold_dB", "<="].value == pytest.approx(noise_dB, abs=0.05)
    assert not [key for key, _ in found if not key.startswith(("link.", "limits."))]
    for each in found.values():
        check(mission, {}, each)


def test_a_building_in_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    only(monkeypatch)
    wall = {"name": "wall", "position_m": [500, 1250, 100], "footprint_m": [60, 60]}
    mission = SMALL.replace({"buildings": [wall]})
    found = repairs(mission, perspective="battery", problem="P3")
    first, second = map(str, found[:2])
    assert first == "flight.obstacles = 'over'"
    assert second == "flight.obstacles = 'ignore'"
    for each in found:
        check(mission, {"problem": "P3"}, each)


def test_a_downdraught_that_is_too_strong(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rotors give 17.2158 N, the weight takes 12.74 N: 4.4758 N are left to the wind."""
    only(monkeypatch)
    mission = SMALL.replace({"wind.force_N": [0.1, 0, -6]})
    found = by_key(mission, problem="P3")
    calmer = found["wind.force_N[2]", ">="]
    assert calmer.value == -4.47
    assert optuav.solve(mission.replace({"wind.force_N": [0.1, 0, calmer.value]}), "P3")
    assert not optuav.solve(mission.replace({"wind.force_N": [0.1, 0, -4.48]}), "P3")
    others = {key for key, _ in found if key.startswith("wind.")} - {"wind.force_N[2]"}
    assert not others, "a level wind holds nothing up, and none blows along y"


def test_a_hover_point_out_of_reach_may_be_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it the UAV hovers at w_U, which the link gives."""
    only(monkeypatch)
    mission = SMALL.replace({"route.hover_m": [1000, 1000, 50]})
    removed = by_key(mission, problem="P3")["route.hover_m", "=="]
    assert str(removed) == "route.hover_m left out"
    assert (removed.to_dict()["now"], removed.value) == ([1000, 1000, 50], None)
    assert optuav.solve(mission.replace({removed.key: removed.value}), "P3")


def test_too_little_charge_takes_whole_packs_or_the_exact_capacity(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The flight takes 7843.11 A·s, 95 % of 8255.9 A·s in one pack, or in three of 3000."""
    only(monkeypatch, "limits", "battery")
    mission = SMALL.replace({"battery.packs": 1, "battery.capacity_As": 3000})
    found = by_key(mission, problem="P3")
    assert found["battery.packs", ">="].value == 3
    assert isinstance(found["battery.packs", ">="].value, int)
    assert found["battery.capacity_As", ">="].value == 8260
    assert ("limits.min_soc", "<=") not in found, "not even 0 would do"
    for each in found.values():
        check(mission, {"problem": "P3"}, each)


def test_slots_of_five_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """88.316 s of flight and a slot each of hover and rest: 98.4 s, where 88.4 s do without."""
    only(monkeypatch, "limits")
    mission = SMALL.replace({"limits.deadline_s": 80})
    options = {"problem": optuav.P4("b1", order="rest-first"), "slot_s": 5.0}
    repair = by_key(mission, **options)["limits.deadline_s", ">="]
    assert repair.value == 98.4
    check(mission, options, repair)


def test_nothing_helps_where_no_single_change_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Out of reach and far too short a time: no number stands in the way of both."""
    only(monkeypatch, "limits", "link")
    mission = SMALL.replace(
        {"limits.min_altitude_m": 600, "limits.max_altitude_m": 700, "limits.deadline_s": 5}
    )
    assert repairs(mission, problem="P3", perspective="battery") == ()


def test_a_feasible_question_needs_no_repair() -> None:
    assert repairs("paper") == ()


def test_a_number_of_ones_own_is_offered_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """The flight takes 75.7922 of 1200 s: 1124.2078 s can be spared, 1e6 are refused."""
    only(monkeypatch, "limits")
    found = repairs(SMALL, problem=InTime(2000), perspective="battery")
    assert [str(each) for each in found] == ["spare_s <= 1120", "limits.deadline_s >= 2080"]
    assert optuav.solve(SMALL, InTime(1120), perspective="battery")
    assert not optuav.solve(SMALL, InTime(1130), perspective="battery")


def test_edited_legs_stay_as_they_are_edited(monkeypatch: pytest.MonkeyPatch) -> None:
    """With 30 s to and from the hover point stated, a lighter UAV is no faster."""
    only(monkeypatch, "limits", "body")
    view = optuav.graph(SMALL)
    for edge in (("origin", "hover"), ("hover", "destination")):
        view.edges[edge]["duration_s"] = 30.0
    mission = SMALL.replace({"limits.deadline_s": 50})
    program = optuav.formulate(mission, "P3", graph=view, perspective="battery")
    found = {each.key: each for each in repairs(program)}
    assert found["limits.deadline_s"].value == 60
    assert "body.mass_kg" not in found


# Random missions --------------------------------------------------------------------------------


@given(infeasible(), st.lists(st.sampled_from(TABLES), min_size=1, max_size=2, unique=True))
@settings(max_examples=3)
def test_every_repair_repairs(question: tuple[Mission, dict[str, Any]], tables: list[str]) -> None:
    mission, options = question
    with pytest.MonkeyPatch.context() as patch:
        only(patch, *tables)
        found = repairs(mission, **{"perspective": "battery", **options})
    for repair in found:
        check(mission, options, repair)


def test_whole_slots_are_found_far_from_the_first() -> None:
    """A thin strip of times after 3 200 slots of rest, between which others were tried."""
    changes = {"limits.min_soc": 0.9, "body.mass_kg": 1.755}
    mission = optuav.load("paper").replace(changes)
    mission = mission.replace({"buildings": mission.buildings[:1]})
    with pytest.MonkeyPatch.context() as patch:
        only(patch, "limits")
        asked = optuav.P4("b1"), {"engine": "grid", "perspective": "battery"}
        found = {each.key: each for each in repairs(mission, problem=asked[0], **asked[1])}
    deadline = found["limits.deadline_s"]
    assert (deadline.value, deadline.resolution) == (3590.0, 10.0)


@pytest.mark.soak
@given(infeasible())
@settings(max_examples=500)
def test_every_repair_repairs_at_length(question: tuple[Mission, dict[str, Any]]) -> None:
    mission, options = question
    for repair in repairs(mission, **{"perspective": "battery", **options}):
        check(mission, options, repair)


# The search, over made-up keys ------------------------------------------------------------------

numbers = st.floats(1e-6, 1e6).map(lambda x: float(f"{x:.6g}"))
signs = st.sampled_from([1, -1])


def feasible_within(low: float, high: float) -> Any:
    return lambda trials: [low <= value <= high for _, value in trials]


def search(key: Key, sign: int, judge: Any) -> Repair | None:
    return searched([(key, sign)], judge).get((key, sign))


@given(numbers, numbers, signs)
def test_a_threshold_is_found_and_rounded_to_its_far_side(
    now: float, edge: float, sign: int
) -> None:
    """Within a tenth of the change or a digit that engines tell apart, and printed in full."""
    assume(sign * edge > sign * now and 1e-3 < edge / now < 1e3)
    key = Key("limits.deadline_s", now, 1e-9, 1e9, False, "s")
    reach = (edge, math.inf) if sign > 0 else (-math.inf, edge)
    repair = search(key, sign, feasible_within(*reach))
    assert repair is not None
    beyond = sign * (repair.value - edge)
    assert 0.0 <= beyond < repair.resolution * (1.0 + 1e-9)
    assert repair.resolution <= max(0.1 * abs(repair.value - now), 1e-6 * edge)
    assert repair.up_to is None
    assert float(f"{repair.value:.15g}") == repair.value


@given(st.integers(1, 1000), st.integers(1, 1000), signs)
def test_whole_numbers_are_found_exactly(now: int, edge: int, sign: int) -> None:
    assume(sign * edge > sign * now)
    reach = (edge, math.inf) if sign > 0 else (-math.inf, edge)
    repair = search(Key("battery.packs", now, 1, 1000, True, "-"), sign, feasible_within(*reach))
    assert repair is not None
    assert repair.value == edge


@example(1.0, -5e-324, -1)
@given(st.floats(-150.0, 150.0), st.floats(-150.0, 150.0), signs)
def test_keys_with_a_sign_are_searched_through_zero(now: float, edge: float, sign: int) -> None:
    assume(1e-3 < sign * (edge - now) < 1e3 * abs(now))
    key = Key("link.snr_threshold_dB", now, -200.0, 200.0, False, "dB")
    reach = (edge, math.inf) if sign > 0 else (-math.inf, edge)
    repair = search(key, sign, feasible_within(*reach))
    assert repair is not None
    assert 0.0 <= sign * (repair.value - edge) <= repair.resolution * (1.0 + 1e-9)


@given(numbers, st.floats(1.5, 50.0), st.floats(10.0, 100.0))
def test_where_feasible_values_end_is_told(now: float, factor: float, width: float) -> None:
    """A range wide enough to be met is told with both its ends, rounded inwards."""
    low, high = now * factor, now * factor * width
    repair = search(
        Key("rotor.max_speed_rad_s", now, 1e-9, 1e12, False, "rad/s"), 1, feasible_within(low, high)
    )
    assert repair is not None
    assert repair.up_to is not None
    assert low <= repair.value <= 1.1 * low
    assert 0.9 * high <= repair.up_to <= high


def test_searches_are_judged_together_and_no_value_twice() -> None:
    """In every round all directions put their values to the judge at once."""
    rounds: list[list[tuple[Key, float]]] = []

    def judge(trials: Any) -> list[bool]:
        rounds.append([*trials])
        return [value >= 7.0 for _, value in trials]

    keys_ = [
        Key(name, 1.0, 1e-3, 1e7, False, "s") for name in ("limits.slot_s", "limits.deadline_s")
    ]
    found = searched([(key, sign) for key in keys_ for sign in (1, -1)], judge)
    assert {(key.name, sign): each.value for (key, sign), each in found.items()} == {
        ("limits.slot_s", 1): 7.0,
        ("limits.deadline_s", 1): 7.0,
    }
    asked = [trial for some in rounds for trial in some]
    assert len(asked) == len(set(asked))
    assert {len({key for key, _ in some}) for some in rounds} == {2}


# Keys -------------------------------------------------------------------------------------------


def test_keys_are_the_numbers_that_the_mission_states() -> None:
    found = stated_keys(PAPER)
    assert found["limits.deadline_s"].high == 1e7
    assert found["battery.packs"].whole
    assert (found["battery.packs"].low, found["battery.packs"].high) == (1, 1000)
    assert "laser.position_m" not in found
    assert "battery.flight_energy_J" not in found, "it is not stated"
    assert "battery.flight_energy_J" in stated_keys(optuav.load("paper-table2"))


@pytest.mark.parametrize(
    "key",
    [*stated_keys(PAPER).values(), *stated_keys(optuav.load("paper-table2")).values()],
    ids=str,
)
@pytest.mark.parametrize("sign", [1, -1])
def test_values_go_outwards_to_a_thousandfold_or_the_end_of_the_range(key: Key, sign: int) -> None:
    """No one flies with a billion of anything: repairs end where changes stop to make sense."""
    values = [*outward(key, sign)]
    end = key.high if sign > 0 else key.low
    assert values == sorted(values, reverse=sign < 0)
    assert len(set(values)) == len(values)
    assert all(sign * value > sign * key.now and key.low <= value <= key.high for value in values)
    if key.now > 0.0 and key.low >= 0.0 and values:
        assert max(values[-1] / key.now, key.now / max(values[-1], 1e-300)) <= 1000.5 or (
            values[-1] == end == 0.0
        )
    if key.now > 0.0 and key.low >= 0.0 and values and values[-1] != end:
        assert values[-1] == pytest.approx(key.now * 1000.0**sign)
