"""The grid of a map: at one distance within bounds, or as the arrays x and y."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from optuav.arrays import Floats
from optuav.errors import Fault, refuse
from optuav.mission.messages import misfits, shown
from optuav.mission.schema import Number

Grid: TypeAlias = float | tuple[npt.ArrayLike, npt.ArrayLike]
Bounds: TypeAlias = tuple[float, float, float, float]
COORDINATE, DISTANCE = Number("m", ge=-1e6, le=1e6), Number("m", ge=1e-3, le=1e6)
DECIMALS = 6  # Of coordinates at one distance [m]
ROUNDING = 1e-9  # Of a distance, by which bounds may be too near for the last point
MOST_POINTS, BYTES = 4_000_000, 100
"""Most points of a map, and about the memory that each takes while it is computed."""


def faults(grid: object, bounds: object, height_m: object) -> Iterator[Fault]:
    """What is wrong with a grid, its bounds and its height."""
    if height_m is not None:
        yield from misfits(("height_m", height_m, COORDINATE))
    if isinstance(grid, Sequence) and len(grid) == 2 and not isinstance(grid, str):
        words = f"at least two growing numbers, each {COORDINATE.words}"
        for name, stated in zip("xy", grid, strict=True):
            if not _growing(stated):
                yield Fault(f"grid, {name}", shown(stated), words)
        if bounds is not None:
            yield Fault("bounds", shown(bounds), "goes with a distance, not with arrays")
        return
    if not DISTANCE.accepts(grid):
        words = f"the distance between two points, {DISTANCE.words}, or the arrays x and y"
        yield Fault("grid", shown(grid), words)
    if bounds is not None:
        ends = [*bounds] if isinstance(bounds, Sequence) and len(bounds) == 4 else [math.nan] * 4
        known = all(map(COORDINATE.accepts, ends))
        if not known or ends[0] >= ends[2] or ends[1] >= ends[3]:
            words = "least x, least y, largest x and largest y, each larger than the least, and"
            yield Fault("bounds", shown(bounds), f"{words} {COORDINATE.words}")
        elif DISTANCE.accepts(grid) and min(ends[2] - ends[0], ends[3] - ends[1]) < grid:
            yield Fault("bounds", shown(bounds), "at least two points each way: too near for grid")


def _growing(stated: object) -> bool:
    """Whether this is an axis: at least two growing numbers in the range of coordinates."""
    try:
        at_m = np.asarray(stated)
    except ValueError:
        return False
    if at_m.dtype.kind not in "iuf" or at_m.ndim != 1 or len(at_m) < 2:
        return False
    ends = at_m[[0, -1]].tolist()
    return bool((np.diff(at_m) > 0).all()) and all(map(COORDINATE.accepts, ends))


def axes(
    grid: Grid, bounds: Bounds | None, around_m: Callable[[], Floats]
) -> tuple[Floats, Floats]:
    """Coordinates x and y of the points [m]; without bounds, multiples of the distance around.

    What they then go around are two corners (2, 2) of a box [m].
    """
    if not isinstance(grid, int | float):
        x, y = (np.asarray(each, dtype=float) for each in grid)
        _refuse_many(len(x), len(y))
        return x, y
    if bounds is None:
        low, high = around_m() / grid
        low_m = np.floor(low) * grid
        high_m = np.maximum(np.ceil(high), np.floor(low) + 1.0) * grid
    else:
        low_m, high_m = np.reshape(bounds, (2, 2))
    most = np.floor((high_m - low_m) / grid + ROUNDING).astype(int) + 1
    _refuse_many(*most.tolist())
    x, y = (
        np.round(first_m + grid * np.arange(count), DECIMALS) + 0.0  # no -0.0
        for first_m, count in zip(low_m, most, strict=True)
    )
    return x, y


def _refuse_many(columns: int, rows: int) -> None:
    """Refuse more points than memory is meant for."""
    if (count := columns * rows) > MOST_POINTS:
        words = f"at most {MOST_POINTS} points, which take {MOST_POINTS * BYTES / 1e9:g} GB"
        refuse([Fault("grid", f"{columns} × {rows} = {count} points", words)])
