"""A mission in a few lines, and as tables that a notebook folds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element

from optuav.errors import printable
from optuav.fields import MissionSection
from optuav.markup import MOST_ROWS, element, folded, pairs, paragraph, shown, table
from optuav.mission.messages import counted

if TYPE_CHECKING:
    from optuav.mission.buildings import Buildings
    from optuav.mission.mission import Mission


def facts(mission: Mission) -> dict[str, str]:
    """Describe a mission in sentences by heading: what, where, how long, and with what."""
    route, limits, battery, laser = mission.route, mission.limits, mission.battery, mission.laser
    start, end, device = (
        f"({', '.join(f'{coordinate:g}' for coordinate in point)}) m"
        for point in (route.origin_m, route.destination_m, mission.link.device_m)
    )
    buildings = counted(len(mission.buildings), "building")
    source = f"a laser of {laser.power_W:g} W" if laser else "no laser"
    return {
        "Mission": f"{printable(mission.name)}: {buildings}, {source}",
        "Route": f"{start} to {end} within {limits.deadline_s:g} s",
        "Device": f"{device}, outage at most {limits.outage_probability:g}",
        "Battery": f"{battery.packs} × {battery.capacity_As:g} A s, {battery.schedule}, "
        f"at least {100 * limits.min_soc:g} % left",
        "Flight": f'model "{mission.flight.model}", {limits.min_altitude_m:g} to '
        f"{limits.max_altitude_m:g} m above ground",
    }


def html(mission: Mission) -> str:
    """The mission as HTML: its facts, and one folded table for each of its parts."""
    about = [paragraph(mission.description)] if mission.description else []
    sections = [
        folded(name, _keys(section))
        for name, section in mission
        if isinstance(section, MissionSection)
    ]
    buildings = folded(f"buildings ({len(mission.buildings)})", _table(mission.buildings))
    return shown(pairs(facts(mission).items()), *about, *sections, buildings)


def buildings_html(buildings: Buildings) -> str:
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


def _table(buildings: Buildings) -> Element:
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
