"""Lines and points of KML 2.2 as a flight."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from optuav.errors import Fault, InputError, decimal
from optuav.judge.stated_flight import EARTH, MOST_PLACES, Kind, StatedFlight, StatedStep, on_earth
from optuav.mission.files import label, refusal
from optuav.mission.messages import shown


def kml_flight(text: str, file: Path) -> StatedFlight:
    """The lines and points of KML, in the order of the file."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise refusal(file, "is KML with definitions of its own, which are not read")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise refusal(file, f"is damaged or cut off at line {line}, column {column}") from None
    steps, notes, home = list[StatedStep](), list[str](), None
    has_lines = any(mark.tag.rpartition("}")[2] == "LineString" for mark in root.iter())
    for mark in root.iter():
        if mark.tag.rpartition("}")[2] != "Placemark":
            continue
        facts = {
            element.tag.rpartition("}")[2]: (element.text or "").strip() for element in mark.iter()
        }
        if "LinearRing" in facts or not {"LineString", "Point"} & facts.keys():
            continue
        name, is_line = facts.get("name") or f"placemark {len(steps) + 1}", "LineString" in facts
        seconds = re.match(r"([\d.]+) s\b", facts.get("description", ""))
        fastest = re.search(r"at most ([\d.]+) m/s", facts.get("description", ""))
        if has_lines and not (is_line or seconds):
            continue  # A label beside the path
        mode = facts.get("altitudeMode", "clampToGround")
        if mode not in ("absolute", "relativeToGround"):
            if not has_lines:
                raise refusal(file, "has no line to fly along, and its points have no heights")
            words = "an altitudeMode, absolute or relativeToGround, with a height of each corner"
            raise InputError([Fault(name, shown(mode), words, label(file))])
        over: Literal["home", "sea"] = "sea" if mode == "absolute" else "home"
        places = list[tuple[float, float, float]]()
        for corner in facts.get("coordinates", "").split():
            with suppress(ValueError):
                x, y, *z = map(decimal, corner.split(","))
                places.append((x, y, z[0] if len(z) == 1 else math.nan))
        if not places or any(not (on_earth(x, y) and math.isfinite(z)) for x, y, z in places):
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
        if len(steps) > MOST_PLACES:
            raise refusal(file, f"has more than {MOST_PLACES} places")
    if home is None:
        raise refusal(file, "has no line or points to fly along: outlines make a map")
    (longitude, latitude, height_m), over = home
    if over == "home" and height_m > 0.0:
        notes.append("the path begins above the ground: a climb from below its begin is added")
        steps.insert(0, StatedStep("take-off", "take-off", math.nan, math.nan, height_m, over))
    altitude_m = height_m if over == "sea" else math.nan
    return StatedFlight((longitude, latitude), altitude_m, tuple(steps), tuple(notes))
