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


@cache
def answers(student: str) -> Mapping[str, Any]:
    """The answers of the worked solutions to a student's numbers, by number of the exercise."""
    found = {}
    for name, cells in sections().items():
        space: dict[str, Any] = {"optuav": optuav}
        with redirect_stdout(io.StringIO()):
            for source in cells:
                exec(source.replace('student = ""', f"student = {student!r}"), space)
                if check := editions().CHECK.search(source):
                    found[check[2]] = space[check[3]]
        assert all(number.startswith(name.split("_")[0]) for number in space.get("numbers", ()))
    return found
