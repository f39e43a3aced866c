"""What all pictures share: colours, fonts, pages, legends, and names made fit to print."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache, partial
from typing import Any, TypedDict

import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter
from matplotlib.typing import LineStyleType

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#7F7F7F"
PALE = "#D9D9D9"
# The palette of Okabe and Ito, which colour-blind readers can tell apart, and two greys.

KINDS = {"flight": BLUE, "hover": GREEN, "rest": ORANGE}
"""Colour of every kind of phase."""

WORDS = {"direct": "Direct path", "traj1": "Traj. 1", "traj2": "Traj. 2", "optimal": "Optimal"}
"""Names of the trajectories as the paper prints them."""

DASHED: LineStyleType = (0.0, (4.0, 2.0))
DOTTED: LineStyleType = (0.0, (1.0, 1.0))

FONT = "DejaVu Sans"
RC: dict[str, Any] = {
    "font.family": FONT,
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "optuav",
}

WIDTH_IN = 7.2
DOTS_PER_INCH = 200
LEGEND_PT = 20.0
"""Room for one line of a legend between axes and title [pt]."""
LONGEST_NAME = 24
TIME = "time since take-off $t$ [s]"


class Look(TypedDict, total=False):
    """Properties of a line or marker, by matplotlib's names."""

    color: str
    linestyle: LineStyleType
    linewidth: float
    marker: str
    markersize: float
    markerfacecolor: str
    markeredgecolor: str
    markeredgewidth: float


applied = partial(matplotlib.style.context, ["default", RC])
"""The look of the pictures, for a block or a function; the user's settings come back after it."""


def page(height_in: float, width_in: float = WIDTH_IN) -> Figure:
    """An empty figure without a window [inch]."""
    return Figure(figsize=(width_in, height_in), dpi=DOTS_PER_INCH, layout="constrained")


def printed(name: str) -> str:
    """A name as a picture shows it: not too long, no mathematics, only letters of the font."""
    short = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
    known = "".join(letter if ord(letter) in _letters() else "□" for letter in short)
    return known.replace("$", r"\$")


@cache
def _letters() -> frozenset[int]:
    return frozenset(get_font(findfont(FontProperties(family=FONT))).get_charmap())


def group_thousands(*axes: Axes) -> None:
    """Set the thousands of long tick labels apart, on both axes."""
    for ax in axes:
        ax.xaxis.set_major_formatter(FuncFormatter(_grouped))
        ax.yaxis.set_major_formatter(FuncFormatter(_grouped))


def _grouped(value: float, _position: float | None) -> str:
    separator = "," if abs(value) >= 1e4 else ""
    return minus(f"{value:{separator}.10g}").replace(",", "\N{THIN SPACE}")


def minus(text: str) -> str:
    """A number with a minus sign in place of a hyphen."""
    return text.replace("-", "\N{MINUS SIGN}")


def margins(
    values: Iterable[float], share: float = 0.05, least: float = 1.0
) -> tuple[float, float]:
    """Limits of an axis that leave some room around values, at least `least` wide."""
    low, high = min(values := list(values)), max(values)
    room = max(share * (high - low), 0.5 * (least - (high - low)))
    return low - room, high + room


def legend_above(ax: Axes, columns: int, handles: Sequence[Artist] | None = None) -> None:
    """Put a legend between axes and title; of all labelled artists unless handles are given."""
    shown = ax.get_legend_handles_labels()[0] if handles is None else handles
    corner = (0.0, 1.0)
    ax.legend(
        handles=shown, loc="lower left", bbox_to_anchor=corner, borderaxespad=0.2, ncols=columns
    )


def name_levels(ax: Axes, levels: Iterable[tuple[float, str]], colour: str = "black") -> None:
    """Name levels at the right side; those too close for two lines share one."""
    low, high = ax.get_ylim()
    groups: list[tuple[float, str]] = []
    for level, words in sorted(levels):
        if groups and level - groups[-1][0] < 0.05 * (high - low):
            groups[-1] = (groups[-1][0], f"{groups[-1][1]}, {words}")
        else:
            groups.append((level, words))
    side = ax.secondary_yaxis("right")
    side.set_yticks([level for level, _ in groups], [words for _, words in groups])
    side.tick_params(length=0.0, labelcolor=colour)
    side.spines["right"].set_visible(False)


def entry(
    label: str, colour: str, linewidth: float = 1.4, linestyle: LineStyleType = "-"
) -> Line2D:
    """The entry of a line in a legend."""
    return Line2D([], [], color=colour, linewidth=linewidth, linestyle=linestyle, label=label)


def root(ax: Axes) -> Figure:
    """The figure that axes belong to."""
    figure = ax.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def settle(ax: Axes) -> None:
    """Give all axes of the figure their final place, which labels depend on."""
    figure = root(ax)
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    for each in figure.axes:
        each.apply_aspect()


def beside(ax: Axes, words: str, at: tuple[float, float], offset_pt: tuple[float, float]) -> None:
    """Write words beside the end of a bar, on the side of the offset."""
    x, y = (int(np.sign(each)) for each in offset_pt)
    side, edge = ("center", "left", "right")[x], ("center", "bottom", "top")[y]
    size, unit = 6.5 if x else 7.0, "offset points"
    ax.annotate(words, at, offset_pt, textcoords=unit, ha=side, va=edge, fontsize=size)
