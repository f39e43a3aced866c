"""Routes on a map: drawn from above and from the side, side by side where they share legs."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.transforms import ScaledTranslation

from optuav.arrays import Floats
from optuav.plan import Stop
from optuav.plots.labels import POINTS_PER_INCH, root
from optuav.plots.scene import Point, Scene
from optuav.plots.style import BLACK, GREEN, KINDS, PALE, margins

MARKERS = {"hover": "o", "rest": "s"}
SHIFT = 2.0
"""Distance between legs that would lie on each other [pt]."""
ARROW_AT, ARROW_STEP = 0.56, 0.05
"""Where a leg shows its direction: past the middle, so that there and back do not meet; and how
much farther its neighbour does."""


class Way(NamedTuple):
    """A route as it is drawn."""

    names: tuple[str, ...]
    points: list[Point]
    stops: tuple[Stop, ...]
    look: Mapping[str, Any]

    @property
    def side(self) -> Floats:
        """Corners from the side (corner, 2): distance over ground and height [m]."""
        corners = np.array(self.points)
        steps = np.hypot(*np.diff(corners[:, :2], axis=0).T)
        return np.stack([np.concatenate([[0.0], np.cumsum(steps)]), corners[:, 2]], axis=1)


def draw_from_above(ax: Axes, shown: Scene, ways: Sequence[Way]) -> None:
    """Draw ways on the map, legs that several of them share side by side, and their stops."""
    aside = shifts([way.points for way in ways])
    for way, legs_aside in zip(ways, aside, strict=True):
        for (start, end), shift in zip(itertools.pairwise(way.points), legs_aside, strict=True):
            _draw_leg(ax, start, end, shift, way.look)
        for stop in way.stops:
            ((x, y, _),) = shown.positions([stop.at])
            ax.plot(x, y, zorder=6, **stop_look(stop.kind, stop.duration_s > 0.0))
    for x, y, _ in shown.positions(["origin", "destination"]):
        ax.plot(x, y, "D", color=BLACK, markersize=4, zorder=6)


def draw_from_side(ax: Axes, shown: Scene, ways: Sequence[Way]) -> Artist:
    """Draw heights along the ways, one a little above the other; the legend's entry."""
    limits = shown.mission.limits
    highest_m = max(1.0, limits.min_altitude_m)
    lowest_m = farthest_m = 0.0
    for rank, way in enumerate(ways):
        along_m, z = way.side.T
        raised_in = (rank - (len(ways) - 1) / 2) * SHIFT / POINTS_PER_INCH
        raised = ax.transData + ScaledTranslation(0.0, raised_in, root(ax).dpi_scale_trans)
        ax.plot(along_m, z, transform=raised, zorder=3, **way.look)
        for number, name in enumerate(way.names):
            for stop in (each for each in way.stops if each.at == name):
                look = stop_look(stop.kind, stop.duration_s > 0.0)
                ax.plot(along_m[number], z[number], transform=raised, zorder=6, **look)
        roof_m = _draw_buildings_along(ax, shown, way)
        lowest_m, highest_m = min(lowest_m, *z), max(highest_m, roof_m, *z)
        farthest_m = max(farthest_m, along_m[-1])
    aside = "\n(lines side by side)" if len(ways) > 1 else ""
    ax.set(xlim=margins([0.0, farthest_m]), xlabel=f"distance over ground along the way [m]{aside}")
    ax.set(ylim=(lowest_m, lowest_m + 1.35 * (highest_m - lowest_m)), ylabel="height z [m]")
    return ax.axhspan(
        limits.min_altitude_m,
        limits.max_altitude_m,
        facecolor=f"{GREEN}1F",
        hatch="....",
        edgecolor=f"{GREEN}40",
        linewidth=0.0,
        label="altitudes for hovering",
    )


def _draw_leg(ax: Axes, start: Point, end: Point, shift: float, look: Mapping[str, Any]) -> None:
    """A leg on the map, moved aside to its left or right as seen from its lesser end."""
    length = math.dist(start[:2], end[:2])
    if length == 0.0:
        return
    low, high = sorted((start[:2], end[:2]))
    normal = (low[1] - high[1]) / length, (high[0] - low[0]) / length
    inches = shift * SHIFT / POINTS_PER_INCH
    moved = ScaledTranslation(normal[0] * inches, normal[1] * inches, root(ax).dpi_scale_trans)
    transform = ax.transData + moved
    ax.plot(*zip(start[:2], end[:2], strict=True), transform=transform, zorder=3, **look)
    at = ARROW_AT + ARROW_STEP * shift
    tail, head = (
        (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
        for share in (at - 0.02, at)
    )
    arrow = {"arrowstyle": "-|>", "color": look["color"], "linewidth": 0.0, "mutation_scale": 12.0}
    arrow |= {"shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", head, tail, xycoords=transform, textcoords=transform, arrowprops=arrow)


def stop_look(kind: str, stays: bool) -> dict[str, Any]:
    """A stop's marker; hollow where the UAV passes by."""
    return {
        "marker": MARKERS[kind],
        "markersize": 6.0,
        "markerfacecolor": KINDS[kind] if stays else "white",
        "markeredgecolor": "white" if stays else KINDS[kind],
        "markeredgewidth": 0.8,
    }


def _draw_buildings_along(ax: Axes, shown: Scene, way: Way) -> float:
    """Draw the buildings that a way leads to or over; the highest roof [m], 0 without any."""
    highest_m = 0.0
    for low_m, high_m, roof_m in _buildings_along(shown, way):
        highest_m = max(highest_m, roof_m)
        ax.add_patch(Rectangle((low_m, 0.0), high_m - low_m, roof_m, color=PALE, linewidth=0.8))
    return highest_m


def _buildings_along(shown: Scene, way: Way) -> Iterator[tuple[float, float, float]]:
    """Where a way is over a footprint, from and to [m] over ground, and the roof [m]."""
    import shapely

    tree, roofs_m = shown.obstacles.tree, shown.obstacles.roof_m
    for (start, end), begin_m in zip(itertools.pairwise(way.points), way.side[:, 0], strict=False):
        if start[:2] == end[:2]:
            continue
        line = shapely.LineString([start[:2], end[:2]])
        for number in np.sort(tree.query(line, predicate="intersects")):
            common = shapely.intersection(line, tree.geometries[number])
            for part in shapely.get_parts(common):
                along = [math.dist(start[:2], point) for point in part.coords]
                yield (
                    float(begin_m + min(along)),
                    float(begin_m + max(along)),
                    float(roofs_m[number]),
                )


def shifts(ways: Sequence[Sequence[Point]]) -> list[list[float]]:
    """By how many line widths every leg of every way moves aside, so that none hides another."""
    users: dict[Any, list[tuple[int, int]]] = defaultdict(list)
    for number, way in enumerate(ways):
        for leg, (start, end) in enumerate(itertools.pairwise(way)):
            users[frozenset((start[:2], end[:2]))].append((number, leg))
    aside = [[0.0] * (len(way) - 1) for way in ways]
    for legs in users.values():
        for rank, (number, leg) in enumerate(legs):
            aside[number][leg] = rank - (len(legs) - 1) / 2
    return aside
