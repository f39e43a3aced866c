"""A waterfall: the power that is left at each station, and what is lost before it."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots import style
from optuav.plots.style import DARK, GREEN, GREY, LASER


class Station(NamedTuple):
    """Power [W] on its way, with words for the axis, and whether it is electric or light."""

    words: str
    power_W: float
    electric: bool = False


@style.applied()
def waterfall(stations: Sequence[Station], *, title: str, ax: Axes | None = None) -> Axes:
    """Draw the power at stations from the left to the right, none larger than the one before.

    Returns the axes, with power in W along y; they are on a page of their own by default.
    """
    ax = ax or style.page(3.2).subplots()
    ax.set(ylabel="power [W]", ylim=(0.0, 1.22 * max(stations[0].power_W, 1e-9)))
    lost: style.Look = {"facecolor": "white", "edgecolor": GREY, "hatch": "////", "linewidth": 0.0}
    for at, (before, (_, power_W, electric)) in enumerate(pairwise([stations[0], *stations])):
        top_W, share = before.power_W, power_W / max(before.power_W, 1e-9)
        ax.bar(at, power_W, 0.8, color=GREEN if electric else LASER)
        ax.bar(at, top_W - power_W, 0.8, power_W, **lost)
        ax.plot([at - 1.4 if at else at - 0.4, at + 0.4], [top_W] * 2, color=DARK, linewidth=0.5)
        loss = f"\n−{100.0 * (1.0 - share):.3g} %" if at and share < 0.9995 else ""
        style.beside(ax, f"{power_W:.4g} W{loss}", (at, top_W), (0.0, 2.0))
    style.group_thousands(ax)
    ax.set_xticks(range(len(stations)), [station.words for station in stations])
    ax.tick_params(axis="x", length=0.0)
    ax.set_title(title, pad=style.LEGEND_PT)
    kinds = {"light": LASER, "electric": GREEN}
    patches = [Patch(color=colour, label=name) for name, colour in kinds.items()]
    style.legend_above(ax, 3, [*patches, Patch(label="lost before", **lost)])
    style.settle(ax)
    return ax
