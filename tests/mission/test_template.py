"""A mission to start from: as a commented file, and made of a drone's datasheet."""

from __future__ import annotations

import itertools
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

import optuav
from optuav.mission import Mission
from optuav.mission.template import INSTEAD, Datasheet, RotorDatasheet, template
from optuav.network.feasibility import advice
from optuav.network.vehicle import hover_load
from optuav.options import BATTERIES
from tests.examples import few
from tests.mission.strategies import NAMES, missions


def loaded(text: str, directory: Path) -> Mission:
    path = directory / "mission.toml"
    path.write_text(text, encoding="utf-8")
    return optuav.load(path)


@pytest.mark.campaign
@few(10, most=1000)
@given(mission=missions(), name=NAMES)
def test_a_template_is_the_mission_with_another_name(
    mission: Mission, name: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Every value survives to the last digit, in any flight model, with any names."""
    again = loaded(template(mission, name), tmp_path_factory.getbasetemp())
    assert again == mission.replace({"name": name, "description": ""})


@pytest.mark.parametrize("name", ["paper", "paper-table2", "matrice350"])
def test_every_key_is_explained(name: str) -> None:
    """Each key of each table stands under its description, those that are not set as comments."""
    mission = optuav.load(name)
    text = template(mission, "mine")
    lines = text.splitlines()
    tables = [getattr(mission, key) for key in Mission.model_fields]
    for table in (each for each in tables if isinstance(each, BaseModel)):
        for key in type(table).model_fields:
            stated = f"{key} = " if getattr(table, key) is not None else f"# {key} ="
            wanted = f"# {table.descriptions()[key].splitlines()[-1]}"
            assert any(
                above == wanted and below.startswith(stated)
                for above, below in itertools.pairwise(lines)
            ), key
    assert text.endswith("\n")
    assert "None" not in text


def test_optional_tables_that_are_not_there_stay_away(tmp_path: Path) -> None:
    """No laser, no buildings: the file says nothing of them and can be read."""
    bare = optuav.load("paper").replace({"laser": None, "buildings": []})
    text = template(bare, "bare")
    assert {"laser", "buildings"}.isdisjoint(tomllib.loads(text))
    assert not loaded(text, tmp_path).buildings


def test_only_the_first_building_is_explained() -> None:
    """The others are short."""
    text = template(optuav.load("paper"), "mine")
    assert text.count("[[buildings]]") == 10
    assert text.count("# Resting place of the UAV") == 1


def test_numbers_look_as_a_person_writes_them() -> None:
    """Whole numbers without a point, arrays on one line."""
    lines = template(optuav.load("paper"), "mine").splitlines()
    assert "deadline_s = 1200" in lines
    assert "device_m = [1000, 3000, 0]" in lines
    assert "min_soc = 0.05" in lines
    assert 'name = "mine"' in lines


KNOWN: dict[str, Any] = {
    "mass_kg": 4.0,
    "packs": 2,
    "cells": 10,
    "capacity_mAh": 6000,
    "hover_min": 36,
    "cruise_speed_m_s": 10,
}


def test_currents_empty_the_packs_in_the_stated_times() -> None:
    """12 Ah in 36 min are 20 A, in 40 min 18 A; ten cells have 37 V."""
    mission = Datasheet(**KNOWN, cruise_min=40).mission()
    assert mission.flight.model == "regimes"
    assert mission.flight.hover_current_A == pytest.approx(20.0)
    assert mission.flight.hover_power_W == pytest.approx(740.0)
    assert mission.flight.flight_current_A == pytest.approx(18.0)
    assert mission.flight.flight_power_W == pytest.approx(666.0)
    assert mission.flight.rest_current_A == pytest.approx(0.4)
    assert mission.battery.capacity_As == pytest.approx(21600.0)
    assert mission.battery.charge_current_A == pytest.approx(12.0)
    assert mission.limits.min_soc == pytest.approx(0.2)


def test_a_sheet_of_rotors_feeds_the_radio_by_the_pack() -> None:
    """At 1 V, as in the mission of the places, 5 W would be 5 A in place of 0.23 A."""
    rotors: dict[str, Any] = {"rotor_radius_m": 0.2, "blade_solidity": 0.05, "tip_speed_m_s": 120}
    common = {"mass_kg": 2.04, "cells": 6, "capacity_mAh": 5000, "cruise_speed_m_s": 20}
    mission = RotorDatasheet(**common, **rotors, drag_ratio=0.3).mission()
    assert mission.link.transmit_voltage_V == pytest.approx(22.2)
    assert not any("radio" in words for words in advice(mission))
    drawn, hovering = hover_load(mission), mission.flight_model.hover()
    assert drawn.current_A - hovering.current_A == pytest.approx(5.0 / 22.2)


WELLS = {"lipo": (0.2, 0.16 / 30.0), "liion": (0.1, 0.0027), "paper": (0.8, 4.5e-5)}
"""ω and k_F [1/s] of the specification."""


@pytest.mark.parametrize("name", WELLS)
def test_a_battery_by_name_has_the_wells_of_such_cells(name: Any, tmp_path: Path) -> None:
    """In a datasheet and in a template; a comment says where they come from."""
    sheets = Datasheet(**KNOWN, battery=name), optuav.RotorDatasheet(**ROTORS, battery=name)
    for mission in (
        *(sheet.mission() for sheet in sheets),
        loaded(template(optuav.load("matrice350"), "mine", battery=name), tmp_path),
    ):
        battery = mission.battery
        assert (battery.available_fraction, battery.flow_rate_per_s) == WELLS[name]
    text = template(optuav.load("paper"), "mine", battery=name)
    assert f"[battery]\n# Wells `{name}`: " in text
    assert "optuav calibrate kibam" in " ".join(text.replace("\n# ", " ").split())


def test_wells_are_those_of_lithium_unless_the_mission_has_others() -> None:
    """A datasheet without a battery takes `lipo`; a mission as a template keeps its own."""
    for sheet in (Datasheet(**KNOWN), optuav.RotorDatasheet(**ROTORS)):
        assert sheet.battery == "lipo"
        assert sheet.mission().battery.available_fraction == 0.2
    assert "# Wells `paper`: " in template(optuav.load("paper"), "mine")
    own = optuav.load("paper").replace({"battery.available_fraction": 0.7})
    assert "# Wells" not in template(own, "mine")


def test_a_battery_without_wells_is_refused() -> None:
    with pytest.raises(optuav.InputError, match="battery = 'nimh'"):
        Datasheet(**KNOWN, battery="nimh")
    with pytest.raises(
        optuav.InputError, match="battery = 'nimh': must be one of lipo, liion, paper"
    ):
        template(optuav.load("paper"), "mine", battery="nimh")  # type: ignore[arg-type]


def test_the_comment_on_wells_says_what_is_known_and_no_more() -> None:
    """To which rate, and what the capacity is, of cells; the paper states neither."""
    said = dict[str, str]()
    for name in BATTERIES:
        text = template(optuav.load("paper"), "mine", battery=name)
        said[name] = " ".join(text.partition("[battery]")[2].partition("# Number")[0].split("\n# "))
    assert "25 °C, to 5 C. Lag (1−ω)²/k_F 120 s; over such cells 70 to 135 s." in said["lipo"]
    words = "Lag (1−ω)²/k_F 300 s, chosen so as not to last longer; the one cell behind it 341 s."
    assert words in said["liion"]
    assert "like a NiMH cell. Lag (1−ω)²/k_F 889 s." in said["paper"]
    for name, text in said.items():
        assert ("rated charge" in text) == (name != "paper")


@pytest.mark.parametrize("name", ["paper", "paper-table2", "paper-drag"])
def test_wells_of_no_lithium_cell_are_doubted(name: str) -> None:
    """The paper's have a lag of 0.2²/4.5e-5 = 889 s; above 400 s a warning says so."""
    mission = optuav.load(name)
    assert any("a lag (1−ω)²/k_F of 889 s, unlike any lithium cell" in x for x in advice(mission))
    for flow, doubted in ((0.64 / 399.0, False), (0.64 / 401.0, True), (0.0, True)):
        wells = {"battery.available_fraction": 0.2, "battery.flow_rate_per_s": flow}
        told = [*advice(mission.replace(wells))]
        assert any("lag" in words for words in told) == doubted


def test_a_payload_as_heavy_as_three_drones_makes_eight_times_the_power() -> None:
    """4^1.5 = 8 by the momentum theory; without cruise time, cruising draws what hovering does."""
    mission = Datasheet(**KNOWN, payload_kg=12).mission()
    assert mission.flight.model == "regimes"
    assert mission.flight.hover_power_W == pytest.approx(8 * 740.0)
    assert mission.flight.flight_current_A == mission.flight.hover_current_A


def test_without_laser_and_reserve_it_hovers_what_the_datasheet_says() -> None:
    """Flight and hover together take the whole charge, and draw alike: 36 min in the air."""
    sheet = Datasheet(**KNOWN, reserve_percent=0, laser_power_W=0)
    plan = optuav.solve(
        sheet.mission().replace({"limits.deadline_s": 9000}), "P3", perspective="battery"
    )
    assert plan.mission_time_s == pytest.approx(36 * 60, rel=1e-4)


@pytest.mark.campaign
@few(10, most=1000)
@given(
    mass_kg=st.floats(0.5, 30),
    payload=st.floats(0, 1),
    packs=st.integers(1, 4),
    cells=st.integers(3, 14),
    capacity_mAh=st.floats(2000, 3e4),
    hover_min=st.floats(25, 90),
    cruise_speed_m_s=st.floats(8, 25),
    laser_power_W=st.floats(0, 2e4),
)
def test_every_sensible_drone_has_a_plan(mass_kg: float, payload: float, **others: Any) -> None:
    """The mission is in order and has a plan, with payloads up to the drone's own mass."""
    if payload > 0.5 and others["hover_min"] < 40:
        payload = 0.5
    sheet = Datasheet(mass_kg=mass_kg, payload_kg=payload * mass_kg, **others)
    assert optuav.solve(sheet.mission(), perspective="battery")


def test_all_faults_are_told_at_once() -> None:
    """Missing, out of range, no number, unknown."""
    values = {**KNOWN, "mass_kg": -1, "cells": "six", "hover_min": None, "wings": 2}
    with pytest.raises(optuav.InputError) as caught:
        Datasheet(**values)
    told = {fault.key: str(fault) for fault in caught.value.faults}
    assert told == {
        "mass_kg": "mass_kg = -1: must be a number, 0.05 <= x <= 1000 [kg]",
        "cells": "cells = 'six': must be a whole number, 1 <= x <= 100 [-]",
        "hover_min": "hover_min: is missing; a number, 1 <= x <= 10000 [min]; or set hover_power_W",
        "wings": "wings = 2: unknown key",
    }


def test_there_are_ten_numbers() -> None:
    """As many as the documentation promises, beside powers in place of times."""
    assert len(Datasheet.model_fields.keys() - INSTEAD - {"battery"}) == 10


ROTORS: dict[str, Any] = {
    "mass_kg": 2.0,
    "cells": 6,
    "capacity_mAh": 5000,
    "cruise_speed_m_s": 20,
    "rotor_radius_m": 0.2,
    "blade_solidity": 0.05,
    "tip_speed_m_s": 120,
    "drag_ratio": 0.3,
}


@pytest.mark.parametrize(
    ("sheet", "values", "key"),
    [
        (
            optuav.RotorDatasheet,
            {**ROTORS, "rotor_radius_m": 0.01, "blade_solidity": 0.001, "tip_speed_m_s": 1},
            "blade_power_W",
        ),
        (
            optuav.RotorDatasheet,
            {**ROTORS, "rotors": 100, "rotor_radius_m": 20, "blade_solidity": 1, "drag_ratio": 100},
            "parasite_W_s3_m3",
        ),
        (
            Datasheet,
            {**KNOWN, "packs": 100, "capacity_mAh": 1e6, "hover_min": 1},
            "hover_current_A",
        ),
        (Datasheet, {**KNOWN, "hover_min": None, "hover_power_W": 1e6, "payload_kg": 1000}, "_W"),
    ],
)
def test_a_refusal_names_the_fields_of_the_datasheet(
    sheet: Any, values: dict[str, Any], key: str
) -> None:
    """Fields that are in range but together give no mission are named, with the key they give."""
    stated = sheet(**values)
    with pytest.raises(optuav.InputError) as caught:
        stated.mission()
    names = [fault.key.split(", ") for fault in caught.value.faults]
    assert {*itertools.chain(*names)} <= sheet.model_fields.keys()
    assert all(getattr(stated, name) is not None for name in itertools.chain(*names))
    assert any(key in fault.allowed for fault in caught.value.faults)


def test_every_key_that_follows_from_fields_is_named_with_them() -> None:
    """No key of [flight] beside the assumed ones is without its fields."""
    for sheet in (Datasheet(**KNOWN), optuav.RotorDatasheet(**ROTORS)):
        assert all(
            {*fields} <= type(sheet).model_fields.keys() for fields in sheet.sources.values()
        )
        follows = vars(sheet.mission().flight).keys() & sheet.sources.keys()
        assert follows == sheet.sources.keys()
