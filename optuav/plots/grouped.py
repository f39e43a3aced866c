"""Bars in groups, each with its number at the end."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots.style import BLACK, GREY, margins

HATCH: dict[str, Any] = {"hatch": "/////", "edgecolor": "white", "linewidth": 0.0}
"""Look of a bar whose plan cannot be flown."""
LONG = 1000.0
"""From here on a number has no decimal."""
GROUP = 0.8
"""Share of the way to the next group that the bars of one take up."""


def draw_groups(
    ax: Axes,
    groups: Sequence[str],
    colours: Mapping[str, str],
    values: Mapping[tuple[str, str], float | None],
    level: float = 0.0,
    hatched: Collection[tuple[str, str]] = (),
) -> None:
    """Draw one bar a value.

    Parameters
    ----------
    ax
        Where to draw.
    groups
        Names along the axis.
    colours
        Colour of every bar of a group, by its name, in order.
    values
        By names of group and bar; None where there is none.
    level
        A value that is inside the axes as well, where a line may be.
    hatched
        Names of group and bar of the plans that cannot be flown.
    """
    width = GROUP / max(2, len(colours))
    known = [value for value in values.values() if value is not None]
    low, high = margins([0.0, level, *known], 0.14)
    ax.set_ylim(low if min(known, default=0.0) < 0.0 else 0.0, high)
    for (group, name), value in values.items():
        middle = list(colours).index(name) - 0.5 * (len(colours) - 1)
        at, end = groups.index(group) + width * middle, value or 0.0
        look = HATCH if (group, name) in hatched else {}
        ax.bar(at, end, 0.92 * width, facecolor=colours[name], **look)
        words = f"{end:.{1 if abs(end) < LONG else 0}f}"
        if value is None:  # on two lines, as bars are narrow, and off the level's own
            words, end = "no\nplan", max(level, 0.0)
        ax.annotate(
            words.replace("-", "\N{MINUS SIGN}"),
            (at, end),
            (0.0, 2.0 if end >= 0.0 else -2.0),
            textcoords="offset points",
            ha="center",
            va="bottom" if end >= 0.0 else "top",
            fontsize=7.0,
        )
    ax.set_xticks(range(len(groups)), groups)
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.tick_params(axis="x", length=0.0)


def cannot_be_flown() -> Patch:
    """The entry of a legend that explains hatched bars."""
    return Patch(facecolor=GREY, label="cannot be flown", **HATCH)
