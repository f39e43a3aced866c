"""Candidates of a map or a grid, and lasers as files: read by GDAL and pyproj, or by hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pytest

import optuav
from optuav.errors import InputError
from optuav.siting.candidates import candidates_of
from tests.cli.run import refused, run
from tests.plan.test_export import BERLIN, on_plane

HERE = optuav.load("matrice350").replace(BERLIN)
PLACES = [(13.4075, 52.4996), (13.3990, 52.5020), (13.4100, 52.5030)]


def points(folder: Path, *places: Any, z_m: Any = None, **more: Any) -> Path:
    """A GeoJSON file of points as GDAL writes it."""
    table = {"z_m": [z_m] * len(places)} if z_m is not None else {"name": ["a"] * len(places)}
    layer = geopandas.GeoDataFrame(
        table, geometry=geopandas.points_from_xy(*zip(*places, strict=True)), crs=4326
    )
    layer.to_file(folder / "points.geojson")
    return folder / "points.geojson"


def test_points_of_a_map_lie_where_the_geodesic_says(tmp_path: Path) -> None:
    """East and north of [earth] to a centimetre; as high as the laser, or as z_m states."""
    found_m = candidates_of(points(tmp_path, *PLACES), [HERE]).position_m
    assert HERE.laser is not None
    for (x_m, y_m, z_m), place in zip(found_m.tolist(), PLACES, strict=True):
        assert (x_m, y_m) == pytest.approx(on_plane(*place), abs=0.01)
        assert z_m == HERE.laser.position_m[2]
    assert (
        candidates_of(points(tmp_path, *PLACES, z_m=7.5), [HERE]).position_m[:, 2].tolist()
        == [7.5] * 3
    )


def test_a_grid_lies_over_all_places() -> None:
    """Ten steps along the longer side, or a stated step; all missions lie in it."""
    far = HERE.replace({"link.device_m": [3000.0, 450.0, 0.0]})
    for missions, step_m in (([HERE], None), ([HERE, far], None), ([HERE], 100.0)):
        found_m = candidates_of("grid", missions, step_m).position_m
        x_m, y_m = (np.unique(found_m[:, axis]) for axis in (0, 1))
        assert len(found_m) == len(x_m) * len(y_m)
        steps_m = np.concatenate([np.diff(x_m), np.diff(y_m)])
        step = step_m or max(np.ptp(x_m), np.ptp(y_m)) / 10
        assert steps_m == pytest.approx(step)
        for mission in missions:
            for roof in mission.buildings:
                assert x_m[0] <= roof.position_m[0] <= x_m[-1] + step
                assert y_m[0] <= roof.position_m[1] <= y_m[-1] + step


@pytest.fixture(scope="module")
def placed() -> optuav.siting.place_laser.Siting:
    """Two lasers for three devices."""
    missions = [
        HERE.replace({"name": f"device {n}", "link.device_m": [x, 450.0, 0.0]})
        for n, x in enumerate((300.0, 600.0, 900.0))
    ]
    return optuav.place_laser(missions, "grid", 2, step_m=250.0)


@pytest.mark.parametrize("suffix", [".geojson", ".kml"])
def test_maps_have_the_lasers_of_the_text(suffix: str, placed: Any, tmp_path: Path) -> None:
    """GDAL reads each site by its number, where the laser is in the end."""
    layer = geopandas.read_file(placed.save(tmp_path / f"sites{suffix}"))
    names = layer["name" if suffix == ".geojson" else "Name"]
    assert [*names] == [f"Site {site}" for site in placed.selection.sites]
    for point, at_m in zip(layer.geometry, placed.position_m, strict=True):
        assert on_plane(point.x, point.y) == pytest.approx(tuple(at_m[:2]), abs=0.01)
        assert point.has_z == (suffix == ".kml")
        if suffix == ".kml":
            assert point.z == pytest.approx(at_m[2] + BERLIN["earth.altitude_m"])
    assert all(f"Site {site}" in str(placed) for site in placed.selection.sites)
    if suffix == ".geojson":  # Its points are candidates again
        found_m = candidates_of(tmp_path / "sites.geojson", placed.missions).position_m
        assert found_m == pytest.approx(placed.position_m, abs=1e-3)


def test_missions_have_their_laser(placed: Any, tmp_path: Path) -> None:
    """Each file is the mission that `mission` returns, and hovers as long as was said."""
    files = placed.save_missions(tmp_path / "missions")
    assert [file.name for file in files] == [f"device-{n}-{n}.toml" for n in range(3)]
    for number, file in enumerate(files):
        mission = optuav.load(file)
        assert mission == placed.mission(number)
        longest_s = np.nanmax(placed.hover_s[number])
        assert optuav.solve(mission).hover_time_s == pytest.approx(longest_s, abs=1e-3)


def test_a_candidate_on_the_other_side_of_the_earth_is_named(tmp_path: Path) -> None:
    file = tmp_path / "masts.geojson"
    point = {"type": "Point", "coordinates": [93.4, 52.5]}
    file.write_text(json.dumps({"type": "FeatureCollection", "features": [{"geometry": point}]}))
    words = r"masts.geojson: features\[0\]\.geometry = \[93.4, 52.5\]: must be a place"
    with pytest.raises(InputError, match=f"{words}.*longitude comes before latitude"):
        optuav.place_laser(HERE, file)


def test_the_picture_has_the_numbers_of_the_text(placed: Any) -> None:
    """Beside the squares of the sites."""
    from optuav import plots

    texts = {text.get_text() for text in plots.sites(placed).texts}
    assert texts == {str(site) for site in placed.selection.sites}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "is not JSON"),
        ("[1]", "needs a FeatureCollection"),
        ('{"type": "FeatureCollection", "features": []}', "features = an empty list: needs a Po"),
        ('{"features": [{"geometry": {"type": "Point", "coordinates": [200, 5]}}]}', r"\[200, 5\]"),
        (
            '{"features": [{"geometry": {"type": "Point", "coordinates": 5}}]}',
            r"a longitude, .* a latitude",
        ),
        (
            '{"features": [{"geometry": {"type": "LineString", "coordinates": [[1, 2]]}}]}',
            "'LineString': must be a Point",
        ),
        (
            '{"features": [{"geometry": {"type": "Polygon", "coordinates": [13.4, 52.5]}}]}',
            "'Polygon': must be a Point",
        ),
        (
            '{"version": 0.6, "generator": "Overpass API", "osm3s": {}, "elements": []}',
            "is Overpass JSON, where a GeoJSON of points is needed",
        ),
        ('{"features": [7]}', r"features\[0\]"),
        ('{"crs": "EPSG:25833", "features": [7]}', "WGS 84"),
    ],
)
def test_damaged_maps_are_named(content: str, words: str, tmp_path: Path) -> None:
    """One error with the file."""
    (tmp_path / "a.geojson").write_text(content)
    with pytest.raises(InputError, match=words) as error:
        candidates_of(tmp_path / "a.geojson", [HERE])
    assert "a.geojson" in str(error.value)


def test_all_faults_are_told(tmp_path: Path) -> None:
    """Of a map and of its features, beside those of missions and options."""
    line = {"type": "LineString", "coordinates": [[13.4, 52.5], [13.5, 52.5]]}
    shapes: list[Any] = [{"type": "Point", "coordinates": [13.4, 52.5]}, line, None]
    features = [{"properties": {"z_m": "high"}, "geometry": shape} for shape in shapes]
    file = tmp_path / "a.geojson"
    file.write_text(json.dumps({"crs": "EPSG:25833", "features": features}))
    with pytest.raises(InputError) as refused_map:
        optuav.place_laser("nope", file, 0, step_m=-1.0)
    keys = [fault.key for fault in refused_map.value.faults]
    assert {"step_m", "crs", "lasers", "features[1].geometry", "features[2].geometry"} <= {*keys}
    assert sum(key.endswith("z_m") for key in keys) == 3
    assert "features[2].geometry = null" in str(refused_map.value)
    said = refused("place", "nope", "--candidates", str(file), "--lasers", "0", "--step", "-1")
    assert all(f"{key}" in said for key in ("nope: ", "--step = -1.0", "--lasers = 0", "z_m"))
    (tmp_path / "b.geojson").write_text('<?xml version="1.0"?>\n<kml xmlns="x"></kml>')
    for kml in ("b.geojson", "b.kml"):
        with pytest.raises(InputError, match="ogr2ogr -f GeoJSON"):
            candidates_of(tmp_path / kml, [HERE])


def test_sites_that_become_candidates_have_one_number(tmp_path: Path) -> None:
    """A file of sites is a file of candidates, where other sites have these numbers."""
    source = tmp_path / "a.geojson"
    geopandas.GeoDataFrame(
        {"name": ["North", None]},
        geometry=geopandas.points_from_xy(*zip(*PLACES[:2], strict=True)),
        crs=4326,
    ).to_file(source)
    sites = optuav.place_laser(HERE, source, refine=False).save(tmp_path / "b.geojson")
    again = optuav.place_laser(HERE, sites, refine=False)
    named = optuav.place_laser(HERE, source, refine=False)
    labels = {text.get_text() for text in optuav.plots.sites(named).texts}
    assert labels == {{0: "North (0)", 1: "1"}[number] for number in named.selection.sites}
    (number,) = again.selection.sites
    assert geopandas.read_file(again.save(tmp_path / "c.geojson"))["name"][0] in (
        f"North (site {number})",
        f"Site {number}",
    )


def test_what_is_refused(tmp_path: Path) -> None:
    """No place on Earth, two of them, a height that is none, a grid of too many points."""
    file = points(tmp_path, *PLACES)
    other = HERE.replace({"earth.latitude_deg": 50.0})
    for missions, words in (
        (["paper"], r"^paper: crs: is missing; .* crs, or \[earth\]"),
        ([HERE, other], "crs: must be the same for all missions"),
    ):
        with pytest.raises(InputError, match=words):
            optuav.place_laser(missions, file)
    with pytest.raises(InputError, match=r"features\[0\].properties.z_m = 'high'"):
        candidates_of(points(tmp_path, *PLACES, z_m="high"), [HERE])
    for step_m, words in (
        (0.0, "0 < x"),
        (1.0, r"1.0: makes \d+ × \d+ candidates"),
        ("x", "0 < x"),
    ):
        stated: Any = step_m
        with pytest.raises(InputError, match=rf"step_m = .*{words}"):
            optuav.place_laser(HERE, "grid", step_m=stated)
    with pytest.raises(InputError, match="step_m = 5: goes with candidates 'grid'"):
        optuav.place_laser(HERE, file, step_m=5)


def test_the_command(tmp_path: Path) -> None:
    """What it writes and prints, and its exit codes."""
    mission = str(HERE.save(tmp_path / "here.toml"))
    save, folder = tmp_path / "sites.kml", tmp_path / "missions"
    asked = ("place", mission, "--candidates", "grid", "--step", "400", "--no-refine")
    answer = run(*asked, "--save", str(save), "--missions", str(folder), "--plot", str(tmp_path))
    assert answer.code == 0
    for file in (save, folder / "matrice350.toml", tmp_path / "sites.png"):
        assert f"wrote {file}" in answer.out
        assert file.exists()
    sites = json.loads(run(*asked, "--json").out)["selection"]["sites"]
    assert f"Site {sites[0]} " in answer.out
    dark = run(*asked, "--set", "limits.deadline_s=10")
    assert dark.code == 1
    for more, words in (
        (("--lasers", "0"), "--lasers = 0"),
        (("--save", "a.csv"), "--save = 'a.csv'"),
        (("--step", "0"), "--step = 0.0"),
        (("--objective", "best"), "--objective = 'best'"),
    ):
        assert words in refused(*asked, *more)
    outside = ("place", "paper", "--candidates", "grid", "--save", str(tmp_path / "b.kml"))
    assert "crs: is missing" in refused(*outside)


def test_names_of_candidates_and_what_is_left_out_are_told(tmp_path: Path) -> None:
    """A place that the file calls B is B in the text, the map and the data; two need two places."""
    file = points(tmp_path, PLACES[0], z_m=30.0)
    document = json.loads(file.read_text())
    document["features"][0]["properties"]["name"] = "B"
    file.write_text(json.dumps(document))
    placed = optuav.place_laser(HERE, file, lasers=2, refine=False)
    assert "B (site 0)" in str(placed)
    assert placed.to_dict()["names"] == ["B"]
    assert "1 of 2: there are no more candidates" in str(placed)
    assert "B (site 0)" in placed.save(tmp_path / "sites.kml").read_text()
    near = [[0.0, 100.0, 30.0], [0.0, 100.0, 30.0]]
    assert "1 of 2: no other candidate adds anything" in str(
        optuav.place_laser(HERE, near, lasers=2, refine=False)
    )
