"""Candidates for places of lasers: points of a GeoJSON file, or of a grid."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, require
from optuav.fields import Range
from optuav.mission import Mission
from optuav.mission.earth import DEGREES, stated_system, system_in_metres
from optuav.mission.files import label, parse_json, read_text
from optuav.mission.messages import path_of, shown
from optuav.network.map_extent import scene

GRID = "grid"
STEPS = 10.0  # Of a grid along its longer side, where no step is stated
STEP = Range("m", gt=0.0, le=1e6)
HEIGHT = Range("m", ge=-1e6, le=1e6)
MOST_CANDIDATES = 10_000  # Candidates of a grid
LARGEST = 32_000_000  # Bytes of a file
ANGLES = Range("deg", ge=-180.0, le=180.0), Range("deg", ge=-90.0, le=90.0)
POINTS = "a Point: longitude and latitude [deg] in WGS 84"


class Candidates(NamedTuple):
    """Points (site, 3) [m], and their names, empty where a point has none; none of a grid."""

    position_m: Floats
    names: tuple[str, ...] = ()


def candidates_of(
    source: str | Path, missions: Sequence[Mission], step_m: float | None = None
) -> Candidates:
    """Return the points of a grid around the missions, or of a GeoJSON file.

    They are as high as the laser of the first mission, but for points with a property ``z_m``.
    """
    laser = missions[0].laser
    height_m = laser.position_m[2] if laser else 0.0
    if source == GRID:
        return Candidates(_grid(missions, step_m, height_m))
    if step_m is not None:
        raise InputError([Fault("step_m", shown(step_m), "goes with candidates 'grid'")])
    return _read(path_of(source, "candidates"), missions, height_m)


def _grid(missions: Sequence[Mission], step_m: float | None, height_m: float) -> Floats:
    """Points at one distance over all places of the missions."""
    corners_m = np.array([scene(mission).corners_m for mission in missions])
    low_m, high_m = corners_m[:, 0].min(axis=0), corners_m[:, 1].max(axis=0)
    step = float((high_m - low_m).max()) / STEPS if step_m is None else step_m
    columns, rows = (np.floor((high_m - low_m) / step + 1e-9).astype(int) + 1).tolist()
    if columns * rows > MOST_CANDIDATES:
        words = f"a larger step: at most {MOST_CANDIDATES} candidates"
        raise InputError([Fault("step_m", f"{columns} × {rows} candidates", words)])
    x_m, y_m = (low + step * np.arange(n) for low, n in zip(low_m, (columns, rows), strict=True))
    points = np.meshgrid(x_m, y_m)
    return np.column_stack(
        [points[0].ravel(), points[1].ravel(), np.full(rows * columns, height_m)]
    )


def _read(path: Path, missions: Sequence[Mission], height_m: float) -> Candidates:
    """Points of a GeoJSON file on the plane of the missions; needs pyproj."""
    if path.suffix.lower() not in (".geojson", ".json"):
        words = f'"{GRID}", or a file of points that ends in .geojson or .json'
        raise InputError([Fault("candidates", shown(str(path)), words)])
    document = parse_json(read_text(path, LARGEST), label(path))
    systems = {stated_system(mission) for mission in missions}
    if len(systems) > 1 or None in systems:
        words = "the same for all missions, or [earth]: candidates of a map need a place on Earth"
        raise InputError([Fault("crs", "", words)])
    require("pyproj", "candidates of a map")
    import pyproj

    points = np.array([*_points(document, label(path), height_m)])
    (crs,) = systems
    ahead = pyproj.Transformer.from_crs(DEGREES, system_in_metres(crs), always_xy=True)
    position_m = np.column_stack([*ahead.transform(*points[:, :2].T.tolist()), points[:, 2]])
    facts = (feature.get("properties") or {} for feature in document["features"])
    stated = (each.get("name", each.get("Name")) for each in facts)
    return Candidates(position_m, tuple("" if name is None else f"{name}" for name in stated))


def _points(document: Any, source: str, height_m: float) -> Iterator[tuple[float, float, float]]:
    """Yield longitude, latitude [deg] and z [m] of each feature."""
    features: Any = document.get("features") if isinstance(document, dict) else None
    if features == []:
        raise InputError([Fault("features", "an empty list", f"needs {POINTS}", source)])
    if not isinstance(features, list):
        raise InputError(
            [Fault("", "", f"needs a FeatureCollection, each feature with {POINTS}", source)]
        )
    stated = str(document.get("crs") or "CRS84")
    if "CRS84" not in stated and "4326" not in stated:
        raise InputError([Fault("crs", stated, "longitudes and latitudes in WGS 84", source)])
    for number, feature in enumerate(features):
        table = feature if isinstance(feature, dict) else {}
        shape: Any = table.get("geometry")
        facts: Any = table.get("properties") or {}
        at: Any = shape.get("coordinates") if isinstance(shape, dict) else None
        whole = isinstance(at, list) and len(at) in (2, 3) and shape.get("type") == "Point"
        if not (whole and all(limits.accepts(x) for limits, x in zip(ANGLES, at, strict=False))):
            where = f"features[{number}].geometry"
            raise InputError([Fault(where, shown(at), POINTS, source)])
        z_m = facts.get("z_m", height_m) if isinstance(facts, dict) else None
        if not HEIGHT.accepts(z_m):
            where = f"features[{number}].properties.z_m"
            raise InputError([Fault(where, shown(z_m), HEIGHT.words, source)])
        yield float(at[0]), float(at[1]), float(z_m)
