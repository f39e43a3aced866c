"""Heights of roofs: texts with units, storeys, columns that are nearly named so, and doubts."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("geopandas")

import geopandas
import pandas as pd
import shapely
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.city import City, read
from optuav.errors import shown
from tests.city.maps import geojson, square

FOOT_M = 0.3048  # The international foot, since 1959
SURVEY_FOOT_M = 1200 / 3937  # The foot of state planes, which is 2 millionths longer


def town(tmp_path: Path, *properties: Mapping[str, object], **options: Any) -> City:
    features = [(each, square(50.0 * k)) for k, each in enumerate(properties)]
    return read(geojson(tmp_path, features), **options)


def roofs(tmp_path: Path, name: str, *values: object, **options: Any) -> list[float]:
    rows = [{name: value} for value in values]
    return town(tmp_path, *rows, **options).position_m[:, 2].tolist()


def refusal(tmp_path: Path, *properties: Mapping[str, object], **options: Any) -> list[str]:
    with pytest.raises(optuav.InputError) as caught:
        town(tmp_path, *properties, **options)
    return [str(fault).rpartition("map.geojson: ")[2] for fault in caught.value.faults]


# Texts


@pytest.mark.parametrize(
    ("text", "height_m"),
    [
        *(("12", 12), (" 9 ", 9), ("+7", 7), ("1e2", 100), (".5", 0.5), ("12.", 12)),
        *(("12 m", 12), ("12m", 12), ("12.5 M", 12.5), ("12\u00a0m", 12), ("12 metres", 12)),
        *(("12 meters", 12), ("1 metre", 1), ("12,5", 12.5), ("12,50 m", 12.5)),
        *(("574'", 574 * FOOT_M), ("40 ft", 40 * FOOT_M), ("40ft", 40 * FOOT_M)),
        *(("40 FT.", 40 * FOOT_M), ("40 feet", 40 * FOOT_M), ("1 foot", FOOT_M)),
        *(("40.5'", 40.5 * FOOT_M), ("40′", 40 * FOOT_M), ("40’", 40 * FOOT_M)),
        *(("11'4\"", (11 + 4 / 12) * FOOT_M), ("11' 4.5\"", (11 + 4.5 / 12) * FOOT_M)),
        *(("11 ft 4 in", (11 + 4 / 12) * FOOT_M), ("11ft4", (11 + 4 / 12) * FOOT_M)),
        *(("11'4''", (11 + 4 / 12) * FOOT_M), ("11′4″", (11 + 4 / 12) * FOOT_M)),
        *(("40'-6\"", 40.5 * FOOT_M), ("40 ft - 6 in", 40.5 * FOOT_M)),
        *(("11 feet 4 inches", (11 + 4 / 12) * FOOT_M), ("11’4”", (11 + 4 / 12) * FOOT_M)),
    ],
)
def test_metres_feet_and_inches_are_read(tmp_path: Path, text: str, height_m: float) -> None:
    assert roofs(tmp_path, "height", text, default_height_m=2.0) == pytest.approx([height_m])


UNREAD = (
    *("3;4", "~12", "-3", "0", "0x10", "1_000", "1,000", "١٢", "inf", "nan", "high", "5 floors"),
    *("12 km", "12mm", "12 cm", "5-6", "11'14\"", "1e400", "1e9", "3000", '4"', "12 m 5"),
    *(True, [12], {"a": 1}, -1.0, 0, 3000),
)


@pytest.mark.parametrize("value", UNREAD)
def test_what_cannot_be_read_is_counted_and_quoted(tmp_path: Path, value: object) -> None:
    """With a default, and each by its feature without one."""
    city = town(tmp_path, {"height": value}, {"height": 9}, {}, default_height_m=5.0)
    assert city.position_m[:, 2].tolist() == [5.0, 9.0, 5.0]
    assert (city.unread, city.assumed_heights) == (("b0",), ("b0", "b2"))
    quoted = "table" if isinstance(value, dict) else shown(value).lower()
    (note,) = [each for each in city.notes() if "cannot be read" in each and "height = " in each]
    assert quoted in note.lower()
    found = refusal(tmp_path, {"height": value}, {"height": 9}, {})
    assert found[0].startswith("2 of 3 buildings without a height")
    assert quoted in found[1].lower()
    assert "1200 [m]" in found[1]
    assert found[2] == "feature 2: no height"


@given(st.integers(1, 900), st.integers(0, 11), st.sampled_from(["{}'{}\"", "{} ft {} in"]))
def test_feet_and_inches_are_those_of_1959(
    tmp_path_factory: pytest.TempPathFactory, feet: int, inches: int, form: str
) -> None:
    text, folder = form.format(feet, inches), tmp_path_factory.getbasetemp()
    (roof_m,) = roofs(folder, "height", text)
    assert roof_m == pytest.approx((12 * feet + inches) * 0.0254, rel=1e-12)


def test_a_tag_of_openstreetmap_keeps_its_inches() -> None:
    """GDAL puts tags in one column, where a backslash stands before a quote."""
    tags = r'"building:part"=>"yes","height"=>"11\'4\"","name"=>"a \"b\", \\c"'.replace(r"\'", "'")
    shape = shapely.geometry.shape(square())
    frame = geopandas.GeoDataFrame({"other_tags": [tags]}, geometry=[shape], crs=4326)
    assert read(frame).position_m[0, 2] == pytest.approx(136 * 0.0254)


# Storeys


@pytest.mark.parametrize(
    ("tags", "height_m"),
    [
        ({"building:levels": "3"}, 9),
        ({"building:levels": "3", "roof:levels": "2"}, 15),
        ({"building:levels": 2.5, "roof:levels": 1}, 10.5),
        ({"building:levels": "0", "roof:levels": "2"}, 6),
        ({"building:levels": "2", "roof:height": "12"}, 18),
        ({"building:levels": "2", "roof:height": "20 ft", "roof:levels": "3"}, 15),
        ({"building:levels": "2,5"}, 7.5),
        ({"building:levels": "3", "roof:levels": "2", "height": "11"}, 11),
        ({"building:levels": "3", "height": "high"}, 9),
        ({"building:levels": "5", "building:min_level": "3"}, 15),
    ],
)
def test_storeys_and_those_of_the_roof(
    tmp_path: Path, tags: Mapping[str, object], height_m: float
) -> None:
    """A roof counts by its height or its storeys, the more of both; `height` includes it."""
    city = town(tmp_path, tags)
    assert city.position_m[:, 2].tolist() == pytest.approx([height_m])
    assert city.level_heights == (() if str(tags.get("height")) == "11" else ("b0",))


@pytest.mark.parametrize(
    "storeys", ["3;4", "10-12", "3, 4", "5 floors", "-1", "0", "1000", "1e308", 3000.0]
)
def test_storeys_that_cannot_be_read_are_quoted(tmp_path: Path, storeys: object) -> None:
    """And doubted where no house has so many."""
    city = town(tmp_path, {"building:levels": storeys}, {"height": 9}, default_height_m=5.0)
    assert (city.unread, city.assumed_heights, city.level_heights) == (("b0",), ("b0",), ())
    assert f"building:levels = {storeys!r}" in "\n".join(city.notes())
    found = refusal(tmp_path, {"building:levels": storeys}, {"height": 9})
    assert (
        found[1] == f"feature 0, building:levels = {storeys!r}: must be a number, 0 < x <= 300 [-]"
    )


def test_storeys_of_a_roof_that_cannot_be_read_are_quoted(tmp_path: Path) -> None:
    city = town(tmp_path, {"building:levels": 2, "roof:levels": "1;2"})
    assert (city.position_m[0, 2], city.unread) == (6.0, ("b0",))
    assert "roof:levels = '1;2'" in "\n".join(city.notes())


def test_a_roof_is_not_below_the_lowest_floor(tmp_path: Path) -> None:
    """`height` counts from the ground, also where a building begins above it.

    A default replaces no height that can be read, and both heights are quoted.
    """
    rows = [{"height": 30, "min_height": 24}, {"height": 3, "min_height": 24}]
    city = town(tmp_path, *rows, default_height_m=5.0)
    assert city.position_m[:, 2].tolist() == [30.0, 3.0]
    assert (city.from_ground, city.unread) == (("b0", "b1"), ("b1",))
    assert city.assumed_heights == ()
    assert "do not begin below their roof: min_height = 24, roof at 3 m" in [*city.notes()]
    words = "feature 1, min_height = 24: must be below the roof, at 3 m"
    assert refusal(tmp_path, *rows)[1] == words
    storeys = town(tmp_path, {"building:levels": 2, "building:min_level": 4}, default_height_m=5.0)
    assert (storeys.unread, storeys.position_m[0, 2]) == (("b0",), 6.0)


# Columns that are nearly named so


@pytest.mark.parametrize("default_m", [None, 12.0])
@pytest.mark.parametrize(
    ("column", "option"),
    [
        *((name, "height") for name in ("HEIGHT", "Height", "height_m", "building_height")),
        *((name, "height") for name in ("heightroof", "measuredHeight", "heigth", "Hoehe")),
        *(
            (name, "height")
            for name in (
                "measuredHe",
                "bldg_hgt",
                "BLDG_HT",
                "H",
                "ROOF_HEIGHT",
                "HAUTEUR",
                "Gebäudehöhe",
            )
        ),
        *((name, "levels") for name in ("building_l", "building:l", "building_levels", "levels")),
        *((name, "levels") for name in ("num_floors", "storeysAboveGround", "NUMFLOORS")),
        *(
            (name, "levels")
            for name in ("Geschosse", "storeysAbo", "stories", "NB_ETAGES", "no_story")
        ),
    ],
)
def test_a_column_that_is_nearly_named_so_is_asked_for(
    tmp_path: Path, column: str, option: str, default_m: float | None
) -> None:
    """In place of a default height; by its name, it is read, and by another, it is not."""
    rows = [{"building": "yes", column: "8"}, {"building": "yes", "height": 3.0}]
    rows[1 if option == "height" else 0].setdefault(column, "8")
    found = refusal(tmp_path, *rows, default_height_m=default_m)
    assert len(found) == 1
    assert found[0].startswith(f"{option}: is missing for 1 of 2 buildings")
    assert repr(column) in found[0]
    high_m = {"height": 8.0, "levels": 24.0}[option]
    city = town(tmp_path, *rows, default_height_m=12.0, **{option: column})
    assert city.position_m[0, 2] == high_m
    own = {"height": "height", "levels": "building:levels"}[option]
    left = town(tmp_path, *rows, default_height_m=12.0, **{option: own})
    assert left.position_m[:, 2].tolist() == [12.0, 3.0]


def test_columns_of_something_else_are_not_asked_for(tmp_path: Path) -> None:
    """Nor those that say nothing about the buildings without a height."""
    others = {
        "roof:height": 2,
        "min_height": 1,
        "building:levels:underground": 2,
        "ground_height": 9,
    }
    texts = {
        "ground_height": 9,
        "height_source": "lidar",
        "HEIGHT": 0,
        "floor_area": 120,
        "levels": None,
        "history": 1900,
    }
    rows = [{**others, **texts}, {"height": 9, "Height": 7}]
    city = town(tmp_path, *rows, default_height_m=5.0)
    assert city.position_m[:, 2].tolist() == [5.0, 9.0]


def test_a_shapefile_cuts_names_and_they_are_asked_for(tmp_path: Path) -> None:
    shapes = [shapely.geometry.shape(square(50.0 * k)) for k in range(2)]
    columns = {"building": ["yes"] * 2, "building_l": [9, 9], "height": [12.0, math.nan]}
    frame = geopandas.GeoDataFrame(columns, geometry=shapes, crs=4326)
    frame.to_file(file := tmp_path / "cut.shp")
    with pytest.raises(optuav.InputError, match=r"levels: is missing .* 'building_l'"):
        read(file, default_height_m=5.0)
    assert read(file, levels="building_l").position_m[:, 2].tolist() == [12.0, 27.0]


# Units


def in_feet(height: object, name: str = "height") -> geopandas.GeoDataFrame:
    """A square at the corner of New York's state plane, which is in feet."""
    shape = shapely.box(980_000, 200_000, 980_100, 200_100)
    return geopandas.GeoDataFrame({name: [height]}, geometry=[shape], crs=2263)


def test_heights_in_feet_have_a_factor(tmp_path: Path) -> None:
    """It is for numbers without a unit of their own, and for no other heights."""
    rows = [{"height": 100}, {"height": "100"}, {"height": "100 m"}, {"height": "100 ft"}, {}]
    rows += [{"building:levels": 2, "roof:height": 10}]
    city = town(tmp_path, *rows, height_factor=0.3048, default_height_m=7.0)
    assert city.position_m[:, 2] == pytest.approx([30.48, 30.48, 100.0, 30.48, 7.0, 6 + 3.048])
    for wrong in (0, -1, math.nan, math.inf, "x", True):
        (found,) = (str(each) for each in fault(height_factor=wrong))
        assert found.startswith("height_factor = ")


def fault(**options: Any) -> tuple[Any, ...]:
    with pytest.raises(optuav.InputError) as caught:
        read(in_feet(3.0), **{"height_factor": 1.0, **options})
    return caught.value.faults


def test_a_number_is_doubted_where_the_map_is_in_feet() -> None:
    """Whoever measures places in feet hardly has heights in metres; outlines become metres."""
    with pytest.raises(optuav.InputError, match=r"height_factor: is missing: .*US survey foot"):
        read(in_feet(35.0))
    assert read(in_feet(35.0), height_factor=FOOT_M).position_m[0, 2] == pytest.approx(10.668)
    assert read(in_feet(35.0), height_factor=1).position_m[0, 2] == 35.0
    compound = in_feet(35.0).set_crs("EPSG:25833+6360", allow_override=True)
    with pytest.raises(optuav.InputError, match=r"height_factor: is missing: .*US survey foot"):
        read(compound)
    assert read(in_feet("35 ft")).position_m[0, 2] == pytest.approx(10.668)
    assert read(in_feet(4, "building:levels")).position_m[0, 2] == 12.0
    city = read(in_feet(None), default_height_m=9.0)
    assert shapely.area(city.footprints) == pytest.approx(1e4 * SURVEY_FOOT_M**2, rel=1e-3)


@pytest.mark.parametrize("name", ["height_ft", "HEIGHT_FT", "bldg_height_feet", "HeightFt"])
def test_a_column_in_feet_by_its_name_is_doubted(tmp_path: Path, name: str) -> None:
    found = refusal(tmp_path, {name: 35}, height=name)
    assert found == [
        f"height_factor: is missing: numbers of {name!r} seem to be in feet; set 0.3048 if they "
        "are, 1 if they are in metres"
    ]
    assert roofs(tmp_path, name, 35, height=name, height_factor=FOOT_M) == pytest.approx([10.668])


def test_a_column_to_ignore_is_named_in_a_sentence(tmp_path: Path) -> None:
    """The message says how to read the column, and how to do without it."""
    (words,) = refusal(tmp_path, {"hoehe": 8}, default_height_m=5.0)
    assert words == (
        "height: is missing for 1 of 1 building, but the column 'hoehe' may hold them: name this "
        "column by height, or name 'height' to ignore it"
    )


def test_masks_and_kinds_of_numbers_are_read() -> None:
    """Columns of pandas with and without a value for what is missing."""
    shapes = [shapely.geometry.shape(square(50.0 * k)) for k in range(3)]
    for values in (
        pd.array([9, None, 12], dtype="Int64"),
        np.array([9.0, np.nan, 12.0], dtype=np.float32),
        pd.array(["9", None, "12"], dtype="string"),
        pd.Categorical(["9", None, "12"]),
        np.array([9, "", "12"], dtype=object),
    ):
        frame = geopandas.GeoDataFrame({"height": values}, geometry=shapes, crs=4326)
        city = read(frame, default_height_m=5.0)
        assert city.position_m[:, 2].tolist() == [9.0, 5.0, 12.0]
        assert city.unread == ()


def test_a_default_beside_texts_says_what_it_replaced(tmp_path: Path) -> None:
    """Every value once, with the first buildings."""
    rows = [{"height": value} for value in ("3;4", "3;4", "~12", "9")]
    city = town(tmp_path, *rows, default_height_m=5.0)
    assert (
        "heights or storeys that cannot be read, or that contradict each other: 3 (b0, b1, b2)"
        in [*city.notes()]
    )
    assert "cannot be read: height = '3;4', height = '~12'" in [*city.notes()]
    assert "  heights or storeys that cannot be read, or that contradict each other: 3" in repr(
        city
    )
    assert json.dumps(city.unread) == '["b0", "b1", "b2"]'
