"""The features of a map file, or of a table, in their reference system."""

from __future__ import annotations

import json
import warnings
import zipfile
import zlib
from collections.abc import Iterable
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
from optuav.city.osm import of_xml, plain
from optuav.errors import Fault, InputError
from optuav.mission.earth import DEGREES
from optuav.mission.files import label, must_be_file, refusal, refusals
from optuav.mission.formats import HEAD as FIRST
from optuav.mission.formats import named
from optuav.mission.maps import (
    HEADS,
    LARGEST_MAP,
    LINES,
    MOST_VALUES,
    OSM,
    PARQUET,
    TEXTS,
    UNREADABLE,
    check_map,
    document_of,
    features,
    system_named,
)
from optuav.mission.messages import first_ten, plural, shown
from optuav.presentation.numbers import figure, fixed

AREAS = ("Polygon", "MultiPolygon", "Unknown")
ZIPS = (".zip", ".shz")
BROKEN_ZIP = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError)
MAPS = (*HEADS, *OSM, *PARQUET, *TEXTS, *LINES)
LONGEST_REMARK = 300  # Characters
WHY = "where the reference system comes from"
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
    if ending in OSM:
        return _of_openstreetmap(of_xml(file), file, layer)
    if ending in PARQUET:
        return _of_parquet(file, layer, bbox), ()
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
        raise refusal(file, "is CityJSONSeq without its first line, which contains the scale")
    if isinstance(whole.get("elements"), list):
        said = whole.get("remark")  # On a time-out, after which elements are missing
        remark = (f"Overpass says {said[:LONGEST_REMARK]!r}",) if isinstance(said, str) else ()
        if remark and not whole["elements"]:
            raise refusal(file, f"has no elements; {remark[0]}")
        frame, remarks = _of_openstreetmap(whole["elements"], file, None)
        return frame, (*remarks, *remark)
    what = named(json.dumps(document)[:FIRST].encode())
    if what and "features" not in whole and "GeoJSON" not in what.words:
        raise refusal(file, f"is {what.words}")
    frame = features(document, file)
    west, south, east, north = ends = frame.total_bounds.tolist()
    on_map = np.isnan(ends).any() or (on_earth((west, south)) and on_earth((east, north)))
    if "crs" not in whole and not on_map:  # GeoJSON without a system should be in degrees
        frame = frame.set_crs(None, allow_override=True)
    if "crs" not in whole:
        frame.attrs[WHY] = "a GeoJSON without a reference system is in"
    return frame, ()


def _of_openstreetmap(
    elements: Iterable[Any], file: Path, layer: str | None
) -> tuple[Any, tuple[str, ...]]:
    """The areas of elements, assembled by GDAL, and remarks on those without geometry."""
    text, remarks = plain(elements, file)
    with TemporaryDirectory() as folder:
        (written := Path(folder, f"{file.stem}.osm")).write_text(text, "utf-8")
        try:
            with warnings.catch_warnings(action="ignore"):
                frame = _layer(written, layer, None)
                # A way and a relation may have one number.
                return frame if frame.index.is_unique else frame.reset_index(drop=True), remarks
        except InputError as error:
            raise InputError(replace(fault, source=label(file)) for fault in error.faults) from None
        except (RuntimeError, shapely.errors.ShapelyError):
            raise refusal(file, "cannot be read as OpenStreetMap") from None


def _of_parquet(file: Path, layer: str | None, bbox: Any) -> Any:
    """The features of GeoParquet, without columns that hold lists or records."""
    import pyarrow
    from pyarrow import parquet

    if layer is not None:
        words = "GeoParquet has no layers; leave it out"
        raise InputError([Fault("layer", shown(layer), words, label(file))])
    with refusals(file, "read"):
        must_be_file(file)
        with file.open("rb") as content:
            head = content.read(FIRST)
    if not head.startswith(b"PAR1"):
        what = named(head)
        raise refusal(file, f"is {what.words if what else 'damaged, or no Parquet file'}")
    try:
        schema, rows = parquet.read_schema(file), parquet.read_metadata(file).num_rows
    except (pyarrow.ArrowException, OSError):
        raise refusal(file, "is a Parquet file that is damaged or cut off") from None
    if (geo_text := (schema.metadata or {}).get(b"geo")) is None:
        raise refusal(file, "is a Parquet file without the metadata of GeoParquet")
    try:
        geo = json.loads(geo_text)
        first = geo["columns"][geo["primary_column"]]
        flat = [field.name for field in schema if not pyarrow.types.is_nested(field.type)]
        if geo["primary_column"] not in flat:
            flat.append(geo["primary_column"])
        if len(flat) * rows > MOST_VALUES:
            raise refusal(file, f"has a table of more than {MOST_VALUES} cells")
        crs = first.get("crs", "OGC:CRS84")
        ours = crs is not None and pyproj.CRS.from_user_input(crs).is_geographic
        within = bbox if ours and "bbox" in first.get("covering", ()) else None
        frame = geopandas.read_parquet(file, columns=flat, bbox=within)
    except (pyarrow.ArrowException, OSError, *UNREADABLE, shapely.errors.ShapelyError):
        raise refusal(file, "is not GeoParquet that geopandas reads") from None
    return frame if frame.index.is_unique else frame.reset_index(drop=True)


def checked_table(frame: Any, file: Path, layer: object) -> Any:
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
                raise refusal(file, f"holds {plural(len(maps), 'map')}, not one: {names}")
            if (size := sum(member.file_size for member in inside.values())) > LARGEST_MAP:
                most = f"the {figure(LARGEST_MAP / 1e6)} MB that are unpacked"
                raise refusal(file, f"holds {fixed(size / 1e6, 0)} MB, more than {most}")
            for name, member in inside.items():
                if not member.is_dir():
                    with archive.open(member) as packed, (folder / name).open("wb") as out:
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
            words = f"is missing; one of {first_ten(areas)}" if areas else "no layer has polygons"
            raise InputError([Fault("layer", "", words, label(file))])
        layer = found[0]
    elif layer not in areas:
        words = f"a layer with polygons: {first_ten(areas)}" if areas else "no layer has polygons"
        raise InputError([Fault("layer", shown(layer), words, label(file))])
    around, reading = None, {"layer": layer}
    if file.suffix.lower() in (".pbf", *OSM):
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


def placed(file: Path, frame: Any, system: pyproj.CRS | None) -> Any:
    """The features in the reference system of their file, or else in the one that is stated."""
    if frame.crs is not None and frame.crs.name in UNDEFINED:
        frame = frame.set_crs(None, allow_override=True)
    if frame.crs is not None and not _is_of_maps(frame.crs):
        if system is None:
            words = f"states {shown(frame.crs.name)}, which is not a map reference system"
            raise refusal(file, f"{words}; specify it as crs")
        frame = frame.set_crs(None, allow_override=True)
    if system is None and frame.crs is None:
        raise refusal(file, "has no coordinate reference system; specify it as crs")
    if system is None or _same(frame.crs, system):
        return frame
    if frame.crs is not None:
        why = frame.attrs.get(WHY, "the file states")
        words = f"must be {frame.crs.to_string()}, which {why}"
        raise InputError([Fault("crs", shown(system.to_string()), words, label(file))])
    return frame.set_crs(system)


def _same(own: pyproj.CRS | None, system: pyproj.CRS) -> bool:
    """Return whether two systems differ in the order of their axes at most."""
    if own is None:
        return False
    degrees = ("EPSG:4326", "EPSG:4979", "OGC:CRS84", "OGC:CRS84h")
    return own.equals(system, ignore_axis_order=True) or (
        own.to_string() in degrees and system.to_string() in degrees
    )


def system_of(system: object) -> pyproj.CRS | None:
    """A reference system of maps; None if pyproj knows none like that."""
    with suppress(pyproj.exceptions.CRSError):
        crs = system_named(system) if isinstance(system, str) else None
        crs = crs or pyproj.CRS.from_user_input(system)
        return crs if _is_of_maps(crs) else None
    return None


def _is_of_maps(crs: pyproj.CRS) -> bool:
    """Return whether it has longitudes and latitudes, or a projection."""
    return bool(crs.is_geographic or crs.is_projected)
