"""Parts of a mission as tables that a notebook folds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from xml.etree.ElementTree import Element

from optuav.fields import MissionSection
from optuav.markup import MOST_ROWS, element, folded, pairs, paragraph, shown, table
from optuav.tables import Building


def html(
    facts: Mapping[str, str],
    description: str,
    sections: Mapping[str, MissionSection],
    buildings: Sequence[Building],
) -> str:
    """A mission as HTML: facts, its description, and one folded table for each of its parts."""
    about = [paragraph(description)] if description else []
    tables = [folded(name, _keys(section)) for name, section in sections.items()]
    roofs = folded(f"buildings ({len(buildings)})", _table(buildings))
    return shown(pairs(facts.items()), *about, *tables, roofs)


def buildings_html(buildings: Sequence[Building]) -> str:
    """The table of the first buildings as HTML."""
    return shown(_table(buildings))


def _keys(section: MissionSection) -> Element:
    """The keys of a part of the mission, with their values and meanings."""
    rows = [(element("code", key), _written(value), words) for key, value, words in stated(section)]
    return table(("key", "value", "meaning"), rows)


def stated(section: MissionSection) -> Iterator[tuple[str, object, str]]:
    """The keys of a part of the mission that have a value, with it and its meaning."""
    words = type(section).descriptions()
    for key, value in section:
        if value is not None:
            yield key, value, words.get(key, "")


def _table(buildings: Sequence[Building]) -> Element:
    """The first buildings: where they are, and their footprints."""
    first = buildings[:MOST_ROWS]
    rows = [
        (building.name, *map(_written, building.position_m), _footprint(building.footprint_m))
        for building in first
    ]
    heads = ("name", "x [m]", "y [m]", "z of the roof [m]", "footprint [m]")
    return table(heads, rows, hidden=len(buildings) - len(first))


def _footprint(stated: object) -> str:
    """A size or how many corners a polygon has."""
    if not isinstance(stated, tuple):
        return "–"
    if isinstance(stated[0], tuple):
        return f"polygon of {len(stated)} corners"
    return " × ".join(map(_written, stated))


def _written(value: object) -> str:
    """A value of a mission as a file states it, numbers as short as they are exact."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_written, value))})"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.10g}".replace("-", "−")
    return str(value)
