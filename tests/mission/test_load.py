"""Mission files: extending, replacing, saving, and the missions that are shipped."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError
from optuav.mission import Mission, json_schema, load, shipped
from tests.examples import few
from tests.mission.strategies import SHIPPED_FILES, documents, missions

PACKAGE = Path(optuav.__file__).parent / "mission"


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file to write over and over."""
    return tmp_path_factory.mktemp("missions") / "mission.toml"


@pytest.fixture
def paper() -> Mission:
    """The shipped mission with the paper's printed parameters."""
    return load("paper")


def written(path: Path, content: str) -> Path:
    """The path, after the content was written to it under what every mission file begins with."""
    path.write_text(f"schema = 1\n{content}", "utf-8")
    return path


def keys(error: InputError) -> list[str]:
    return [fault.key for fault in error.faults]


# The shipped missions


def test_shipped_missions() -> None:
    first = ("matrice350", "paper", "paper-drag", "paper-table2", "relay-today")
    assert shipped() == (*first, "three-sensors")
    assert [load(name).name for name in shipped()] == list(shipped())


def test_paper_has_the_printed_parameters(paper: Mission) -> None:
    """Table I and the text of the paper, with what they leave out."""
    assert paper.route.origin_m == (0, 0, 50)
    assert paper.route.destination_m == (2000, 0, 50)
    assert paper.route.hover_m is None
    assert vars(paper.limits) == {
        "deadline_s": 1200,
        "min_soc": 0.05,
        "keep_soc": "end",
        "slot_s": 1,
        "outage_probability": 0.01,
        "min_altitude_m": 50,
        "max_altitude_m": 100,
    }
    assert vars(paper.battery) == {
        "packs": 2,
        "capacity_As": 36000,
        "nominal_voltage_V": 11.1,
        "available_fraction": 0.8,
        "flow_rate_per_s": 4.5e-5,
        "charge_current_A": 10,
        "charging": "constant",
        "schedule": "pooled",
        "period_s": None,
        "flight_energy_J": None,
        "hover_energy_J": None,
    }
    assert paper.rotor is not None
    assert vars(paper.rotor) == {
        "max_speed_rad_s": 1060,
        "lift_coefficient_N_s2_rad2": 3.8305e-6,
        "friction_torque_Nm": 0.04,
        "drag_coefficient_Nm_s2_rad2": 2.2518e-8,
        "viscous_damping_Nm_s_rad": 2e-4,
        "velocity_constant_rpm_V": 920,
        "resistance_ohm": 0.2,
        "inertia_kg_m2": 4.1904e-5,
    }
    assert paper.body is not None
    assert vars(paper.body) == {
        "mass_kg": 1.3,
        "gravity_m_s2": 9.8,
        "arm_length_m": 0.175,
        "inertia_x_kg_m2": 0.081,
        "inertia_y_kg_m2": 0.081,
        "inertia_z_kg_m2": 0.142,
        "drag_area_m2": 0.0,
    }
    assert paper.laser is not None
    assert vars(paper.laser) == {
        "beam": None,
        "position_m": (1000, 0, 50),
        "power_W": 1000,
        "wavelength_nm": 1550,
        "visibility_km": None,
        "attenuation_per_km": 0.1019,
        "emitter_slope": 0.34,
        "emitter_offset_W": -1.1,
        "receiver_slope": 0.5434,
        "receiver_offset_W": -0.2761,
    }
    assert vars(paper.link) == {
        "device_m": (1000, 3000, 0),
        "noise_power_W": 1e-4,
        "transmit_power_W": 5,
        "transmit_voltage_V": 1,
        "rice_factor": 20,
        "snr_threshold_dB": -11,
        "path_loss_exponent": 2,
    }
    assert paper.wind.force_N == (0, 0, 0)
    assert (paper.flight.model, paper.flight.through_buildings) == ("rotors", False)


def test_buildings_of_the_paper_mirror_each_other(paper: Mission) -> None:
    """Ten buildings of 60, 80 and 100 m in pairs, left and right of the laser at x = 1000 m."""
    heights = [building.position_m[2] for building in paper.buildings]
    assert heights == [60, 60, 60, 60, 80, 80, 80, 80, 100, 100]
    assert [building.name for building in paper.buildings] == [f"b{n}" for n in range(1, 11)]
    assert {building.footprint_m for building in paper.buildings} == {(40, 40)}
    left = [building.position_m for building in paper.buildings[::2]]
    assert left == [
        (50, 300, 60),
        (220, 800, 60),
        (400, 1300, 80),
        (700, 500, 80),
        (800, 1750, 100),
    ]
    right = [building.position_m for building in paper.buildings[1::2]]
    assert right == [(2000 - x, y, z) for x, y, z in left]


def test_table2_differs_from_the_paper_in_its_loads_only(paper: Mission) -> None:
    """Fitted loads; voltages and energies are those that the paper reports for them."""
    table2 = load("paper-table2")
    assert table2.flight.model == "regimes"
    assert vars(table2.flight) == {
        "model": "regimes",
        "obstacles": None,
        "clearance_m": None,
        "max_altitude_m": None,
        "through_buildings": False,
        "acceleration_m_s2": 12.2349,
        "max_speed_m_s": None,
        "flight_current_A": 93.658,
        "flight_power_W": 1443.05,
        "hover_current_A": 72.073,
        "hover_power_W": 1032.82,
        "rest_current_A": 0,
        "rest_power_W": 0,
        "charge_current_A": 5.992,
        "charge_power_W": 66.515,
    }
    assert table2.battery.flight_energy_J == pytest.approx(2 * 36000 * 15.4, rel=1e-12)
    assert table2.battery.hover_energy_J == pytest.approx(2 * 36000 * 14.33, rel=1e-12)
    back = table2.replace(
        {
            "name": "paper",
            "description": paper.description,
            "flight.model": "rotors",
            "battery.flight_energy_J": None,
            "battery.hover_energy_J": None,
        }
    )
    assert back == paper


@pytest.mark.parametrize("content", SHIPPED_FILES, ids=shipped())
def test_every_shipped_value_says_where_it_comes_from(content: bytes) -> None:
    """Each value outside [[buildings]] has a comment, and the first line names the schema."""
    text = content.decode("utf-8")
    first, *lines = text.partition("[[buildings]]")[0].splitlines()
    assert first == "#:schema ../mission.schema.json"
    values = [line for line in lines if "=" in line and not line.startswith("#")]
    exempt = ("schema", "extends", "description", 'model = "regimes"')
    assert all("#" in line for line in values if not line.startswith(exempt))


# Reading


def test_a_file_is_called_as_it_says_or_as_it_is_called(tmp_path: Path) -> None:
    """The name of the file stands in for a name that is not stated; extending passes none on."""
    base = written(tmp_path / "base.toml", "extends = 'paper'\nname = 'north'\ndescription = 'x'")
    assert load(base).name == "north"
    other = load(written(tmp_path / "other.toml", "extends = 'base.toml'"))
    assert (other.name, other.description) == ("other", "")
    assert load(str(written(tmp_path / "bell\a.toml", "extends = 'paper'"))).name == "bell�"


def test_extends_states_only_what_differs(tmp_path: Path, paper: Mission) -> None:
    """Tables join key by key over several files and directories; the rest stays the same."""
    (tmp_path / "bases").mkdir()
    written(tmp_path / "bases" / "late.toml", "extends = 'paper'\nlimits.deadline_s = 2000")
    top = written(
        tmp_path / "top.toml",
        "extends = 'bases/late.toml'\nlimits.min_soc = 0.2\nlimits.slot_s = 3",
    )
    expected = {"name": "top", "description": "", "limits.deadline_s": 2000}
    expected |= {"limits.min_soc": 0.2, "limits.slot_s": 3}
    assert load(top) == paper.replace(expected)


def test_buildings_replace_the_list(tmp_path: Path) -> None:
    """A file that states buildings has no others, and may have none."""
    content = "extends = 'paper'\n[[buildings]]\nname = 'hangar'\nposition_m = [1, 2, 3]"
    mission = load(written(tmp_path / "one.toml", content))
    assert [(building.name, building.position_m) for building in mission.buildings] == [
        ("hangar", (1.0, 2.0, 3.0))
    ]
    assert not load(written(tmp_path / "no.toml", "extends = 'paper'\nbuildings = []")).buildings


def test_a_shipped_name_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file called paper is reached by a path, the shipped mission by its name."""
    monkeypatch.chdir(tmp_path)
    written(Path("paper"), "extends = 'paper'\nlimits.deadline_s = 5")
    assert load("paper").limits.deadline_s == 1200
    assert load("./paper").limits.deadline_s == 5


def test_faults_name_the_file_that_stated_the_value(tmp_path: Path) -> None:
    """In a chain each fault points to where it has to be repaired."""
    base = written(
        tmp_path / "base.toml",
        "extends = 'paper'\nlimits.min_soc = 2\nlimits.deadline_s = -1\nlink.colour = 'red'\n"
        "[[buildings]]\nposition_m = [1, 2]",
    )
    top = written(tmp_path / "top.toml", "extends = 'base.toml'\nlimits.deadline_s = 9\nwind = 1")
    with pytest.raises(InputError) as caught:
        load(top)
    assert {(fault.key, fault.source) for fault in caught.value.faults} == {
        ("limits.min_soc", str(base)),
        ("link.colour", str(base)),
        ("buildings[0].name", str(base)),
        ("buildings[0].position_m", str(base)),
        ("wind", str(top)),
    }


def test_a_fault_between_files_names_the_mission_that_is_shipped(tmp_path: Path) -> None:
    """A lowered ceiling contradicts the floor, and the ceiling is what was stated here."""
    top = written(tmp_path / "top.toml", "extends = 'paper'\nlimits.min_altitude_m = 200")
    with pytest.raises(InputError) as caught:
        load(top)
    assert str(caught.value) == (
        "paper: limits.max_altitude_m = 100: must be a number, x >= min_altitude_m = 200 [m]"
    )


def test_an_empty_file_lists_all_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load(written(tmp_path / "empty.toml", ""))
    assert sorted(keys(caught.value)) == ["battery", "body", "limits", "link", "rotor", "route"]
    assert all(fault.allowed.startswith("is missing; a table [") for fault in caught.value.faults)
    assert all(fault.value == "" for fault in caught.value.faults)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("limits.deadline = 1", {"limits.deadline": "unknown key; did you mean 'deadline_s'?"}),
        ("deadline_s = 1", {"deadline_s": "unknown key; did you mean 'limits.deadline_s'?"}),
        ("link.mass_kg = 1", {"link.mass_kg": "unknown key; did you mean 'body.mass_kg'?"}),
        ("limit.min_soc = 1", {"limit": "unknown key; did you mean 'limits'?"}),
        ("building = []", {"building": "unknown key; did you mean 'buildings'?"}),
        ("xyz = 1", {"xyz": "unknown key"}),
        ("extend = 'a'", {"extend": "unknown key; did you mean 'extends'?"}),
    ],
)
def test_unknown_keys_come_with_the_nearest(
    tmp_path: Path, content: str, expected: dict[str, str]
) -> None:
    """A key of that name elsewhere, or the key most like it."""
    with pytest.raises(InputError) as caught:
        load(written(tmp_path / "m.toml", f"extends = 'paper'\n{content}"))
    assert {fault.key: fault.allowed for fault in caught.value.faults} == expected


# Displacing


@pytest.mark.parametrize("how", ["file", "replace"])
def test_a_newly_stated_value_displaces_its_twin(tmp_path: Path, paper: Mission, how: str) -> None:
    """The flow rate by its other unit, the attenuation by the visibility and back."""

    def restated(base: str, key: str, value: float) -> Mission:
        if how == "replace":
            return load(base).replace({key: value})
        return load(written(tmp_path / f"{key}.toml", f"extends = '{base}'\n{key} = {value}"))

    assert restated("paper", "battery.flow_rate_per_min", 0.06).battery.flow_rate_per_s == 0.001
    hazy = restated("paper", "laser.visibility_km", 3).laser
    assert hazy is not None
    assert (hazy.visibility_km, hazy.attenuation_per_km) == (3.0, None)
    base = str(tmp_path / "hazy.toml")
    paper.replace({"laser.visibility_km": 3}).save(base)
    clear = restated(base, "laser.attenuation_per_km", 0.2).laser
    assert clear is not None
    assert (clear.visibility_km, clear.attenuation_per_km) == (None, 0.2)


def test_a_new_wavelength_displaces_the_coefficients(paper: Mission) -> None:
    """They are those of the wavelength; one without known coefficients needs its own."""
    laser = paper.replace({"laser.wavelength_nm": 810}).laser
    assert laser is not None
    assert laser.emitter_slope == 0.445
    assert laser.emitter_offset_W == -0.75
    assert laser.receiver_slope == 0.5414
    assert laser.receiver_offset_W == -0.2313
    own = paper.replace({"laser.emitter_slope": 0.5})
    same = own.replace({"laser.wavelength_nm": 1550}).laser
    assert same is not None
    assert same.emitter_slope == 0.5
    with pytest.raises(InputError) as caught:
        paper.replace({"laser.wavelength_nm": 1064})
    assert keys(caught.value) == [
        "laser.emitter_slope",
        "laser.emitter_offset_W",
        "laser.receiver_slope",
        "laser.receiver_offset_W",
    ]


def test_what_is_missing_since_it_was_displaced_is_said_to_be(tmp_path: Path) -> None:
    """Not that the mission had left it out; nor of what it never stated."""
    told = "a new laser.wavelength_nm replaces the old one; set both"
    top = "extends = 'matrice350'\nlaser.wavelength_nm = 1064\nlaser.emitter_slope = 0.3"
    with pytest.raises(InputError) as in_a_file:
        load(written(tmp_path / "top.toml", top))
    with pytest.raises(InputError) as in_python:
        load("matrice350").replace({"laser.wavelength_nm": 1064, "laser.emitter_slope": 0.3})
    for caught in (in_a_file, in_python):
        others = ["emitter_offset_W", "receiver_slope", "receiver_offset_W"]
        assert sorted(keys(caught.value)) == sorted(f"laser.{name}" for name in others)
        assert all(fault.allowed.endswith(told) for fault in caught.value.faults)
    with pytest.raises(InputError) as never_stated:
        load("matrice350").replace({"laser.power_W": None, "laser.wavelength_nm": 810})
    assert told not in str(never_stated.value)


def test_a_new_capacity_displaces_the_energies_of_the_old_one() -> None:
    """E_1 and E_2 belong to the full battery; stated together with it they stay."""
    table2 = load("paper-table2")
    for change in ({"battery.packs": 3}, {"battery.capacity_As": 48000}):
        battery = table2.replace(change).battery
        assert (battery.flight_energy_J, battery.hover_energy_J) == (None, None)
    unchanged = {"battery.packs": 2, "battery.capacity_As": 36000, "battery.charge_current_A": 9}
    assert table2.replace(unchanged).battery.flight_energy_J == 1108800
    both = table2.replace({"battery.capacity_As": 1, "battery.flight_energy_J": 2}).battery
    assert (both.flight_energy_J, both.hover_energy_J) == (2.0, None)


def test_twins_stated_together_are_a_fault(tmp_path: Path, paper: Mission) -> None:
    """Nothing is displaced within one statement."""
    both = "flow_rate_per_s = 1e-5\nflow_rate_per_min = 6e-4"
    with pytest.raises(InputError) as caught:
        load(written(tmp_path / "m.toml", f"extends = 'paper'\n[battery]\n{both}"))
    assert keys(caught.value) == ["battery.flow_rate_per_min"]
    with pytest.raises(InputError, match="either visibility_km or attenuation_per_km, not both"):
        paper.replace({"laser.visibility_km": 10, "laser.attenuation_per_km": 0.1})


# Replacing


def test_replace_by_dotted_key(paper: Mission) -> None:
    """Values, positions, buildings by name and place; the old mission stays as it was."""
    changed = paper.replace(
        {
            "limits.deadline_s": 800,
            "buildings.b3.position_m": [300, 800, 60],
            "buildings[4].footprint_m": None,
            "buildings.b10": None,
            "route.hover_m": (1000, 2500, 60),
            "wind": {"force_N": [1, 0, 0]},
            "name": "changed",
        }
    )
    assert changed.limits.deadline_s == 800
    assert changed.buildings[2].position_m == (300, 800, 60)
    assert changed.buildings[4].footprint_m is None
    assert [building.name for building in changed.buildings] == [f"b{n}" for n in range(1, 10)]
    assert changed.route.hover_m == (1000, 2500, 60)
    assert changed.wind.force_N == (1, 0, 0)
    assert paper == load("paper")
    assert changed.replace({"route.hover_m": None}).route.hover_m is None


def test_replace_takes_what_python_has(paper: Mission) -> None:
    """NumPy's numbers and arrays, and parts of another mission."""
    assert paper.replace({"limits.deadline_s": np.int64(800)}).limits.deadline_s == 800
    assert paper.replace({"limits.min_soc": np.float64(0.5)}).limits.min_soc == 0.5
    origin = paper.replace({"route.origin_m": np.array([1, 2, 3])}).route.origin_m
    assert origin == (1.0, 2.0, 3.0)
    assert [type(x) for x in origin] == [float] * 3
    fewer = paper.replace({"buildings": paper.buildings[:3], "limits": load("paper-table2").limits})
    assert fewer.buildings == paper.buildings[:3]
    dark = paper.replace({"laser": None})
    assert dark.laser is None
    assert dark.replace({"laser": paper.laser}) == paper


def test_replace_lists_every_fault(paper: Mission) -> None:
    """Unknown keys with the nearest known one, and values that are not allowed."""
    known = ", ".join(paper.buildings.names)
    with pytest.raises(InputError) as caught:
        paper.replace(
            {
                "limits.deadlines": 800,
                "limit.min_soc": 0.5,
                "deadline_s": 800,
                "schema": 1,
                "buildings.b33.position_m": [1, 2, 3],
                "buildings[10].name": "b11",
                "buildings.b3.colour": "red",
                "buildings.b4.position_m": [1, 2],
                "limits.min_soc": 1,
                "route.origin_m": None,
                "battery.packs": 2.5,
            }
        )
    assert {fault.key: fault.allowed for fault in caught.value.faults} == {
        "limits.deadlines": "unknown key; did you mean 'limits.deadline_s'?",
        "limit.min_soc": "unknown key; did you mean 'limits.min_soc'?",
        "deadline_s": "unknown key; did you mean 'limits.deadline_s'?",
        "schema": "unknown key",
        "buildings.b33.position_m": f"the mission's buildings are: {known}; "
        "did you mean 'buildings.b3'?",
        "buildings[10].name": f"the mission's buildings [0] to [9] are: {known}",
        "buildings.b3.colour": "unknown key",
        "buildings.b4.position_m": "three numbers [x, y, z], |x| and |y| <= 1e6, 0 <= z <= 1e6 [m]",
        "limits.min_soc": "a number, 0 <= x < 1 [-]",
        "route.origin_m": "is missing; three numbers [x, y, z], each |x| <= 1e6 [m]",
        "battery.packs": "a whole number, 1 <= x <= 1000 [-]",
    }


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (None, [""]),
        ({3: 1}, ["3"]),
        ({"buildings": 3, "buildings.b1.name": "x"}, ["buildings", "buildings.b1.name"]),
        ({"buildings": [{"name": []}], "buildings.b1.name": "x"}, None),
        ({"battery": {"packs": np.array([1, 2])}}, ["battery.packs"]),
        ({"limits.min_soc": np.array(["a"])}, ["limits.min_soc"]),
        ({"buildings.b1": 3}, ["buildings[0]"]),
        ({"": 1}, [""]),
    ],
    ids=str,
)
def test_replace_refuses_the_absurd(
    paper: Mission, values: Any, expected: list[str] | None
) -> None:
    """Whatever is passed, the answer is the one error."""
    with pytest.raises(InputError) as caught:
        paper.replace(values)
    assert expected is None or set(keys(caught.value)) == set(expected)


def test_names_with_dots_are_reached(paper: Mission) -> None:
    """A building's name is not taken apart."""
    named = paper.replace({"buildings.b1.name": "St. Mary", "buildings.b2.name": "St. Mary.tower"})
    moved = named.replace(
        {"buildings.St. Mary.position_m": [1, 2, 3], "buildings.St. Mary.tower": None}
    )
    assert moved.buildings[0].position_m == (1, 2, 3)
    assert len(moved.buildings) == 9


@pytest.mark.campaign
@few(10, most=1000)
@given(mission=missions(), data=st.data())
def test_replacing_a_value_by_itself_changes_nothing(mission: Mission, data: st.DataObject) -> None:
    """Whatever the key: nothing is displaced by a value that was there."""
    tables = mission.to_dict()
    tables.pop("schema")
    name = data.draw(st.sampled_from(sorted(tables)))
    if isinstance(tables[name], dict) and tables[name]:
        key = data.draw(st.sampled_from(sorted(tables[name])))
        assert mission.replace({f"{name}.{key}": tables[name][key]}) == mission
    assert mission.replace({name: tables[name]}) == mission


# Saving


@pytest.mark.campaign
@few(10, most=1000)
@given(mission=missions())
def test_a_saved_mission_is_read_again(scratch: Path, mission: Mission) -> None:
    """File, dict, JSON and pickle give the same mission to the last digit."""
    mission.save(scratch)
    assert load(scratch) == mission
    assert Mission.from_dict(mission.to_dict()) == mission
    assert Mission.from_dict(json.loads(json.dumps(mission.to_dict()))) == mission
    copy = pickle.loads(pickle.dumps(mission))
    assert copy == mission
    assert hash(copy) == hash(mission)


@pytest.mark.campaign
@few(10, most=1000)
@given(document=documents())
def test_what_is_stated_is_what_is_kept(document: dict[str, object]) -> None:
    """No stated value is changed, lost or moved, but for the rate per minute."""
    kept = Mission.from_dict(document).to_dict()
    battery = document["battery"]
    assert isinstance(battery, dict)
    if "flow_rate_per_min" in battery:
        per_s = battery.pop("flow_rate_per_min") / 60
        battery["flow_rate_per_s"] = per_s
    for name, table in document.items():
        if isinstance(table, dict):
            assert table.items() <= kept[name].items()
        else:
            assert kept[name] == table


def test_a_saved_file_is_complete_and_readable(tmp_path: Path, paper: Mission) -> None:
    """It extends nothing, and an array takes one line."""
    path = tmp_path / "saved.toml"
    load("paper-table2").replace(
        {
            "description": 'brackets [\n    1,\n    2,\n] and "quotes"',
            "buildings": paper.buildings[:1],
        }
    ).save(path)
    text = path.read_text("utf-8")
    assert "extends" not in tomllib.loads(text)
    assert "\nposition_m = [1000.0, 0.0, 50.0]\n" in text
    assert tomllib.loads(text)["description"] == 'brackets [\n    1,\n    2,\n] and "quotes"'


def test_a_polygon_is_saved_on_one_line(tmp_path: Path, paper: Mission) -> None:
    corners = [[0, 200], [100, 200], [100, 400], [0, 400]]
    mission = paper.replace({"buildings.b1.footprint_m": corners})
    mission.save(tmp_path / "saved.toml")
    line = "footprint_m = [[0.0, 200.0], [100.0, 200.0], [100.0, 400.0], [0.0, 400.0]]\n"
    assert line in (tmp_path / "saved.toml").read_text("utf-8")
    assert load(tmp_path / "saved.toml") == mission


def test_saving_is_whole_or_not_at_all(
    tmp_path: Path, paper: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interrupted write leaves the old file and no other."""
    path = written(tmp_path / "kept.toml", "extends = 'paper'")
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(InputError, match=r"kept\.toml: cannot be written: No space left on device"):
        paper.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_saving_where_that_is_impossible(
    tmp_path: Path, paper: Mission, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Missing directory, a directory in the way, no permission."""
    with pytest.raises(InputError, match="there is no directory"):
        paper.save(tmp_path / "missing" / "m.toml")
    with pytest.raises(InputError, match="is a directory, not a file"):
        paper.save(tmp_path)
    with pytest.raises(InputError, match="is not a possible path"):
        paper.save("a\0b")

    def refuse(path: object, *_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(InputError, match=r"m\.toml: cannot be written: Permission denied"):
        paper.save(tmp_path / "m.toml")


def test_saving_follows_a_link(tmp_path: Path, paper: Mission) -> None:
    """The file that the link leads to is written; the link stays one."""
    link = tmp_path / "link.toml"
    link.symlink_to(tmp_path / "real.toml")
    paper.save(link)
    assert link.is_symlink()
    assert load(tmp_path / "real.toml") == paper


# For editors


def test_the_json_schema_knows_what_files_may_state() -> None:
    """Both flow rates, extends, and no more requirements than a file that extends has."""
    schema = json_schema()
    assert schema["required"] == ["schema"]
    assert {"extends", "schema", "name", "buildings"} <= schema["properties"].keys()
    definitions = schema["definitions"]
    assert definitions["BatteryPacks"]["properties"]["flow_rate_per_min"]["maximum"] == 6e4
    requiring = [name for name, definition in definitions.items() if "required" in definition]
    assert requiring == ["Building", "Device"]
    assert set(schema["then"]["required"]) == {"route", "limits", "battery", "link"}
    assert "null" not in json.dumps(schema)


def test_reading_a_mission_imports_no_heavy_library() -> None:
    """Footprints that are sizes need no geometry, and files no physics."""
    code = (
        "import sys, optuav; optuav.load('paper-table2'); print(*sorted("
        "{'numpy', 'scipy', 'shapely', 'networkx', 'cvxpy', 'casadi'} & set(sys.modules)))"
    )
    process = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=PACKAGE.parents[1],
    )
    assert process.stdout.strip() == ""


def test_buildings_from_a_table(tmp_path: Path) -> None:
    """Columns of a CSV file by pandas, and the same as plain lists; NaN is no footprint."""
    pandas = pytest.importorskip("pandas")
    path = tmp_path / "roofs.csv"
    path.write_text("name,x_m,y_m,z_m,width_m,depth_m\na,0,500,60,20,30\nb,90,700,40,,\n", "utf-8")
    paper = optuav.load("paper")
    mission = paper.with_buildings(pandas.read_csv(path))
    assert (
        mission.buildings
        == paper.replace(
            {
                "buildings": [
                    {"name": "a", "position_m": [0, 500, 60], "footprint_m": [20, 30]},
                    {"name": "b", "position_m": [90, 700, 40]},
                ]
            }
        ).buildings
    )
    empty = dict.fromkeys(("name", "x_m", "y_m", "z_m"), ())
    assert not paper.with_buildings(empty).buildings


def test_a_table_of_buildings_is_refused_with_all_its_faults() -> None:
    paper = optuav.load("paper")
    with pytest.raises(optuav.InputError) as caught:
        paper.with_buildings({"name": ["a"], "x_mm": [0, 1], "y_m": [0], "z_m": [1]})
    told = sorted(map(str, caught.value.faults))
    assert told == [
        "columns = name 1, x_mm 2, y_m 1, z_m 1: must be of equal length",
        "x_m: is missing",
        "x_mm: unknown column; did you mean 'x_m'?",
    ]
    nan = float("nan")
    with pytest.raises(optuav.InputError, match=r"buildings\.a\.footprint_m"):
        paper.with_buildings(
            {"name": ["a"], "x_m": [0], "y_m": [9], "z_m": [1], "width_m": [3], "depth_m": [nan]}
        )


@pytest.mark.parametrize("table", [None, [1, 2], "abc", {"name": 3}, {"name": "abc"}])
def test_what_is_no_table_of_buildings_is_refused_in_words(table: Any) -> None:
    with pytest.raises(optuav.InputError, match="columns by name"):
        optuav.load("paper").with_buildings(table)


@pytest.mark.parametrize(("rows", "words"), [(3, "a DataFrame of 3 rows"), (1, "of 1 row:")])
@pytest.mark.parametrize("reader", [optuav.load, optuav.load_plan, optuav.check_solutions])
def test_a_refused_table_is_named_not_printed(
    reader: Callable[[Any], object], rows: int, words: str
) -> None:
    pandas = pytest.importorskip("pandas")
    with pytest.raises(InputError) as refusal:
        reader(pandas.DataFrame({"name": ["roof"] * rows, "height_m": 12.0}))
    assert words in str(refusal.value)
    assert "roof" not in str(refusal.value)


def test_a_pickled_mission_is_changed_in_a_process_that_has_read_none(tmp_path: Path) -> None:
    """Workers get missions so; pydantic before 2.14 builds no class for what it reads so."""
    (file := tmp_path / "mission").write_bytes(pickle.dumps(optuav.load("relay-today")))
    code = (
        f"import pickle; mission = pickle.loads(open({str(file)!r}, 'rb').read())\n"
        "print(mission.replace({'limits.deadline_s': 800}).limits.deadline_s)"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert (process.stdout, process.stderr) == ("800.0\n", "")
