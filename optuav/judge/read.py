"""Read the subject of a judgement: a plan of ours, or an itinerary of anybody's."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError, printable
from optuav.judge.timeline import STOP, Itinerary, stop_breaches
from optuav.mission import Mission, load, shipped
from optuav.mission.files import label, parse_json, parse_toml, read_text, resolve_from
from optuav.mission.load import is_name
from optuav.mission.messages import nearest, path_of, shown
from optuav.mission.validation import Breach, Document, StatedMission, format_breaches
from optuav.plan import Plan, Stop
from optuav.plan.plan import KIND, LARGEST_BYTES, parse_plan

MOST_STOPS = 10_000  # Largest number of stops of an itinerary

KEYS = {
    "mission": "the name of a shipped mission, a path relative to this file, or a whole mission",
    "stops": f"tables [[stops]], each {STOP}; at most {MOST_STOPS}, or stops = []",
}
"""Keys of an itinerary's file beside its schema."""


def read(
    stated: Plan | Itinerary | Mapping[str, object] | str | Path,
) -> tuple[str, Plan | Itinerary, Mapping[str, Any]]:
    """Return the name of a source, its plan or itinerary, and the data of a plan's file."""
    if isinstance(stated, Plan | Itinerary):
        return printable(stated.mission.name), stated, {}
    if isinstance(stated, Mapping):
        document, here, source = {str(k): value for k, value in stated.items()}, Path(), "a dict"
        if document.get("kind") == KIND:
            plan, data = parse_plan(json.dumps(document, default=str), source, here)
            return printable(plan.mission.name), plan, data
        itinerary = _itinerary(document, here, source)
        return printable(itinerary.mission.name), itinerary, {}
    words = "a Plan, an Itinerary of a mission and its stops, a dict, or the path of a file"
    file = path_of(stated, "plan", words)
    advice = "; it is a shipped mission: use optuav solve" if str(file) in shipped() else ""
    text, source = read_text(file, LARGEST_BYTES, hint=advice), label(file)
    if file.suffix != ".json" and not text.lstrip().startswith("{"):
        return source, _itinerary(parse_toml(text, source), file.parent, source), {}
    content = None if KIND in text else parse_json(text, source)
    if isinstance(content, dict) and "stops" in content and "phases" not in content:
        return source, _itinerary(content, file.parent, source), {}
    return source, *parse_plan(text, source, file.parent)


def _itinerary(document: Document, folder: Path, source: str) -> Itinerary:
    """The itinerary that a document states, or an `InputError` with all faults."""
    if not KEYS.keys() & document.keys() and {"extends", "limits", "route"} & document.keys():
        words = "is a mission, not an itinerary: use optuav solve or validate"
        raise InputError([Fault("", "", words, source)])
    name, stops = document.get("mission"), document.get("stops", ())
    faults, breaches, mission = list[Fault](), format_breaches(document), None
    for key in {**KEYS, **document}:
        if key not in ("schema", *KEYS):
            breaches.append(Breach((key,), f"unknown key{nearest(key, KEYS)}"))
        elif key in KEYS and key not in document:
            breaches.append(Breach((key,), f"is missing; {KEYS[key]}"))
    if isinstance(name, str | dict) and name:
        try:
            if isinstance(name, dict):
                mission = Mission.from_dict(name)
            else:
                mission = load(name if is_name(name) else resolve_from(folder, name))
        except InputError as error:
            for fault in error.faults:
                if isinstance(name, dict):
                    faults.append(replace(fault, key=f"mission.{fault.key}", source=source))
                elif fault.key:
                    faults.append(fault)
                else:  # of a missing file, not inside it
                    faults.append(Fault("mission", shown(name), fault.allowed, source))
    else:
        breaches.append(Breach(("mission",), KEYS["mission"]))
    if isinstance(stops, list) and len(stops) <= MOST_STOPS:
        breaches += stop_breaches(stops, mission)
    else:
        breaches.append(Breach(("stops",), KEYS["stops"]))
    faults = [*StatedMission(document, {(): source}).faults(breaches), *faults]
    if faults or mission is None:
        raise InputError(faults)
    return Itinerary(mission, tuple(Stop(**stop) for stop in stops))
