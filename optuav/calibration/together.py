"""Several files of measurements, and what is wrong with any of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from optuav.calibration.data import LINE
from optuav.errors import Fault, InputError

Read = TypeVar("Read")
MOST_LINES = 5
"""Lines with one and the same fault that are named."""


def together(paths: Iterable[str | Path], read: Callable[[Path], Read]) -> list[Read]:
    """Read several files, and tell the faults of all of them at once, equal ones as one."""
    found, faults = list[Read](), list[Fault]()
    for path in paths:
        try:
            found.append(read(Path(path)))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(_counted(faults))
    if not found:
        raise InputError("no file of measurements was named")
    return found


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
