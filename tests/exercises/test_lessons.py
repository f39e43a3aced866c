"""Editions of the lessons: what students get, and what nbgrader and Otter read."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import nbformat
import pytest

from tests.exercises.worked import ROOT, editions, sections

LESSONS = sorted((ROOT / "examples").glob("*.py"))


def test_the_student_edition_is_up_to_date() -> None:
    """``make lessons`` has nothing to change, and no lesson of another name is left."""
    made = editions().student_files()
    folder = ROOT / "optuav" / "lessons"
    kept = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert sorted(kept) == sorted(made)
    assert [path.name for path in made if kept[path] != made[path]] == []


def solution_lines(text: str) -> list[str]:
    """Lines of code in worked solutions that say something, and that no lesson teaches."""
    parts = editions().SOLUTION.findall(text)
    lines = [line.strip() for part in parts for line in part.splitlines()]
    return [line for line in lines if len(line) > 12 and re.match(r"answer_|[a-z_]+_s = ", line)]


def test_the_package_has_no_worked_solution() -> None:
    """Neither in the notebooks nor in the code of the graders."""
    lines = [line for path in LESSONS for line in solution_lines(path.read_text("utf-8"))]
    assert len(lines) >= len(sections())
    files = [*(ROOT / "optuav").rglob("*.ipynb"), *(ROOT / "optuav" / "exercises").glob("*.py")]
    shipped = {path: path.read_text("utf-8") for path in files}
    assert [path for path, text in shipped.items() if "SOLUTION" in text] == []
    held = [
        (line, path.name)
        for line in lines
        for path, text in shipped.items()
        if json.dumps(line, ensure_ascii=False)[1:-1] in text
    ]
    assert held == []


def test_marks_of_solutions_come_in_pairs() -> None:
    """Around at least one line, before each the name that it gives a value to."""
    for path in LESSONS:
        text = path.read_text("utf-8")
        marks = re.findall(r"^ *### (BEGIN|END) SOLUTION$", text, re.MULTILINE)
        assert marks == ["BEGIN", "END"] * (len(marks) // 2)
        left = editions().without_solutions(text)
        assert "SOLUTION" not in left
        assert len(re.findall(r"^answer_\d = \.\.\.$", left, re.M)) == len(marks) // 2


@pytest.mark.parametrize("name", [*sections()])
def test_a_lesson_without_answers_runs_to_its_end(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every check says that there is no answer yet."""
    space: dict[str, Any] = {}
    cells = [editions().without_solutions(each) for each in sections()[name]]
    for source in cells:
        exec(source, space)
    checks = sum("exercises.check(" in each for each in cells)
    assert capsys.readouterr().out.count("no answer yet") == checks


@cache
def others() -> Mapping[Path, bytes]:
    """The editions for nbgrader and Otter, by place."""
    found: dict[Path, bytes] = editions().other_files()
    return found


def made(kind: str, name: str) -> Any:
    """A notebook of an edition."""
    path = {"nbgrader": Path("nbgrader", "source", name), "otter": Path("otter")}[kind]
    return json.loads(others()[editions().BUILD / path / f"{name}.ipynb"])


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_editions_are_notebooks(path: Path) -> None:
    student = editions().notebook(path.stem, editions().cells(path.read_text("utf-8")))
    for document in (json.loads(student), made("nbgrader", path.stem), made("otter", path.stem)):
        nbformat.validate(document)


def test_nbgrader_finds_answers_and_checks() -> None:
    """An answer holds a solution and no points; its check is locked and has a point."""
    cells = made("nbgrader", "05_declare_a_problem")["cells"]
    known = [(each["metadata"]["nbgrader"], each) for each in cells if each["metadata"]]
    names = [each["grade_id"] for each, _ in known]
    assert names == ["answer-q05_1", "check-q05_1", "answer-q05_2", "check-q05_2"]
    for data, cell in known:
        text = "".join(cell["source"])
        assert ("### BEGIN SOLUTION" in text) == data["solution"] == (not data["grade"])
        assert ("assert grade" in text) == data["locked"] == ("points" in data)


def test_otter_finds_questions() -> None:
    """Raw cells open and close each, in the order that Otter expects."""
    cells = made("otter", "05_declare_a_problem")["cells"]
    raw = ["".join(each["source"]).split("\n")[0] for each in cells if each["cell_type"] == "raw"]
    question = [f"# {mark}" for mark in ("BEGIN QUESTION", "BEGIN SOLUTION", "END SOLUTION")]
    question += ["# BEGIN TESTS", "# END TESTS", "# END QUESTION"]
    assert raw == ["# ASSIGNMENT CONFIG", *question, *question]


def test_otter_gets_the_data_of_a_lesson() -> None:
    """All files beside the notebook are listed for the copies of students and of the grader."""
    assert "files" not in "".join(made("otter", "05_declare_a_problem")["cells"][0]["source"])
    first = "".join(made("otter", "19_fit_a_battery")["cells"][0]["source"])
    listed = re.findall(r"^  - (.+)$", first.partition("files:\n")[2], re.MULTILINE)
    assert "data/lifetimes.csv" in listed
    folder = editions().BUILD / "otter"
    assert all(folder / each in others() for each in listed)
