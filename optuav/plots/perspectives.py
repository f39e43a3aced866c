"""Trajectories side by side in every perspective, as bars: hover time, or charge left."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots.comparison import LEGEND_PT, Bar
from optuav.plots.grouped import cannot_be_flown, draw_groups
from optuav.plots.labels import settle
from optuav.plots.map import WORDS
from optuav.plots.style import (
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    group_thousands,
    page,
    styled,
)

COLOURS = {"direct": GREY, "traj1": SKY, "traj2": ORANGE, "optimal": BLUE}
NAMES = {
    "battery": "Battery Persp.",
    "energy": "Ener. Persp.",
    "adjusted": "Adj. Ener. Persp.",
    "available": "available well\n(ours)",
}
"""Perspectives as the paper's figures print them."""


def hover_bars(shown: Sequence[Bar], title: str, ax: Axes | None = None) -> Axes:
    """Draw the hover time of every trajectory, grouped by perspective.

    Parameters
    ----------
    shown
        At least one; perspectives appear in the order in which they come.
    title
        What is shown.
    ax
        Where to draw; on a page of its own by default.
    """
    return _draw(shown, [each.hover_time_s for each in shown], "hover time Δ [s]", title, None, ax)


def charge_bars(shown: Sequence[Bar], title: str, min_soc: float, ax: Axes | None = None) -> Axes:
    """Draw the charge left η1 of every trajectory, grouped by perspective.

    Parameters
    ----------
    shown
        At least one; perspectives appear in the order in which they come.
    title
        What is shown.
    min_soc
        η0, marked among the charges [-].
    ax
        Where to draw; on a page of its own by default.
    """
    percent = [None if each.soc is None else 100.0 * each.soc for each in shown]
    return _draw(shown, percent, "charge left $η_1(T)$ [%]", title, 100.0 * min_soc, ax)


def _draw(
    shown: Sequence[Bar],
    values: Sequence[float | None],
    y_label: str,
    title: str,
    level: float | None,
    ax: Axes | None,
) -> Axes:
    groups = [NAMES[name] for name in dict.fromkeys(each.perspective for each in shown)]
    keys = [(NAMES[each.perspective], each.trajectory) for each in shown]
    used = dict.fromkeys(each.trajectory for each in shown)
    colours = {name: COLOURS[name] for name in COLOURS if name in used}
    with styled():
        if ax is None:
            ax = page(7.2, 3.4).subplots()
        hatched = {key for key, each in zip(keys, shown, strict=True) if not each.flyable}
        draw_groups(
            ax, groups, colours, dict(zip(keys, values, strict=True)), level or 0.0, hatched
        )
        ax.set_ylabel(y_label)
        ax.set_title(title, pad=LEGEND_PT)
        handles: list[object] = [Patch(color=colours[name], label=WORDS[name]) for name in colours]
        if level is not None:
            least = ax.axhline(level, color=VERMILLION, linewidth=1.0, label="least, $η_0$")
            handles.append(least)
        if hatched:
            handles.append(cannot_be_flown())
        ax.legend(
            handles=handles,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            ncols=len(handles),
        )
        group_thousands(ax)
        ax.set_xticks(range(len(groups)), groups)
        settle(ax)
    return ax
