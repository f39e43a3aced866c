"""A drone that fails in an event: gaps by hand, hovers by simulation, and rosters by the judge."""

from __future__ import annotations

import csv
import math
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError
from optuav.judge.fleets import replay_fleet
from optuav.service.event import Event
from tests.cli.run import words
from tests.examples import few
from tests.plan.test_export import BERLIN

START = "2027-05-01T14:00+02:00"
HERE = optuav.load("matrice350").replace(BERLIN)
RESERVE = optuav.coverage("matrice350").event(4, 5)
"""Four hours with one drone more than needed."""
CLIMB_S = 2.0 * (12.0 / RESERVE.mission.flight.acceleration_m_s2) ** 0.5
"""A climb of 12 m from standing to standing."""


def uncovered_s(event: Event, drone: int, at_s: float) -> float:
    """Seconds of the event without a hover, counted one by one."""
    hovers = [
        (row["start_s"], row["start_s"] + row["hover_s"])
        for row in event.rows
        if row["drone"] != drone
    ]
    seconds = range(math.ceil(at_s), round(3600 * event.hours))
    return sum(all(not begin <= s + 0.5 < end for begin, end in hovers) for s in seconds)


@pytest.mark.parametrize("at_s", [2100, 3700])
def test_a_new_roster_has_no_flight_without_a_hover_and_rests_as_long_as_climbs(at_s: int) -> None:
    """A drone whose turn comes too early stays on its roof."""
    for drone in range(1, 6):
        roster = RESERVE.without(drone, at_s).roster
        assert roster is not None
        assert min(row["hover_s"] for row in roster.rows) > 1.0
        for number in range(1, 6):
            *rests_s, _ = [row["rest_s"] for row in roster.rows if row["drone"] == number] or [0.0]
            assert all(rest_s >= 2.0 * CLIMB_S - 1e-6 for rest_s in rests_s)


@few(8)
@given(st.integers(1, 5), st.integers(0, 14_399))
def test_gaps_are_those_that_seconds_show(drone: int, at_s: int) -> None:
    """And the judge flies the roster of the others, whose only gap is a leg of the next one."""
    failure = RESERVE.without(drone, at_s)
    assert failure.gap_s == pytest.approx(uncovered_s(RESERVE, drone, at_s), abs=10.0)
    hovers = [row for row in RESERVE.rows if row["drone"] == drone]
    ends_s = [(max(row["start_s"], at_s), row["start_s"] + row["hover_s"]) for row in hovers]
    # Drones hover in turns: what one leaves is a gap, and each is listed
    expected_s = [ends for ends in ends_s if ends[1] > at_s]
    assert np.ravel(failure.gaps_s) == pytest.approx(np.ravel(expected_s), abs=1e-5)
    if len(expected_s) > 1:
        assert f"in {len(expected_s)} gaps, {expected_s[0][0]:.2f} to " in words(str(failure))
    roster = failure.roster
    assert roster is not None
    assert roster.replay().flyable
    out_s = RESERVE.cycles[0].phases[0].duration_s + CLIMB_S
    assert 0.0 <= failure.new_gap_s <= out_s + 1e-6
    last = {row["drone"]: row for row in roster.rows}
    assert {row["rest_s"] for row in last.values()} == {0.0}  # It rests on, failed or not
    assert all(row["start_s"] + row["hover_s"] <= at_s + 1e-6 for row in roster.rows
               if row["drone"] == drone) or failure.gap_s == 0.0  # fmt: skip
    ends_s = [row["start_s"] + row["hover_s"] for row in roster.rows]
    gaps_s = [row["start_s"] - end for end, row in zip([0.0, *ends_s], roster.rows, strict=False)]
    assert sum(gap for gap in gaps_s if gap > 1e-6) == pytest.approx(failure.new_gap_s, abs=1e-6)
    assert max(ends_s) == pytest.approx(14_400.0)
    # What had happened before stays as it was
    before = [row for row in RESERVE.rows if row["start_s"] + row["hover_s"] <= at_s]
    for row, kept in zip(before, roster.rows, strict=False):
        assert (row["drone"], row["start_s"], row["hover_s"]) == (
            kept["drone"],
            kept["start_s"],
            kept["hover_s"],
        )


@pytest.mark.parametrize("at_s", [100.0, 2000.0, 5000.0, 9000.0])
def test_who_can_cover_can(at_s: float) -> None:
    """Each alone, flown by the judge: so long a hover keeps the reserve, 5 s more do not."""
    failure = RESERVE.without(1, at_s)
    out, _, back, *_ = RESERVE.cycles[0].phases
    for row in failure.rows:
        if row["state"] in ("hovers", "flies out") or row["hover_s"] == 0.0:
            continue
        flown = [each for each in RESERVE.rows if each["drone"] == row["drone"]]
        flown = [each for each in flown if each["start_s"] - out.duration_s < at_s]
        assert row["ready_s"] >= at_s + out.duration_s + CLIMB_S - 1e-6
        for more_s, flyable in ((0.0, True), (5.0, False)):
            ends_s = [each["start_s"] + each["hover_s"] + back.duration_s for each in flown]
            takes_off_s = [each["start_s"] - out.duration_s for each in flown[1:]]
            takes_off_s.append(row["ready_s"] - out.duration_s)
            rests_s = [off - end for end, off in zip(ends_s, takes_off_s, strict=False)]
            hovers_s = [each["hover_s"] for each in flown] + [row["hover_s"] + more_s]
            from optuav.service.fleet import repeated

            plan = repeated(RESERVE.cycles[0], [*zip(hovers_s, [*rests_s, 0.0], strict=False)])
            found = replay_fleet(
                [plan], [0.0], drones=1, share=0.01, until_s=plan.phases[-1].end_s, places=1
            )
            faults = {event.kind for event in found.violations} - {"gap", "share"}
            assert (not faults) == flyable, (row, faults)


def test_without_a_reserve_there_may_be_no_roster() -> None:
    """Three drones cannot hold what four must: the answer is that there is none."""
    event = optuav.coverage("matrice350").event(4)
    assert event.drones == event.least_drones == 4
    failure = event.without(1, 600)
    assert failure.gap_s == pytest.approx(uncovered_s(event, 1, 600), abs=10.0)
    assert failure.roster is None
    assert failure.new_gap_s is None
    assert "none was found" in str(failure)
    assert [*failure.plot()] == []


def test_a_drone_with_nothing_left_to_do_makes_no_gap() -> None:
    """After its last landing its failure changes nothing."""
    last = max(row["start_s"] + row["hover_s"] for row in RESERVE.rows if row["drone"] == 1)
    failure = RESERVE.without(1, last + 100.0)
    assert (failure.gap_s, failure.gap_from_s, failure.new_gap_s) == (0.0, None, 0.0)
    assert failure.roster is not None
    assert failure.roster.rows == RESERVE.rows
    assert "4 h without a gap" in str(failure.roster)
    assert "Failed drone 1" in words(str(failure.roster))


@pytest.mark.parametrize("options", [{}, {"swap_s": 300.0}], ids=str)
@pytest.mark.parametrize("at_s", [0.0, 700.0, 6000.0])
def test_overlaps_and_points_apart_stay(options: Any, at_s: float) -> None:
    """The judge checks the roster of the others for both, or the words say what it cannot keep."""
    event = optuav.coverage("relay-today", **options).event(3, 5, overlap_s=40.0, separation_m=10.0)
    failure = event.without(2, at_s)
    roster = failure.roster
    assert roster is not None
    assert roster.overlap_s == 40.0
    assert roster.replay().flyable
    assert (roster.separation_m is None) == ("one point" in (failure.reason or ""))
    for row, after in pairwise(row for row in roster.rows if row["start_s"] > at_s):
        assert row["start_s"] + row["hover_s"] - after["start_s"] == pytest.approx(40.0)


def test_the_new_roster_is_flown_by_files_too(tmp_path: Path) -> None:
    """It goes into another folder, and shows who covers."""
    event = optuav.coverage(optuav.load("matrice350").replace(BERLIN)).event(4, 5)
    failure = event.without(3, 1000)
    assert failure.roster is not None
    files = failure.roster.save_flights(tmp_path, "2027-05-01T14:00+02:00")
    assert len([file for file in files if file.suffix == ".plan"]) == len(failure.roster.rows)
    assert [*failure.plot()] == ["event.png"]
    assert "Without drone 3 from 1000 s on" in str(failure)
    assert len(failure.to_frame()) == 4


@pytest.mark.parametrize("options", [{}, {"swap_s": 300.0}], ids=str)
@pytest.mark.parametrize("at_s", [500, 3000, 6100])
def test_nobody_takes_off_for_a_failure_before_it(options: Any, at_s: int, tmp_path: Path) -> None:
    """By the clock of the pilots, with the climb; and the failed drone lands no more."""
    event = optuav.coverage(HERE, **options).event(4, 5)
    drone = next(row["drone"] for row in event.rows if row["start_s"] + row["hover_s"] > at_s)
    failure = event.without(drone, at_s)
    assert failure.roster is not None
    files = failure.roster.save_flights(tmp_path, START)
    with (tmp_path / "roster.csv").open(encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    begin = datetime.fromisoformat(START)
    planned = event.save_flights(tmp_path / "before", START)
    with (tmp_path / "before" / "roster.csv").open(encoding="utf-8") as file:
        before = {(row["drone"], row["take_off"]) for row in csv.DictReader(file)}
    assert "failed" not in planned[0].read_text("utf-8")
    passed_s = {
        (row["drone"], row["take_off"]): (
            datetime.fromisoformat(row["take_off"]) - begin
        ).total_seconds()
        for row in rows
    }
    assert all(s >= at_s - 0.5 for flight, s in passed_s.items() if flight not in before)
    assert any(flight not in before for flight in passed_s)
    (lost,) = (row for row in rows if row["failed"])
    assert (lost["drone"], lost["landing"], lost["leave"]) == (str(drone), "", "")
    assert (datetime.fromisoformat(lost["failed"]) - begin).total_seconds() == at_s
    assert max(number for number, row in enumerate(rows) if row["drone"] == str(drone)) == (
        rows.index(lost)
    )
    assert not [*tmp_path.glob(f"drone-{drone}-visit-{lost['visit']}.*")]
    gap = f"with a gap of {failure.new_gap_s:.2f} s"
    assert failure.new_gap_s is not None
    texts = [file.read_text("utf-8") for file in files if file.suffix in (".plan", ".txt", ".kml")]
    assert texts
    assert all(f"drone {drone} fails at" in text for text in texts)
    assert all(gap in text for text in texts)
    assert f"visit {lost['visit']}\\, fails" in (tmp_path / "roster.ics").read_text("utf-8")
    ((_, axes),) = failure.roster.pictures()
    assert gap in axes.get_title(loc="left")
    (mark,) = (text for text in axes.texts if "failed" in text.get_text())
    assert mark.get_position() == pytest.approx((at_s / 3600.0, drone - 1))
    bars = [path.get_extents() for bars in axes.collections for path in bars.get_paths()]
    own = [bar for bar in bars if abs(0.5 * (bar.y0 + bar.y1) - drone + 1) < 0.1]
    assert max(bar.x1 for bar in own) == pytest.approx(at_s / 3600.0)


def test_a_higher_climb_after_a_failure_is_told(tmp_path: Path) -> None:
    """The roster counts on 12 m; by hand, 27 m last half as long again."""
    event = optuav.coverage(HERE).event(4, 5)
    roster = event.without(2, 3000).roster
    assert roster is not None
    files = roster.save_flights(tmp_path, START, climb_m=27.0)
    text = next(file for file in files if file.suffix == ".txt").read_text("utf-8")
    assert f"is {0.5 * CLIMB_S:.1f} s late" in text


def test_bad_input() -> None:
    """A drone that is not there, and moments outside the event; both at once."""
    wrong: Any
    for wrong in (0, 6, 1.5, "1", None):
        with pytest.raises(InputError, match=r"drone = .*1 <= x <= 5"):
            RESERVE.without(wrong, 10)
    for wrong in (-1, 14_400, math.nan, "10"):
        with pytest.raises(InputError, match=r"at_s = .*0 <= x < 14400"):
            RESERVE.without(1, wrong)
    with pytest.raises(InputError) as refused:
        RESERVE.without(0, -1)
    assert {fault.key for fault in refused.value.faults} == {"drone", "at_s"}
