"""A calibration: observed and fitted values, and their differences."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from optuav.calibration.fit import Fit, Panel
from optuav.errors import InputError
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE

GROUPS = {**style.KINDS, "charge": style.PURPLE, "": BLUE}
"""Colours of the groups of observations."""
ROLES = {"fitted": BLUE, "repeat": style.SKY, "predicted": style.ORANGE}
"""Colours of named observations."""
DECADE = 10.0
"""Largest over smallest value beyond which the axis is logarithmic."""
FEW = 100
"""Most observations that are drawn as large dots."""
PER_NAME_IN, BASE_IN, CURVE_IN = 0.21, 0.85, 1.9
"""Height of a named observation, of what surrounds them, and of a curve [inch]."""


class FitAxes(NamedTuple):
    """Values of a quantity, and their residuals, fitted minus observed."""

    values: Axes
    residuals: Axes


@style.applied()
def fit(found: Fit) -> tuple[FitAxes, ...]:
    """Draw observed and fitted values, and their differences, one row a quantity.

    Parameters
    ----------
    found
        A calibration from observations, of `optuav.fit_kibam`, `optuav.fit_regimes` or
        `optuav.fit_rotor`.

    Raises
    ------
    InputError
        If the calibration rests on no observations.

    Examples
    --------
    >>> import optuav
    >>> from optuav.calibration import Panel
    >>> panel = Panel("lifetime", "s", (100.0, 120.0), (101.0, 118.0), names=("1 A", "2 A"))
    >>> found = optuav.Fit("kibam", ("cell.csv",), "2 loads", (), (panel,))
    >>> optuav.plots.fit(found)[0].values.get_xlabel()
    'lifetime [s]'
    """
    if not found.panels:
        raise InputError(f"there is nothing to draw: the values come from {found.data}")
    axes = _page(found)
    for ax, panel in zip(axes, found.panels, strict=True):
        (_draw_names if panel.names else _draw_curve)(ax, panel)
    sources = ", ".join(style.printed(each.rpartition("/")[2]) for each in found.sources[:2])
    more = f" and {len(found.sources) - 2} more" if len(found.sources) > 2 else ""
    axes[0].values.set_title(f"{found.kind} from {sources}{more}", pad=style.LEGEND_PT)
    axes[0].residuals.set_title("what is left over", pad=style.LEGEND_PT)
    style.legend_above(axes[0].values, 6, _entries(found))
    style.settle(axes[0].values)
    return axes


def _page(found: Fit) -> tuple[FitAxes, ...]:
    heights = [
        BASE_IN + PER_NAME_IN * len(panel.names) if panel.names else CURVE_IN
        for panel in found.panels
    ]
    grid = style.page(0.4 + sum(heights)).subplots(
        len(heights), 2, squeeze=False, height_ratios=heights, width_ratios=(1.7, 1.0)
    )
    return tuple(FitAxes(left, right) for left, right in grid)


def _draw_names(axes: FitAxes, panel: Panel) -> None:
    """Draw one line a named observation, from the top."""
    rows = np.arange(len(panel.names))
    observed, fitted = np.array(panel.observed), np.array(panel.fitted)
    roles = np.array(panel.each_role)
    axes.values.hlines(rows, observed, fitted, color=style.PALE, linewidth=2.5, zorder=1)
    axes.values.plot(observed, rows, "o", color=BLACK, markerfacecolor="none", markersize=5.5)
    left = fitted - observed
    for role, colour in ROLES.items():
        chosen = roles == role
        axes.values.plot(fitted[chosen], rows[chosen], "o", color=colour, markersize=3.0)
        axes.residuals.barh(rows[chosen], left[chosen], 0.55, color=colour)
    for ax in axes:
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.tick_params(axis="y", length=0.0)
    axes.values.set_yticks(rows, [style.printed(name) for name in panel.names])
    axes.residuals.set_yticks(rows, [""] * len(rows))
    values = np.concatenate([observed, fitted])
    low, high = float(np.min(values)), float(np.max(values))
    if low > 0.0 and high > DECADE * low:
        axes.values.set_xscale("log")
        steps = (1.0,) if high > DECADE**3 * low else (1.0, 2.0, 5.0)
        axes.values.xaxis.set_major_locator(LogLocator(subs=steps))
        axes.values.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10g}"))
        axes.values.xaxis.set_minor_formatter(NullFormatter())
    else:
        axes.values.set_xlim(style.margins(values, 0.08, 0.02 * max(abs(low), abs(high)) or 1.0))
    axes.residuals.xaxis.set_major_locator(MaxNLocator(4))
    axes.residuals.axvline(0.0, color=BLACK, linewidth=0.5)
    least = 1e-4 * float(np.max(np.abs(observed))) or 1.0
    reach = 1.15 * max(float(np.max(np.abs(left))), least)
    axes.residuals.set_xlim(-reach, reach)
    axes.values.set_xlabel(f"{panel.quantity} [{panel.unit}]")
    axes.residuals.set_xlabel(f"fitted $-$ observed [{panel.unit}]")


def _draw_curve(axes: FitAxes, panel: Panel) -> None:
    """Draw dots along an axis, and the fit as a line that breaks where the group changes."""
    at, observed, fitted = map(np.array, (panel.at, panel.observed, panel.fitted))
    groups = np.array(panel.groups or ("",) * len(at))
    size = 2.5 if len(at) > FEW else 6.0
    for group in dict.fromkeys(groups.tolist()):
        own = groups == group
        look: style.Look = {"color": GROUPS.get(group, BLUE), "markersize": size}
        axes.values.plot(at[own], observed[own], ".", alpha=0.6, **look)
        axes.residuals.plot(at[own], (fitted - observed)[own], ".", alpha=0.6, **look)
    cuts = [0, *(np.flatnonzero(groups[1:] != groups[:-1]) + 1), len(at)]
    for start, end in pairwise(cuts):
        axes.values.plot(at[start:end], fitted[start:end], color=BLACK, linewidth=1.1)
    axes.residuals.axhline(0.0, color=BLACK, linewidth=0.5)
    style.group_thousands(*axes)
    axes.values.set(xlabel=panel.at_words, ylabel=f"{panel.quantity} [{panel.unit}]")
    axes.residuals.set(xlabel=panel.at_words, ylabel=f"fitted $-$ observed [{panel.unit}]")


def _entries(found: Fit) -> list[Artist]:
    """The entries of the legend, by the first panel."""
    shown = found.panels[0]
    if shown.names:
        used = {role for panel in found.panels for role in panel.roles} | {"fitted"}
        ring = Line2D([], [], ls="", marker="o", color=BLACK, mfc="none", label="observed")
        dots = [
            Line2D([], [], ls="", marker="o", color=colour, markersize=3.0, label=role)
            for role, colour in ROLES.items()
            if role in used
        ]
        return [ring, *dots]
    dots = [
        Line2D([], [], ls="", marker=".", color=GROUPS.get(name, BLUE), label=name or "observed")
        for name in dict.fromkeys(shown.groups or ("",))
    ]
    words = "mean" if shown.groups else "fitted"
    return [*dots, Line2D([], [], color=BLACK, linewidth=1.1, label=words)]
