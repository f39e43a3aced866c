"""Missions that name a file with a table of buildings."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.mission.buildings import TableFile
from optuav.mission.table_files import fingerprint, geoparquet

PAPER = optuav.load("paper")
ROOFS = """# Roofs of a block
name,x_m,y_m,z_m,width_m,depth_m
"b, east",300, 900 ,60,20,30

,,,,,
c,7e2,1200,40,,
"""
SQUARE = [[0.0, 0.0], [30.0, 0.0], [30.0, 20.0], [0.0, 20.0]]
POLYGONS = [
    {"name": "a", "position_m": [10.0, 5.0, 12.0], "footprint_m": SQUARE},
    {"name": "b", "position_m": [500.0, 5.0, 8.5]},
    {
        "name": "ü",
        "position_m": [110.0, 5.0, 30.0],
        "footprint_m": [[x + 100.0, y] for x, y in SQUARE],
    },
]


def written(folder: Path, table: str = "roofs.csv", content: str | bytes = ROOFS) -> Path:
    """A mission file with its table."""
    folder.mkdir(exist_ok=True)
    place = folder / table
    place.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    mission = folder / "block.toml"
    mission.write_text(f'schema = 1\nextends = "paper"\nbuildings_file = "{table}"\n', "utf-8")
    return mission


def refusal(file: Path) -> list[str]:
    with pytest.raises(optuav.InputError) as caught:
        optuav.load(file)
    return list(map(str, caught.value.faults))


def test_a_csv_file_states_what_tables_state(tmp_path: Path) -> None:
    mission = optuav.load(written(tmp_path))
    rows = [
        {"name": "b, east", "position_m": [300.0, 900.0, 60.0], "footprint_m": [20.0, 30.0]},
        {"name": "c", "position_m": [700.0, 1200.0, 40.0]},
    ]
    assert (
        mission.to_dict()
        == PAPER.replace({"name": "block", "description": "", "buildings": rows}).to_dict()
    )
    table = tmp_path / "roofs.csv"
    assert mission.buildings.source == TableFile(str(table), fingerprint(table), 2)
    later = mission.replace({"limits.deadline_s": 900})
    assert later.buildings.source == mission.buildings.source
    assert mission.replace({"buildings.c": None}).buildings.source is None
    # FIPS 180-4, the message "abc".
    digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    table.write_bytes(b"abc")
    assert fingerprint(table) == digest


def test_a_saved_mission_names_its_table(tmp_path: Path) -> None:
    """From another folder; and not if the table is another one by then, or gone."""
    mission = optuav.load(written(tmp_path / "maps"))
    saved = tmp_path / "saved.toml"
    mission.save(saved)
    text = saved.read_text("utf-8")
    assert 'buildings_file = "maps/roofs.csv"' in text
    assert "[[buildings]]" not in text
    assert optuav.load(saved) == mission
    table = tmp_path / "maps" / "roofs.csv"
    table.write_text(ROOFS.replace("7e2", "7e1"), "utf-8")
    with pytest.raises(optuav.InputError, match=r"roofs\.csv: is another table: its SHA-256 hash"):
        mission.save(tmp_path / "other.toml")
    table.unlink()
    with pytest.raises(optuav.InputError, match=r"roofs\.csv: there is no such file"):
        mission.save(tmp_path / "other.toml")
    assert not (tmp_path / "other.toml").exists()


def test_a_new_list_takes_the_place_of_a_table_and_a_table_that_of_a_list(tmp_path: Path) -> None:
    written(tmp_path)
    above = tmp_path / "above.toml"
    roof = '[[buildings]]\nname = "hut"\nposition_m = [1, 2, 3]\n'
    above.write_text(f'schema = 1\nextends = "block.toml"\n{roof}', "utf-8")
    assert optuav.load(above).buildings.names == ("hut",)
    above.write_text('schema = 1\nextends = "block.toml"\n', "utf-8")
    assert optuav.load(above).buildings.names == ("b, east", "c")


HEAD = "name,x_m,y_m,z_m\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["has no header; its columns are name, x_m, y_m, z_m"]),
        ("# only remarks\n\n", ["has no header; its columns are name, x_m, y_m, z_m"]),
        ("name,x,y_m,z_m\na,1,2,3\n", ["x: unknown column", "x_m: is missing"]),
        ("name,x_m,y_m,z_m,z_m\n", ["z_m: is there twice"]),
        (
            HEAD + "a,1,2\nb,1,2,3\nc,1,2,3,4\n",
            ["row 1: has 3 cells, not 4", "row 3: has 5 cells, not 4"],
        ),
        (HEAD + "a,1,2,nan\n", ["buildings.a.position_m = [1.0, 2.0, nan]: must be three numbers"]),
        (HEAD + "a,1,2,\n", ["buildings.a.position_m = [1.0, 2.0, None]: must be three numbers"]),
        (HEAD + "a,1,2,3m\n", ["buildings.a.position_m = [1.0, 2.0, '3m']: must be three numbers"]),
        (
            HEAD + "a,1_0,2,3\n",
            ["buildings.a.position_m = ['1_0', 2.0, 3.0]: must be three numbers"],
        ),
        (HEAD + "a,1,2,-3\na,1,2,3\n", ["buildings[0].position_m", "buildings[1].name = 'a'"]),
        (HEAD + ",1,2,3\nhover,1,2,3\n", ["buildings[0].name = ''", "buildings.hover.name"]),
        (b"\xff\xfe", ["is not text in UTF-8"]),
        (HEAD + '"' + "x" * 200_000 + '",1,2,3\n', ["is not CSV: field larger than"]),
    ],
)
def test_a_wrong_csv_file_is_refused_with_all_its_faults(
    content: str | bytes, words: list[str], tmp_path: Path
) -> None:
    found = refusal(written(tmp_path, content=content))
    assert len(found) == len(words)
    for told, expected in zip(found, words, strict=True):
        assert "roofs.csv: " in told
        assert expected in told


def test_faults_of_a_mission_and_of_its_table_are_told_together(tmp_path: Path) -> None:
    file = written(tmp_path, content=HEAD + "a,1,2,nan\n")
    file.write_text(file.read_text("utf-8") + "\n[limits]\nmin_soc = 2\n", "utf-8")
    first, second = refusal(file)
    assert "roofs.csv: buildings.a.position_m" in first
    assert "block.toml: limits.min_soc = 2" in second


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ('"none.csv"', "buildings_file = 'none.csv': "),
        ('"."', "is no regular file"),
        ("3", "buildings_file = 3: must be a path relative to this file"),
        ('"block.toml"', "has none of the suffixes .csv, .parquet"),
        ('"a\\u0000b.csv"', "there is no such file"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(stated: str, words: str, tmp_path: Path) -> None:
    file = written(tmp_path)
    file.write_text(f'schema = 1\nextends = "paper"\nbuildings_file = {stated}\n', "utf-8")
    (told,) = refusal(file)
    assert told.startswith(str(file))
    assert words in told


def test_a_table_and_a_list_exclude_each_other(tmp_path: Path) -> None:
    file = written(tmp_path)
    file.write_text(file.read_text("utf-8") + "buildings = []\n", "utf-8")
    (told,) = refusal(file)
    assert "no [[buildings]] beside it" in told
    with pytest.raises(optuav.InputError, match=r"buildings_file.*only in a mission file"):
        optuav.Mission.from_dict({**PAPER.to_dict(), "buildings_file": "roofs.csv"})


# Maps


@pytest.fixture
def geopandas() -> Any:
    pytest.importorskip("pyarrow")
    return pytest.importorskip("geopandas")


def frame_of(geopandas: Any, crs: str | None = "EPSG:25832", **changes: Any) -> Any:
    """The three buildings as a table: two outlines and a point."""
    import shapely

    shapes = [shapely.Polygon(SQUARE), shapely.Point(500, 5)]
    shapes.append(shapely.MultiPolygon([shapely.Polygon(POLYGONS[2]["footprint_m"])]))
    columns = {"name": ["a", "b", "ü"], "z_m": [12.0, 8.5, 30.0]}
    columns |= {"x_m": [10.0, 500.0, 110.0], "y_m": [5, 5, 5], "colour": ["red", None, "blue"]}
    geometry = changes.pop("geometry", shapes)
    columns = {k: v for k, v in {**columns, **changes}.items() if v is not None}
    return geopandas.GeoDataFrame(columns, geometry=geometry, crs=crs)


def on_disk(frame: Any, folder: Path, name: str) -> Path:
    """A mission that names the frame as a file."""
    file = written(folder, name, b"")
    (folder / name).unlink()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frame.to_parquet(folder / name) if "parquet" in name else frame.to_file(folder / name)
    return file


@pytest.mark.parametrize("name", ["roofs.parquet", "roofs.gpkg", "roofs.geojson"])
def test_a_map_in_metres_states_outlines_and_points(
    name: str, geopandas: Any, tmp_path: Path
) -> None:
    mission = optuav.load(on_disk(frame_of(geopandas), tmp_path, name))
    assert mission.buildings.rows() == POLYGONS
    without = frame_of(geopandas, x_m=None, y_m=None)
    inside = optuav.load(on_disk(without, tmp_path / "other", name)).buildings
    assert inside.roof_m[:, 2].tolist() == [12.0, 8.5, 30.0]
    assert inside.roof_m[1, :2].tolist() == [500.0, 5.0]
    assert (inside.roof_m[[0, 2], :2] > [[0, 0], [100, 0]]).all()
    assert (inside.roof_m[[0, 2], :2] < [[30, 20], [130, 20]]).all()


def test_a_map_that_does_not_fit_is_refused(geopandas: Any, tmp_path: Path) -> None:
    """Degrees, missing and wrong columns and heights, courtyards, and what is no map at all."""
    import shapely

    ring = shapely.Polygon(SQUARE).buffer(9.0)
    yard = ring.difference(shapely.Polygon(SQUARE))
    shapes = [yard, shapely.LineString([(0, 0), (1, 1)]), None]
    cases: list[tuple[Any, list[str]]] = [
        (frame_of(geopandas, "EPSG:4326"), ["has x and y in degree, not in metres; optuav city"]),
        (frame_of(geopandas, "EPSG:2263"), ["has x and y in US survey foot, not in metres"]),
        (frame_of(geopandas, z_m=None, height=[1, 2, 3]), ["z_m: is missing; there are name, x_m"]),
        (frame_of(geopandas, z_m=["1", "two", "3"]), ["z_m: must be a column of numbers"]),
        (
            frame_of(geopandas, z_m=[1.0, float("nan"), -1.0], name=["a", "a", "b"]),
            ["buildings[1].position_m", "buildings.b.position_m", "buildings[1].name = 'a'"],
        ),
        (
            frame_of(geopandas, geometry=shapes),
            [
                "buildings[0].footprint_m = Polygon: must be one polygon",
                "buildings[1].footprint_m = Line",
            ],
        ),
        (
            frame_of(geopandas, x_m=[99.0, 1.0, 110.0]),
            ["buildings.a.footprint_m = ", "contains x and y of position_m"],
        ),
    ]
    for number, (frame, words) in enumerate(cases):
        found = refusal(on_disk(frame, tmp_path / str(number), "roofs.parquet"))
        assert all(each in "\n".join(found) for each in words), found
        assert all("roofs.parquet: " in each for each in found)
    open_ring = '{"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9]]]}'
    broken = f'{{"type": "Feature", "properties": {{"name": "a"}}, "geometry": {open_ring}}}'
    for name in ("roofs.parquet", "roofs.gpkg", "roofs.geojson"):
        for content in ("no map", f'{{"type": "FeatureCollection", "features": [{broken}]}}'):
            (told,) = refusal(written(tmp_path / "no map", name, content))
            assert f"{name}: " in told
            assert re.search(
                r"is not a table that|is damaged|is no \.gpkg file but|is not JSON|in degree", told
            )


def test_a_parquet_file_without_geometry_has_the_columns_of_csv(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    table = {"name": ["b, east", "c"], "x_m": [300, 700], "y_m": [900.0, 1200.0], "z_m": [60, 40]}
    table |= {"width_m": [20.0, None], "depth_m": [30.0, None]}
    file = written(tmp_path, "roofs.parquet", b"")
    parquet.write_table(pyarrow.table(table), tmp_path / "roofs.parquet")
    expected = optuav.load(written(tmp_path / "csv")).buildings.rows()
    assert optuav.load(file).buildings.rows() == expected
    parquet.write_table(pyarrow.table({**table, "z_m": [-1, None]}), tmp_path / "roofs.parquet")
    first, second = refusal(file)
    assert "roofs.parquet: buildings['b, east'].position_m" in first.replace(
        "buildings.b, east", "buildings['b, east']"
    )
    assert "buildings.c.position_m = [700, 1200.0, nan]" in second
    parquet.write_table(pyarrow.table({"name": [], "x_m": []}), tmp_path / "roofs.parquet")
    assert [each.rpartition(": ")[2] for each in refusal(file)] == ["is missing", "is missing"]


def test_a_geopackage_with_two_layers_is_refused(geopandas: Any, tmp_path: Path) -> None:
    file = on_disk(frame_of(geopandas), tmp_path, "roofs.gpkg")
    frame_of(geopandas).to_file(tmp_path / "roofs.gpkg", layer="more")
    (told,) = refusal(file)
    assert "it has 2 layers, not one" in told


def test_what_is_written_as_geoparquet_comes_back(geopandas: Any, tmp_path: Path) -> None:
    """The same bytes each time, and every corner."""
    buildings = PAPER.replace({"buildings": POLYGONS}).buildings
    content, named = geoparquet(buildings, "EPSG:25832", tmp_path / "roofs.parquet")
    assert geoparquet(buildings, "EPSG:25832", tmp_path / "roofs.parquet")[0] == content
    mission = optuav.load(written(tmp_path, "roofs.parquet", content))
    assert mission.buildings == named
    assert named.read_from(None) == buildings != named


# Plans


def test_a_plan_holds_what_it_uses_of_a_table(tmp_path: Path) -> None:
    """With the table it is the plan as it was; without it a plan over the embedded buildings."""
    mission = optuav.load(written(tmp_path / "maps"))
    plan = optuav.solve(mission)
    file = tmp_path / "plan.json"
    plan.save(file)
    data = json.loads(file.read_text("utf-8"))
    table = tmp_path / "maps" / "roofs.csv"
    named = {"path": "maps/roofs.csv", "sha256": fingerprint(table), "buildings": 2}
    assert data["buildings_file"] == named
    assert [each["name"] for each in data["mission"]["buildings"]] == ["c"]
    assert optuav.load_plan(file) == plan
    moved = tmp_path / "far" / "plan.json"
    moved.parent.mkdir()
    moved.write_text(file.read_text("utf-8"), "utf-8")
    alone = optuav.load_plan(moved)
    assert alone.phases == plan.phases
    assert alone.mission.buildings.names == ("c",)
    assert "1 of its 2 buildings are unknown" in " ".join(str(alone).split())
    found = optuav.audit(moved)
    assert found
    assert found.events[0].kind == "unknown"
    assert optuav.audit(file)
    assert optuav.audit(file).events[0].kind != "unknown"
    with pytest.raises(optuav.InputError, match="buildings_file: the table itself is needed"):
        optuav.solve(alone.mission)
    alone.save(moved)
    again = json.loads(moved.read_text("utf-8"))
    assert again["mission"] == data["mission"]
    assert again["buildings_file"]["sha256"] == named["sha256"]


def test_a_plan_keeps_what_is_in_its_way(tmp_path: Path) -> None:
    """Walls that darken a roof on the route are embedded, so that the verdict is the same."""
    rows = "wall,900,1500,200,400,4\nlow,900,1600,5,400,4\nroof,700,1200,40,,\n"
    table = HEAD.strip() + ",width_m,depth_m\n" + rows
    mission = optuav.load(written(tmp_path / "maps", content=table))
    mission = mission.replace(
        {"laser.position_m": [900, 2500, 10], "flight.through_buildings": True}
    )
    plan = optuav.solve(mission, optuav.P4("roof"))
    plan.save(tmp_path / "maps" / "plan.json")
    whole = optuav.audit(tmp_path / "maps" / "plan.json")
    text = (tmp_path / "maps" / "plan.json").read_text("utf-8")
    assert [each["name"] for each in json.loads(text)["mission"]["buildings"]] == ["wall", "roof"]
    (tmp_path / "plan.json").write_text(text, "utf-8")
    alone = optuav.audit(tmp_path / "plan.json")
    assert alone.events[1:] == whole.events
    assert any(each.kind == "no sight" for each in whole.events)
    assert bool(alone) == bool(whole)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"path": "other.csv"}, r"other\.csv: is another table: its SHA-256 hash is"),
        ({"sha256": "0" * 64}, "is another table"),
        ({"sha256": 3}, "path, sha256 and buildings of a table"),
        ({"path": None}, "path, sha256 and buildings of a table"),
        ({"buildings": True}, "path, sha256 and buildings of a table"),
        ({"path": "\0"}, "path, sha256 and buildings of a table"),
        (None, "path, sha256 and buildings of a table"),
    ],
)
def test_a_plan_is_refused_beside_another_table(
    change: dict[str, Any] | None, words: str, tmp_path: Path
) -> None:
    """By `load_plan` and by `audit` alike."""
    plan, file = optuav.solve(optuav.load(written(tmp_path))), tmp_path / "plan.json"
    plan.save(file)
    (tmp_path / "other.csv").write_text(ROOFS.replace("7e2", "7e1"), "utf-8")
    data = json.loads(file.read_text("utf-8"))
    data["buildings_file"] = change and {**data["buildings_file"], **change}
    file.write_text(json.dumps(data), "utf-8")
    for read in (optuav.load_plan, optuav.audit):
        with pytest.raises(optuav.InputError, match=words) as caught:
            read(file)
        (fault,) = caught.value.faults
        assert (fault.key, fault.source) == ("buildings_file", str(file))


def test_buildings_of_a_plan_are_those_of_its_table(tmp_path: Path) -> None:
    plan, file = optuav.solve(optuav.load(written(tmp_path))), tmp_path / "plan.json"
    plan.save(file)
    data = json.loads(file.read_text("utf-8"))
    data["mission"]["buildings"][0]["position_m"][2] = 41.0
    file.write_text(json.dumps(data), "utf-8")
    with pytest.raises(optuav.InputError, match=r"buildings\.c: is not as in roofs\.csv"):
        optuav.load_plan(file)
