"""Files that hold a table of buildings: CSV, or a map format whose x and y are metres."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, decimal, printable, refuse, require
from optuav.mission.building_columns import COLUMNS, SIZES, corners_of, of_columns, of_polygons
from optuav.mission.buildings import Buildings, TableFile
from optuav.mission.files import MARK, label, must_be_file, read_text, refusal, refusals
from optuav.mission.maps import TEXTS, check_map, document_of, features
from optuav.mission.messages import first_ten

PARQUET, MAPS = (".parquet", ".geoparquet"), (".gpkg", ".geojson")
OUTLINE = "one polygon without courtyards, or a point; optuav city reads other maps"
UNREADABLE = (ValueError, RuntimeError, OSError, AttributeError, LookupError, TypeError)
SHOWN_DIGITS = 12  # Printed digits of a hash


def read_buildings(path: Path) -> Buildings:
    """The buildings of a file, or an `InputError`."""
    digest, ending = fingerprint(path), path.suffix.lower()
    readers = {".csv": _of_csv, **dict.fromkeys(PARQUET, _of_parquet)}
    readers |= dict.fromkeys(MAPS, _of_map)
    if ending not in readers:
        raise refusal(path, f"has none of the suffixes {', '.join(readers)}")
    try:
        table = readers[ending](path)
    except InputError as error:
        faults = (replace(fault, source=fault.source or label(path)) for fault in error.faults)
        raise InputError(faults) from None
    return table.read_from(TableFile(os.path.abspath(path), digest, len(table)))


def check(path: Path, expected: str) -> None:
    """Refuse a table whose hash is not the one expected."""
    if (found := fingerprint(path)) != expected:
        here, there = (f"{digest[:SHOWN_DIGITS]}…" for digest in (found, expected))
        raise refusal(path, f"is another table: its SHA-256 hash is {here}, not {there}")


def fingerprint(path: Path) -> str:
    """The SHA-256 hash of the content of a file, in hexadecimal digits."""
    with refusals(path, "read"):
        must_be_file(path)
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


def _of_csv(path: Path) -> Buildings:
    """The buildings of a CSV file."""
    return of_columns(csv_columns(path))


def csv_columns(path: Path) -> dict[str, Any]:
    """The columns of a CSV file; lines that are blank or begin with ``#`` do not count."""
    with refusals(path, "read"):
        must_be_file(path)
        text = read_text(path, path.stat().st_size)
    lines: Iterable[str] = io.StringIO(text, newline=None)
    if "#" in text:
        lines = (line for line in lines if not line.startswith("#"))
    rows, cells = csv.reader(lines), list[str]()
    try:
        names = [cell.strip() for cell in next(filter(any, rows), ())]
        if not names:
            raise refusal(path, f"has no header; its columns are {', '.join(COLUMNS)}")
        faults = [Fault(name, "", "is there twice") for name in {*names} if names.count(name) > 1]
        # One list of all cells: as many small ones as rows take their time.
        for number, row in enumerate(filter(any, rows), start=1):
            if len(row) == len(names):
                cells += row
            else:
                faults.append(Fault(f"row {number}", "", f"has {len(row)} cells, not {len(names)}"))
    except csv.Error as error:
        raise refusal(path, f"is not CSV: {error}") from None
    refuse(faults)
    return {name: _cells(name, cells[k :: len(names)]) for k, name in enumerate(names)}


def _cells(name: str, cells: Sequence[str]) -> Any:
    """A column of CSV as numbers if all cells are numbers; otherwise text."""
    if name == COLUMNS[0]:
        return [cell.strip() for cell in cells]
    if name in SIZES:
        cells = [cell or "nan" for cell in cells]
    text = "".join(cells)
    if text.isascii() and "_" not in text:
        try:
            return np.fromiter(map(float, cells), float, len(cells))
        except ValueError:
            pass
    return [_number(cell.strip()) for cell in cells]


def _number(cell: str) -> float | str | None:
    """The number in a cell, or its text; None if it is empty."""
    try:
        return decimal(cell) if cell else None
    except ValueError:
        return cell


def _of_parquet(path: Path) -> Buildings:
    """The buildings of a Parquet file: a map, or without geometry the columns of CSV."""
    require("pyarrow", "Parquet files")
    from pyarrow import parquet

    try:
        is_map = b"geo" in (parquet.read_schema(path).metadata or {})
        table = parquet.read_table(path, columns=[] if is_map else None)
        columns = {name: table[name].to_numpy() for name in table.column_names}
    except UNREADABLE as error:
        raise _unreadable(path, "pyarrow", error) from None
    return _of_map(path) if is_map else of_columns(columns)


def _unreadable(path: Path, reader: str, error: Exception) -> InputError:
    return refusal(path, f"is not a table that {reader} can read: {error_words(error)}")


def error_words(error: Exception) -> str:
    """The words of a library on a file, without queries that only the library knows."""
    if isinstance(error, UnicodeDecodeError):
        return "it has text that is not UTF-8"
    if "sql" in str(error).lower():
        return "its database is damaged"
    words, _, _ = str(error).partition("\n")[0].partition(".; ")  # What drivers there are
    return printable(words)


def _of_map(path: Path) -> Buildings:
    """The buildings of a map in metres: outlines or points, with columns `name` and `z_m`."""
    require("geopandas", "tables of buildings in map formats")
    import geopandas
    import pyogrio
    import shapely

    try:
        with warnings.catch_warnings(action="ignore"):  # Faults are refused below
            if path.suffix.lower() in PARQUET:
                frame = geopandas.read_parquet(path)
            elif path.suffix.lower() in TEXTS:
                frame = features(document_of(path), path)
            else:
                check_map(path)
                if len(layers := pyogrio.list_layers(path)) != 1:
                    raise ValueError(f"it has {len(layers)} layers, not one")
                frame = geopandas.read_file(path)
        if not isinstance(frame, geopandas.GeoDataFrame):
            raise ValueError("it has no geometry")
        shapes = frame.geometry.to_numpy()
    except InputError:
        raise
    except (*UNREADABLE, shapely.errors.ShapelyError) as error:
        raise _unreadable(path, "geopandas", error) from None
    must_be_in_metres(frame, path)
    of_file = [column for column in frame.columns if column != frame.geometry.name]
    wanted = (COLUMNS[0], COLUMNS[3])
    refuse(
        Fault(x, "", f"is missing; there are {first_ten(of_file)}")
        for x in wanted
        if x not in of_file
    )
    single = (shapely.get_type_id(shapes) > 3) & (shapely.get_num_geometries(shapes) == 1)
    shapes[single] = shapely.get_geometry(shapes[single], 0)
    kind, empty = shapely.get_type_id(shapes), shapely.is_missing(shapes) | shapely.is_empty(shapes)
    outlined = ~empty & (kind == 3) & (shapely.get_num_interior_rings(shapes) == 0)
    refuse(
        Fault(f"buildings[{number}].footprint_m", shapes[number].geom_type, OUTLINE)
        for number in np.flatnonzero(~(empty | outlined | (kind == 0))).tolist()
    )
    at_m = np.full((len(shapes), 2), np.nan)
    if not {*COLUMNS[1:3]} <= {*of_file}:
        at_m[~empty] = shapely.get_coordinates(shapely.point_on_surface(shapes[~empty]))
    columns = [_column(frame, x) if x in of_file else at_m[:, k] for k, x in enumerate(COLUMNS[1:])]
    shapes[~outlined] = None
    names, roof_m = frame[COLUMNS[0]].tolist(), np.column_stack(columns)
    return of_polygons(names, roof_m, *corners_of(shapes))


def must_be_in_metres(frame: Any, path: Path) -> None:
    """Refuse a map whose x and y have another unit."""
    crs = frame.crs
    units = [] if crs is None else [axis.unit_name for axis in crs.axis_info[:2]]
    if strange := {*units} - {"metre"}:
        words = f"has x and y in {', '.join(sorted(strange))}, not in metres"
        raise refusal(path, f"{words}; optuav city makes a mission of a map")


def _column(frame: Any, name: str) -> Floats:
    """A column of numbers, or an `InputError`."""
    try:
        return np.asarray(frame[name], dtype=float)
    except (TypeError, ValueError):
        raise InputError([Fault(name, "", "a column of numbers")]) from None


def geoparquet(buildings: Buildings, crs: str, path: Path) -> tuple[bytes, Buildings]:
    """The content of a file for a table of buildings, and the buildings as if read from there."""
    require("geopandas", "tables of buildings in map formats")
    require("pyarrow", "GeoParquet files")
    import geopandas
    import shapely

    corners_m, count = buildings.outlines()
    drawn = np.repeat(np.arange(np.count_nonzero(count)), count[count > 0])
    outlines = np.full(len(buildings), None, dtype=object)
    outlines[count > 0] = shapely.polygons(shapely.linearrings(corners_m, indices=drawn))
    columns = dict(zip(COLUMNS, (buildings.names, *buildings.roof_m.T), strict=True))
    content = io.BytesIO()
    frame = geopandas.GeoDataFrame(columns, geometry=outlines, crs=crs)
    frame.attrs["creator"] = MARK.decode()
    frame.to_parquet(content, index=False)
    digest = hashlib.sha256(content.getvalue()).hexdigest()
    source = TableFile(os.path.abspath(path), digest, len(buildings))
    return content.getvalue(), buildings.read_from(source)
