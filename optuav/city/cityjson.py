"""CityJSON: solids as outlines from above, with their heights.

The format: https://www.cityjson.org/specs/ (versions 1.0 to 2.0, and CityJSONSeq).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyproj
import shapely

from optuav.arrays import Floats
from optuav.city.columns import SOLID
from optuav.city.outlines import mended
from optuav.errors import Fault, InputError
from optuav.mission.files import refusal
from optuav.mission.maps import UNREADABLE, system_named, table
from optuav.mission.messages import first_ten, shown
from optuav.presentation.numbers import figure

FARTHEST = 1e9  # Coordinates [m or deg], more than any reference system has
DEEPEST = 10  # Parts within parts
BUILDING = re.compile(r"(\+.*)?Building(Part)?")  # Types of extensions begin with a plus sign
DEPTHS = {"MultiSurface": 0, "CompositeSurface": 0}
DEPTHS |= {"Solid": 1, "MultiSolid": 2, "CompositeSolid": 2}
"""How deep surfaces lie in the boundaries of a geometry; other types have no surfaces."""

Prism = tuple[list[Any], float, float]
"""Surfaces that have an area from above, and the lowest and the highest corner."""
NOTHING: Prism = ([], np.nan, np.nan)


def solids(parts: list[Any], file: Path) -> tuple[Any, tuple[str, ...]]:
    """Return the buildings of CityJSON as a table, and remarks on other objects.

    `parts` is a document, or the head and the features of a sequence. A building counts by those of
    its parts that have an outline, if some have. The outline is all that surfaces cover from above,
    at the highest level of detail that has any. The column `SOLID` is the height from the lowest
    corner of all parts of the building to the highest of the part, 0 where it is flat, in the unit
    of the file. The other columns hold attributes, such as `measuredHeight`.
    """
    at, rows, kinds = "type", list[tuple[Any, ...]](), Counter[str]()
    try:
        for part in parts:
            at = "vertices or transform"
            document = {**parts[0], **part}  # Features share scale, system and templates
            corners = _corners(document, file)
            at, objects, prisms = "CityObjects", document["CityObjects"], dict[str, Prism]()
            for name, thing in objects.items():
                at = f"CityObjects, {shown(name)}"
                if _is_building(thing):
                    prisms[name] = _prism(thing.get("geometry") or (), corners, document, file)
                else:
                    kinds[thing["type"]] += 1
            at, above = "CityObjects", _above(objects)
            wholes, by_parts = dict[str, list[str]](), set[str]()
            for name, (surfaces, *_) in prisms.items():
                at = f"CityObjects, {shown(name)}"
                wholes[name] = [*_wholes(name, above)]
                by_parts.update(wholes[name][1:] if surfaces else ())
            for name, prism in prisms.items():
                thing, (_, low_end, high_end) = objects[name], prism
                below = thing["type"].endswith("Part") and high_end > low_end  # Of parts on it
                if name not in by_parts or below:
                    attributes = thing.get("attributes") or {}
                    rows.append((name, wholes[name][-1], *prism, attributes))
        at, columns = "metadata or attributes", zip(*rows, strict=True) if rows else ((),) * 6
        names, whole, surfaces, low, high, facts = map(list, columns)
        if len({*names}) < len(names):
            raise refusal(file, "has several objects of one name")
        frame = table(facts, names, _from_above(surfaces, names, file), _crs(parts[0]), file)
        ground = pd.Series(low, dtype=float).groupby(whole).transform("min").to_numpy()
        frame[SOLID] = np.where(np.equal(low, high), 0.0, high - ground)
    except InputError:
        raise
    except UNREADABLE:
        raise refusal(file, f"is not CityJSON: {at} is not as specified") from None
    others = first_ten([f"{kind} ({count})" for kind, count in kinds.most_common()])
    return frame, (f"left out, as neither Building nor BuildingPart: {others}",) if kinds else ()


@np.errstate(over="ignore", invalid="ignore")
def _corners(document: dict[str, Any], file: Path) -> Floats:
    """The vertices of a document (vertex, 3)."""
    corners = np.array(document["vertices"], dtype=float).reshape(-1, 3)
    if grid := document.get("transform"):
        corners = corners * grid["scale"] + grid["translate"]
    return _near(corners, file)


def _near(corners: Floats, file: Path) -> Floats:
    """Corners, refused where they are on no map."""
    if not (np.abs(corners) < FARTHEST).all():
        raise refusal(file, f"has coordinates beyond {figure(FARTHEST)}")
    return corners


def _is_building(thing: dict[str, Any]) -> bool:
    """Return whether an object is a building or a part of one, also by an extension."""
    return bool(BUILDING.fullmatch(thing["type"]))


def _above(objects: Mapping[str, Any]) -> dict[str, str]:
    """The building that each part belongs to, which one of the two may state."""
    buildings = {name: building for name, building in objects.items() if _is_building(building)}
    above = {
        child: name
        for name, building in buildings.items()
        for child in building.get("children") or ()
    }
    for name, building in buildings.items():
        above.update((name, whole) for whole in building.get("parents") or () if whole in buildings)
    return above


def _wholes(name: str, above: Mapping[str, str]) -> Iterator[str]:
    """Yield a part, the building that it belongs to, and so on."""
    for _ in range(DEEPEST):
        yield name
        if name not in above:
            return
        name = above[name]
    raise ValueError


def _from_above(surfaces: list[list[Any]], names: list[str], file: Path) -> list[Any]:
    """The outline of each building from above, of no area where no surface has any."""
    counts = [*map(len, surfaces)]
    shapes = np.array([*chain.from_iterable(surfaces)], dtype=object)
    shapes, _ = mended(shapes, np.repeat(np.array(names, dtype=object), counts), file)
    ends = np.cumsum(counts, dtype=int)
    return [shapely.union_all(shapes[n - count : n]) for n, count in zip(ends, counts, strict=True)]


def _prism(geometries: Any, corners: Floats, document: dict[str, Any], file: Path) -> Prism:
    """The geometry with surfaces of the highest level of detail."""
    resolved = [_resolved(geometry, corners, document) for geometry in geometries]
    for shape, points, placed in sorted(resolved, key=_detail, reverse=True):
        if not (rings := [ring for ring in _outer_rings(shape) if len(ring) > 2]):
            continue
        used = np.concatenate([*map(np.array, rings)])
        if (used < 0).any():
            raise IndexError
        with np.errstate(over="ignore", invalid="ignore"):
            at = _near(points[used] @ placed[:3, :3].T + placed[:3, 3], file)
        seen = map(shapely.Polygon, np.split(at[:, :2], np.cumsum([*map(len, rings)])[:-1]))
        # Walls are lines from above.
        if flat := [polygon for polygon in seen if polygon.area > 0.0]:
            return flat, float(at[:, 2].min()), float(at[:, 2].max())
    return NOTHING


def _resolved(geometry: Any, corners: Floats, document: dict[str, Any]) -> tuple[Any, Floats, Any]:
    """A geometry, its vertices, and the matrix that places them; for an instance its template's."""
    placed = np.eye(4)
    if geometry.get("type") != "GeometryInstance":
        return geometry, corners, placed
    (anchor,), number = geometry["boundaries"], geometry["template"]
    if min(anchor, number) < 0:
        raise IndexError
    placed[:] = np.reshape(geometry["transformationMatrix"], (4, 4))
    placed[:3, 3] += corners[anchor]
    templates = document["geometry-templates"]
    points = np.array(templates["vertices-templates"], dtype=float).reshape(-1, 3)
    return templates["templates"][number], points, placed


def _detail(resolved: tuple[Any, ...]) -> float:
    """The level of detail of a geometry."""
    return float(resolved[0].get("lod", 0))


def _outer_rings(geometry: Any) -> Iterator[list[int]]:
    """The outer ring of every surface."""
    surfaces = geometry["boundaries"] if geometry.get("type") in DEPTHS else []
    for _ in range(DEPTHS.get(geometry.get("type"), 0)):
        surfaces = [*chain.from_iterable(surfaces)]
    return (surface[0] for surface in surfaces if surface)


def _crs(document: dict[str, Any]) -> pyproj.CRS | None:
    """Its reference system, such as ``EPSG:7415`` or two codes for plane and heights; or None."""
    name = (document.get("metadata") or {}).get("referenceSystem")
    if not name:
        return None
    system: pyproj.CRS | None = system_named(str(name))
    if system is not None:
        return system
    raise InputError([Fault("metadata.referenceSystem", shown(name), "a code of EPSG or OGC")])
