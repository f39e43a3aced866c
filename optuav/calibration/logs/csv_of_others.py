"""CSV files of AirData and of programs that decode DJI's records, and any with named columns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from optuav.calibration import csv
from optuav.calibration.logs.samples import CUT_OFF, Columns, Readings, in_order
from optuav.errors import Fault, decimal, refuse
from optuav.mission.files import csv_rows, label, opened, refusal
from optuav.mission.messages import nearest, plural, shown

FEET_m, MILES_PER_H = 0.3048, 0.44704
NAMES: Mapping[str, tuple[str, ...]] = {
    "time": ("time", "osd.flytime"),
    "current": ("current", "battery.current"),
    "voltage": ("voltage", "battery.voltage", "battery.totalvoltage"),
    "speed": ("speed", "osd.hspeed"),
    "climb": ("zspeed", "osd.zspeed", "osd.vspeed"),
    "charge": (
        "battery_percent",
        "battery.chargelevel",
        "battery.relativecapacity",
        "battery.life",
    ),
    "armed": ("osd.ismotoron", "osd.ismotorup", "ismotoron", "ismotorup"),
    "landed": ("osd.isonground", "osd.groundorsky", "isonground"),
}
"""Columns of AirData and of decoders of DJI's records, in small letters."""
DOWNWARD = "zspeed"  # End of names whose positive values are a descent, as DJI counts
SPEEDS: Mapping[str, float] = {
    **{"": 1.0, "m/s": 1.0, "mps": 1.0, "km/h": 1 / 3.6, "kph": 1 / 3.6},
    **{"mph": MILES_PER_H, "ft/s": FEET_m, "knots": 1852 / 3600},
}
WORTH: Mapping[str, Mapping[str, float]] = {
    "time": {"": 1.0, "s": 1.0, "ms": 1e-3, "millisecond": 1e-3, "milliseconds": 1e-3},
    "current": {"": 1.0, "a": 1.0, "ma": 1e-3},
    "voltage": {"": 1.0, "v": 1.0, "mv": 1e-3},
    **{"speed": SPEEDS, "climb": SPEEDS},
    "charge": {"": 0.01, "%": 0.01},
}
STATES = {"true": 1, "1": 1, "ground": 1, "on ground": 1, "yes": 1} | dict.fromkeys(
    ("false", "0", "sky", "no"), 0
)
UNIT = re.compile(r"(.*?) *[\[(]([^\[()\]]*)[\])]")
OWN = csv.Format(
    {
        **{"time": "time", "current": "current", "voltage": "voltage"},
        **{"speed": "speed", "climb": "speed"},
    }
)
"""Columns of optuav, for `columns`."""
NEW = "time_s, current_A, voltage_V, speed_m_s, climb_m_s, battery_percent, isMotorOn, isOnGround"
OLD_NEW = "--column OLD=NEW"
OF_AIRDATA = "time(millisecond), current(A), voltage(v), speed(mph)"
MOST_NAMED = 8  # Headings of a file in a message


def read(path: Path, columns: Mapping[str, str]) -> Readings | None:
    """The samples in a CSV file of another program; None if it has the headings of optuav."""
    source = label(path)
    with opened(path, csv.LARGEST_FILE) as file:
        # Only signs of degrees are lost, which some programs write in other codes.
        text = file.read().decode("utf-8-sig", errors="replace")
    first, _, rest = text.partition("\n")
    mark = ""
    if re.fullmatch(r"\"?sep=.\"?\s*", first):  # A hint for Excel
        mark, text = first.strip().strip('"')[-1], rest
    head = next((line for line in text.splitlines() if line.strip() and line[0] != "#"), "")
    mark = mark or max(",;\t", key=head.count)
    whole, _, last = text.rpartition("\n")
    short = last.count(mark) < head.count(mark) or last.count('"') % 2 == 1
    if cut := bool(whole and last.strip()) and short:
        text = whole  # The last cell may be the beginning of one
    rows = csv_rows(text, source, mark)
    _, headings = next(rows, (0, list[str]()))
    places = dict[str, tuple[int, float]]()
    faults = list[Fault]()
    for old, new in columns.items():
        if old not in headings:
            words = f"a column of the file{nearest(old, headings)}"
            faults.append(Fault("columns", shown(old), words, source))
        if _column(new) is None:
            words = f"one of {NEW}, or with another unit"
            faults.append(Fault("columns", shown(new), words, source))
    # Those that are named here first, then those with a unit: decoders of DJI's records put a
    # text such as 0m 2.8s before the seconds.
    ranks = [(old not in columns, not UNIT.fullmatch(old)) for old in headings]
    for place in sorted(range(len(headings)), key=ranks.__getitem__):
        heading = headings[place]
        if (found := _column(columns.get(heading, heading))) and found[0] not in places:
            places[found[0]] = place, found[1]
        elif heading in columns and found:
            words = f"names {columns[heading]} a second time"
            faults.append(Fault("columns", shown(heading), words, source))
    faults += [*_twice(headings, places, source), *_unknown_units(headings, places, source)]
    refuse(faults)
    foreign = any(_foreign(heading) for heading in headings)
    if not columns and not (foreign and {"time"} & places.keys()):
        if len(headings) > 1 and not any(map(_has_unit, headings)):
            names = ", ".join(shown(heading) for heading in headings[:MOST_NAMED])
            more = ", …" * (len(headings) > MOST_NAMED)
            words = f"has no heading that is known: {names}{more}; use {OLD_NEW}, NEW one of {NEW}"
            raise refusal(path, f"{words}; headings of AirData, such as {OF_AIRDATA}, need none")
        return None
    if missing := [name for name in ("time", "current") if name not in places]:
        words = f"there is no column of the {' and of the '.join(missing)}; {OLD_NEW} names one"
        raise refusal(path, words)
    readings = _cells(path, rows, len(headings), places, decimal_comma=mark != ",")
    return readings._replace(warnings=[CUT_OFF] if cut else [])


def _twice(
    headings: Sequence[str], places: Mapping[str, tuple[int, float]], source: str
) -> Iterator[Fault]:
    """Yield a fault for a column that is read and whose heading another one has too."""
    small = [heading.strip().lower() for heading in headings]
    for place, _ in places.values():
        if (count := small.count(small[place])) > 1:
            words = f"must be the heading of one column; it is that of {count}"
            yield Fault("column", shown(headings[place]), words, source)


def _has_unit(heading: str) -> bool:
    """Return whether a heading ends in a unit, as those of optuav do."""
    _, line, unit = heading.rpartition("_")
    return bool(line) and any(unit in units for units in csv.SIZES_OF_UNITS.values())


def _unknown_units(
    headings: Sequence[str], places: Mapping[str, tuple[int, float]], source: str
) -> Iterator[Fault]:
    """Yield a fault for a quantity all of whose columns are in units that are not known."""
    for heading in headings:
        if (parts := UNIT.fullmatch(heading.strip().lower())) is None:
            continue
        for quantity, worth in WORTH.items():
            if parts[1] in NAMES[quantity] and quantity not in places:
                units = ", ".join(unit for unit in worth if unit)
                yield Fault("column", shown(heading), f"must be in one of {units}", source)


def _column(heading: str) -> tuple[str, float] | None:
    """The quantity that a heading names, and the SI value of its unit."""
    for quantity in OWN.kinds:
        if heading in (known := OWN.headings(quantity)):
            return quantity, known[heading]
    return _foreign(heading)


def _foreign(heading: str) -> tuple[str, float] | None:
    """The quantity that a heading of another program names, and the SI value of its unit."""
    small = heading.strip().lower()
    parts = UNIT.fullmatch(small)
    for name, unit in ((small, ""), parts.groups() if parts else (small, "")):
        for quantity, names in NAMES.items():
            if name in names and unit in (worth := WORTH.get(quantity, {"": 1.0})):
                return quantity, -worth[unit] if name.endswith(DOWNWARD) else worth[unit]
    return None


def _cells(
    path: Path,
    rows: Iterator[tuple[int, list[str]]],
    most: int,
    places: Mapping[str, tuple[int, float]],
    *,
    decimal_comma: bool,
) -> Readings:
    """The samples of lines whose time and current are known, in order of time.

    In a line of more cells than headings, `most`, no cell is known to belong to its heading.
    """
    kept, lost, long = list[list[float]](), 0, 0
    for _, cells in rows:
        if any(cells[most:]):
            long += 1
            continue
        values = list[float]()
        for name in NAMES:
            place, worth = places.get(name, (-1, 1.0))
            cell = cells[place] if 0 <= place < len(cells) else ""
            values.append(_number(name, cell, worth, decimal_comma=decimal_comma))
        time_s, current_A = values[:2]
        if not np.isfinite([time_s, current_A]).all():
            lost += 1
        else:
            kept.append(values)
    if long > len(kept) + lost:
        words = f"has {plural(long, 'line')} with more cells than its {plural(most, 'heading')}"
        hint = "decimal commas go with semicolons or tabs between the columns"
        raise refusal(path, f"{words}: {hint}" if not decimal_comma else words)
    table = np.array(kept).T if kept else np.empty((len(NAMES), 0))
    table, count = table[:, in_order(table[0])], len(kept)
    late = count - table.shape[1]
    by_name = dict(zip(NAMES, table, strict=True))
    states = (np.nan_to_num(by_name[name], nan=-1).astype(int) for name in ("armed", "landed"))
    series = ("time", "current", "voltage", "speed", "climb", "charge")
    notes = list[str]()
    if lost or late or long:
        parts = [f"{long} with more cells than headings"] * bool(long)
        parts += [f"{lost} without time or current"] * bool(lost)
        parts += [f"{late} whose time does not move on"] * bool(late)
        of = f"{long + lost + late} of {plural(long + count + lost, 'line')}"
        notes.append(f"{of} are not read: {' and '.join(parts)}")
    return Readings(Columns(*(by_name[name] for name in series), *states), 1, notes, ())


def _number(name: str, cell: str, worth: float, *, decimal_comma: bool) -> float:
    """The number in a cell in SI units; a state as 1 or 0; NaN if it has none."""
    if name in ("armed", "landed"):
        return STATES.get(cell.strip().lower(), np.nan)
    try:
        return worth * decimal(cell.replace(",", ".") if decimal_comma else cell)
    except ValueError:
        return np.nan
