"""A flight as a mission of MAVLink commands, for QGroundControl and for ArduPilot's tools.

An autopilot sets home where it arms, refuses a second take-off (PX4) or begins its mission anew
after a landing (ArduCopter): a mission holds one flight, with altitudes relative to its take-off
(https://mavlink.io/en/messages/common.html, commands MAV_CMD).
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from optuav.export import Flight, Position

WAYPOINT, LOITER_TIME, LAND, TAKE_OFF, CHANGE_SPEED = 16, 19, 21, 22, 178
GLOBAL, MISSION, RELATIVE = 0, 2, 3
"""Frames: altitude above mean sea level, no position, and altitude above home."""
GROUND_SPEED, KEEP_THROTTLE = 1.0, -1.0
QUADROTOR, ANY_AUTOPILOT = 2, 0
SLOWEST_M_S = 0.01  # A speed of 0 stops the UAV for ever
LEAST_CLIMB_M = 11.0  # PX4 takes no lower take-off: its acceptance radius of 10 m, and 1 m


class Item(NamedTuple):
    """A command with three parameters, and a place with its height above home [m]."""

    command: int
    parameters: tuple[float, float, float]
    position: Position | None = None
    height_m: float = 0.0


def items(flight: Flight, climb_m: float) -> Iterator[Item]:
    """Yield the commands after home: a climb above the take-off, and a descent from as high."""

    def at(command: int, point: Position, above_m: float = 0.0, stay_s: float = 0.0) -> Item:
        height_m = round(point.z_m - flight.start.z_m + above_m, 6)
        return Item(command, (stay_s, 0.0, 0.0), point, height_m)

    yield at(TAKE_OFF, flight.start, climb_m)
    for step in flight.steps:
        *_, end = step.way
        if step.kind == "hover":
            yield at(LOITER_TIME, end, stay_s=step.duration_s)
            continue
        if step.duration_s == 0.0 and step is not flight.steps[-1]:
            continue  # Between hovers at one point
        told_m_s = 0.0
        for point, level_m_s in zip(step.way[1:], step.level_speeds_m_s, strict=True):
            speed_m_s = max(level_m_s, SLOWEST_M_S)
            if speed_m_s != told_m_s:
                yield Item(CHANGE_SPEED, (GROUND_SPEED, speed_m_s, KEEP_THROTTLE))
            told_m_s, last = speed_m_s, point is end and step is flight.steps[-1]
            yield at(WAYPOINT, point, climb_m * last)
    yield at(LAND, flight.end)


def plan(
    flight: Flight,
    climb_m: float,
    altitude_m: float,
    notes: Sequence[str],
    judged_with: Mapping[str, object],
) -> str:
    """The mission as a plan of QGroundControl (its file format, version 1).

    QGroundControl skips notes, and the values that the flight was judged with, by their keys in a
    mission.
    """
    listed = []
    for number, (command, parameters, position, height_m) in enumerate(
        items(flight, climb_m), start=1
    ):
        item: dict[str, object] = {"autoContinue": True, "command": command, "doJumpId": number}
        place: list[float | None] = [0.0, 0.0, 0.0, 0.0]
        if position is not None:
            item |= {"AMSLAltAboveTerrain": None, "Altitude": height_m, "AltitudeMode": 1}
            # Without a heading the UAV keeps its own
            place = [None, position.latitude_deg, position.longitude_deg, height_m]
        frame = MISSION if position is None else RELATIVE
        item |= {"frame": frame, "params": [*parameters, *place], "type": "SimpleItem"}
        listed.append(item)
    longitude_deg, latitude_deg, z_m, _ = flight.start
    home = [latitude_deg, longitude_deg, round(z_m + altitude_m, 6)]
    fastest_m_s = max(
        SLOWEST_M_S, *(speed for step in flight.steps for speed in step.level_speeds_m_s)
    )
    document = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "optuav",
        "notes": notes,
        "judged_with": judged_with,
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": [], "version": 2},
        "mission": {
            **{"version": 2, "firmwareType": ANY_AUTOPILOT, "vehicleType": QUADROTOR},
            **{"cruiseSpeed": fastest_m_s, "hoverSpeed": fastest_m_s},
            **{"globalPlanAltitudeMode": 1, "plannedHomePosition": home, "items": listed},
        },
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def waypoints(flight: Flight, climb_m: float, altitude_m: float) -> str:
    """The mission as MAVLink's text of waypoints, version 110: twelve fields a line, no notes."""
    home = flight.start
    first = Item(WAYPOINT, (0.0, 0.0, 0.0), home, round(home.z_m + altitude_m, 6))
    lines = ["QGC WPL 110"]
    for number, item in enumerate([first, *items(flight, climb_m)]):
        command, parameters, position, height_m = item
        frame = MISSION if position is None else RELATIVE if number else GLOBAL
        place = (0.0, 0.0) if position is None else (position.latitude_deg, position.longitude_deg)
        figures = "\t".join(f"{figure:.9f}" for figure in (*parameters, 0.0, *place, height_m))
        lines.append(f"{number}\t{int(not number)}\t{frame}\t{command}\t{figures}\t1")
    return "\n".join(lines) + "\n"
