"""Questions about heights: columns that may be meant, feet, and heights that are missing."""

from __future__ import annotations

import difflib
import itertools
import math
import re
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from optuav.arrays import Booleans
from optuav.city.columns import SHORT, SOLID, TAGS, column, columns_of, names_in, spellings, texts
from optuav.city.heights import (
    BASES,
    MORE_TAGS,
    OF_OPENSTREETMAP,
    ROOF,
    STOREYS,
    lengths_m,
    vertical_unit,
)
from optuav.city.lengths import metres, parsed
from optuav.errors import Fault
from optuav.mission.files import label
from optuav.mission.messages import first_ten, nearest, plural, shown
from optuav.presentation.numbers import figure

LIKE = {
    "height": re.compile(
        r"height|hgt|(?:^|[^a-z])ht(?:[^a-z]|$)|^h(?:_?m)?$|"
        r"h(?:oe|ö)he|hauteur|hoogte|altezza|altura"
    ),
    "levels": re.compile(
        r"level|(?<!hi)stor(?:ey|ies|y)|floor|"
        r"[eé]tage|niveau|geschoss|stockwerk|verdieping|piani|plantas"
    ),
}
"""Words in the names of columns that may state heights or storeys, also in other languages."""
CUT_OFF = {"height": "measuredheight", "levels": "buildinglevels"}
"""Names that have these words only beyond the letters that a shapefile keeps."""
UNLIKE = re.compile(
    r"(?:^|[^a-z])(?:min|ground|base|eave)|maxheight|under|below|basement|area|space|type|source"
)
"""Words in the names of columns that state something else."""
READ = {*itertools.chain.from_iterable(map(spellings, MORE_TAGS))}
IN_FEET = re.compile(r"(?<![A-Za-z])(?i:ft|feet|foot)(?![A-Za-z])|[a-z](?:Ft|Feet|Foot)(?![a-z])")
STATES = r"\W*[0-9.,]*[1-9]"  # Start of a text that is a number other than 0
HEIGHT_WORDS = f"{ROOF.words}, or a text such as 12 m, 40 ft or 11'4\""


def nowhere(file: Path, frame: Any, names: Mapping[str, str]) -> Iterator[Fault]:
    """Yield a fault for each column that is asked for, and is neither there nor a tag."""
    for option, name in names.items():
        there = name in columns_of(frame) or column(frame, name).notna().any()
        if not there and name != OF_OPENSTREETMAP[option]:
            words = f"no column of this name{_others(frame, name)}"
            yield Fault(option, shown(name), words, label(file))


def not_asked(
    file: Path, frame: Any, unknown: Booleans, named: Mapping[str, Any]
) -> Iterator[Fault]:
    """Yield a fault for each option left out where other columns may state unknown heights."""
    bare = frame[unknown]
    names = names_in(bare)
    for option in (option for option, name in named.items() if name is None):
        like = [name for name in names if _is_like(name, option)]
        if likely := [shown(name) for name in like if _states(column(bare, name))]:
            one = len(likely) == 1
            words = f"is missing for {len(bare)} of {plural(len(frame), 'building')}, but the "
            words += f"{'column' if one else 'columns'} {first_ten(likely)} may hold them: name "
            words += f"{'this column' if one else 'one of them'} by {option}, or name "
            words += f"{shown(OF_OPENSTREETMAP[option])} to ignore {'it' if one else 'them'}"
            yield Fault(option, "", words, label(file))


def _is_like(name: str, option: str) -> bool:
    """Return whether a column is nearly named as that of heights or storeys."""
    low, tag = name.lower(), OF_OPENSTREETMAP[option]
    letters = re.sub(r"\W|_", "", low)
    cut = len(name) == SHORT and CUT_OFF[option].startswith(letters)
    like = cut or LIKE[option].search(low) or difflib.get_close_matches(letters, [tag], cutoff=0.8)
    return bool(like) and name not in {tag, *READ} and not UNLIKE.search(low)


def _states(values: Any) -> bool:
    """Return whether some of the values look like numbers other than 0."""
    return bool(texts(values).str.match(STATES).any())


def in_feet(file: Path, frame: Any, name: str, factor: float | None) -> Iterator[Fault]:
    """Yield a fault if numbers of a column seem to be in feet, and no factor is stated."""
    unit = vertical_unit(frame.crs)[1]
    if factor is not None or not ("foot" in unit or IN_FEET.search(name)):
        return
    if SOLID in frame and name == OF_OPENSTREETMAP["height"]:
        frame = frame[~(frame[SOLID] > 0.0)]
    values = column(frame, name)
    bare = np.isnan(parsed(values, partial(metres, factor=math.nan))) & (lengths_m(values, 1.0) > 0)
    if bare.any():
        why = f", as the map is in {unit}" if "foot" in unit else ""
        words = f"is missing: numbers of {shown(name)} seem to be in feet{why}; set "
        words += "0.3048 if they are, 1 if they are in metres"
        yield Fault("height_factor", "", words, label(file))


def unknown_heights(
    file: Path, frame: Any, known: pd.DataFrame, names: Mapping[str, str]
) -> Iterator[Fault]:
    """Yield a fault that buildings have unknown heights, and one for each of them."""
    unknown = known[known["roof_m"].isna()]
    if not len(unknown):
        return
    if SOLID not in frame and not {TAGS, *names.values()} & {*columns_of(frame)}:
        words = f"no column of this name, and none for levels{_others(frame, names['height'])}"
        words = f"{words}; or set default_height_m"
        yield Fault("height", shown(names["height"]), words, label(file))
        return
    words = f"of {plural(len(known), 'building')} without a height; set default_height_m"
    yield Fault("", "", f"{len(unknown)} {words}", label(file))
    columns = (unknown[column] for column in ("unread", "of", "stated_m"))
    for number, value, name, stated_m in zip(unknown.index, *columns, strict=True):
        words = HEIGHT_WORDS if name else "no height"
        if name in BASES:
            words = f"must be below the roof, at {figure(stated_m)} m"
        elif name == names["levels"]:
            words = STOREYS.words
        part = "" if name in ("", names["height"]) else f", {name}"
        yield Fault(f"feature {number}{part}", value, words)


def _others(frame: Any, name: str) -> str:
    """Say which columns there are in place of one that is missing; empty without any."""
    columns = columns_of(frame)
    return nearest(name, columns) or f"; there are {first_ten(columns)}" if columns else ""
