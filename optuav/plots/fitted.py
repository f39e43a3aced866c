"""A calibration: what was observed, what the fit makes of it, and what is left over."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from optuav.calibration.fit import Fit, Panel
from optuav.errors import InputError
from optuav.plots.labels import settle
from optuav.plots.style import (
    BLACK,
    BLUE,
    KINDS,
    ORANGE,
    PALE,
    PURPLE,
    SKY,
    group_thousands,
    margins,
    page,
    printed,
    styled,
)

COLOURS = {**KINDS, "charge": PURPLE}
"""Of the groups of observations."""
ROLES = {"fitted": BLUE, "repeat": SKY, "predicted": ORANGE}
"""Of named observations."""
DECADE = 10.0
"""Largest over smallest value beyond which the axis is logarithmic."""
FEW = 100
"""Observations that are drawn as large dots."""
PER_NAME_IN, BASE_IN, CURVE_IN = 0.21, 0.85, 1.9
"""Height of a named observation, of what surrounds them, and of a curve [inch]."""
LEGEND_PT = 20.0


class FitAxes(NamedTuple):
    """Values of a quantity, and what the fit leaves over of them."""

    values: Axes
    residuals: Axes


def fit(found: Fit, axes: tuple[FitAxes, ...] | None = None) -> tuple[FitAxes, ...]:
    """Draw observed and fitted values, and their differences, one row a quantity.

    Parameters
    ----------
    found
        A calibration from observations.
    axes
        Where to draw, one a panel of the fit; on a page of its own by default.

    Raises
    ------
    InputError
        If the calibration rests on no observations, or the number of axes differs.
    """
    if not found.panels:
        raise InputError(f"there is nothing to draw: the values come from {found.data}")
    if axes is not None and len(axes) != len(found.panels):
        raise InputError(f"{len(found.panels)} pairs of axes are needed, one a quantity")
    with styled():
        if axes is None:
            axes = _page(found)
        for ax, panel in zip(axes, found.panels, strict=True):
            (_draw_names if panel.names else _draw_course)(ax, panel)
        sources = ", ".join(printed(source.rpartition("/")[2]) for source in found.sources[:2])
        more = f" and {len(found.sources) - 2} more" if len(found.sources) > 2 else ""
        axes[0].values.set_title(f"{found.kind} from {sources}{more}", pad=LEGEND_PT)
        axes[0].residuals.set_title("what is left over", pad=LEGEND_PT)
        _legend(axes[0].values, found)
        settle(axes[0].values)
    return axes


def _page(found: Fit) -> tuple[FitAxes, ...]:
    heights = [
        BASE_IN + PER_NAME_IN * len(panel.names) if panel.names else CURVE_IN
        for panel in found.panels
    ]
    grid = page(7.2, 0.4 + sum(heights)).subplots(
        len(heights), 2, squeeze=False, height_ratios=heights, width_ratios=(1.7, 1.0)
    )
    return tuple(FitAxes(left, right) for left, right in grid)


def _draw_names(axes: FitAxes, panel: Panel) -> None:
    """One line a named observation, from the top."""
    places = np.arange(len(panel.names))
    observed, fitted = np.array(panel.observed), np.array(panel.fitted)
    roles = np.array(panel.each_role)
    axes.values.hlines(places, observed, fitted, color=PALE, linewidth=2.5, zorder=1)
    axes.values.plot(observed, places, "o", color=BLACK, markerfacecolor="none", markersize=5.5)
    left = fitted - observed
    for role, colour in ROLES.items():
        chosen = roles == role
        axes.values.plot(fitted[chosen], places[chosen], "o", color=colour, markersize=3.0)
        axes.residuals.barh(places[chosen], left[chosen], 0.55, color=colour)
    for ax in axes:
        ax.set_ylim(len(places) - 0.5, -0.5)
        ax.tick_params(axis="y", length=0.0)
    axes.values.set_yticks(places, [printed(name) for name in panel.names])
    axes.residuals.set_yticks(places, [""] * len(places))
    positive = min(*observed, *fitted) > 0.0
    values = np.concatenate([observed, fitted])
    if positive and np.max(values) > DECADE * np.min(values):
        axes.values.set_xscale("log")
        wide = np.max(values) > DECADE**3 * np.min(values)
        axes.values.xaxis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
        axes.values.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10g}"))
        axes.values.xaxis.set_minor_formatter(NullFormatter())
    else:
        axes.values.set_xlim(margins(values, 0.08, 0.02 * float(np.max(np.abs(values))) or 1.0))
    axes.residuals.xaxis.set_major_locator(MaxNLocator(4))
    axes.residuals.axvline(0.0, color=BLACK, linewidth=0.5)
    least = 1e-4 * float(np.max(np.abs(observed))) or 1.0
    reach = 1.15 * max(float(np.max(np.abs(left))), least)
    axes.residuals.set_xlim(-reach, reach)
    axes.values.set_xlabel(f"{panel.quantity} [{panel.unit}]")
    axes.residuals.set_xlabel(f"fitted $-$ observed [{panel.unit}]")


def _draw_course(axes: FitAxes, panel: Panel) -> None:
    """Dots along an axis, and the fit as a line that breaks where the group changes."""
    at, observed, fitted = map(np.array, (panel.at, panel.observed, panel.fitted))
    groups = np.array(panel.groups or ("",) * len(at))
    for group in dict.fromkeys(groups.tolist()):
        own = groups == group
        dots: dict[str, Any] = {
            "color": COLOURS.get(group, BLUE),
            "markersize": 2.5 if len(at) > FEW else 6.0,
            "alpha": 0.6,
        }
        axes.values.plot(at[own], observed[own], ".", **dots)
        axes.residuals.plot(at[own], (fitted - observed)[own], ".", **dots)
    cuts = [0, *(np.flatnonzero(groups[1:] != groups[:-1]) + 1), len(at)]
    for start, end in pairwise(cuts):
        axes.values.plot(at[start:end], fitted[start:end], color=BLACK, linewidth=1.1)
    axes.residuals.axhline(0.0, color=BLACK, linewidth=0.5)
    group_thousands(*axes)
    axes.values.set(xlabel=panel.at_words, ylabel=f"{panel.quantity} [{panel.unit}]")
    axes.residuals.set(xlabel=panel.at_words, ylabel=f"fitted $-$ observed [{panel.unit}]")


def _legend(ax: Axes, found: Fit) -> None:
    shown = found.panels[0]
    if shown.names:
        handles = [
            Line2D(
                [], [], ls="", marker="o", color=BLACK, markerfacecolor="none", label="observed"
            ),
            *(
                Line2D([], [], ls="", marker="o", color=colour, markersize=3.0, label=role)
                for role, colour in ROLES.items()
                if role == "fitted" or any(role in panel.roles for panel in found.panels)
            ),
        ]
    else:
        handles = [
            Line2D(
                [], [], ls="", marker=".", color=COLOURS.get(name, BLUE), label=name or "observed"
            )
            for name in dict.fromkeys(shown.groups or ("",))
        ]
        words = "mean" if shown.groups else "fitted"
        handles.append(Line2D([], [], color=BLACK, linewidth=1.1, label=words))
    ax.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=6
    )
