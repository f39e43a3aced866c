"""Solids of CityJSON become prisms."""

from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("geopandas")

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
    with pytest.raises(optuav.InputError, match="1 of 1 building without a height"):
        read(file)
    assert read(file, height="measuredHeight").position_m[0, 2] == 11.0
    assert read(file, levels="storeysAboveGround").position_m[0, 2] == 9.0


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("metadata", {}, "states no coordinate reference system"),
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
