"""Flights as ground stations state them: places on Earth in order, and what is done there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

MOST_PLACES = 10_000
EARTH = "longitude −180 to 180, latitude −90 to 90"

Kind = Literal["pass", "hover", "rest", "take-off", "land", "return"]


class StatedStep(NamedTuple):
    """A place on Earth that an item flies to, and what it does there."""

    item: str  # such as "item 4"
    kind: Kind
    longitude_deg: float  # NaN for the place of the step before, as the latitude
    latitude_deg: float
    height_m: float
    over: Literal["home", "sea"]
    stay_s: float = 0.0
    speed_m_s: float = math.nan  # on the way there; NaN for the drone's own


class StatedFlight(NamedTuple):
    """Steps in order, from home, whose altitude above mean sea level may be unknown (NaN) [m]."""

    home: tuple[float, float]  # longitude, latitude
    home_altitude_m: float
    steps: tuple[StatedStep, ...]
    notes: tuple[str, ...]
    judged_with: Mapping[str, object] | None = None  # Of our own: values in place of a mission's


def on_earth(longitude: float, latitude: float) -> bool:
    """Return whether degrees are a place."""
    return abs(longitude) <= 180.0 and abs(latitude) <= 90.0
