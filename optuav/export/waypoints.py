"""A course as a mission of MAVLink commands, for QGroundControl and for ArduPilot's tools.

Altitudes are relative to home, which is the origin. A stop on a roof is a landing, a delay and a
take-off (https://mavlink.io/en/messages/common.html, commands MAV_CMD).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import NamedTuple

from optuav.export import PlanOnEarth, Position

WAYPOINT, LOITER_TIME, LAND, TAKE_OFF, DELAY, CHANGE_SPEED = 16, 19, 21, 22, 93, 178
GLOBAL, MISSION, RELATIVE = 0, 2, 3
"""Frames: altitude above mean sea level, no position, and altitude above home."""
GROUND_SPEED, KEEP_THROTTLE, UNUSED = 1.0, -1.0, -1.0
QUADROTOR, ANY_AUTOPILOT = 2, 0
SLOWEST_M_S = 0.01  # A speed of 0 stops the UAV for ever


class Item(NamedTuple):
    """A command with four parameters; a NaN in the fourth keeps the heading."""

    command: int
    parameters: tuple[float, float, float]
    position: Position | None = None


def items(course: PlanOnEarth) -> Iterator[Item]:
    """Yield the commands after home."""
    yield Item(TAKE_OFF, (0.0, 0.0, 0.0), course.start)
    for step in course.steps:
        *_, end = step.way
        if step.kind == "flight":
            speed_m_s = max(step.peak_speed_m_s, SLOWEST_M_S)
            yield Item(CHANGE_SPEED, (GROUND_SPEED, speed_m_s, KEEP_THROTTLE))
            yield from (Item(WAYPOINT, (0.0, 0.0, 0.0), point) for point in step.way[1:])
        elif step.kind == "hover":
            yield Item(LOITER_TIME, (step.duration_s, 0.0, 0.0), end)
        else:
            yield Item(LAND, (0.0, 0.0, 0.0), end)
            yield Item(DELAY, (step.duration_s, UNUSED, UNUSED))
            yield Item(TAKE_OFF, (0.0, 0.0, 0.0), end)


def plan(course: PlanOnEarth) -> str:
    """The mission as a plan of QGroundControl (its file format, version 1)."""
    home_m = course.start.z_m
    listed = []
    for number, (command, parameters, position) in enumerate(items(course), start=1):
        item: dict[str, object] = {"autoContinue": True, "command": command, "doJumpId": number}
        place: list[float | None] = [0.0, 0.0, 0.0, 0.0]
        if position is not None:
            height_m = round(position.z_m - home_m, 6)
            item |= {"AMSLAltAboveTerrain": None, "Altitude": height_m, "AltitudeMode": 1}
            place = [None, position.latitude_deg, position.longitude_deg, height_m]
        elif command == DELAY:
            place[0] = UNUSED
        frame = MISSION if position is None else RELATIVE
        item |= {"frame": frame, "params": [*parameters, *place], "type": "SimpleItem"}
        listed.append(item)
    longitude_deg, latitude_deg, _ = course.start
    home = [latitude_deg, longitude_deg, round(home_m + course.altitude_m, 6)]
    fastest_m_s = max(SLOWEST_M_S, *(step.peak_speed_m_s for step in course.steps))
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "optuav",
        "notes": course.notes,
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
        "mission": {
            **{"version": 2, "firmwareType": ANY_AUTOPILOT, "vehicleType": QUADROTOR},
            **{"cruiseSpeed": fastest_m_s, "hoverSpeed": fastest_m_s},
            **{"globalPlanAltitudeMode": 1, "plannedHomePosition": home, "items": listed},
        },
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def waypoints(course: PlanOnEarth) -> str:
    """The mission as MAVLink's text of waypoints, version 110; lines with # are comments."""
    start, home_m = course.start, course.start.z_m
    rows = [(1, GLOBAL, WAYPOINT, (0.0, 0.0, 0.0), start[1], start[0], home_m + course.altitude_m)]
    for command, parameters, position in items(course):
        frame, place = MISSION, (0.0, 0.0, 0.0)
        if position is not None:
            frame = RELATIVE
            place = (position.latitude_deg, position.longitude_deg, position.z_m - home_m)
        rows.append((0, frame, command, parameters, *place))
    lines = ["QGC WPL 110", *(f"# {note}" for note in course.notes)]
    for number, (current, frame, command, parameters, *angles_and_height) in enumerate(rows):
        heading = UNUSED if command == DELAY else 0.0
        numbers = (*parameters, heading, *angles_and_height)
        figures = "\t".join(f"{parameter:.9f}" for parameter in numbers)
        lines.append(f"{number}\t{current}\t{frame}\t{command}\t{figures}\t1")
    return "\n".join(lines) + "\n"
