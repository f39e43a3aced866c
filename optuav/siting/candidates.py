"""Candidates for places of lasers: points of a GeoJSON file, or of a grid."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, collected, printable, refuse, require
from optuav.fields import COORDINATE, Range
from optuav.mission import Mission
from optuav.mission.earth import DEGREES, stated_system, system_in_metres
from optuav.mission.files import label, parse_json, read_text, refusal
from optuav.mission.formats import named
from optuav.mission.messages import misfits, path_of, shown
from optuav.network.map_extent import scene

GRID = "grid"
GRID_STEPS = 10.0  # Steps of a grid along its longer side, if no step is set
STEP = Range("m", gt=0.0, le=1e6)
MOST_CANDIDATES = 10_000  # Candidates of a grid
LARGEST_FILE = 32_000_000  # Bytes of a file
ANGLES = Range("deg", ge=-180.0, le=180.0), Range("deg", ge=-90.0, le=90.0)
POINTS = "a Point: longitude and latitude [deg] in WGS 84"
LONGITUDE_FIRST = "a longitude, |x| <= 180, and then a latitude, |x| <= 90 [deg], in WGS 84"
NO_EARTH = "is missing; candidates of a map need the mission's place on Earth: crs, or [earth]"
CONVERTS = "ogr2ogr -f GeoJSON, which comes with GDAL, converts other maps"
OF_A_SITE = re.compile(r"(^Site \d+| \(site \d+\))$")
"""Number of a site in a name that `Siting.save` wrote, which is another one the next time."""


class Candidates(NamedTuple):
    """Points (site, 3) [m], and their names, empty where a point has none; none of a grid."""

    position_m: Floats
    names: tuple[str, ...] = ()


class CandidatePoint(NamedTuple):
    """A point of a file, by its angles [deg]; as high as the laser where z is None [m]."""

    longitude_deg: float
    latitude_deg: float
    z_m: float | None
    name: str


def points_of(source: str | Path, step_m: float | None = None) -> list[CandidatePoint] | None:
    """Return the points of a GeoJSON file, None of a grid; refused with all faults."""
    faults, points = list[Fault](), None
    if step_m is not None:
        faults += misfits(("step_m", step_m, STEP))
    if source != GRID:
        if step_m is not None and not faults:
            faults.append(Fault("step_m", shown(step_m), "goes with candidates 'grid'"))
        with collected(faults):
            points = _read(path_of(source, "candidates"))
    refuse(faults)
    return points


def candidates_of(
    source: str | Path, missions: Sequence[Mission], step_m: float | None = None
) -> Candidates:
    """Return the points of a grid around the missions, or of a GeoJSON file.

    They are as high as the laser of the first mission, but for points with a property ``z_m``.
    """
    laser, points = missions[0].laser, points_of(source, step_m)
    height_m = laser.position_m[2] if laser else 0.0
    if points is None:
        return Candidates(_grid(missions, step_m, height_m))
    return _on_plane(points, missions, height_m, label(path_of(source, "candidates")))


def _grid(missions: Sequence[Mission], step_m: float | None, height_m: float) -> Floats:
    """Points at one distance over all places of the missions."""
    corners_m = np.array([scene(mission).corners_m for mission in missions])
    low_m, high_m = corners_m[:, 0].min(axis=0), corners_m[:, 1].max(axis=0)
    step = float((high_m - low_m).max()) / GRID_STEPS if step_m is None else step_m
    columns, rows = (np.floor((high_m - low_m) / step + 1e-9).astype(int) + 1).tolist()
    if columns * rows > MOST_CANDIDATES:
        words = f"makes {columns} × {rows} candidates, at most {MOST_CANDIDATES}: set a larger step"
        raise InputError([Fault("step_m", shown(step_m), words)])
    x_m, y_m = (low + step * np.arange(n) for low, n in zip(low_m, (columns, rows), strict=True))
    points = np.meshgrid(x_m, y_m)
    return np.column_stack(
        [points[0].ravel(), points[1].ravel(), np.full(rows * columns, height_m)]
    )


def _read(path: Path) -> list[CandidatePoint]:
    """Points of a GeoJSON file."""
    if path.suffix.lower() not in (".geojson", ".json"):
        words = f'"{GRID}", or a file of points that ends in .geojson or .json; {CONVERTS}'
        raise InputError([Fault("candidates", shown(str(path)), words)])
    text = read_text(path, LARGEST_FILE)
    what = named(text.encode())
    if what is not None and what.name == "KML":
        raise refusal(path, f"is KML; {CONVERTS}")
    document = parse_json(text, label(path))
    if what is not None and not (isinstance(document, dict) and "features" in document):
        raise refusal(path, f"is {what.name}, where a GeoJSON of points is needed")
    return _points(document, label(path))


def _on_plane(
    points: Sequence[CandidatePoint], missions: Sequence[Mission], height_m: float, source: str
) -> Candidates:
    """Points on the plane of the missions; needs pyproj."""
    without = [mission for mission in missions if stated_system(mission) is None]
    refuse(Fault("crs", "", NO_EARTH, printable(mission.name)) for mission in without)
    systems = {stated_system(mission) for mission in missions}
    if len(systems) > 1:
        raise InputError([Fault("crs", "", "the same for all missions")])
    require("pyproj", "candidates of a map")
    import pyproj

    (crs,) = systems
    assert crs is not None
    ahead = pyproj.Transformer.from_crs(DEGREES, system_in_metres(crs), always_xy=True)
    x_m, y_m = ahead.transform(
        [point.longitude_deg for point in points], [point.latitude_deg for point in points]
    )
    z_m = [height_m if point.z_m is None else point.z_m for point in points]
    words = f"a place whose x and y around the mission are each {COORDINATE.words}"
    words += "; longitude comes before latitude"
    refuse(
        Fault(
            f"features[{number}].geometry",
            shown([point.longitude_deg, point.latitude_deg]),
            words,
            source,
        )
        for number, (point, *at_m) in enumerate(zip(points, x_m, y_m, strict=True))
        if not all(map(COORDINATE.accepts, at_m))
    )
    return Candidates(np.column_stack([x_m, y_m, z_m]), tuple(point.name for point in points))


def _points(document: Any, source: str) -> list[CandidatePoint]:
    """The point of each feature; refused with all faults."""
    features: Any = document.get("features") if isinstance(document, dict) else None
    if features == []:
        raise InputError([Fault("features", "an empty list", f"needs {POINTS}", source)])
    if not isinstance(features, list):
        raise InputError(
            [Fault("", "", f"needs a FeatureCollection, each feature with {POINTS}", source)]
        )
    faults, points = list[Fault](), list[CandidatePoint]()
    system = str(document.get("crs") or "CRS84")
    if "CRS84" not in system and "4326" not in system:
        faults.append(Fault("crs", system, "longitudes and latitudes in WGS 84", source))
    for number, feature in enumerate(features):
        table = feature if isinstance(feature, dict) else {}
        shape: Any = table.get("geometry")
        facts: Any = table.get("properties") or {}
        at: Any = shape.get("coordinates") if isinstance(shape, dict) else None
        kind: Any = shape.get("type") if isinstance(shape, dict) else None
        whole = isinstance(at, list) and len(at) in (2, 3)
        wrong = None
        if kind != "Point":
            value = "null" if shape is None else shown(shape if kind is None else kind)
            wrong = Fault(f"features[{number}].geometry", value, POINTS, source)
        elif not (whole and all(x.accepts(y) for x, y in zip(ANGLES, at, strict=False))):
            wrong = Fault(f"features[{number}].geometry", shown(at), LONGITUDE_FIRST, source)
        if wrong:
            faults.append(wrong)
        z_m = facts.get("z_m", 0.0) if isinstance(facts, dict) else None
        if not COORDINATE.accepts(z_m):
            where = f"features[{number}].properties.z_m"
            faults.append(Fault(where, shown(z_m), COORDINATE.words, source))
        elif not wrong:
            name = facts.get("name", facts.get("Name"))
            name_of_site = "" if name is None else OF_A_SITE.sub("", f"{name}")
            height_m = float(z_m) if "z_m" in facts else None
            points.append(CandidatePoint(float(at[0]), float(at[1]), height_m, name_of_site))
    refuse(faults)
    return points
