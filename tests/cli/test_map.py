"""``optuav map``: hover times over positions, on the screen and in files."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("xarray")

import optuav
import optuav.maps
from tests.cli.run import refused, run, widest
from tests.several_devices import three

BOUNDS = ("--step", "500", "--bounds", "-500,2500,2500,3500")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_is_printed_is_the_map_of_python() -> None:
    """In words and as JSON, with null and a reason where there is no plan."""
    found = optuav.maps.hover_point("paper", 500, bounds=(-500, 2500, 2500, 3500))
    said = run("map", "paper", "--over", "hover-point", *BOUNDS)
    assert said.code == 0
    assert widest(said.out) <= 80
    (best_s,) = found.to_numpy()[~np.isnan(found.to_numpy())]
    assert f"{best_s:.2f} s at (1000, 3000) m" in said.out
    assert "20 points: the device is out of reach" in " ".join(said.out.split())
    document = json.loads(run("map", "paper", "--over", "hover-point", *BOUNDS, "--json").out)
    values = np.array(document["hover_time_s"], dtype=float)
    assert np.array_equal(values, found.to_numpy(), equal_nan=True)
    assert document["x_m"] == [-500, 0, 500, 1000, 1500, 2000, 2500]
    assert document["kind"] == "optuav map"
    words = document["reason_words"][document["reason"][0][0]]
    assert words.startswith("the device is out of reach of the hover point")
    assert document["reason"][1][3] == 0


def test_a_best_point_at_the_edge_is_said_to_be_there() -> None:
    """What is beyond the map may be better."""
    said = run("map", "paper", "--over", "device", "--step", "500", "--bounds", "0,2000,1000,3000")
    assert "Longest    " in said.out
    assert ") m, at the edge of the map\n" in said.out


def test_options_are_those_of_python() -> None:
    asked = ("map", "paper", "--over", "laser", "--step", "1000", "--height-m", "70")
    asked = (*asked, "--perspective", "battery", "--set", "limits.deadline_s=900", "--json")
    document = json.loads(run(*asked).out)
    mission = optuav.load("paper").replace({"limits.deadline_s": 900})
    found = optuav.maps.laser(mission, 1000, height_m=70, perspective="battery")
    assert document["hover_time_s"] == found.to_numpy().tolist()
    assert document["height_m"] == 70


def test_files_and_pictures_are_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And replaced by the next map, as they are from optuav."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("rasterio")
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"optuav")  # drawn, not rendered
    for over in ("hover-point", "device"):
        asked = ("map", "paper", "--over", over, *BOUNDS, "--save", "a.tif", "--plot", "pictures")
        said = run(*asked)
        assert said.code == 0
        assert "wrote a.tif" in said.out
        assert (folder / f"pictures/{over}.png").read_bytes() == b"optuav"
    assert (folder / "a.tif").read_bytes().startswith(b"II")


def test_a_city_is_on_earth(folder: Path) -> None:
    """A mission of a map file states its reference system, and contours have degrees."""
    pytest.importorskip("geopandas")
    pytest.importorskip("matplotlib")
    from tests.city.maps import LATITUDE, LONGITUDE, geojson, square
    from tests.cli.test_city import SITE

    town = geojson(folder, [({"height": 30.0}, square(40.0 + 100 * k)) for k in range(3)])
    assert run("city", str(town), *SITE, "--save", "town.toml").code == 0
    assert f"+lon_0={LONGITUDE}" in (optuav.load("town.toml").crs or "")
    asked = ("map", "town.toml", "--over", "device", "--step", "20", "--save", "town.geojson")
    assert run(*asked).code == 0
    features = json.loads((folder / "town.geojson").read_text("utf-8"))["features"]
    places = np.concatenate([each for f in features for each in f["geometry"]["coordinates"]])
    assert np.abs(places - [LONGITUDE, LATITUDE]).max() < 0.02


def test_without_xarray_one_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where arrays are labelled; the words and numbers of a map need no library."""
    asked = ("map", "paper", "--over", "laser", "--step", "500")
    known = [run(*asked).out, run(*asked, "--json").out]
    monkeypatch.setitem(sys.modules, "xarray", None)
    assert [run(*asked).out, run(*asked, "--json").out] == known
    words = refused(*asked, "--save", "map.tif")
    assert words == (
        "error: maps need xarray, of the extra optuav[batch]; "
        'in a clone of optuav: python -m pip install ".[batch]"\n'
    )


def test_no_plan_anywhere_is_an_honest_no() -> None:
    said = run("map", "paper", "--over", "laser", *BOUNDS, "--set", "limits.deadline_s=30")
    assert said.code == 1
    assert "No plan      21 points: the shortest flight takes longer" in said.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("--over", "roof", "--step", "9"),
            "--over = 'roof': must be one of device, laser, hover-point",
        ),
        (
            ("--over", "laser", "--step", "0"),
            "--step = 0.0: must be a number, 0.001 <= x <= 1e6 [m]",
        ),
        (
            ("--over", "laser", "--step", "1", "--bounds", "a,b"),
            "--bounds = 'a,b': must be four numbers",
        ),
        (
            ("--over", "laser", "--step", "9", "--save", "a.png"),
            "--save = 'a.png': must be a name that",
        ),
        (
            ("--over", "laser", "--step", "9", "--save", "-"),
            "--save = '-': must be a name that ends in",
        ),
        (("--over", "laser", "--step", "9", "--save", "no/a.tif"), "there is no directory"),
        (("--over", "laser", "--step", "500", "--save", "a.geojson"), "crs: is missing"),
    ],
)
def test_faults_are_one_message(arguments: tuple[str, ...], words: str, folder: Path) -> None:
    said = refused("map", "paper", *arguments)
    assert words in said
    assert said.count("--") == words.count("--")
    assert not [*folder.iterdir()]


def test_faults_of_all_options_are_said_at_once() -> None:
    asked = ("--over", "roof", "--step", "0", "--bounds", "1,b", "--height-m", "inf")
    asked = (*asked, "--perspective", "wels")
    said = refused("map", "paper", *asked, "--set", "limits.min_soc=3")
    for words in (
        "--over = 'roof'",
        "--step = 0.0",
        "--bounds = '1,b'",
        "--height-m = inf",
        "--perspective = 'wels': must be one of",
        "min_soc",
    ):
        assert said.count(words) == 1


def test_one_of_several_devices_is_named(tmp_path: Path) -> None:
    """The map is that of Python, and several devices without a name are refused in words."""
    three().save(file := tmp_path / "three.toml")
    options = ("--step", "300", "--bounds", "300,2400,600,2700", "--json")
    said = run("map", f"{file}", "--over", "device", "--device", "west", *options)
    found = json.loads(said.out)
    expected = optuav.maps.device(three(), 300, device="west", bounds=(300, 2400, 600, 2700))
    assert found["over"] == "devices.west.position_m"
    assert found["hover_time_s"] == expected.values.tolist()
    words = refused("map", f"{file}", "--over", "device", *options)
    assert "device: is missing; the mission has several devices: one of west, north, east" in words
    words = refused("map", f"{file}", "--over", "laser", "--device", "west", *options)
    assert "--device = 'west': goes with maps of a device or of its hover point" in words
