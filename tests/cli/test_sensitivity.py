"""``optuav sensitivity``: what matters most, on the screen and in files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import optuav
from tests.cli.run import refused, run, widest

STATED = "[battery]\ncapacity_As = { percent = 5 }\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_tables_are_those_of_python() -> None:
    found = run("sensitivity", "paper", "--samples", "50", "--seed", "4")
    assert found.code == 0
    assert widest(found.out) <= 80
    assert found.out.rstrip() == str(optuav.sensitivity("paper", samples=50, seed=4))


def test_every_detail_is_saved_and_drawn(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("optuav.plots.files.image", lambda *_: b"")  # drawn, not rendered
    (folder / "sure.toml").write_text(STATED, "utf-8")
    paper = optuav.load("paper")
    paper.replace({"buildings": paper.buildings[8:]}).save("few.toml")
    run("solve", "few.toml", "--save", "plan.json")
    asked = ("sensitivity", "few.toml", "--uncertainty", "sure.toml", "--plan", "plan.json")
    asked = (*asked, "--samples", "50")
    written = run(*asked, "--save", "all.json", "--plot", "pictures")
    assert written.code == 0
    assert "wrote" in written.out
    names = sorted(path.name for path in (folder / "pictures").glob("*.png"))
    assert names == ["hover.png", "tornado.png"]
    data = json.loads((folder / "all.json").read_text("utf-8"))
    assert data["chances"]["uncertain"] == ["battery.capacity_As"]
    assert json.loads(run(*asked, "--json").out) == data
    run(*asked, "--save", "all.csv")
    lines = (folder / "all.csv").read_text("utf-8").splitlines()
    assert lines[0].startswith("key,unit,now,low,high,hover_low_s,hover_high_s,elasticity")
    assert len(lines) == len(data["rows"]) + 1


def test_a_mission_without_a_plan_is_an_honest_no() -> None:
    found = run("sensitivity", "paper", "--set", "limits.deadline_s=60", "--samples", "10")
    assert found.code == 1
    assert "The mission has no plan" in found.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--samples", "0"), "samples = 0"),
        (("--uncertainty", "nowhere.toml"), "there is no such file"),
        (("--plan", "nowhere.json"), "there is no such file"),
        (("--perspective", "hopeful"), "perspective = 'hopeful'"),
        (("--save", "all.txt"), "ends in .csv or .json"),
    ],
)
def test_bad_input_is_refused_in_words(arguments: tuple[str, ...], words: str) -> None:
    assert words in refused("sensitivity", "paper", *arguments)
