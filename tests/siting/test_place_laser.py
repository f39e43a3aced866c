"""Where lasers are put, against plans that are solved one by one."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.options import Perspective
from optuav.siting import places as siting
from optuav.siting.places import HoverTimes
from optuav.status import Status
from tests.several_devices import three

CANDIDATES_M = np.array(
    [[1000.0, 0.0, 50.0], [250.0, 700.0, 120.0], [1800.0, 900.0, 90.0], [900.0, 1500.0, 40.0]]
)


def town() -> Mission:
    """The mission ``paper`` in haze, with a long wall that hides some roofs from some sites."""
    wall = {"name": "wall", "position_m": [1100, 600, 140], "footprint_m": [900, 40]}
    paper = optuav.load("paper")
    rows = [each.model_dump(mode="json", exclude_none=True) for each in paper.buildings]
    return paper.replace(
        {
            "buildings": [*rows[::3], wall],
            "flight.through_buildings": True,
            "laser.visibility_km": 3.0,
            "limits.deadline_s": 1800,
        }
    )


def devices() -> list[Mission]:
    """The town with its device in four places, the last of which nothing reaches."""
    places = [[300.0, 1200.0, 0.0], [1000.0, 2600.0, 0.0], [1900.0, 500.0, 0.0]]
    far = town().replace({"link.device_m": [9e5, 9e5, 0.0]})
    return [*(town().replace({"link.device_m": each}) for each in places), far]


def solved_s(missions: list[Mission], sites_m: Floats, perspective: Perspective) -> Floats:
    """Hover times by `optuav.solve`, mission by mission, 0 without a plan."""
    found = np.zeros((len(missions), len(sites_m)))
    for (i, mission), (j, site_m) in itertools.product(enumerate(missions), enumerate(sites_m)):
        plan = optuav.solve(
            mission.replace({"laser.position_m": site_m.tolist()}), perspective=perspective
        )
        if plan.status is Status.OPTIMAL:
            found[i, j] = plan.hover_time_s
    return found


@pytest.mark.parametrize("perspective", ["available", "wells", "battery"])
def test_table_is_that_of_single_solves(perspective: Perspective) -> None:
    """The hover point that moves with the laser, and sight past the wall, included."""
    found_s = HoverTimes(devices(), perspective).at(CANDIDATES_M)
    assert np.isnan(found_s[3]).all()
    expected_s = solved_s(devices(), CANDIDATES_M, perspective)
    np.testing.assert_allclose(np.nan_to_num(found_s), expected_s, rtol=0.0, atol=2e-6)
    assert np.ptp(expected_s[0]) > 1.0  # else the sites would not matter


def test_table_does_not_mix_missions_up() -> None:
    """Missions that differ in more than their device, in any order, and more than fit at once."""
    short = [each.replace({"limits.deadline_s": 700}) for each in devices()]
    mixed = [each for pair in zip(devices(), short, strict=True) for each in pair]
    sites_m = np.concatenate([CANDIDATES_M] * 500) + np.arange(2000.0)[:, None] * [0.1, 0.0, 0.0]
    together_s = HoverTimes(mixed, "battery").at(sites_m)
    for mission, row_s in zip(mixed, together_s, strict=True):
        (alone_s,) = HoverTimes([mission], "battery").at(sites_m[::97])
        np.testing.assert_allclose(row_s[::97], alone_s, rtol=0.0, atol=1e-9)
    assert (np.nan_to_num(together_s[::2]) > np.nan_to_num(together_s[1::2])).any()


@pytest.mark.parametrize(
    ("lasers", "objective", "at_least_s"),
    [
        (1, "mean", None),
        (2, "covered", 560.0),
        pytest.param(2, "mean", None, marks=pytest.mark.soak),
        pytest.param(1, "covered", 560.0, marks=pytest.mark.soak),
    ],
)
def test_sites_are_the_best_of_all_choices(
    objective: Any, at_least_s: float | None, lasers: int
) -> None:
    """Each mission uses the one laser that lets it hover longest."""
    found = optuav.place_laser(
        devices(), CANDIDATES_M, lasers, objective=objective, at_least_s=at_least_s, refine=False
    )
    hover_s = solved_s(devices(), CANDIDATES_M, "available")
    values = []
    for sites in itertools.combinations(range(4), lasers):
        reached_s = hover_s[:, sites].max(axis=1)
        values.append(reached_s.mean() if at_least_s is None else sum(reached_s >= at_least_s))
    assert found.value == pytest.approx(max(values), abs=2e-6)
    assert found.gap == 0.0
    assert found.laser[3] == -1
    assert found.mission(3) == found.missions[3]


def test_laser_of_each_mission_is_where_its_plan_is_best() -> None:
    """The missions that come back are solved to the hover times that were stated."""
    found = optuav.place_laser(devices(), CANDIDATES_M, 2)
    for number in range(3):
        plan = optuav.solve(found.mission(number))
        assert plan.hover_time_s == pytest.approx(np.nanmax(found.hover_s[number]), abs=2e-6)


def lit(mission: Mission, place_m: Floats) -> list[bool]:
    """Which places are in sight of the laser, as the network of that mission has it."""
    moved = mission.replace({"laser.position_m": place_m.tolist()})
    return list(build_network(moved).places.laser_sight.tolist())


@pytest.mark.parametrize("lasers", [1, 2])
def test_refinement_gains_within_reach_and_sight(lasers: int) -> None:
    """No farther than half way to the next candidate, at the same height, the same in sight."""
    missions, sites_m = devices()[:3], CANDIDATES_M[1:3]
    plain = optuav.place_laser(missions, sites_m, lasers, refine=False)
    found = optuav.place_laser(missions, sites_m, lasers)
    assert found.selection == plain.selection
    assert found.value > plain.value + 0.1
    start_m = sites_m[list(found.selection.sites)]
    assert (found.position_m[:, 2] == start_m[:, 2]).all()
    for start, end in zip(start_m, found.position_m, strict=True):
        half_m = 0.5 * np.linalg.norm(sites_m[0, :2] - sites_m[1, :2])
        assert np.linalg.norm(end - start) <= half_m + 1e-9
        assert all(lit(each, start) == lit(each, end) for each in missions)
    hover_s = solved_s(missions, found.position_m, "available")
    assert hover_s.max(axis=1).mean() == pytest.approx(found.value, abs=2e-6)


def test_a_single_candidate_stays_where_it_is() -> None:
    """There is no distance to say how far it may go."""
    found = optuav.place_laser("paper", CANDIDATES_M[:1], perspective="battery")
    assert found.position_m.tolist() == CANDIDATES_M[:1].tolist()


def test_worst_leaves_out_what_no_candidate_serves() -> None:
    """Else one device that is out of reach would make all choices equal."""
    found = optuav.place_laser(devices(), CANDIDATES_M, 2, objective="worst", refine=False)
    hover_s = solved_s(devices()[:3], CANDIDATES_M, "available")
    pairs = itertools.combinations(range(4), 2)
    best_s = max(hover_s[:, pair].max(axis=1).min() for pair in pairs)
    assert found.value == pytest.approx(best_s, abs=2e-6)
    assert "1 with a laser on any candidate; they are left out" in str(found)
    nowhere = optuav.place_laser(devices()[3:], CANDIDATES_M, objective="worst")
    assert (nowhere.value, nowhere.gap, nowhere.selection.sites) == (0.0, 0.0, ())


def test_summary_tells_bound_gap_and_greedy() -> None:
    """Always printed, whatever the objective; also where nothing is gained."""
    for objective, at_least_s in (("mean", None), ("worst", None), ("covered", 1e6)):
        text = str(
            optuav.place_laser(
                devices(), CANDIDATES_M, objective=objective, at_least_s=at_least_s, refine=False
            )
        )
        lines = {line.split()[0] for line in text.splitlines()}
        assert {"Placed", "Bound", "Greedy"} <= lines
        assert "no selection is better" in text or "gap" in text
    assert "0 of 4 hover 1e+06 s or longer" in text
    assert "no site adds anything" in text


def test_every_fault_is_told_at_once() -> None:
    wrong: dict[str, Any] = {
        "lasers": 0,
        "objective": "worts",
        "perspective": "wels",
        "gap": -1.0,
        "time_limit_s": float("nan"),
    }
    with pytest.raises(optuav.InputError) as refusal:
        optuav.place_laser([], [[0.0, float("nan"), 0.0], [1e7, 0.0, 0.0]], **wrong)
    keys = [fault.key for fault in refusal.value.faults]
    assert keys == ["missions", "candidates[0]", "candidates[1]", *wrong]
    assert "did you mean 'worst'" in str(refusal.value)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"objective": "covered"}, "at_least_s"),
        ({"at_least_s": 600.0}, "at_least_s"),
        ({"lasers": True}, "lasers"),
        ({"lasers": 1.5}, "lasers"),
    ],
)
def test_options_that_contradict_each_other(options: dict[str, Any], key: str) -> None:
    with pytest.raises(optuav.InputError) as refusal:
        optuav.place_laser("paper", CANDIDATES_M, **options)
    assert [fault.key for fault in refusal.value.faults] == [key]


@pytest.mark.parametrize("candidates", [[], [1.0, 2.0, 3.0], [[1.0, 2.0]], "here", [[1, 2, "x"]]])
def test_candidates_that_are_no_points(candidates: Any) -> None:
    with pytest.raises(optuav.InputError, match="points"):
        optuav.place_laser("paper", candidates)


def test_missions_whose_laser_cannot_be_placed() -> None:
    """All are named: one without a laser, and one whose packs take turns."""
    dark = optuav.load("paper").replace({"laser": None, "name": "dark"})
    turns = optuav.load("paper").replace({"battery.schedule": "sequential", "name": "turns"})
    with pytest.raises(optuav.InputError) as refusal:
        optuav.place_laser([dark, turns], CANDIDATES_M)
    told = [(fault.source, fault.key) for fault in refusal.value.faults]
    assert told == [("dark", "laser"), ("turns", "battery.schedule")]


def test_solver_is_loaded_only_where_it_is_needed() -> None:
    """A single candidate is chosen without HiGHS; importing the function loads no solver."""
    code = (
        "import sys, optuav; found = optuav.place_laser('paper', [[1000, 0, 50]]);"
        "print([each for each in ('highspy', 'scipy.sparse', 'cvxpy') if each in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("missions", [5, ["papr", "paper", "pape"]])
def test_missions_that_are_none(missions: Any) -> None:
    """All that cannot be read are told, and no other error comes of them."""
    with pytest.raises(optuav.InputError) as refusal:
        optuav.place_laser(missions, CANDIDATES_M)
    assert len(refusal.value.faults) == (1 if missions == 5 else 2)


def test_numbers_of_numpy_are_numbers_and_the_answer_is_plain_data() -> None:
    """As they come out of a computation; and JSON has no NaN."""
    lasers, gap = np.int64(1), np.float32(0.5)
    found = optuav.place_laser(devices(), CANDIDATES_M, lasers, gap=gap, refine=False)  # type: ignore[arg-type]
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert told["kind"] == "optuav siting"
    assert told["missions"] == ["paper"] * 4
    assert told["laser"] == [0, 0, 0, -1]
    assert told["hover_s"][3] == [None]
    assert told["candidates_m"] == CANDIDATES_M.tolist()
    assert [len(row) for row in told["candidate_hover_s"]] == [len(CANDIDATES_M)] * 4
    assert told["candidate_hover_s"][3] == [None] * len(CANDIDATES_M)
    assert told["position_m"] == [CANDIDATES_M[told["selection"]["sites"][0]].tolist()]
    assert told["value"] == told["selection"]["value"] == found.value


@pytest.mark.parametrize("number", [4, -1, "a", 0.5])
def test_a_mission_that_is_none_of_them(number: Any) -> None:
    found = optuav.place_laser(devices(), CANDIDATES_M[:1], refine=False)
    assert "1 of 1 candidate for 4 missions" in str(found)
    with pytest.raises(optuav.InputError, match=r"number = .*0 <= x < 4"):
        found.mission(number)


def test_what_is_alike_is_counted_with_the_reason() -> None:
    """A charger that caps the current makes lasers equal; in haze the light decides, not it."""
    haze = optuav.load("paper").replace({"laser.visibility_km": 1.0})
    sites_m = [[1000, 0, 50], [1000, 900, 50], [1000, 1800, 50]]
    capped = optuav.place_laser("paper", sites_m)
    hovers_s = solved_s([optuav.load("paper")], np.array(sites_m), "available")[0]
    assert hovers_s == pytest.approx([hovers_s.max()] * 3, abs=1e-6)
    assert capped.selection.alike == (2,)
    printed = " ".join(str(capped).split())
    assert "as good: 2 in place of site 0; battery.charge_current_A = 10 A caps" in printed
    again = optuav.place_laser(["paper", optuav.load("paper").replace({"name": "x"})], sites_m)
    assert "; missions 0, 1, battery.charge_current_A = 10 A" in " ".join(str(again).split())
    assert "Alike" not in str(optuav.place_laser(haze, sites_m, refine=False))
    cover = optuav.place_laser([haze] * 2, sites_m, objective="covered", at_least_s=1)
    assert cover.selection.alike == (2,)
    assert "caps" not in str(cover)


def in_a_town() -> list[Mission]:
    """Many roofs, some with walls, and the device in two places."""
    draw, count = np.random.default_rng(3), 40
    roofs_m = {"x_m": draw.uniform(0.0, 2000.0, count), "y_m": draw.uniform(0.0, 2500.0, count)}
    roofs_m["z_m"] = draw.uniform(10.0, 60.0, count)
    walls_m = dict.fromkeys(("width_m", "depth_m"), draw.choice([np.nan, 10.0], count))
    table = {"name": [f"b{k}" for k in range(count)], **roofs_m, **walls_m}
    return [mission.with_buildings(table) for mission in devices()[:2]]


@pytest.mark.parametrize("perspective", ["available", "battery"])
def test_in_a_town_the_same_buildings_decide(
    perspective: Perspective, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where few buildings are tried first, times, sites and moves are those over all of them."""
    options: dict[str, Any] = {"perspective": perspective}
    sites_m = np.array([[0.0, 0.0, 150.0], [2000.0, 0.0, 150.0]])
    known = optuav.place_laser(in_a_town(), sites_m, **options)
    monkeypatch.setattr(siting, "MANY_BUILDINGS", 20)
    monkeypatch.setattr(siting, "FIRST_ROUTES", 5)
    found = optuav.place_laser(in_a_town(), sites_m, **options)
    np.testing.assert_array_equal(found.candidate_hover_s, known.candidate_hover_s)
    np.testing.assert_array_equal(found.position_m, known.position_m)
    np.testing.assert_array_equal(found.hover_s, known.hover_s)
    assert found.selection == known.selection
    assert (found.position_m != sites_m[list(found.selection.sites)]).any()
    hover_s = solved_s(in_a_town(), sites_m, perspective)
    np.testing.assert_allclose(found.candidate_hover_s, hover_s, rtol=0.0, atol=2e-6)


def test_refinement_ends_where_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the charger caps the current, eight points are tried, and sight is not asked for."""
    told, sites_m = list[tuple[int, int | None, str]](), [[1000, 0, 50], [1000, 900, 50]]
    monkeypatch.setattr(HoverTimes, "lit", None)
    found = optuav.place_laser("paper", sites_m, progress=lambda *each: told.append(each))
    assert found.position_m.tolist() == [sites_m[found.selection.sites[0]]]
    assert told == [(0, 2, "hover times"), (2, None, "laser 1, steps of 225 m")]


def test_progress_counts_hover_times_and_may_stop_the_work() -> None:
    """The count rises, with a total for the table; an interrupt ends it, and changes no answer."""
    told = list[tuple[int, int | None, str]]()

    def tell(done: int, total: int | None, words: str) -> None:
        told.append((done, total, words))
        if len(told) == 3:
            raise KeyboardInterrupt

    known = optuav.place_laser(devices(), CANDIDATES_M, 2)
    with pytest.raises(KeyboardInterrupt):
        optuav.place_laser(devices(), CANDIDATES_M, 2, progress=tell)
    assert told[0] == (0, 16, "hover times")
    assert told[1][:2] == (16, None)
    assert told[2][2].startswith("laser 2, steps of ")
    again = optuav.place_laser(devices(), CANDIDATES_M, 2, progress=tell)
    assert [done for done, _, _ in told[3:]] == sorted(done for done, _, _ in told[3:])
    assert again.to_dict() == known.to_dict()
    with pytest.raises(optuav.InputError, match="progress"):
        optuav.place_laser("paper", CANDIDATES_M, progress=1)  # type: ignore[arg-type]


def test_a_laser_serves_missions_over_several_devices() -> None:
    """Hover times are those of `solve` with the laser there, beside a mission with one device."""
    sites = [(0.0, 0.0, 10.0), (1000.0, 1000.0, 10.0)]
    placed = optuav.place_laser([three(), "paper"], sites, refine=False)
    for number, mission in enumerate((three(), optuav.load("paper"))):
        site = placed.position_m[placed.laser[number]].tolist()
        best = optuav.solve(mission.replace({"laser.position_m": site}))
        assert placed.hover_s[number, placed.laser[number]] == pytest.approx(best.hover_time_s)


def test_many_routes_over_devices_are_placed_as_few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some sites at a time, or each solved by itself, give the same hover times."""
    sites = np.array([[0.0, 0.0, 10.0], [1000.0, 1000.0, 10.0], [1900.0, 100.0, 20.0]])
    together = HoverTimes([three()], "available").at(sites)
    monkeypatch.setattr(siting, "ROUTES_AT_ONCE", 1)
    assert HoverTimes([three()], "available").at(sites) == pytest.approx(together)
    monkeypatch.setattr(siting, "takes_arrays", lambda *_: False)
    assert HoverTimes([three()], "available").at(sites) == pytest.approx(together)
