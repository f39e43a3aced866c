"""One mission stated on top of another: what ``extends`` and `Mission.replace` do.

Tables join key by key, anything else is replaced. A newly stated value also displaces what only
made sense with the old one, as a rate per minute does the rate per second.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from optuav.errors import Fault
from optuav.mission.messages import Key, StatedMission, nearest, shown
from optuav.mission.schema import CONVERSIONS, REGIME_KEYS
from optuav.mission.validation import KEYS, Document

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


def overlay(base: Document, stated: Document) -> dict[str, Any]:
    """Join two mission documents.

    Parameters
    ----------
    base
        Document underneath.
    stated
        What is stated on top of it; None removes a key.

    Returns
    -------
    dict
        A new document; the arguments stay as they are.
    """
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


def _both(base: Document, stated: Document) -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Tables that are in both documents, with their names."""
    for name, table in stated.items():
        below = base.get(name)
        if isinstance(below, dict) and isinstance(table, dict):
            yield name, below, table


def revise(base: Document, values: Document) -> tuple[StatedMission, list[Fault]]:
    """Apply values by dotted key, as in ``{"limits.deadline_s": 800}``.

    Parameters
    ----------
    base
        Complete document of a mission.
    values
        Value by dotted key; None removes an optional key, a table or a building.

    Returns
    -------
    statement
        What the mission states then, not yet validated.
    faults
        The keys that do not exist.
    """
    stated: dict[str, Any] = {}
    buildings: dict[str, Any] = {}
    faults: list[Fault] = []
    # Whole tables first, so that their keys can be stated beside them.
    for key, value in sorted(_by_key(values), key=lambda item: item[0].count(".")):
        name, _, field = key.partition(".")
        if key.startswith(("buildings.", "buildings[")):
            buildings[key] = value
        elif key not in _KEYS:
            faults.append(Fault(key, shown(value), f"unknown key{nearest(key, _KEYS)}"))
        elif field:
            stated[name] = {**_table(stated.get(name)), field: value}
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


def without_none(document: Document) -> dict[str, Any]:
    """The document without the keys that are None."""

    def stated(table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        return {key: value for key, value in table.items() if value is not None}

    tables = {name: stated(table) for name, table in document.items() if table is not None}
    if isinstance(tables.get("buildings"), list | tuple):
        tables["buildings"] = [stated(building) for building in tables["buildings"]]
    return tables


def _revise_buildings(buildings: list[Any], values: Document) -> Iterator[Fault]:
    """Apply values to a list in place; None takes the place of a building that is removed.

    Keys are ``buildings.b3``, ``buildings.b3.position_m`` or ``buildings[2].position_m``.
    """
    places = {str(_table(building).get("name")): n for n, building in enumerate(buildings)}
    for key, value in values.items():
        place, field = _place(key, places)
        if place is None or place >= len(buildings):
            known = [f"buildings.{name}" for name in places]
            yield Fault(key, shown(value), f"unknown building{nearest(key, known)}")
        elif field:
            buildings[place] = {**_table(buildings[place]), field: value}
        elif isinstance(value, dict):
            buildings[place] = {**_table(buildings[place]), **value}
        else:
            buildings[place] = value


def _place(key: str, places: Mapping[str, int]) -> tuple[int | None, str]:
    """Which building a dotted key means and which of its fields, empty for all of it."""
    if match := _BY_INDEX.fullmatch(key):
        return int(match[1]), match[2] or ""
    whole = key.removeprefix("buildings.")
    name, _, field = whole.rpartition(".")
    return (places[whole], "") if whole in places else (places.get(name), field)


def _table(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _by_key(values: Document) -> Iterator[tuple[str, Any]]:
    """Keys and values; models and NumPy's values, also in a list or table, as plain data."""
    for key, value in values.items():
        if isinstance(value, list | tuple):
            yield str(key), [_plain(item) for item in value]
        elif isinstance(value, dict):
            yield str(key), {name: _plain(item) for name, item in value.items()}
        else:
            yield str(key), _plain(value)


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json", exclude_none=True)
    return value.tolist() if hasattr(value, "tolist") else value
