"""A quantity over two others: its values as colours, with contours."""

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from optuav.arrays import Floats
from optuav.plots import style
from optuav.plots.style import BLACK, GREY, Look

COLOURS = "viridis"  # In the same order of brightness for colour-blind readers
MOST_CONTOURS = 8
NONE: Look = {"facecolor": "white", "edgecolor": GREY, "hatch": "////", "linewidth": 0.0}
"""The look of places without a value."""
NAMES: Look = {"fontsize": 6.5, "inline": False}
"""The look of the values beside contours."""


@style.applied()
def heat_map(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    values: npt.ArrayLike,
    *,
    title: str,
    x_label: str,
    y_label: str,
    label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw a quantity over two others as colours, with contours at round values.

    Of growing numbers x and y, which are the middles of cells, and values (y, x), hatched where
    they are NaN. On a page of its own by default.
    """
    ax = ax or style.page(4.4).subplots()
    across, upwards, table = (np.asarray(each, dtype=float) for each in (x, y, values))
    known, columns, rows = np.isfinite(table), _edges(across), _edges(upwards)
    ax.set(title=title, xlabel=x_label, ylabel=y_label)
    if not known.all():
        corner, size = (columns[0], rows[0]), (columns[-1] - columns[0], rows[-1] - rows[0])
        ax.add_patch(Rectangle(corner, *size, zorder=0.5, **NONE))
    shown = ax.pcolorfast(columns, rows, np.ma.masked_invalid(table), cmap=COLOURS)
    shown.set_zorder(0.8)
    ax.set(xlim=columns[[0, -1]], ylim=rows[[0, -1]])
    if known.any():
        bar = style.root(ax).colorbar(shown, ax=ax, label=label, shrink=0.9)
        bar.outline.set_linewidth(0.4)
    style.group_thousands(ax)
    style.settle(ax)
    if levels := contour_levels(table):
        for level in levels:
            bar.ax.axhline(level, color=BLACK, linewidth=0.5)
        lines = ax.contour(across, upwards, table, levels, colors=BLACK, linewidths=0.5)
        parts = zip(map(_named, levels), lines.allsegs, strict=True)
        ways = {name: ax.transData.transform(np.concatenate(each)) for name, each in parts if each}
        _keep(ax.clabel(lines, fmt=_named, **NAMES), ways)
    return ax


def _named(level: float) -> str:
    """The name of a contour."""
    return style.minus(f"{level:.10g}")


def _keep(names: Iterable[Text], ways: Mapping[str, Floats]) -> None:
    """Keep the names that lie on no other and on no way of another contour, by its name [px]."""
    taken = list[Bbox]()
    for each in names:
        each.set_path_effects([withStroke(linewidth=1.5, foreground="white")])
        box = each.get_window_extent()
        others = [way for name, way in ways.items() if name != each.get_text()]
        crossed = any(((box.min <= way) & (way <= box.max)).all(axis=1).any() for way in others)
        if crossed or any(box.overlaps(other) for other in taken):
            each.remove()
        else:
            taken.append(box)


def without_value(label: str) -> Patch:
    """The entry of places without a value in a legend."""
    return Patch(label=label, **NONE)


def contour_levels(values: Floats) -> list[float]:
    """Round values between the smallest and the largest, at which contours are drawn."""
    known = values[np.isfinite(values)]
    if not len(known):
        return []
    low, high = float(known.min()), float(known.max())
    steps = MaxNLocator(MOST_CONTOURS, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [level for each in steps if low < (level := float(f"{each:.10g}")) < high]


def _edges(middles: Floats) -> Floats:
    """The borders of cells around their middles."""
    between = 0.5 * (middles[1:] + middles[:-1])
    ends = 2.0 * middles[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])
