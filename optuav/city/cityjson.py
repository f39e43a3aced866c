"""CityJSON: solids as outlines from above, with their heights.

The format: https://www.cityjson.org/specs/ (versions 1.0 to 2.0).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyproj
import shapely

from optuav.city.outlines import mended
from optuav.errors import Fault, InputError
from optuav.mission.files import refusal
from optuav.mission.maps import UNREADABLE, table
from optuav.mission.messages import shown

FARTHEST = 1e9  # Coordinates [m or deg], more than any reference system has
DEEPEST = 10  # Parts within parts
KINDS = ("Building", "BuildingPart")


def solids(document: dict[str, Any], file: Path) -> Any:
    """The buildings of a CityJSON document as a table with outline and height.

    A building counts by its parts where it has some. The outline is all that its surfaces cover
    from above, at the highest level of detail; its height reaches from the lowest corner of all
    parts of the building to its own highest, 0 where it is flat. The column `height` holds it; the
    others hold attributes, such as `measuredHeight`.
    """
    at, rows = "vertices or transform", list[tuple[Any, ...]]()
    try:
        corners_m = np.array(document["vertices"], dtype=float).reshape(-1, 3)
        if grid := document.get("transform"):
            corners_m = corners_m * grid["scale"] + grid["translate"]
        if not (np.abs(corners_m) < FARTHEST).all():
            raise refusal(file, f"has coordinates beyond {FARTHEST:g}")
        at, objects = "CityObjects", document["CityObjects"]
        for name, each in objects.items():
            at = f"CityObjects, {shown(name)}"
            if each["type"] in KINDS and each.get("geometry") and not _in_parts(each, objects):
                prism = _prism(each["geometry"], corners_m)
                rows.append((name, _whole(name, objects), *prism, each.get("attributes", {})))
        columns = zip(*rows, strict=True) if rows else ((),) * 6
        names, wholes, surfaces, low_m, high_m, known = map(list, columns)
        outlines = _from_above(surfaces, names, file)
        at = "metadata"
        frame = table(known, names, outlines, _crs(document), file)
        ground_m = pd.Series(low_m, dtype=float).groupby(wholes).transform("min").to_numpy()
        frame["height"] = np.where(np.equal(low_m, high_m), 0.0, high_m - ground_m)
        return frame
    except InputError:
        raise
    except UNREADABLE:
        raise refusal(file, f"is not CityJSON: {at} is not as specified") from None


def _in_parts(building: dict[str, Any], objects: dict[str, Any]) -> bool:
    """Return whether parts of a building have a geometry of their own."""
    return any(objects[child].get("geometry") for child in building.get("children", ()))


def _whole(name: str, objects: Mapping[str, Any]) -> str:
    """The building that a part belongs to in the end."""
    for _ in range(DEEPEST):
        if not (above := objects[name].get("parents")):
            return name
        name = above[0]
    raise ValueError


def _from_above(surfaces: list[list[Any]], names: list[str], file: Path) -> list[Any]:
    """The outline of each building from above, of no area where no surface has any."""
    counts = [*map(len, surfaces)]
    shapes = np.array([*chain.from_iterable(surfaces)], dtype=object)
    shapes, _ = mended(shapes, np.repeat(np.array(names, dtype=object), counts), file)
    ends = np.cumsum(counts, dtype=int)
    return [shapely.union_all(shapes[n - count : n]) for n, count in zip(ends, counts, strict=True)]


def _prism(geometries: list[dict[str, Any]], corners_m: Any) -> tuple[list[Any], float, float]:
    """Surfaces that have an area from above, and the lowest and highest corner [m]."""
    best = max(geometries, key=lambda each: float(each.get("lod", 0)))
    rings = [*_outer_rings(best["boundaries"])]
    seen = [shapely.Polygon(corners_m[ring, :2]) for ring in rings if len(ring) > 2]
    used = np.concatenate([*map(np.array, rings)])
    if (used < 0).any():
        raise IndexError
    used_m = corners_m[used, 2]
    # Walls are lines from above.
    flat = [polygon for polygon in seen if polygon.area > 0.0]
    return flat, float(used_m.min()), float(used_m.max())


def _outer_rings(boundaries: Any) -> Iterator[list[int]]:
    """The outer ring of every surface, however deep it lies."""
    if isinstance(boundaries[0][0], int):
        yield boundaries[0]
    else:
        for boundary in boundaries:
            yield from _outer_rings(boundary)


def _crs(document: dict[str, Any]) -> str | None:
    """Its reference system, such as ``EPSG:7415``; None if it states none."""
    name = document.get("metadata", {}).get("referenceSystem")
    if not name:
        return None
    if found := re.search(r"EPSG\W+(?:[\d.]+\W+)?(\d{4,6})$", str(name)):
        with suppress(pyproj.exceptions.CRSError):
            return str(pyproj.CRS.from_epsg(found[1]))
    raise InputError([Fault("metadata.referenceSystem", shown(name), "a code of EPSG")])
