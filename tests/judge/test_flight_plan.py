"""Flight plans of ground stations are flown as they say, or it is told what is not.

Times and charges are computed here from the model's own figures for each leg; places by the
geodesics of the ellipsoid, which know no plane.
"""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pyproj")

import pyproj

import optuav
from optuav.errors import InputError
from optuav.judge.flight_plan import FlightPlan
from optuav.judge.timeline import SimulatedPhase
from tests.cli.run import refused, run, words
from tests.several_devices import plan_over_three

HOME = (52.5, 13.4, 34.0)
Item = dict[str, Any]


def item(command: int, *numbers: float | None, frame: int = 3) -> Item:
    """A simple item as QGroundControl writes it: four parameters, latitude, longitude, height."""
    filled = [*numbers, *[0] * (7 - len(numbers))]
    return {"autoContinue": True, "command": command, "frame": frame, "params": filled} | {
        "type": "SimpleItem",
        "AltitudeMode": 1,
        "Altitude": filled[6],
        "doJumpId": 1,
    }


def plan(folder: Path, items: list[Item], name: str = "survey.plan", **mission: Any) -> Path:
    """A plan of QGroundControl, after those that its own tests read."""
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
        "mission": {
            **{"version": 2, "firmwareType": 12, "vehicleType": 2, "cruiseSpeed": 15},
            **{"hoverSpeed": 5, "globalPlanAltitudeMode": 1, "plannedHomePosition": [*HOME]},
            **{"items": items, **mission},
        },
    }
    file = folder / name
    file.write_text(json.dumps(document))
    return file


SQUARE = [
    item(22, 0, 0, 0, None, *HOME[:2], 40),
    item(16, 0, 0, 0, None, 52.503, 13.4, 40),
    item(178, 1, 8, -1, frame=2),
    item(16, 0, 0, 0, None, 52.503, 13.406, 60),
    item(2000, 0, 0, 1, frame=2),
    item(19, 30, 0, 0, None, 52.5, 13.406, 60),
    item(21, 0, 0, 0, None, *HOME[:2], 0),
]


def judged(file: Path, mission: Any = "relay-today") -> tuple[optuav.judge.Audit, FlightPlan]:
    verdict = optuav.audit(file, mission)
    assert isinstance(verdict.subject, FlightPlan)
    return verdict, verdict.subject


def test_a_plan_is_flown_leg_by_leg(tmp_path: Path) -> None:
    """Climb, three legs at their speeds, a loiter, the way home, and down; lengths by geodesics."""
    verdict, _ = judged(plan(tmp_path, SQUARE))
    assert verdict.flyable
    assert verdict.replay is not None
    flights = [phase for phase in verdict.replay.phases if phase.kind == "flight"]
    geod = pyproj.Geod(ellps="WGS84")
    places = [(13.4, 52.5, 0), (13.4, 52.5, 40), (13.4, 52.503, 40), (13.406, 52.503, 60)]
    places += [(13.406, 52.5, 60), (13.4, 52.5, 60), (13.4, 52.5, 0)]
    for phase, (begin, end) in zip(flights, pairwise(places), strict=True):
        *_, level_m = geod.inv(*begin[:2], *end[:2])
        length_m = math.hypot(level_m, end[2] - begin[2])
        assert phase.distance_m == pytest.approx(length_m, abs=0.01)
    speeds = [phase.peak_speed_m_s for phase in flights]
    level = [math.dist(p.points_m[0][:2], p.points_m[1][:2])
             / p.distance_m for p in flights]  # fmt: skip
    speeds = [speed * share for speed, share in zip(speeds, level, strict=True)]
    assert speeds[1:5] == pytest.approx([5.0, 8.0, 8.0, 8.0], rel=1e-6)
    model = optuav.load("relay-today").flight_model
    leg = model.leg_at((flights[1].distance_m, 0.0, 0.0), 5.0)  # type: ignore[attr-defined]
    assert flights[1].duration_s == pytest.approx(float(leg.duration_s), rel=1e-6)
    assert verdict.replay.times_s["hover_time_s"] == 30.0


def test_the_margin_is_the_charge_left_over_the_reserve(tmp_path: Path) -> None:
    """By the sum of currents over times, not by the wells."""
    verdict, _ = judged(plan(tmp_path, SQUARE))
    assert verdict.replay is not None
    stages = [stage for phase in verdict.replay.phases for stage in phase.stages]
    drawn_As = sum(stage.duration_s * stage.drawn.current_A for stage in stages)
    mission = verdict.subject.mission
    left = 1.0 - drawn_As / float(mission.pool.capacity_As)
    data = verdict.to_dict()
    assert data["margin"] == pytest.approx(left - mission.limits.min_soc, abs=1e-9)
    assert f"Margin {round(100 * left, 2):g} % of the charge left" in " ".join(str(verdict).split())


def test_the_last_item_with_home_in_reach(tmp_path: Path) -> None:
    """A battery that just brings it home from one item, and from no later one.

    Each verdict is that of a plan that turns back there, judged on its own.
    """
    away = [item(16, 0, 0, 0, None, 52.5 + 0.004 * n, 13.4, 40) for n in range(1, 8)]
    up = item(22, 0, 0, 0, None, *HOME[:2], 40)
    mission = optuav.load("relay-today").replace({"battery.capacity_As": 12000, "battery.packs": 1})
    verdict, _ = judged(plan(tmp_path, [up, *away]), mission)
    rows = verdict.to_dict()["items"]
    assert isinstance(rows, list)
    reach = [row["home"] for row in rows[1:]]
    assert any(reach)
    assert not all(reach)
    for number, home in enumerate(reach, start=1):
        there = plan(tmp_path, [up, *away[:number]], "there.plan")
        _, subject = judged(there, mission)
        moves = [move for _, move in subject.flown]
        turned = [(f"{k}", move) for k, move in enumerate(moves)]
        turned[-1] = (
            turned[-1][0],
            moves[-1]._replace(end_place=subject.mission.route.destination_m),
        )
        back = moves[0]._replace(
            start_place=subject.mission.route.destination_m, end_place="destination"
        )
        ends = {"route.destination_m": subject.mission.route.origin_m}
        whole = FlightPlan(subject.mission.replace(ends), [*turned, ("back", back)], ())
        kinds = {event.kind for event in optuav.replay(whole).violations}
        assert (not kinds & {"empty", "state of charge"}) == home, number
    last = max(number for number, home in enumerate(reach, start=1) if home)
    assert f"home is for the last time after item {last + 1}" in words(str(verdict))


def test_a_roof_in_reach_and_one_behind_a_wall(tmp_path: Path) -> None:
    """The nearest roof that a straight way leads to, where home is too far."""
    boxes = {
        "near": ([0.0, 2900.0, 20.0], [10.0, 10.0]),
        "hidden": ([0.0, 3010.0, 10.0], [10.0, 10.0]),
        "wall": ([0.0, 3000.0, 300.0], [200.0, 4.0]),
    }
    buildings = [
        {"name": name, "position_m": at_m, "footprint_m": size_m}
        for name, (at_m, size_m) in boxes.items()
    ]
    changes = {**TOWN, "buildings": buildings, "battery.packs": 1, "battery.capacity_As": 7000}
    mission = optuav.load("relay-today").replace(changes)
    north = pyproj.Geod(ellps="WGS84").fwd(13.4, 52.5, 0.0, 2990.0)[1]
    away = item(16, 0, 0, 0, None, north, 13.4, 40)
    verdict, _ = judged(plan(tmp_path, [SQUARE[0], away], hoverSpeed=15), mission)
    rows = verdict.to_dict()["items"]
    assert isinstance(rows, list)
    assert (rows[0]["home"], rows[-1]["home"], rows[-1]["roof"]) == (True, False, "near")
    assert "home is for the last time after item 1" in words(str(verdict))


def test_wind_is_that_of_the_mission(tmp_path: Path) -> None:
    """Against the wind a leg takes more charge; the verdict states the wind."""
    file = plan(tmp_path, [SQUARE[0], SQUARE[1]])
    against = optuav.load("relay-today").replace({"wind.velocity_m_s": [0, -6, 0]})
    calm, _ = judged(file)
    windy, _ = judged(file, against)
    assert windy.to_dict()["margin"] != calm.to_dict()["margin"]
    assert "Wind 6 m/s" in " ".join(str(windy).split())
    assert "none is stated" in str(calm)


WAYPOINTS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t52.5\t13.4\t34\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t40\t1
2\t0\t3\t16\t5\t0\t0\t0\t52.502\t13.4\t40\t1
3\t0\t0\t16\t0\t0\t0\t0\t52.502\t13.403\t74\t1
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


def test_a_text_of_waypoints(tmp_path: Path) -> None:
    """A hold is a hover; altitudes above the sea are those over home, plus home's; home again."""
    (file := tmp_path / "a.waypoints").write_text(WAYPOINTS)
    verdict, subject = judged(file)
    assert verdict.flyable
    assert verdict.replay is not None
    heights = [phase.end.position_m[2] for phase in verdict.replay.phases]
    assert heights == pytest.approx([40, 40, 40, 40, 40, 0])
    assert verdict.replay.times_s["hover_time_s"] == 5.0
    assert subject.mission.route.origin_m == pytest.approx((0, 0, 0))


def test_a_take_off_downwards_is_doubted(tmp_path: Path) -> None:
    """Some programs write heights over home as if they were above the sea."""
    down = item(22, 0, 0, 0, None, *HOME[:2], 20, frame=0)
    _, subject = judged(plan(tmp_path, [down, SQUARE[1]]))
    assert any("item 1 takes off downwards, by 14 m" in note for note in subject.notes)


def test_places_below_the_ground_are_told(tmp_path: Path) -> None:
    """Home stands at z = 0; whether the ground is lower elsewhere, no mission knows."""
    low = item(16, 0, 0, 0, None, 52.501, 13.4, -12.5)
    _, subject = judged(plan(tmp_path, [SQUARE[0], low, SQUARE[-1]]))
    assert any(note.startswith("item 2 lies 12.5 m below z = 0") for note in subject.notes)
    _, subject = judged(plan(tmp_path, SQUARE))
    assert not any("below z = 0" in note for note in subject.notes)


def test_a_home_at_zero_is_unknown(tmp_path: Path) -> None:
    """As ground stations write it before the drone has a position; the first place counts."""
    text = WAYPOINTS.replace("52.5\t13.4\t34", "0\t0\t0").replace("3\t0\t0\t16", "3\t0\t3\t16")
    (file := tmp_path / "a.waypoints").write_text(text)
    verdict, subject = judged(file)
    assert any("home is unknown" in note for note in subject.notes)
    assert verdict.replay is not None
    assert max(phase.distance_m for phase in verdict.replay.phases) < 300.0


def test_pymavlink_reads_and_writes_the_same_text(tmp_path: Path) -> None:
    """What MAVProxy saves is judged as what we read."""
    mavwp = pytest.importorskip("pymavlink.mavwp")
    (file := tmp_path / "a.waypoints").write_text(WAYPOINTS)
    loader = mavwp.MAVWPLoader()
    loader.load(str(file))
    loader.save(str(tmp_path / "b.waypoints"))
    first, second = judged(file)[0], judged(tmp_path / "b.waypoints")[0]
    assert first.to_dict()["items"] == second.to_dict()["items"]


MARK = "<kml><Placemark><Point><coordinates>13,52</coordinates></Point></Placemark></kml>"
KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Placemark><name>Path</name><LineString>
<altitudeMode>relativeToGround</altitudeMode>
<coordinates>13.4,52.5,30 13.403,52.5,30 13.403,52.502,50</coordinates></LineString></Placemark>
</Document></kml>"""


def test_a_path_in_kml(tmp_path: Path) -> None:
    (file := tmp_path / "path.kml").write_text(KML)
    verdict, subject = judged(file)
    assert verdict.replay is not None
    assert [p.end.position_m[2] for p in verdict.replay.phases] == pytest.approx([30, 30, 50])
    assert any("without a landing" in note for note in subject.notes)


def test_points_in_kml_are_labels_beside_a_line_and_else_waypoints(tmp_path: Path) -> None:
    point = "<Placemark><name>{}</name><Point>{}<coordinates>{}</coordinates></Point></Placemark>"
    mode = "<altitudeMode>relativeToGround</altitudeMode>"
    label = point.format("car park", "", "13.5,52.6,0")
    (file := tmp_path / "a.kml").write_text(KML.replace("</Document>", f"{label}</Document>"))
    (tmp_path / "b.kml").write_text(KML)
    assert judged(file)[0].to_dict()["items"] == judged(tmp_path / "b.kml")[0].to_dict()["items"]
    places = ("13.4,52.5,30", "13.403,52.5,30", "13.403,52.502,50")
    points = "".join(point.format(k, mode, place) for k, place in enumerate(places))
    (tmp_path / "c.kml").write_text(KML[: KML.index("<Placemark>")] + points + "</Document></kml>")
    rows = judged(tmp_path / "c.kml")[0].to_dict()["items"]
    same = judged(tmp_path / "b.kml")[0].to_dict()["items"]
    assert isinstance(rows, list)
    assert isinstance(same, list)
    assert [row["end_s"] for row in rows] == [row["end_s"] for row in same]


TOWN = {
    **{"earth.longitude_deg": 13.4, "earth.latitude_deg": 52.5, "earth.altitude_m": 34.0},
}


@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".kml"])
@pytest.mark.parametrize("name", ["relay-today", "matrice350"])
def test_our_own_exports_come_back(tmp_path: Path, name: str, suffix: str) -> None:
    """To 1 s and 1e-6 degrees: each time at which a place is left, and each place.

    If a file holds one flight, with a climb and a descent, these are no legs of the plan, and the
    legs begin and end higher than their places: then places and hovers come back.
    """
    mission = optuav.load(name).replace(TOWN)
    solved = optuav.solve(mission)
    solved.export(tmp_path / f"own{suffix}")
    mine, climbs, back = list[SimulatedPhase](), False, list[Any]()
    for file in sorted(tmp_path.glob(f"*{suffix}")):
        verdict, _ = judged(file, mission)
        assert verdict.replay is not None
        rows = verdict.to_dict()["items"]
        assert isinstance(rows, list)
        for phase, row in zip(verdict.replay.phases, rows, strict=True):
            climbs |= row["what"] == "climb"
            mine += [phase] if row["what"] not in ("climb", "descent") else []
        system = mission.to_dict().get("crs") or _plane()
        back.append(pyproj.Transformer.from_crs(system, 4326, always_xy=True))
    other = [
        phase
        for phase in optuav.replay(solved).phases
        if phase.duration_s > 0.0 and not (climbs and phase.kind == "rest")
    ]
    assert len(mine) == len(other)
    for one, two in zip(mine, other, strict=True):
        assert one.kind == two.kind
        ends = (back[0].transform(*phase.end.position_m[:2]) for phase in (one, two))
        for a, b in zip(*ends, strict=True):
            assert a == pytest.approx(b, abs=1e-6)
        if one.kind == "hover" or not climbs:
            assert one.duration_s == pytest.approx(two.duration_s, abs=1.0)
        if not climbs:
            assert one.end_s == pytest.approx(two.end_s, abs=1.0)
            assert one.end.position_m[2] == pytest.approx(two.end.position_m[2], abs=1e-3)


@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".kml"])
def test_exports_over_several_devices_come_back(tmp_path: Path, suffix: str) -> None:
    """Each hover with its seconds, and no word on devices: a flight plan flies for none."""
    plan = plan_over_three()
    plan.export(tmp_path / f"own{suffix}", force=True)
    hovers_s = list[float]()
    for file in sorted(tmp_path.glob(f"*{suffix}")):
        verdict, _ = judged(file, plan.mission)
        assert verdict.replay is not None
        phases = verdict.replay.phases
        hovers_s += [phase.duration_s for phase in phases if phase.kind == "hover"]
        assert not {event.kind for event in verdict.events} & {"device", "share", "rests"}
    assert hovers_s == pytest.approx([647.331326 / 3] * 3, abs=1e-3)


def _plane() -> str:
    from optuav.mission.earth import plane

    return plane((13.4, 52.5))


def test_patterns_fly_the_items_that_they_carry(tmp_path: Path) -> None:
    carried = [SQUARE[1], item(206, 10, 0, 1, frame=2), SQUARE[3]]
    survey = {"type": "ComplexItem", "complexItemType": "survey", "version": 5} | {
        "TransectStyleComplexItem": {"Items": carried, "version": 2}
    }
    bare = {"type": "ComplexItem", "complexItemType": "StructureScan", "version": 3}
    _, subject = judged(plan(tmp_path, [SQUARE[0], survey, SQUARE[-1]]))
    assert [name for name, _ in subject.flown][:3] == ["item 1", "item 2.1", "item 2.3"]
    assert "item 2 (survey) is flown by the 3 items that it carries" in subject.notes
    with pytest.raises(
        InputError, match=r"item 2 \(StructureScan\): is a pattern without waypoints"
    ):
        optuav.audit(plan(tmp_path, [SQUARE[0], bare]), "relay-today")


@pytest.mark.parametrize("carried", [[], [item(206, 10, 0, 1, frame=2)]])
def test_patterns_without_waypoints_are_refused(tmp_path: Path, carried: list[Item]) -> None:
    """None, or only cameras: nobody knows where they are flown."""
    survey = {"type": "ComplexItem", "complexItemType": "survey", "version": 5} | {
        "TransectStyleComplexItem": {"Items": carried, "version": 2}
    }
    with pytest.raises(InputError, match=r"item 2 \(survey\): is a pattern without waypoints"):
        optuav.audit(plan(tmp_path, [SQUARE[0], survey, *SQUARE[1:]]), "relay-today")


def test_speeds_of_climbs_are_not_those_of_legs(tmp_path: Path) -> None:
    """Types 2 and 3 of MAV_CMD_DO_CHANGE_SPEED; the legs keep the level speed before."""
    vertical = [item(178, 2, 1, -1, frame=2), item(178, 3, 2, -1, frame=2)]
    _, plain = judged(plan(tmp_path, SQUARE))
    verdict, subject = judged(plan(tmp_path, [SQUARE[0], *vertical, *SQUARE[1:]]))
    assert [move.speeds_m_s for move in subject.moves()] == [
        move.speeds_m_s for move in plain.moves()
    ]
    told = words(str(verdict))
    assert "item 2 sets the speed of climbs, which are flown at the mission's own" in told
    assert "item 3 sets the speed of descents" in told


def test_a_plan_without_a_take_off_is_told(tmp_path: Path) -> None:
    verdict, _ = judged(plan(tmp_path, SQUARE[1:]))
    assert "item 1 is no take-off: ArduCopter does not start such a plan" in words(str(verdict))
    assert "no take-off" not in str(judged(plan(tmp_path, SQUARE))[0])


def test_a_plan_far_from_its_mission_is_told(tmp_path: Path) -> None:
    """A mission half a degree south: 55.6 km, by the ellipsoid."""
    file = plan(tmp_path, SQUARE)
    for latitude, told in ((52.0, True), (52.5, False)):
        at = {"earth.latitude_deg": latitude, "earth.longitude_deg": 13.4}
        verdict, _ = judged(file, optuav.load("relay-today").replace(at))
        assert ("away from the nearest place of the mission" in words(str(verdict))) == told
    away_m = pyproj.Geod(ellps="WGS84").inv(13.4, 52.0, 13.4, 52.5)[2]
    assert away_m == pytest.approx(55_600, rel=0.01)


def test_a_plan_is_known_by_its_content(tmp_path: Path) -> None:
    """Saved as .json; an export of it says what it is, and a fault in it is not an option's."""
    file = plan(tmp_path, SQUARE, "survey.json")
    assert optuav.audit(file, "relay-today").flyable
    assert "name the drone that flies it by --mission" in refused("audit", str(file))
    told = refused("export", str(file), str(tmp_path / "out.kml"))
    assert "is a plan of QGroundControl, not a saved plan; optuav audit reads it" in told
    (fence := tmp_path / "fence.plan").write_text('{"fileType": "Plan", "version": 1}')
    told = refused("audit", str(fence), "--mission", "relay-today")
    assert "fence.plan: mission: must be a table" in told


def test_assumptions_on_battery_and_laser_are_told(tmp_path: Path) -> None:
    """A full battery where nothing states it, and a hover in the mission's own light."""
    at = {"earth.latitude_deg": HOME[0], "earth.longitude_deg": HOME[1]}
    mission = optuav.load("relay-today").replace(at)
    verdict, _ = judged(
        plan(tmp_path, [SQUARE[0], item(19, 30, 0, 0, None, *HOME[:2], 40), SQUARE[-1]]), mission
    )
    assert "the battery is assumed full at take-off" in words(str(verdict))
    assert "the mission's laser charges the drone at item 2" in words(str(verdict))
    verdict, _ = judged(plan(tmp_path, SQUARE), mission.replace({"start": {"soc": 0.9}}))
    assert "assumed full" not in str(verdict)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("limits.min_soc", 0.0, "judged_with.limits.min_soc: is none of start, limits.deadline_s"),
        ("laser", {}, "judged_with.laser = an empty table: must be left out: null"),
        ("limits.deadline_s", -1, "judged_with.limits.deadline_s = -1: must be a number, 0 < x"),
    ],
)
def test_a_file_changes_only_what_an_event_changes(
    tmp_path: Path, key: str, value: object, told: str
) -> None:
    """Not the reserve, for example, which would make any plan flyable."""
    file = plan(tmp_path, SQUARE)
    document = json.loads(file.read_text()) | {
        "groundStation": "optuav",
        "judged_with": {key: value},
    }
    file.write_text(json.dumps(document))
    with pytest.raises(InputError, match=told):
        optuav.audit(file, "relay-today")


@pytest.mark.parametrize(
    ("command", "note"),
    [
        (17, "loiters without end"),
        (18, "is flown as a waypoint"),
        (82, "is flown as a waypoint"),
        (4711, "has command 4711, which is not flown"),
    ],
)
def test_items_that_are_not_simple_are_named(tmp_path: Path, command: int, note: str) -> None:
    items = [SQUARE[0], item(command, 2, 0, 0, None, 52.501, 13.4, 40), SQUARE[-1]]
    _, subject = judged(plan(tmp_path, items))
    assert any(f"item 2 {note}" in each for each in subject.notes)


def test_heights_over_terrain_are_taken_over_home(tmp_path: Path) -> None:
    """As frame 10, and as QGroundControl's own mode, whose height stands outside of the figures."""
    own = item(16, 0, 0, 0, None, 52.502, 13.4, None, frame=0)
    own |= {"AltitudeMode": 3, "Altitude": 50}
    over = item(16, 0, 0, 0, None, 52.501, 13.4, 50, frame=10)
    verdict, subject = judged(plan(tmp_path, [SQUARE[0], over, own, SQUARE[-1]]))
    assert verdict.replay is not None
    assert [p.end.position_m[2] for p in verdict.replay.phases][1:3] == [50, 50]
    assert sum("over terrain" in note for note in subject.notes) == 2


@pytest.mark.parametrize(
    ("items", "told"),
    [
        (
            [item(16, 0, 0, 0, None, 52.5, 13.4, 1e9)],
            r"item 1, height = 1000000000.0: must be a number, \|x\| <= 1e6",
        ),
        (
            [SQUARE[0], item(16, 0, 0, 0, None, 40, -25, -10, frame=1)],
            "item 2, frame = 1: must be one of 0, 3, 5, 6, 10, 11, with degrees",
        ),
        (
            [item(16, 1e9, 0, 0, None, 52.5, 13.4, 40)],
            "item 1, seconds = 1000000000.0: must be a number, 0 <= x <= 1e7",
        ),
        ([SQUARE[0], item(177, 1, 5, frame=2)], "item 2: is DO_JUMP, which flies a part again"),
        ([item(84, 0, 0, 0, None, *HOME[:2], 40)], "item 1: is a take-off of a VTOL"),
        ([item(16, 0, 0, 0, None, 152.5, 13.4, 40)], "latitude −90 to 90"),
        ([item(16, 0, 0, 0, None, 52.5, 13.4, None)], "item 1, height = null: must be a number"),
        ([item(2000, 0, frame=2)], "has no item that flies anywhere"),
        ([], "has no item that flies anywhere"),
        (
            [SQUARE[0], SQUARE[1], SQUARE[-1], SQUARE[0], SQUARE[1]],
            "item 3: lands on the way, but not at a",
        ),
    ],
)
def test_plans_that_cannot_be_judged_are_refused(
    tmp_path: Path, items: list[Item], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        optuav.audit(plan(tmp_path, items), "relay-today")


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("plannedHomePosition", None, "= null: must be three numbers: latitude and longitude"),
        ("plannedHomePosition", [52.5, "13", 0], ".*must be three numbers"),
        ("hoverSpeed", 0, r"= 0: must be a number, x > 0 \[m/s\]"),
        ("version", "2", "= '2': must be a whole number"),
    ],
)
def test_a_wrong_value_of_a_plan_is_named_by_its_key(
    tmp_path: Path, key: str, value: object, told: str
) -> None:
    with pytest.raises(InputError, match=f"survey.plan: mission.{key} {told}"):
        optuav.audit(plan(tmp_path, SQUARE, **{key: value}), "relay-today")


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("a.plan", '{"fileType": "Plan"}', "a.plan: version: must be a whole number"),
        ("a.plan", '{"fileType": "Plan", "vers', "is not JSON"),
        ("a.plan", '{"fileType": "Rally"}', "is JSON of another kind, not a plan"),
        ("a.plan", '{"type": "FeatureCollection", "features": []}', "is GeoJSON, not a plan"),
        ("a.plan", "%PDF-1.7", "is none: a flight plan is a|is a PDF"),
        (
            "a.waypoints",
            "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\n",
            "line 2: fields = 7: must be twelve",
        ),
        ("a.waypoints", "QGC WPL 110\n", "has no items: is it cut off"),
        ("a.waypoints", " \n", "a.waypoints: is empty"),
        (
            "a.waypoints",
            "QGC WPL 110\n0 1 0 nan 0 0 0 0 52.5 13.4 34 1\n1 0 3 inf 0 0 0 0 52.5 13.4 34 1",
            r"line 2: field 4 = 'nan': must be a number\n.* field 4 = 'inf'",
        ),
        ("a.waypoints", "QGC WPL 100\n0 0 3 16", "of version 100; optuav reads version 110"),
        ("a.waypoints", "QGC WPL 1100\n0 0 3 16", "of version 1100; optuav reads version 110"),
        ("a.kml", KML[: len(KML) // 2], "is damaged or cut off at line"),
        (
            "a.kml",
            KML.replace("relativeToGround", "clampToGround"),
            "must be an altitudeMode, absolute or",
        ),
        ("a.kml", KML.replace(",30", ",-30"), "= -30.0: must be a height over ground, x >= 0"),
        (
            "a.kml",
            KML.replace(",30", ""),
            "must be a list of coordinates longitude,latitude,height",
        ),
        ("a.kml", KML.replace("LineString", "LinearRing"), "has no line or points to fly along"),
        ("a.kml", MARK, "has no line to fly along, and its points have no heights"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, name: str, content: str, told: str) -> None:
    (file := tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=told):
        optuav.audit(file, "relay-today")


def test_the_picture_of_a_flight_plan_is_its_own(tmp_path: Path) -> None:
    """Named by its file, with climb and descent, without the band of a relay's hovers."""
    file = plan(tmp_path, [item(22, 0, 0, 0, None, *HOME[:2], 400), *SQUARE[1:2], SQUARE[-1]])
    verdict, _ = judged(file)
    assert verdict.replay is not None
    axes = optuav.plots.profile(verdict.replay)
    assert axes.altitude.get_title(loc="left").startswith("survey.plan: flight over time")
    named = {text.get_text() for text in axes.altitude.texts}
    assert "climb" in named
    legend = axes.power.get_legend()
    assert legend is not None
    assert "altitudes for hovering" not in {text.get_text() for text in legend.get_texts()}
    assert len(axes.altitude.lines) == 1


def test_a_kmz_is_to_be_unpacked(tmp_path: Path) -> None:
    (file := tmp_path / "a.kml").write_bytes(b"PK\x03\x04\xff\xfe")
    with pytest.raises(InputError, match=r"unpack a \.kmz"):
        optuav.audit(file, "relay-today")


def test_a_plan_that_lands_with_its_reserve_is_at_it(tmp_path: Path) -> None:
    """A reserve that is missed by rounding is no "<0.01 % below" beside FLYABLE."""
    file = plan(tmp_path, SQUARE)
    verdict, _ = judged(file)
    assert verdict.replay is not None
    left = verdict.replay.soc["battery"]
    for more, told in ((5e-7, "at the reserve;"), (-5e-7, "at the reserve;"), (-0.1, "10 % above")):
        mission = optuav.load("relay-today").replace({"limits.min_soc": left + more})
        again, _ = judged(file, mission)
        assert again.flyable
        assert told in words(str(again))


def test_all_wrong_values_are_named_with_what_they_are(tmp_path: Path) -> None:
    """Ten in one plan, by the numbers of items, and three in one text of waypoints."""
    items: list[Any] = [
        SQUARE[0],
        item(16, 0, "b", 0, None, "a", 13.4, 40),  # type: ignore[arg-type]
        item(16, 0, 0, 0, None, 95, 13.4, 40),
        item(19, -5, 0, 0, None, 95.5, 13.4, 40),
        7,
        {"command": 16},
        {**SQUARE[1], "command": "go", "frame": None},
    ]
    with pytest.raises(InputError) as refused_plan:
        optuav.audit(plan(tmp_path, items, hoverSpeed=-3), "relay-today")
    assert {(fault.key, fault.value) for fault in refused_plan.value.faults} == {
        ("mission.hoverSpeed", "-3"),
        ("item 2, param 2", "'b'"),
        ("item 2, param 5", "'a'"),
        ("item 3", "[13.4, 95.0]"),
        ("item 4", "[13.4, 95.5]"),
        ("item 4, seconds", "-5.0"),
        ("item 5", "7"),
        ("item 6, type", ""),
        ("item 7, command", "'go'"),
        ("item 7, frame", "null"),
    }
    file, lines = tmp_path / "a.waypoints", WAYPOINTS.splitlines()
    lines[2:4] = ["1\t0\t3", lines[3].replace("52.5", "x", 1)]
    file.write_text("\n".join([*lines, "9\t0\t3\t19\t-5\t0\t0\t0\t52.5\t13.4\t40\t1"]))
    with pytest.raises(InputError) as refused_text:
        optuav.audit(file, "relay-today")
    told = str(refused_text.value)
    assert "line 3: fields = 3: must be twelve" in told
    assert "line 4: field 9 = 'x" in told
    assert "item 9, seconds = -5.0" in told


def test_the_command_tells_faults_of_all_that_it_reads() -> None:
    """Of the plan, the mission and the picture."""
    told = refused("audit", "missing.plan", "--mission", "nope.toml", "--plot", "x.bmp")
    assert all(f"{name}: there is no such file" in told for name in ("missing.plan", "nope.toml"))
    assert "--plot = 'x.bmp'" in told


def test_a_foreign_flight_plan_serves_no_devices(tmp_path: Path) -> None:
    """Coverage is not judged for a flight plan, also where the mission has several devices."""
    verdict, _ = judged(plan(tmp_path, SQUARE), "three-sensors")
    assert verdict.flyable


def test_every_cut_of_a_file_is_read_or_refused(tmp_path: Path) -> None:
    for name, text in (
        ("a.plan", plan(tmp_path, SQUARE).read_text()),
        ("a.waypoints", WAYPOINTS),
        ("a.kml", KML),
    ):
        for share in range(0, 100, 7):
            (tmp_path / name).write_text(text[: len(text) * share // 100])
            try:
                optuav.audit(tmp_path / name, "relay-today")
            except InputError:
                continue


def test_the_command(tmp_path: Path) -> None:
    """Exit codes 0 and 1, one error for what is missing, JSON with the items."""
    file = plan(tmp_path, SQUARE)
    found = run("audit", str(file), "--mission", "relay-today")
    assert found.code == 0, found.err
    assert "In reach home is, straight on, after every item" in " ".join(found.out.split())
    assert "item 6" in found.out
    data = json.loads(run("audit", str(file), "--mission", "relay-today", "--json").out)
    assert data["items"][0]["what"] == "climb"
    assert "name the drone that flies it by --mission" in refused("audit", str(file))
    assert "goes with a flight plan only" in refused("audit", "relay-today", "--mission", "paper")
    assert "there is no such file" in refused("audit", "no.plan", "--mission", "paper")
    dry = run("audit", str(file), "--mission", _small(tmp_path))
    assert dry.code == 1
    assert "NOT FLYABLE" in dry.out


def _small(folder: Path) -> str:
    (file := folder / "small.toml").write_text(
        'schema = 1\nextends = "relay-today"\nbattery.capacity_As = 900\nbattery.packs = 1\n'
    )
    return str(file)


def test_a_rest_in_kml_is_charged_on_its_roof(tmp_path: Path) -> None:
    """A laser below a roof lights it: the building that it stands on is in nobody's way."""
    mission = optuav.load("relay-today").replace(
        {f"earth.{k}": v for k, v in zip(("latitude_deg", "longitude_deg"), HOME, strict=False)}
    )
    planned = optuav.solve(mission)
    verdict, _ = judged(planned.export(tmp_path / "a.kml")[0], mission)
    assert verdict.replay is not None
    (rest,) = (phase for phase in verdict.replay.phases if phase.kind == "rest")
    (stated,) = (phase for phase in planned.phases if phase.kind == "rest")
    assert rest.start.name == rest.end.name == stated.end_place
    assert rest.stages[0].net.current_A == pytest.approx(stated.stages[0].current_A)
    assert verdict.replay.soc["battery"] == pytest.approx((planned.soc or {})["battery"], abs=1e-4)


@pytest.mark.parametrize("model", ["relay-today", "matrice350"])
@pytest.mark.parametrize("suffix", [".kml", ".plan", ".waypoints"])
def test_exports_keep_the_speed_limit(model: str, suffix: str, tmp_path: Path) -> None:
    """The speed that they state is level, as the limit is, also where the legs climb."""
    at = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4, "earth.altitude_m": 34.0}
    mission = optuav.load(model).replace({**at, "flight.max_speed_m_s": 7.77})
    planned = optuav.solve(mission)
    for file in planned.export(tmp_path / f"a{suffix}", climb_m=None if suffix == ".kml" else 60):
        if file.suffix == suffix:
            kinds = {event.kind for event in optuav.audit(file, mission).violations}
            assert "speed" not in kinds
            assert suffix != ".kml" or not kinds


def test_a_point_that_is_flown_to_again_has_the_later_item(tmp_path: Path) -> None:
    """The route counts on, and so do the legs of events."""
    there, away = (item(16, 0, 0, 0, None, place, 13.4, 40) for place in (52.501, 52.503))
    verdict, _ = judged(plan(tmp_path, [SQUARE[0], there, away, there, away, SQUARE[-1]]))
    assert verdict.replay is not None
    route = ["origin", *(f"item {n}" for n in (1, 2, 3, 4, 5, 6)), "destination"]
    assert verdict.replay.route == route
