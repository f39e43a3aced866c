"""Maps of hover times over positions, and of lasers and whom they serve."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.transforms import offset_copy
from matplotlib.typing import LineStyleType

from optuav.arrays import Floats, Integers
from optuav.errors import Fault, InputError
from optuav.mission import Mission, load
from optuav.mission.messages import plural, shown
from optuav.network.map_extent import scene
from optuav.plots import signs, style
from optuav.plots.heat import LONGEST_HOVER_LABEL, heat_map, without_value
from optuav.plots.map import draw_buildings, draw_site
from optuav.plots.style import BLACK, DARK, GREY, PALE, SKY, Look
from optuav.presentation.numbers import coordinates, figure, seconds

if TYPE_CHECKING:
    import xarray

MOVED = {"link.device_m": "device", "laser.position_m": "laser", "route.hover_m": "hover point"}
"""Name of the place that a map moves, by its key."""
OF_DEVICE = {"position_m": "device {}", "hover_m": "hover point of {}"}
"""The same of one of several devices, by the end of the key, with its name."""
NO_MAP = "a map, as the functions of optuav.maps return it"
LARGEST_IN, LEAST_IN, AROUND_IN, LEGEND_IN = (5.4, 6.0), (1.6, 1.6), (1.8, 1.5), 6.0
"""Largest and least size of a map, what surrounds it, and width of its legend [inch]."""
LABELS_PT = 32.0  # Height of the labels below axes [pt]


@style.applied()
def hover_map(
    mission: Mission | str | Path, found: xarray.DataArray, *, ax: Axes | None = None
) -> Axes:
    """Draw the longest hover over positions, with contours, buildings and the best position.

    Parameters
    ----------
    mission
        The mission whose places are shown, also by its name or path.
    found
        Its map, as the functions of `optuav.maps` return it.
    ax
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, in m.

    Raises
    ------
    InputError
        If it is not such a map, or the mission cannot be loaded.

    Examples
    --------
    >>> import optuav
    >>> hovers = optuav.maps.laser("paper", 250)
    >>> ax = optuav.plots.hover_map(optuav.load("paper"), hovers)
    >>> ax.get_title(loc="left").splitlines()
    ['paper: longest hover, laser anywhere at z = 50 m,', 'perspective available']
    """
    mission = load(mission)
    moved = _moved(getattr(found, "attrs", {}).get("over", ""))
    if moved is None or {*found.dims} != {"x", "y"} or min(found.shape) < 2:
        raise InputError([Fault("found", type(found).__name__, NO_MAP)])
    found = found.sortby(["x", "y"]).transpose("y", "x")
    x, y, site = found.x.to_numpy(), found.y.to_numpy(), scene(mission)
    ax = _map_axes(np.array([x[-1] - x[0], y[-1] - y[0]]), ax)
    walls: Look = {"facecolor": "none", "edgecolor": BLACK, "zorder": 3}
    handles = draw_site(ax, site, walls, cased=True)
    box = np.array([[x[0], y[0]], [x[-1], y[-1]]])
    for device in mission.devices:  # The title tells of one by its name
        at_m, name = device.position_m[:2], style.drawable(device.name)
        if ((at_m >= box[0]) & (at_m <= box[1])).all():
            style.annotate_beside(ax, name, at_m, (7.0, 6.0), zorder=5, **style.HALO)
    points = [("end", "origin and destination", ["origin", "destination"])]
    hovers = site.places.hovers[site.places.exists[site.places.hovers]].tolist()
    word = f"hover point{'s' * (len(hovers) > 1)}"
    points += [("hover", word, [site.places.names[place] for place in hovers])] if hovers else []
    for sign, words, names in points:
        handles += signs.put(ax, sign, site.positions(names), words, cased=True, zorder=4)
    if (best_m := found.attrs.get("best_m")) is not None:
        words = f"best: {seconds(float(found.max()), 1)} at {coordinates(best_m[:2], 10)} m"
        words += ", edge of the map" * (found.attrs["best_at"] == "edge")
        # It may be at the edge of the map
        handles += signs.put(ax, "optimum", best_m, words, clip_on=False)
    roofs_m = site.places.position_m[site.places.buildings, :2]
    handles = [handle for handle in handles if _reaches(handle, roofs_m, box)]
    if found.isnull().any():
        handles.append(without_value("no plan"))
    _legend_below(ax, handles)
    height_m = figure(found.attrs["height_m"], 10)
    rule = f"\n{style.perspective(found.attrs['perspective'])}"
    places = f"{moved} anywhere at z = {height_m} m"
    title = style.titled(mission.name, "longest hover", places, rule)
    return heat_map(x, y, found.to_numpy(), ("x [m]", "y [m]", LONGEST_HOVER_LABEL), title, ax)


def _moved(key: object) -> str | None:
    """Name of the place that a map moves; None of another key."""
    table, _, last = str(key).partition(".")
    name, _, end = last.rpartition(".")
    if table == "devices" and end in OF_DEVICE:
        return OF_DEVICE[end].format(style.drawable(name))
    return MOVED.get(str(key))


class _Placed(Protocol):
    """Lasers on some of several candidates."""

    @property
    def missions(self) -> tuple[Mission, ...]: ...
    @property
    def perspective(self) -> str: ...
    @property
    def candidates_m(self) -> Floats: ...
    @property
    def position_m(self) -> Floats: ...
    @property
    def selection(self) -> Any: ...
    @property
    def laser(self) -> Integers: ...
    @property
    def names(self) -> tuple[str, ...]: ...


@style.applied()
def sites(found: _Placed, *, ax: Axes | None = None) -> Axes:
    """Draw candidates, the sites chosen, lasers where they are, and the devices they serve.

    Parameters
    ----------
    found
        The answer of `optuav.place_laser`. Buildings come from its first mission.
    ax
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, in m.

    Raises
    ------
    InputError
        If it is not such an answer.

    Examples
    --------
    >>> import optuav
    >>> hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    >>> siting = optuav.place_laser(hazy, [[1000, 0, 50], [1000, 2000, 50]])
    >>> optuav.plots.sites(siting).get_title(loc="left")
    'paper: lasers on 1 of 2 candidates, perspective available'
    """
    if not hasattr(found, "candidates_m"):
        raise InputError([Fault("found", shown(found), "must be an answer of optuav.place_laser")])
    counts = [len(mission.served) for mission in found.missions]
    site, laser = scene(found.missions[0]), np.repeat(found.laser, counts)
    served = laser >= 0
    every = (device for mission in found.missions for device in mission.served)
    devices_m = np.array([device.position_m[:2] for device in every])
    candidates_m, lasers_m = found.candidates_m[:, :2], found.position_m[:, :2]
    chosen_m = candidates_m[[*found.selection.sites]]
    roofs_m = found.missions[0].buildings.roof_m[:, :2]
    every_m = np.concatenate([devices_m, candidates_m, lasers_m, roofs_m])
    x, y = (style.margins(values) for values in every_m.T)
    ax = _map_axes(np.array([x[1] - x[0], y[1] - y[0]]), ax)
    ax.set(xlim=x, ylim=y, xlabel="x [m]", ylabel="y [m]")
    handles = draw_buildings(ax, site, {"facecolor": PALE, "edgecolor": GREY})
    own_m, moved = lasers_m[laser[served]], (chosen_m != lasers_m).any(axis=1)
    lines: tuple[tuple[str, Floats, str, LineStyleType], ...] = (
        ("device and its laser", _lines(devices_m[served], own_m), SKY, "-"),
        ("moved", _lines(chosen_m[moved], lasers_m[moved]), DARK, style.DOTTED),
    )
    for words, at_m, colour, dashes in lines:
        look: Look = {"color": colour, "linestyle": dashes, "linewidth": 1.0, "label": words}
        handles += ax.plot(*at_m.T, **look) if len(at_m) else []
    ring: Look = {"marker": "o", "markersize": 14.0, "linestyle": "", "markerfacecolor": "none"}
    handles += signs.put(ax, "laser", candidates_m, "candidate", hollow=True, markersize=6.0)
    ring |= {"markeredgecolor": DARK, "markeredgewidth": 0.9, "label": "selected"}
    handles += ax.plot(*chosen_m.T, **ring) if len(chosen_m) else []
    handles += signs.put(ax, "laser", lasers_m, "laser")
    handles += signs.put(ax, "device", devices_m[served], "device")
    handles += signs.put(ax, "device", devices_m[~served], "device without a plan", hollow=True)
    for number, at_m in zip(found.selection.sites, chosen_m, strict=True):
        name = style.drawable(found.names[number]) if found.names else ""
        words = f"{name} ({number})" if name else f"{number}"
        style.annotate_beside(ax, words, tuple(at_m), (7.0, 5.0), fontsize=8.0)
    _legend_below(ax, handles)
    lasers = f"lasers on {len(chosen_m)} of {plural(len(candidates_m), 'candidate')}"
    rule = style.perspective(found.perspective)
    ax.set_title(style.titled(found.missions[0].name, lasers, rule))
    style.group_thousands(ax)
    for _ in range(2):  # The first time moves the axes, as both have one scale, and their labels
        style.settle(ax)
    return ax


def _lines(starts_m: Floats, ends_m: Floats) -> Floats:
    """Lines as one with gaps (point, 2) [m]."""
    return np.stack([starts_m, ends_m, np.full_like(ends_m, np.nan)], axis=1).reshape(-1, 2)


def _map_axes(size_m: Floats, ax: Axes | None) -> Axes:
    """Axes of one scale for a map of this size (2,) with a legend below, if need be on a page."""
    if ax is None:
        across_in, deep_in = np.maximum(size_m * np.min(LARGEST_IN / size_m), LEAST_IN).tolist()
        ax = style.page(deep_in + AROUND_IN[1], max(across_in + AROUND_IN[0], LEGEND_IN)).subplots()
    ax.set_aspect("equal")
    return ax


def _legend_below(ax: Axes, handles: Sequence[Artist]) -> None:
    """Put a legend below the map: of the page, or else of only the axes."""
    page = style.root(ax)
    if isinstance(page, style.Page):
        page.legend(handles=handles, loc="outside lower left", ncols=3)
    else:
        below = offset_copy(ax.transAxes, page, 0.0, -LABELS_PT, units="points")
        look: Look = {"loc": "upper left", "bbox_to_anchor": (0.0, 0.0), "borderaxespad": 0.0}
        ax.legend(handles=handles, bbox_transform=below, ncols=2, **look)


def _reaches(drawn: Artist, roofs_m: Floats, box: Floats) -> bool:
    """Return whether marks, or buildings with these roofs, are within a box (2, 2) on the map."""
    points = drawn.get_xydata() if isinstance(drawn, Line2D) else roofs_m
    return bool(((points >= box[0]) & (points <= box[1])).all(axis=1).any())
