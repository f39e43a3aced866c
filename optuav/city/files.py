"""The features of a map file, or of a table, in their reference system."""

from __future__ import annotations

import warnings
import zipfile
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory
from typing import Any

import geopandas
import numpy as np
import pyogrio
import pyproj
import shapely

from optuav.city.city import on_earth
from optuav.city.cityjson import solids
from optuav.errors import Fault, InputError
from optuav.mission.earth import DEGREES
from optuav.mission.files import label, refusal, refusals
from optuav.mission.maps import HEADS, LARGEST, LINES, TEXTS, check_map, document_of, features
from optuav.mission.messages import counted, listed, shown

AREAS = ("Polygon", "MultiPolygon", "Unknown")
ZIPS = (".zip", ".shz")
BROKEN_ZIP = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError)
MAPS = (*HEADS, *TEXTS, *LINES)
UNDEFINED = ("Undefined Cartesian SRS", "Undefined geographic SRS")  # By GeoPackage, none
AREAS_OF_TAGS = Path(__file__).with_name("osm.ini")  # Closed ways that GDAL takes for areas


def features_of(file: Path, layer: str | None, bbox: Any) -> tuple[Any, tuple[str, ...]]:
    """Return the features of a file in its own reference system, and the kinds of other objects."""
    ending = file.suffix.lower()
    if ending in ZIPS:
        with TemporaryDirectory() as folder:
            try:
                return features_of(_unpacked(file, Path(folder)), layer, bbox)
            except InputError as error:
                faults = [replace(fault, source=label(file)) for fault in error.faults]
                raise InputError(faults) from None
    if ending in (*TEXTS, *LINES):
        if layer is not None:
            words = "GeoJSON and CityJSON have no layers; leave it out"
            raise InputError([Fault("layer", shown(layer), words, label(file))])
        return _of_json(document_of(file), file)
    check_map(file)
    try:
        # GDAL warns of rings that are mended or listed, and of foreign columns.
        with warnings.catch_warnings(action="ignore"):
            return _layer(file, layer, bbox), ()
    except (RuntimeError, shapely.errors.ShapelyError):  # By pyogrio, all of its errors
        raise refusal(file, "cannot be read: it is damaged or incomplete") from None


def _of_json(document: Any, file: Path) -> tuple[Any, tuple[str, ...]]:
    """The features of GeoJSON or CityJSON, and the kinds of other objects."""
    whole = document if isinstance(document, dict) else {}
    parts = whole.get("features", [whole])
    head = parts[0] if isinstance(parts, list) and parts and isinstance(parts[0], dict) else {}
    if head.get("type") == "CityJSON":
        return solids(parts, file)
    if head.get("type") == "CityJSONFeature":
        raise refusal(file, "is CityJSONSeq without its first line, which states the scale")
    if "elements" in whole:
        words = (
            "export GeoJSON from overpass turbo, or convert it by osmtogeojson (with `out geom`)"
        )
        raise refusal(file, f"is Overpass JSON, which optuav does not read: {words}")
    frame = features(document, file)
    west, south, east, north = ends = frame.total_bounds.tolist()
    on_map = np.isnan(ends).any() or (on_earth((west, south)) and on_earth((east, north)))
    if "crs" not in whole and not on_map:  # GeoJSON without a system should be in degrees
        frame = frame.set_crs(None, allow_override=True)
    return frame, ()


def own(frame: Any, file: Path, layer: object) -> Any:
    """A table from Python, with columns named by texts and features named once."""
    if layer is not None or frame.active_geometry_name is None:
        raise refusal(file, "has no layers" if layer is not None else "has no geometry")
    frame = frame.loc[:, ~frame.columns.duplicated()].rename(columns=str)
    if frame.index.nlevels > 1:
        frame.index = ["/".join(map(str, levels)) for levels in frame.index]
    return frame if frame.index.is_unique else frame.reset_index(drop=True)


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
    around, reading = None, {"layer": layer}
    if file.suffix.lower() == ".pbf":
        reading["CONFIG_FILE"] = str(AREAS_OF_TAGS)
    facts = pyogrio.read_info(file, **reading)
    if bbox is not None and (own := system_of(facts["crs"])):
        around = pyproj.Transformer.from_crs(DEGREES, own, always_xy=True).transform_bounds(*bbox)
    options = {"bbox": around, "fid_as_index": True, "on_invalid": "ignore"}
    frame = pyogrio.read_dataframe(file, **reading, **options)
    if not isinstance(frame, geopandas.GeoDataFrame):
        raise InputError([Fault("layer", shown(layer), "has no geometry", label(file))])
    if bbox is None and len(frame) < facts["features"]:
        raise refusal(file, f"is incomplete: it has {len(frame)} of {facts['features']} features")
    return frame


def placed(file: Path, frame: Any, stated: pyproj.CRS | None) -> Any:
    """The features in the reference system of their file, or else in the one that is stated."""
    if frame.crs is not None and frame.crs.name in UNDEFINED:
        frame = frame.set_crs(None, allow_override=True)
    if stated is None and frame.crs is None:
        raise refusal(file, "has no coordinate reference system; state it as crs")
    if stated is None and not _is_of_maps(frame.crs):
        raise refusal(file, f"states {shown(frame.crs.name)}, which is not a system of maps")
    if stated is not None and frame.crs not in (None, stated):
        words = f"{label(file)} states {frame.crs.to_string()}"
        raise InputError([Fault("crs", shown(stated.to_string()), words)])
    return frame if stated is None else frame.set_crs(stated)


def system_of(stated: object) -> pyproj.CRS | None:
    """A reference system of maps; None if pyproj knows none like that."""
    with suppress(pyproj.exceptions.CRSError):
        crs = pyproj.CRS.from_user_input(stated)
        return crs if _is_of_maps(crs) else None
    return None


def _is_of_maps(crs: pyproj.CRS) -> bool:
    """Return whether it has longitudes and latitudes, or a projection."""
    return bool(crs.is_geographic or crs.is_projected)
