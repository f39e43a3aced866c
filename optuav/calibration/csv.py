"""Measurements from CSV files with units in the header, and doubts about those units.

A heading is a quantity and its unit, as in ``time_s,current_A``; lines that start with ``#`` are
remarks. Numbers are returned in SI units.
"""

import hashlib
import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError, collected, decimal, refuse
from optuav.mission.files import csv_rows, label, read_text
from optuav.mission.messages import nearest, paths_of, plural, shown
from optuav.presentation.numbers import figure, short, significant, typed

Read = TypeVar("Read")

LARGEST_FILE = 20_000_000  # bytes
MOST_WRONG = 1000  # Wrong cells after which a file is read no further
SMALLEST, LARGEST = 1e-9, 1e10  # measured values but for 0, in SI units; clocks count from 1970
WIDEST_STEP = 10.0  # longest step of a record, in median steps, that is not a gap
MOST_SUGGESTIONS = 50
MOST_VALUES, MOST_RUNS = 5, 5  # wrong values and runs of lines that a fault lists

GRAVITY_N_KG = 9.80665
SIZES_OF_UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "current": {"A": 1.0, "mA": 1e-3},
    "voltage": {"V": 1.0, "mV": 1e-3},
    "power": {"W": 1.0, "kW": 1e3, "mW": 1e-3},
    "speed": {"m_s": 1.0, "km_h": 1 / 3.6},
    "rotor speed": {"rad_s": 1.0, "rpm": math.tau / 60.0},
    "force": {"N": 1.0, "g": 1e-3 * GRAVITY_N_KG, "kg": GRAVITY_N_KG},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254},
    "density": {"kg_m3": 1.0},
    "resistance": {"ohm": 1.0, "mohm": 1e-3},
    "velocity constant": {"rpm_V": 1.0},
    "thrust coefficient": {"": 1.0, "nD": 4.0 / math.pi**3},
    "torque coefficient": {"": 1.0, "nD": 8.0 / math.pi**3},
    "power coefficient": {"nD": 4.0 / math.pi**4},
    "text": {"": 1.0},
}
"""SI value of each unit, by kind of quantity; a balance shows thrust in grams.

Coefficients by turns a second n and diameter D, T = C_T ρ n² D⁴, Q = C_Q ρ n² D⁵, P = C_P ρ n³ D⁵,
become those by the tip's speed and the disc's area, where C_P = C_Q.
"""
USUAL = {
    "current": (0.01, 2e3, "A"),
    "voltage": (1.0, 2e3, "V"),
    "power": (1.0, 1e6, "W"),
    "speed": (0.0, 300.0, "m/s"),
    "rotor speed": (10.0, 5e3, "rad/s"),
    "length": (0.005, 3.0, "m"),
    "density": (0.1, 3.0, "kg/m3"),
    "resistance": (1e-3, 20.0, "ohm"),
    "thrust coefficient": (0.002, 0.03, ""),
}
"""Least and most that UAVs show, from some grams to those that carry people, and the unit."""
UNKNOWN_IN_UNIT = (-1.0, 65535.0)
UNKNOWN: Mapping[str, tuple[float, ...]] = {
    "current": (-1.0, -0.01, 655.35),
    "voltage": (-1.0, -0.001, 65.535),
    "power": (),
    "speed": (655.35,),
}
"""Values that autopilots log where they know none: −1 or 65535 in the unit of the column or of the
autopilot, which has hundredths and thousandths; the latter in SI units, by kind of quantity."""
SMALL = -0.1  # unknown values between this and 0 may also be those of a sensor that is off
ROUNDED_UNIT = 1e-9  # relative, of a change of units


class Format(NamedTuple):
    """The columns of a file with their kinds, keys of `SIZES_OF_UNITS`, and the fewest lines."""

    kinds: Mapping[str, str]
    optional: tuple[str, ...] = ()  # columns that may be missing
    blanks: tuple[str, ...] = ()  # columns whose empty cells are read as NaN
    least: int = 1
    also: Mapping[str, tuple[str, str]] = {}  # further names, each with its column and its kind
    unread: tuple[str, ...] = ()  # headings of columns that stand beside these and are not read

    @property
    def names(self) -> Iterator[tuple[str, str, str]]:
        """Names of columns, each with its column and its kind."""
        yield from ((column, column, kind) for column, kind in self.kinds.items())
        yield from ((name, *of) for name, of in self.also.items())

    def headings(self, column: str) -> dict[str, float]:
        """The headings that a column may have, each with the SI value of its unit."""
        return {
            f"{name}_{unit}".rstrip("_"): size
            for name, own, kind in self.names
            for unit, size in (SIZES_OF_UNITS[kind].items() if own == column else ())
        }

    def named(self, heading: str) -> str | None:
        """The column that a heading names, with whatever unit."""
        matches = (own for name, own, _ in self.names if f"{heading}_".startswith(f"{name}_"))
        return next(matches, None)


@dataclass(frozen=True)
class Measurements:
    """A file: its name, the line number of each row, and its columns in SI units by quantity."""

    source: str
    kinds: Mapping[str, str]
    sizes: Mapping[str, float]  # SI value of the unit of each column
    lines: tuple[int, ...]
    numbers: Mapping[str, Floats]
    texts: Mapping[str, tuple[str, ...]]
    unread: tuple[str, ...] = ()

    def faults(self, wrong: Booleans, key: str, allowed: str, unit: str = "") -> Iterator[Fault]:
        """At most one fault, for all rows that break a rule."""
        cells = []
        for row in np.flatnonzero(wrong).tolist():
            cell = self.texts[key][row] if key in self.texts else "an empty cell"
            if key in self.numbers and not math.isnan(value := self.numbers[key][row]):
                cell = f"{typed(value, 6)}{unit}"
            cells.append((self.lines[row], cell))
        if cells:
            yield _fault(self.source, key, allowed, cells)

    def unknown(self, column: str) -> Booleans:
        """Return which values of a column only say that the value is unknown.

        A sensor that is off by a little shows several values below 0; then small ones are measured.
        """
        matches = self._matches(column)
        unknown: Booleans = np.any([*matches.values()], axis=0)
        if np.any(self.numbers[column][~unknown] < 0.0):
            unknown = np.any([rows for x, rows in matches.items() if not SMALL < x < 0.0], axis=0)
        return unknown

    def left_out(self, column: str, rows: Booleans) -> Iterator[str]:
        """A sentence for each kind of unknown value, with its count."""
        unit = USUAL[self.kinds[column]][-1]
        for sign, matches in self._matches(column).items():
            if count := int(np.sum(rows & matches)):
                which = f"{count} of {plural(len(rows), 'line')}"
                words = f"their {column} is {typed(sign)} {unit}, which means unknown"
                yield f"{self.source}: {which} {'is' if count == 1 else 'are'} left out: {words}"

    def _matches(self, column: str) -> dict[float, Booleans]:
        """The rows of a column with each value that means unknown, in SI units."""
        of_unit = (self.sizes[column] * value for value in UNKNOWN_IN_UNIT)
        signs = dict.fromkeys(significant(x, 12) for x in (*UNKNOWN[self.kinds[column]], *of_unit))
        values = self.numbers[column]
        return {sign: np.isclose(values, sign, rtol=ROUNDED_UNIT, atol=0.0) for sign in signs}

    def only(self, rows: Booleans) -> "Measurements":
        """The rows that are chosen."""
        chosen = np.flatnonzero(rows).tolist()
        texts = {name: tuple(cells[n] for n in chosen) for name, cells in self.texts.items()}
        numbers = {name: values[rows] for name, values in self.numbers.items()}
        lines = tuple(self.lines[number] for number in chosen)
        return replace(self, lines=lines, numbers=numbers, texts=texts)

    def not_read(self) -> Iterator[str]:
        """A sentence on the columns that are not read, if there are any."""
        if self.unread:
            yield f"{self.source}: columns that are not read: {', '.join(self.unread)}"

    def few(self, column: str, least: int, *reasons: str) -> Iterator[Fault]:
        """A fault, with the reasons, if a column has too few different values."""
        if (count := len(np.unique(self.numbers[column]))) < least:
            words = f"must have at least {least} different {column}s; there are {count}"
            yield Fault("", "", "; ".join([words, *reasons]), self.source)

    def doubts(self) -> Iterator[str]:
        """A warning for each column whose largest size does not suit a UAV."""
        for column, values in self.numbers.items():
            if (kind := self.kinds[column]) in USUAL:
                largest = float(np.max(np.abs(values)))
                yield from unit_doubts(f"the largest {column}", largest, column, kind)


def read(text: str, source: str, formats: Iterable[Format]) -> Measurements:
    """Read a CSV text in the format that most headings belong to, or refuse it."""
    rows = csv_rows(text, source)
    first, headings = next(rows, (0, list[str]()))
    if not headings:
        raise InputError([Fault("", "", "must have a header and lines of measurements", source)])
    form = max(formats, key=lambda each: len([*filter(each.named, headings)]))
    places, faults = _places(f"{source}, line {first}", headings, form)
    lines, uneven = array("l"), list[tuple[int, str]]()
    texts: dict[str, list[str]] = {c: [] for c in places.values() if form.kinds[c] == "text"}
    columns = {column: array("d") for column in places.values() if column not in texts}
    sizes = {c: form.headings(c)[headings[place]] for place, c in places.items()}
    wrong = {place: list[tuple[int, str]]() for place in places}
    for line, cells in rows:
        if len(cells) != len(headings):
            uneven.append((line, str(len(cells))))
        else:
            lines.append(line)
            for place, column in places.items():
                cell = cells[place]
                if column in texts:
                    texts[column].append(cell)
                    is_wrong = not cell
                else:
                    columns[column].append(value := _value(cell, sizes[column]))
                    is_wrong = math.isnan(value) and not (column in form.blanks and not cell)
                if is_wrong:
                    wrong[place].append((line, cell or "an empty cell"))
        if sum(map(len, wrong.values()), len(uneven)) > MOST_WRONG:
            break
    broken = [("cells", f"as many as in the header, {len(headings)}", uneven)]
    for place, column in places.items():
        words = "a word" if column in texts else "a number, 0 or 1e-9 to 1e10 in SI units"
        broken.append((headings[place], words, wrong[place]))
    faults += [_fault(source, *parts) for parts in broken if parts[-1]]
    blanks = {column: np.full(len(lines), math.nan) for column in form.blanks}
    numbers = blanks | {column: np.array(values) for column, values in columns.items()}
    if (count := len(lines) + len(uneven)) < form.least:
        words = (
            f"must have at least {plural(form.least, 'line')} of measurements; there are {count}"
        )
        faults.append(Fault("", "", words, source))
    refuse(faults)
    texts_kept = {column: tuple(cells) for column, cells in texts.items()}
    unread = tuple(heading for heading in headings if heading in form.unread)
    return Measurements(source, form.kinds, sizes, tuple(lines), numbers, texts_kept, unread)


def record_faults(table: Measurements) -> Iterator[Fault]:
    """The lines of a record where time does not move on, and all if nothing is drawn."""
    time_s, current_A = table.numbers["time"], table.numbers["current"]
    late = np.diff(time_s, prepend=-math.inf) > 0.0
    yield from table.faults(~late, "time", "later than the line before", " s")
    idle = np.full(len(time_s), not np.any(current_A[:-1] > 0.0))
    yield from table.faults(idle, "current", "some current above 0: positive is discharge")


def gaps(table: Measurements) -> Iterator[Fault]:
    """The lines of a record that come too long after the line before."""
    steps_s = np.diff(table.numbers["time"], prepend=math.nan)
    usual_s = float(np.nanmedian(steps_s))
    words = f"no gap of more than {figure(WIDEST_STEP)} usual steps of {figure(usual_s)} s before"
    if usual_s > 0.0:
        yield from table.faults(steps_s > WIDEST_STEP * usual_s, "time", words, " s")


def read_all(
    files: object,
    formats: Sequence[Format],
    one: Callable[[Measurements], Read],
    log: Callable[[Path], Read | None] = lambda _: None,
) -> tuple[tuple[str, ...], list[Read]]:
    """The files' names, and each read with `one`; faults are refused at once, also a repeated file.

    Files are a path or several; those that are flight logs are read with `log`.
    """
    paths, first = paths_of(files, "files"), dict[object, str]()
    records, faults = list[Read](), list[Fault]()
    for path in paths:
        with collected(faults):
            source, record = label(path), log(path)
            if record is None:
                text = read_text(path, LARGEST_FILE)
                content: object = text
                record = one(read(text, source, formats))
            else:
                with path.open("rb") as file:
                    content = hashlib.file_digest(file, "sha256").digest()
            records.append(record)
            if content in first:
                words = f"has the content of {first[content]}: name each measurement once"
                faults.append(Fault("", "", words, source))
            first.setdefault(content, source)
    refuse(faults)
    return tuple(map(str, paths)), records


def unit_doubts(
    words: str, size: float, column: str, kind: str, usual: tuple[float, float, str] | None = None
) -> Iterator[str]:
    """A warning of a size in SI units that no UAV has, naming units that would make it usual."""
    least, most, unit = usual or USUAL[kind]
    if not least <= size <= most:
        meant = [
            usual_unit
            for usual_unit, worth in SIZES_OF_UNITS[kind].items()
            if least <= size * worth <= most
        ]
        heading = f"{column}_{next(iter(SIZES_OF_UNITS[kind]))}".rstrip("_")
        usual_sizes = f"where a UAV has {short(least)} to {short(most)} {unit}".rstrip()
        hint = f"; perhaps {heading} is in {' or '.join(meant)}" if meant else ""
        look = f"look at the units in the names of the columns{hint}"
        yield f"{words} is {f'{figure(size, 5)} {unit}'.rstrip()}, {usual_sizes}: {look}"


def _places(
    source: str, headings: Sequence[str], form: Format
) -> tuple[dict[int, str], list[Fault]]:
    """The column at each place of the header, and the header's faults."""
    if len(headings) == 1 and any(mark in headings[0] for mark in ";\t"):
        return {}, [
            Fault("columns", shown(headings[0]), "must have commas between the columns", source)
        ]
    column_of = {heading: column for column in form.kinds for heading in form.headings(column)}
    columns, faults = dict[int, str](), list[Fault]()
    for place, heading in enumerate(headings):
        column = column_of.get(heading)
        if heading in form.unread:
            continue
        if column is None:
            like = nearest(heading, column_of) if place < MOST_SUGGESTIONS else ""
            words = f"must be a known column{like}; known are {', '.join(column_of)}"
            if (column := form.named(heading)) is not None:
                words = f"must have a unit that belongs to it, {' or '.join(form.headings(column))}"
            faults.append(Fault("column", shown(heading), words, source))
        elif column in columns.values():
            faults.append(Fault(heading, "", f"is a second column of {column}", source))
        else:
            columns[place] = column
    named = set(map(form.named, headings))
    faults += [
        Fault("", "", f"there is no column {' or '.join(form.headings(column))}", source)
        for column in form.kinds
        if column not in form.optional and column not in named
    ]
    return columns, faults


def _value(cell: str, size: float) -> float:
    """The number in a cell in SI units, NaN if it has none."""
    try:
        value = size * decimal(cell)
    except ValueError:
        return math.nan
    return value if value == 0.0 or SMALLEST <= abs(value) <= LARGEST else math.nan


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
