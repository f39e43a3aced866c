"""Repairs repair, a little less does not, and none is missed where the answer is known."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings

import optuav
from optuav.diagnosis import Repair, repairs
from optuav.diagnosis.keys import Key, keys
from optuav.errors import InputError
from optuav.mission import Mission
from tests.diagnosis.missions import PAPER, SMALL, infeasible


def by_key(mission: Mission, **options: Any) -> dict[tuple[str, str], Repair]:
    return {(each.key, each.comparison): each for each in repairs(mission, **options)}


def solved(mission: Mission, options: dict[str, Any], key: str, value: float) -> bool:
    try:
        return bool(optuav.solve(mission.replace({key: value}), **options))
    except InputError:
        return False


def check(mission: Mission, options: dict[str, Any], repair: Repair) -> None:
    """It repairs; one digit less does not; it lies on the side that it says."""
    assert repair.verified
    assert solved(mission, options, repair.key, repair.value), f"{repair} does not repair"
    if repair.comparison == "==":
        assert repair.value is True
        return
    sign = 1 if repair.comparison == ">=" else -1
    assert sign * (repair.value - repair.now) > 0
    short = repair.value - sign * repair.resolution
    short = int(short) if isinstance(repair.value, int) else float(f"{short:.12g}")
    assert not solved(mission, options, repair.key, short), f"{repair}: {short} would do"
    assert repair.resolution <= max(0.1 * abs(repair.value - repair.now), isinstance(short, int))
    if repair.up_to is not None:
        assert sign * repair.up_to >= sign * repair.value
        assert solved(mission, options, repair.key, repair.up_to)


# Known answers ----------------------------------------------------------------------------------


def test_a_deadline_shorter_than_the_flight() -> None:
    """Twice 37.8961 s of flight: 75.7922 s, rounded up."""
    mission = SMALL.replace({"limits.deadline_s": 60})
    found = by_key(mission, problem="P3")
    repair = found["limits.deadline_s", ">="]
    assert (repair.value, repair.up_to, repair.now) == (75.8, None, 60)
    assert str(repair) == "limits.deadline_s >= 75.8"
    assert not [key for key, _ in found if key.startswith(("battery.", "laser."))]
    for each in found.values():
        check(mission, {"problem": "P3"}, each)


def test_a_deadline_that_is_almost_long_enough() -> None:
    """Rounded to no more digits than engines tell apart, and printed with all of them."""
    flight_s = 2 * optuav.graph(SMALL).edges["origin", "hover"]["duration_s"]
    mission = SMALL.replace({"limits.deadline_s": flight_s - 1e-9})
    repair = by_key(mission, problem="P3")["limits.deadline_s", ">="]
    assert flight_s <= repair.value <= flight_s + 1e-6
    assert float(str(repair).split()[-1]) == repair.value


def test_too_heavy() -> None:
    """Full thrust 4 ϱ v_max² = 17.2158 N carries 1.7567 kg; 1.75 kg can be flown on the charge."""
    mission = PAPER.replace({"body.mass_kg": 2.5})
    found = by_key(mission)
    assert found["body.mass_kg", "<="].value == 1.75
    assert 4 * found["rotor.lift_coefficient_N_s2_rad2", ">="].value * 1060**2 > 2.5 * 9.8
    assert 4 * 3.8305e-6 * found["rotor.max_speed_rad_s", ">="].value ** 2 > 2.5 * 9.8
    assert found["rotor.max_speed_rad_s", ">="].up_to is not None, "ever faster rotors drain it"
    assert found["body.gravity_m_s2", "<="].value * 2.5 < 17.2158
    for each in found.values():
        check(mission, {}, each)


def test_out_of_reach() -> None:
    """The link covers 501.4836 m, so the device on the ground is reached from 501 m."""
    mission = PAPER.replace({"limits.min_altitude_m": 600, "limits.max_altitude_m": 700})
    found = by_key(mission)
    assert found["limits.min_altitude_m", "<="].value == 501
    power_W = 5 * (600 / 501.4836) ** 2
    assert found["link.transmit_power_W", ">="].value == pytest.approx(power_W, rel=2e-3)
    noise_dB = -11 - 20 * math.log10(600 / 501.4836)
    assert found["link.snr_threshold_dB", "<="].value == pytest.approx(noise_dB, abs=0.05)
    assert not [key for key, _ in found if not key.startswith(("link.", "limits."))]
    for each in found.values():
        check(mission, {}, each)


def test_a_building_in_the_way() -> None:
    wall = {"name": "wall", "position_m": [500, 1250, 100], "footprint_m": [60, 60]}
    mission = PAPER.replace({"buildings": [*PAPER.to_dict()["buildings"], wall]})
    found = by_key(mission, problem="P3")
    assert str(found["flight.through_buildings", "=="]) == "flight.through_buildings = true"
    for each in found.values():
        check(mission, {"problem": "P3"}, each)


def test_too_little_charge_takes_whole_packs_or_the_exact_capacity() -> None:
    """The flight takes 7843.11 A·s, 95 % of 8255.9 A·s in one pack, or in three of 3000."""
    mission = SMALL.replace({"battery.packs": 1, "battery.capacity_As": 3000})
    found = by_key(mission, problem="P3")
    assert found["battery.packs", ">="].value == 3
    assert isinstance(found["battery.packs", ">="].value, int)
    assert found["battery.capacity_As", ">="].value == 8260
    assert ("limits.min_soc", "<=") not in found, "not even 0 would do"
    for each in found.values():
        check(mission, {"problem": "P3"}, each)


def test_slots_of_five_seconds() -> None:
    """88.316 s of flight and a slot each of hover and rest: 98.4 s, where 88.4 s do without."""
    mission = SMALL.replace({"limits.deadline_s": 80})
    options = {"problem": "P4", "building": "b1", "order": "rest-first"}
    assert by_key(mission, **options)["limits.deadline_s", ">="].value == 88.4
    slotted = by_key(mission, **options, slot_s=5.0)
    assert slotted["limits.deadline_s", ">="].value == 98.4
    check(mission, {**options, "slot_s": 5.0}, slotted["limits.deadline_s", ">="])


def test_nothing_helps_where_no_single_change_does() -> None:
    """Out of reach and far too short a time: no number stands in the way of both."""
    mission = SMALL.replace(
        {"limits.min_altitude_m": 600, "limits.max_altitude_m": 700, "limits.deadline_s": 5}
    )
    assert repairs(mission, problem="P3") == ()


def test_a_feasible_question_needs_no_repair() -> None:
    assert repairs("paper") == ()


def test_order_is_by_relative_size_and_repeatable() -> None:
    mission = SMALL.replace({"body.mass_kg": 2.5})
    first, second = (repairs(mission, problem="P3") for _ in range(2))
    assert first == second
    assert [each.size for each in first] == sorted(each.size for each in first)


def test_edited_legs_stay_as_they_are_edited() -> None:
    """With 30 s to and from the hover point stated, a lighter UAV is no faster."""
    view = optuav.graph(SMALL)
    for edge in (("origin", "hover"), ("hover", "destination")):
        view.edges[edge]["duration_s"] = 30.0
    mission = SMALL.replace({"limits.deadline_s": 50})
    program = optuav.formulate(mission, "P3", graph=view)
    found = {each.key: each for each in repairs(program)}
    assert found["limits.deadline_s"].value == 60
    assert "body.mass_kg" not in found


# Random missions --------------------------------------------------------------------------------


@given(infeasible())
@settings(max_examples=4)
def test_every_repair_repairs(question: tuple[Mission, dict[str, Any]]) -> None:
    mission, options = question
    for repair in repairs(mission, **options):
        check(mission, options, repair)


@pytest.mark.soak
@given(infeasible())
@settings(max_examples=500)
def test_every_repair_repairs_at_length(question: tuple[Mission, dict[str, Any]]) -> None:
    mission, options = question
    for repair in repairs(mission, **options):
        check(mission, options, repair)


# Keys -------------------------------------------------------------------------------------------


def test_keys_are_the_numbers_that_the_mission_states() -> None:
    found = {key.name: key for key in keys(PAPER)}
    assert found["limits.deadline_s"].high == 1e7
    assert found["battery.packs"].whole
    assert (found["battery.packs"].low, found["battery.packs"].high) == (1, 1000)
    assert "laser.position_m" not in found
    assert "battery.flight_energy_J" not in found, "it is not stated"
    assert "battery.flight_energy_J" in {key.name for key in keys(optuav.load("paper-table2"))}


@pytest.mark.parametrize("key", [*keys(PAPER), *keys(optuav.load("paper-table2"))], ids=str)
@pytest.mark.parametrize("sign", [1, -1])
def test_values_go_outwards_to_the_end_of_the_range(key: Key, sign: int) -> None:
    values = [*key.further(sign)]
    end = key.high if sign > 0 else key.low
    assert values == sorted(values, reverse=sign < 0)
    assert len(set(values)) == len(values)
    assert all(sign * value > sign * key.now and key.low <= value <= key.high for value in values)
    assert (values[-1] if values else key.now) == end
