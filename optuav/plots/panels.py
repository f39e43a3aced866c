"""One panel a plan, one below the other, over the time of the longest."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from optuav.errors import InputError
from optuav.plan import Plan
from optuav.plots.bands import swatch
from optuav.plots.labels import root
from optuav.plots.style import KINDS, page

WIDTH_IN, AROUND_IN = 7.2, 0.7
MOST = 7
"""Entries of a legend side by side."""


def panels(plans: Sequence[Plan], axes: Sequence[Axes] | None, height_in: float) -> Sequence[Axes]:
    """Axes for plans: those given, or on a page of their own, each of a height [in].

    Raises
    ------
    InputError
        If there is no plan to draw, or as many axes are not given.
    """
    if not plans or (axes is not None and len(axes) != len(plans)):
        raise InputError("one plan at least, and as many axes as plans")
    if axes is None:
        figure = page(WIDTH_IN, AROUND_IN + height_in * len(plans))
        axes = list(figure.subplots(len(plans), 1, sharex=True, squeeze=False)[:, 0])
    end_s = max(plan.mission_time_s for plan in plans)
    for ax in axes:
        ax.set_xlim(0.0, end_s or 1.0)
    axes[-1].set_xlabel("time since take-off $t$ [s]")
    return axes


def legend_below(ax: Axes, handles: Sequence[Artist], plans: Sequence[Plan]) -> None:
    """Put a legend below all panels: what is drawn, and the bands of the phases that occur."""
    kinds = dict.fromkeys(phase.kind for plan in plans for phase in plan.phases)
    entries = [*handles, *(swatch(KINDS[kind], kind) for kind in kinds)]
    root(ax).legend(handles=entries, loc="outside lower center", ncols=min(len(entries), MOST))
