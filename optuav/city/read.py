"""From a map file to the buildings of a city."""

from __future__ import annotations

import itertools
import math
import re
import warnings
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory
from typing import Any

import geopandas
import numpy as np
import numpy.typing as npt
import pandas as pd
import pyogrio
import pyproj
import shapely

from optuav.arrays import Booleans, Floats, Integers
from optuav.city.city import ON_EARTH, City, on_earth
from optuav.city.cityjson import FARTHEST, solids
from optuav.city.outlines import mended, parts_of
from optuav.errors import Fault, InputError, collected, refuse
from optuav.mission.earth import DEGREES, plane
from optuav.mission.files import label, refusal, refusals
from optuav.mission.maps import HEADS, LARGEST, LINES, TEXTS, check_map, document_of, features
from optuav.mission.messages import counted, listed, misfits, nearest, path_of, shown
from optuav.mission.schema import MOST_CORNERS, Number

HEIGHT = Number("m", gt=0, le=1e6)
FARTHEST_M = 1e6  # Largest distance of a building from the origin of a mission
DECIMALS = 3  # Decimals of corners [m], so that they are the same on any processor
AREAS = ("Polygon", "MultiPolygon", "Unknown")
NOT_BUILT = ("", "no", "false", "0", "0.0")  # Values of the column building
ZIPS = (".zip", ".shz")
BROKEN_ZIP = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError)
MAPS = (*HEADS, *TEXTS, *LINES)
HALF_TURN = 180.0  # deg
OF_OPENSTREETMAP = {"height": "height", "levels": "building:levels"}
TAGS = "other_tags"  # Where GDAL puts the tags of OpenStreetMap that have no column


def read(
    path: str | Path | geopandas.GeoDataFrame,
    *,
    layer: str | None = None,
    crs: str | int | None = None,
    height: str = "height",
    levels: str = "building:levels",
    level_height_m: float = 3.0,
    default_height_m: float | None = None,
    bbox: tuple[float, float, float, float] | None = None,
    origin: tuple[float, float] | None = None,
) -> City:
    """Read the buildings of a map, and project them to metres.

    Every polygon is a building; one of several polygons is as many buildings of the same height.
    Where the features have a column ``building``, such as OpenStreetMap's, a feature counts if its
    value is not missing, blank, ``no``, ``false`` or ``0``. Courtyards count as built over.

    Parameters
    ----------
    path
        A GeoPackage, GeoJSON (one document, or one feature a line), shapefile, FlatGeobuf or
        OpenStreetMap's .osm.pbf; or CityJSON, whose solids count by their outline from above and
        their height over the lowest corner of the building that they are a part of; or a zip with
        one of them. Nothing else is opened, and no address. Or a GeoDataFrame.
    layer
        The layer with the buildings; by default the only one with polygons, or the one of them that
        is named after buildings.
    crs
        Coordinate reference system of a file that states none, for example ``"EPSG:25832"``.
    height
        Column, or tag of OpenStreetMap, with the height of the roof over ground [m].
    levels
        Column or tag with the number of storeys, for buildings without a height.
    level_height_m
        Height of a storey, 0 < x <= 1e6 [m].
    default_height_m
        Height of buildings that state neither, 0 < x <= 1e6 [m]; by default they are refused.
    bbox
        West, south, east and north end of the part to read, longitudes and latitudes [deg]; the
        buildings that reach into it count. By default everything.
    origin
        Longitude and latitude of x = y = 0 [deg]; by default the middle of the buildings.

    Returns
    -------
    City
        The buildings in the order of the file, in the plane of metres around the origin.

    Raises
    ------
    InputError
        If the file cannot be read, states no reference system, misses a named column, or
        has no buildings there; with every building whose height is missing.

    Examples
    --------
    >>> import optuav
    >>> try:
    ...     optuav.city.read("nowhere.gpkg", level_height_m=-1)
    ... except optuav.InputError as error:
    ...     print(error)
    level_height_m = -1: a number, 0 < x <= 1e6 [m]
    nowhere.gpkg: there is no such file
    """
    bbox = tuple(bbox.tolist()) if isinstance(bbox, np.ndarray) else bbox
    origin = tuple(origin.tolist()) if isinstance(origin, np.ndarray) else origin
    is_frame = isinstance(path, geopandas.GeoDataFrame)
    columns, file = {"height": height, "levels": levels}, Path("GeoDataFrame")
    faults = [Fault(n, shown(x), "a text") for n, x in columns.items() if not isinstance(x, str)]
    system = None if crs is None else _system(crs)
    if crs is not None and system is None:
        words = 'a coordinate reference system that pyproj knows, such as "EPSG:25832"'
        faults.append(Fault("crs", shown(crs), words))
    faults += _faults(level_height_m, default_height_m, bbox, origin)
    with collected(faults):
        file = file if is_frame else path_of(path, words="a path or a GeoDataFrame")
        within = bbox if crs is None and not faults else None
        frame = _own(path, file, layer) if is_frame else _features(file, layer, within)
    refuse(faults)
    frame, not_built = _built(frame)
    frame = _placed(file, frame, system)
    if (np.abs(frame.total_bounds) > FARTHEST).any():
        raise refusal(file, f"has coordinates beyond {FARTHEST:g}")
    numbers, frame = frame.index, _with_areas(frame, file)
    left_out = numbers.difference(frame.index, sort=False)
    frame = frame.to_crs(DEGREES)
    if bbox is not None:
        frame = frame[frame.intersects(shapely.box(*bbox))]
    if bbox is not None and not len(frame):
        words = "no building reaches into it"
        raise InputError([Fault("bbox", shown(bbox), words, label(file))])
    if not len(frame):
        raise refusal(file, "has no buildings")
    refuse(_nowhere(file, frame, columns))
    roof_m, of_levels = _heights(frame, height, levels, level_height_m)
    unknown = np.isnan(roof_m)
    if default_height_m is None:
        refuse(_unknown_heights(file, frame, unknown, height, levels))
    else:
        roof_m[unknown] = default_height_m
    west, south, east, north = frame.total_bounds.tolist()
    if not (on_earth((west, south)) and on_earth((east, north))):
        raise refusal(file, f"has places that are not on Earth: {ON_EARTH}")
    if origin is None:
        if east - west > HALF_TURN:
            middle = f"180 and {(south + north) / 2:.6g} for example"
            raise refusal(file, f"lies on both sides of the antimeridian: state origin, {middle}")
        origin = round((west + east) / 2, 6), round((south + north) / 2, 6)
    ends = np.array([(x, y, *origin) for x in (west, east) for y in (south, north)]).T
    if max(pyproj.Geod(ellps="WGS84").inv(*ends)[2]) > FARTHEST_M:
        words = f"has buildings more than {FARTHEST_M / 1e3:g} km from longitude, latitude"
        raise refusal(file, f"{words} = {origin}: state a part of it by bbox, or a nearer origin")
    shapes = frame.geometry.to_crs(plane(origin)).to_numpy()
    # Edges that are straight on one map are bent on another, and rounding moves corners.
    shapes = shapely.transform(shapes, lambda at_m: np.round(at_m, DECIMALS))
    shapes, bent = mended(shapes, frame.index, file)
    parts, of = parts_of(shapes)
    areas = np.asarray(shapely.area(parts) > 0.0)
    parts, of = parts[areas], of[areas]
    if not len(parts):
        raise refusal(file, "has no buildings larger than a millimetre")
    footprints = np.asarray(shapely.polygons(shapely.get_exterior_ring(parts)))
    refuse(_detailed(footprints, frame.index[of], file))
    names, was_mended = _names(frame.index, of), frame["mended"].to_numpy() | bent
    noted = {
        "level_heights": of_levels[of],
        "assumed_heights": unknown[of],
        "mended": was_mended[of],
        "filled": shapely.get_num_interior_rings(parts) > 0,
    }
    gone = [*left_out, *frame.index[np.bincount(of, minlength=len(frame)) == 0]]
    return City(
        tuple(names),
        np.column_stack([_points_on(footprints), roof_m[of]]),
        footprints,
        (float(origin[0]), float(origin[1])),
        **{name: tuple(itertools.compress(names, where)) for name, where in noted.items()},
        left_out=tuple(map(str, gone)),
        not_built=tuple(map(str, not_built)),
    )


def _faults(
    level_height_m: object, default_height_m: object, bbox: object, origin: object
) -> Iterator[Fault]:
    """Yield the faults of the numbers among the options."""
    yield from misfits(("level_height_m", level_height_m, HEIGHT))
    if default_height_m is not None:
        yield from misfits(("default_height_m", default_height_m, HEIGHT))
    ends = [*bbox] if isinstance(bbox, Sequence) and len(bbox) == 4 else [0] * 4
    ordered = on_earth(ends[:2]) and on_earth(ends[2:]) and ends[0] < ends[2] and ends[1] < ends[3]
    if bbox is not None and not ordered:
        words = "west, south, east, north: longitudes and latitudes, west < east, south < north"
        yield Fault("bbox", shown(bbox), f"{words} [deg]")
    if origin is not None and not on_earth(origin):
        yield Fault("origin", shown(origin), f"longitude, latitude: {ON_EARTH}")


def _own(frame: Any, file: Path, layer: object) -> Any:
    """A table from Python, with columns named by texts and features named once."""
    if layer is not None or frame.active_geometry_name is None:
        raise refusal(file, "has no layers" if layer is not None else "has no geometry")
    frame = frame.loc[:, ~frame.columns.duplicated()].rename(columns=str)
    if frame.index.nlevels > 1:
        frame.index = ["/".join(map(str, levels)) for levels in frame.index]
    return frame if frame.index.is_unique else frame.reset_index(drop=True)


def _features(file: Path, layer: str | None, bbox: Any) -> Any:
    """The features of a file with their outlines, in its own reference system."""
    ending = file.suffix.lower()
    if ending in ZIPS:
        with TemporaryDirectory() as folder:
            try:
                return _features(_unpacked(file, Path(folder)), layer, bbox)
            except InputError as error:
                faults = [replace(fault, source=label(file)) for fault in error.faults]
                raise InputError(faults) from None
    if ending in (*TEXTS, *LINES):
        if layer is not None:
            words = "GeoJSON and CityJSON have no layers; leave it out"
            raise InputError([Fault("layer", shown(layer), words, label(file))])
        document = document_of(file)
        is_city = isinstance(document, dict) and document.get("type") == "CityJSON"
        return solids(document, file) if is_city else features(document, file)
    check_map(file)
    try:
        # GDAL warns of rings that are mended or listed, and of foreign columns.
        with warnings.catch_warnings(action="ignore"):
            return _layer(file, layer, bbox)
    except (RuntimeError, shapely.errors.ShapelyError):  # By pyogrio, all of its errors
        raise refusal(file, "cannot be read: it is damaged or incomplete") from None


def _unpacked(file: Path, folder: Path) -> Path:
    """The only map in a zip, unpacked into a folder with the files that belong to it."""
    try:
        with refusals(file, "read"), zipfile.ZipFile(file) as archive:
            inside = {Path(member.filename).name: member for member in archive.infolist()}
            maps = [name for name in inside if Path(name).suffix.lower() in MAPS]
            if len(maps) != 1:
                names = ", ".join(map(repr, maps[:10])) or "none"
                raise refusal(file, f"holds {counted(len(maps), 'map')}, not one: {names}")
            if (size := sum(member.file_size for member in inside.values())) > LARGEST:
                most = f"the {LARGEST / 1e6:g} MB that are unpacked"
                raise refusal(file, f"holds {size / 1e6:.0f} MB, more than {most}")
            for name, each in inside.items():
                if not each.is_dir():
                    with archive.open(each) as packed, (folder / name).open("wb") as out:
                        copyfileobj(packed, out)
            return folder / maps[0]
    except BROKEN_ZIP:
        raise refusal(file, "is damaged, encrypted or no zip") from None


def _placed(file: Path, frame: Any, stated: pyproj.CRS | None) -> Any:
    """The features in the reference system of their file, or else in the one that is stated."""
    if stated is None and frame.crs is None:
        raise refusal(file, "states no coordinate reference system; state it as crs")
    if stated is None and not _is_of_maps(frame.crs):
        raise refusal(file, f"states {shown(frame.crs.name)}, which is not a system of maps")
    if stated is not None and frame.crs not in (None, stated):
        words = f"{label(file)} states {frame.crs.to_string()}"
        raise InputError([Fault("crs", shown(stated.to_string()), words)])
    return frame if stated is None else frame.set_crs(stated)


def _system(stated: object) -> pyproj.CRS | None:
    """A reference system of maps; None if pyproj knows none like that."""
    with suppress(pyproj.exceptions.CRSError):
        crs = pyproj.CRS.from_user_input(stated)
        return crs if _is_of_maps(crs) else None
    return None


def _is_of_maps(crs: pyproj.CRS) -> bool:
    """Return whether it has longitudes and latitudes, or a projection."""
    return bool(crs.is_geographic or crs.is_projected)


def _layer(file: Path, layer: str | None, bbox: Any) -> Any:
    """The features of a layer that GDAL reads."""
    kinds = {str(name): str(kind).partition(" ")[0] for name, kind in pyogrio.list_layers(file)}
    areas = [name for name, kind in kinds.items() if kind in AREAS]
    if layer is None:
        likely = [name for name in areas if "building" in name.lower()]
        if not (found := areas if len(areas) == 1 else likely):
            words = f"is missing; one of {listed(areas)}" if areas else "no layer has polygons"
            raise InputError([Fault("layer", "", words, label(file))])
        layer = found[0]
    elif layer not in areas:
        words = f"a layer with polygons: {listed(areas)}" if areas else "no layer has polygons"
        raise InputError([Fault("layer", shown(layer), words, label(file))])
    around = None
    facts = pyogrio.read_info(file, layer=layer)
    if bbox is not None and (own := _system(facts["crs"])):
        around = pyproj.Transformer.from_crs(DEGREES, own, always_xy=True).transform_bounds(*bbox)
    options = {"layer": layer, "bbox": around, "fid_as_index": True}
    frame = pyogrio.read_dataframe(file, on_invalid="ignore", **options)
    if not isinstance(frame, geopandas.GeoDataFrame):
        raise InputError([Fault("layer", shown(layer), "has no geometry", label(file))])
    if bbox is None and len(frame) < facts["features"]:
        raise refusal(file, f"is incomplete: it has {len(frame)} of {facts['features']} features")
    return frame


def _built(frame: Any) -> tuple[Any, Any]:
    """The features that are buildings, and the names of those that do not say so."""
    if "building" not in frame:
        return frame, ()
    column = frame["building"]
    denied = column.astype("str").str.strip().str.lower().isin(NOT_BUILT) | column.isna()
    return frame[~denied], frame.index[denied]


def _with_areas(frame: Any, file: Path) -> Any:
    """The features that have an area, with valid outlines; the column `mended` tells which were."""
    shapes, broken = mended(frame.geometry.to_numpy(), frame.index, file)
    frame = frame.set_geometry(geopandas.GeoSeries(shapes, frame.index, frame.crs))
    return frame.assign(mended=broken)[shapely.area(shapes) > 0.0]


def _detailed(footprints: npt.NDArray[np.object_], names: Any, file: Path) -> Iterator[Fault]:
    """Yield a fault for each outline with more corners than a mission takes."""
    corners = shapely.get_num_coordinates(footprints) - 1
    for k in np.flatnonzero(corners > MOST_CORNERS):
        words = f"an outline has {corners[k]} corners, more than {MOST_CORNERS}; simplify it"
        yield Fault(f"feature {names[k]}", "", words, label(file))


def _points_on(footprints: npt.NDArray[np.object_]) -> Floats:
    """A point on each polygon (polygon, 2) [m], rounded where it stays on it."""
    exact = shapely.get_coordinates(shapely.point_on_surface(footprints))
    rounded = np.round(exact, DECIMALS)
    return np.where(shapely.intersects_xy(footprints, *rounded.T)[:, None], rounded, exact)


def _names(index: Any, of: Integers) -> list[str]:
    """A name for every part, of its feature and its number there."""
    heads = [f"b{label}" if isinstance(label, int | np.integer) else str(label) for label in index]
    part = np.arange(len(of)) - np.searchsorted(of, of)
    both = zip(of.tolist(), part.tolist(), strict=True)
    return [heads[k] + (f"-{number + 1}" if number else "") for k, number in both]


def _heights(
    frame: Any, height: str, levels: str, level_height_m: float
) -> tuple[Floats, Booleans]:
    """Height of every roof [m], NaN where none is stated; and whether it follows from levels."""
    roof_m, storeys = (_numbers(frame, name) for name in (height, levels))
    of_levels = np.isnan(roof_m) & ~np.isnan(storeys)
    roof_m = np.where(of_levels, storeys * level_height_m, roof_m)
    return roof_m, of_levels


def _numbers(frame: Any, name: str) -> Floats:
    """Numbers of a column or tag, also with their unit m; NaN for other texts and values ≤ 0."""
    column = _stated(frame, name)
    text = column.astype("str").str.strip().str.removesuffix("m").str.rstrip()
    numbers = pd.to_numeric(text, errors="coerce").to_numpy(float)
    return np.where((numbers > 0.0) & (numbers <= HEIGHT.le), numbers, math.nan)


def _stated(frame: Any, name: str) -> Any:
    """Return the values of a column, or else of a tag of that name."""
    if name in frame:
        return frame[name]
    if TAGS in frame:
        pattern = rf'"{re.escape(name)}"=>"((?:[^"\\]|\\.)*)"'
        return frame[TAGS].astype("str").str.extract(pattern, expand=False)
    return pd.Series(math.nan, frame.index)


def _columns(frame: Any) -> list[str]:
    """Names of the columns that the file has."""
    return [*frame.columns.drop([frame.geometry.name, "mended"])]


def _others(frame: Any, name: str) -> str:
    """Say which columns there are in place of one that is missing; empty without any."""
    known = _columns(frame)
    return nearest(name, known) or f"; there are {listed(known)}" if known else ""


def _nowhere(file: Path, frame: Any, named: dict[str, str]) -> Iterator[Fault]:
    """Columns that are asked for, and are neither there nor a tag."""
    for option, name in named.items():
        there = name in _columns(frame) or _stated(frame, name).notna().any()
        if not there and name != OF_OPENSTREETMAP[option]:
            words = f"no column of this name{_others(frame, name)}"
            yield Fault(option, shown(name), words, label(file))


def _unknown_heights(
    file: Path, frame: Any, unknown: Booleans, height: str, levels: str
) -> Iterator[Fault]:
    """Return a fault that buildings have unknown heights, and one for each of them."""
    if not unknown.any():
        return
    if not {TAGS, height, levels} & {*_columns(frame)}:
        words = f"no column of this name, and none for levels{_others(frame, height)}"
        yield Fault("height", shown(height), f"{words}; or state default_height_m", label(file))
        return
    words = f"of {counted(len(unknown), 'building')} without a height; "
    yield Fault("", "", f"{unknown.sum()} {words}state default_height_m", label(file))
    heights = _stated(frame[unknown], height)
    for (number, value), given in zip(heights.items(), heights.notna(), strict=True):
        text = shown(value) if given else ""
        yield Fault(f"feature {number}", text, HEIGHT.words if text else "no height")
