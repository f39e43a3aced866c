"""Makes editions of the lessons from their sources: ``make lessons``.

The source of a lesson is a script in cells, ``examples/*.py``. Its exercises have worked
solutions, in lines between ``### BEGIN SOLUTION`` and ``### END SOLUTION``, and each is followed by
a cell that prints its grade. The student edition, notebooks without solutions, is part of the
package; editions for nbgrader and for Otter, which take the solutions out themselves, go to
``build/lessons``.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
SOURCES = ROOT / "examples"
STUDENT = ROOT / "optuav" / "lessons"
BUILD = ROOT / "build" / "lessons"
BEGIN, END = "### BEGIN SOLUTION", "### END SOLUTION"
LINK = re.compile(r"\]\((\w+)\.py\)")  # From one lesson to another
SOLUTION = re.compile(rf"^ *{BEGIN}\n.*?^ *{END}\n?", re.MULTILINE | re.DOTALL)
PRINTED = re.compile(r"^print\((task|grade)\)$", re.MULTILINE)
CHECK = re.compile(
    r'^(grade = exercises\.check\("([\w.]+)", (\w+), student\))\nprint\(grade\)$', re.MULTILINE
)
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}
NBGRADER = """\
c = get_config()
c.CourseDirectory.course_id = "optuav"
c.ClearSolutions.code_stub = {"python": "# your answer"}
"""
OTTER = "# ASSIGNMENT CONFIG\nexport_cell: false\ntests:\n  ok_format: false"


@dataclass(frozen=True)
class Cell:
    """A cell of a notebook."""

    kind: str  # code, markdown or raw
    source: str
    metadata: dict[str, Any] = field(default_factory=dict)


def cells(text: str) -> list[Cell]:
    """The cells of a script; prose without the marks of comments."""
    content = []
    for part in re.split(r"^# %%", text, flags=re.MULTILINE)[1:]:
        head, _, body = part.partition("\n")
        if head.strip() == "[markdown]":
            prose = re.sub(r"^# ?", "", body.strip("\n"), flags=re.MULTILINE)
            content.append(Cell("markdown", prose))
        else:
            content.append(Cell("code", body.strip("\n")))
    return content


def without_solutions(text: str) -> str:
    """A lesson as students get it."""
    return SOLUTION.sub("", text)


def for_notebooks(text: str) -> str:
    """A lesson as students get it, with tasks and grades that show themselves."""
    return PRINTED.sub(r"\1", without_solutions(text))


def notebook(name: str, content: Iterable[Cell], place: str = r"\1.ipynb") -> str:
    """A notebook without outputs, the same at every run, and the place of other lessons from it."""
    written = [
        {
            "cell_type": cell.kind,
            **({"execution_count": None, "outputs": []} if cell.kind == "code" else {}),
            "id": f"{name.split('_', maxsplit=1)[0]}-{number:02}",
            "metadata": cell.metadata,
            "source": LINK.sub(rf"]({place})", cell.source).splitlines(keepends=True),
        }
        for number, cell in enumerate(content)
    ]
    whole = {
        "cells": [dict(sorted(cell.items())) for cell in written],
        "metadata": {"kernelspec": KERNEL, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def for_nbgrader(content: Sequence[Cell]) -> Iterator[Cell]:
    """Cells with what nbgrader knows of them: answers with solutions, and locked checks."""
    for number, cell in enumerate(content):
        check = CHECK.search(cell.source)
        if BEGIN in cell.source:
            following = CHECK.search(content[number + 1].source)
            assert following, cell.source
            yield _graded(cell.source, f"answer-{_question(following[2])}", solution=True)
        elif check:
            source = f"{cell.source}\nassert grade, grade"
            yield _graded(source, f"check-{_question(check[2])}", solution=False)
        else:
            yield cell


def _graded(source: str, name: str, *, solution: bool) -> Cell:
    known = {"grade": not solution, "grade_id": name, "locked": not solution, "schema_version": 3}
    points = {} if solution else {"points": 1}
    return Cell(
        "code", source, {"nbgrader": {**known, **points, "solution": solution, "task": False}}
    )


def for_otter(content: Sequence[Cell], files: Sequence[str]) -> Iterator[Cell]:
    """Cells with the raw ones between which Otter looks for questions, solutions and tests."""
    listed = ["files:", *(f"  - {file}" for file in files)] if files else []
    yield Cell("raw", "\n".join([OTTER, *listed]))
    for number, cell in enumerate(content):
        check = CHECK.search(cell.source)
        if BEGIN in cell.source:
            following = CHECK.search(content[number + 1].source)
            assert following, cell.source
            source = cell.source.replace(BEGIN, "# BEGIN SOLUTION NO PROMPT")
            yield Cell("raw", f"# BEGIN QUESTION\nname: {_question(following[2])}\npoints: 1")
            yield Cell("raw", "# BEGIN SOLUTION")
            yield Cell("code", source.replace(END, "# END SOLUTION"))
            yield Cell("raw", "# END SOLUTION")
        elif check:
            test = (
                f"def test_{_question(check[2])}({check[3]}, student):\n"
                "    from optuav import exercises\n\n"
                f"    {check[1]}\n"
                "    assert grade, str(grade)"
            )
            yield Cell("raw", "# BEGIN TESTS")
            yield Cell("code", test)
            yield Cell("raw", "# END TESTS")
            yield Cell("raw", "# END QUESTION")
        else:
            yield cell


def _question(number: str) -> str:
    """Number of an exercise as a name, in which a dot is not allowed."""
    return f"q{number.replace('.', '_')}"


def student_files() -> dict[Path, bytes]:
    """The student edition, and the data of the lessons, by place."""
    files = {
        STUDENT / f"{path.stem}.ipynb": notebook(
            path.stem, cells(for_notebooks(path.read_text("utf-8")))
        ).encode()
        for path in sorted(SOURCES.glob("*.py"))
    }
    return files | {STUDENT / path.relative_to(SOURCES): path.read_bytes() for path in data_files()}


def data_files(text: str = '"data"') -> list[Path]:
    """The data that a lesson of this text reads; all of it by default."""
    if '"data"' not in text:
        return []
    return sorted(file for file in (SOURCES / "data").iterdir() if file.suffix in (".csv", ".toml"))


def other_files() -> dict[Path, bytes]:
    """The editions for nbgrader and Otter, by place."""
    files = {BUILD / "nbgrader" / "nbgrader_config.py": NBGRADER.encode()}
    for path in sorted(SOURCES.glob("*.py")):
        content, name = cells(path.read_text("utf-8")), path.stem
        read = data_files(path.read_text("utf-8"))
        course, assignment = BUILD / "otter", BUILD / "nbgrader" / "source" / name
        names = [file.relative_to(SOURCES).as_posix() for file in read]
        cells_for_otter = for_otter(content, names)
        graded = notebook(name, for_nbgrader(content), r"../\1/\1.ipynb")
        files[assignment / f"{name}.ipynb"] = graded.encode()
        files[course / f"{name}.ipynb"] = notebook(name, cells_for_otter).encode()
        for file in read:
            for folder in (course, assignment):
                files[folder / file.relative_to(SOURCES)] = file.read_bytes()
    return files


def main() -> None:
    """Write all editions in the place of those before."""
    for folder in (STUDENT, BUILD):
        shutil.rmtree(folder, ignore_errors=True)
    for path, content in {**student_files(), **other_files()}.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


if __name__ == "__main__":
    main()
