"""One mission stated on top of another: what ``extends`` and `Mission.replace` do.

Tables join key by key, anything else is replaced. A newly stated value also displaces what only
made sense with the old one, as a rate per minute does the rate per second.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from pydantic import BaseModel

from optuav.errors import Fault
from optuav.mission.messages import Document, Key, StatedMission, keys_of, nearest, shown
from optuav.mission.schema import CONVERSIONS, REGIME_KEYS
from optuav.mission.validation import KEYS

_ENERGIES = frozenset({"flight_energy_J", "hover_energy_J"})

DISPLACED: dict[str, dict[str, frozenset[str]]] = {
    "battery": {
        "flow_rate_per_s": frozenset({"flow_rate_per_min"}),
        "flow_rate_per_min": frozenset({"flow_rate_per_s"}),
        "packs": _ENERGIES,
        "capacity_As": _ENERGIES,
        "schedule": frozenset({"period_s"}),
    },
    "laser": {
        "visibility_km": frozenset({"attenuation_per_km"}),
        "attenuation_per_km": frozenset({"visibility_km"}),
        "wavelength_nm": frozenset(CONVERSIONS[810]),
    },
    "flight": {"model": REGIME_KEYS},
}
"""By table, the keys that a new value of a key displaces unless they are stated with it."""

_KEYS = {"name", "description", *KEYS} | {
    f"{name}.{key}" for name, keys in KEYS.items() if name != "buildings" for key in keys
}

_BY_INDEX = re.compile(r"buildings\[(\d{1,9})\](?:\.(.*))?", re.DOTALL)


def overlay(base: Document, stated: Document) -> Document:
    """A new document: what is stated on top of a base, where None removes a key."""
    joined, gone = {**base, **stated}, displaced(base, stated)
    for name, below, table in _both(base, stated):
        kept = {key: value for key, value in below.items() if (name, key) not in gone}
        joined[name] = kept | table
    return joined


def displaced(base: Document, stated: Document) -> dict[Key, str]:
    """Keys that `overlay` displaces, each with the dotted key whose new value does."""
    return {
        (name, other): f"{name}.{key}"
        for name, below, table in _both(base, stated)
        for key, others in DISPLACED.get(name, {}).items()
        if table.get(key) is not None and table[key] != below.get(key)
        for other in others & below.keys() - table.keys()
    }


def _both(base: Document, stated: Document) -> Iterator[tuple[str, Document, Document]]:
    """Tables that are in both documents, with their names."""
    for name, table in stated.items():
        below = base.get(name)
        if isinstance(below, dict) and isinstance(table, dict):
            yield name, below, table


def revise(base: Document, values: Mapping[str, object]) -> tuple[StatedMission, list[Fault]]:
    """What a mission states after values by dotted key, not yet validated, and unknown keys.

    As in ``{"limits.deadline_s": 800}``, on top of the complete document of a mission; None removes
    an optional key, a table or a building.
    """
    stated: Document = {}
    buildings: Document = {}
    faults: list[Fault] = []
    # Whole tables first, so that their keys can be stated beside them.
    for key, value in sorted(_plain_items(values), key=lambda item: item[0].count(".")):
        name, _, field = key.partition(".")
        if key.startswith(("buildings.", "buildings[")):
            buildings[key] = value
        elif key not in _KEYS:
            faults.append(Fault(key, shown(value), f"unknown key{nearest(key, _KEYS)}"))
        elif field:
            stated[name] = {**keys_of(stated.get(name)), field: value}
        else:
            stated[name] = value
    document = overlay(base, stated)
    if buildings:
        listed = document.get("buildings")
        revised = list(listed) if isinstance(listed, list | tuple) else []
        faults += _revise_buildings(revised, buildings)
        if revised:
            document["buildings"] = [building for building in revised if building is not None]
    return StatedMission(without_none(document), displaced=displaced(base, stated)), faults


def without_none(document: Mapping[str, object]) -> Document:
    """The document without the keys that are None."""

    def stated(table: object) -> object:
        if not isinstance(table, dict):
            return table
        return {key: value for key, value in table.items() if value is not None}

    tables: Document = {
        name: stated(table) for name, table in document.items() if table is not None
    }
    if isinstance(tables.get("buildings"), list | tuple):
        tables["buildings"] = [stated(building) for building in tables["buildings"]]
    return tables


def _revise_buildings(buildings: list[object], values: Document) -> Iterator[Fault]:
    """Apply values to a list in place; None takes the place of a building that is removed.

    Keys are ``buildings.b3``, ``buildings.b3.position_m`` or ``buildings[2].position_m``.
    """
    numbers = {str(keys_of(building).get("name")): n for n, building in enumerate(buildings)}
    for key, value in values.items():
        number, field = _building(key, numbers)
        if number is None or number >= len(buildings):
            known = [f"buildings.{name}" for name in numbers]
            yield Fault(key, shown(value), f"unknown building{nearest(key, known)}")
        elif field:
            buildings[number] = {**keys_of(buildings[number]), field: value}
        elif isinstance(value, dict):
            buildings[number] = {**keys_of(buildings[number]), **value}
        else:
            buildings[number] = value


def _building(key: str, numbers: Mapping[str, int]) -> tuple[int | None, str]:
    """Which building a dotted key means and which of its fields, empty for all of it."""
    if match := _BY_INDEX.fullmatch(key):
        return int(match[1]), match[2] or ""
    whole = key.removeprefix("buildings.")
    name, _, field = whole.rpartition(".")
    return (numbers[whole], "") if whole in numbers else (numbers.get(name), field)


def _plain_items(values: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """Keys and values; models and NumPy's values, also in a list or table, as plain data."""
    for key, value in values.items():
        if isinstance(value, list | tuple):
            yield str(key), [_plain(item) for item in value]
        elif isinstance(value, dict):
            yield str(key), {name: _plain(item) for name, item in value.items()}
        else:
            yield str(key), _plain(value)


def _plain(value: object) -> object:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", exclude_none=True)
    return value.tolist() if hasattr(value, "tolist") else value
