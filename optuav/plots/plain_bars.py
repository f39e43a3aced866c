"""A few values as bars."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from matplotlib.axes import Axes

from optuav.plots.comparison import LEGEND_PT
from optuav.plots.grouped import cannot_be_flown, draw_groups
from optuav.plots.labels import settle
from optuav.plots.style import BLUE, group_thousands, page, styled


def bars(
    values: Mapping[str, float | None],
    *,
    title: str,
    y_label: str,
    hatched: Collection[str] = (),
    ax: Axes | None = None,
) -> Axes:
    """Draw one bar a value.

    Parameters
    ----------
    values
        By name; None where there is none.
    title, y_label
        What is shown; the label with its unit.
    hatched
        Names of the bars whose plans cannot be flown.
    ax
        Where to draw; on a page of its own by default.
    """
    with styled():
        if ax is None:
            ax = page(7.2, 3.0).subplots()
        named = {(name, ""): value for name, value in values.items()}
        draw_groups(ax, list(values), {"": BLUE}, named, hatched={(name, "") for name in hatched})
        ax.set(ylabel=y_label)
        ax.set_title(title, pad=LEGEND_PT if hatched else None)
        if hatched:
            ax.legend(
                handles=[cannot_be_flown()],
                loc="lower left",
                bbox_to_anchor=(0.0, 1.0),
                borderaxespad=0.2,
            )
        group_thousands(ax)
        ax.set_xticks(range(len(values)), list(values))
        settle(ax)
    return ax
