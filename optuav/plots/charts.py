"""Bars by group, and curves over one quantity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.typing import LineStyleType

from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION

COLOURS = {
    **{"battery": BLUE, "energy": ORANGE, "adjusted": SKY, "available": GREEN},
    **{"direct": GREY, "traj1": SKY, "traj2": ORANGE, "optimal": BLUE},
    **{"P3": GREY, "P4": ORANGE, "P2": SKY, "P2-tight": BLUE, "P1": GREEN, "": BLUE},
}
"""Colours of bars by name, in the order in which they stand side by side."""
PRINTED = {
    "battery": "Battery Persp.",
    "energy": "Ener. Persp.",
    "adjusted": "Adj. Ener. Persp.",
    "available": "available well\n(ours)",
}
"""Names of groups that are perspectives, as the paper's figures print them."""
LONG = 1000.0
"""Least number that is written without a decimal."""
GROUP = 0.8
"""Share of the way to the next group that the bars of one take up."""
HATCH = "/////"

LINES: tuple[tuple[str, LineStyleType], ...] = (
    (BLUE, "-"),
    (ORANGE, (0.0, (5.0, 1.5))),
    (GREEN, (0.0, (2.0, 1.0))),
    (PURPLE, (0.0, (6.0, 1.2, 1.5, 1.2))),
    (SKY, (0.0, (9.0, 2.0))),
    (BLACK, style.DOTTED),
)
"""Looks of curves, no two of which differ in colour alone."""
COLUMNS = 3
ROOM_ABOVE = 0.14
"""Share of the height that is left above the curves for the words of the marks."""


class Bar(NamedTuple):
    """A value of a plan, None without one, by its group below the axis and its name in the legend.

    A name is a perspective, a trajectory, a problem, or nothing. Bars of plans that cannot be flown
    are hatched.
    """

    group: str
    name: str
    value: float | None
    flyable: bool = True


class Level(NamedTuple):
    """A value that is marked among bars, and the words for it."""

    value: float
    words: str


class Line(NamedTuple):
    """A curve: its name in the legend, arrays of one length, and the marker of every point."""

    label: str
    x: npt.ArrayLike
    y: npt.ArrayLike
    marker: str = ""


class Mark(NamedTuple):
    """An upright line at some x, and the words beside it."""

    at: float
    words: str


@style.applied()
def bars(
    shown: Sequence[Bar],
    *,
    title: str,
    y_label: str,
    level: Level | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw bars in groups, with their numbers.

    Parameters
    ----------
    shown
        At least one; groups appear in the order in which they come.
    title, y_label
        Heading, and label with its unit.
    level
        A value that is marked.
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> shown = [optuav.plots.Bar("P3", "", 577.5), optuav.plots.Bar("P1", "", 597.3)]
    >>> ax = optuav.plots.bars(shown, title="hover", y_label="Δ [s]")
    >>> [text.get_text() for text in ax.texts]
    ['577.5', '597.3']
    """
    ax = ax or style.page(3.4 if any(each.name for each in shown) else 3.0).subplots()
    ax.set_ylabel(y_label)
    handles = _draw_groups(ax, shown, level)
    ax.set_title(title, pad=style.LEGEND_PT if handles else None)
    if handles:
        style.legend_above(ax, len(handles), handles)
    style.settle(ax)
    return ax


def _draw_groups(ax: Axes, bars: Sequence[Bar], level: Level | None = None) -> list[Artist]:
    """Draw bars in groups with their numbers, and a level; entries of the legend."""
    groups = list(dict.fromkeys(each.group for each in bars))
    used = [name for name in COLOURS if any(each.name == name for each in bars)]
    floor, width = level.value if level else 0.0, GROUP / max(2, len(used))
    known = [each.value for each in bars if each.value is not None]
    low, high = style.margins([0.0, floor, *known], 0.14)
    ax.set_ylim(low if min(known, default=0.0) < 0.0 else 0.0, high)
    for group, name, value, flyable in bars:
        middle = used.index(name) - 0.5 * (len(used) - 1)
        at, end = groups.index(group) + width * middle, value or 0.0
        (bar,) = ax.bar(at, end, 0.92 * width, color=COLOURS[name])
        if not flyable:
            bar.set(hatch=HATCH, edgecolor="white", linewidth=0.0)
        words = f"{end:.{1 if abs(end) < LONG else 0}f}"
        if value is None:  # on two lines, as bars are narrow, and above the line of the level
            words, end = "no\nplan", max(floor, 0.0)
        style.beside(ax, style.minus(words), (at, end), (0.0, 2.0 if end >= 0.0 else -2.0))
    style.group_thousands(ax)
    ax.set_xticks(range(len(groups)), [PRINTED.get(group, group) for group in groups])
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.tick_params(axis="x", length=0.0)
    handles: list[Artist] = [
        Patch(color=COLOURS[name], label=style.WORDS.get(name, name)) for name in used if name
    ]
    if level:
        handles.append(ax.axhline(floor, color=VERMILLION, linewidth=1.0, label=level.words))
    if not all(each.flyable for each in bars):
        looks = {"fc": GREY, "ec": "white", "hatch": HATCH, "linewidth": 0.0}
        handles.append(Patch(label="cannot be flown", **looks))  # type: ignore[arg-type]
    return handles


@style.applied()
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
    ax = ax or style.page(4.0).subplots()
    for number, line in enumerate(lines):
        colour, dashes = LINES[number % len(LINES)]
        (curve,) = ax.plot(line.x, line.y, color=colour, linestyle=dashes, zorder=3)
        curve.set(label=line.label, marker=line.marker, markersize=4.0)
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
        ax.axvline(mark.at, color=VERMILLION, linewidth=0.9, linestyle=style.DOTTED)
    style.settle(ax)
    _name_marks(ax, marks)
    return ax


def _name_marks(ax: Axes, marks: Sequence[Mark]) -> None:
    """Write the words of marks on the side with more room, in two rows."""
    low, high = ax.get_xlim()
    for number, mark in enumerate(marks):
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
