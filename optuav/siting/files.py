"""Files of placed lasers: maps, and missions with their laser."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.export import shapes
from optuav.mission import Mission
from optuav.mission.files import ending_of, refusals, write_text
from optuav.mission.messages import path_of
from optuav.plan.export import MAPS, NO_GEOID, altitude_m_of, positions_on_earth


class PlacedLaser(NamedTuple):
    """A laser's place: its name, its position (x, y, z) [m], and facts of it."""

    name: str
    position_m: Floats
    facts: dict[str, float]


def save(
    mission: Mission, sites: Sequence[PlacedLaser], notes: Sequence[str], path: str | Path
) -> Path:
    """Write lasers on a map; see `Siting.save`."""
    file = path_of(path)
    suffix = ending_of(file, *MAPS)
    positions = positions_on_earth(mission, np.array([site.position_m for site in sites]))
    marks = [
        shapes.MapPoint(site.name, position, site.facts)
        for site, position in zip(sites, positions, strict=True)
    ]
    if suffix == ".kml":
        text = shapes.marked_kml(mission.name, notes, altitude_m_of(mission), marks)
    else:
        flat = any(position.ellipsoid_m is None for position in positions)
        text = shapes.marked_geojson(mission.name, [*notes, *([NO_GEOID] if flat else [])], marks)
    write_text(file, text)
    return file


def save_missions(missions: Sequence[Mission], directory: str | Path) -> list[Path]:
    """Write missions, with their numbers if there are several; see `Siting.save_missions`."""
    folder, several = path_of(directory, "directory"), len(missions) > 1
    with refusals(folder, "made"):
        folder.mkdir(parents=True, exist_ok=True)
    written = list[Path]()
    for number, mission in enumerate(missions):
        name = re.sub(r"[^\w-]+", "-", mission.name).strip("-") or "mission"
        file = folder / f"{name}{f'-{number}' * several}.toml"
        written.append(mission.save(file))
    return written
