"""Files of placed lasers: maps, and missions with their laser."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from optuav.export import shapes
from optuav.mission.files import ending_of, refusals, write_text
from optuav.mission.messages import path_of
from optuav.plan.export import MAPS, NO_GEOID, altitude_m_of, positions_on_earth

if TYPE_CHECKING:
    from optuav.siting.place_laser import Siting


def save(siting: Siting, path: str | Path) -> Path:
    """Write the lasers on a map; see `Siting.save`."""
    file, mission = path_of(path), siting.missions[0]
    suffix = ending_of(file, *MAPS)
    sites, positions = siting.selection.sites, positions_on_earth(mission, siting.position_m)
    moved_m = np.linalg.norm(siting.position_m - siting.candidates_m[[*sites]], axis=1)
    marks = list[shapes.Mark]()
    for number, (site, position) in enumerate(zip(sites, positions, strict=True)):
        serves, moved = int((siting.laser == number).sum()), float(moved_m[number])
        facts = {"site": site, "serves": serves, "moved_m": moved}
        marks.append(shapes.Mark(f"Site {site}", position, facts))
    notes = str(siting).splitlines()
    if suffix == ".kml":
        text = shapes.marked_kml(mission.name, notes, altitude_m_of(mission), marks)
    else:
        flat = any(position.ellipsoid_m is None for position in positions)
        text = shapes.marked_geojson(mission.name, [*notes, *([NO_GEOID] if flat else [])], marks)
    write_text(file, text)
    return file


def save_missions(siting: Siting, directory: str | Path) -> list[Path]:
    """Write every mission with its laser; see `Siting.save_missions`."""
    folder, count = path_of(directory, "directory"), len(siting.missions)
    with refusals(folder, "made"):
        folder.mkdir(parents=True, exist_ok=True)
    written = list[Path]()
    for number in range(count):
        mission = siting.mission(number)
        name = re.sub(r"[^\w-]+", "-", mission.name).strip("-") or "mission"
        file = folder / f"{name}{f'-{number}' * (count > 1)}.toml"
        written.append(mission.save(file))
    return written
