"""Items of a MAVLink mission as a flight.

Commands are those of https://mavlink.io/en/messages/common.html (MAV_CMD).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from optuav.errors import Fault, InputError, refuse
from optuav.fields import COORDINATE
from optuav.judge.stated_flight import EARTH, MOST_PLACES, Kind, StatedFlight, StatedStep, on_earth
from optuav.judge.timeline import DURATION
from optuav.mission.files import label, refusal
from optuav.mission.messages import shown

WAYPOINT, LOITER_FOR_EVER, LOITER_TURNS, LOITER_TIME, RETURN, LAND = 16, 17, 18, 19, 20, 21
TAKE_OFF, LOITER_TO_ALTITUDE, SPLINE, DELAY, CHANGE_SPEED = 22, 31, 82, 93, 178
CONDITION_DELAY = 112
DELAYS = DELAY, CONDITION_DELAY
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
NO_ITEMS = -1  # Stands for the command of a pattern without waypoints
KINDS: dict[int, Kind] = {
    **{WAYPOINT: "pass", TAKE_OFF: "take-off", LAND: "land", RETURN: "return"},
    **{LOITER_TIME: "hover", LOITER_FOR_EVER: "hover"},
    **dict.fromkeys((LOITER_TURNS, LOITER_TO_ALTITUDE, SPLINE), "pass"),
}
STAYING = WAYPOINT, LOITER_TIME, *DELAYS
ABSOLUTE, RELATIVE, TERRAIN, NOWHERE = (0, 5), (3, 6), (10, 11), 2
"""Frames of heights: above mean sea level, over home, over terrain; no place at all."""
IN_DEGREES = *ABSOLUTE, *RELATIVE, *TERRAIN
VERTICAL = {2.0: "climbs", 3.0: "descents"}  # Types of a change of speed that is not level
AS_BEFORE = (-1.0, -2.0)  # Speeds that stand for no change, and for the autopilot's own
SPEED_WORDS = "a number, x > 0 [m/s]"


class MavlinkItem(NamedTuple):
    """An item: its name, command and frame, four parameters, and latitude, longitude, height."""

    name: str
    command: int
    frame: int
    numbers: tuple[float, ...]

    @property
    def no_change(self) -> bool:
        """Whether a change of speed keeps the level speed before."""
        vertical = self.numbers[0] in VERTICAL
        return vertical or self.numbers[1] in AS_BEFORE or math.isnan(self.numbers[1])

    @property
    def elsewhere(self) -> bool:
        """Whether it states a place."""
        latitude, longitude = self.numbers[4:6]
        return bool(latitude or longitude) and not math.isnan(latitude + longitude)


def flight_of_items(
    file: Path,
    home: tuple[float, float, float],
    items: Sequence[MavlinkItem],
    speed_m_s: float,
    notes: list[str],
    faults: Sequence[Fault] = (),
) -> StatedFlight:
    """The flight of items from home: longitude, latitude [deg], altitude [m]; and notes added.

    Speeds are `speed_m_s` [m/s] until an item changes them. `InputError` with every item that is
    not simple, after faults of the file.
    """
    if faults:
        refuse([*faults, *_faults(items, label(file))])
    if len(items) > MOST_PLACES:
        raise refusal(file, f"has more than {MOST_PLACES} items")
    if not on_earth(*home[:2]):
        raise InputError([Fault("home", shown(home[:2]), EARTH, label(file))])
    if not any(home[:2]):  # Written without a position of the drone
        degrees = ((item.numbers[5], item.numbers[4]) for item in items if item.frame != NOWHERE)
        home = (*next((at for at in degrees if all(at)), home[:2]), math.nan)
        notes.append("home is unknown: it is assumed to be at the first place of the plan")
    flown = [*_until_the_end(items, notes)]
    refuse(_faults(flown, label(file)))
    steps = _steps(flown, home, speed_m_s, notes)
    if not steps:
        raise refusal(file, "has no item that flies anywhere")
    if steps[0].kind != "take-off":
        words = "is no take-off: ArduCopter does not start such a plan on the ground"
        notes.append(f"{steps[0].item} {words}")
    return StatedFlight(home[:2], home[2], tuple(steps), tuple(notes))


def _until_the_end(items: Iterable[MavlinkItem], notes: list[str]) -> Iterator[MavlinkItem]:
    """Yield the items up to the flight's end: a return, a loiter without end, a last landing."""
    landed = ended = False
    for item in items:
        moves = item.command not in {*SILENT, *DELAYS, CHANGE_SPEED}
        if moves and ended:
            notes.append(
                f"{item.name} and what follows come after the flight's end and are not flown"
            )
            return
        if moves and landed and item.command not in {TAKE_OFF, *REFUSED, NO_ITEMS}:
            notes.append(f"{item.name} and what follows come after a landing and are not flown")
            return
        if moves:
            landed, ended = item.command == LAND, item.command in (RETURN, LOITER_FOR_EVER)
        yield item


def _faults(items: Iterable[MavlinkItem], source: str) -> Iterator[Fault]:
    """Yield what is wrong with items."""
    for item in items:
        name, command, _, (stay_s, speed_m_s, *_) = item
        if command in STAYING and not (math.isnan(stay_s) or DURATION.accepts(stay_s)):
            yield Fault(f"{name}, seconds", shown(stay_s), DURATION.words, source)
        if command == CHANGE_SPEED and not (
            speed_m_s in AS_BEFORE or math.isnan(speed_m_s) or 0.0 < speed_m_s < math.inf
        ):
            words = f"{SPEED_WORDS}, or −1 for the speed before"
            yield Fault(f"{name}, speed", shown(speed_m_s), words, source)
        if command in REFUSED or command == NO_ITEMS:
            words = REFUSED.get(command, "a pattern without waypoints")
            yield Fault(name, "", f"is {words}; fly it as waypoints", source)
        if command in KINDS and command != RETURN:
            yield from _faults_of_place(item, source)


def _faults_of_place(item: MavlinkItem, source: str) -> Iterator[Fault]:
    """Yield what is wrong with the place of an item."""
    name, _, frame, (*_, latitude, longitude, height_m) = item
    if frame not in (*IN_DEGREES, NOWHERE):
        degrees = ", ".join(map(str, sorted(IN_DEGREES)))
        words = f"one of {degrees}, with degrees; local frames, such as 1, have metres"
        yield Fault(f"{name}, frame", shown(frame), words, source)
    elif not math.isnan(latitude + longitude) and not on_earth(longitude, latitude):
        yield Fault(name, shown((longitude, latitude)), EARTH, source)
    if not COORDINATE.accepts(height_m):
        height = "null" if math.isnan(height_m) else shown(height_m)
        yield Fault(f"{name}, height", height, COORDINATE.words, source)


def _steps(
    items: Iterable[MavlinkItem],
    home: tuple[float, float, float],
    speed_m_s: float,
    notes: list[str],
) -> list[StatedStep]:
    """The steps of items without faults, each at the speed that is then set."""
    steps = list[StatedStep]()
    for item in items:
        name, command, frame, numbers = item
        if command in DELAYS and steps and numbers[0] > 0.0:
            steps[-1] = steps[-1]._replace(stay_s=steps[-1].stay_s + numbers[0])
        elif command == CHANGE_SPEED and not item.no_change:
            speed_m_s = numbers[1]
        elif command == CHANGE_SPEED and numbers[0] in VERTICAL:
            which = VERTICAL[numbers[0]]
            notes.append(f"{name} sets the speed of {which}, which are flown at the mission's own")
        if command in {*SILENT, *DELAYS, CHANGE_SPEED}:
            continue
        if command not in KINDS:
            notes.append(f"{name} has command {command}, which is not flown")
            continue
        kind = KINDS[command]
        if command == TAKE_OFF and steps and steps[-1].kind == "land":
            steps[-1] = steps[-1]._replace(kind="rest")
        elif command == LOITER_FOR_EVER:
            notes.append(f"{name} loiters without end: the flight is judged until it gets there")
        elif command in (LOITER_TURNS, LOITER_TO_ALTITUDE, SPLINE):
            notes.append(f"{name} is flown as a waypoint, by a straight line")
        if frame in TERRAIN:
            notes.append(f"{name} has its height over terrain; optuav measures it from home")
        stay_s = numbers[0] if command in (WAYPOINT, LOITER_TIME) and numbers[0] > 0.0 else 0.0
        speed = math.nan if command == TAKE_OFF else speed_m_s
        longitude, latitude = numbers[5:3:-1] if item.elsewhere else (math.nan, math.nan)
        step = StatedStep(
            name, "hover" if stay_s else kind, longitude, latitude, numbers[6],
            "sea" if frame in ABSOLUTE else "home", stay_s, speed,
        )  # fmt: skip
        if command == RETURN:
            longitude, latitude = home[:2]
            step = step._replace(
                longitude_deg=longitude, latitude_deg=latitude, height_m=0.0, over="home"
            )
        steps.append(step)
    return steps
