"""Columns of a map, and tags of OpenStreetMap in place of them."""

from __future__ import annotations

import math
import re
from typing import Any

import pandas as pd

TAGS = "other_tags"  # Where GDAL puts the tags of OpenStreetMap that have no column
SOLID = "height of the solid"  # Column for the heights of solids, in the unit of their system
QUOTED = r'"((?:[^"\\]|\\.)*)"'  # A name or a value in the column of tags
SHORT = 10  # Letters of a name in a shapefile
NO = ("", "no", "false", "0", "0.0")  # Values that deny what their column or tag says


def column(frame: Any, name: str) -> Any:
    """Return the values of a column, or else of a tag of that name."""
    if name in frame:
        return frame[name]
    if TAGS in frame:
        pattern = f'"{re.escape(name)}"=>{QUOTED}'
        tags = frame[TAGS].astype("str").str.extract(pattern, expand=False)
        return tags.str.replace(r"\\(.)", r"\1", regex=True)
    return pd.Series(math.nan, frame.index)


def spellings(name: str) -> tuple[str, ...]:
    """Return the names of columns for a tag of OpenStreetMap.

    Databases write ``_`` for ``:``, and shapefiles cut off all but ten letters.
    """
    plain = name.replace(":", "_")
    return name, plain, name[:SHORT], plain[:SHORT]


def tag(frame: Any, name: str) -> Any:
    """Return the values of a tag of OpenStreetMap, by the first of its names that is there."""
    return column(frame, next((known for known in spellings(name) if known in frame), name))


def texts(values: Any) -> Any:
    """Return values as texts, empty where there is none."""
    return values.astype("str").str.strip().where(values.notna(), "")


def affirmed(values: Any) -> Any:
    """Return whether values are stated and do not deny what their name says."""
    return ~texts(values).str.lower().isin(NO)


def columns_of(frame: Any) -> list[str]:
    """Names of the columns that the file has."""
    added = frame.geometry.name, SOLID, "mended"
    return [name for name in frame.columns if name not in added]


def names_in(frame: Any) -> list[str]:
    """Names of columns and tags."""
    tags = frame[TAGS].dropna().astype("str").str.findall(f"{QUOTED}=>") if TAGS in frame else []
    return [*columns_of(frame), *dict.fromkeys(name for row in tags for name in row)]
