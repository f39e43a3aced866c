"""``optuav audit``: exit codes, words, JSON and the picture."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import optuav
from tests.cli.run import WIDTH, refused, run, widest, words

STAY = '[[stops]]\nat = "hover"\nkind = "hover"\nduration_s = {}\n'


@pytest.fixture
def itinerary(tmp_path: Path) -> Path:
    """An itinerary that can be flown."""
    path = tmp_path / "mine.toml"
    path.write_text('schema = 1\nmission = "paper"\n' + STAY.format(500), "utf-8")
    return path


def test_yes(itinerary: Path) -> None:
    found = run("audit", str(itinerary))
    assert found.code == 0
    assert found.out.startswith("FLYABLE")
    assert "Tolerance    1e−06 of the capacity" in found.out


def test_no_with_time_value_and_limit(itinerary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    itinerary.write_text('schema = 1\nmission = "paper"\n' + STAY.format(650), "utf-8")
    monkeypatch.chdir(itinerary.parent)
    found = run("audit", itinerary.name)
    assert found.code == 1
    assert "660.26 s  the available well runs dry: −" in found.out
    # The well is emptiest when the mission ends.
    assert re.search(r"dry: −\d+\.\d+ at 725\.79 s, at least 0 A s", words(found.out))
    assert widest(found.out) <= WIDTH


def test_saved_plans_and_json(tmp_path: Path) -> None:
    saved = tmp_path / "plan.json"
    optuav.solve("paper", optuav.P1(trajectory="direct"), perspective="battery").save(saved)
    found = run("audit", str(saved), "--json")
    answer = json.loads(found.out)
    assert (found.code, answer["flyable"]) == (1, False)
    (dry,) = [event for event in answer["events"] if event["violation"]]
    assert (dry["kind"], dry["limit"], dry["unit"]) == ("empty", 0.0, "A s")
    assert dry["time_s"] == pytest.approx(660.26, abs=0.005)


def test_a_spoiled_figure_is_a_no(tmp_path: Path) -> None:
    """It is readable, and `load_plan` would refuse it."""
    saved = tmp_path / "plan.json"
    optuav.solve("paper", "P3", perspective="energy").save(saved)
    assert run("audit", str(saved)).code == 0
    data = json.loads(saved.read_text("utf-8"))
    data["hover_time_s"] += 1.0
    saved.write_text(json.dumps(data), "utf-8")
    found = run("audit", str(saved))
    assert found.code == 1
    assert "hover_time_s: the file says 525.628" in found.out


def test_unreadable_files_are_refused(itinerary: Path, tmp_path: Path) -> None:
    assert "there is no such file" in refused("audit", str(tmp_path / "none.json"))
    itinerary.write_text("schema = 1\n", "utf-8")
    told = refused("audit", str(itinerary))
    assert "mission: is missing" in told
    assert "stops: is missing" in told


def test_picture(itinerary: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    for ending, begin in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        target = tmp_path / f"profile{ending}"
        found = run("audit", str(itinerary), "--plot", str(target))
        assert found.code == 0
        assert target.read_bytes().startswith(begin)
        assert f"wrote {target}" in found.out


def test_a_picture_under_another_ending_is_refused_before_the_work(
    itinerary: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(optuav, "audit", None)
    told = refused("audit", str(itinerary), "--plot", str(tmp_path / "pr.xyz"))
    assert told.startswith("error: --plot = ")
    assert told.endswith("pr.xyz': must be a name that ends in .png, .svg or .pdf\n")


def test_a_shipped_mission_is_called_one() -> None:
    told = "there is no such file; it is a shipped mission: use optuav solve"
    assert refused("audit", "paper") == f"error: paper: {told}\n"


def test_help_tells_what_an_itinerary_holds() -> None:
    """Brackets would be taken for markup of the screen, and vanish."""
    assert "keys schema and mission, and a table stops for each stop: at (the name" in words(
        run("audit", "--help").out
    )
