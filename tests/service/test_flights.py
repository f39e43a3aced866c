"""Files of an event for pilots: clock times by hand, flights that meet, and what is refused."""

from __future__ import annotations

import csv
import json
import math
import re
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import pytest

import optuav
from optuav.errors import InputError, NoPlanError
from optuav.service.event import spots_of
from tests.cli.run import refused, run
from tests.plan.test_export import BERLIN, refused_by_px4, waypoints

START = "2027-05-01T14:00+02:00"
HERE = optuav.load("matrice350").replace(BERLIN)


def roster(folder: Path) -> list[dict[str, str]]:
    """Rows of the table that pilots get."""
    with (folder / "roster.csv").open(newline="", encoding="utf-8") as file:
        return [*csv.DictReader(file)]


def moment(row: dict[str, str], name: str) -> datetime:
    return datetime.fromisoformat(row[name])


@pytest.mark.parametrize("options", [{}, {"swap_s": 300.0}, {"pad_power_W": 500.0}], ids=str)
def test_the_roster_has_the_event_in_clock_times(options: Any, tmp_path: Path) -> None:
    """Every hover of the event in a row, its moments by hand, and files that hold that flight."""
    event = optuav.coverage(HERE, **options).event(2)
    event.save_flights(tmp_path, START)
    begin, rows = datetime.fromisoformat(START), roster(tmp_path)
    out, _, back, *_ = event.plans[0].phases
    climb_s = 2.0 * (12.0 / event.mission.flight.acceleration_m_s2) ** 0.5  # As the descent
    assert len(rows) == len(event.rows)
    for row, hover in zip(rows, event.rows, strict=True):
        assert int(row["drone"]) == hover["drone"]
        starts_s = hover["start_s"]
        for name, at_s in (
            ("take_off", starts_s - out.duration_s - climb_s),
            ("on_station", starts_s),
            ("leave", starts_s + hover["hover_s"]),
            ("landing", starts_s + hover["hover_s"] + back.duration_s + climb_s),
        ):
            assert abs(moment(row, name) - begin - timedelta(seconds=at_s)).total_seconds() < 0.6
        assert row["roof"] == event.building
        places = {"exchange": "bay", "pad": f"pad {row['drone']}", "laser": f"beam {row['drone']}"}
        assert row["place"] == places[event.charged_by]
        assert 20.0 <= float(row["battery_left_percent"]) < 100.0
        document = json.loads((tmp_path / f"{row['files']}.plan").read_text("utf-8"))
        assert refused_by_px4(document) == []
        items = waypoints(tmp_path / f"{row['files']}.waypoints")
        (loiter,) = (item for item in items if item.command == 19)
        assert loiter.param1 == pytest.approx(hover["hover_s"], abs=1e-6)
        home = document["mission"]["plannedHomePosition"]
        assert items[-1].x == pytest.approx(home[0])  # It lands where it took off
        assert items[-1].z == pytest.approx(0.0, abs=1e-6)
        assert any("FLYABLE" in note for note in document["notes"])


def test_the_calendar_has_the_same_moments(tmp_path: Path) -> None:
    """Lines of RFC 5545, read by hand: at most 75 octets, CRLF, times in UTC."""
    named = HERE.replace({"name": "Relay, north; " + 20 * "ü"})
    optuav.coverage(named).event(1).save_flights(tmp_path, START)
    text = (tmp_path / "roster.ics").read_bytes()
    assert all(len(line) <= 75 for line in text.split(b"\r\n"))
    assert text.count(b"\n") == text.count(b"\r\n")
    lines = re.sub(b"\r\n ", b"", text).decode().split("\r\n")
    assert lines[0] == "BEGIN:VCALENDAR"
    assert lines[-2:] == ["END:VCALENDAR", ""]
    starts = [line.removeprefix("DTSTART:") for line in lines if line.startswith("DTSTART")]
    takes_off = [moment(row, "take_off").astimezone(UTC) for row in roster(tmp_path)]
    assert starts == [f"{each:%Y%m%dT%H%M%SZ}" for each in takes_off]
    assert (
        sum(line.startswith("SUMMARY:Drone 1\\, visit 1: Relay\\, north\\; ü") for line in lines)
        == 1
    )


def test_clocks_that_are_put_back_keep_the_duration(tmp_path: Path) -> None:
    """On 31 October 2027 clocks in Berlin go from 3:00 back to 2:00."""
    start = datetime(2027, 10, 31, 2, 30, tzinfo=ZoneInfo("Europe/Berlin"))
    event = optuav.coverage(HERE).event(1)
    event.save_flights(tmp_path, start)
    ((_, axes),) = event.pictures(start)
    axes.figure.canvas.draw()
    ticks = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
    told = {round(hours, 9): label.get_text() for hours, label in ticks}
    assert (told[0.0], told[1.0]) == ("02:30", "02:30")
    assert axes.get_xlabel() == "clock time, from 2027-10-31 02:30 on"
    last = roster(tmp_path)[-1]
    assert last["leave"].startswith("2027-10-31T02:30:00+01:00")


def test_overlaps_and_points_apart_are_flown(tmp_path: Path) -> None:
    """60 s of two drones at every handover, 10 m apart in height, by the files alone."""
    event = optuav.coverage(HERE).event(4, overlap_s=60.0, separation_m=10.0)
    assert event.replay().flyable
    event.save_flights(tmp_path, START, climb_m=20.0)
    rows = roster(tmp_path)
    heights_m = []
    for row in rows:
        items = json.loads((tmp_path / f"{row['files']}.plan").read_text())["mission"]["items"]
        assert items[0]["Altitude"] == 20.0
        heights_m.append(next(item["Altitude"] for item in items if item["command"] == 19))
    for (one, other), (low_m, high_m) in zip(pairwise(rows), pairwise(heights_m), strict=True):
        seconds = (moment(one, "leave") - moment(other, "on_station")).total_seconds()
        assert seconds == pytest.approx(60.0, abs=1.1)
        assert abs(high_m - low_m) == pytest.approx(10.0, abs=1e-6)


@pytest.mark.parametrize(("mission", "hours"), [("paper", 0.5), ("relay-today", 2.0)])
@pytest.mark.parametrize("swap_s", [None, 600.0])
def test_the_judge_finds_what_the_programme_promised(
    mission: str, hours: float, swap_s: float | None
) -> None:
    """Hovers that overlap and are apart; the judge refuses a longer overlap and a larger step."""
    cycle = optuav.coverage(mission, swap_s=swap_s)
    event = cycle.event(hours, overlap_s=45.0, separation_m=8.0)
    replay = event.replay()
    assert replay.flyable, replay.violations
    ends_s = [row["start_s"] + row["hover_s"] for row in event.rows]
    starts_s = [row["start_s"] for row in event.rows]
    assert [end - start for end, start in zip(ends_s, starts_s[1:], strict=False)] == pytest.approx(
        [45.0] * (len(event.rows) - 1)
    )
    assert ends_s[-1] == pytest.approx(3600.0 * hours)
    assert min(later - end for end, later in zip(ends_s, starts_s[2:], strict=False)) >= -1e-6
    points = [plan.mission.route.hover_m for plan in event.plans]
    for one, other in pairwise(points):
        assert one is not None
        assert other is not None
        assert abs(one[2] - other[2]) >= 8.0
    kinds = {"overlap_s": 46.0, "separation_m": (0.0, 0.0, 8.1)}
    for (name, value), kind in zip(kinds.items(), ("overlap", "separation"), strict=True):
        stated: Any = {name: value}
        wrong = type(event)(**{**vars(event), **stated}).replay()
        assert kind in {fault.kind for fault in wrong.violations} <= {kind, "share"}


def test_a_point_to_the_side_costs_its_legs() -> None:
    """The drone that hovers 60 m farther from the roof rests and hovers by its own legs."""
    event = optuav.coverage("relay-today").event(2, separation_m=(60.0, 0.0, 0.0))
    first, second, *_ = event.plans
    near, far = first.mission.route.hover_m, second.mission.route.hover_m
    assert near is not None
    assert far is not None
    assert [b - a for a, b in zip(near, far, strict=True)] == pytest.approx([60.0, 0.0, 0.0])
    roof = next(b.position_m for b in first.mission.buildings if b.name == event.building)
    for plan, point in ((first, near), (second, far)):
        assert plan.phases[0].distance_m == pytest.approx(math.dist(roof, point))


@pytest.mark.parametrize("drones", range(2, 12))
def test_neighbours_in_a_ring_have_two_points(drones: int) -> None:
    """Also the last and the first, of an odd number too."""
    spots = spots_of(drones, 3)
    assert all(a != b for a, b in zip(spots, [*spots[1:], spots[0]], strict=True))
    assert spots_of(drones, 1) == [0] * drones


def test_an_odd_number_needs_a_third_point() -> None:
    """50 m higher is below limits.max_altitude_m of 120 m, 100 m higher is not."""
    cycle = optuav.coverage(HERE)
    assert cycle.event(2).drones == 3
    assert cycle.event(2, separation_m=50.0).drones == 4
    with pytest.raises(NoPlanError, match="3 drones need a third hover point"):
        cycle.event(2, 3, separation_m=50.0)
    with pytest.raises(NoPlanError, match=r"nobody hovers .* above limits.max_altitude_m = 120 m"):
        cycle.event(2, separation_m=70.0)


def test_bad_input(tmp_path: Path) -> None:
    """One error each, and nothing is written."""
    cycle = optuav.coverage(HERE)
    event = cycle.event(1)
    wrong: Any
    for wrong in ("tomorrow", "2027-05-01", "2027-05-01T14:00", 5, datetime(2027, 5, 1), None):
        with pytest.raises(InputError, match=r"start = .*offset from UTC"):
            event.save_flights(tmp_path / "a", wrong)
    for wrong in ("9999-12-31T23:59+00:00", "0001-01-01T00:00+14:00"):
        with pytest.raises(InputError, match=r"start = .*in the years 1970 to 9998"):
            event.save_flights(tmp_path / "a", wrong)
    with pytest.raises(InputError, match=r"climb_m = 0.*0 < x <= 1000"):
        event.save_flights(tmp_path / "a", START, climb_m=0.0)
    for wrong in (0, -5.0, "x", (), (1.0, 2.0), (0, 0, 0), (900, 900, 0), (0, 0, math.nan), 1001):
        with pytest.raises(InputError, match="separation_m = "):
            cycle.event(1, separation_m=wrong)
    for wrong in (-1.0, "x", 1000.0, math.nan):
        with pytest.raises(InputError, match="overlap_s = "):
            cycle.event(1, overlap_s=wrong)
    with pytest.raises(InputError, match="crs: is missing"):
        optuav.coverage("matrice350").event(1).save_flights(tmp_path / "a", START)
    assert [*tmp_path.iterdir()] == []


def test_the_command_writes_a_folder_for_pilots(tmp_path: Path) -> None:
    """And refuses a folder with flights that are not of this event."""
    mission, folder = str(HERE.save(tmp_path / "here.toml")), tmp_path / "flights"
    asked = ("coverage", mission, "--flights", str(folder), "--start", START)
    answer = run(*asked, "--hours", "2", "--overlap-s", "60", "--separation-m", "0,10,0")
    assert answer.code == 0
    assert f"wrote {folder}" in answer.out
    assert "60 s of overlap, next drone (0, 10, 0) m away" in answer.out
    assert len(roster(folder)) == 5
    assert run(*asked, "--hours", "2").code == 0
    assert "holds flights of another event: drone-" in refused(*asked, "--hours", "1")
    assert "--flights = " in refused(*asked)
    assert "--start = soon: goes with --flights" in refused(*asked[:2], "--start", "soon")
    assert "--start: is missing" in refused(*asked[:4], "--hours", "1")
    assert "--separation-m = " in refused(*asked, "--hours", "1", "--separation-m", "up")


def test_files_are_written_all_or_none(tmp_path: Path) -> None:
    """The place of the picture, which is written last, is checked before any file is written."""
    (tmp_path / "event.png").mkdir()
    with pytest.raises(InputError, match=r"event\.png: is a directory"):
        optuav.coverage(HERE).event(1).save_flights(tmp_path, START)
    assert [file.name for file in tmp_path.iterdir()] == ["event.png"]


def test_files_state_the_charge_with_climbs_and_warn(tmp_path: Path) -> None:
    """By hand for exchanged packs: what the legs and the hover draw, and two climbs of 60 m."""
    event = optuav.coverage(HERE, swap_s=300.0).event(1)
    files = event.save_flights(tmp_path, START, climb_m=60.0)
    flight, (out, hover, back, *_) = HERE.flight, event.plans[0].phases
    once_s = 2.0 * (60.0 / flight.acceleration_m_s2) ** 0.5
    stages = [stage for phase in (out, hover, back) for stage in phase.stages]
    drawn_As = -sum(stage.duration_s * stage.current_A for stage in stages)
    size_As = float(HERE.pool.capacity_As)
    left = 100.0 * (1.0 - (drawn_As + 2.0 * once_s * flight.flight_current_A) / size_As)
    row = roster(tmp_path)[0]
    assert float(row["battery_at_take_off_percent"]) == 100.0
    # Legs that begin 60 m higher slope otherwise
    assert float(row["battery_left_percent"]) == pytest.approx(left, abs=0.7)
    for file in files:
        if file.suffix in (".plan", ".txt", ".kml", ".geojson"):
            assert ("WARNING: with its climbs" in file.read_text("utf-8")) == (left < 20.0)


def test_a_climb_that_costs_the_reserve_is_told(tmp_path: Path) -> None:
    """In the command's words and every file of a flight; the audit of one agrees."""
    mission, folder = str(HERE.save(tmp_path / "here.toml")), tmp_path / "flights"
    asked = ("coverage", mission, "--hours", "1", "--flights", str(folder), "--start", START)
    assert "WARNING: with its climbs, drone 1" in run(*asked, "--climb-m", "900").out
    for file in folder.glob("drone-1*"):
        assert ("WARNING" in file.read_text("utf-8")) == (file.suffix != ".waypoints")


LIT = {"limits.deadline_s": 1800.0, "start": {"soc": 0.6}}
"""A deadline and a charge of a mission, neither of which counts for an event."""


@pytest.mark.parametrize("name", ["matrice350", "relay-today"])
@pytest.mark.parametrize(
    "options", [{}, {"lit_hover": False}, {"pad_power_W": 400.0}, {"swap_s": 120.0}], ids=str
)
def test_the_audit_of_a_flight_gives_the_charges_of_the_roster(
    name: str, options: Any, tmp_path: Path
) -> None:
    """By every technology, of later visits too, and in a mission with its own start and deadline.

    A text of waypoints agrees where the mission states what the file's notes ask for.
    """
    mission = optuav.load(name).replace({**BERLIN, **LIT})
    event = optuav.coverage(mission, **options).event(4, overlap_s=60.0, separation_m=10.0)
    event.save_flights(tmp_path, START)
    rows = roster(tmp_path)
    for row in rows:
        file = tmp_path / f"{row['files']}.plan"
        judged = optuav.audit(file, mission)
        notes = "\n".join(json.loads(file.read_text("utf-8"))["notes"])
        short = {"state of charge"} if "with its climbs, drone" in notes else set[str]()
        assert {violation.kind for violation in judged.violations} <= short, file.name
        begin, left = (float(row[f"battery_{at}_percent"]) for at in ("at_take_off", "left"))
        assert 100.0 * judged.replay.soc["battery"] == pytest.approx(left, abs=0.06)
        assert "judged as the file says, in place of the mission" in str(judged)
        assert ("leave [laser] out" in notes) == bool(options)
        asked = {
            "limits.deadline_s": 1e7,
            "battery.charging": "taper",
            "start": {"soc": begin / 100.0},
        }
        beam = [key for key in ("laser", "receiver") if options and getattr(mission, key)]
        dark = dict.fromkeys(beam)
        plain = optuav.audit(file.with_suffix(".waypoints"), mission.replace({**asked, **dark}))
        # Wells that are not level, as after a rest, hold the same charge
        assert 100.0 * plain.replay.soc["battery"] == pytest.approx(left, abs=0.12)


def test_a_map_says_when_charging_tapers(tmp_path: Path) -> None:
    """The audit without a taper finds that the available well passes its full charge then."""
    event = optuav.coverage(HERE).event(4)
    event.save_flights(tmp_path, START)
    file = tmp_path / "drone-1.kml"
    (tapers_s, *_) = re.findall(r"s, charging tapers after ([\d.]+) s<", file.read_text("utf-8"))
    (full_s, *_) = (e.time_s for e in optuav.audit(file, HERE).violations if e.kind == "full")
    before_s = sum(phase.duration_s for phase in event.plans[0].phases[:3])
    assert before_s + float(tapers_s) == pytest.approx(full_s, abs=0.01)


def test_files_warn_of_drones_that_meet_and_say_how_to_audit_them(tmp_path: Path) -> None:
    """One roof and one hover point for all, also after a failure; apart, only the roof is told."""
    mission = optuav.load("relay-today").replace(BERLIN)
    cycle = optuav.coverage(mission)
    apart = cycle.event(2, separation_m=10.0)
    for name, event, close in (("a", cycle.event(4), True), ("b", apart, False)):
        files = event.save_flights(tmp_path / name, START)
        texts = [f.read_text("utf-8") for f in files if f.suffix in (".plan", ".txt", ".kml")]
        assert all("take off and land at one point" in text for text in texts)
        assert {"at one hover point" in text for text in texts} == {close}
    drones = tmp_path / "a" / "drone-1.kml"
    assert not optuav.audit(drones, mission).flyable
    stated = mission.replace({"limits.deadline_s": 1e7, "battery.charging": "taper"})
    assert optuav.audit(drones, stated).flyable


def test_drones_that_share_a_bay_are_sent_to_no_bay_of_their_own(tmp_path: Path) -> None:
    """As packs are exchanged, one bay may serve all."""
    files = optuav.coverage(HERE, swap_s=300.0).event(1).save_flights(tmp_path, START)
    (text, *_) = (file.read_text("utf-8") for file in files if file.suffix == ".txt")
    assert (
        "move those of each drone to its landing place at the bay, which drones may share" in text
    )


def test_the_library_tells_all_faults_at_once(tmp_path: Path) -> None:
    event = optuav.coverage("matrice350").event(1)
    with pytest.raises(InputError, match=r"(?s)crs: is missing") as refused_files:
        event.save_flights(tmp_path, "soon", climb_m=-2.0)
    assert {"crs", "start", "climb_m"} == {fault.key for fault in refused_files.value.faults}


def test_the_command_tells_all_faults_at_once() -> None:
    """Of the event, of its files and their place, and of the points apart."""
    told = refused(
        *("coverage", "matrice350", "--hours", "0", "--drones", "0", "--overlap-s", "-1"),
        *("--separation-m", "abc", "--flights", "f1", "--start", "foo", "--climb-m", "low"),
    )
    assert "--climb-m = 'low': must be a number, 0 < x <= 1000 [m]" in told
    assert "crs: is missing; an export needs the mission's place on Earth" in told
    names = ("hours", "drones", "overlap-s", "separation-m", "start", "climb-m")
    assert all(f"--{name} = " in told for name in names)
    assert "'abc'" in told
