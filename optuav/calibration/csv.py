"""Measurements from CSV files with units in the header, and doubts about those units.

A heading is a quantity and its unit, as in ``time_s,current_A``; lines that start with ``#`` are
remarks. Numbers are returned in SI units.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError
from optuav.mission.files import label, read_text
from optuav.mission.messages import nearest, shown
from optuav.mission.schema import short

Read = TypeVar("Read")

LARGEST_FILE = 50_000_000  # bytes
SIZES = (1e-9, 1e10)  # of a measured value in SI units, unless it is 0; clocks count from 1970
WIDEST_STEP = 10.0  # longest step of a record, in median steps, that is not a gap
MOST_VALUES, MOST_RUNS = 5, 5  # wrong values and runs of lines that a fault lists

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
"""SI value of each unit, by kind of quantity; a balance shows thrust in grams."""


class Column(NamedTuple):
    """A column that a file may have: its quantity, and a key of `UNITS`.

    Empty cells, where `blanks` allows them, are read as NaN.
    """

    name: str
    kind: str
    needed: bool = True
    blanks: bool = False

    @property
    def headings(self) -> Mapping[str, float]:
        """The headings that the column may have, each with the SI value of its unit."""
        return {f"{self.name}_{unit}".rstrip("_"): size for unit, size in UNITS[self.kind].items()}

    def resembles(self, heading: str) -> bool:
        """Whether a heading names the quantity, with whatever unit."""
        return f"{heading}_".startswith(f"{self.name}_")


class Format(NamedTuple):
    """The columns of a file, and the fewest lines that are enough."""

    columns: tuple[Column, ...]
    least: int = 1


@dataclass(frozen=True)
class Measurements:
    """A file: its name, the line number of each row, and its columns in SI units by quantity."""

    source: str
    lines: tuple[int, ...]
    numbers: Mapping[str, Floats]
    texts: Mapping[str, tuple[str, ...]]

    def faults(
        self,
        wrong: Booleans,
        key: str,
        allowed: str,
        value: Callable[[int], str] | None = None,
    ) -> Iterator[Fault]:
        """At most one fault, for all rows that break a rule."""
        rows = np.flatnonzero(wrong).tolist()
        value = value or (lambda row: f"{self.numbers[key][row]:g}".replace("nan", "an empty cell"))
        if rows:
            lines = [(self.lines[row], value(row)) for row in rows]
            yield _fault(self.source, key, allowed, lines)


def read(path: Path, *formats: Format) -> Measurements:
    """Read a CSV file in UTF-8, in that of the formats to which most of its headings belong.

    Raises
    ------
    InputError
        With every fault of header and cells.
    """
    (header_line, headings), *rows = _rows(path)
    columns, least = max(
        formats,
        key=lambda each: sum(
            any(column.resembles(heading) for column in each.columns) for heading in headings
        ),
    )
    source = label(path)
    places, faults = _places(f"{source}, line {header_line}", headings, columns)
    uneven = [(line, str(len(cells))) for line, cells in rows if len(cells) != len(headings)]
    if uneven:
        words = f"as many as in the header, {len(headings)}"
        faults.append(_fault(source, "cells", words, uneven))
    even = [(line, cells) for line, cells in rows if len(cells) == len(headings)]
    numbers, texts = dict[str, Floats](), dict[str, tuple[str, ...]]()
    for place, column in places.items():
        heading, found = headings[place], list[float]()
        broken: dict[str, list[tuple[int, str]]] = {}
        for line, cells in even:
            parsed = _parsed(cells[place], column, heading)
            if isinstance(parsed, str):
                broken.setdefault(parsed, []).append((line, cells[place] or "an empty cell"))
            else:
                found.append(parsed)
        faults += [_fault(source, heading, *each) for each in broken.items()]
        if column.kind == "text":
            texts[column.name] = tuple(cells[place] for _, cells in even)
        else:
            numbers[column.name] = np.array(found)
    if len(rows) < least:
        words = f"at least {least} line{'s' * (least > 1)} of measurements; there are {len(rows)}"
        faults.append(Fault("", "", words, source))
    if faults:
        raise InputError(faults)
    return Measurements(source, tuple(line for line, _ in even), numbers, texts)


def clock_faults(table: Measurements) -> Iterator[Fault]:
    """The lines of a record at which time stands still or runs backwards."""
    time_s = table.numbers["time"]
    steps_s = np.diff(time_s, prepend=-math.inf)
    for wrong, does in ((steps_s == 0.0, "stands still"), (steps_s < 0.0, "runs backwards")):
        words = f"later than the line before; time {does}"
        yield from table.faults(wrong, "time", words, lambda row: f"{time_s[row]:g} s")


def gaps(table: Measurements) -> Iterator[Fault]:
    """The lines of a record that come too long after the line before."""
    time_s = table.numbers["time"]
    usual_s = float(np.median(np.diff(time_s)))
    if usual_s > 0.0:
        late = np.diff(time_s, prepend=time_s[0]) > WIDEST_STEP * usual_s
        words = f"no gap of more than {WIDEST_STEP:g} usual steps of {usual_s:g} s"
        after = "{:g} s after {:g} s".format
        yield from table.faults(
            late, "time", words, lambda row: after(time_s[row], time_s[row - 1])
        )


def read_all(files: Iterable[str | Path], one: Callable[[Path], Read]) -> list[Read]:
    """What `one` reads from each file.

    Raises
    ------
    InputError
        With the faults of all files, also where two have the same content, or if none is named.
    """
    found, faults = list[Read](), list[Fault]()
    first: dict[bytes, Path] = {}
    for path in map(Path, files):
        try:
            found.append(one(path))
        except InputError as error:
            faults += error.faults
            continue
        other = first.setdefault(sha256(path.read_bytes()).digest(), path)
        if other is not path:
            words = f"has the content of {label(other)}: name each measurement once"
            faults.append(Fault("", "", words, label(path)))
    if faults:
        raise InputError(faults)
    if not found:
        raise InputError("no file of measurements was named")
    return found


USUAL: Mapping[str, tuple[float, float, str, str]] = {
    "current": (0.01, 2e3, "A", "current"),
    "voltage": (1.0, 2e3, "V", "voltage"),
    "speed": (0.0, 300.0, "m/s", "speed"),
    "rotor speed": (10.0, 5e3, "rad/s", "speed"),
    "thrust per power": (0.003, 0.5, "N/W", "thrust"),
    "radius": (0.005, 3.0, "m", "radius"),
    "air density": (0.1, 3.0, "kg/m3", "air_density"),
    "resistance": (1e-3, 20.0, "ohm", "resistance"),
    "lifetime": (60.0, 1e6, "s", "lifetime"),
}
"""Least and most that UAVs show, from some grams to those that carry people; unit and column."""
KINDS = {"thrust per power": "force", "radius": "length", "air density": "density"}
KINDS |= {"lifetime": "time"}  # of the other quantities the kind has the same name


def unit_doubts(when: str, sizes: Mapping[str, float]) -> Iterator[str]:
    """A warning for every size (by a key of `USUAL`, in SI units) that no UAV has.

    Most such numbers are in another unit than their column says; the warning names those units in
    which the number would be usual.
    """
    for quantity, size in sizes.items():
        least, most, unit, name = USUAL[quantity]
        if least <= size <= most:
            continue
        units = UNITS[KINDS.get(quantity, quantity)]
        meant = [each for each, worth in units.items() if least <= size * worth <= most]
        words = " or ".join(filter(None, [", ".join(meant[:-1]), *meant[-1:]]))
        hint = (
            f"; under {name}_{next(iter(units))} it may be {words} that is meant" if meant else ""
        )
        yield (
            f"the {quantity} {when} is {size:.5g} {unit}, where that of a UAV is {short(least)} to "
            f"{short(most)} {unit}: look at the units in the names of the columns{hint}"
        )


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of every line that is neither empty nor a remark."""
    found = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(read_text(path, LARGEST_FILE).splitlines(), start=1)
        if line.strip(" ,\t") and not line.startswith("#")
    ]
    if not found:
        raise InputError([Fault("", "", "a header and lines of measurements", label(path))])
    return found


def _places(
    source: str, headings: Sequence[str], columns: Sequence[Column]
) -> tuple[dict[int, Column], list[Fault]]:
    """The column at each place of the header, and the header's faults."""
    if len(headings) == 1 and any(mark in headings[0] for mark in ";\t"):
        return {}, [Fault("columns", shown(headings[0]), "commas between the columns", source)]
    known = {heading: column for column in columns for heading in column.headings}
    found, unclear, faults = dict[int, Column](), set[str](), list[Fault]()
    for place, heading in enumerate(headings):
        column = known.get(heading)
        if column is None:
            like = [each for each in columns if each.resembles(heading)]
            unclear |= {each.name for each in like}
            words = (
                f"a unit that belongs to it, {' or '.join(like[0].headings)}"
                if like
                else f"a column that is known{nearest(heading, known)}; "
                f"known are {', '.join(known)}"
            )
            faults.append(Fault("column", shown(heading), words, source))
        elif column in found.values():
            faults.append(Fault(heading, "", f"a second column of {column.name}", source))
        else:
            found[place] = column
    named = unclear | {column.name for column in found.values()}
    faults += [
        Fault("", "", f"there is no column {' or '.join(column.headings)}", source)
        for column in columns
        if column.needed and column.name not in named
    ]
    return found, faults


def _parsed(cell: str, column: Column, heading: str) -> float | str:
    """The number in a cell in SI units, NaN for a word; or what the cell should have been."""
    if column.kind == "text":
        return math.nan if cell else "a word"
    if not cell and column.blanks:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        return f"a finite number, as {heading}"
    value *= column.headings[heading]
    least, most = SIZES
    usable = value == 0.0 or least <= abs(value) <= most
    return value if usable else f"0, or {least:g} to {most:g} in size"


def _fault(source: str, key: str, allowed: str, wrong: Sequence[tuple[int, str]]) -> Fault:
    """One fault for all lines, with their values, that break a rule."""
    values = list(dict.fromkeys(value for _, value in wrong))
    if len(values) > MOST_VALUES:
        values = [values[0], "…", values[-1]]
    numbers = np.array([line for line, _ in wrong])
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    named = [f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs]
    more = sum(map(len, runs[MOST_RUNS:]))
    lines = f"{', '.join(named[:MOST_RUNS])}{f' and {more} more' if more else ''}"
    return Fault(key, ", ".join(values), allowed, f"{source}, line{'s' * (len(wrong) > 1)} {lines}")
