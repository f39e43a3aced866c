"""A problem of your own: its Python file is run, and its errors are put into words."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from inspect import isabstract
from types import ModuleType
from typing import TYPE_CHECKING

from optuav.errors import Fault, InputError, OptuavError, nearest

if TYPE_CHECKING:
    from formulations.formulation import Formulation

LARGEST_BYTES = 1_000_000
files: dict[str, str] = {}
"""Files that were run, as Python names them in a traceback, by the name that the user gave."""


def problem_class(stated: str) -> type[Formulation]:
    """Run the file of ``FILE.py:CLASS``, and return its class."""
    from formulations.formulation import Formulation
    from optuav.mission.files import expand_home, read_text

    name, _, kind = stated.rpartition(":")
    if not name.endswith(".py"):
        raise InputError(
            [Fault("--problem", repr(stated), "FILE.py:CLASS, such as mine.py:LeastLaser")]
        )
    path = expand_home(name, "--problem")
    text, place = read_text(path, LARGEST_BYTES), path.resolve()
    files[str(place)], module = name, ModuleType("problem_file")
    sys.modules[module.__name__], module.__file__ = module, str(place)
    # The file may import what lies beside it, but hides nothing that is installed.
    sys.path.append(str(place.parent))
    try:
        program = compile(text, str(place), "exec")
    except (MemoryError, RecursionError, SyntaxError, ValueError) as error:
        raise _refused(error, name, getattr(error, "lineno", None) or 1) from error
    try:
        exec(program, module.__dict__)
    except SystemExit as error:
        raise InputError([Fault("", "", f"ended with {error!r} while it ran", name)]) from error
    classes = {key: value for key, value in vars(module).items() if isinstance(value, type)}
    problems = {
        k: e for k, e in classes.items() if issubclass(e, Formulation) and not isabstract(e)
    }
    if kind not in problems:
        known = f"; it has {', '.join(problems)}" if problems else ""
        words = f"the file has no class of this name that subclasses optuav.Formulation{known}"
        raise InputError([Fault("--problem", repr(stated), words + nearest(kind, problems))])
    return problems[kind]


@contextmanager
def faults_named() -> Iterator[None]:
    """Turn an error in a problem's file into an `InputError` that names its line."""
    try:
        yield
    except Exception as error:
        trace = traceback.extract_tb(error.__traceback__)
        places = [(frame.filename, frame.lineno) for frame in trace]
        known = [(files[file], line) for file, line in places if file in files]
        if not known:
            raise
        name, line = known[-1]
        if isinstance(error, InputError):
            faults = (replace(fault, source=f"{name}, line {line}") for fault in error.faults)
            raise InputError(faults) from error
        if isinstance(error, OptuavError):
            raise
        raise _refused(error, name, line) from error


def _refused(error: Exception, name: str, line: int | None) -> InputError:
    words = f"{type(error).__name__}: {getattr(error, 'msg', error)}"
    return InputError([Fault("", "", words, f"{name}, line {line}")])
