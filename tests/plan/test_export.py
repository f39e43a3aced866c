"""Exports of plans: read back by GDAL, pymavlink and pyproj, which know nothing of optuav."""

from __future__ import annotations

import json
from math import cos, radians, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import geopandas
import pyproj
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavwp

import optuav
from optuav import P1, InputError, NoPlanError, Plan
from optuav.export import NOT_FLOWN
from tests.cli.run import refused, run

BERLIN = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4, "earth.altitude_m": 34.0}
SUFFIXES = (".kml", ".geojson", ".plan", ".waypoints")
TAKE_OFF, WAYPOINT, LOITER, LAND, DELAY, SPEED = 22, 16, 19, 21, 93, 178


def placed(**options: Any) -> Plan:
    """The plan of `paper` at a place on Earth."""
    return optuav.solve(optuav.load("paper").replace(BERLIN), **options)


def on_plane(longitude_deg: float, latitude_deg: float) -> tuple[float, float]:
    """East and north of the origin [m] by the geodesic, which knows no projection."""
    away = pyproj.Geod(ellps="WGS84").inv(13.4, 52.5, longitude_deg, latitude_deg)
    azimuth = radians(away[0])
    return away[2] * sin(azimuth), away[2] * cos(azimuth)


def waypoints(file: Path) -> list[Any]:
    """Items of a file as pymavlink reads them."""
    loader = mavwp.MAVWPLoader()
    return [loader.wp(number) for number in range(loader.load(str(file)))]


@pytest.mark.parametrize("suffix", [".kml", ".geojson"])
def test_maps_read_the_way_where_the_mission_states_it(suffix: str, tmp_path: Path) -> None:
    """GDAL finds each leg's ends where [earth] puts them, at altitudes above mean sea level."""
    plan = placed()
    file = plan.export(tmp_path / f"plan{suffix}")
    layer = geopandas.read_file(file)
    assert layer.crs.equals("EPSG:4326")
    lines = [*layer[layer.geom_type == "LineString"].geometry]
    assert plan.route == ("origin", "hover", "b10", "destination")
    assert [line.coords[0][2] for line in lines] == [84.0, 84.0, 134.0]
    roof_m = plan.mission.buildings[9].position_m[:2]
    for point, place_m in (
        (lines[0].coords[0], (0.0, 0.0)),
        (lines[2].coords[0], roof_m),
        (lines[2].coords[1], (2000.0, 0.0)),
    ):
        assert on_plane(*point[:2]) == pytest.approx(place_m, abs=1e-3)


def test_autopilots_read_the_stops_in_order(tmp_path: Path) -> None:
    """Pymavlink reads commands, times, heights over the origin, and a speed before each leg."""
    plan = placed()
    found = waypoints(plan.export(tmp_path / "plan.waypoints"))
    commands = [item.command for item in found]
    leg = [SPEED, WAYPOINT]
    assert commands == [
        WAYPOINT,
        TAKE_OFF,
        *leg,
        LOITER,
        *leg,
        LAND,
        DELAY,
        TAKE_OFF,
        *leg,
    ]
    home, loiter, delay = found[0], found[4], found[8]
    assert (home.frame, home.z, home.current) == (0, 84.0, 1)
    assert loiter.param1 == pytest.approx(597.2698, abs=1e-3)
    assert delay.param1 == pytest.approx(plan.rest_time_s, abs=1e-6)
    assert [item.z for item in found if item.frame == 3] == [0, 0, 0, 50, 50, 50, 0]
    speeds_m_s = [item.param2 for item in found if item.command == SPEED]
    assert speeds_m_s == pytest.approx([154.891, 83.184, 130.911], abs=1e-3)


def test_groundcontrol_and_autopilots_read_the_same_commands(tmp_path: Path) -> None:
    """The plan of QGroundControl has the items of the text, to 1e-7 degrees."""
    plan = placed()
    document = json.loads(plan.export(tmp_path / "a.plan").read_text())
    assert (document["fileType"], document["version"], document["mission"]["version"]) == (
        "Plan",
        1,
        2,
    )
    listed, text = document["mission"]["items"], waypoints(plan.export(tmp_path / "a.waypoints"))
    assert [item["doJumpId"] for item in listed] == [*range(1, len(listed) + 1)]
    for item, other in zip(listed, text[1:], strict=True):
        assert (item["command"], item["frame"]) == (other.command, other.frame)
        assert item["params"][:3] == pytest.approx([other.param1, other.param2, other.param3])
        assert item["params"][4:] == pytest.approx([other.x, other.y, other.z], abs=1e-7)
    latitude, longitude, altitude_m = document["mission"]["plannedHomePosition"]
    assert (latitude, longitude, altitude_m) == (text[0].x, text[0].y, text[0].z)


@given(
    st.floats(-179.9, 179.9),
    st.floats(-89.0, 89.0),
    st.floats(-400.0, 5000.0),
)
@settings(max_examples=10, deadline=None)
def test_places_survive_the_round_trip(
    longitude_deg: float, latitude_deg: float, altitude_m: float
) -> None:
    """Back on the mission's plane, every place is where the mission states it, to a centimetre."""
    from optuav.plan.export import course_of

    plan = optuav.solve("paper", "P3")
    names = ("earth.longitude_deg", "earth.latitude_deg", "earth.altitude_m")
    numbers = (longitude_deg, latitude_deg, altitude_m)
    mission = plan.mission.replace(dict(zip(names, numbers, strict=True)))
    course = course_of(plan.model_copy(update={"mission": mission}))
    there = pyproj.Proj(proj="aeqd", lon_0=longitude_deg, lat_0=latitude_deg, datum="WGS84")
    end = course.steps[-1].way[-1]
    assert there(*end[:2]) == pytest.approx((2000.0, 0.0), abs=0.01)
    assert there(*course.start[:2]) == pytest.approx((0.0, 0.0), abs=0.01)
    assert course.altitude_m == altitude_m


def test_crs_places_a_mission_as_earth_does(tmp_path: Path) -> None:
    """A stated crs is the frame of x and y, and the altitude of z = 0 goes with it."""
    crs = "+proj=aeqd +lon_0=13.4 +lat_0=52.5 +datum=WGS84 +units=m +no_defs"
    mission = optuav.load("paper").replace({"crs": crs, "earth.altitude_m": 34.0})
    files = [
        plan.export(tmp_path / f"{name}.kml").read_text()
        for name, plan in (("crs", optuav.solve(mission)), ("earth", placed()))
    ]
    assert files[0] == files[1]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_each_file_says_that_nobody_flew_it(suffix: str, tmp_path: Path) -> None:
    """And a plan that cannot be flown is refused unless forced, and then says why."""
    assert NOT_FLOWN in placed().export(tmp_path / f"a{suffix}").read_text("utf-8")
    fallen = placed(problem="P3", perspective="battery")
    file = tmp_path / f"b{suffix}"
    with pytest.raises(
        InputError, match=r"plan\.flyable = false: must be true; the available well runs"
    ):
        fallen.export(file)
    assert not file.exists()
    assert "runs dry at 660.26 s" in fallen.export(file, force=True).read_text("utf-8")


def test_names_that_markup_knows_are_escaped(tmp_path: Path) -> None:
    """A mission may be called what XML reserves."""
    plan = placed()
    named = plan.model_copy(update={"mission": plan.mission.replace({"name": "<b> & ü"})})
    root = ElementTree.parse(named.export(tmp_path / "a.kml")).getroot()
    assert root[0][0].text == "<b> & ü"


def test_what_is_refused(tmp_path: Path) -> None:
    """A plan without a place on Earth, another suffix, a frame in degrees, no plan."""
    plan = optuav.solve("paper")
    for file, words in (("a.kml", r"crs: is missing; .*\[earth\]"), ("a.gpx", r"ends in \.kml")):
        with pytest.raises(InputError, match=words):
            plan.export(tmp_path / file)
    for crs, words in (("EPSG:4326", "in metres"), ("EPSG:999999", "pyproj knows")):
        mission = plan.mission.replace({"crs": crs})
        with pytest.raises(InputError, match=words):
            plan.model_copy(update={"mission": mission}).export(tmp_path / "a.kml")
    none = placed(problem=P1(), perspective="available").mission.replace({"limits.deadline_s": 10})
    with pytest.raises(NoPlanError):
        optuav.solve(none).export(tmp_path / "a.kml")
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"earth.latitude_deg": 3.0}, "earth.longitude_deg: is missing"),
        ({"earth.longitude_deg": 3.0}, "earth.latitude_deg: is missing"),
        ({**BERLIN, "crs": "EPSG:25833"}, "earth.latitude_deg = 52.5: not beside crs"),
        (
            {**BERLIN, "earth.latitude_deg": 91.0},
            r"earth.latitude_deg = 91.0: must be a number, \|x\| <=",
        ),
        ({"earth.altitude_m": "high"}, "earth.altitude_m = 'high': must be a number"),
    ],
)
def test_a_place_on_earth_is_whole(values: dict[str, object], words: str) -> None:
    """Both angles or none, in range, and one frame of x and y."""
    with pytest.raises(InputError, match=words):
        optuav.load("paper").replace(values)


def test_the_command_writes_what_the_library_writes(tmp_path: Path) -> None:
    """Exit codes, words and files of ``optuav export``."""
    good, fallen = placed(), placed(problem="P3", perspective="battery")
    good.save(tmp_path / "good.json")
    fallen.save(tmp_path / "fallen.json")
    for suffix in SUFFIXES:
        file = tmp_path / f"a{suffix}"
        assert run("export", str(tmp_path / "good.json"), str(file)).code == 0
        assert file.read_text("utf-8") == good.export(tmp_path / f"b{suffix}").read_text("utf-8")
    asked = ("export", str(tmp_path / "fallen.json"), str(tmp_path / "c.kml"))
    assert "--force" in refused(*asked)
    assert not (tmp_path / "c.kml").exists()
    assert run(*asked, "--force").code == 0
    assert (tmp_path / "c.kml").exists()
