"""Measurements from CSV files: one line of names with units, every fault told at once.

A column is a quantity and its unit, as in ``time_s,current_A``; lines that start with ``#`` are
remarks. Values come out in SI units.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError
from optuav.mission.files import label, read_text
from optuav.mission.words import nearest, shown

LARGEST_FILE = 50_000_000
"""Most bytes that a file of measurements may have."""

SIZES = (1e-9, 1e10)
"""Between which sizes a measured value lies in SI units, unless it is 0; clocks count from 1970."""

GRAVITY_N_KG = 9.80665
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "power": {"W": 1.0, "kW": 1e3},
    "speed": {"m_s": 1.0, "km_h": 1 / 3.6},
    "rotor speed": {"rad_s": 1.0, "rpm": math.tau / 60.0},
    "force": {"N": 1.0, "g": 1e-3 * GRAVITY_N_KG, "kg": GRAVITY_N_KG},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254},
    "density": {"kg_m3": 1.0},
    "resistance": {"ohm": 1.0, "mohm": 1e-3},
    "velocity constant": {"rpm_V": 1.0},
    "number": {"": 1.0},
    "text": {"": 1.0},
}
"""What a unit is worth in SI units, by kind of quantity; grams of thrust are those of a balance."""

LINE = ", line "
"""Between the file and the line of a fault."""

WIDEST_STEP = 10.0
"""Longest step between lines of a record, in median steps, that is no gap."""


@dataclass(frozen=True)
class Column:
    """A column that a file may have.

    Parameters
    ----------
    name
        The quantity, without its unit.
    kind
        A key of `UNITS`.
    needed
        Whether the file must have it.
    blanks
        Whether its cells may be empty; they read as NaN.
    """

    name: str
    kind: str
    needed: bool = True
    blanks: bool = False

    @property
    def headings(self) -> Mapping[str, float]:
        """What the column may be called, and what its unit is worth."""
        return {f"{self.name}_{unit}".rstrip("_"): size for unit, size in UNITS[self.kind].items()}

    @property
    def words(self) -> str:
        """The headings as a person lists them."""
        return " or ".join(self.headings)


@dataclass(frozen=True)
class Table:
    """A file of measurements.

    Parameters
    ----------
    source
        Path of the file, fit to print.
    lines
        Number of every line in the file.
    numbers
        Column by name of the quantity, SI units.
    texts
        Columns of text.
    """

    source: str
    lines: tuple[int, ...]
    numbers: Mapping[str, Floats]
    texts: Mapping[str, tuple[str, ...]]

    def fault(self, row: int, key: str, value: object, allowed: str) -> Fault:
        """What is wrong in a row."""
        text = value if isinstance(value, str) else f"{value:g}"
        return Fault(key, text, allowed, f"{self.source}{LINE}{self.lines[row]}")

    def faults(self, wrong: Booleans, key: str, allowed: str) -> Iterator[Fault]:
        """What is wrong in the rows of a column of numbers."""
        for row in np.flatnonzero(wrong).tolist():
            yield self.fault(row, key, float(self.numbers[key][row]), allowed)


def headings_of(path: Path) -> list[str]:
    """The names in the header of a file."""
    return _rows(path)[0][1]


def read(path: Path, columns: Sequence[Column], least: int = 1) -> Table:
    """Read a file of measurements.

    Parameters
    ----------
    path
        A CSV file in UTF-8, commas between its cells.
    columns
        The columns it may have.
    least
        Fewest lines that are enough.

    Raises
    ------
    InputError
        With every fault of header and cells.
    """
    (header_line, headings), *rows = _rows(path)
    source, faults = label(path), list[Fault]()
    places = _places(f"{source}{LINE}{header_line}", headings, columns, faults)
    cells: dict[str, list[float | str]] = {name: [] for name in places}
    lines = []
    for line, row in rows:
        where = f"{source}{LINE}{line}"
        if len(row) != len(headings):
            words = f"as many as in the header, {len(headings)}"
            faults.append(Fault("cells", f"{len(row)}", words, where))
            continue
        lines.append(line)
        for name, (place, column, size) in places.items():
            value = _value(row[place], column, size)
            if value is None:
                gap = "an empty cell" if not row[place] else row[place]
                words = _allowed(row[place], headings[place], column)
                faults.append(Fault(headings[place], gap, words, where))
            else:
                cells[name].append(value)
    if len(rows) < least:
        words = f"at least {least} line{'s' * (least > 1)} of measurements; there are {len(rows)}"
        faults.append(Fault("", "", words, source))
    if faults:
        raise InputError(faults)
    texts = {name for name, (_, column, _) in places.items() if column.kind == "text"}
    return Table(
        source,
        tuple(lines),
        {name: np.array(cells[name], dtype=float) for name in places if name not in texts},
        {name: tuple(map(str, cells[name])) for name in texts},
    )


def check_record(table: Table) -> None:
    """Refuse a record over time whose clock stands still or runs back, or that has a gap.

    Raises
    ------
    InputError
        Naming every such line.
    """
    faults = [*clock_faults(table), *gaps(table)]
    if faults:
        raise InputError(faults)


def clock_faults(table: Table) -> Iterator[Fault]:
    """Every line at which the clock stands still or runs back."""
    time_s = table.numbers["time"]
    steps_s = np.diff(time_s)
    for row in (np.flatnonzero(steps_s <= 0.0) + 1).tolist():
        does = "runs backwards" if steps_s[row - 1] < 0.0 else "stands still"
        words = f"later than the line before; time {does}"
        yield table.fault(row, "time", f"{time_s[row]:g} s", words)


def gaps(table: Table) -> Iterator[Fault]:
    """Every line that is late."""
    time_s = table.numbers["time"]
    steps_s = np.diff(time_s)
    usual_s = float(np.median(steps_s))
    if usual_s > 0.0:
        for row in (np.flatnonzero(steps_s > WIDEST_STEP * usual_s) + 1).tolist():
            value = f"{time_s[row]:g} s after {time_s[row - 1]:g} s"
            words = f"no gap of more than {WIDEST_STEP:g} usual steps of {usual_s:g} s"
            yield table.fault(row, "time", value, words)


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of every line that says something."""
    found = []
    for number, line in enumerate(read_text(path, LARGEST_FILE).splitlines(), start=1):
        if line.strip(" ,\t") and not line.startswith("#"):
            cells = next(csv.reader([line]))
            found.append((number, [cell.strip() for cell in cells]))
    if not found:
        raise InputError([Fault("", "", "a header and lines of measurements", label(path))])
    return found


def _places(
    where: str, headings: Sequence[str], columns: Sequence[Column], faults: list[Fault]
) -> dict[str, tuple[int, Column, float]]:
    """Place, column and size of the unit by name of the quantity."""
    known = {heading: column for column in columns for heading in column.headings}
    found: dict[str, tuple[int, Column, float]] = {}
    if len(headings) == 1 and any(mark in headings[0] for mark in ";\t"):
        faults.append(Fault("columns", shown(headings[0]), "commas between the columns", where))
        return found
    unclear = set()
    for place, heading in enumerate(headings):
        column = known.get(heading)
        if column is None:
            meant = [each for each in columns if heading.partition("_")[0] == each.name]
            meant = meant or [each for each in columns if heading.startswith(f"{each.name}_")]
            unclear |= {each.name for each in meant}
            words = (
                f"a unit that belongs to it, {meant[0].words}"
                if meant
                else f"a column that is known{nearest(heading, known)}; "
                f"known are {', '.join(known)}"
            )
            faults.append(Fault("column", shown(heading), words, where))
        elif column.name in found:
            faults.append(Fault(heading, "", f"a second column of {column.name}", where))
        else:
            found[column.name] = (place, column, column.headings[heading])
    faults += [
        Fault("", "", f"there is no column {column.words}", where)
        for column in columns
        if column.needed and column.name not in found and column.name not in unclear
    ]
    return found


def _value(cell: str, column: Column, size: float) -> float | str | None:
    """What a cell says in SI units; None where it says nothing useful, or nothing measured."""
    if not cell and column.blanks:
        return math.nan
    if column.kind == "text":
        return cell or None
    try:
        value = size * float(cell)
    except ValueError:
        return None
    return value if value == 0.0 or SIZES[0] <= abs(value) <= SIZES[1] else None


def _allowed(cell: str, heading: str, column: Column) -> str:
    """What a cell should have said."""
    if column.kind == "text":
        return "a word"
    try:
        finite = math.isfinite(float(cell))
    except ValueError:
        finite = False
    least, most = SIZES
    return f"0, or {least:g} to {most:g} in size" if finite else f"a finite number, as {heading}"
