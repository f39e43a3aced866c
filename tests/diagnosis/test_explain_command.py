"""``optuav explain``: exit codes and what is printed."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

import optuav
from optuav.cli.options import command_of
from optuav.cli.solve import explain
from optuav.errors import InputError
from tests.cli.run import run as command
from tests.diagnosis.missions import SMALL, only

POOR = {
    "limits.min_soc": 0.9,
    "laser.power_W": 100.0,
    "buildings": optuav.load("paper").buildings[:1],
}
"""Changes of `paper` with which one rest makes no plan, and more may."""
app = typer.Typer()
app.command()(command_of("explain", explain))

BATTERY = ("--perspective", "battery")


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def test_an_optimum_is_explained_with_exit_code_0() -> None:
    result = run("paper", "--perspective", "battery", "--problem", "P3")
    assert result.exit_code == 0
    assert result.output.strip() == str(
        optuav.diagnosis.explain("paper", problem="P3", perspective="battery")
    )


def test_an_infeasible_question_exits_with_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    only(monkeypatch, "limits")
    SMALL.replace({"limits.deadline_s": 60}).save(tmp_path / "short.toml")
    result = run(str(tmp_path / "short.toml"), *BATTERY, "--problem", "P3", "--json")
    assert result.exit_code == 1
    answer = json.loads(result.output)
    assert answer["status"] == "infeasible"
    assert answer["conflicts"][0]["conflicts"][0]["holds"] is True
    changes = {(each["key"], each["comparison"]): each["value"] for each in answer["repairs"]}
    assert changes["limits.deadline_s", ">="] == 75.8


def test_settings_change_the_mission() -> None:
    result = run(
        "paper",
        "--perspective",
        "battery",
        "--problem",
        "P3",
        "--set",
        "limits.deadline_s=500",
        "--json",
    )
    assert result.exit_code == 0
    assert json.loads(result.output)["hover_time_s"] == pytest.approx(500 - 75.7922, abs=1e-3)


def test_a_saved_plan(tmp_path: Path) -> None:
    plan = optuav.solve("paper", "P3", perspective="battery")
    plan.save(tmp_path / "plan.json")
    result = run(str(tmp_path / "plan.json"))
    assert result.exit_code == 0
    assert "one more A s of the capacity of a pack gives 0.0216 s of hover" in result.output


def test_bad_input_is_an_input_error(tmp_path: Path) -> None:
    """Which `optuav.cli.main` turns into exit code 2."""
    optuav.solve("paper", "P3", perspective="battery").save(tmp_path / "plan.json")
    for arguments in (
        ("nowhere.toml",),
        ("paper", "--problem", "P9"),
        ("paper", "--problem", "P3", "--stops", "2"),
        (str(tmp_path / "plan.json"), "--stops", "2"),
        (str(tmp_path / "plan.json"), "--problem", "P3"),
        (str(tmp_path / "plan.json"), "--set", "limits.deadline_s=1"),
        (str(tmp_path / "none.json"),),
    ):
        assert isinstance(run(*arguments).exception, InputError)


def test_a_search_for_more_stops_by_option(tmp_path: Path) -> None:
    """Also of a saved plan with one rest and one hover."""
    SMALL.save(tmp_path / "small.toml")
    found = run(str(tmp_path / "small.toml"), "--set", "limits.deadline_s=3000", "--hovers", "2")
    assert found.exit_code == 0
    optuav.solve(SMALL.replace({"limits.deadline_s": 3000})).save(tmp_path / "p.json")
    of_plan = run(str(tmp_path / "p.json"), "--hovers", "2")
    assert of_plan.output == found.output
    assert re.search(r"\d\.\d\d s longer than with one rest", " ".join(found.output.split()))


def test_the_command_for_more_stops_can_be_pasted(tmp_path: Path) -> None:
    """With the mission's file and the settings; JSON has the note alone."""
    SMALL.save(tmp_path / "two words.toml")
    asked = (str(tmp_path / "two words.toml"), "--set", "limits.deadline_s=900")
    found = run(*asked).output
    said = found.partition("What more stops would gain:\n")[2].replace("\\\n", "")
    _, _, mission, *options = shlex.split(said)
    assert (mission, *options[4:]) == asked
    assert options[:4] == ["--stops", "2", "--hovers", "2"]
    assert "What more stops" not in run(*asked, "--json").output


@pytest.mark.parametrize(
    ("settings", "code"),
    [
        (["limits.deadline_s=200"], 0),
        (["limits.deadline_s=200", "battery.schedule=sequential"], 3),
        (["limits.deadline_s=60", "battery.schedule=sequential"], 1),
    ],
)
def test_solve_and_explain_leave_with_one_code(settings: list[str], code: int) -> None:
    """A plan that nothing proves is code 3 of both."""
    asked = ("paper", "--problem", "P3", *(part for each in settings for part in ("--set", each)))
    assert [command(name, *asked).code for name in ("solve", "explain")] == [code, code]


def test_a_search_that_its_time_limit_ends_leaves_the_answer_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It left with 1, as if more stops were known to make no plan.

    What is known of them stays: conflicts and repairs, under an answer that is unknown.
    """
    only(monkeypatch, "limits")
    limit = ("--stops", "3", "--time-limit-s", "1e-9")
    path = tmp_path / "poor.toml"
    SMALL.replace(POOR).save(path)
    explained = command("explain", str(path), *limit)
    assert [command("solve", str(path), *limit).code, explained.code] == [3, 3]
    words = " ".join(explained.out.split())
    assert "UNKNOWN (known for one rest and one hover only: " in words
    assert "at most 3 rests and 1 hover: the search ended after 1e−09 s" in words
    assert "Conflict" in words
    assert "Feasible if" in words
