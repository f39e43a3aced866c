"""``optuav compare``: verdicts as exit codes, tables, data and pictures."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.engines.casadi_engine import Casadi
from optuav.errors import SolverError
from optuav.studies import compare_methods as methods
from tests.cli.run import refused, run, widest, words

QUICK = ("compare", "small.toml", "--engines", "grid", "--slots", "10,60")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a mission of one building, ``small.toml``."""
    monkeypatch.chdir(tmp_path)
    mission = optuav.load("paper")
    mission.replace({"buildings": [mission.buildings[0].model_dump()]}).save("small.toml")
    return tmp_path


def test_agreement_is_exit_code_0() -> None:
    found = run(*QUICK)
    assert found.code == 0
    assert widest(found.out) <= 80
    assert found.out.splitlines()[2] == "All 12 answers agree."  # Below the heading
    assert found.out.rstrip() == str(
        optuav.compare("small.toml", slots_s=(10.0, 60.0), engines=("grid",))
    )


def test_largest_gap_is_the_largest() -> None:
    """Not the one that uses up most of its own bound: P3's 8.85 s of 10 s at slots of 10 s."""
    printed = run(*QUICK, "--perspective", "battery").out.splitlines()
    (line,) = (line.split() for line in printed if line.startswith("grid 10 s"))
    found = optuav.compare("small.toml", slots_s=(10.0,), engines=("grid",), perspective="battery")
    gaps_s = {
        " ".join(filter(None, (row["problem"], row["building"], row["order"]))): row["gap_s"]
        for row in found.rows
        if row["method"] == "grid 10 s"
    }
    assert gaps_s["P4 b1 rest-first"] > gaps_s["P3"] == pytest.approx(8.848, abs=1e-3)
    assert line[3] == f"{max(gaps_s.values()):.2f}" == "9.54"


def test_every_engine_by_default() -> None:
    """Those that take the perspective; in the paper's also those for what is linear."""
    asked = ("compare", "small.toml", "--slots", "60", "--set", "buildings=[]", "--json")
    for counted, expected in (
        ((), ["bracket", "CasADi", "grid 60 s"]),
        (
            ("--perspective", "battery"),
            ["closed form", "LP", "CasADi wells", "grid 60 s", "MILP 60 s"],
        ),
    ):
        rows = json.loads(run(*asked, *counted).out)["rows"]
        assert [row["method"] for row in rows if row["problem"] == "P3"] == expected


def test_disagreement_is_loud_and_exit_code_1(monkeypatch: pytest.MonkeyPatch) -> None:
    """With an accuracy that no solver has."""
    monkeypatch.setattr(methods, "ACCURACY_S", {"casadi": -1.0, "bracket": 0.0})
    asked = (
        "compare",
        "small.toml",
        "--engines",
        "casadi",
        "--slots",
        "60",
        "--set",
        "buildings=[]",
    )
    found = run(*asked)
    assert found.code == 1
    assert "DISAGREE  P3, CasADi: " in found.out
    assert "NO" in found.out
    assert "agree." not in found.out
    as_json = run(*asked, "--json")
    assert as_json.code == 1
    assert json.loads(as_json.out)["agrees"] is False


def test_an_engine_that_fails_is_exit_code_3(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise SolverError("it broke")

    monkeypatch.setattr(Casadi, "solve", fails)
    found = run("compare", "small.toml", "--engines", "casadi", "--slots", "60")
    assert found.code == 3
    assert "FAILED  P3, CasADi: it broke" in found.out
    assert run(*QUICK, "--time-limit-s", "1e-9").code == 3


def test_nothing_feasible_is_exit_code_1() -> None:
    found = run(*QUICK, "--set", "limits.deadline_s=60")
    assert found.code == 1
    assert "No problem has a plan: the flight takes 75.79 s" in words(found.out)
    assert "none" not in found.out
    assert widest(found.out) <= 80


def test_the_same_question_gives_the_same_output() -> None:
    """Times taken differ from run to run and are told only when asked."""
    asked = ("compare", "small.toml", "--engines", "grid", "--slots", "60")
    as_json = run(*asked, "--json").out
    assert as_json == run(*asked, "--json").out
    assert "time [s]" not in run(*asked).out
    assert "time" not in json.loads(as_json)["rows"][0]
    assert json.loads(run(*asked, "--json", "--times").out)["rows"][0]["time_s"] > 0.0
    timed = run(*asked, "--times").out
    assert "time [s]" in timed
    assert widest(timed) <= 80


def test_files(folder: Path) -> None:
    found = run(*QUICK, "--save", "all.csv")
    assert found.out.splitlines()[-1] == "wrote all.csv"
    with (folder / "all.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert {row["agrees"] for row in rows} == {"True"}
    as_json = run(*QUICK, "--save", "all.json", "--json")
    assert (folder / "all.json").read_text("utf-8") == as_json.out


def test_pictures(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"")  # drawn, not rendered
    found = run(*QUICK, "--plot", "new")
    assert found.code == 0
    assert sorted(path.name for path in (folder / "new").iterdir()) == [
        "gaps.pdf",
        "gaps.png",
        "gaps.svg",
    ]
    assert found.out.count("wrote ") == 1
    found = run("compare", "small.toml", "--by", "trajectory", "--plot", "new")
    assert (folder / "new" / "choices.png").exists()


def test_plans_by_perspective_and_trajectory(folder: Path) -> None:
    table2 = optuav.load("paper-table2")
    table2.replace({"buildings": table2.buildings[:1]}).save("table2.toml")
    found = run("compare", "table2.toml", "--by", "perspective,trajectory", "--slots", "1")
    assert found.code == 0
    assert widest(found.out) <= 80
    assert found.out.rstrip() == str(
        optuav.compare("table2.toml", by=("perspective", "trajectory"), slots_s=1.0)
    )
    assert "energy direct yes 697.00" in words(found.out)
    data = json.loads(run("compare", "small.toml", "--by", "trajectory", "--json").out)
    assert [row["trajectory"] for row in data["rows"]] == ["direct", "traj1", "traj2", "optimal"]
    run("compare", "small.toml", "--by", "perspective", "--save", "by.csv")
    assert (
        (folder / "by.csv").read_text("utf-8").startswith("perspective,trajectory,flyable,status")
    )


def test_plans_by_trajectory_where_there_are_none() -> None:
    found = run("compare", "paper", "--by", "trajectory", "--set", "limits.deadline_s=60")
    assert found.code == 1
    assert "Because the flight takes 75.79 s" in found.out
    assert widest(found.out) <= 80


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--slots", ""), "--slots = '': must be numbers of seconds"),
        (("--slots", "1,x"), "--slots = '1,x': must be numbers of seconds"),
        (("--slots", "0"), "--slots = 0.0"),
        (("--slots", "1e-9"), "--slots = 1e-09"),
        (("--slots", "inf"), "--slots = inf"),
        (("--slots", "1,1.0"), "must have each length once"),
        (("--engines", "grid,abacus"), "engines = 'abacus': must be some of bracket, casadi, grid"),
        (
            ("--perspective", "wells"),
            "perspective = 'wells': must be one of battery, energy, adjusted",
        ),
        (
            ("--engines", "cvxpy"),
            "engines = 'cvxpy': must be some of bracket, casadi, grid in the persp",
        ),
        (
            ("--by", "problem"),
            "by = 'problem': must be some of perspective, trajectory; or only method, schedule or",
        ),
        (
            ("--by", "schedule,trajectory"),
            "by = 'schedule': must be some of perspective, trajectory; or",
        ),
        (("--by", "trajectory,trajectory"), "each once"),
        (("--by", "trajectory", "--slots", "1,2"), "one length unless by = 'method'"),
        (
            ("--by", "trajectory", "--engines", "grid"),
            "goes with by = 'method' only",
        ),
        (("--by", "trajectory", "--times"), "times = true: goes with by = 'method' only"),
        (("--by", "perspective", "--perspective", "energy"), "is compared by already"),
        (("--time-limit-s", "0"), "--time-limit-s = 0.0"),
        (("--set", "limits.min_soc=2"), "limits.min_soc = 2"),
    ],
)
def test_bad_input_is_refused_in_words(arguments: tuple[str, ...], said: str) -> None:
    assert said in refused("compare", "paper", *arguments)


@pytest.mark.parametrize("by", [(), ("--by", "trajectory")])
@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--save", "table.txt"), "a name that ends in .csv or .json"),
        (("--save", "no/such/folder/x.csv"), "there is no directory no/such/folder"),
        (("--plot", "small.toml"), "is not a directory"),
    ],
)
def test_places_that_cannot_be_written_to_are_refused_before_the_work(
    by: tuple[str, ...], option: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("optuav.studies.compare.compare", None)
    assert said in refused("compare", "paper", *by, *option)
