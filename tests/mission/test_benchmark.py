"""The recipes of the benchmark set: what they cover, and that their missions never change."""

from __future__ import annotations

import json
from pathlib import Path
from zlib import crc32

import pytest

import optuav
from optuav.judge.benchmark import FILE, answers
from optuav.mission import benchmark
from optuav.mission.benchmark import town

RECIPES = benchmark.recipes()


def test_a_town_is_the_same_on_every_machine() -> None:
    """Whole metres, drawn by the one generator whose numbers Python promises never to change."""
    table = town([], 3, 7)
    assert table["x_m"] == [647, 1301, 1071]
    assert table["y_m"] == [301, 144, 731]
    assert table["z_m"] == [34, 65, 32]
    towns = [town([], **each.town) for each in RECIPES.values() if each.town]
    assert crc32(json.dumps(towns).encode()) == 2877490131
    assert all(isinstance(x, int) for each in towns for x in each["x_m"] + each["z_m"])


def test_footprints_leave_out_what_has_to_be_free() -> None:
    kept_m = [(50, 50), (100, 100)]
    table = town(kept_m, 200, 1, size_m=200, width_m=20)
    for x, y in zip(table["x_m"], table["y_m"], strict=True):
        assert all(max(abs(x - p[0]), abs(y - p[1])) > 20 for p in kept_m)
    assert table["width_m"] == table["depth_m"] == [20] * 200


def test_streets_are_a_grid() -> None:
    table = town([], 100, 1, streets=True, size_m=1000)
    assert {*table["x_m"]} == {*table["y_m"]} == {*range(50, 1000, 100)}


def test_the_set_has_what_its_page_says() -> None:
    """200 missions of 10 to 10 000 roofs; each kind of answer, each reason, and all options."""
    assert len(RECIPES) == 200
    missions = {name: optuav.load(name) for name in RECIPES}
    assert [mission.name for mission in missions.values()] == [*RECIPES]
    roofs = {len(mission.buildings) for mission in missions.values()}
    assert {10, 30, 100, 300, 1000, 3000, 10000} <= roofs
    assert {each.flight.model for each in missions.values()} == {"rotors", "regimes"}
    assert {each.battery.schedule for each in missions.values()} == {*optuav.options.SCHEDULES}
    assert {each.battery.charging for each in missions.values()} == {"constant", "taper"}
    assert {each.laser is None for each in missions.values()} == {True, False}
    assert sum(any(each.wind.force_N) for each in missions.values()) > 10
    statuses = [each.status for each in answers().values()]
    assert {*statuses} == {"optimal", "feasible", "infeasible"}
    problems = {benchmark.parsed(each.problem)[0] for each in answers().values()}
    assert problems == {"P1", "P2-tight", "P3", "P4"}


REASONS = (
    "the flight takes",
    "charge left",
    "available well not empty",
    "the device is out of reach",
    "P1.a outage",
    "P1.e altitude",
    "the UAV cannot fly",
    "crosses building",
)


@pytest.mark.parametrize("reason", REASONS)
def test_every_reason_has_a_mission_without_a_plan(reason: str) -> None:
    assert any(reason in words for each in answers().values() for words in each.reasons)


def test_every_problem_has_one_answer() -> None:
    asked = [
        (name, problem, perspective)
        for name, each in RECIPES.items()
        for problem in each.problems
        for perspective in each.perspectives
    ]
    assert [*answers()] == asked


def test_answers_are_consistent() -> None:
    """A proved value is its bound, and a plan that keeps more limits hovers no longer."""
    for each in answers().values():
        assert (each.status == "infeasible") == (each.hover_s is None) == bool(each.reasons)
        if each.hover_s is None or each.bound_s is None:
            continue
        assert each.hover_s <= each.bound_s
        assert (each.bound_s - each.hover_s <= 3e-6) == (each.status == "optimal")
        by_charge = answers().get((each.mission, each.problem, "battery"))
        if each.perspective == "available" and by_charge and "tight" not in each.problem:
            assert by_charge.hover_s is not None
            assert each.hover_s <= by_charge.hover_s + 1e-5


def test_the_set_is_small() -> None:
    """It travels in the wheel."""
    assert sum(each.stat().st_size for each in Path(FILE).parent.glob("*.*")) < 500_000


def test_a_mission_is_loaded_by_its_name_everywhere(tmp_path: Path) -> None:
    """And saved as a file of its own."""
    mission = optuav.load("set/walls-30")
    mission.save(tmp_path / "mine.toml")
    assert optuav.load(tmp_path / "mine.toml") == mission
    with pytest.raises(optuav.InputError, match="did you mean 'set/walls-30'"):
        optuav.load("set/wall-30")
