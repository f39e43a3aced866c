"""Tables of buildings: judged as columns where all is in order, and else row by row."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from annotated_types import Ge, Le
from pydantic import ConfigDict, FailFast, TypeAdapter, ValidationError

from optuav.arrays import Floats, Integers
from optuav.errors import InputError
from optuav.fields import (
    MOST_CORNERS,
    MOST_ITEMS,
    Altitude,
    Coordinate,
    Length,
    MissionSection,
    Name,
)
from optuav.mission.buildings import Buildings
from optuav.mission.columns import columns_of, rows_of
from optuav.mission.validation import (
    Breach,
    Document,
    StatedMission,
    breaches_of,
    mask_faulty,
    rules_of_buildings,
)
from optuav.tables import Building

if TYPE_CHECKING:
    import numpy.typing as npt

COLUMNS, SIZES = ("name", "x_m", "y_m", "z_m"), ("width_m", "depth_m")
"""Columns of a table of buildings; the footprint columns may be left out."""
_LISTS = TypeAdapter(
    tuple[
        Annotated[tuple[Name, ...], FailFast()],
        Annotated[list[Coordinate], FailFast()],
        Annotated[list[Coordinate], FailFast()],
        Annotated[list[Altitude], FailFast()],
        Annotated[list[Length], FailFast()],
        Annotated[list[Annotated[int, Ge(3), Le(MOST_CORNERS)]], FailFast()],
    ],
    config=ConfigDict(allow_inf_nan=False),
)
"""Names, coordinates of roofs and of corners, heights, sizes, and numbers of corners."""


class Listing(MissionSection):
    """Buildings without the rest of a mission."""

    buildings: Buildings


def of_columns(table: Mapping[str, Iterable[object]]) -> Buildings:
    """The buildings of a table with `COLUMNS` and maybe `SIZES`, or an `InputError`."""
    columns = columns_of(table, COLUMNS, SIZES)
    return _at_once(columns) or row_by_row([*_tables(columns)])


def _at_once(columns: Mapping[str, Sequence[Any]]) -> Buildings | None:
    """The buildings of columns without any fault."""
    numbers: dict[str, Floats] = {}
    for name in {*COLUMNS[1:], *SIZES} & columns.keys():
        column = columns[name]
        if isinstance(column, list) and not {*map(type, column)} <= {int, float}:
            return None
        try:
            numbers[name] = np.asarray(column, dtype=float)
        except OverflowError:
            return None
    roof_m = np.column_stack([numbers[name] for name in COLUMNS[1:]])
    unknown = np.full(len(roof_m), np.nan)
    size_m = np.column_stack([numbers.get(name, unknown) for name in SIZES])
    sized = ~np.isnan(size_m).all(axis=1)
    table = _packed(columns["name"], roof_m, size_m[sized], sized)
    return table if _is_allowed(table) else None


def corners_of(footprints: npt.NDArray[np.object_]) -> tuple[Floats, Integers]:
    """Corners of polygons (corner, 2), and their number by polygon, 0 for None."""
    import shapely

    corners, of = shapely.get_coordinates(footprints, return_index=True)
    corner = of == np.append(of[1:], -1)  # All but the last of a ring, which is the first again
    return corners[corner], np.bincount(of[corner], minlength=len(footprints))


def of_polygons(
    names: Sequence[str], roof_m: Floats, corners_m: Floats, count: Integers
) -> Buildings:
    """The buildings of arrays, or an `InputError`.

    Roofs (building, 3) [m], the corners of all footprints (corner, 2) [m], and by building how many
    they are.
    """
    table = _packed(names, roof_m, corners_m, count)
    return table if _is_allowed(table) else row_by_row(table.rows())


def _packed(names: Sequence[Any], roof_m: Floats, corners_m: Floats, count: Any) -> Buildings:
    """Columns as a table, whatever they hold."""
    roofs, corners = (array("d", np.asarray(x, float).tobytes()) for x in (roof_m, corners_m))
    begins = array("q", np.append(0, np.cumsum(count)).astype(np.int64).tobytes())
    return Buildings(tuple(names), roofs, corners, begins)


def _is_allowed(table: Buildings) -> bool:
    """Return whether columns have nothing that `row_by_row` refuses."""
    count, corners_m = np.diff(table.begins), np.asarray(table.corners).reshape(-1, 2)
    of_size, roof_m = (count == 1).repeat(count), table.roof_m
    numbers = roof_m[:, :2], corners_m[~of_size], roof_m[:, 2], corners_m[of_size]
    lists = (values.ravel().tolist() for values in (*numbers, count[count > 1]))
    try:
        _LISTS.validate_python((table.names, *lists))
    except ValidationError:
        return False
    return not table.breaches


def _tables(columns: Mapping[str, Sequence[Any]]) -> Iterator[Document]:
    """The rows of columns as tables [[buildings]]."""
    for row in rows_of(columns):
        building = {} if row["name"] is None else {"name": row["name"]}
        building["position_m"] = [row[name] for name in COLUMNS[1:]]
        size = [row.get(name) for name in SIZES]
        if any(length is not None and str(length) != "nan" for length in size):
            building["footprint_m"] = size
        yield building


def row_by_row(rows: list[Document]) -> Buildings:
    """The buildings of any number of tables [[buildings]], or an `InputError` with their faults."""
    content = StatedMission({"buildings": rows}, {(): ""})
    buildings, breaches = list[Building](), list[Breach]()
    for begin in range(0, len(rows), MOST_ITEMS):
        part = {"buildings": rows[begin : begin + MOST_ITEMS]}
        try:
            buildings += Listing.model_validate(part).buildings
        except ValidationError as error:
            for (table, number, *key), words in breaches_of(Listing, error, StatedMission(part)):
                breaches.append(Breach((table, begin + int(number), *key), words))
    breaches += rules_of_buildings(mask_faulty(content.document, {key for key, _ in breaches}))
    if breaches:
        raise InputError(content.faults(breaches))
    return Buildings.of(buildings)
