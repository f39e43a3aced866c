"""Where lasers are put, and whom they serve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from optuav.arrays import Floats
from optuav.network.scene import scene
from optuav.plots import style
from optuav.plots.map import draw_buildings
from optuav.plots.positions import COLUMNS, map_axes
from optuav.plots.style import BLACK, GREEN, GREY, ORANGE, PALE, PURPLE, SKY, Look

if TYPE_CHECKING:
    from optuav.siting.place_laser import Siting


@style.applied()
def sites(found: Siting) -> Axes:
    """Draw candidates, the sites chosen, lasers where they are, and the devices they serve.

    Parameters
    ----------
    found
        As `optuav.place_laser` returns it. Buildings are those of its first mission.

    Returns
    -------
    The axes, in m.

    Examples
    --------
    >>> import optuav
    >>> hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    >>> found = optuav.place_laser(hazy, [[1000, 0, 50], [1000, 2000, 50]])
    >>> optuav.plots.sites(found).get_title(loc="left")
    'paper: 1 of 2 candidates, for 1 mission, available'
    """
    shown, served = scene(found.missions[0]), found.laser >= 0
    devices_m = np.array([mission.link.device_m[:2] for mission in found.missions])
    candidates_m, lasers_m = found.candidates_m[:, :2], found.position_m[:, :2]
    chosen_m = candidates_m[[*found.choice.sites]]
    roofs_m = shown.places.position_m[shown.places.buildings, :2]
    every_m = np.concatenate([devices_m, candidates_m, lasers_m, roofs_m])
    x, y = (style.margins(values) for values in every_m.T)
    ax = map_axes(np.array([x[1] - x[0], y[1] - y[0]]))
    ax.set(xlim=x, ylim=y, xlabel="x [m]", ylabel="y [m]")
    handles = draw_buildings(ax, shown, {"facecolor": PALE, "edgecolor": GREY})
    ways = np.stack([devices_m[served], lasers_m[found.laser[served]]], axis=1)
    moves = np.stack([chosen_m, lasers_m], axis=1)
    moves = moves[(moves[:, 0] != moves[:, 1]).any(axis=1)]
    lines: tuple[tuple[str, Floats, Look], ...] = (
        ("device and its laser", ways, {"colors": SKY, "linewidths": 0.8}),
        ("moved", moves, {"colors": PURPLE, "linewidths": 1.6}),
    )
    marks: tuple[tuple[str, str, Floats, Look], ...] = (
        ("o", "candidate", candidates_m, {"color": ORANGE, "fillstyle": "none", "markersize": 5.0}),
        ("s", "chosen", chosen_m, {"color": BLACK, "fillstyle": "none", "markersize": 8.0}),
        ("*", "laser", lasers_m, {"color": PURPLE, "markersize": 9.0}),
        ("^", "device", devices_m[served], {"color": GREEN, "markersize": 6.0}),
        ("^", "device without a plan", devices_m[~served], {"color": GREEN, "fillstyle": "none"}),
    )
    for words, ends, look in lines:
        if len(ends):
            handles.append(
                ax.add_collection(LineCollection([*ends], label=words, **look, zorder=2.5))
            )
    for marker, words, at_m, look in marks:
        if len(at_m):
            handles += ax.plot(*at_m.T, marker, label=words, zorder=3, **look)
    below: Look = {"loc": "outside lower left", "ncols": COLUMNS}
    style.root(ax).legend(handles=handles, **below)
    count, every = len(found.choice.sites), len(found.missions)
    title = f"{style.printed(found.missions[0].name)}: {count} of {len(candidates_m)} candidates, "
    ax.set_title(f"{title}for {every} mission{'s' * (every > 1)}, {found.perspective}")
    style.group_thousands(ax)
    return ax
