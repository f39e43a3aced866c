"""Lengths and numbers of storeys as texts of a map: metres, feet and inches."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from optuav.arrays import Floats
from optuav.city.columns import texts

FOOT_M, INCHES = 0.3048, 12
FARTHEST = 1e9
NUMBER = (  # 1,000 may be one or a thousand
    r"(?:[0-9]+,[0-9]{1,2}|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]{1,3})?)"
)
METRES = re.compile(rf"\+?({NUMBER})\s*(m|met(?:er|re)s?)?", re.IGNORECASE)
FEET = re.compile(
    rf"({NUMBER})\s*(?:['′’]|ft\.?|feet|foot)[\s-]*(?:({NUMBER})\s*(?:\"|''|[″”]|in\.?|inch(?:es)?)?)?",
    re.IGNORECASE,
)


def metres(text: str, factor: float = 1.0) -> float:
    """Return the length [m] that a text states; NaN if it states none in metres or in feet.

    A number without a unit of its own counts `factor` metres.
    """
    if length := METRES.fullmatch(text):
        return _number(length[1]) * (1.0 if length[2] else factor)
    if length := FEET.fullmatch(text):
        feet, inches = _number(length[1]), _number(length[2] or "0")
        return FOOT_M * (feet + inches / INCHES) if inches < INCHES else math.nan
    return math.nan


def storeys(text: str) -> float:
    """Return a number of storeys; NaN for any other text."""
    number = METRES.fullmatch(text)
    return _number(number[1]) if number and not number[2] else math.nan


def parsed(values: Any, parse: Callable[[str], float]) -> Floats:
    """Return the numbers that values state; a text that comes again is parsed once."""
    codes, kinds = pd.factorize(texts(values))
    return np.array([*map(parse, kinds)], dtype=float)[codes]


def _number(text: str) -> float:
    """A number with a decimal point or comma; NaN beyond all that a map measures."""
    number = float(text.replace(",", "."))
    return number if number < FARTHEST else math.nan
