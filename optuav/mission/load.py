"""Mission files in TOML: read with the files that they extend, and the schema for editors."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError
from optuav.mission.files import label, read_text, refusal
from optuav.mission.messages import (
    Document,
    Key,
    StatedMission,
    nearest,
    printable,
    shortened,
    shown,
)
from optuav.mission.mission import Mission
from optuav.mission.overlay import displaced, overlay
from optuav.mission.validation import format_breaches, validate

LARGEST_FILE = 2_000_000
"""Most bytes that a mission file may have."""

LONGEST_CHAIN = 32
"""Most files that may extend one another."""

_HERE = Path(__file__).parent
_SHIPPED = _HERE / "shipped"

# tomllib's time grows with the square of the parts of a dotted key.
_PART = r"""(?>[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*"""
_DEEP_KEY = re.compile(rf"(?<![\w-])(?>{_PART}\.[ \t]*){{32}}", re.ASCII)


@dataclass(frozen=True)
class _File:
    """A mission file, valid or not."""

    path: Path
    source: str
    document: Document
    """The tables, without the keys that concern the file as such."""
    extends: Any
    faults: list[Fault]
    """What is wrong with the version of the format."""


def load(source: str | Path) -> Mission:
    """Read a mission.

    Parameters
    ----------
    source
        Name of a shipped mission, as `shipped` lists them, or path of a TOML file. A file that
        ``extends`` another (a shipped name or a path relative to the file) takes from it all that
        it does not state itself, except name and description; `Mission.replace` lists what a
        stated value displaces.

    Returns
    -------
    Mission
        The mission; it has the name of the file if the file states none.

    Raises
    ------
    InputError
        With every fault of the file and of those that it extends.

    Examples
    --------
    >>> import optuav
    >>> mission = optuav.load("paper")
    >>> mission.limits.deadline_s
    1200.0
    >>> optuav.load("papr")
    Traceback (most recent call last):
    optuav.errors.InputError: papr: there is no such file; did you mean 'paper'?
    """
    if not isinstance(source, str | Path):
        raise InputError([Fault("", shown(source), "a shipped mission's name or a file's path")])
    files, broken = _chain(source)
    document: Document = {}
    sources: dict[Key, str] = {}
    gone: dict[Key, str] = {}
    for file in reversed(files):
        sources[()] = file.source
        for name, table in file.document.items():
            sources[name,] = file.source
            sources |= {
                (name, key): file.source for key in (table if isinstance(table, dict) else ())
            }
        gone |= displaced(document, file.document)
        document = overlay(document, file.document)
    document.setdefault("name", shortened(printable(files[0].path.stem)))
    faults = [*broken, *(fault for file in files for fault in file.faults)]
    return validate(Mission, StatedMission(document, sources, gone), faults, whole=not broken)


@cache
def shipped() -> tuple[str, ...]:
    """Names of the missions that come with the package, in alphabetical order.

    Returns
    -------
    tuple of str
        Names that `load` takes.

    Examples
    --------
    >>> import optuav
    >>> optuav.shipped()
    ('matrice350', 'paper', 'paper-table2')
    """
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.toml")))


def json_schema() -> Document:
    """JSON Schema (draft 7) of the files that `load` reads.

    A file without ``extends`` has to state what a mission needs, one with it needs no more than
    ``schema``. Rules between values (names, footprints, altitudes, loads of the flight models)
    are left to `load`.

    Returns
    -------
    dict
        The schema as plain data.

    Examples
    --------
    >>> import optuav
    >>> schema = optuav.json_schema()
    >>> schema["definitions"]["Limits"]["properties"]["deadline_s"]["maximum"]
    10000000.0
    """
    schema: Document = json.loads((_HERE / "mission.schema.json").read_text("utf-8"))
    return schema


def _chain(source: str | Path) -> tuple[list[_File], list[Fault]]:
    """The file, the one it extends and so on; and why the chain breaks off, if it does."""
    files = [_read(source, Path())]
    while files[-1].extends is not None:
        try:
            files.append(_base(files))
        except InputError as error:
            file = files[-1]
            return files, [Fault("extends", shown(file.extends), str(error), file.source)]
    return files, []


def _base(files: Sequence[_File]) -> _File:
    """What the last of the files extends; name and description are a file's own."""
    extends = files[-1].extends
    if not isinstance(extends, str):
        raise InputError("a shipped mission's name or a path relative to this file")
    if len(files) == LONGEST_CHAIN:
        raise InputError(f"a chain of at most {LONGEST_CHAIN} files")
    base = _read(extends, files[-1].path.parent)
    if any(os.path.realpath(base.path) == os.path.realpath(file.path) for file in files):
        circle = " -> ".join(file.source for file in (*files, base))
        raise InputError(f"a file that does not lead back to one before it: {circle}")
    for key in ("name", "description"):
        base.document.pop(key, None)
    return base


def _read(source: str | Path, directory: Path) -> _File:
    path, name, hint = _SHIPPED / f"{source}.toml", str(source), ""
    if source not in shipped():
        path = directory / source
        name, others = label(path), ", ".join(shipped())
        hint = nearest(path.name, shipped()) or f"; shipped missions are {others}"
    document = parse(read_text(path, LARGEST_FILE, hint=hint), path)
    faults = StatedMission(document, {(): name}).faults(format_breaches(document))
    document.pop("schema", None)
    return _File(path, name, document, document.pop("extends", None), faults)


def parse(text: str, path: Path) -> Document:
    """The tables of a TOML file, or an `InputError` if it is none or nested too deeply."""
    if _DEEP_KEY.search(text):
        raise refusal(path, "has a dotted name of more than 32 parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise refusal(path, "is nested too deeply") from None
    except ValueError as error:
        raise refusal(path, f"is not TOML: {shortened(printable(str(error)))}") from None
