"""Several files of measurements, and what is wrong with any of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TypeVar

from optuav.calibration.data import LINE
from optuav.errors import Fault, InputError
from optuav.mission.files import label

Read = TypeVar("Read")
MOST_LINES = 5
"""Lines with one and the same fault that are named."""


def together(paths: Iterable[str | Path], read: Callable[[Path], Read]) -> list[Read]:
    """Read several files, and tell the faults of all of them at once, equal ones as one.

    Raises
    ------
    InputError
        With these faults, if a file is named twice, or if none is.
    """
    found, faults = list[Read](), list[Fault]()
    first: dict[str, Path] = {}
    for path in map(Path, paths):
        other = first.setdefault(os.path.realpath(path), path)
        if other is not path:
            faults.append(
                Fault("", "", f"is the file {label(other)} again: name it once", label(path))
            )
            continue
        try:
            found.append(read(path))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(_counted(faults))
    if not found:
        raise InputError("no file of measurements was named")
    return found


def copies(paths: Iterable[Path]) -> Iterator[str]:
    """A sentence for every file that has the very bytes of one before it."""
    first: dict[bytes, Path] = {}
    for path in paths:
        other = first.setdefault(sha256(path.read_bytes()).digest(), path)
        if other is not path:
            yield (
                f"{label(path)} has the same content as {label(other)}: measurements that are "
                "counted twice make the intervals too narrow"
            )


def _counted(faults: Iterable[Fault]) -> Iterator[Fault]:
    """Those that differ by their line alone as one that names the lines."""
    alike: dict[Fault, list[str]] = {}
    for fault in faults:
        file, _, line = fault.source.partition(LINE)
        alike.setdefault(replace(fault, source=file), []).append(line)
    for fault, lines in alike.items():
        yield replace(fault, source=f"{fault.source}{_named(lines)}") if any(lines) else fault


def _named(lines: Sequence[str]) -> str:
    if len(lines) == 1:
        return f"{LINE}{lines[0]}"
    more = f" and {len(lines) - MOST_LINES} more" if len(lines) > MOST_LINES else ""
    return f", lines {', '.join(lines[:MOST_LINES])}{more}"
