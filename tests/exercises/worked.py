"""The worked solutions of the exercises, as they stand in the lessons."""

from __future__ import annotations

import importlib.util
import io
import sys
from collections.abc import Mapping
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import optuav

ROOT = Path(__file__).parents[2]


@cache
def editions() -> ModuleType:
    """``docs/make_lessons.py``."""
    path = ROOT / "docs" / "make_lessons.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # Its dataclasses look for it there
    spec.loader.exec_module(module)
    return module


@cache
def sections() -> Mapping[str, list[str]]:
    """Of every lesson with exercises the cells of code from their heading on, by its stem."""
    found = {}
    for path in sorted((ROOT / "examples").glob("*.py")):
        cells = editions().cells(path.read_text("utf-8"))
        headed = [k for k, each in enumerate(cells) if each.source.startswith("## Exercises\n")]
        if headed:
            found[path.stem] = [each.source for each in cells[headed[0] :] if each.kind == "code"]
    return found


def worked(number: str, student: str = "") -> Any:
    """The answer of the worked solution of an exercise to a student's numbers."""
    lesson = number.partition(".")[0]
    (name,) = (each for each in sections() if each.startswith(f"{lesson}_"))
    return _answers(name, student)[number]


@cache
def _answers(name: str, student: str) -> Mapping[str, Any]:
    """The answers of a lesson's worked solutions, by number."""
    space: dict[str, Any] = {"optuav": optuav}
    found = {}
    with redirect_stdout(io.StringIO()):
        for source in sections()[name]:
            exec(source.replace('student = ""', f"student = {student!r}"), space)
            if check := editions().CHECK.search(source):
                found[check[2]] = space[check[3]]
    return found
