"""Bands that colour the phases of a plan, and panels over its time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.errors import InputError
from optuav.plan import Plan
from optuav.plots.style import KINDS, TIME, page, printed, root

TINT = 0.15
NAMES_PT = 16.0
"""Room for the names between axes and title [pt]."""
MOST = 7
"""Largest number of entries side by side in a legend."""


class Band(NamedTuple):
    """A stretch of time [s], and names for it, of which the first that fits is written."""

    begin_s: float
    end_s: float
    colour: str
    names: tuple[str, ...]


def phase_band(kind: str, place: str, begin_s: float, end_s: float) -> Band:
    """The band of a phase; that of a rest names its place where there is room."""
    names = (f"rest, {printed(place)}", kind) if kind == "rest" else (kind,)
    return Band(begin_s, end_s, KINDS[kind], names)


def plan_bands(plan: Plan) -> list[Band]:
    """The bands of the phases of a plan that take time."""
    return [
        phase_band(each.kind, each.end_place, each.start_s, each.end_s)
        for each in plan.phases
        if each.duration_s > 0.0
    ]


def draw_bands(axes: Sequence[Axes], bands: Sequence[Band]) -> None:
    """Draw bands on axes that share their time, with names above the first.

    The limits of the axes are final, and their place is settled.
    """
    for band in bands:
        for ax in axes:
            ax.axvspan(band.begin_s, band.end_s, color=band.colour, alpha=TINT, linewidth=0.0)
    top = axes[0]
    for band in bands:
        ends = [(band.begin_s, 0.0), (band.end_s, 0.0)]
        left, right = top.transData.transform(ends)[:, 0]
        for name in band.names:
            text = top.annotate(
                name,
                (0.5 * (band.begin_s + band.end_s), 1.0),
                (0.0, 3.0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="center",
                va="bottom",
                fontsize=7.5,
            )
            text.set_in_layout(False)
            if text.get_window_extent().width <= right - left:
                break
            text.remove()


def swatch(colour: str, label: str) -> Patch:
    """The entry of a band in a legend."""
    return Patch(color=colour, alpha=2.0 * TINT, linewidth=0.0, label=label)


def swatches(kinds: Iterable[str]) -> list[Patch]:
    """The entries of the kinds of phases that occur."""
    return [swatch(KINDS[kind], kind) for kind in dict.fromkeys(map(str, kinds))]


def panels(plans: Sequence[Plan], height_in: float) -> Sequence[Axes]:
    """Axes of a height [inch] for each plan, over the time of the longest; at least one plan."""
    if not plans:
        raise InputError("there is no plan to draw")
    figure = page(0.7 + height_in * len(plans))
    axes = list(figure.subplots(len(plans), 1, sharex=True, squeeze=False)[:, 0])
    end_s = max(plan.mission_time_s for plan in plans)
    axes[-1].set(xlim=(0.0, end_s or 1.0), xlabel=TIME)
    return axes


def legend_below(ax: Axes, handles: Sequence[Artist], plans: Sequence[Plan]) -> None:
    """Put a legend below all panels: what is drawn, and the kinds of phases that occur."""
    kinds = (phase.kind for plan in plans for phase in plan.phases)
    entries = [*handles, *swatches(kinds)]
    root(ax).legend(handles=entries, loc="outside lower center", ncols=min(len(entries), MOST))
