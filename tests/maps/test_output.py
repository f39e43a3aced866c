"""GeoTIFF and GeoJSON are read back by other programs, where the mission is on Earth."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("xarray")
pytest.importorskip("rasterio")
pytest.importorskip("pyproj")
import pyproj
import rasterio

import optuav
from optuav.errors import InputError

LONGITUDE, LATITUDE = 13.4, 52.52
PLANE = f"+proj=aeqd +lon_0={LONGITUDE} +lat_0={LATITUDE} +datum=WGS84 +units=m +no_defs"
PAPER = optuav.load("paper")
HERE = PAPER.replace({"crs": PLANE, "buildings": PAPER.buildings[6:8]})


def test_a_geotiff_has_every_point_in_its_place(tmp_path: Path) -> None:
    """Looked up by coordinates, NaN without a plan; the same bytes again, over the first."""
    found = optuav.maps.hover_point(HERE, 50, bounds=(700, 2600, 900, 2750))
    file = optuav.maps.save(found, tmp_path / "hover.tif")
    content = file.read_bytes()
    with rasterio.open(file) as read:
        points = [(x, y) for y in found.y.to_numpy() for x in found.x.to_numpy()]
        values = np.array([*read.sample(points)]).reshape(found.shape)
        assert np.array_equal(values, found.to_numpy(), equal_nan=True)
        assert np.isnan(values).any()
        assert not np.isnan(values).all()
        assert pyproj.CRS(read.crs.to_wkt()).equals(pyproj.CRS(PLANE), ignore_axis_order=True)
        assert np.isnan(read.nodata)
        assert read.descriptions == ("hover_time_s",)
        assert read.units == ("s",)
        assert read.tags()["over"] == "route.hover_m"
    assert b"optuav" in content[:4096]  # a file that a command may replace
    assert optuav.maps.save(found, file).read_bytes() == content


def test_a_geotiff_of_a_mission_anywhere_has_metres(tmp_path: Path) -> None:
    found = optuav.maps.laser("paper", 500)
    with rasterio.open(optuav.maps.save(found, tmp_path / "laser.tiff")) as read:
        assert read.crs is None
        assert read.xy(0, 0) == (float(found.x[0]), float(found.y[-1]))


def test_contours_are_where_the_map_has_their_values(tmp_path: Path) -> None:
    """Back in metres by another way, the map between its points has the value of the line."""
    pytest.importorskip("matplotlib")
    found = optuav.maps.hover_point(HERE, 25, bounds=(800, 2550, 1200, 3000))
    assert not found.isnull().any()
    file = optuav.maps.save(found, tmp_path / "contours.geojson")
    document = json.loads(file.read_text("utf-8"))
    assert document["type"] == "FeatureCollection"
    levels = [each["properties"]["hover_time_s"] for each in document["features"]]
    assert len(levels) > 2
    assert levels == sorted(levels)
    ahead = pyproj.Geod(ellps="WGS84")
    for each in document["features"]:
        corners = np.concatenate(each["geometry"]["coordinates"])
        count = len(corners)
        start = np.full(count, LONGITUDE), np.full(count, LATITUDE)
        bearing, _, away_m = ahead.inv(*start, *corners.T)
        x, y = away_m * np.sin(np.radians(bearing)), away_m * np.cos(np.radians(bearing))
        x, y = (at.clip(*found[axis].values[[0, -1]]) for axis, at in (("x", x), ("y", y)))
        # Between two points along x or y a contour is where the straight line has its value.
        values = found.interp(x=("corner", x), y=("corner", y)).to_numpy()
        assert values == pytest.approx(each["properties"]["hover_time_s"], abs=0.02)
    assert optuav.maps.save(found, tmp_path / "again.geojson").read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    ("crs", "name", "words"),
    [
        (None, "a.geojson", "crs: is missing; GeoJSON holds longitudes and latitudes"),
        (
            "nowhere",
            "a.tif",
            "crs = 'nowhere': must be a coordinate reference system that pyproj knows",
        ),
        ("EPSG:4326", "a.tif", "crs = 'EPSG:4326': must be a reference system in metres"),
        ("EPSG:2263", "a.geojson", "a reference system in metres"),
        (None, "a.png", "a name that ends in .tif, .tiff or .geojson"),
    ],
)
def test_faults_leave_no_file(crs: str | None, name: str, words: str, tmp_path: Path) -> None:
    found = optuav.maps.laser(PAPER.replace({"crs": crs}), 500)
    with pytest.raises(InputError) as caught:
        optuav.maps.save(found, tmp_path / name)
    assert words in str(caught.value)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(("library", "name"), [("rasterio", "a.tif"), ("geopandas", "a.geojson")])
def test_a_missing_library_is_one_sentence(
    library: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = optuav.maps.laser(HERE, 500)

    def missing(package: str) -> object:
        raise ImportError(package)

    monkeypatch.setattr("optuav.errors.import_module", missing)
    with pytest.raises(InputError, match=rf"need {library}, of the extra optuav\[city\]; "):
        optuav.maps.save(found, tmp_path / name)


def test_what_is_no_map_is_refused(tmp_path: Path) -> None:
    words = "a map, as the functions of optuav.maps return it"
    with pytest.raises(InputError, match=words):
        optuav.maps.save(3, tmp_path / "x.tif")  # type: ignore[arg-type]
    assert not [*tmp_path.iterdir()]


def test_a_map_is_saved_as_it_lies_whatever_the_order_of_its_points(tmp_path: Path) -> None:
    """Turned over or on its side it is the same map; with points left out another, or none."""
    found = optuav.maps.laser("paper", 500)
    content = optuav.maps.save(found, tmp_path / "a.tif").read_bytes()
    for other in (found.T, found[::-1], found[:, ::-1]):
        assert optuav.maps.save(other, tmp_path / "b.tif").read_bytes() == content
    with rasterio.open(optuav.maps.save(found[::2], tmp_path / "c.tif")) as read:
        assert read.res == (500.0, 1000.0)
    for other in (found[:1], found[[0, 1, 3]], found[0]):
        with pytest.raises(InputError, match=r"^found = DataArray: "):
            optuav.maps.save(other, tmp_path / "d.tif")
    with pytest.raises(InputError, match=r"^found = DataArray: "):
        optuav.maps.save(optuav.maps.laser(HERE, 500)[:1], tmp_path / "d.geojson")
    assert not [*tmp_path.glob("d.*")]
