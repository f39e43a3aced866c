"""Mission files in TOML: read with the files that they extend, and the schema for editors."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError
from optuav.mission.files import label, read_toml
from optuav.mission.messages import nearest, safe_name, shown
from optuav.mission.mission import Mission, overlay
from optuav.mission.validation import Document, Key, StatedMission, format_breaches, validate

LARGEST_FILE = 2_000_000
"""Most bytes that a mission file may have."""

LONGEST_CHAIN = 32
"""Most files that may extend one another."""

_HERE = Path(__file__).parent
SHIPPED = dict(sorted((path.stem, path) for path in (_HERE / "shipped").iterdir()))
"""The missions that come with the package, by name."""


@dataclass(frozen=True)
class _File:
    """A mission file, valid or not."""

    path: Path
    source: str
    document: Document  # Without the keys that concern the file as such
    extends: Any
    faults: list[Fault]  # What is wrong with the version of the format


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
    (first, *others), broken = _chain(source)
    document, gone = dict[str, Any](), dict[Key, str]()
    sources: dict[Key, str] = {}
    for file in (*reversed(others), first):
        sources[()] = file.source
        for name, table in file.document.items():
            keys = table if isinstance(table, dict) else ()
            sources |= dict.fromkeys([(name,), *((name, key) for key in keys)], file.source)
        if document:
            document, more = overlay(document, file.document)
            gone |= more
        else:
            document = file.document
    document.setdefault("name", safe_name(first.path.stem))
    faults = [*broken, *(fault for file in (first, *others) for fault in file.faults)]
    return validate(Mission, StatedMission(document, sources, gone), faults, whole=not broken)


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
    return tuple(SHIPPED)


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
    while (extends := files[-1].extends) is not None:
        try:
            if not isinstance(extends, str):
                raise InputError("a shipped mission's name or a path relative to this file")
            if len(files) == LONGEST_CHAIN:
                raise InputError(f"a chain of at most {LONGEST_CHAIN} files")
            base = _read(extends, files[-1].path.parent)
            if os.path.realpath(base.path) in [os.path.realpath(each.path) for each in files]:
                circle = " -> ".join(each.source for each in (*files, base))
                raise InputError(f"a file that does not lead back to one before it: {circle}")
        except InputError as error:
            return files, [Fault("extends", shown(extends), str(error), files[-1].source)]
        for key in ("name", "description"):  # which are a file's own
            base.document.pop(key, None)
        files.append(base)
    return files, []


def _read(source: str | Path, directory: Path) -> _File:
    """A shipped mission's file, or one in a directory."""
    if path := SHIPPED.get(str(source)) if isinstance(source, str) else None:
        name, hint = str(source), ""
    else:
        path = directory / source
        name = label(path)
        hint = nearest(path.name, SHIPPED) or f"; shipped missions are {', '.join(SHIPPED)}"
    document = read_toml(path, LARGEST_FILE, hint=hint)
    faults = []
    if breaches := format_breaches(document):
        faults = StatedMission(document, {(): name}).faults(breaches)
    document.pop("schema", None)
    return _File(path, name, document, document.pop("extends", None), faults)
