"""Tables of devices, as columns or in files: CSV, or GeoJSON whose x and y are metres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from optuav.errors import InputError, require
from optuav.mission.columns import columns_of, rows_of
from optuav.mission.files import label, refusal
from optuav.mission.validation import Document

COLUMNS, SHARE = ("name", "x_m", "y_m", "z_m"), "share"
"""Columns of a table of devices; the share may be left out."""
ON_EARTH = ("name", "longitude", "latitude", "height")
"""Columns of a table of devices on Earth: degrees, and metres above ground."""


def rows_of_columns(
    table: Mapping[str, Iterable[object]], names: Sequence[str] = COLUMNS
) -> list[Document]:
    """The devices of columns as tables [[devices]], not judged yet; or an `InputError`.

    Columns have other names if they are on Earth, where positions stay as they are.
    """
    tables = list[Document]()
    for row in rows_of(columns_of(table, names, (SHARE,))):
        device: Document = {"name": row["name"], "position_m": [row[x] for x in names[1:]]}
        share = row.get(SHARE)
        if share is not None and str(share) != "nan":
            device[SHARE] = share
        tables.append(device)
    return tables


def read_devices(path: Path, *, on_earth: bool = False) -> list[Document]:
    """The devices of a file as tables [[devices]], not judged yet; or an `InputError`.

    On Earth their positions are longitude, latitude [deg] and height above ground [m].
    """
    names = ON_EARTH if on_earth else COLUMNS
    readers = {".csv": _of_csv, ".geojson": _of_geojson}
    if (ending := path.suffix.lower()) not in readers:
        raise refusal(path, f"has none of the suffixes {', '.join(readers)}")
    try:
        if not (listed := rows_of_columns(readers[ending](path, names), names)):
            raise refusal(path, "has no devices, only names of columns")
        return listed
    except InputError as error:
        faults = (replace(fault, source=fault.source or label(path)) for fault in error.faults)
        raise InputError(faults) from None


def _of_csv(path: Path, names: Sequence[str]) -> Mapping[str, Iterable[object]]:
    from optuav.mission.table_files import csv_columns

    columns = csv_columns(path)
    if SHARE in columns:
        columns[SHARE] = [None if cell == "" else cell for cell in columns[SHARE]]
    return columns


def _of_geojson(path: Path, names: Sequence[str]) -> Mapping[str, Iterable[object]]:
    """Columns of a map: `name`, perhaps `share`, and the coordinates of its points."""
    require("geopandas", "tables of devices in map formats")
    import shapely

    from optuav.mission.maps import document_of, features
    from optuav.mission.table_files import must_be_in_metres

    document = document_of(path)
    frame = features(document, path)
    if names == ON_EARTH:
        frame = frame if frame.crs is None else frame.to_crs(4326)
    else:
        must_be_in_metres(frame, path)
    shapes = frame.geometry.to_numpy()
    named = [str(name) for name in frame.columns if name != frame.geometry.name]
    columns: dict[str, Any] = {x: frame[x].tolist() for x in (*names, SHARE) if x in named}
    if {*names[1:]} <= columns.keys():
        return columns
    # The shapes have lost their heights.
    ends = [feature["geometry"]["coordinates"][2:] for feature in document.get("features", ())]
    single = bool((shapely.get_type_id(shapes) == 0).all())
    if not single or not (names[-1] in columns or all(len(end) == 1 for end in ends)):
        words = f"{', '.join(names[1:])} beside shapes, or {names[-1]} beside points"
        raise refusal(path, f"needs points with three coordinates, {words}")
    x, y = shapely.get_coordinates(shapes).T.tolist()
    heights = [end[0] for end in ends if end]
    return {names[1]: x, names[2]: y, **({names[3]: heights} if heights else {}), **columns}
