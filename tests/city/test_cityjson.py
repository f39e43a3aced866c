"""Solids of CityJSON become prisms."""

from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("geopandas")

import numpy as np
import shapely

import optuav
from optuav.city import read

# A house of 10 m by 20 m with walls of 6 m and a gable roof up to 9 m, on a hill of 100 m, in
# decimetres from a corner of the grid of UTM zone 33.
CORNERS = [
    *((0, 0, 0), (100, 0, 0), (100, 200, 0), (0, 200, 0)),
    *((0, 0, 60), (100, 0, 60), (100, 200, 60), (0, 200, 60)),
    *((50, 0, 90), (50, 200, 90)),
]
SHELL = [
    *([[3, 2, 1, 0]], [[0, 1, 5, 8, 4]], [[2, 3, 7, 9, 6]]),
    *([[0, 4, 7, 3]], [[1, 2, 6, 5]], [[4, 8, 9, 7]], [[5, 6, 9, 8]]),
]
SOLID = {"type": "Solid", "lod": "2.0", "boundaries": [SHELL]}
BEFORE = {"type": "MultiSurface", "lod": "1", "boundaries": [[[0, 1, 2, -1]]]}
PART = {"type": "BuildingPart", "geometry": [SOLID]}
FLAT = {"type": "MultiSurface", "lod": "0", "boundaries": [[[0, 1, 2, 3]]]}


def document(**objects: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25833"},
        "transform": {"scale": [0.1, 0.1, 0.1], "translate": [390_000.0, 5_800_000.0, 100.0]},
        "CityObjects": objects,
        "vertices": [[*each] for each in CORNERS],
    }


def written(folder: Path, content: dict[str, Any]) -> Path:
    file = folder / "town.city.json"
    file.write_text(json.dumps(content))
    return file


def test_a_solid_counts_by_its_outline_and_height(tmp_path: Path) -> None:
    """At the highest level of detail; what is no building does not count."""
    house = {"type": "Building", "geometry": [FLAT, SOLID]}
    tree = {"type": "SolitaryVegetationObject", "geometry": [SOLID]}
    city = read(written(tmp_path, document(house=house, tree=tree)))
    assert city.names == ("house",)
    assert shapely.area(city.footprints) == pytest.approx([200.0], rel=2e-3)
    assert city.position_m[0, 2] == pytest.approx(9.0)
    optuav.load("paper").replace({"buildings": city.buildings()})


def test_parts_count_in_place_of_the_building_that_they_make(tmp_path: Path) -> None:
    whole = {"type": "Building", "geometry": [FLAT], "children": ["nave", "tower"]}
    part = {"type": "BuildingPart", "parents": ["church"], "geometry": [SOLID]}
    content = document(church=whole, nave=part, tower=copy.deepcopy(part))
    assert read(written(tmp_path, content)).names == ("nave", "tower")


def test_a_part_that_stands_on_another_reaches_from_the_ground(tmp_path: Path) -> None:
    """A tower of 50 m on a podium of 10 m has its roof at 60 m, in another building at 50 m."""
    above = [[[n + 10 for n in ring] for ring in face] for face in SHELL]
    tower = {"type": "Solid", "lod": "2.0", "boundaries": [above]}
    parts = {
        "podium": {"type": "BuildingPart", "parents": ["house"], "geometry": [SOLID]},
        "tower": {"type": "BuildingPart", "parents": ["podium"], "geometry": [tower]},
        "other": {"type": "Building", "geometry": [tower]},
    }
    content = document(house={"type": "Building", "children": ["podium"]}, **parts)
    content["vertices"] = [[x, y, z * 10 // 9] for x, y, z in CORNERS]
    content["vertices"] += [[x, y, 100 + z * 50 // 9] for x, y, z in CORNERS]
    city = read(written(tmp_path, content))
    roofs_m = dict(zip(city.names, city.position_m[:, 2].tolist(), strict=True))
    assert roofs_m == pytest.approx({"podium": 10.0, "tower": 60.0, "other": 50.0})


def test_a_file_may_be_named_cityjson(tmp_path: Path) -> None:
    file = written(tmp_path, document(house={"type": "Building", "geometry": [SOLID]}))
    assert read(file.rename(tmp_path / "town.cityjson")).names == ("house",)


def test_a_flat_outline_has_no_height_but_attributes_may(tmp_path: Path) -> None:
    attributes = {"measuredHeight": 11.0, "storeysAboveGround": 3}
    house = {"type": "Building", "geometry": [FLAT], "attributes": attributes}
    file = written(tmp_path, document(house=house))
    with pytest.raises(optuav.InputError, match="height: is missing for 1 of 1 building"):
        read(file)
    with pytest.raises(optuav.InputError, match="1 of 1 building without a height"):
        read(file, height="height", levels="building:levels")
    assert read(file, height="measuredHeight").position_m[0, 2] == 11.0
    assert read(file, levels="storeysAboveGround").position_m[0, 2] == 9.0


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("metadata", {}, "has no coordinate reference system"),
        ("metadata", {"referenceSystem": "local"}, "a code of EPSG"),
        ("vertices", [[0, 0, 0]], "is not CityJSON"),
        ("vertices", "none", "is not CityJSON"),
        ("CityObjects", {"house": {}}, "is not CityJSON: CityObjects, 'house' is not as specified"),
        ("CityObjects", {"a": {**PART, "parents": ["a"]}}, "is not CityJSON: CityObjects, 'a'"),
        ("CityObjects", {"a": {**PART, "geometry": [BEFORE]}}, "is not CityJSON: CityObjects, 'a'"),
        ("CityObjects", {}, "has no buildings"),
        ("transform", {"scale": [1, 1, 1]}, "is not CityJSON"),
    ],
)
def test_what_is_wrong_is_said_once(tmp_path: Path, key: str, value: object, words: str) -> None:
    house = {"type": "Building", "geometry": [SOLID]}
    with pytest.raises(optuav.InputError, match=words) as caught:
        read(written(tmp_path, {**document(house=house), key: value}))
    assert len(caught.value.faults) == 1


def test_other_json_is_geojson_or_none(tmp_path: Path) -> None:
    file = tmp_path / "map.json"
    file.write_text('{"type": "FeatureCollection", "features": []}')
    with pytest.raises(optuav.InputError):
        read(file)
    file.write_text("[1, 2]")
    with pytest.raises(optuav.InputError, match="is not GeoJSON: type is not"):
        read(file)


def test_a_surface_that_crosses_itself_everywhere_is_refused(tmp_path: Path) -> None:
    """As in any other map: mended, it would take minutes."""
    town, chance = document(tower=PART | {"type": "Building"}), random.Random(1)
    first = len(CORNERS)
    town["vertices"] += [[chance.randrange(9999), chance.randrange(9999), 0] for _ in range(1500)]
    tangled = {**FLAT, "boundaries": [[[*range(first, first + 1500)]]]}
    town["CityObjects"]["tangle"] = {"type": "Building", "geometry": [tangled]}
    (file := tmp_path / "town.json").write_text(json.dumps(town))
    with pytest.raises(optuav.InputError, match="feature tangle: is too tangled to be mended"):
        read(file)


# Children, extensions and geometries of all kinds


def block(west: int, high: int, first: int = 0) -> tuple[list[list[int]], list[Any]]:
    """Corners of a block of 10 m by 10 m [dm], and the shell of its solid."""
    base = [(0, 0), (100, 0), (100, 100), (0, 100)]
    corners = [[west + x, y, z] for z in (0, high) for x, y in base]
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return corners, [[[first + n for n in face]] for face in faces]


def blocks(folder: Path, objects: dict[str, Any], *highs: int, **more: Any) -> Path:
    """A file with objects over blocks of these heights [dm], which stand 20 m apart."""
    content = {**document(**objects), **more}
    content["vertices"] = [each for k, high in enumerate(highs) for each in block(200 * k, high)[0]]
    return written(folder, content)


def solid(k: int, lod: Any = "2", kind: str = "Building", **more: Any) -> dict[str, Any]:
    shell = block(0, 0, 8 * k)[1]
    return {
        "type": kind,
        "geometry": [{"type": "Solid", "lod": lod, "boundaries": [shell]}],
        **more,
    }


def heights_m(city: Any) -> dict[str, float]:
    return dict(zip(city.names, city.position_m[:, 2].round(6).tolist(), strict=True))


OTHERS = ["BuildingInstallation", "BuildingRoom", "BuildingFurniture", "BuildingStorey"]
OTHERS += ["BuildingConstructiveElement", "BuildingUnit", "+Chimney", "IntBuildingInstallation"]


@pytest.mark.parametrize("kind", OTHERS)
def test_children_that_are_no_parts_take_nothing_away(tmp_path: Path, kind: str) -> None:
    """Of a building or of a part, also where only the child names the other; and they are told."""
    house = solid(0, children=["child"])
    whole = {"type": "Building", "geometry": [], "children": ["part"]}
    objects = {
        "house": house,
        "child": solid(1, kind=kind, parents=["house"]),
        "whole": whole,
        "part": solid(2, kind="BuildingPart", parents=["whole"], children=["inner"]),
        "inner": solid(1, kind=kind, parents=["part"]),
    }
    city = read(blocks(tmp_path, objects, 100, 120, 300))
    assert heights_m(city) == {"house": 10.0, "part": 30.0}
    told = f"left out, as neither Building nor BuildingPart: {kind} (2)"
    assert told in [*city.notes()]
    assert city.left_out == ()


def test_a_part_without_surfaces_does_not_replace_its_building(tmp_path: Path) -> None:
    """Nor one that is named and not there, as in a part of a larger file."""
    objects = {
        "house": solid(0, children=["part", "gone"]),
        "part": {"type": "BuildingPart", "parents": ["house"], "geometry": []},
        "bare": {"type": "Building"},
        "null": {"type": "Building", "geometry": None, "children": None, "attributes": None},
    }
    city = read(blocks(tmp_path, objects, 100))
    assert heights_m(city) == {"house": 10.0}
    assert city.left_out == ("part", "bare", "null")


def test_a_group_is_no_building_whose_ground_counts(tmp_path: Path) -> None:
    """Buildings on a slope keep their heights where a group holds them."""
    low = block(0, 100)[0]
    high = [[x + 200, y, z + 500] for x, y, z in low]
    group = {"type": "CityObjectGroup", "children": ["low", "high"], "geometry": []}
    objects = {"low": solid(0, parents=["group"]), "high": solid(1, parents=["group"])}
    content = document(group=group, **objects)
    content["vertices"] = [*low, *high]
    assert heights_m(read(written(tmp_path, content))) == {"low": 10.0, "high": 10.0}


def test_buildings_of_extensions_are_buildings(tmp_path: Path) -> None:
    """By their names; others are told by their types, also where nothing else is there."""
    objects = {"a": solid(0, kind="+NoiseBuilding"), "b": solid(1, kind="+NoiseCityFurniture")}
    city = read(blocks(tmp_path, objects, 100, 200))
    assert heights_m(city) == {"a": 10.0}
    assert "left out, as neither Building nor BuildingPart: +NoiseCityFurniture (1)" in (
        "\n".join(city.notes())
    )
    file = blocks(tmp_path, {"b": solid(0, kind="Bridge"), "c": solid(0, kind="+Mast")}, 100)
    with pytest.raises(
        optuav.InputError, match=r"has no buildings; left out, as .* Bridge \(1\), \+M"
    ):
        read(file)


@pytest.mark.parametrize(
    "geometry",
    [
        {"type": "MultiSurface", "lod": "3", "boundaries": []},
        {"type": "MultiSurface", "lod": "3", "boundaries": [[]]},
        {"type": "MultiSurface", "lod": "3", "boundaries": [[[]]]},
        {"type": "Solid", "lod": "3", "boundaries": []},
        {"type": "Solid", "lod": "3", "boundaries": [[]]},
        {"type": "MultiSolid", "lod": "3.1", "boundaries": [[[]]]},
        {"type": "CompositeSolid", "lod": "3", "boundaries": []},
        {"type": "MultiPoint", "lod": "3", "boundaries": [0, 1]},
        {"type": "MultiLineString", "lod": "3", "boundaries": [[0, 1], [1, 2]]},
        {"type": "MultiSurface", "lod": "3", "boundaries": [[[0, 1, 5, 4]]]},
        {"type": "+Mesh", "lod": "4", "boundaries": {"of": "an extension"}},
    ],
)
def test_the_highest_detail_that_covers_ground_counts(
    tmp_path: Path, geometry: dict[str, Any]
) -> None:
    """Nothing, points, lines and walls alone do not; a building of nothing else is listed."""
    objects = {"a": solid(0, 1.2), "b": {"type": "Building", "geometry": [geometry]}, "c": solid(1)}
    objects["a"]["geometry"].append(geometry)
    city = read(blocks(tmp_path, objects, 100, 200))
    assert heights_m(city) == {"a": 10.0, "c": 20.0}
    assert city.left_out == ("b",)


def test_solids_of_all_kinds_are_read(tmp_path: Path) -> None:
    """Several solids of a building have one height; cavities inside change nothing."""
    shells = [block(0, 0, 8 * k)[1] for k in range(5)]
    kinds = {
        "a": {"type": "MultiSurface", "lod": 2, "boundaries": shells[0]},
        "b": {"type": "CompositeSurface", "lod": "2", "boundaries": shells[1]},
        "c": {"type": "Solid", "lod": "2", "boundaries": [shells[2], shells[2]]},
        "d": {"type": "MultiSolid", "lod": "2", "boundaries": [[shells[3]], [shells[4]]]},
        "e": {"type": "CompositeSolid", "lod": "2", "boundaries": [[shells[3]], [shells[4]]]},
    }
    objects = {name: {"type": "Building", "geometry": [each]} for name, each in kinds.items()}
    city = read(blocks(tmp_path, objects, 100, 110, 120, 130, 140))
    assert heights_m(city) == {"a": 10, "b": 11, "c": 12, "d": 14, "d-2": 14, "e": 14, "e-2": 14}


def test_an_instance_of_a_template_is_read(tmp_path: Path) -> None:
    """Turned by a quarter, three times as large and moved: 30 m by 60 m, 27 m high.

    Corners of templates are metres; the anchor is a vertex of the file.
    """
    house = np.array(CORNERS) / 10  # 10 m by 20 m by 9 m
    matrix = [0, -3, 0, 7, 3, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1]
    instance = {"type": "GeometryInstance", "template": 1, "boundaries": [8]}
    instance["transformationMatrix"] = matrix
    templates = [FLAT, {**SOLID, "lod": "2.2"}]
    objects = {
        "a": solid(0),
        "b": {"type": "Building", "geometry": [{**FLAT, "lod": "1"}, instance]},
        "c": {"type": "Building", "geometry": [{**instance, "template": 0}]},
    }
    library = {"templates": templates, "vertices-templates": house.tolist()}
    file = blocks(tmp_path, objects, 100, 200, **{"geometry-templates": library})
    city = read(file, default_height_m=5.0)
    assert heights_m(city) == {"a": 10.0, "b": 27.0, "c": 5.0}
    assert shapely.area(city.footprints) == pytest.approx([100, 1800, 1800], rel=2e-3)
    west_m, _, east_m, _ = shapely.bounds(city.footprints[1])
    first_m = shapely.bounds(city.footprints[0])[0]
    assert (west_m - first_m, east_m - first_m) == pytest.approx((20 + 7 - 60, 20 + 7), abs=0.5)
    for wrong in ({"template": 2}, {"template": -1}, {"boundaries": [-1]}, {"boundaries": []}):
        objects["b"]["geometry"] = [{**instance, **wrong}]
        file = blocks(tmp_path, objects, 100, 200, **{"geometry-templates": library})
        with pytest.raises(optuav.InputError, match="CityObjects, 'b' is not as specified"):
            read(file)


def test_a_sequence_is_read_as_its_document(tmp_path: Path) -> None:
    """CityJSONSeq: features have vertices of their own, and the rest of their head."""
    head = document()
    features = []
    for name, high in (("a", 100), ("b", 300)):
        own = {"type": "CityJSONFeature", "id": name, "CityObjects": {name: solid(0)}}
        features.append({**own, "vertices": block(0 if name == "a" else 200, high)[0]})
    whole = read(blocks(tmp_path, {"a": solid(0), "b": solid(1)}, 100, 300))
    file = tmp_path / "town.city.jsonl"
    file.write_text("\n".join(map(json.dumps, [{**head, "vertices": []}, *features])))
    city = read(file)
    assert heights_m(city) == heights_m(whole) == {"a": 10.0, "b": 30.0}
    assert shapely.equals(city.footprints, whole.footprints).all()
    file.write_text("\n".join(map(json.dumps, features)))
    with pytest.raises(optuav.InputError, match="is CityJSONSeq without its first line"):
        read(file)
    twice = [{**head, "vertices": []}, features[0], features[0]]
    file.write_text("\n".join(map(json.dumps, twice)))
    with pytest.raises(optuav.InputError, match="has several objects of one name"):
        read(file)


# Units and attributes


OPENGIS = "http://www.opengis.net/def/crs"


@pytest.mark.parametrize(
    ("system", "unit_m", "outline_m"),
    [
        ("EPSG:2263", 1200 / 3937, 1200 / 3937),
        ("urn:ogc:def:crs:EPSG::2263", 1200 / 3937, 1200 / 3937),
        ("EPSG:2263+6360", 1200 / 3937, 1200 / 3937),
        ("EPSG:2263+5703", 1.0, 1200 / 3937),
        (f"{OPENGIS}-compound?1={OPENGIS}/EPSG/0/25833&2={OPENGIS}/EPSG/0/8228", 0.3048, 1.0),
        (f"{OPENGIS}/EPSG/9.8.15/25833", 1.0, 1.0),
        ("urn:ogc:def:crs,crs:EPSG::25833,crs:EPSG::6360", 1200 / 3937, 1.0),
        ("urn:ogc:def:crs:EPSG:9.8:25833", 1.0, 1.0),
    ],
)
def test_heights_count_in_the_unit_of_their_axis(
    tmp_path: Path, system: str, unit_m: float, outline_m: float
) -> None:
    """Of a plane alone, in that of the plane; only there a stated factor comes first."""
    metadata = {"referenceSystem": system}
    grid = {"scale": [0.1, 0.1, 0.1], "translate": [980_000.0, 200_000.0, 0.0]}
    if outline_m == 1.0:
        grid["translate"] = [390_000.0, 5_800_000.0, 0.0]
    file = blocks(tmp_path, {"a": solid(0)}, 100, metadata=metadata, transform=grid)
    city = read(file)
    assert city.position_m[0, 2] == pytest.approx(10 * unit_m, rel=1e-12)
    assert shapely.area(city.footprints) == pytest.approx([100 * outline_m**2], rel=2e-3)
    words = f"heights of solids are in units of {unit_m:.6g} m, by the "
    assert (words in "\n".join(city.notes())) == (unit_m != 1.0)
    halved, by_axis = read(file, height_factor=0.5), system.count("EPSG") > 1 or "+" in system
    assert halved.position_m[0, 2] == pytest.approx(10 * unit_m if by_axis else 5.0, rel=1e-12)
    half = "heights of solids are in units of 0.5 m, by the stated factor"
    assert (half in "\n".join(halved.notes())) == (not by_axis)
    assert (words in "\n".join(halved.notes())) == by_axis


def test_a_crs_that_is_stated_has_its_unit(tmp_path: Path) -> None:
    grid = {"scale": [0.1, 0.1, 0.1], "translate": [980_000.0, 200_000.0, 0.0]}
    file = blocks(tmp_path, {"a": solid(0)}, 100, metadata={}, transform=grid)
    assert read(file, crs=2263).position_m[0, 2] == pytest.approx(10 * 1200 / 3937)


def test_attributes_are_read_beside_solids(tmp_path: Path) -> None:
    """A flat outline has the height of its attribute; a column that is named comes first."""
    flat = {"type": "MultiSurface", "lod": "0", "boundaries": [[[0, 1, 2, 3]]]}
    rows = [{"height": 12, "measuredHeight": 33}, {"measuredHeight": 44}, {}]
    objects = {
        "a": {"type": "Building", "geometry": [flat], "attributes": rows[0]},
        "b": solid(1, attributes=rows[1]),
        "c": solid(2, attributes=rows[2]),
    }
    file = blocks(tmp_path, objects, 100, 200, 300)
    assert heights_m(read(file)) == {"a": 12.0, "b": 20.0, "c": 30.0}
    feet = {"height": "measuredHeight", "height_factor": 0.3048}
    expected = {"a": 33 * 0.3048, "b": 44 * 0.3048, "c": 30.0}
    assert heights_m(read(file, **feet)) == pytest.approx(expected)
    del objects["a"]["attributes"]["height"]
    file = blocks(tmp_path, objects, 100, 200, 300)
    with pytest.raises(optuav.InputError, match=r"height: is missing for 1 of 3 .*'measuredHeigh"):
        read(file, default_height_m=5.0)


def test_a_solid_from_the_centre_of_the_earth_is_doubted(tmp_path: Path) -> None:
    """A corner at z = 0 below a town on a mountain makes a building of 1500 m."""
    objects = {"a": solid(0), "b": solid(1)}
    content = blocks(tmp_path, objects, 15_000, 90)
    with pytest.raises(
        optuav.InputError, match=r"feature a, height of the solid = 1500.0: must be a num"
    ):
        read(content)
    city = read(content, default_height_m=8.0)
    assert (heights_m(city), city.unread) == ({"a": 8.0, "b": 9.0}, ("a",))
