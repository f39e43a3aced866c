"""Maps in words, as plain data, and as files: GeoTIFF, and contours as GeoJSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.errors import Fault, InputError, require
from optuav.maps.positions import HoverMap
from optuav.mission.earth import DEGREES, system_in_metres
from optuav.mission.files import ending_of, write_files
from optuav.mission.messages import path_of, plural
from optuav.presentation.blocks import Block, Facts
from optuav.presentation.numbers import coordinates, figure, seconds
from optuav.service.calm_air import calm_facts
from optuav.solving.best_plans import REASONS
from optuav.studies.batch import LABELS

if TYPE_CHECKING:
    import pyproj
    import xarray

PRECISION_DEG = 1e-7  # Longitudes and latitudes, to a centimetre
UNEVEN = 1e-5  # Difference of distances of points that counts as none [m]
NO_MAP = "a map, as the functions of optuav.maps return it"
FORMATS = {".tif": "GeoTIFF", ".tiff": "GeoTIFF", ".geojson": "GeoJSON"}


def blocks(hover_map: HoverMap) -> Iterator[Block]:
    """Describe a map: its subject, where the hover is longest, and why some points have no plan."""
    facts, values = hover_map.facts, hover_map.solved.values["hover_time_s"]
    (height, width), places = values.shape, dict[str, str]()
    places["Map"] = f"{facts['mission']}, {facts['perspective']}: {facts['over']} on {width} × "
    places["Map"] += f"{height} points at z = {figure(facts['height_m'], 10)} m"
    for name, axis in ("x", hover_map.x), ("y", hover_map.y):
        places[name] = f"{figure(float(axis[0]), 10)} to {figure(float(axis[-1]), 10)} m"
    if "best_m" in facts:
        x, y, _ = facts["best_m"]
        edge = ", at the edge of the map" * (facts["best_at"] == "edge")
        places["Longest"] = f"{seconds(np.nanmax(values))} at {coordinates((x, y), 10)} m{edge}"
        if others := facts["best_points"] - 1:
            because = f"; {facts['best_because']}" if "best_because" in facts else ""
            places["Longest"] += f", and at {plural(others, 'other point')}{because}"
        places["Shortest"] = seconds(np.nanmin(values))
        places |= dict(calm_facts(facts.get("in_calm_air")))
    none = [("No plan", f"{plural(n, 'point')}: {why}") for n, why in _why(hover_map)]
    yield Facts([*places.items(), *none])


def to_dict(hover_map: HoverMap) -> dict[str, Any]:
    """A map as plain data for JSON, None without a plan."""
    values = {name: hover_map.solved.values[name].tolist() for name in ("hover_time_s", "reason")}
    values["hover_time_s"] = [
        [None if isnan(at) else at for at in row] for row in values["hover_time_s"]
    ]
    axes = {"x_m": hover_map.x.tolist(), "y_m": hover_map.y.tolist()}
    words = {"reason_words": [*REASONS.values()]}
    long_name, unit = LABELS["hover_time_s"]
    head = {"kind": "optuav map", "long_name": long_name, "units": unit}
    return {**head, **hover_map.facts, **axes, **values, **words}


def save(found: xarray.DataArray, path: str | Path) -> Path:
    """Write a map for geographic information systems; the same map gives the same bytes.

    Parameters
    ----------
    found
        A map, as the functions of `optuav.maps` return it.
    path
        The file. As .tif or .tiff a GeoTIFF of the hover times [s], NaN without a plan, north up,
        with the mission's reference system if it has one (needs rasterio). As .geojson the contours
        that a picture shows, in longitude and latitude, each with its hover time ``hover_time_s``
        (needs geopandas and matplotlib); the mission states its ``crs``. An existing file is
        replaced, whole or not at all.

    Returns
    -------
    Path
        The file that was written.

    Raises
    ------
    InputError
        If the file cannot be written or has another suffix, if a library is missing, or if the map
        has no reference system where it needs one, or one that is not in metres.

    Examples
    --------
    >>> import optuav, tempfile
    >>> hover_map = optuav.maps.laser("paper", 500)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     optuav.maps.save(hover_map, f"{folder}/laser.tif").name
    'laser.tif'
    """
    file = path_of(path)
    is_map = "over" in getattr(found, "attrs", {}) and {*found.dims} == {"x", "y"}
    if not is_map or min(found.shape) < 2:
        raise InputError([Fault("found", type(found).__name__, NO_MAP)])
    found = found.sortby(["x", "y"]).transpose("y", "x")
    kind = FORMATS[ending_of(file, *FORMATS)]
    write_files({file: _geotiff(found) if kind == "GeoTIFF" else _geojson(found)})
    return file


def _geotiff(dataset: xarray.DataArray) -> bytes:
    """The values as a picture of one band, whose first row is the northernmost."""
    require("rasterio", "GeoTIFFs")
    from rasterio.io import MemoryFile
    from rasterio.transform import Affine

    steps_m = [np.diff(dataset[axis]) for axis in ("x", "y")]
    if any(np.ptp(step_m) > UNEVEN for step_m in steps_m):
        words = "points at one distance each way, as a GeoTIFF needs them"
        raise InputError([Fault("found", type(dataset).__name__, words)])
    (across_m, up_m), (height, width) = (float(step_m.mean()) for step_m in steps_m), dataset.shape
    left, top, system = float(dataset.x[0]), float(dataset.y[-1]), _system(dataset)
    # The corner of the cell around the first point.
    corner = Affine(across_m, 0.0, left - across_m / 2, 0.0, -up_m, top + up_m / 2)
    options: dict[str, Any] = {"crs": system and system.to_wkt(), "transform": corner}
    options |= {"dtype": "float64", "nodata": np.nan, "compress": "deflate", "count": 1}
    with MemoryFile() as memory:
        with memory.open(driver="GTiff", height=height, width=width, **options) as file:
            # Before the values, to stand at the head of the file, which marks it as ours.
            file.update_tags(TIFFTAG_SOFTWARE="optuav", **_facts(dataset))
            file.set_band_description(1, f"{dataset.name}")
            file.set_band_unit(1, "s")
            file.write(dataset.to_numpy()[::-1], 1)
        content: bytes = memory.read()
    return content


def _geojson(dataset: xarray.DataArray) -> bytes:
    """Contours at round values, as lines of longitudes and latitudes."""
    require("geopandas", "contours")
    require("matplotlib", "contours")
    import contourpy
    import geopandas
    import shapely

    from optuav.plots.heat import contour_levels

    if (system := _system(dataset)) is None:
        words = "is missing; GeoJSON holds longitudes and latitudes, so the mission needs a crs"
        raise InputError([Fault("crs", "", words)])
    values = dataset.to_numpy()
    lines: Any = contourpy.contour_generator(dataset.x.to_numpy(), dataset.y.to_numpy(), values)
    # None where points without a plan lie between.
    parts = {level: shown for level in contour_levels(values) if (shown := lines.lines(level))}
    shapes = geopandas.GeoSeries(map(shapely.MultiLineString, parts.values()), crs=system)
    shapes = shapes.to_crs(DEGREES).set_precision(PRECISION_DEG, mode="pointwise")
    table = geopandas.GeoDataFrame({"hover_time_s": [*parts]}, geometry=shapes)
    head = {"type": "FeatureCollection", "name": "optuav", **_facts(dataset)}
    return f"{json.dumps({**head, 'features': [*table.iterfeatures(drop_id=True)]})}\n".encode()


def _facts(dataset: xarray.DataArray) -> dict[str, str]:
    """Subject of the map, in words."""
    return {
        name: str(dataset.attrs[name]) for name in ("mission", "perspective", "over", "height_m")
    }


def _system(dataset: xarray.DataArray) -> pyproj.CRS | None:
    """The reference system of a map; None if it has none."""
    if (stated := dataset.attrs.get("crs")) is None:
        return None
    return system_in_metres(stated)


def _why(hover_map: HoverMap) -> Iterator[tuple[int, str]]:
    """Numbers of points without a plan and the reasons, the most frequent first."""
    words = [*REASONS.values()]
    codes, counts = np.unique(hover_map.solved.values["reason"], return_counts=True)
    for place in np.argsort(-counts, kind="stable"):
        if codes[place]:
            yield int(counts[place]), words[codes[place]]
