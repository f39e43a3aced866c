"""Print the answers of students' exercises: ``python docs/make_keys.py students.txt 01 04``.

The file has a student per line, by the text that the student gives as ``student``; then come
numbers of lessons. Answers are those of the worked solutions, which stand in ``examples/*.py`` and
in no wheel. They are computed with each student's numbers, and the grader confirms them.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import patch

from make_lessons import SOURCES, cells

import optuav
from optuav import Itinerary, exercises
from optuav.modelling import Model

HEADING = "# %% [markdown]\n# ## Exercises\n"
STUDENT = re.compile(r'^student = ""$', re.MULTILINE)


def keys(students: Sequence[str], lessons: Sequence[str]) -> Iterator[tuple[str, str, object]]:
    """Yield student, number and answer, exercise by exercise for each student."""
    for lesson in lessons:
        (path,) = SOURCES.glob(f"{lesson}_*.py")
        for student in students:
            for number, answer in answers_of(path, student):
                yield student, number, answer


def exercise_cells(path: Path) -> list[str]:
    """Return the cells of code of a lesson's exercises; they need nothing of the lesson."""
    _, heading, exercises_of_lesson = path.read_text("utf-8").partition(HEADING)
    content = cells(f"{heading}{exercises_of_lesson}")
    return [cell.source for cell in content if cell.kind == "code"]


def answers_of(path: Path, student: str) -> list[tuple[str, object]]:
    """Run the worked solutions of a lesson, and return their answers by number."""
    answers = list[tuple[str, object]]()
    names: dict[str, Any] = {"__name__": path.stem, "optuav": optuav}
    check = exercises.check

    def checked(number: str, answer: object, student: str = "") -> exercises.Grade:
        grade = check(number, answer, student)
        assert grade, f"the worked solution fails for {student!r}: {grade}"
        answers.append((number, answer))
        return grade

    with redirect_stdout(StringIO()), patch.object(exercises, "check", checked):
        for source in exercise_cells(path):
            personal = STUDENT.sub(f"student = {student!r}", source)
            exec(compile(personal, str(path), "exec", dont_inherit=True), names)
    return answers


def shown(answer: object) -> str:
    """Return an answer as text: numbers of four decimals at most, and a model in full."""
    if isinstance(answer, bool | str):
        return str(answer)
    if isinstance(answer, int | float):
        return f"{answer:.4f}".rstrip("0").rstrip(".")
    if isinstance(answer, Itinerary):
        return "; ".join(f"{stop.kind} {stop.duration_s:g} s at {stop.at}" for stop in answer.stops)
    if isinstance(answer, tuple | list):
        return ", ".join(map(shown, answer))
    if isinstance(answer, dict):
        return "; ".join(f"{name}: {value}" for name, value in answer.items())
    if isinstance(answer, Model):
        return str(answer)
    if isinstance(answer, type):
        return f"class {answer.__name__}"
    return repr(answer)


if __name__ == "__main__":
    file, *lessons = sys.argv[1:]
    students = [line.strip() for line in Path(file).read_text("utf-8").splitlines() if line.strip()]
    for student, number, answer in keys(students, lessons):
        print(f"{student:16} {number:6} {shown(answer)}")
