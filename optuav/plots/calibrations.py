"""A calibration: observed and fitted values, and their differences."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from optuav.calibration.fit import Fit, Panel
from optuav.calibration.logs.flight_log import FlightLog
from optuav.errors import InputError
from optuav.looks import PHASES
from optuav.mission.messages import of_kind
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE
from optuav.presentation.numbers import figure

GROUPS = {**PHASES, "charge": style.PINK, "": BLUE}  # Colours of the groups of observations
ROLES = {"fitted": BLUE, "repeat": style.SKY, "predicted": style.ORANGE}
"""Colours of named observations."""
DECADE = 10.0  # Largest over smallest value beyond which the axis is logarithmic
FEW = 100  # Most observations that are drawn as large dots
PER_NAME_IN, BASE_IN, CURVE_IN, LOG_IN = 0.21, 0.85, 1.9, 1.4
"""Height of a named observation, of what surrounds them, of a curve, and of a log's row [inch]."""


class FitAxes(NamedTuple):
    """Panels of a quantity that was fitted, in its unit.

    Parameters
    ----------
    values, residuals
        Its observed and fitted values; and fitted minus observed.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.FitAxes._fields
    ('values', 'residuals')
    """

    values: Axes
    residuals: Axes

    def _repr_png_(self) -> style.Shown:
        return style.picture_of(self)


class FlightLogAxes(NamedTuple):
    """Panels of a flight log over its time.

    Parameters
    ----------
    speed, climb, current
        Speed over ground [m/s], climb [m/s] and current [A].

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.FlightLogAxes._fields
    ('speed', 'climb', 'current')
    """

    speed: Axes
    climb: Axes
    current: Axes

    def _repr_png_(self) -> style.Shown:
        return style.picture_of(self)


@style.applied()
def fit(found: Fit, *, figure: style.AnyFigure | None = None) -> tuple[FitAxes, ...]:
    """Draw observed and fitted values, and their differences, one row per quantity.

    Parameters
    ----------
    found
        A calibration from observations, of `optuav.fit_kibam`, `optuav.fit_regimes` or
        `optuav.fit_rotor`.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    `optuav.plots.FitAxes` of every quantity, in its unit.

    Raises
    ------
    InputError
        If the calibration rests on no observations.

    Examples
    --------
    >>> import optuav
    >>> from optuav.calibration import Panel
    >>> panel = Panel("lifetime", "s", (100.0, 120.0), (101.0, 118.0), names=("1 A", "2 A"))
    >>> fitted = optuav.Fit("kibam", ("cell.csv",), "2 loads", (), (panel,))
    >>> optuav.plots.fit(fitted)[0].values.get_xlabel()
    'lifetime [s]'
    """
    of_kind("found", found, Fit, "a calibration, as optuav.fit_kibam returns it")
    if not found.panels:
        raise InputError(f"there is nothing to draw: the values come from {found.data}")
    heights = [BASE_IN + PER_NAME_IN * len(p.names) if p.names else CURVE_IN for p in found.panels]
    grid = (figure or style.page(0.4 + sum(heights))).subplots(
        len(heights), 2, squeeze=False, height_ratios=heights, width_ratios=(1.7, 1.0)
    )
    axes = style.Panels(FitAxes(left, right) for left, right in grid)
    first: dict[tuple[int, str], Axes] = {}
    for ax, panel in zip(axes, found.panels, strict=True):
        (_draw_names if panel.names else _draw_curve)(ax, panel)
        for column, drawn in enumerate(() if panel.names else ax):
            above = first.setdefault((column, panel.at_words), drawn)
            if above is not drawn:
                drawn.sharex(above)
                drawn.autoscale_view()
    sources = ", ".join(style.drawable(source.rpartition("/")[2]) for source in found.sources[:2])
    more = f" and {len(found.sources) - 2} more" if len(found.sources) > 2 else ""
    top = axes[0].values
    # On a line of its own: beside the files it would reach into the title of the residuals.
    lag = f"\n{found.lag_words}" if found.lag_words else ""
    top.set_title(f"{sources}{more}: fit of {found.kind}{lag}", pad=style.LEGEND_PT)
    axes[0].residuals.set_title("what the fit leaves over", pad=style.LEGEND_PT)
    shown = axes if found.panels[0].names else axes[:1]
    labelled = [ax.values.get_legend_handles_labels() for ax in shown]
    entries = {words: handle for pair in labelled for handle, words in zip(*pair, strict=True)}
    style.legend_above(top, 6, list(entries.values()))
    style.settle(top)
    return axes


@style.applied()
def flight_log(log: FlightLog, *, figure: style.AnyFigure | None = None) -> FlightLogAxes:
    r"""Draw speed, climb and current of a flight log, coloured by what the drone did.

    Parameters
    ----------
    log
        A log that a calibration was made from, see `optuav.Fit.logs`.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    FlightLogAxes
        The speed, the climb and the current; left out are the grey samples.

    Raises
    ------
    InputError
        If it is not a flight log.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> rows = ["time(millisecond),current(A),voltage(v),speed(mph)"]
    >>> rows += [f"{100 * n},18,22.2,{n % 2}" for n in range(200)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "flight.csv"
    ...     _ = file.write_text("\n".join(rows))
    ...     log = optuav.fit_regimes(file).logs[0]
    >>> [ax.get_ylabel() for ax in optuav.plots.flight_log(log)]
    ['speed [m/s]', 'climb [m/s]', 'current [A]']
    """
    of_kind("log", log, FlightLog, "a flight log of a calibration")
    axes = (figure or style.page(0.6 + 3 * LOG_IN)).subplots(3, 1, sharex=True)
    series = {
        "speed [m/s]": log.samples.speed_m_s,
        "climb [m/s]": log.samples.climb_m_s,
        "current [A]": log.samples.current_A,
    }
    for ax, (words, values) in zip(axes, series.items(), strict=True):
        rows = {"left out": ~log.used}
        rows |= {phase: log.used & (log.phase == phase) for phase in (*GROUPS, "other")}
        for label, own in rows.items():
            if np.any(own):
                colour = {"left out": style.PALE, "other": style.SKY, **GROUPS}[label]
                ax.plot([], [], ".", color=colour, label=label)
                ax.plot(log.samples.time_s[own], values[own], ".", color=colour, markersize=2.5)
        ax.set_ylabel(words)
        style.group_thousands(ax)
    axes[-1].set_xlabel("time in the log [s]")
    title = style.titled(log.source.rpartition("/")[2], "what the log is used for")
    axes[0].set_title(title, pad=style.LEGEND_PT)
    style.legend_above(axes[0], 6)
    style.settle(axes[0])
    return FlightLogAxes(*axes)


def _draw_names(axes: FitAxes, panel: Panel) -> None:
    """Draw one line a named observation, from the top."""
    rows, values, residuals = np.arange(len(panel.names)), axes.values, axes.residuals
    observed, fitted = np.array(panel.observed), np.array(panel.fitted)
    left, roles = fitted - observed, np.array(panel.roles or ["fitted"] * len(rows))
    ring: style.Look = {"color": BLACK, "markerfacecolor": "none", "markersize": 5.5}
    values.hlines(rows, observed, fitted, color=style.PALE, linewidth=2.5, zorder=1)
    values.plot(observed, rows, "o", label="observed", **ring)
    for role, colour in ROLES.items():
        of_role = roles == role
        label = role if of_role.any() or role == "fitted" else None
        values.plot(fitted[of_role], rows[of_role], "o", color=colour, markersize=3.0, label=label)
        residuals.barh(rows[of_role], left[of_role], 0.55, color=colour)
    for ax in axes:
        ax.set_ylim(len(rows) - 0.5, -0.5)
        ax.tick_params(axis="y", length=0.0)
    values.set_yticks(rows, [style.drawable(name) for name in panel.names])
    residuals.set_yticks(rows, [""] * len(rows))
    both = np.concatenate([observed, fitted])
    low, high = float(np.min(both)), float(np.max(both))
    if low > 0.0 and high > DECADE * low:
        values.set_xscale("log")
        steps = (1.0,) if high > DECADE**3 * low else (1.0, 2.0, 5.0)
        values.xaxis.set_major_locator(LogLocator(subs=steps))
        values.xaxis.set_major_formatter(FuncFormatter(lambda value, _: figure(value, 10)))
        values.xaxis.set_minor_formatter(NullFormatter())
    else:
        values.set_xlim(style.margins(both, 0.08, 0.02 * max(abs(low), abs(high)) or 1.0))
    residuals.xaxis.set_major_locator(MaxNLocator(4))
    residuals.axvline(0.0, color=BLACK, linewidth=0.5)
    least = 1e-4 * float(np.max(np.abs(observed))) or 1.0
    reach = 1.15 * max(float(np.max(np.abs(left))), least)
    residuals.set_xlim(-reach, reach)
    values.set_xlabel(f"{panel.quantity} [{panel.unit}]")
    residuals.set_xlabel(f"fitted $-$ observed [{panel.unit}]")


def _draw_curve(axes: FitAxes, panel: Panel) -> None:
    """Draw dots along an axis, and the fit as a line that breaks where the group changes."""
    at, observed, fitted = map(np.array, (panel.at, panel.observed, panel.fitted))
    groups = np.array(panel.groups or ("",) * len(at))
    look: style.Look = {"markersize": 2.5 if len(at) > FEW else 6.0, "alpha": 0.6}
    for group in dict.fromkeys(groups.tolist()):
        own, look["color"] = groups == group, GROUPS.get(group, BLUE)
        axes.values.plot([], [], ".", color=look["color"], label=group or "observed")
        axes.values.plot(at[own], observed[own], ".", **look)
        axes.residuals.plot(at[own], (fitted - observed)[own], ".", **look)
    cuts = [0, *(np.flatnonzero(groups[1:] != groups[:-1]) + 1), len(at)]
    words = "mean" if panel.groups else "fitted"
    line: style.Look = {"color": BLACK, "linewidth": 1.1, "label": words}
    if panel.line:
        axes.values.plot(*zip(*panel.line, strict=True), **line)
    else:
        for start, end in pairwise(cuts):
            axes.values.plot(at[start:end], fitted[start:end], **line)
    axes.residuals.axhline(0.0, color=BLACK, linewidth=0.5)
    style.group_thousands(*axes)
    axes.values.set(xlabel=panel.at_words, ylabel=f"{panel.quantity} [{panel.unit}]")
    axes.residuals.set(xlabel=panel.at_words, ylabel=f"fitted $-$ observed [{panel.unit}]")
