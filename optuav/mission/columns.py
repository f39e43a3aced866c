"""Columns of a table from Python: a data frame, or lists in a dict."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from optuav.arrays import plain
from optuav.errors import Fault, InputError, printable, refuse
from optuav.mission.messages import nearest, shown
from optuav.mission.validation import Document

MOST_BYTES = 8  # Size of a number that is a float of Python


def columns_of(
    table: Mapping[str, Iterable[object]], required: Sequence[str], optional: Sequence[str]
) -> dict[str, Sequence[Any]]:
    """The columns of a table by name, all of one length, with plain values; or an `InputError`."""
    wanted = "columns by name, as a data frame or as lists in a dict"
    if not hasattr(table, "keys"):
        raise InputError([Fault("", shown(table), wanted)])
    refuse(
        Fault(str(name), shown(table[name]), wanted)
        for name in table
        if isinstance(table[name], str) or not isinstance(table[name], Iterable)
    )
    columns = {str(name): _plain(table[name]) for name in table}
    names = (*required, *optional)
    faults = [
        Fault(name, "", f"unknown column{nearest(name, names)}")
        for name in columns
        if name not in names
    ]
    faults += [Fault(name, "", "is missing") for name in required if name not in columns]
    if len({len(column) for column in columns.values()}) > 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        faults.append(Fault("columns", printable(lengths), "of equal length"))
    refuse(faults)
    return columns


def rows_of(columns: Mapping[str, Sequence[Any]]) -> Iterator[Document]:
    """The cells of each row by the names of their columns."""
    lists = (getattr(column, "tolist", column.__iter__)() for column in columns.values())
    for cells in zip(*lists, strict=True):
        yield dict(zip(columns, cells, strict=True))


def _plain(column: Iterable[Any]) -> Sequence[Any]:
    """A column as an array if it is one of numbers, or else as a list of plain values."""
    kind = getattr(column, "dtype", None)
    if isinstance(kind, np.dtype) and kind.kind in "iuf" and kind.itemsize <= MOST_BYTES:
        values: Any = plain(column)
        return values if values.ndim == 1 else [*values.tolist()]
    listed: list[Any] = column if isinstance(column, list) else [*column]
    if {*map(type, listed)} <= {str, int, float}:
        return listed
    return [entry.tolist() if hasattr(entry, "tolist") else entry for entry in listed]
