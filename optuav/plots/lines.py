"""Curves over one quantity, with marks where something begins or ends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.typing import LineStyleType

from optuav.plots import style
from optuav.plots.labels import settle
from optuav.plots.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

DOTTED: LineStyleType = (0.0, (1.0, 1.0))
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
LINES: tuple[LineStyleType, ...] = (
    "-",
    (0.0, (5.0, 1.5)),
    (0.0, (2.0, 1.0)),
    (0.0, (6.0, 1.2, 1.5, 1.2)),
    (0.0, (9.0, 2.0)),
    DOTTED,
)
"""As many as colours, so that no two curves differ in colour alone."""
COLUMNS = 3
ROOM_ABOVE = 0.14
"""Share of the height that is left above the curves for the words of the marks."""


class Line(NamedTuple):
    """A curve.

    Parameters
    ----------
    label
        Its name in the legend.
    x, y
        Arrays of one length.
    marker
        Of every point; empty for none.
    """

    label: str
    x: npt.ArrayLike
    y: npt.ArrayLike
    marker: str = ""


class Mark(NamedTuple):
    """An upright line at some x, and the words beside it."""

    at: float
    words: str


def curves(
    lines: Sequence[Line],
    *,
    title: str,
    x_label: str,
    y_label: str,
    marks: Sequence[Mark] = (),
    y_from_zero: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw curves over one quantity.

    Parameters
    ----------
    lines
        At least one, in the order of the legend.
    title, x_label, y_label
        Heading, and labels with units.
    marks
        Where something begins or ends.
    y_from_zero
        Whether the axis begins at 0.
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> line = optuav.plots.Line("square", [0.0, 1.0, 2.0], [0.0, 1.0, 4.0])
    >>> ax = optuav.plots.curves([line], title="powers", x_label="x [m]", y_label="y [m²]")
    >>> ax.get_legend().get_texts()[0].get_text()
    'square'
    """
    with style.applied():
        ax = ax or style.page(4.0).subplots()
        for number, line in enumerate(lines):
            ax.plot(
                line.x,
                line.y,
                color=COLOURS[number % len(COLOURS)],
                linestyle=LINES[number % len(LINES)],
                marker=line.marker,
                markersize=4.0,
                label=line.label,
                zorder=3,
            )
        values = np.concatenate([np.asarray(line.y, dtype=float) for line in lines])
        low, high = style.margins(values[np.isfinite(values)].tolist() + [0.0] * y_from_zero)
        low = max(low, 0.0) if y_from_zero else low
        ax.set_ylim(low, high + ROOM_ABOVE * (high - low) * bool(marks))
        rows = -(-len(lines) // COLUMNS)
        ax.set_title(title, pad=style.LEGEND_PT * (0.35 + 0.65 * rows))
        ax.set(xlabel=x_label, ylabel=y_label)
        style.legend_above(ax, min(COLUMNS, len(lines)))
        style.group_thousands(ax)
        for mark in marks:
            ax.axvline(mark.at, color=VERMILLION, linewidth=0.9, linestyle=DOTTED)
        settle(ax)
        low, high = ax.get_xlim()
        for number, mark in enumerate(marks):  # on the side with more room, in two rows
            to_left = mark.at - low > high - mark.at
            ax.annotate(
                mark.words,
                (mark.at, 1.0),
                (-3.0 if to_left else 3.0, -3.0 - 9.0 * (number % 2)),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="right" if to_left else "left",
                va="top",
                fontsize=7.0,
                color=VERMILLION,
            )
    return ax
