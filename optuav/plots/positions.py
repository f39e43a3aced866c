"""A map of hover times over positions, with what stands there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from optuav.arrays import Floats
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.network.places import HOVER
from optuav.network.scene import scene
from optuav.plots import style
from optuav.plots.heat import heat_map, without_value
from optuav.plots.map import draw_site
from optuav.plots.style import BLACK, VERMILLION, Look

if TYPE_CHECKING:
    import xarray

MOVED = {
    "link.device_m": "device",
    "laser.position_m": "laser",
    "route.hover_m": "hover point",
}
"""What a map moves, by its key."""
NO_MAP = "a map, as the functions of optuav.maps return it"
LARGEST_IN, LEAST_IN, AROUND_IN, LEGEND_IN = (5.4, 6.0), (1.6, 1.6), (1.8, 1.5), 6.0
"""Largest and least size of a map, what surrounds it, and width of its legend [inch]."""
COLUMNS = 3


@style.applied()
def hover_map(mission: Mission | str | Path, found: xarray.DataArray) -> Axes:
    """Draw the longest hover over positions, with contours, buildings and the best position.

    Parameters
    ----------
    mission
        The mission whose places are shown, also by its name or path.
    found
        Its map, as the functions of `optuav.maps` return it.

    Returns
    -------
    The axes, in m.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.maps.laser("paper", 250)
    >>> ax = optuav.plots.hover_map(optuav.load("paper"), found)
    >>> ax.get_title(loc="left").splitlines()
    ['paper, perspective available', 'laser anywhere at z = 50 m']
    """
    mission = load(mission)
    if getattr(found, "attrs", {}).get("over") not in MOVED:
        raise InputError([Fault("found", type(found).__name__, NO_MAP)])
    x, y, shown = found.x.to_numpy(), found.y.to_numpy(), scene(mission)
    ax = map_axes(np.array([x[-1] - x[0], y[-1] - y[0]]))
    handles = draw_site(ax, shown, {"facecolor": "none", "edgecolor": BLACK, "zorder": 3})
    points = {"D": ("origin and destination", ["origin", "destination"])}
    points |= {"o": ("hover point", ["hover"])} if shown.places.exists[HOVER] else {}
    for marker, (words, names) in points.items():
        at = shown.positions(names)[:, :2].T
        handles += ax.plot(*at, marker, markersize=4.5, zorder=4, label=words)
    for each in handles:
        if isinstance(each, Line2D):
            each.set(markerfacecolor="white", markeredgecolor=BLACK, markeredgewidth=0.7)
    if (best_m := found.attrs.get("best_m")) is not None:
        words = f"best: {float(found.max()):.1f} s at ({best_m[0]:.10g}, {best_m[1]:.10g}) m"
        words += ", edge of the map" * (found.attrs["best_at"] == "edge")
        (best,) = ax.plot(*best_m[:2], "X", markersize=9.0, zorder=5, label=style.minus(words))
        best.set(markerfacecolor=VERMILLION, markeredgecolor="white", markeredgewidth=0.7)
        handles.append(best)
    roofs_m = shown.places.position_m[shown.places.buildings, :2]
    box = np.array([[x[0], y[0]], [x[-1], y[-1]]])
    handles = [each for each in handles if _reaches(each, roofs_m, box)]
    if found.isnull().any():
        handles.append(without_value("no plan"))
    below: Look = {"loc": "outside lower left", "ncols": COLUMNS}
    style.root(ax).legend(handles=handles, **below)
    moved, height_m = MOVED[found.attrs["over"]], style.minus(f"{found.attrs['height_m']:.10g}")
    title = f"{style.printed(mission.name)}, perspective {found.attrs['perspective']}\n"
    title += f"{moved} anywhere at z = {height_m} m"
    axes = {"x_label": "x [m]", "y_label": "y [m]", "label": "longest hover Δ [s]"}
    return heat_map(x, y, found.to_numpy(), title=title, ax=ax, **axes)


def map_axes(size_m: Floats) -> Axes:
    """Axes of one scale for a map of this size (2,) with a legend below, on a page of its own."""
    across_in, deep_in = np.maximum(size_m * np.min(LARGEST_IN / size_m), LEAST_IN).tolist()
    page = style.page(deep_in + AROUND_IN[1], max(across_in + AROUND_IN[0], LEGEND_IN))
    ax = page.subplots()
    ax.set_aspect("equal")
    return ax


def _reaches(drawn: Artist, roofs_m: Floats, box: Floats) -> bool:
    """Whether marks, or the buildings with these roofs, are within a box (2, 2) on the map."""
    points = drawn.get_xydata() if isinstance(drawn, Line2D) else roofs_m
    return bool(((points >= box[0]) & (points <= box[1])).all(axis=1).any())
