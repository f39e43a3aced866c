"""Tables of devices, as columns or in files: CSV, or GeoJSON whose x and y are metres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from optuav.errors import Fault, InputError, printable, refuse, require
from optuav.mission.files import label, refusal
from optuav.mission.messages import nearest, shown
from optuav.mission.validation import Document

COLUMNS, SHARE = ("name", "x_m", "y_m", "z_m"), "share"
"""Columns of a table of devices; the share may be left out."""
POINTS = "points with x, y and z; or columns x_m, y_m and z_m beside other shapes"


def rows_of_columns(table: Mapping[str, Iterable[object]]) -> list[Document]:
    """The devices of columns as tables [[devices]], not judged yet; or an `InputError`."""
    wanted = "columns by name, as a data frame or as lists in a dict"
    if not hasattr(table, "keys"):
        raise InputError([Fault("", shown(table), wanted)])
    refuse(
        Fault(str(name), shown(table[name]), wanted)
        for name in table
        if isinstance(table[name], str) or not isinstance(table[name], Iterable)
    )
    columns = {str(name): [*map(_plain, table[name])] for name in table}
    faults = [
        Fault(name, "", f"unknown column{nearest(name, (*COLUMNS, SHARE))}")
        for name in columns
        if name not in (*COLUMNS, SHARE)
    ]
    faults += [Fault(name, "", "is missing") for name in COLUMNS if name not in columns]
    if len({len(column) for column in columns.values()}) > 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        faults.append(Fault("columns", printable(lengths), "of equal length"))
    refuse(faults)
    rows = list[Document]()
    for cells in zip(*columns.values(), strict=True):
        row = dict(zip(columns, cells, strict=True))
        device: Document = {"name": row["name"], "position_m": [row[x] for x in COLUMNS[1:]]}
        share = row.get(SHARE)
        if share is not None and str(share) != "nan":
            device[SHARE] = share
        rows.append(device)
    return rows


def _plain(cell: Any) -> Any:
    """A cell of a column without NumPy's types."""
    return cell.tolist() if hasattr(cell, "tolist") else cell


def read_devices(path: Path) -> list[Document]:
    """The devices of a file as tables [[devices]], not judged yet; or an `InputError`."""
    readers = {".csv": _of_csv, ".geojson": _of_geojson}
    if (ending := path.suffix.lower()) not in readers:
        raise refusal(path, f"has none of the suffixes {', '.join(readers)}")
    try:
        return rows_of_columns(readers[ending](path))
    except InputError as error:
        faults = (replace(fault, source=fault.source or label(path)) for fault in error.faults)
        raise InputError(faults) from None


def _of_csv(path: Path) -> Mapping[str, Iterable[object]]:
    from optuav.mission.table_files import csv_columns

    columns = csv_columns(path)
    if SHARE in columns:
        columns[SHARE] = [None if cell == "" else cell for cell in columns[SHARE]]
    return columns


def _of_geojson(path: Path) -> Mapping[str, Iterable[object]]:
    """Columns of a map in metres: `name`, perhaps `share`, and the coordinates of its points."""
    require("geopandas", "tables of devices in map formats")
    import shapely

    from optuav.mission.maps import document_of, features
    from optuav.mission.table_files import must_be_in_metres

    frame = features(document_of(path), path)
    must_be_in_metres(frame, path)
    shapes = frame.geometry.to_numpy()
    known = [str(name) for name in frame.columns if name != frame.geometry.name]
    columns: dict[str, Any] = {x: frame[x].tolist() for x in (*COLUMNS, SHARE) if x in known}
    if not {*COLUMNS[1:]} <= columns.keys():
        if not ((shapely.get_type_id(shapes) == 0) & shapely.has_z(shapes)).all():
            raise refusal(path, f"needs {POINTS}")
        at_m = shapely.get_coordinates(shapes, include_z=True)
        columns |= dict(zip(COLUMNS[1:], at_m.T.tolist(), strict=True))
    return columns
