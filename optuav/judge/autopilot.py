"""Flight plans of ground stations as steps on Earth: QGroundControl's, MAVLink's text, and KML.

Formats: plans of QGroundControl (version 1, mission 2), the text ``QGC WPL 110``, and lines and
points of KML 2.2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from optuav.errors import Fault, InputError, collected, decimal, refuse
from optuav.judge.kml_path import kml_flight
from optuav.judge.mavlink import (
    KINDS,
    NO_ITEMS,
    NOWHERE,
    REFUSED,
    SPEED_WORDS,
    TERRAIN,
    MavlinkItem,
    flight_of_items,
)
from optuav.judge.stated_flight import StatedFlight
from optuav.mission.files import label, parse_json, read_text, refusal
from optuav.mission.formats import named
from optuav.mission.messages import shown

SUFFIXES = (".plan", ".waypoints", ".kml")
LARGEST = 20_000_000  # bytes
WHOLE_FIELDS = 4  # First fields of a line: number, current, frame, command
FIELDS = "must be twelve: number, current, frame, command, seven figures, continue"
CALCULATED_OVER_TERRAIN = 3  # QGroundControl's mode of heights that it computes itself


def flight_of(file: Path) -> StatedFlight:
    """The flight in a file, by its content; refused with every item that is not simple."""
    text, source = read_text(file, LARGEST), label(file)
    if not text.strip():
        raise refusal(file, "is empty")
    if (version := re.match(r"\s*QGC WPL\s*(\S*)", text)) is not None:
        if version[1] != "110":
            words = f"is a text of waypoints of version {version[1] or 'unknown'}"
            raise refusal(file, f"{words}; optuav reads version 110")
        return _of_waypoints(text, file)
    what = named(text.encode())
    if what and what.words.startswith("KML"):
        return kml_flight(text, file)
    if not text.lstrip().startswith("{"):
        words = f"is {what.name}" if what else "is something else"
        plans = "a flight plan is a .plan, .waypoints or .kml"
        raise refusal(file, f"{words}: {plans}")
    document = parse_json(text, source)
    if document.get("fileType") != "Plan":
        words = f"is {what.name}" if what else "is JSON of another kind"
        raise refusal(file, f"{words}, not a plan of QGroundControl, whose fileType is Plan")
    notes = list[str]()
    version = _value(document, "version", WHOLE, file)
    mission = _value(document, "mission", TABLE, file)
    versions = version, _value(mission, "version", WHOLE, file, "mission.")
    if versions != (1, 2):
        words = f"versions 1 of the plan and 2 of its mission, not {versions[0]}, {versions[1]}"
        raise refusal(file, f"is a plan of another version: {words}")
    home, speed_m_s, faults = (math.nan,) * 3, math.nan, list[Fault]()
    rows, items = list[MavlinkItem](), []
    with collected(faults):
        latitude, longitude, altitude_m = _value(
            mission, "plannedHomePosition", HOME, file, "mission."
        )
        home = longitude, latitude, altitude_m
    if mission.get("hoverSpeed") is not None:
        with collected(faults):
            speed_m_s = float(_value(mission, "hoverSpeed", SPEED, file, "mission."))
    with collected(faults):
        items = _value(mission, "items", LIST, file, "mission.")
    _add_items(items, rows, notes, faults, file)
    judged_with = None
    if document.get("groundStation") == "optuav" and "judged_with" in document:
        with collected(faults):
            judged_with = _value(document, "judged_with", TABLE, file)
    flight = flight_of_items(file, home, rows, speed_m_s, notes, faults)
    return flight._replace(judged_with=judged_with)


class ItemForm(NamedTuple):
    """A value of a key: whether it is one, and what is allowed."""

    accepts: Callable[[Any], bool]
    words: str


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_place(value: object) -> bool:
    """Return whether a value is a list of three numbers."""
    return isinstance(value, list) and len(value) == 3 and all(map(_is_number, value))


def _as_stated(value: object) -> str:
    """A value of a file in JSON as a short text."""
    return "null" if value is None else shown(value)


NUMBER = ItemForm(_is_number, "a number")
WHOLE = ItemForm(lambda value: _is_number(value) and value == int(value), "a whole number")
SPEED = ItemForm(lambda value: _is_number(value) and value > 0.0, SPEED_WORDS)
TABLE = ItemForm(lambda value: isinstance(value, dict), "a table")
TEXT = ItemForm(lambda value: isinstance(value, str), "a text")
LIST = ItemForm(lambda value: isinstance(value, list), "a list")
HOME = ItemForm(
    _is_place,
    "three numbers: latitude and longitude [deg], altitude [m]",
)
PARAMETERS = ItemForm(
    lambda value: isinstance(value, list) and len(value) == 7, "a list of 7 numbers or null"
)


def _value(table: Any, key: str, form: ItemForm, file: Path, before: str = "") -> Any:
    """The value of a key of a plan; refused by its name if it is missing or of another form."""
    value = table.get(key)
    if not form.accepts(value):
        value_in_words = _as_stated(value) if key in table else ""
        raise InputError([Fault(f"{before}{key}", value_in_words, form.words, label(file))])
    return value


def _add_items(
    items: Sequence[Any],
    rows: list[MavlinkItem],
    notes: list[str],
    faults: list[Fault],
    file: Path,
    before: str = "",
) -> None:
    """Add simple items to rows, and those that patterns carry; and the faults of all others."""
    for number, item in enumerate(items):
        name = f"item {before}{number + 1}"
        with collected(faults):
            if not isinstance(item, dict):
                raise InputError([Fault(name, _as_stated(item), TABLE.words, label(file))])
            if _value(item, "type", TEXT, file, f"{name}, ") == "SimpleItem":
                rows.append(_simple(item, name, file))
                continue
            kind = str(item.get("complexItemType", "pattern"))
            pattern, carried = "TransectStyleComplexItem", []
            if pattern in item and "Items" in _value(item, pattern, TABLE, file, f"{name}, "):
                carried = _value(item[pattern], "Items", LIST, file, f"{name}, {pattern}.")
            others, wrong = len(rows), len(faults)
            _add_items(carried, rows, notes, faults, file, f"{before}{number + 1}.")
            if {row.command for row in rows[others:]} & {*KINDS, *REFUSED, NO_ITEMS}:
                words = f"is flown by the {len(carried)} items that it carries"
                notes.append(f"{name} ({kind}) {words}")
            elif len(faults) == wrong:
                rows.append(MavlinkItem(f"{name} ({kind})", NO_ITEMS, NOWHERE, (math.nan,) * 7))


def _simple(item: Any, name: str, file: Path) -> MavlinkItem:
    """A simple item; refused with all faults."""
    faults, frame, command = list[Fault](), NOWHERE, NO_ITEMS
    numbers: tuple[float, ...] = (math.nan,) * 7
    with collected(faults):
        parameters = _value(item, "params", PARAMETERS, file, f"{name}, ")
        refuse(
            Fault(f"{name}, param {n}", shown(value), "a number or null", label(file))
            for n, value in enumerate(parameters, start=1)
            if not (value is None or _is_number(value))
        )
        numbers = tuple(math.nan if value is None else float(value) for value in parameters)
    with collected(faults):
        frame = int(_value({"frame": NOWHERE} | item, "frame", WHOLE, file, f"{name}, "))
    with collected(faults):
        if math.isnan(numbers[6]) and item.get("AltitudeMode") == CALCULATED_OVER_TERRAIN:
            height_m = float(_value(item, "Altitude", NUMBER, file, f"{name}, "))
            numbers, frame = (*numbers[:6], height_m), TERRAIN[0]
    with collected(faults):
        command = int(_value(item, "command", WHOLE, file, f"{name}, "))
    refuse(faults)
    return MavlinkItem(name, command, frame, numbers)


def _of_waypoints(text: str, file: Path) -> StatedFlight:
    """The flight of MAVLink's text."""
    rows, source, faults = list[MavlinkItem](), label(file), list[Fault]()
    for number, line in enumerate(text.splitlines()[1:], start=2):
        if not line.strip() or line.startswith("#"):
            continue
        cells, here = line.split(), f"{source}, line {number}"
        if len(cells) != 12:
            faults.append(Fault("fields", f"{len(cells)}", FIELDS, here))
            continue
        wrong = [n for n, cell in enumerate(cells) if not _is_decimal(cell, n < WHOLE_FIELDS)]
        faults += (Fault(f"field {n + 1}", shown(cells[n]), "a number", here) for n in wrong)
        if not wrong:
            name, _, frame, command, *numbers, _ = map(decimal, cells)
            rows.append(MavlinkItem(f"item {int(name)}", int(command), int(frame), tuple(numbers)))
    if not rows:
        refuse(faults)
        raise refusal(file, "has no items: is it cut off?")
    latitude, longitude, altitude_m = rows[0].numbers[4:]
    home = longitude, latitude, altitude_m
    return flight_of_items(file, home, rows[1:], math.nan, [], faults)


def _is_decimal(text: str, finite: bool) -> bool:
    """Return whether a text is a number, not infinite; NaN stands for no value where it may."""
    try:
        number = decimal(text)
    except ValueError:
        return False
    return math.isfinite(number) or (math.isnan(number) and not finite)
