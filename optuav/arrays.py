"""Arrays by content, of any shape; docstrings state shape and unit."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Integers: TypeAlias = npt.NDArray[np.intp]
Booleans: TypeAlias = npt.NDArray[np.bool_]
Number: TypeAlias = float | Floats  # A number, or an array of them
Truth: TypeAlias = np.bool_ | Booleans  # A truth value, or an array of them
Values: TypeAlias = Mapping[str, Any]  # Numbers, or arrays with one entry a programme, by name


def plain(values: Any) -> npt.NDArray[Any]:
    """Values as an array; masked ones are NaN, which no range allows."""
    if np.ma.is_masked(values):
        return np.where(np.ma.getmaskarray(values), np.nan, np.ma.getdata(values))
    return np.asarray(values)


def ragged(first: Integers, counts: Integers) -> tuple[Integers, Integers]:
    """Rows of several numbers each, which count on from its first: row of each, and the number."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) + np.repeat(first - np.cumsum(counts) + counts, counts)


def portions(counts: Integers, most: int) -> Iterator[slice]:
    """Slices of rows of several entries each that hold `most` entries, or up to a row more."""
    if len(counts):
        begins = np.flatnonzero(np.diff(np.cumsum(counts) // most, prepend=-1))
        yield from map(slice, begins.tolist(), [*begins[1:].tolist(), len(counts)])
