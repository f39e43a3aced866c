"""Maps as files: GeoTIFF, and contours as GeoJSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, require
from optuav.mission.files import label, write_files
from optuav.mission.messages import path_of, shown

if TYPE_CHECKING:
    import pyproj
    import xarray

DEGREES, DECIMALS = "EPSG:4326", 7  # Longitudes and latitudes [deg], to a centimetre
UNEVEN = 1e-6  # Most that two distances of a GeoTIFF's points may differ by [m]
FORMATS = {".tif": "GeoTIFF", ".tiff": "GeoTIFF", ".geojson": "GeoJSON"}


def save(found: xarray.DataArray, path: str | Path) -> Path:
    """Write a map for geographic information systems; the same map gives the same bytes.

    Parameters
    ----------
    found
        A map, as the functions of `optuav.maps` return it.
    path
        The file. As .tif or .tiff a GeoTIFF of the hover times [s], NaN without a plan, north up,
        with the mission's reference system if it has one (needs rasterio); its points lie at one
        distance along x, and at one along y. As .geojson the contours that a picture shows, in
        longitude and latitude, each with its hover time ``hover_time_s`` (needs pyproj and
        matplotlib); the mission states its ``crs``. What is there is replaced, whole or not at all.

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
    >>> found = optuav.maps.laser("paper", 500)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     optuav.maps.save(found, f"{folder}/laser.tif").name
    'laser.tif'
    """
    file = path_of(path)
    if "over" not in getattr(found, "attrs", {}):
        words = "a map, as the functions of optuav.maps return it"
        raise InputError([Fault("found", type(found).__name__, words)])
    if (kind := FORMATS.get(file.suffix.lower())) is None:
        words = f"one of {', '.join(FORMATS)}"
        raise InputError([Fault("suffix", shown(file.suffix), words, label(file))])
    write_files({file: _geotiff(found) if kind == "GeoTIFF" else _geojson(found)})
    return file


def _geotiff(found: xarray.DataArray) -> bytes:
    """The values as a picture of one band, whose first row is the northernmost."""
    require("rasterio", "GeoTIFFs")
    from rasterio.io import MemoryFile
    from rasterio.transform import Affine

    (left, across_m), (low, up_m) = (_even(found[axis].to_numpy(), axis) for axis in ("x", "y"))
    height, width = found.shape
    top = low + up_m * (height - 1)
    # The corner of the cell of which the first point is the middle.
    corner = Affine(across_m, 0.0, left - across_m / 2, 0.0, -up_m, top + up_m / 2)
    system = _system(found)
    options: dict[str, Any] = {"crs": system and system.to_wkt(), "transform": corner}
    options |= {"dtype": "float64", "nodata": np.nan, "compress": "deflate", "count": 1}
    with MemoryFile() as memory:
        with memory.open(driver="GTiff", height=height, width=width, **options) as file:
            # Before the values, to stand at the head of the file, by which it is known as ours.
            file.update_tags(TIFFTAG_SOFTWARE="optuav", **_facts(found))
            file.set_band_description(1, f"{found.name}")
            file.write(found.to_numpy()[::-1], 1)
        content: bytes = memory.read()
    return content


def _geojson(found: xarray.DataArray) -> bytes:
    """Contours at round values, as lines of longitudes and latitudes."""
    require("pyproj", "contours")
    require("matplotlib", "contours")
    import contourpy
    import pyproj

    from optuav.plots.heat import contour_levels

    if (system := _system(found)) is None:
        words = "is missing; GeoJSON holds longitudes and latitudes, so the mission states its crs"
        raise InputError([Fault("crs", "", words)])
    back = pyproj.Transformer.from_crs(system, DEGREES, always_xy=True)
    values = found.to_numpy()
    lines: Any = contourpy.contour_generator(found.x.to_numpy(), found.y.to_numpy(), values)
    features = []
    for level in contour_levels(values):
        parts = (np.column_stack(back.transform(*each.T)) for each in lines.lines(level))
        corners = [np.round(each, DECIMALS).tolist() for each in parts]
        if not corners:  # as where points without a plan lie between
            continue
        shape = {"type": "MultiLineString", "coordinates": corners}
        facts = {"hover_time_s": level}
        features.append({"type": "Feature", "properties": facts, "geometry": shape})
    head = {"type": "FeatureCollection", "name": "optuav", **_facts(found)}
    return f"{json.dumps({**head, 'features': features})}\n".encode()


def _facts(found: xarray.DataArray) -> dict[str, str]:
    """What the map is about, in words."""
    return {name: str(found.attrs[name]) for name in ("mission", "perspective", "over", "height_m")}


def _even(points_m: Floats, axis: str) -> tuple[float, float]:
    """The first point, and the distance to the next, where all have the same [m]."""
    apart_m = np.diff(points_m)
    if np.ptp(apart_m) > UNEVEN:
        words = "points at one distance, as a GeoTIFF needs them"
        raise InputError([Fault(axis, shown(points_m.tolist()), words)])
    return float(points_m[0]), float(points_m[-1] - points_m[0]) / len(apart_m)


def _system(found: xarray.DataArray) -> pyproj.CRS | None:
    """The reference system of a map; None if it has none."""
    if (stated := found.attrs.get("crs")) is None:
        return None
    require("pyproj", "reference systems")
    import pyproj

    try:
        system = pyproj.CRS.from_user_input(stated)
    except pyproj.exceptions.CRSError:
        words = 'a coordinate reference system that pyproj knows, as "EPSG:25832"'
        raise InputError([Fault("crs", shown(stated), words)]) from None
    if any(axis.unit_name != "metre" for axis in system.axis_info[:2]):
        raise InputError([Fault("crs", shown(stated), "a reference system in metres")])
    return system
