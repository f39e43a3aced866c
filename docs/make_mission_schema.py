"""Writes optuav/mission/mission.schema.json from the models of a mission.

Run it where a key changes: ``python docs/make_mission_schema.py``; a test compares.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from optuav.fields import RATE_PER_MINUTE
from optuav.flight.model import FLIGHTS
from optuav.laser.beam import BEAMS
from optuav.laser.fits import CONVERSIONS
from optuav.mission import Mission
from optuav.mission.forms import CHOICES, LISTS, SCHEMA, SECTIONS, TABLES, forms

FILE = Path(__file__).parents[1] / "optuav" / "mission" / "mission.schema.json"

_TWINS = {
    "battery": ("flow_rate_per_s", "flow_rate_per_min"),
    "laser": ("visibility_km", "attenuation_per_km"),
}
_ALTERNATIVES = {*CONVERSIONS[810], *(key for twins in _TWINS.values() for key in twins)}
"""Keys that are required only where what stands in for them is not stated."""


def json_schema() -> dict[str, Any]:
    """The schema that `optuav.json_schema` describes."""
    generated = _plain(Mission.model_json_schema(ref_template="#/definitions/{model}"))
    definitions: dict[str, Any] = generated["$defs"]
    by_key = [form for name in CHOICES for form in forms(name)]
    definitions |= {form.__name__: _plain(form.model_json_schema()) for form in by_key}
    definitions = dict(sorted(definitions.items()))
    for model in (Mission, *(form for name in TABLES for form in forms(name))):
        properties = (generated if model is Mission else definitions[model.__name__])["properties"]
        for key, words in model.descriptions().items():
            properties[key] = {"description": words, **properties[key]}
    definitions["Laser"]["properties"].pop("beam")  # It has none
    for name, definition in definitions.items():
        if name not in ("Building", "Device"):
            definition.pop("required", None)
    for name, twins in _TWINS.items():
        for form in forms(name):
            definitions[form.__name__]["not"] = {"required": list(twins)}
    definitions["BatteryPacks"]["properties"]["flow_rate_per_min"] = {
        "description": "Rate k_F at which charge flows between the wells [1/min].",
        "minimum": RATE_PER_MINUTE.ge,
        "maximum": RATE_PER_MINUTE.le,
        "type": "number",
    }
    properties: dict[str, Any] = generated["properties"]
    # Where a table states no model, any of them may be meant.
    for name in CHOICES:
        found = [{"$ref": f"#/definitions/{form.__name__}"} for form in forms(name)]
        properties[name] = {"anyOf": found}
    for key in ("name", "description"):
        properties[key].pop("default")
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Mission of optuav",
        "type": "object",
        "additionalProperties": False,
        "required": ["schema"],
        "properties": {
            "schema": {"description": "Version of the format.", "const": SCHEMA},
            "extends": {
                "description": "Shipped mission, or path relative to this file, that this file "
                "changes; [[buildings]] and [[devices]] replace the list.",
                "type": "string",
            },
            "buildings_file": {
                "description": "Table of buildings in place of [[buildings]], by its path relative "
                "to this file: .csv, .parquet, .gpkg or .geojson, in metres.",
                "type": "string",
            },
            "devices_file": {
                "description": "Table of devices in place of [[devices]], by its path relative to "
                "this file: .csv or .geojson, in metres.",
                "type": "string",
            },
            **properties,
        },
        "if": {"not": {"required": ["extends"]}},
        "then": _complete(),
        "definitions": definitions,
    }


def _complete() -> dict[str, Any]:
    """What a file needs that extends no other."""
    tables: dict[str, dict[str, Any]] = {
        name: {"required": [key for key in _required(section) if key not in _ALTERNATIVES]}
        for name, section in SECTIONS.items()
        if name not in ("wind", *LISTS, "receiver")
    }
    for name, twins in _TWINS.items():
        tables[name]["anyOf"] = [{"required": [twin]} for twin in twins]
    needed: dict[str, Any]
    known = {"properties": {"wavelength_nm": {"enum": list(CONVERSIONS)}}}
    needed = {"if": known, "else": {"required": list(CONVERSIONS[810])}}
    for beam in BEAMS.values():
        stated = {"properties": {"beam": {"const": beam.name}}, "required": ["beam"]}
        own = [key for key in _required(beam.table) if key not in _ALTERNATIVES]
        needed = {"if": stated, "then": {"required": own}, "else": needed}
    tables["laser"] |= needed
    by_default, *others = FLIGHTS.values()
    needed = {"required": [*by_default.needs]}
    for model in reversed(others):
        stated = {"properties": {"model": {"const": model.name}}, "required": ["model"]}
        keys = {"properties": {"flight": {"required": _required(model.table)}}}
        needed = {
            "if": {"properties": {"flight": stated}, "required": ["flight"]},
            "then": keys | ({"required": [*model.needs]} if model.needs else {}),
            "else": needed,
        }
    return {"required": _required(Mission), "properties": tables, **needed}


def _required(model: type[BaseModel]) -> list[str]:
    return [key for key, field in model.model_fields.items() if field.is_required()]


def _plain(node: Any) -> Any:
    """The schema without titles and null, which TOML has not, and with tuples as in draft 7."""
    if isinstance(node, list):
        return [_plain(item) for item in node]
    if not isinstance(node, dict):
        return node
    options = [option for option in node.pop("anyOf", ()) if option != {"type": "null"}]
    if len(options) == 1:
        node = options[0] | node
    elif options:
        node["anyOf"] = options
    if "prefixItems" in node:
        node["items"] = node.pop("prefixItems")
    dropped = {"title", *({"default"} if node.get("default") is None else ())}
    return {key: _plain(value) for key, value in node.items() if key not in dropped}


if __name__ == "__main__":
    FILE.write_text(json.dumps(json_schema(), indent=2) + "\n", "utf-8")
