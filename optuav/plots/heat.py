"""Any quantity over two others, as colours with contours."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np
from contourpy import contour_generator
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize
from matplotlib.contour import ContourSet
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from optuav.arrays import Floats
from optuav.plots import style
from optuav.plots.style import BLACK, GREY, Look
from optuav.presentation.numbers import figure, significant

COLOURS = "viridis"  # Brightness keeps its order for colour-blind readers
MOST_CONTOURS = 8
CLOSE_PT = 2.5  # Distance of two contours below which they are one thick line
NONE: Look = {"facecolor": "white", "edgecolor": GREY, "hatch": "////", "linewidth": 0.0}
"""The look of places without a value."""
LONGEST_HOVER_LABEL = "longest hover Δ [s]"
BELOW: Look = {"loc": "outside lower left", "ncols": 3}  # Place of a legend
ISLAND = 3.0  # Least area [cells] that a closed contour surrounds; fewer cells would be diamonds


@style.applied()
def heat_map(
    x: Floats,
    y: Floats,
    values: Floats,
    labels: tuple[str, str, str],
    title: str,
    ax: Axes | None = None,
    scale: Normalize | None = None,
) -> Axes:
    """Draw a quantity over two others as colours, with contours at round values.

    The values (y, x) are hatched where NaN; x and y grow, as the middles of cells. On a page of its
    own, or with a scale of colours, which has its bar elsewhere, the axes end at the first and last
    of them, as what lies beyond may not be allowed.
    """
    is_finite, columns, rows = np.isfinite(values), _edges(x), _edges(y)
    makes_axes = ax is None or scale is not None
    ends = (x[[0, -1]], y[[0, -1]]) if makes_axes else (columns[[0, -1]], rows[[0, -1]])
    if ax is None:
        ax = style.page(4.4).subplots()
        if not is_finite.all():
            style.root(ax).legend(handles=[without_value("no plan")], **BELOW)
    ax.set(title=title, xlabel=labels[0], ylabel=labels[1])
    if not is_finite.all():
        corner, size = (columns[0], rows[0]), (columns[-1] - columns[0], rows[-1] - rows[0])
        ax.add_patch(Rectangle(corner, *size, zorder=0.5, **NONE))
    shown = ax.pcolorfast(columns, rows, np.ma.masked_invalid(values), cmap=COLOURS, norm=scale)
    shown.set_zorder(0.8)
    ax.set(xlim=ends[0], ylim=ends[1])
    bars = list[Colorbar]()
    if is_finite.any() and scale is None:
        bars = [style.root(ax).colorbar(shown, ax=ax, label=labels[2], shrink=0.9)]
        bars[0].outline.set_linewidth(0.4)
    style.group_thousands(ax)
    style.settle(ax)
    style.thin_ticks(ax)
    ends_of = values if scale is None else np.array([scale.vmin, scale.vmax], dtype=float)
    low, high = values[is_finite].min(initial=np.inf), values[is_finite].max(initial=-np.inf)
    if levels := [level for level in contour_levels(ends_of) if low < level < high]:
        for bar, level in product(bars, levels):
            bar.ax.axhline(level, color=BLACK, linewidth=0.5)
        smooth = _without_jumps(ax, x, y, values, levels)
        segments = {level: _contour(x, y, smooth, level) for level in levels}
        segments = {level: lines for level, lines in segments.items() if lines}
        drawn = {_named(level): np.concatenate(lines) for level, lines in segments.items()}
        marks = [np.asarray(line.get_xydata()) for line in ax.lines]
        drawn["marks"] = np.concatenate([np.empty((0, 2)), *marks])
        ways = {name: ax.transData.transform(way) for name, way in drawn.items()}
        if segments:
            known_levels, lines = [*segments], [*segments.values()]
            contours = ContourSet(ax, known_levels, lines, colors=BLACK, linewidths=0.5)
            _keep(ax.clabel(contours, fmt=_named, fontsize=6.5, inline=False), ways, ax.bbox)
    return ax


def _without_jumps(
    ax: Axes, x: Floats, y: Floats, values: Floats, levels: Sequence[float]
) -> Floats:
    """Values without those beside a jump, where the contours of several levels would be one."""
    rank = np.where(np.isfinite(values), np.searchsorted(levels, values), np.nan)
    steep = np.zeros(values.shape, dtype=bool)
    places_px = ax.transData.transform(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    places_pt = places_px.reshape(*values.shape, 2) * style.POINTS_PER_INCH / style.root(ax).dpi
    for axis in (0, 1):
        step_pt = np.abs(np.diff(places_pt, axis=axis)).sum(axis=-1)
        crossed = np.abs(np.diff(rank, axis=axis))
        jumps = (crossed > 1.0) & (crossed * CLOSE_PT > step_pt)
        first, second = ((slice(None),) * axis + (part,) for part in (np.s_[:-1], np.s_[1:]))
        steep[first] |= jumps
        steep[second] |= jumps
    return np.ma.masked_array(values, steep)


def _contour(x: Floats, y: Floats, values: Floats, level: float) -> list[Floats]:
    """The contours of a level as lines (point, 2), but those around a cell or two."""
    lines = contour_generator(x, y, np.ma.masked_invalid(values)).lines(level)
    closed = (np.asarray(line) for line in lines)
    return [line for line in closed if not 0.0 < _surrounded(x, y, line) < ISLAND]


def _surrounded(x: Floats, y: Floats, line: Floats) -> float:
    """The cells that a closed line surrounds; 0 if it is open."""
    if (line[0] != line[-1]).any():
        return 0.0
    across = np.interp(line[:, 0], x, np.arange(len(x)))
    upward = np.interp(line[:, 1], y, np.arange(len(y)))
    twice = across[:-1] * upward[1:] - across[1:] * upward[:-1]
    return 0.5 * abs(float(twice.sum()))


def _named(level: float) -> str:
    """The name of a contour."""
    return figure(level, 10)


def _keep(names: Iterable[Text], ways: Mapping[str, Floats], frame: Bbox) -> None:
    """Keep the names in a frame that lie on no other and no way of anything else [px]."""
    taken = list[Bbox]()
    for text in names:
        text.set_path_effects([withStroke(linewidth=1.5, foreground="white")])
        box = text.get_window_extent()
        others = [way for name, way in ways.items() if name != text.get_text()]
        crossed = any(((box.min <= way) & (way <= box.max)).all(axis=1).any() for way in others)
        cut = not (frame.contains(*box.min) and frame.contains(*box.max))
        if cut or crossed or any(box.overlaps(other) for other in taken):
            text.remove()
        else:
            taken.append(box)


def without_value(label: str) -> Patch:
    """The entry of places without a value in a legend."""
    return Patch(label=label, **NONE)


def contour_levels(values: Floats) -> list[float]:
    """Round values between the smallest and the largest, for contours."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return []
    low, high = float(finite.min()), float(finite.max())
    steps = MaxNLocator(MOST_CONTOURS, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [level for step in steps if low < (level := significant(step, 10)) < high]


def _edges(middles: Floats) -> Floats:
    """The borders of cells around their middles."""
    between = 0.5 * (middles[1:] + middles[:-1])
    ends = 2.0 * middles[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])
