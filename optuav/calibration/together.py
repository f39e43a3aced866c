"""Several files of measurements, and what is wrong with any of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from itertools import chain
from pathlib import Path
from typing import TypeVar

from optuav.calibration.data import LINE
from optuav.errors import Fault, InputError
from optuav.mission.files import label

Read = TypeVar("Read")
MOST_RUNS = 5
"""Lines with one and the same fault that are named, or stretches of them."""
MOST_VALUES = 5
"""Values with one and the same fault in a column that are told one by one."""


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
    """Those that differ by their line alone as one, and those of many values in one column too."""
    alike: dict[Fault, dict[str, list[str]]] = {}
    for fault in faults:
        file, _, line = fault.source.partition(LINE)
        kind = replace(fault, source=file, value="")
        alike.setdefault(kind, {}).setdefault(fault.value, []).append(line)
    for fault, lines in alike.items():
        for value, own in (lines if len(lines) <= MOST_VALUES else _as_one(lines)).items():
            where = _named(own) if any(own) else ""
            yield replace(fault, value=value, source=f"{fault.source}{where}")


def _as_one(lines: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """The lines of many values under the first and the last of these."""
    first, *_, last = lines
    return {f"{first}, …, {last}": sorted(chain.from_iterable(lines.values()), key=int)}


def _named(lines: Sequence[str]) -> str:
    """Lines in order, those that follow each other by the first and the last."""
    runs: list[list[int]] = []
    for line in map(int, lines):
        if runs and line == runs[-1][-1] + 1:
            runs[-1].append(line)
        else:
            runs.append([line])
    if len(lines) == 1:
        return f"{LINE}{lines[0]}"
    named = [f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs]
    more = sum(map(len, runs[MOST_RUNS:]))
    return f", lines {', '.join(named[:MOST_RUNS])}{f' and {more} more' if more else ''}"
