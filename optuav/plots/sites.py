"""Where lasers are put, and whom they serve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.errors import Fault, InputError
from optuav.mission.messages import shown
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

    Raises
    ------
    InputError
        If it is no such answer.

    Examples
    --------
    >>> import optuav
    >>> hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    >>> found = optuav.place_laser(hazy, [[1000, 0, 50], [1000, 2000, 50]])
    >>> optuav.plots.sites(found).get_title(loc="left")
    'paper: lasers on 1 of 2 candidates, perspective available'
    """
    if not hasattr(found, "candidates_m"):
        raise InputError([Fault("found", shown(found), "as optuav.place_laser returns it")])
    site, served = scene(found.missions[0]), found.laser >= 0
    devices_m = np.array([mission.link.device_m[:2] for mission in found.missions])
    candidates_m, lasers_m = found.candidates_m[:, :2], found.position_m[:, :2]
    chosen_m = candidates_m[[*found.selection.sites]]
    roofs_m = found.missions[0].buildings.roof_m[:, :2]
    every_m = np.concatenate([devices_m, candidates_m, lasers_m, roofs_m])
    x, y = (style.margins(values) for values in every_m.T)
    ax = map_axes(np.array([x[1] - x[0], y[1] - y[0]]))
    ax.set(xlim=x, ylim=y, xlabel="x [m]", ylabel="y [m]")
    handles = draw_buildings(ax, site, {"facecolor": PALE, "edgecolor": GREY})
    own_m, moved = lasers_m[found.laser[served]], (chosen_m != lasers_m).any(axis=1)
    drawn: tuple[tuple[str, str, Floats, str, float], ...] = (
        ("-", "device and its laser", _lines(devices_m[served], own_m), SKY, 0.0),
        ("-", "moved", _lines(chosen_m[moved], lasers_m[moved]), PURPLE, 0.0),
        ("o", "candidate", candidates_m, ORANGE, 5.0),
        ("s", "chosen", chosen_m, BLACK, 8.0),
        ("*", "laser", lasers_m, PURPLE, 9.0),
        ("^", "device", devices_m[served], GREEN, 6.0),
        ("^", "device without a plan", devices_m[~served], GREEN, 6.0),
    )
    for marker, words, at_m, colour, size in drawn:
        look: Look = {"color": colour, "markersize": size, "linewidth": 1.0, "label": words}
        look |= {"fillstyle": "full" if words in ("laser", "device") else "none"}
        handles += ax.plot(*at_m.T, marker, **look) if len(at_m) else []
    style.root(ax).legend(handles=handles, loc="outside lower left", ncols=COLUMNS)
    title = f"{style.printed(found.missions[0].name)}: lasers on {len(chosen_m)} of "
    ax.set_title(f"{title}{len(candidates_m)} candidates, perspective {found.perspective}")
    style.group_thousands(ax)
    return ax


def _lines(starts_m: Floats, ends_m: Floats) -> Floats:
    """Lines as one with gaps (point, 2) [m]."""
    return np.stack([starts_m, ends_m, np.full_like(ends_m, np.nan)], axis=1).reshape(-1, 2)
