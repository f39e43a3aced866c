"""``optuav check-solutions`` and ``optuav missions --set``: exit codes, words and JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.cli.run import WIDTH, refused, run, widest

HEAD = {"schema": 1, "kind": "optuav solutions"}


def written(folder: Path, hover_s: float, claimed_s: float, mission: str) -> str:
    """A file with one solution for the direct route."""
    stop = {"at": "hover", "kind": "hover", "duration_s": hover_s}
    mine: dict[str, Any] = {"mission": mission, "problem": "P3"}
    path = folder / "mine.json"
    solutions = [{**mine, "hover_s": claimed_s, "stops": [stop]}]
    path.write_text(json.dumps({**HEAD, "solutions": solutions}), "utf-8")
    return str(path)


def test_exit_codes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """0 where all hold, 1 where one does not, 2 where the file cannot be read."""
    monkeypatch.chdir(
        tmp_path
    )  # Lines are as wide as their words, and the folder's name may be long
    here = Path()
    holds = run("check-solutions", written(here, 577.5, 577.5, "set/deadline-1200"))
    assert holds.code == 0
    assert holds.out.startswith("1 of 1 solutions hold:")
    assert "set/deadline-1200, P3, available: holds, 0.024 s below the best known" in holds.out
    assert "and 193 more" in holds.out
    wrong = run("check-solutions", written(here, 600.0, 601.0, "set/deadline-1200"))
    assert wrong.code == 1
    assert "set/deadline-1200, P3, available: DOES NOT HOLD" in wrong.out
    assert widest(holds.out + wrong.out) <= WIDTH
    said = refused("check-solutions", written(here, 600.0, 600.0, "set/deadline-12000"))
    assert "did you mean 'set/deadline-1200'?" in said
    assert "no such file" in refused("check-solutions", str(tmp_path / "none.json"))


def test_json(tmp_path: Path) -> None:
    found = run("check-solutions", written(tmp_path, 600.0, 600.0, "set/deadline-1200"), "--json")
    data = json.loads(found.out)
    assert (found.code, data["all_hold"], len(data["missing"])) == (1, False, 199)
    (row,) = data["solutions"]
    assert (row["holds"], row["hover_s"], row["claimed_s"]) == (False, 600.0, 600.0)
    assert 22.4 < -row["gap_s"] < 22.5
    assert len(row["wrong"]) == 1


def test_the_set_is_listed() -> None:
    """Every mission once for each of its problems, and in JSON with all that is known."""
    shown = run("missions", "--set")
    data = json.loads(run("missions", "--set", "--json").out)
    assert shown.code == 0
    assert len(data) == 200
    for each in data:
        assert each["name"] in shown.out
        assert {x["mission"] for x in each["answers"]} == {each["name"]}
    problems = {(x["mission"], x["problem"]) for each in data for x in each["answers"]}
    assert sum(line.startswith("set/") for line in shown.out.splitlines()) == len(problems)
    assert widest(shown.out) <= WIDTH
