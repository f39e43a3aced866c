"""CityJSON: solids as outlines from above, with their heights.

The format: https://www.cityjson.org/specs/ (versions 1.0 to 2.0).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pandas as pd
import pyproj
import shapely

from optuav.errors import Fault, InputError, printable
from optuav.mission.files import label, parse_json, read_text, refusal
from optuav.mission.messages import shown

LARGEST = 500_000_000  # bytes
FARTHEST = 1e9  # Coordinates [m or deg], more than any reference system has
MOST_VALUES = 100_000_000
KINDS = ("Building", "BuildingPart")


def solids(file: Path) -> Any:
    """The buildings of a CityJSON file as a table with outline and height; None if it is none.

    A building counts by its parts where it has some. The outline is all that its surfaces cover
    from above, at the highest level of detail; its height reaches from its lowest corner to its
    highest. The column `height` holds it; the others hold attributes, as `measuredHeight`.
    """
    document = parse_json(read_text(file, LARGEST), label(file), MOST_VALUES)
    if not isinstance(document, dict) or document.get("type") != "CityJSON":
        return None
    try:
        corners_m = np.array(document["vertices"], dtype=float).reshape(-1, 3)
        if grid := document.get("transform"):
            corners_m = corners_m * grid["scale"] + grid["translate"]
        if not (np.abs(corners_m) < FARTHEST).all():
            raise refusal(file, f"has coordinates beyond {FARTHEST:g}")
        found = [
            (name, *_prism(each["geometry"], corners_m), each.get("attributes", {}))
            for name, each in document["CityObjects"].items()
            if each["type"] in KINDS and each.get("geometry")
            if not _in_parts(each, document["CityObjects"])
        ]
        names, outlines, heights_m, attributes = zip(*found, strict=True) if found else ((),) * 4
        table = pd.DataFrame([*attributes], index=[*names]).assign(height=heights_m)
        return geopandas.GeoDataFrame(table, geometry=[*outlines], crs=_crs(document))
    except InputError:
        raise
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        words = f"is no CityJSON: {type(error).__name__}: {printable(str(error))}"
        raise refusal(file, words) from None


def _in_parts(building: dict[str, Any], objects: dict[str, Any]) -> bool:
    """Whether parts of a building have a geometry of their own."""
    return any(objects[child].get("geometry") for child in building.get("children", ()))


def _prism(geometries: list[dict[str, Any]], corners_m: Any) -> tuple[Any, float]:
    """Outline from above, and height [m]; of no area where no surface has any."""
    best = max(geometries, key=lambda each: float(each.get("lod", 0)))
    rings = [*_outer_rings(best["boundaries"])]
    seen = [shapely.Polygon(corners_m[ring, :2]) for ring in rings if len(ring) > 2]
    used_m = corners_m[np.concatenate([*map(np.array, rings)]), 2]
    # Walls are lines from above.
    outline = shapely.union_all([shapely.make_valid(each) for each in seen if each.area > 0.0])
    return outline, float(np.ptp(used_m))


def _outer_rings(boundaries: Any) -> Iterator[list[int]]:
    """The outer ring of every surface, however deep it lies."""
    if isinstance(boundaries[0][0], int):
        yield boundaries[0]
    else:
        for each in boundaries:
            yield from _outer_rings(each)


def _crs(document: dict[str, Any]) -> str | None:
    """Its reference system, as ``EPSG:7415``; None if it states none."""
    stated = document.get("metadata", {}).get("referenceSystem")
    if not stated:
        return None
    if found := re.search(r"EPSG\W+(?:[\d.]+\W+)?(\d{4,6})$", str(stated)):
        with suppress(pyproj.exceptions.CRSError):
            return str(pyproj.CRS.from_epsg(found[1]))
    raise InputError([Fault("metadata.referenceSystem", shown(stated), "a code of EPSG")])
