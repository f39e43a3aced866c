"""Flight plans of ground stations as steps on Earth: QGroundControl's, MAVLink's text, and KML.

Formats: plans of QGroundControl (version 1, mission 2), the text ``QGC WPL 110``, and lines and
points of KML 2.2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

from optuav.errors import Fault, InputError, decimal
from optuav.judge.kml_path import kml_flight
from optuav.judge.mavlink import (
    NO_ITEMS,
    NOWHERE,
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
CALCULATED_OVER_TERRAIN = 3  # QGroundControl's mode of heights that it computes itself


def flight_of(file: Path) -> StatedFlight:
    """The flight in a file, by its content; refused with every item that is not simple."""
    text, source = read_text(file, LARGEST), label(file)
    if re.match(r"\s*QGC WPL", text):
        home, rows = _of_waypoints(text, file)
        return flight_of_items(file, home, rows, math.nan, [])
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
    latitude, longitude, altitude_m = _value(mission, "plannedHomePosition", HOME, file, "mission.")
    speed_m_s = math.nan
    if mission.get("hoverSpeed") is not None:
        speed_m_s = float(_value(mission, "hoverSpeed", SPEED, file, "mission."))
    items = _value(mission, "items", LIST, file, "mission.")
    rows = [*_items(items, notes, file, "mission.items")]
    return flight_of_items(file, (longitude, latitude, altitude_m), rows, speed_m_s, notes)


class ItemForm(NamedTuple):
    """A value of a key: whether it is one, and what is allowed."""

    accepts: Callable[[Any], bool]
    words: str


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_numbers(value: object, count: int, *, empty: bool) -> bool:
    """Return whether a value is a list of so many numbers, some perhaps null."""
    is_list = isinstance(value, list) and len(value) == count
    return is_list and all(_is_number(x) or (empty and x is None) for x in cast(list[Any], value))


NUMBER = ItemForm(_is_number, "a number")
WHOLE = ItemForm(lambda value: _is_number(value) and value == int(value), "a whole number")
SPEED = ItemForm(lambda value: _is_number(value) and value > 0.0, SPEED_WORDS)
TABLE = ItemForm(lambda value: isinstance(value, dict), "a table")
TEXT = ItemForm(lambda value: isinstance(value, str), "a text")
LIST = ItemForm(lambda value: isinstance(value, list), "a list")
HOME = ItemForm(
    lambda value: _is_numbers(value, 3, empty=False),
    "three numbers: latitude and longitude [deg], altitude [m]",
)
PARAMETERS = ItemForm(
    lambda value: _is_numbers(value, 7, empty=True), "a list of 7 numbers or null"
)


def _value(table: Any, key: str, form: ItemForm, file: Path, before: str = "") -> Any:
    """The value of a key of a plan; refused by its name if it is missing or of another form."""
    value = table.get(key)
    if not form.accepts(value):
        stated = shown(value) if key in table else ""
        raise InputError([Fault(f"{before}{key}", stated, form.words, label(file))])
    return value


def _items(
    items: Sequence[Any], notes: list[str], file: Path, key: str, before: str = ""
) -> Iterator[MavlinkItem]:
    """Simple items, and those that patterns carry."""
    for number, each in enumerate(items):
        name, at = f"{before}item {number + 1}", f"{key}[{number}]"
        if not isinstance(each, dict):
            raise InputError([Fault(at, shown(each), TABLE.words, label(file))])
        if _value(each, "type", TEXT, file, f"{at}.") == "SimpleItem":
            stated = _value(each, "params", PARAMETERS, file, f"{at}.")
            numbers = [math.nan if value is None else float(value) for value in stated]
            frame = int(_value({"frame": NOWHERE} | each, "frame", WHOLE, file, f"{at}."))
            if math.isnan(numbers[6]) and each.get("AltitudeMode") == CALCULATED_OVER_TERRAIN:
                numbers[6] = float(_value(each, "Altitude", NUMBER, file, f"{at}."))
                frame = TERRAIN[0]
            command = int(_value(each, "command", WHOLE, file, f"{at}."))
            yield MavlinkItem(name, command, frame, tuple(numbers))
            continue
        kind = str(each.get("complexItemType", "pattern"))
        pattern = "TransectStyleComplexItem"
        if pattern not in each or "Items" not in _value(each, pattern, TABLE, file, f"{at}."):
            yield MavlinkItem(f"{name} ({kind})", NO_ITEMS, NOWHERE, (math.nan,) * 7)
            continue
        carried = _value(each[pattern], "Items", LIST, file, f"{at}.{pattern}.")
        notes.append(f"{name} ({kind}) is flown by the {len(carried)} items that it carries")
        yield from _items(carried, notes, file, f"{at}.{pattern}.Items", f"{name}, ")


def _of_waypoints(text: str, file: Path) -> tuple[tuple[float, float, float], list[MavlinkItem]]:
    """Home and the items of MAVLink's text."""
    rows, source = list[MavlinkItem](), label(file)
    for number, line in enumerate(text.splitlines()[1:], start=2):
        if not line.strip() or line.startswith("#"):
            continue
        cells = line.split()
        try:
            if len(cells) != 12:
                raise ValueError
            name, _, frame, command, *numbers, _ = map(decimal, cells)
        except ValueError:
            words = (
                "a line of twelve numbers: number, current, frame, command, seven figures, continue"
            )
            raise InputError([Fault("", "", words, f"{source}, line {number}")]) from None
        rows.append(MavlinkItem(f"item {name:.0f}", int(command), int(frame), tuple(numbers)))
    if not rows:
        raise refusal(file, "has no items: is it cut off?")
    latitude, longitude, altitude_m = rows[0].numbers[4:]
    return (longitude, latitude, altitude_m), rows[1:]
