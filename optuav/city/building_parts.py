"""Features that are buildings, parts in place of their outlines, and what lies underground.

By the tags of OpenStreetMap: https://wiki.openstreetmap.org/wiki/Simple_3D_Buildings
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import geopandas
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely

from optuav.arrays import Booleans
from optuav.city.columns import affirmed, column, tag, texts

INSIDE_SHARE = 0.5  # Share of a part that lies in its outline
LEFT_SHARE = 0.1  # Least share of an outline that counts where its parts leave it free
NARROW_DEG = 1e-9  # Width of holes that are too narrow to be cut, a tenth of a millimetre


def built(frame: Any) -> tuple[Any, Any, Any]:
    """Return the features that are buildings or parts, which are parts, and the names of others."""
    part = affirmed(tag(frame, "building:part"))
    whole = affirmed(frame["building"]) if "building" in frame else ~part
    kept = whole | part
    return frame[kept], part[kept] & ~whole[kept], frame.index[~kept]


def underground(frame: Any, known: Any) -> tuple[Booleans, Booleans]:
    """Return what lies underground, and what does not though its layer is below 0.

    A layer below 0 alone says that a building is below ground; with a height or storeys above the
    ground, it may as well stand below a bridge.
    """
    low = pd.to_numeric(texts(column(frame, "layer")), errors="coerce").lt(0.0).to_numpy()
    buried = texts(column(frame, "location")).str.lower().eq("underground").to_numpy()
    buried = buried | affirmed(column(frame, "is_underground")).to_numpy()
    stands = (known["roof_m"].notna() | (known["of"] != "")).to_numpy()
    return buried | (low & ~stands), low & stands & ~buried


def in_place_of_outlines(town: Any) -> tuple[Any, Any, Any]:
    """Return the buildings by their parts, and the names of outlines: with parts, and too high.

    A part belongs to the outline that most of it lies in, and has its height if it states none. An
    outline of parts is no building, but for what they leave free of it, in pieces around them. If
    nothing is left, and it states more height than all of its parts, it is too high.
    """
    shapes, is_part = town.geometry.to_numpy().copy(), town["part"].to_numpy()
    wholes, parts = np.flatnonzero(~is_part), np.flatnonzero(is_part)
    part, whole = shapely.STRtree(shapes[wholes]).query(shapes[parts], predicate="intersects")
    part, whole = parts[part], wholes[whole]
    shared = shapely.area(shapely.intersection(shapes[part], shapes[whole]))
    inside = shared > INSIDE_SHARE * shapely.area(shapes[part])
    part, whole = part[inside], whole[inside]
    roof_m, of_levels = (town[name].to_numpy().copy() for name in ("roof_m", "of_levels"))
    bare = np.isnan(roof_m[part])
    of_levels[part[bare]] = of_levels[whole[bare]]
    np.fmax.at(roof_m, part[bare], roof_m[whole[bare]])
    order = np.argsort(whole, kind="stable")
    outlines, first = np.unique(whole[order], return_index=True)
    for outline, own in zip(outlines, np.split(part[order], first)[1:], strict=True):
        shapes[outline] = _left_free(shapes[outline], shapes[own])
    top_m = np.zeros(len(town))
    np.fmax.at(top_m, whole, roof_m[part])
    too_high = outlines[shapely.is_missing(shapes[outlines]) & (roof_m > top_m)[outlines]]
    town = town.assign(roof_m=roof_m, of_levels=of_levels).set_geometry(
        geopandas.GeoSeries(shapes, town.index, town.crs)
    )
    return town[~shapely.is_missing(shapes)], town.index[outlines], town.index[too_high]


def _left_free(outline: Any, parts: npt.NDArray[np.object_]) -> Any:
    """The larger pieces of an outline that its parts leave free, cut open around parts, or None."""
    taken = shapely.union_all(parts)
    shapely.prepare(taken)
    pieces = shapely.get_parts(shapely.difference(outline, taken))
    large = pieces[shapely.area(pieces) >= LEFT_SHARE * outline.area]
    # No multipolygon: its polygons may not share edges.
    return shapely.geometrycollections([*_cut(large, taken)]) if len(large) else None


def _cut(pieces: npt.NDArray[np.object_], taken: Any) -> Iterator[Any]:
    """Yield pieces, cut from south to north through every hole that parts make.

    Footprints have no holes: uncut, a ring around a part would be built over, part and all.
    """
    for piece in pieces:
        holes = np.asarray(shapely.polygons(shapely.get_rings(piece)[1:]))
        ends = shapely.bounds(holes[shapely.intersects(taken, holes)]).reshape(-1, 4)
        ends = ends[ends[:, 2] - ends[:, 0] > NARROW_DEG]
        if not len(ends):
            yield piece
            continue
        west, south, east, north = piece.bounds
        middles = np.sort((ends[:, 0] + ends[:, 2]) / 2)
        middle = middles[len(middles) // 2]
        sides = shapely.box([west, middle], south, [middle, east], north)
        halves = shapely.get_parts(shapely.intersection(piece, sides))
        yield from _cut(halves[shapely.area(halves) > 0.0], taken)
