"""A mission as blocks: facts, and for a notebook tables of its parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from optuav.fields import MissionSection
from optuav.presentation.blocks import Block, Facts, Fold, Note, Table
from optuav.presentation.markup import MOST_ROWS
from optuav.presentation.numbers import figure
from optuav.tables import Building, Device


def blocks(
    facts: Mapping[str, str],
    description: str,
    sections: Mapping[str, MissionSection],
    devices: Sequence[Device],
    buildings: Sequence[Building],
) -> Iterator[Block]:
    """A mission: facts; in HTML its description, and one folded table for each of its parts."""
    yield Facts([*facts.items()])
    if description:
        yield Fold("", [Note([description])], in_text=False)
    for name, section in sections.items():
        yield Fold(name, [_keys(section)], in_text=False)
    if devices:
        yield Fold(f"devices ({len(devices)})", [_devices_table(devices)], in_text=False)
    yield Fold(f"buildings ({len(buildings)})", [buildings_table(buildings)], in_text=False)


def _keys(section: MissionSection) -> Table:
    """The keys of a part of the mission, with their values and meanings."""
    rows = [(key, _shown(value), words) for key, value, words in keys_with_values(section)]
    return Table(("key", "value", "meaning"), rows)


def keys_with_values(section: MissionSection) -> Iterator[tuple[str, object, str]]:
    """The keys of a part of the mission that have a value, with it and its meaning."""
    words = type(section).descriptions()
    for key, value in section:
        if value is not None:
            yield key, value, words.get(key, "")


def _devices_table(devices: Sequence[Device]) -> Table:
    """Where devices are, and what they state for themselves."""
    rows = [
        (
            device.name,
            *map(_shown, device.position_m),
            *map(_or_dash, (device.hover_m, device.share)),
        )
        for device in devices
    ]
    return Table(("name", "x [m]", "y [m]", "z [m]", "hover point [m]", "share [-]"), rows, last=1)


def _or_dash(value: object) -> str:
    """A value, or a dash where none is stated."""
    return "–" if value is None else _shown(value)


def buildings_table(buildings: Sequence[Building]) -> Table:
    """The first buildings: where they are, and their footprints."""
    first = buildings[:MOST_ROWS]
    rows = [
        (building.name, *map(_shown, building.position_m), _footprint(building.footprint_m))
        for building in first
    ]
    heads = ("name", "x [m]", "y [m]", "z of the roof [m]", "footprint [m]")
    more = len(buildings) - len(first)
    return Table(heads, rows, last=1, below=[f"and {more} more"] if more else [])


def _footprint(stated: object) -> str:
    """A size or how many corners a polygon has."""
    if not isinstance(stated, tuple):
        return "–"
    if isinstance(stated[0], tuple):
        return f"polygon of {len(stated)} corners"
    return " × ".join(map(_shown, stated))


def _shown(value: object) -> str:
    """A value of a mission as a file states it, numbers as short as they are exact."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_shown, value))})"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return figure(value, 10)
    return str(value)
