"""Flight plans of ground stations as steps on Earth: QGroundControl's, MAVLink's text, and KML.

Formats: plans of QGroundControl (version 1, mission 2), the text ``QGC WPL 110``, and lines and
points of KML 2.2. Commands are those of https://mavlink.io/en/messages/common.html (MAV_CMD).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast
from xml.etree import ElementTree

from optuav.errors import Fault, InputError, decimal
from optuav.mission.files import label, parse_json, read_text, refusal
from optuav.mission.formats import named
from optuav.mission.messages import shown

SUFFIXES = (".plan", ".waypoints", ".kml")
LARGEST = 20_000_000  # bytes
MOST_ITEMS = 10_000
WAYPOINT, LOITER_FOR_EVER, LOITER_TURNS, LOITER_TIME, RETURN, LAND = 16, 17, 18, 19, 20, 21
TAKE_OFF, LOITER_TO_ALTITUDE, SPLINE, DELAY, CHANGE_SPEED = 22, 31, 82, 93, 178
CONDITION_DELAY = 112
SILENT = {115, 195, 196, 197, 201, 203, 204, 205, 206, 211, 212, 213, 214, 530, 532, 2000, 2001}
SILENT |= {183, 184, 206, 207, 215, 2500, 2501, 530, 531, 1000, 181, 182}
"""Cameras, gimbals, headings, relays and fences, which change neither the way nor the time."""
REFUSED = {
    177: "DO_JUMP, which flies a part again",
    84: "a take-off of a VTOL",
    85: "a landing of a VTOL",
    3000: "a transition of a VTOL",
    33: "FOLLOW, which no plan knows beforehand",
    92: "GUIDED, which another computer flies",
}
RELATIVE, ABSOLUTE, TERRAIN, NOWHERE = (3, 6), (0, 5), (10, 11), 2
"""Frames of heights: over home, above mean sea level, over terrain; no place at all."""
CALCULATED_OVER_TERRAIN = 3  # QGroundControl's mode of heights that it computes itself
AS_BEFORE = (-1.0, -2.0)  # Speeds that stand for no change, and for the autopilot's own
EARTH = "longitude −180 to 180, latitude −90 to 90"

Kind = Literal["pass", "hover", "rest", "take-off", "land", "return"]


class StatedStep(NamedTuple):
    """A place on Earth that an item flies to, and what it does there."""

    item: str  # such as "item 4"
    kind: Kind
    longitude_deg: float  # NaN for the place of the step before, as the latitude
    latitude_deg: float
    height_m: float
    over: Literal["home", "sea"]
    stay_s: float = 0.0
    speed_m_s: float = math.nan  # on the way there; NaN for the drone's own


class StatedFlight(NamedTuple):
    """Steps in order, from home, whose altitude above mean sea level may be unknown (NaN) [m]."""

    home: tuple[float, float]  # longitude, latitude
    home_altitude_m: float
    steps: tuple[StatedStep, ...]
    notes: tuple[str, ...]


def flight_of(file: Path) -> StatedFlight:
    """The flight in a file, by its content; refused with every item that is not simple."""
    text, source = read_text(file, LARGEST), label(file)
    if re.match(r"\s*QGC WPL", text):
        home, rows = _of_waypoints(text, file)
        return _flight(file, home, rows, math.nan, [])
    what = named(text.encode())
    if what and what.words.startswith("KML"):
        return _of_kml(text, file)
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
    return _flight(file, (longitude, latitude, altitude_m), rows, speed_m_s, notes)


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
SPEED = ItemForm(lambda value: _is_number(value) and value > 0.0, "a number, x > 0 [m/s]")
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


class PlanItem(NamedTuple):
    """An item: its name, command and frame, four parameters, and latitude, longitude, height."""

    name: str
    command: int
    frame: int
    numbers: tuple[float, ...]


def _items(
    items: Sequence[Any], notes: list[str], file: Path, key: str, before: str = ""
) -> Iterator[PlanItem]:
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
            yield PlanItem(name, command, frame, tuple(numbers))
            continue
        kind = str(each.get("complexItemType", "pattern"))
        pattern = "TransectStyleComplexItem"
        if pattern not in each or "Items" not in _value(each, pattern, TABLE, file, f"{at}."):
            yield PlanItem(f"{name} ({kind})", -1, NOWHERE, (math.nan,) * 7)
            continue
        carried = _value(each[pattern], "Items", LIST, file, f"{at}.{pattern}.")
        notes.append(f"{name} ({kind}) is flown by the {len(carried)} items that it carries")
        yield from _items(carried, notes, file, f"{at}.{pattern}.Items", f"{name}, ")


def _of_waypoints(text: str, file: Path) -> tuple[tuple[float, float, float], list[PlanItem]]:
    """Home and the items of MAVLink's text."""
    rows, source = list[PlanItem](), label(file)
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
        rows.append(PlanItem(f"item {name:.0f}", int(command), int(frame), tuple(numbers)))
    if not rows:
        raise refusal(file, "has no items: is it cut off?")
    latitude, longitude, altitude_m = rows[0].numbers[4:]
    return (longitude, latitude, altitude_m), rows[1:]


def _flight(
    file: Path,
    home: tuple[float, float, float],
    rows: Sequence[PlanItem],
    speed_m_s: float,
    notes: list[str],
) -> StatedFlight:
    """The steps of items, with what is not flown as they say."""
    steps, faults = list[StatedStep](), list[Fault]()
    if len(rows) > MOST_ITEMS:
        raise refusal(file, f"has more than {MOST_ITEMS} items")
    if not _on_earth(*home[:2]):
        raise InputError([Fault("home", shown(home[:2]), EARTH, label(file))])
    if not any(home[:2]):  # Written without a position of the drone
        known = ((row.numbers[5], row.numbers[4]) for row in rows if row.frame != NOWHERE)
        place = next((at for at in known if all(at)), home[:2])
        home = (*place, math.nan)
        notes.append("home is unknown: it is taken to be at the first place of the plan")
    landed = ended = False
    for row in rows:
        what, (stay_s, second, *_), (latitude, longitude, height_m) = (
            row.name,
            row.numbers[:4],
            row.numbers[4:],
        )
        if row.command in SILENT:
            continue
        if row.command in (WAYPOINT, LOITER_TIME, DELAY, CONDITION_DELAY) and stay_s < 0.0:
            words = "a number, x >= 0 [s]"
            faults.append(Fault(f"{what}, seconds", shown(stay_s), words, label(file)))
            continue
        if row.command in (DELAY, CONDITION_DELAY):
            if steps and stay_s > 0.0:
                steps[-1] = steps[-1]._replace(stay_s=steps[-1].stay_s + stay_s)
            continue
        if row.command == CHANGE_SPEED:
            if second in AS_BEFORE or math.isnan(second):
                continue
            if not SPEED.accepts(second):
                words = f"{SPEED.words}, or −1 for the speed before"
                faults.append(Fault(f"{what}, speed", shown(second), words, label(file)))
            speed_m_s = second
            continue
        kind: Kind = "pass"
        if ended:
            notes.append(f"{what} and what follows come after the flight's end and are not flown")
            break
        if row.command in REFUSED or row.command < 0:
            words = REFUSED.get(row.command, "a pattern that carries no items")
            faults.append(Fault(what, "", f"is {words}; fly it as waypoints", label(file)))
            continue
        if row.command == TAKE_OFF:
            kind = "take-off"
            if landed:
                steps[-1] = steps[-1]._replace(kind="rest")
                landed = False
        elif landed:
            notes.append(f"{what} and what follows come after a landing and are not flown")
            break
        elif row.command == LAND:
            kind, landed = "land", True
        elif row.command == RETURN:
            kind, ended = "return", True
        elif row.command == LOITER_TIME:
            kind = "hover"
        elif row.command == LOITER_FOR_EVER:
            kind, stay_s, ended = "hover", 0.0, True
            notes.append(f"{what} loiters without end: the flight is judged until it gets there")
        elif row.command in (LOITER_TURNS, LOITER_TO_ALTITUDE, SPLINE):
            stay_s = 0.0
            notes.append(f"{what} is flown as a waypoint, by a straight line")
        elif row.command != WAYPOINT:
            notes.append(f"{what} has command {row.command}, which is not flown")
            continue
        stays = kind in ("pass", "hover") and stay_s > 0.0 and row.command != SPLINE
        if row.frame in TERRAIN:
            notes.append(f"{what} has its height over terrain; it is taken over home")
        over: Literal["home", "sea"] = "sea" if row.frame in ABSOLUTE else "home"
        if kind == "return":
            longitude, latitude, height_m, over = *home[:2], 0.0, "home"
        elif not (latitude or longitude) or math.isnan(latitude + longitude):
            longitude = latitude = math.nan
        elif not _on_earth(longitude, latitude):
            faults.append(Fault(what, shown((longitude, latitude)), EARTH, label(file)))
            continue
        if not math.isfinite(height_m):
            faults.append(Fault(what, "", "a height as a number", label(file)))
            continue
        at = (longitude, latitude, height_m, over)
        speed = math.nan if kind == "take-off" else speed_m_s
        steps.append(StatedStep(what, "hover" if stays else kind, *at, stay_s * stays, speed))
    if faults:
        raise InputError(faults)
    if not steps:
        raise refusal(file, "has no item that flies anywhere")
    return StatedFlight(home[:2], home[2], tuple(steps), tuple(notes))


def _of_kml(text: str, file: Path) -> StatedFlight:
    """The lines and points of KML, in the order of the file."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise refusal(file, "is KML with definitions of its own, which are not read")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise refusal(file, f"is damaged or cut off at line {line}, column {column}") from None
    steps, notes, home = list[StatedStep](), list[str](), None
    has_lines = any(each.tag.rpartition("}")[2] == "LineString" for each in root.iter())
    for mark in root.iter():
        if mark.tag.rpartition("}")[2] != "Placemark":
            continue
        facts = {each.tag.rpartition("}")[2]: (each.text or "").strip() for each in mark.iter()}
        if "LinearRing" in facts or not {"LineString", "Point"} & facts.keys():
            continue
        name, is_line = facts.get("name") or f"placemark {len(steps) + 1}", "LineString" in facts
        seconds = re.match(r"([\d.]+) s\b", facts.get("description", ""))
        fastest = re.search(r"at most ([\d.]+) m/s", facts.get("description", ""))
        if has_lines and not (is_line or seconds):
            continue  # A label beside the path
        mode = facts.get("altitudeMode", "clampToGround")
        if mode not in ("absolute", "relativeToGround"):
            words = "an altitudeMode, absolute or relativeToGround, with a height of each corner"
            raise InputError([Fault(name, shown(mode), words, label(file))])
        over: Literal["home", "sea"] = "sea" if mode == "absolute" else "home"
        places = list[tuple[float, float, float]]()
        for corner in facts.get("coordinates", "").split():
            with suppress(ValueError):
                x, y, *z = map(decimal, corner.split(","))
                places.append((x, y, z[0] if len(z) == 1 else math.nan))
        if not places or any(not (_on_earth(x, y) and math.isfinite(z)) for x, y, z in places):
            words = f"a list of coordinates longitude,latitude,height: {EARTH}"
            raise InputError([Fault(name, "", words, label(file))])
        if over == "home" and (lowest := min(z for *_, z in places)) < 0.0:
            words = "a height over ground, x >= 0 [m]"
            raise InputError([Fault(name, shown(lowest), words, label(file))])
        home = home or (places[0], over)
        if not is_line:
            stay_s = float(seconds[1]) if seconds else 0.0
            kind: Kind = "rest" if name.startswith("rest") else "hover" if stay_s else "pass"
            steps.append(StatedStep(name, kind, *places[0], over, stay_s))
            continue
        speed_m_s = float(fastest[1]) if fastest else math.nan
        steps += [StatedStep(name, "pass", *at, over, 0.0, speed_m_s) for at in places]
        if len(steps) > MOST_ITEMS:
            raise refusal(file, f"has more than {MOST_ITEMS} places")
    if home is None:
        raise refusal(file, "has no line or points to fly along: outlines make a map")
    (longitude, latitude, height_m), over = home
    if over == "home" and height_m > 0.0:
        notes.append("the path begins above the ground: a climb from below its begin is added")
        steps.insert(0, StatedStep("take-off", "take-off", math.nan, math.nan, height_m, over))
    altitude_m = height_m if over == "sea" else math.nan
    return StatedFlight((longitude, latitude), altitude_m, tuple(steps), tuple(notes))


def _on_earth(longitude: float, latitude: float) -> bool:
    return abs(longitude) <= 180.0 and abs(latitude) <= 90.0
