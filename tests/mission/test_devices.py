"""Several devices in a mission: their list, their tables, and everything that is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import optuav
from optuav.errors import InputError

PAPER = optuav.load("paper")
COLUMNS = {"name": ["a", "b"], "x_m": [400.0, 1000.0], "y_m": [2600.0, 3000.0], "z_m": [0.0, 2.0]}
TWO = PAPER.with_devices(COLUMNS)


def faults(values: dict[str, object], mission: optuav.Mission = PAPER) -> dict[str, str]:
    """Allowed values by key of all faults of a change."""
    with pytest.raises(InputError) as caught:
        mission.replace(values)
    return {fault.key: fault.allowed for fault in caught.value.faults}


def device(name: str, **more: object) -> dict[str, object]:
    return {"name": name, "position_m": [0, 2000, 0], **more}


def test_devices_replace_the_keys_of_one_and_the_other_way_round() -> None:
    assert TWO.link.device_m is None
    assert [(each.name, each.share) for each in TWO.served] == [("a", 0.5), ("b", 0.5)]
    assert TWO.replace({"link.device_m": [1000, 3000, 0]}) == PAPER
    stated = PAPER.replace({"route.hover_m": [1000, 2600, 60]})
    assert stated.replace({"devices": TWO.to_dict()["devices"]}) == TWO
    assert "link.device_m" in faults({"route.hover_m": [1000, 2600, 60]}, TWO)
    moved = TWO.replace({"devices.b.position_m": [1000, 2900, 0], "devices[0].share": None})
    assert moved.devices[1].position_m == (1000.0, 2900.0, 0.0)
    left = TWO.replace({"devices.a": None})
    assert left == PAPER.replace({"link.device_m": [1000, 3000, 2]})


def test_every_fault_of_a_list_is_told_at_once() -> None:
    listed = [
        device("a", share=0.5),
        device("a", share=2),
        device("b3", share=0.5, shre=1),
        device("hover", share=0.5, hover_m=[1, 2]),
        {"position_m": [0, 0, 0]},
    ]
    told = faults({"devices": listed, "link.device_m": [0, 0, 0]})
    assert told["link.device_m"].startswith("not beside [[devices]]")
    assert told["devices[1].share"] == "a number, 0 < x <= 1 [-]"
    assert told["devices[1].name"] == "a name of its own; devices[0] has this one"
    assert told["devices.b3.name"] == "a name that no building has"
    assert told["devices.b3.shre"] == "unknown key; did you mean 'share'?"
    assert told["devices.hover.name"] == "a name other than origin, hover, destination"
    assert told["devices.hover.hover_m"].startswith("three numbers")
    assert told["devices[4].name"].startswith("is missing")
    assert told["devices[4].share"].startswith("is missing")
    words = "a list of 1 to 100 tables [[devices]] with name, position_m"
    assert faults({"devices": []}) == {"devices": words}
    with pytest.raises(InputError, match=r"devices = 3: must be a list of 1 to 100 tables"):
        PAPER.replace({"devices": 3})
    many = [device(f"d{k}") for k in range(101)]
    assert faults({"devices": many}) == {"devices": words}
    with pytest.raises(InputError, match=r"devices = 101 tables: must be a list"):
        PAPER.replace({"devices": many})
    uneven = [device("a", share=0.5), device("b", share=0.5 - 2e-9)]
    assert faults({"devices": uneven})["devices"].startswith(
        "must have shares that add up to 1; 0.5 of "
    )
    assert PAPER.replace({"devices": [device("a", share=0.5), device("b", share=0.5 - 1e-10)]})


def test_a_file_names_a_table_of_devices(tmp_path: Path) -> None:
    """CSV and GeoJSON; beside a list, and with faults of rows, the file is refused."""
    (tmp_path / "two.csv").write_text(
        "# sensors\nname,x_m,y_m,z_m,share\na,400,2600,0,0.25\nb,1000,3000,2,0.75\n", "utf-8"
    )
    points = [
        {
            "type": "Feature",
            "properties": {"name": name},
            "geometry": {"type": "Point", "coordinates": [x, y, z]},
        }
        for name, x, y, z in zip(*COLUMNS.values(), strict=True)
    ]
    content = {"type": "FeatureCollection", "features": points}
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    (tmp_path / "two.geojson").write_text(json.dumps({**content, "crs": crs}), "utf-8")
    file = tmp_path / "own.toml"

    def load(named: str, more: str = "") -> optuav.Mission:
        file.write_text(f'schema = 1\nextends = "paper"\n{named}\n{more}', "utf-8")
        return optuav.load(file)

    assert [each.share for each in load('devices_file = "two.csv"').devices] == [0.25, 0.75]
    assert load('devices_file = "two.geojson"').devices == TWO.devices
    beside = '[[devices]]\nname = "c"\nposition_m = [0, 0, 0]'
    with pytest.raises(InputError, match=r"devices_file.*no \[\[devices\]\] beside it"):
        load('devices_file = "two.csv"', beside)
    (tmp_path / "two.csv").write_text("name,x_m,y_m,z_m\na,400,far,0\na,0,0,0\n", "utf-8")
    with pytest.raises(InputError) as caught:
        load('devices_file = "two.csv"')
    assert {fault.key for fault in caught.value.faults} == {
        "devices[0].position_m",
        "devices[1].name",
    }
    with pytest.raises(InputError, match=r"none of the suffixes .csv, .geojson"):
        load('devices_file = "two.gpkg"')
    (tmp_path / "none.csv").write_text("name,x_m,y_m,z_m\n", "utf-8")
    with pytest.raises(InputError, match=r"devices_file = 'none.csv': the file .*has no devices"):
        load('devices_file = "none.csv"')
    (tmp_path / "none.csv").unlink()
    with pytest.raises(InputError, match=r"'none.csv': the file .*: there is no such file"):
        load('devices_file = "none.csv"')


def test_columns_are_judged() -> None:
    with pytest.raises(InputError, match="x: unknown column"):
        PAPER.with_devices({**COLUMNS, "x": [1, 2]})
    with pytest.raises(InputError, match="z_m: is missing"):
        PAPER.with_devices({name: COLUMNS[name] for name in ("name", "x_m", "y_m")})
    with pytest.raises(InputError, match="of equal length"):
        PAPER.with_devices({**COLUMNS, "name": ["a"]})


def test_a_mission_of_devices_survives_its_file_and_its_template(tmp_path: Path) -> None:
    from optuav.mission.template import template

    assert optuav.load(TWO.save(tmp_path / "two.toml")).devices == TWO.devices
    (tmp_path / "new.toml").write_text(template(TWO, "new"), "utf-8")
    again = optuav.load(tmp_path / "new.toml")
    assert again.replace({"name": "paper", "description": PAPER.description}) == TWO
    assert optuav.Mission.from_dict(TWO.to_dict()) == TWO
    assert "Devices" in TWO.summary()
    assert hash(TWO) != hash(PAPER) or TWO != PAPER


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("devices.nort.position_m", "did you mean 'devices.north'?"),
        ("devices.sea.position_m", "the mission's devices are: west, north"),
        ("devices.north.positon_m", "did you mean 'position_m'?"),
        ("device.north.position_m", "did you mean 'devices.NAME.position_m'?"),
    ],
)
def test_a_wrong_key_of_a_device_suggests_one(key: str, words: str) -> None:
    """A wrong name a device's, a wrong field the fields; nothing that is not like it."""
    mission = PAPER.replace({"devices": [device("west"), device("north")]})
    refused = faults({key: [1, 2, 3]}, mission)[key]
    assert refused.endswith(words)


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("devices.nort.position_m[0]", "did you mean 'devices.north'?"),
        ("devices.north.positon_m[0]", "did you mean 'devices.north.position_m[0]'?"),
        ("devices.north.position_m", "did you mean 'devices.north.position_m[0]'?"),
        ("devices.north.hover_m[0]", "is a key only where the mission sets devices.north.hover_m;"),
        ("devices.nor.position_m[5]", "did you mean 'devices.north'?"),
        ("devices.north.share", "shares cannot vary one by one, as they add up to 1"),
    ],
)
def test_a_wrong_key_of_a_study_suggests_one(key: str, words: str) -> None:
    """Not a laser's, which was the most alike."""
    mission = PAPER.replace({"devices": [device("west"), device("north")]})
    with pytest.raises(InputError) as caught:
        optuav.batch(mission, {key: [1.0, 2.0]})
    (fault,) = caught.value.faults
    assert words in fault.allowed
    assert "laser" not in fault.allowed


@pytest.mark.parametrize("name", ["a,b", " a", "a "])
def test_a_name_that_an_order_cannot_list_is_refused(name: str) -> None:
    """``--device-order a,b`` is two names, and blanks beside commas belong to none."""
    told = faults({"devices": [device(name), device("c")]})
    assert [words[:21] for words in told.values()] == ["a name without commas"]


def test_all_wrong_keys_of_a_study_are_told_at_once() -> None:
    """A device that does not exist beside a key that no mission has."""
    mission = PAPER.replace({"devices": [device("west"), device("north")]})
    keys = ["devices.nort.position_m[0]", "devices.north.position_m[5]"]
    with pytest.raises(InputError) as caught:
        optuav.batch(mission, {key: [1.0, 2.0] for key in keys})
    assert sorted(fault.key for fault in caught.value.faults) == keys


def test_an_order_of_devices_names_those_that_it_lacks() -> None:
    with pytest.raises(InputError, match=r"each device once: a, b; without b here"):
        optuav.solve(TWO, optuav.P1(device_order=("a",)))
