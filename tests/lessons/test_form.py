"""Every lesson says what it needs and teaches, asks before it shows, and pins nothing."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from optuav import exercises

ROOT = Path(__file__).parents[2]
LESSONS = sorted((ROOT / "examples").glob("*.py"))
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])")
LINK = re.compile(r"\]\((\w+\.py)\)")
MAKES_NO_PICTURE = {"print", "write_text", "save", "kill", "wait", "update", "unlink", "cleanup"}
MAKES_NO_PICTURE |= {"stop", "add_edge", "maximise", "minimise", "subject_to"}
MAKES_NO_PICTURE |= {
    "prefer_small",
    "plot",
    "annotate",
    "set_option",
    "fill_between",
    "heappush",
    "append",
    "simplefilter",
    "set_xlim",
    "set_ylim",
    "set_xscale",
    "set_yscale",
}

pytestmark = pytest.mark.parametrize("lesson", LESSONS, ids=lambda path: path.stem)


@pytest.fixture
def text(lesson: Path) -> str:
    return lesson.read_text("utf-8")


@pytest.fixture
def tree(text: str) -> ast.Module:
    return ast.parse(text)


def cells(text: str) -> list[tuple[str, str]]:
    """What stands behind the marker of each cell, and the cell."""
    parts = re.split(r"^# %%(.*)\n", text, flags=re.MULTILINE)
    return list(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.soak
def test_runs_in_a_process_of_its_own(lesson: Path, tmp_path: Path) -> None:
    """Nothing that another lesson loaded or set is needed, and no warning comes at the start.

    Its console has no Greek either.
    """
    done = subprocess.run(
        [sys.executable, "-W", "error", str(lesson)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "cp1252"},
        capture_output=True,
        text=True,
        encoding="cp1252",
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_is_in_cells(text: str) -> None:
    assert text.count("\n# %%\n") >= 3
    assert text.startswith("# %% [markdown]\n# # ")


def test_says_what_it_needs_and_what_is_learnt(lesson: Path, text: str) -> None:
    """Before the first line of code; what it needs comes earlier in the course."""
    head, _, _ = text.partition("# %%\n")
    assert re.search(r"^# \*\*Learning intentions\.\*\* After this page you can$", head, re.M)
    assert len(re.findall(r"^# - ", head, re.MULTILINE)) >= 3
    before = re.search(r"\*\*Before this lesson:\*\*(.+?)\*\*Time:\*\* (\d+) minutes\.", head, re.S)
    assert before
    needed = LINK.findall(before[1])
    assert needed or lesson == LESSONS[0]
    assert all(name < lesson.name for name in needed)


def test_links_lead_to_lessons(text: str) -> None:
    names = {path.name for path in LESSONS}
    assert [name for name in LINK.findall(text) if name not in names] == []


def test_page_of_lessons_says_the_same(lesson: Path, text: str) -> None:
    """Its title or a short form of it leads to the lesson, with the minutes that it states."""
    (minutes,) = re.findall(r"\*\*Time:\*\* (\d+) minutes\.", text)
    page = (ROOT / "docs" / "lessons.md").read_text("utf-8")
    (row,) = re.findall(rf"^\| .*\(\.\./examples/{lesson.name}\).*$", page, re.MULTILINE)
    assert row.startswith(f"| {lesson.name[:2]} |")
    assert f"| {minutes} |" in row


def test_asks_before_it_shows(text: str) -> None:
    """At least twice, in a text that code follows."""
    marked = cells(text)
    asked = [number for number, (_, cell) in enumerate(marked) if "**Before you run:**" in cell]
    assert len(asked) >= 2
    assert all(marked[number + 1][0] == "" for number in asked)


def test_shows_a_picture(text: str) -> None:
    """A notebook shows only what stands last in its cell."""
    shown = 0
    for mark, cell in cells(text):
        if not mark:
            *others, last = ast.parse(cell).body
            calls = [each.value for each in others if isinstance(each, ast.Expr)]
            names = {ast.unparse(each.func) for each in calls if isinstance(each, ast.Call)}
            assert {name.rpartition(".")[2] for name in names} <= MAKES_NO_PICTURE
            assert all(isinstance(each, ast.Call) for each in calls)
            shown += isinstance(last, ast.Expr) and "print" not in ast.unparse(last.value)
    assert shown >= 1


def test_pins_nothing(tree: ast.Module) -> None:
    """Who changes a number sees what follows from it; figures are checked in `test_figures`."""
    assert [node for node in ast.walk(tree) if isinstance(node, ast.Assert)] == []


def test_has_a_test_of_its_figures(lesson: Path) -> None:
    tests = (Path(__file__).parent / "test_figures.py").read_text("utf-8")
    assert f"\ndef test_{lesson.stem}(" in tests


def test_has_few_exercises(lesson: Path) -> None:
    """Lessons on tools alone have none."""
    number = lesson.name[:2]
    allowed = {0} if number in {"23", "25", "27"} else {1, 2, 3}
    assert len(exercises.numbers(number)) in allowed


def texts(node: ast.AST) -> Iterator[str]:
    """Texts that stand in an expression as they are; how a number is formatted is none of them."""
    if isinstance(node, ast.FormattedValue):
        yield from texts(node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    else:
        for child in ast.iter_child_nodes(node):
            yield from texts(child)


def test_prints_no_number_that_it_did_not_compute(tree: ast.Module) -> None:
    """Neither in the texts that are printed nor as an argument of print."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    printed = [each for call in calls if ast.unparse(call.func) == "print" for each in call.args]
    assert [text for each in printed for text in texts(each) if NUMBER.search(text)] == []
    bare = [each for each in printed if isinstance(each, ast.Constant)]
    assert all(isinstance(each.value, str) for each in bare)
