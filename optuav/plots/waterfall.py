"""A waterfall: the power left at each station, and the loss before it."""

from collections.abc import Sequence
from itertools import pairwise
from textwrap import fill

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots import style
from optuav.plots.style import DARK, GREEN, GREY, LASER

WORDS_WIDTH = 10  # Letters in a line below a station


@style.applied()
def waterfall(
    stations: Sequence[tuple[str, float, bool]], *, title: str, ax: Axes | None = None
) -> Axes:
    """Draw the power at stations from the left to the right, none larger than the one before.

    A station has words, power [W], and whether it is electric or light. Returns the axes, with
    power in W along y; they are on a page of their own by default.
    """
    ax = ax or style.page(3.2).subplots()
    ax.set(ylabel="power [W]", ylim=(0.0, 1.22 * max(stations[0][1], 1e-9)))
    lost: style.Look = {"facecolor": "white", "edgecolor": GREY, "hatch": "////", "linewidth": 0.0}
    for at, (before, (_, power_W, electric)) in enumerate(pairwise([stations[0], *stations])):
        top_W, share = before[1], power_W / max(before[1], 1e-9)
        ax.bar(at, power_W, 0.8, color=GREEN if electric else LASER)
        ax.bar(at, top_W - power_W, 0.8, power_W, **lost)
        ax.plot([at - 1.4 if at else at - 0.4, at + 0.4], [top_W] * 2, color=DARK, linewidth=0.5)
        loss = f"\n−{100.0 * (1.0 - share):.3g} %" if at and share < 0.9995 else ""
        style.beside(ax, f"{power_W:.4g} W{loss}", (at, top_W), (0.0, 2.0))
    style.group_thousands(ax)
    ax.set_xticks(range(len(stations)), [fill(words, WORDS_WIDTH) for words, *_ in stations])
    ax.tick_params(axis="x", length=0.0)
    ax.set_title(title, pad=style.LEGEND_PT)
    kinds = {"light": LASER, "electric": GREEN}
    patches = [Patch(color=colour, label=name) for name, colour in kinds.items()]
    style.legend_above(ax, 3, [*patches, Patch(label="lost before", **lost)])
    style.settle(ax)
    return ax
