"""A few values as bars."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes

from optuav.plots.grouped import draw_groups
from optuav.plots.labels import settle
from optuav.plots.style import BLUE, group_thousands, page, styled


def bars(
    values: Mapping[str, float | None], *, title: str, y_label: str, ax: Axes | None = None
) -> Axes:
    """Draw one bar a value.

    Parameters
    ----------
    values
        By name; None where there is none.
    title, y_label
        What is shown; the label with its unit.
    ax
        Where to draw; on a page of its own by default.
    """
    with styled():
        if ax is None:
            ax = page(7.2, 3.0).subplots()
        named = {(name, ""): value for name, value in values.items()}
        draw_groups(ax, list(values), {"": BLUE}, named)
        ax.set(ylabel=y_label)
        ax.set_title(title)
        group_thousands(ax)
        ax.set_xticks(range(len(values)), list(values))
        settle(ax)
    return ax
