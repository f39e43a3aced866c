"""The worked solutions of the exercises, as they stand in the lessons."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parents[2]


def script(name: str) -> ModuleType:
    """Return a script of the documentation as a module."""
    if str(ROOT / "docs") not in sys.path:
        sys.path.append(str(ROOT / "docs"))
    return importlib.import_module(name)


def editions() -> ModuleType:
    """Return ``docs/make_lessons.py``."""
    return script("make_lessons")


@cache
def sections() -> Mapping[str, list[str]]:
    """Return the cells of code of the exercises of every lesson that has some, by its stem."""
    paths = sorted((ROOT / "examples").glob("*.py"))
    found = {path.stem: script("make_keys").exercise_cells(path) for path in paths}
    return {name: cells for name, cells in found.items() if cells}


def worked(number: str, student: str = "") -> Any:
    """Return the answer of the worked solution of an exercise to a student's numbers."""
    return _answers(number.partition(".")[0], student)[number]


@cache
def _answers(lesson: str, student: str) -> Mapping[str, Any]:
    """Return the answers of a lesson's worked solutions by number, as the keys have them."""
    keys = script("make_keys").keys([student], [lesson])
    return {number: answer for _, number, answer in keys}
