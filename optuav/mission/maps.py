"""Map files, read without a network and without the files that they name.

GDAL chooses a driver by the content of a file, and some drivers open whatever a file names: a VRT
its sources, a GeoJSON the address of its reference system. So GDAL gets only binary formats that no
other driver takes for its own, and GeoJSON is read here.
"""

from __future__ import annotations

import re
import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError
from optuav.mission.files import (
    ends_early,
    label,
    must_be_file,
    opened,
    parse_json,
    read_text,
    refusal,
    refusals,
)
from optuav.mission.formats import HEAD as FIRST
from optuav.mission.formats import named
from optuav.mission.messages import shown

HEADS = {
    ".gpkg": (0, b"SQLite format 3\0"),
    ".shp": (0, b"\0\0\x27\x0a"),
    ".fgb": (0, b"fgb\x03fgb"),
    ".pbf": (4, b"\n\tOSMHeader"),
}
"""Formats that GDAL reads: the bytes that identify a file, and where they begin."""
HEAD = 100  # Bytes that every such file has
TEXT_ENDS = 16  # They have a zero up to this byte, where drivers of text formats stop reading
TEXTS, LINES = (".geojson", ".json", ".cityjson"), (".geojsonl", ".geojsons", ".ndjson", ".jsonl")
PARQUET, OSM = (".parquet", ".geoparquet"), (".osm",)
CONVERTS = "ogr2ogr, which comes with GDAL, converts other maps: ogr2ogr town.gpkg FILE"
LARGEST_MAP = 500_000_000  # bytes of text, and of the content of a zip
MOST_VALUES = 100_000_000
CODE = re.compile(r"[\w:./#,+-]{1,200}")  # Not the code of a projection, whose grids are files
SEVERAL = re.compile(r"\x1e|\{[^\n]*\}[ \r]*\n\s*\{")  # Objects of JSON, one a line
CODES = re.compile(r"(?:EPSG\W+(?:(?:0|\d+(?:\.\d+)+)\W+)?|\+)(\d{4,6})(?!\d)")
NAMED = {"properties": {"name": "EPSG:4326"}}  # Default of a GeoJSON without a reference system
UNREADABLE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError)


def check_map(file: Path) -> None:
    """Refuse a file that is not, or not wholly, of a format that GDAL may read."""
    with refusals(file, "read"):
        must_be_file(file)
        if (ending := file.suffix.lower()) not in HEADS:
            with file.open("rb") as content:
                what = named(content.read(FIRST))
            is_known = f"is {what.name}" if what else "has no suffix of a map"
            advice = (what.advice if what else "") or CONVERTS
            if what and "optuav" in what.words and what.name != "KML":  # Which may be a map
                raise refusal(file, f"is {what.words}")
            raise refusal(file, f"{is_known}; {advice}. Suffixes of maps are {known()}")
        (at, start), beside = HEADS[ending], file.with_suffix(".shx")
        for part in [file, beside] if ending == ".shp" and beside.is_file() else [file]:
            with part.open("rb") as content:
                head, size = content.read(HEAD), part.stat().st_size
            whole = len(head) == HEAD and 0 in head[:TEXT_ENDS]
            if not (whole and head[at:].startswith(start)):
                if (what := named(head)) and not head[at:].startswith(start):
                    raise refusal(part, f"is no {part.suffix} file but {what.name}")
                raise refusal(part, f"is damaged, or no {part.suffix} file")
            if ending == ".shp" and size < (stated := 2 * int.from_bytes(head[24:28])):
                raise refusal(part, f"is cut off: it has {size} of {stated} bytes")
        if ending == ".shp" and (part := file.with_suffix(".dbf")).is_file():
            with part.open("rb") as content:
                head, size = content.read(12), part.stat().st_size
            rows, start_bytes, row_bytes = struct.unpack("<IHH", head[4:].ljust(8, b"\xff"))
            if size < (stated := start_bytes + rows * row_bytes):
                raise refusal(part, f"is cut off: it has {size} of {stated} bytes")


def known() -> str:
    """The suffixes of maps."""
    return ", ".join((*HEADS, *OSM, *PARQUET, *TEXTS, *LINES, ".zip"))


def document_of(file: Path) -> Any:
    """The JSON of a map; lines of features as one collection of them."""
    _must_be_json(file)
    text = read_text(file, LARGEST_MAP)
    if file.suffix.lower() not in LINES and not SEVERAL.match(text):
        return parse_json(text, label(file), MOST_VALUES)
    lines = text.split("\x1e" if text.startswith("\x1e") else "\n")
    full = [line for line in lines if line.strip()]
    if full and ends_early(full[-1]):
        raise refusal(file, "is cut off within its last line")
    joined = ",\n".join(full)
    return {"features": parse_json(f"[{joined}]", label(file), MOST_VALUES)}


SUFFIX_OF = {
    "OpenStreetMap data (.osm.pbf)": ".osm.pbf",
    "OpenStreetMap data (.osm)": ".osm",
    "a Parquet file": ".parquet",
    "a GeoPackage": ".gpkg",
    "a FlatGeobuf": ".fgb",
    "a shapefile": ".shp",
}
"""Suffixes of maps that are not JSON, by how the words on their format begin."""


def _must_be_json(file: Path) -> None:
    """Refuse an empty file and one of another format, whose name is advised if it is a map."""
    with opened(file, LARGEST_MAP) as content:
        head = content.read(FIRST)
    if not head.strip():
        raise refusal(file, "is empty")
    what = named(head)
    if what and (what.binary or head.lstrip().startswith(b"<")):
        suffix = next((own for form, own in SUFFIX_OF.items() if what.words.startswith(form)), "")
        advice = f"; name it {file.stem}{suffix}" if suffix else ""
        raise refusal(file, f"is {what.words}{advice}")


def features(document: Any, file: Path) -> Any:
    """The features of a GeoJSON document as a table, without geometry where that is invalid."""
    at, properties, shapes, numbers = "type", list[dict[str, Any]](), list[Any](), list[Any]()
    try:
        for number, feature in enumerate(document.get("features", [document])):
            at = f"feature {number}"
            if feature.get("type") != "Feature":
                raise ValueError
            properties.append({**(feature.get("properties") or {})})
            shapes.append(_shape(feature.get("geometry")))
            numbers.append(feature.get("id"))
    except UNREADABLE:
        raise refusal(file, f"is not GeoJSON: {at} is not as specified") from None
    if {*map(type, numbers)} != {int} or len({*numbers}) < len(numbers) or min(numbers) < 0:
        numbers = [*range(len(numbers))]
    return table(properties, numbers, shapes, _crs(document, file), file)


def table(known: list[dict[str, Any]], names: list[Any], shapes: Any, crs: Any, file: Path) -> Any:
    """Return the properties of features, with their names and shapes; refused if too large."""
    import geopandas
    import numpy as np
    import pandas as pd

    if len({key for row in known for key in row}) * len(known) > MOST_VALUES:
        raise refusal(file, f"has a table of more than {MOST_VALUES} cells")
    outlines = np.empty(len(shapes), dtype=object)
    outlines[:] = shapes
    rows = pd.DataFrame(known, index=pd.Index(names)).drop(columns="geometry", errors="ignore")
    return geopandas.GeoDataFrame(rows, geometry=outlines, crs=crs)


def _shape(geometry: Any) -> Any:
    """A shape without heights, because heights may leave its rings open; or None."""
    import shapely

    try:
        shape = shapely.geometry.shape(geometry) if geometry else None
        flat = shape is None or not shape.has_z
        return shape if flat else shapely.remove_repeated_points(shapely.force_2d(shape))
    except (*UNREADABLE, shapely.errors.ShapelyError):
        return None


def _crs(document: dict[str, Any], file: Path) -> Any:
    """The reference system of a GeoJSON document; None if it states null."""
    if (stated := document.get("crs", NAMED)) is None:
        return None
    name = stated.get("type") if isinstance(stated, dict) else stated
    with suppress(LookupError, TypeError):
        if system := system_named(name := stated["properties"]["name"]):
            return system
    words = 'is not a reference system that pyproj knows, by its name as in {"type": "name", '
    words += '"properties": {"name": "EPSG:25832"}}; correct it in the file'
    raise InputError([Fault("the file's crs", shown(name), words, label(file))])


def system_named(name: str) -> Any:
    """The reference system of a name, with a second code for heights perhaps; None if unknown.

    By an authority (``EPSG:25832``, ``OGC:CRS84h``, a URN or address of them), or by two codes
    (``EPSG:25832+7837``, ``urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::7837``, a ``crs-compound``).
    """
    import pyproj

    with suppress(pyproj.exceptions.CRSError):
        if CODE.fullmatch(name):
            return pyproj.CRS.from_user_input(name)
    codes = CODES.findall(name)
    with suppress(pyproj.exceptions.CRSError):
        if codes and name.endswith(codes[-1]):
            return pyproj.CRS.from_user_input(f"EPSG:{'+'.join(codes)}")
    return None
