"""Exports of plans: read back by GDAL, pymavlink and pyproj, which know nothing of optuav."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import partial
from math import cos, radians, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import geopandas
import numpy as np
import pyproj
import pytest
import rasterio
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink import mavwp

import optuav
from optuav import P1, P4, InputError, NoPlanError, Plan
from optuav.export import NOT_FLOWN
from optuav.plan.climbs import FlightCharge, taken_off_with
from tests.cli.run import refused, run
from tests.several_devices import plan_over_three

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


def geoid(folder: Path, height_m: float) -> None:
    """Let pyproj find a grid of one height for EGM96, which is written here."""
    rows = {"width": 361, "height": 181, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    place: Any = {"driver": "GTiff", "transform": Affine(1, 0, -180.5, 0, -1, 90.5), **rows}
    with rasterio.open(folder / "us_nga_egm96_15.tif", "w", **place) as file:
        file.write(np.full((1, 181, 361), height_m, "float32"))
    pyproj.datadir.append_data_dir(str(folder))


@pytest.fixture
def grids(tmp_path: Path) -> Iterator[Path]:
    """A folder for grids that pyproj finds, until the test ends."""
    before = pyproj.datadir.get_data_dir()
    (tmp_path / "grids").mkdir()
    yield tmp_path / "grids"
    pyproj.datadir.set_data_dir(before)


def test_kml_has_the_way_where_the_mission_states_it(tmp_path: Path) -> None:
    """GDAL finds each leg's ends where [earth] puts them, at altitudes above mean sea level."""
    plan = placed()
    (file,) = plan.export(tmp_path / "plan.kml")
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


W_U = {"west": (496.2356, 2110.3833), "north": (1000, 2501.0152), "east": (1582.3933, 1915.0727)}
"""Hover points of the three devices by the check numbers [m]."""


@pytest.mark.parametrize("suffix", [".kml", ".geojson"])
def test_a_map_has_a_hover_of_each_device_with_its_seconds(suffix: str, tmp_path: Path) -> None:
    """GDAL finds a point at each w_U, in flight order, with a third of Δ beside it."""
    (file,) = plan_over_three().export(tmp_path / f"a{suffix}")
    layer = geopandas.read_file(file)
    stays = layer[layer.geom_type == "Point"]
    if suffix == ".kml":
        names = [name.split(" at ")[1] for name in stays.Name]
        lower = stays.rename(columns=str.lower)  # Drivers of GDAL write it in two ways
        seconds = [float(words.split()[0]) for words in lower.description]
    else:
        names, seconds = [*stays.place], [*stays.duration_s]
    assert names == ["east", "north", "b9", "west"]
    third_s = 647.331326 / 3
    assert seconds == pytest.approx([third_s, third_s, 1016.469, third_s], abs=1e-3)
    for name, point in zip(names, stays.geometry, strict=True):
        if name in W_U:
            assert on_plane(point.x, point.y) == pytest.approx(W_U[name], abs=1e-3)


def test_autopilots_loiter_over_each_device(tmp_path: Path) -> None:
    """Pymavlink reads a loiter at each w_U for a third of Δ; a rest between parts the flights."""
    first, _, second, _ = plan_over_three().export(tmp_path / "a.waypoints", force=True)
    loiters = [[w for w in waypoints(file) if w.command == LOITER] for file in (first, second)]
    for items, names in zip(loiters, (["east", "north"], ["west"]), strict=True):
        assert [item.param1 for item in items] == pytest.approx([647.331326 / 3] * len(names))
        for item, name in zip(items, names, strict=True):
            assert on_plane(item.y, item.x) == pytest.approx(W_U[name], abs=0.02)
    document = json.loads(plan_over_three().export(tmp_path / "a.plan", force=True)[0].read_text())
    items = [item for item in document["mission"]["items"] if item["command"] == LOITER]
    assert [item["params"][0] for item in items] == pytest.approx([647.331326 / 3] * 2)
    assert refused_by_px4(document) == []


def test_geojson_has_heights_above_the_ellipsoid_or_none(grids: Path, tmp_path: Path) -> None:
    """RFC 7946 wants them there: with a geoid 40.25 m above it, else none, and words."""
    plan = placed()
    (file,) = plan.export(tmp_path / "flat.geojson")
    flat, words = geopandas.read_file(file), json.loads(file.read_text())["notes"]
    geoid(grids, 40.25)
    (file,) = plan.export(tmp_path / "high.geojson")
    high, more = geopandas.read_file(file), json.loads(file.read_text())["notes"]
    assert not flat.has_z.any()
    assert "Without heights" in words[1]
    assert high.has_z.all()
    assert more == [NOT_FLOWN]
    lines = [*high[high.geom_type == "LineString"].geometry]
    assert [line.coords[0][2] for line in lines] == pytest.approx([124.25, 124.25, 174.25])
    for one, other in zip(flat.geometry, high.geometry, strict=True):
        assert one.coords[0] == other.coords[0][:2]


def test_autopilots_read_a_file_per_flight(tmp_path: Path) -> None:
    """Pymavlink reads commands, times and speeds, at heights above each file's own take-off."""
    plan = placed()
    paths = plan.export(tmp_path / "hill.waypoints", force=True)
    names = ["hill-1.waypoints", "hill-1.txt", "hill-2.waypoints", "hill-2.txt"]
    assert [path.name for path in paths] == names
    first, second = waypoints(paths[0]), waypoints(paths[2])
    leg = [SPEED, WAYPOINT]
    assert [item.command for item in first] == [WAYPOINT, TAKE_OFF, *leg, LOITER, *leg, LAND]
    assert [item.command for item in second] == [WAYPOINT, TAKE_OFF, *leg, LAND]
    # The origin and the hover point at z = 50, the roof at 100, the destination at 50
    assert [item.z for item in first] == [84, 12, 0, 0, 0, 0, 62, 50]
    assert [item.z for item in second] == [134, 12, 0, -38, -50]
    assert [item.frame for item in second] == [0, 3, 2, 3, 3]
    assert first[4].param1 == pytest.approx(597.2698, abs=1e-3)
    speeds_m_s = [item.param2 for item in [*first, *second] if item.command == SPEED]
    assert speeds_m_s == pytest.approx([154.891, 83.184, 130.911], abs=1e-3)
    assert f"after a rest of {plan.rest_time_s:.2f} s" in paths[3].read_text()


def refused_by_px4(document: dict[str, Any], radius_m: float = 10.0) -> list[str]:
    """Break of a rule of its FeasibilityChecker, written from the rules."""
    found, positioned = list[str](), False
    items = document["mission"]["items"]
    for item in items:
        if item["command"] == TAKE_OFF:
            if item["Altitude"] - 1.0 < radius_m:
                found.append("take-off too low")
            if positioned:
                found.append("take-off is not the first item with a position")
        positioned |= item["command"] not in (DELAY, SPEED)
    if items[0]["command"] != TAKE_OFF or items[-1]["command"] != LAND:
        found.append("no take-off or no landing")
    return found


@pytest.mark.parametrize(
    "make",
    [
        placed,
        partial(placed, problem="P3"),
        partial(placed, problem=P4("b9")),
        lambda: optuav.solve(optuav.load("matrice350").replace(BERLIN)),
        lambda: optuav.coverage(optuav.load("matrice350").replace(BERLIN)).event(4).plans[0],
    ],
)
def test_every_export_keeps_the_rules_of_autopilots_and_ground_stations(
    make: Any, tmp_path: Path
) -> None:
    """PX4's, QGroundControl's twelve fields between tabs, and home where each flight takes off."""
    plan = make()
    rests = sum(phase.kind == "rest" and phase.duration_s > 0.0 for phase in plan.phases)
    plans = plan.export(tmp_path / "a.plan", force=True)
    texts = plan.export(tmp_path / "a.waypoints", force=True)[::2]
    assert len(plans) == len(texts) == rests + 1
    landed: list[float] = []
    for file, text in zip(plans, texts, strict=True):
        document = json.loads(file.read_text())
        assert refused_by_px4(document) == []
        head, *lines = text.read_text().splitlines()
        assert head == "QGC WPL 110"
        assert {len(line.split("\t")) for line in lines} == {12}
        home, items = document["mission"]["plannedHomePosition"], document["mission"]["items"]
        assert items[0]["params"][4:6] == home[:2]
        # A flight begins where the one before it has landed
        assert home == pytest.approx(landed or home, abs=1e-6)
        *angles, height_m = items[-1]["params"][4:]
        landed = [*angles, home[2] + height_m]
        rows = [[float(figure) for figure in line.split("\t")] for line in lines]
        assert rows[0][8:11] == pytest.approx(home, abs=1e-6)
        assert [row[3] for row in rows[1:]] == [item["command"] for item in items]
        for row, item in zip(rows[1:], items, strict=True):
            assert row[4:7] == pytest.approx(item["params"][:3])
            assert row[8:11] == pytest.approx(item["params"][4:], abs=1e-6)


def test_what_climbs_cost_is_told(tmp_path: Path) -> None:
    """By hand: 2 m/s² up and down again for 12 m, at the draw of flight, at both ends."""
    plan = optuav.solve(optuav.load("matrice350").replace(BERLIN))
    flight = plan.mission.flight
    once_s = 2.0 * (12.0 / flight.acceleration_m_s2) ** 0.5
    charge_As = 4 * once_s * flight.flight_current_A
    share = charge_As / (plan.mission.battery.capacity_As * plan.mission.battery.packs)
    percent = f"{round(100.0 * share, 2):g} %"
    for path in plan.export(tmp_path / "a.plan"):
        words = json.loads(path.read_text())["notes"][-1]
        assert f"{4 * once_s:.1f} s and {percent} of the battery in 2 flights" in words


@pytest.mark.parametrize("mission", ["paper", "paper-drag", "paper-table2", "relay-today"])
def test_a_battery_that_climbs_empty_is_refused_with_a_reserve_to_plan_with(
    mission: str, tmp_path: Path
) -> None:
    """Here, with the values that the refusal names, the first flight keeps charge."""
    place = optuav.load(mission).replace({**BERLIN, "limits.keep_soc": "end"})
    plan, file = optuav.solve(place), tmp_path / "a.plan"
    with pytest.raises(InputError, match="climbs, the plan cannot be flown") as refused_plan:
        plan.export(file)
    assert not [*tmp_path.iterdir()]
    (tmp_path / "forced").mkdir()
    notes = json.loads(plan.export(tmp_path / "forced" / "a.plan", force=True)[0].read_text())
    assert any("cannot be flown: the battery is empty" in note for note in notes["notes"])
    assert "that plan may have other flights, and need more" in str(refused_plan.value)
    named = re.findall(r"--set (\S+)=([\w.]*\w)", str(refused_plan.value))
    assert {key for key, _ in named} >= {"limits.min_soc"}
    changed = place.replace({key: x if x == "always" else float(x) for key, x in named})
    first, *_ = optuav.solve(changed).export(file)
    verdict = optuav.audit(first, changed.replace({"limits.min_soc": 0.0}))
    assert "empty" not in {event.kind for event in verdict.violations}


def test_a_reserve_that_climbs_take_is_told_with_the_one_to_set(tmp_path: Path) -> None:
    """With the value that the warning names, the flights land with what the mission asks for."""
    mission, file = optuav.load("matrice350").replace(BERLIN), tmp_path / "a.plan"
    (warning,) = (note for note in notes_of(optuav.solve(mission), file) if "reserve is" in note)
    (stated,) = re.findall(r"--set limits.min_soc=([\d.]*\d)", warning)
    _, second = optuav.solve(mission.replace({"limits.min_soc": float(stated)})).export(file)
    assert float(stated) == 0.21
    left = [note for note in json.loads(second.read_text())["notes"] if "lands with" in note]
    assert float(re.findall(r"lands with ([\d.]+) %", left[0])[0]) >= 20.0


def test_a_deadline_that_climbs_miss_is_told(tmp_path: Path) -> None:
    """By hand: four times 12 m at 2 m/s²; the deadline that the warning names is kept."""
    mission = optuav.load("matrice350").replace({**BERLIN, "limits.deadline_s": 500.0})
    notes = notes_of(optuav.solve(mission), tmp_path / "a.plan")
    (warning,) = (note for note in notes if "deadline" in note)
    legs = 2 * 2.0 * (12.0 / mission.flight.acceleration_m_s2) ** 0.5
    assert float(re.findall(r"takes ([\d.]+) s", warning)[0]) == pytest.approx(500 + legs, abs=0.5)
    (stated,) = re.findall(r"--set limits.deadline_s=(\d+)", warning)
    plan = optuav.solve(mission.replace({"limits.deadline_s": float(stated)}))
    (file,) = plan.export(tmp_path / "b.plan")
    verdict = optuav.audit(file, mission)
    assert "deadline" not in {event.kind for event in verdict.violations}


def notes_of(plan: Plan, file: Path) -> list[str]:
    """Notes of the first flight of a plan."""
    notes: list[str] = json.loads(plan.export(file)[0].read_text())["notes"]
    return notes


def test_flights_of_another_plan_are_not_left_beside(tmp_path: Path) -> None:
    """A plan of one flight after one of two: a pilot who loads hill-2 would fly the old one."""
    mission = optuav.load("matrice350").replace(BERLIN)
    two, one = optuav.solve(mission), optuav.solve(mission, "P3")
    for suffix in (".plan", ".waypoints"):
        file = tmp_path / f"hill{suffix}"
        stale = two.export(file)
        (tmp_path / f"hill-side-2{suffix}").touch()  # Another plan's name
        with pytest.raises(InputError, match=f"hill-1{suffix}, hill-2{suffix}"):
            one.export(file)
        assert not file.exists()
        two.export(file)  # The same flights are replaced
        for old in stale:
            old.unlink()
        one.export(file)
        with pytest.raises(InputError, match=f"another plan: hill{suffix}"):
            two.export(file)
        assert not (tmp_path / f"hill-1{suffix}").exists()
        two.export(file, force=True)


def test_a_low_take_off_is_doubted(tmp_path: Path) -> None:
    """PX4's acceptance radius is a parameter, so that 5 m may be right."""
    for climb_m, doubted in ((11.0, False), (10.9, True)):
        path, _ = placed().export(tmp_path / "a.plan", climb_m=climb_m, force=True)
        assert ("NAV_ACC_RAD" in path.read_text()) == doubted
        assert bool(refused_by_px4(json.loads(path.read_text()))) == doubted
    wrong: Any
    for wrong in (0.0, -1, 1001, float("nan"), "12"):
        with pytest.raises(InputError, match=r"climb_m = .*: .*0 < x <= 1000 \[m\]"):
            placed().export(tmp_path / "a.plan", climb_m=wrong)
    with pytest.raises(InputError, match=r"climb_m = 12.0: goes with \.plan and \.waypoints"):
        placed().export(tmp_path / "a.kml", climb_m=12.0)


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
        plan.export(tmp_path / f"{name}.kml")[0].read_text()
        for name, plan in (("crs", optuav.solve(mission)), ("earth", placed()))
    ]
    assert files[0] == files[1]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_each_file_says_that_nobody_flew_it(suffix: str, tmp_path: Path) -> None:
    """And a plan that cannot be flown is refused unless forced, and then says why."""
    for file in placed().export(tmp_path / f"a{suffix}", force=True):
        assert (NOT_FLOWN in file.read_text("utf-8")) != (file.suffix == ".waypoints")
    fallen = placed(problem="P3", perspective="battery")
    file = tmp_path / f"b{suffix}"
    with pytest.raises(
        InputError, match=r"plan\.flyable = false: must be true; the available well runs"
    ):
        fallen.export(file)
    assert not [*tmp_path.glob("b*")]
    assert "runs dry at 660.26 s" in fallen.export(file, force=True)[-1].read_text("utf-8")


def test_names_that_markup_knows_are_escaped(tmp_path: Path) -> None:
    """A mission may be called what XML reserves."""
    plan = placed()
    named = plan.model_copy(update={"mission": plan.mission.replace({"name": "<b> & ü"})})
    root = ElementTree.parse(*named.export(tmp_path / "a.kml")).getroot()
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
    good = optuav.solve(optuav.load("matrice350").replace(BERLIN))
    fallen = placed(problem="P3", perspective="battery")
    good.save(tmp_path / "good.json")
    fallen.save(tmp_path / "fallen.json")
    for suffix in SUFFIXES:
        asked = ("export", str(tmp_path / "good.json"), str(tmp_path / f"a{suffix}"))
        answer = run(*asked)
        assert answer.code == 0
        for file in good.export(tmp_path / f"b{suffix}"):
            mine = file.with_name(file.name.replace("b", "a"))
            assert f"wrote {mine}" in answer.out
            assert mine.read_text("utf-8") == file.read_text("utf-8")
        assert run(*asked).code == 0  # Its own files are replaced
    asked = ("export", str(tmp_path / "fallen.json"), str(tmp_path / "c.kml"))
    assert "--force" in refused(*asked)
    assert not (tmp_path / "c.kml").exists()
    assert run(*asked, "--force").code == 0
    assert (tmp_path / "c.kml").exists()
    (tmp_path / "d-1.waypoints").write_text("QGC WPL 110\n")
    asked = ("export", str(tmp_path / "good.json"), str(tmp_path / "d.waypoints"))
    assert "is not from optuav" in refused(*asked)
    assert [file.name for file in tmp_path.glob("d*")] == ["d-1.waypoints"]
    assert run(*asked, "--climb-m", "30", "--force").code == 0
    assert "0 < x <= 1000" in refused(*asked, "--climb-m", "-3")


@pytest.mark.parametrize("climb_m", [12.0, 300.0])
def test_a_flight_lands_as_exported_with_what_the_audit_finds(
    climb_m: float, tmp_path: Path
) -> None:
    """The judge reads the file and knows nothing of the plan; what is below the reserve is told."""
    mission = optuav.load("relay-today").replace(BERLIN)
    plan = optuav.solve(mission, "P3")
    (file,) = plan.export(tmp_path / "a.plan", climb_m=climb_m)
    replayed = optuav.audit(file, mission).replay
    assert replayed is not None
    words = json.loads(file.read_text())["notes"]
    left = f"{100.0 * replayed.soc['battery']:.2f}".rstrip("0")
    assert any(
        f"the plan lands with {left} % of the battery; the reserve is 20" in w for w in words
    )
    assert "Take off with at least 100 % of the battery." in words


@pytest.mark.parametrize(
    ("share", "words"), [(0.99996, "100 %"), (1.0, "100 %"), (0.98764, "98.76 %")]
)
def test_nearly_all_of_a_battery_is_all_at_a_take_off(share: float, words: str) -> None:
    charge = FlightCharge(share, 0.2, dry=False, planned=0.2)
    assert taken_off_with(charge) == f"Take off with at least {words} of the battery."


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_an_unknown_altitude_is_told(suffix: str, tmp_path: Path) -> None:
    """An altitude of 0 that nobody stated is 519 m below Munich; another one is right."""
    unstated = {key: value for key, value in BERLIN.items() if "altitude" not in key}
    for earth, told in ((unstated, True), ({**unstated, "earth.altitude_m": 1.0}, False)):
        plan = optuav.solve(optuav.load("paper").replace(earth))
        for file in plan.export(tmp_path / f"a{suffix}", force=True):
            words = file.read_text("utf-8")
            assert ("earth.altitude_m is 0" in words) == (told and file.suffix != ".waypoints")


def test_flights_of_a_mission_without_an_altitude_are_read_back(tmp_path: Path) -> None:
    """The second flight begins on its roof, not inside the building."""
    crs = "+proj=aeqd +lon_0=13.4 +lat_0=52.5 +datum=WGS84 +units=m +no_defs"
    mission = optuav.load("relay-today").replace({"crs": crs})
    plan = optuav.solve(mission)
    _, second = plan.export(tmp_path / "a.plan")
    replayed = optuav.audit(second, mission).replay
    assert replayed is not None
    assert "building" not in {event.kind for event in replayed.violations}
    roof_m = plan.mission.buildings.roof_m[plan.mission.buildings.names.index(plan.route[2])]
    assert replayed.phases[0].start.position_m == pytest.approx(roof_m.tolist(), abs=1e-3)


def test_every_piece_of_a_bent_leg_tells_its_own_speed(tmp_path: Path) -> None:
    """A steep climb over a roof is slow over ground: at these speeds a leg lasts as planned.

    The fastest piece's speed for all of them would fly the climb twice as fast as the drone can.
    """
    mission = optuav.load("relay-today").replace(BERLIN)
    place: Any = mission.link.device_m
    roof = {"name": "roof", "position_m": [0.53 * place[0], 0.53 * place[1], 140]}
    walled = mission.replace(
        {"buildings": [roof | {"footprint_m": [60, 60]}], "flight.obstacles": "over"}
    )
    plan = optuav.solve(walled, P1(trajectory="direct"))
    (file,) = plan.export(tmp_path / "bent.waypoints")[:1]
    here, flown_s, speeds_m_s = (
        on_plane(waypoints(file)[0].y, waypoints(file)[0].x),
        0.0,
        list[float](),
    )
    for item in waypoints(file)[2:]:
        if item.command == LOITER:
            break
        if item.command == SPEED:
            speeds_m_s.append(item.param2)
            continue
        there = on_plane(item.y, item.x)
        flown_s += float(np.hypot(there[0] - here[0], there[1] - here[1])) / speeds_m_s[-1]
        here = there
    (leg, *_) = (phase for phase in plan.phases if phase.kind == "flight")
    assert len(leg.waypoints_m) == 1
    assert 2.0 * speeds_m_s[0] < speeds_m_s[1]
    assert 0.8 * leg.duration_s < flown_s < leg.duration_s


def test_two_hovers_at_one_point_have_no_leg_between(tmp_path: Path) -> None:
    """No autopilot is told to creep to where it is."""
    point = {"hover_m": [600, 450, 80]}
    devices = [
        {"name": "a", "position_m": [600, 450, 0], **point},
        {"name": "b", "position_m": [610, 450, 0], **point},
    ]
    mission = optuav.load("relay-today").replace({**BERLIN, "devices": devices})
    plan = optuav.solve(mission, P1(trajectory="direct"))
    (file,) = plan.export(tmp_path / "two.waypoints")[:1]
    commands = [item.command for item in waypoints(file)]
    assert [*map(commands.count, (LOITER, WAYPOINT))] == [2, 3]  # home, hover point, destination
