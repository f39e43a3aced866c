"""Heights of roofs over the ground: of solids, of columns and tags, or by storeys."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import pyproj

from optuav.arrays import Booleans, Floats
from optuav.city.columns import SOLID, column, tag, texts
from optuav.city.lengths import metres, parsed, storeys
from optuav.errors import shown
from optuav.fields import Range
from optuav.mission.messages import first_ten
from optuav.presentation.numbers import figure

OF_OPENSTREETMAP = {"height": "height", "levels": "building:levels"}
ROOF = Range("m", gt=0, le=1200)  # No building is higher
STOREYS = Range("-", gt=0, le=300)  # No building has more
BASES = ("min_height", "building:min_level")
MORE_TAGS = ("roof:levels", "roof:height", *BASES)

Quote = tuple[str, Any, Booleans]
"""A name, its values, and where they cannot be read."""


def heights(
    frame: Any, names: Mapping[str, str], level_height_m: float, factor: float | None
) -> pd.DataFrame:
    """Return the height of the roof of each feature, and its source.

    Columns: ``roof_m``, NaN where no height is known, or one that is not above where the building
    begins; ``stated_m``, the height also there; ``of_levels``, the height follows from storeys;
    ``raised``, the building begins above the ground; ``unread`` and ``of``, a value that cannot be
    read, as a text, and its name.
    """
    roof_m, quotes = _stated(frame, names["height"], factor)
    of_levels_m, more = _by_storeys(frame, names["levels"], level_height_m, factor)
    of_levels = np.isnan(roof_m) & ~np.isnan(of_levels_m)
    quotes += [(name, values, where & np.isnan(roof_m)) for name, values, where in more]
    roof_m = np.where(of_levels, of_levels_m, roof_m)
    stated_m, raised = roof_m, np.zeros(len(frame), dtype=bool)
    for name, values, base_m in _bases(frame, level_height_m, factor):
        raised |= base_m > 0.0
        quotes.insert(0, (name, values, (base_m > 0.0) & (roof_m <= base_m)))
        roof_m = np.where(roof_m <= base_m, math.nan, roof_m)
    return _quoted(quotes, frame.index).assign(
        roof_m=roof_m, stated_m=stated_m, of_levels=of_levels, raised=raised
    )


def vertical_unit(crs: pyproj.CRS) -> tuple[float, str]:
    """Return the unit of heights [m] and its name: of the vertical axis, or else of the plane."""
    axes = crs.axis_info
    up = [axis for axis in axes if axis.direction == "up"] or (axes if crs.is_projected else [])
    return (up[0].unit_conversion_factor, up[0].unit_name) if up else (1.0, "metre")


def remarks_on(frame: Any, known: pd.DataFrame, name: str, factor: float | None) -> Iterator[str]:
    """Yield sentences on the unit of solids, and on values that cannot be read."""
    unit_m, source = _unit_of_solids(frame, name, factor)
    if SOLID in frame and (factor is not None or unit_m != 1.0):
        yield f"heights of solids are in units of {figure(unit_m)} m, by {source}"
    quoted = dict.fromkeys(zip(known["of"], known["unread"], known["stated_m"], strict=True))
    pairs = [(of, f"{of} = {value}", stated_m) for of, value, stated_m in quoted if of]
    if unread := dict.fromkeys(words for of, words, _ in pairs if of not in BASES):
        yield f"cannot be read: {first_ten([*unread])}"
    if above := [
        f"{words}, roof at {figure(high_m)} m" for of, words, high_m in pairs if of in BASES
    ]:
        yield f"do not begin below their roof: {first_ten(above)}"


def lengths_m(values: Any, factor: float | None) -> Floats:
    """Return lengths [m]; a number without a unit of its own counts `factor` metres, or one."""
    return parsed(values, partial(metres, factor=factor or 1.0))


def _stated(frame: Any, name: str, factor: float | None) -> tuple[Floats, list[Quote]]:
    """Heights [m] of a column and of solids; solids come first unless another column is named."""
    values = column(frame, name)
    roof_m, quotes = _within(lengths_m(values, factor), ROOF), list[Quote]()
    if SOLID in frame:
        is_osm_height, high = name == OF_OPENSTREETMAP["height"], frame[SOLID].to_numpy()
        solid_m = _within(high * _unit_of_solids(frame, name, factor)[0], ROOF)
        roof_m = np.where(np.isnan(solid_m) | ~(is_osm_height | np.isnan(roof_m)), roof_m, solid_m)
        quotes.append((SOLID, frame[SOLID], (high > 0.0) & np.isnan(roof_m)))
    return roof_m, [*quotes, (name, values, np.isnan(roof_m))]


def _unit_of_solids(frame: Any, name: str, factor: float | None) -> tuple[float, str]:
    """The unit of solids [m], and what says so.

    A vertical axis comes first; a factor is for solids only if no other column is named for it.
    """
    unit_m, unit = vertical_unit(frame.crs)
    by_axis = any(axis.direction == "up" for axis in frame.crs.axis_info)
    if factor is None or by_axis or name != OF_OPENSTREETMAP["height"]:
        return unit_m, f"the {unit} of the reference system"
    return factor, "the stated factor"


def _by_storeys(
    frame: Any, name: str, level_height_m: float, factor: float | None
) -> tuple[Floats, list[Quote]]:
    """Heights [m] by storeys, with the roof by its own storeys or its height, the more of both."""
    values, on_top, top = column(frame, name), *(tag(frame, key) for key in MORE_TAGS[:2])
    floors, top_floors, top_m = (
        *(parsed(quoted, storeys) for quoted in (values, on_top)),
        lengths_m(top, factor),
    )
    above_m = np.fmax(np.fmax(top_floors * level_height_m, top_m), 0.0)
    counted = _within(floors + np.nan_to_num(top_floors), STOREYS)
    roof_m = _within(floors * level_height_m + above_m, ROOF)
    roof_m = np.where(np.isnan(counted), math.nan, roof_m)
    has_roof = ~np.isnan(roof_m)
    unread = has_roof & np.isnan([top_floors, top_m])
    on_roof = zip(MORE_TAGS, (on_top, top), unread, strict=False)
    return roof_m, [(name, values, ~has_roof), *on_roof]


def _bases(
    frame: Any, level_height_m: float, factor: float | None
) -> tuple[tuple[str, Any, Floats], ...]:
    """Tags that state where a building begins above the ground, with their values in metres."""
    height, level = (tag(frame, name) for name in BASES)
    bases_m = lengths_m(height, factor), parsed(level, storeys) * level_height_m
    return tuple(zip(BASES, (height, level), bases_m, strict=True))


def _within(numbers: Floats, allowed: Range) -> Floats:
    """Numbers in their range, NaN for others."""
    assert allowed.le is not None
    return np.where((numbers > 0.0) & (numbers <= allowed.le), numbers, math.nan)


def _quoted(quotes: list[Quote], index: Any) -> pd.DataFrame:
    """The first value of each feature that cannot be read, and its name; empty if there is none."""
    quoted = pd.DataFrame({"unread": "", "of": ""}, index, dtype=object)
    for name, values, where in quotes:
        quoting = where & (texts(values) != "").to_numpy() & (quoted["of"] == "").to_numpy()
        quoted.loc[quoting, "unread"] = [*map(shown, values[quoting])]
        quoted.loc[quoting, "of"] = name
    return quoted
