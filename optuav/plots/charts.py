"""Bars by group, curves, and waterfalls of power."""

from collections.abc import Sequence
from itertools import cycle, pairwise
from textwrap import fill
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from optuav.arrays import Booleans
from optuav.errors import InputError, refuse
from optuav.looks import LOOKS
from optuav.mission.messages import several, unknown
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, DARK, GREEN, GREY, LASER, ORANGE, PINK, SKY
from optuav.presentation.numbers import fixed, percent, watts

COLOURS = {
    **{"battery": BLUE, "energy": ORANGE, "adjusted": SKY, "available": GREEN},
    **{"direct": GREY, "traj1": SKY, "traj2": ORANGE, "optimal": BLUE},
    **{"P3": GREY, "P4": ORANGE, "P2": SKY, "P2-tight": BLUE, "P1": GREEN, "": BLUE},
}
"""Colours of bars by name, in their order side by side."""
PRINTED = {
    "battery": "battery\nperspective",
    "energy": "energy\nperspective",
    "adjusted": "adjusted energy\nperspective",
    "available": "available well\n(optuav)",
}
"""Names of groups that are perspectives: those of the paper, and that of optuav."""
LONG = 1000.0  # Least number that is written without a decimal
GROUP = 0.8  # Share of the way to the next group that the bars of one take up
HATCH = "/////"
LINES = (BLUE, ORANGE, GREEN, PINK, SKY, BLACK)
DASHES = (*style.DASHES, (0.0, (9.0, 2.0)), style.DOTTED)  # Looks of curves
WELLS = ("available", "bound")
RIMS = {
    well: [withStroke(linewidth=2.6, foreground=LOOKS[other].light)]
    for well, other in zip(WELLS, WELLS[::-1], strict=True)
}
"""Rims of the lines of wells, each in the colour of the other, as one is pale and one dark."""
COLUMNS = 3
ROOM_ABOVE = 0.14  # Share of the height that is left above the curves for the words of the marks
WIDTHS = (1.4, 0.6, 4.0)  # Of the last line, more of each before it that others lie on, and at most
SAME_LINE = 4e-3  # Share of the axis by which two lines that look alike differ at most
WORDS_WIDTH = 10  # Letters in a line below a station


class Bar(NamedTuple):
    """A value of a plan.

    Parameters
    ----------
    group, name
        Words below the axis; and in the legend, a perspective, trajectory, problem or nothing.
    value
        Its height, in the unit of the axis; None without a plan.
    flyable
        Bars of plans that cannot be flown (False) are hatched.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.Bar("P3", "battery", 688.8, flyable=False).value
    688.8
    """

    group: str
    name: str
    value: float | None
    flyable: bool | None = True


class Line(NamedTuple):
    """A curve.

    Parameters
    ----------
    label
        Its name in the legend.
    x, y
        Arrays of one length, in the units of the axes.
    marker
        Matplotlib's marker of every point, ``"o"`` for dots; empty for none.
    well
        ``"available"`` or ``"bound"``, for the colour of that well; by default another.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.Line("battery", [600.0, 1200.0], [524.2, 719.5]).label
    'battery'
    """

    label: str
    x: npt.ArrayLike
    y: npt.ArrayLike
    marker: str = ""
    well: str = ""


class Mark(NamedTuple):
    """A value that is marked by a line.

    Parameters
    ----------
    at, words
        The value, in the unit of its axis, and the words beside the line.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.Mark(1200.0, "deadline").words
    'deadline'
    """

    at: float
    words: str


@style.applied()
def bars(
    shown: Sequence[Bar],
    *,
    title: str,
    y_label: str,
    level: Mark | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw bars in groups, with their numbers.

    Parameters
    ----------
    shown
        At least one; groups keep their order.
    title, y_label
        Heading, and label with its unit.
    level
        A value that is marked.
    ax
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with values along y and groups along x.

    Raises
    ------
    InputError
        If a bar has another name than `Bar` allows.

    Examples
    --------
    >>> import optuav
    >>> shown = [optuav.plots.Bar("P3", "", 577.5), optuav.plots.Bar("P1", "", 597.3)]
    >>> ax = optuav.plots.bars(shown, title="hover", y_label="Δ [s]")
    >>> [text.get_text() for text in ax.texts]
    ['577.5', '597.3']
    """
    shown = several("shown", shown, Bar, "at least one Bar")
    strange = dict.fromkeys(bar.name for bar in shown if bar.name not in COLOURS)
    refuse(unknown("name", name, [*filter(None, COLOURS)]) for name in strange)
    ax = ax or style.page(3.4 if any(bar.name for bar in shown) else 3.0).subplots()
    groups = list(dict.fromkeys(bar.group for bar in shown))
    used = [name for name in COLOURS if any(bar.name == name for bar in shown)]
    floor, width = level.at if level else 0.0, GROUP / max(2, len(used))
    values = [bar.value for bar in shown if bar.value is not None]
    low, high = style.margins([0.0, floor, *values], 0.14)
    ax.set(ylabel=y_label, ylim=(low if min(values, default=0.0) < 0.0 else 0.0, high))
    for group, name, value, flyable in shown:
        middle = used.index(name) - 0.5 * (len(used) - 1)
        at, end = groups.index(group) + width * middle, value or 0.0
        (bar,) = ax.bar(at, end, 0.92 * width, color=COLOURS[name])
        if flyable is False:
            bar.set(hatch=HATCH, edgecolor="white", linewidth=0.0)
        words = fixed(end, 1 if abs(end) < LONG else 0)
        if value is None:  # on two lines, as bars are narrow, and above the line of the level
            words, end = "no\nplan", max(floor, 0.0)
        style.annotate_beside(ax, words, (at, end), (0.0, 2.0 if end >= 0.0 else -2.0))
    style.group_thousands(ax)
    ax.set_xticks(range(len(groups)), [PRINTED.get(group, group) for group in groups])
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.tick_params(axis="x", length=0.0)
    handles: list[Artist] = [
        Patch(color=COLOURS[name], label=style.WORDS.get(name, name)) for name in used if name
    ]
    if level:
        handles.append(ax.axhline(floor, **style.limit("charge"), label=level.words))
    if any(bar.flyable is False for bar in shown):
        looks: style.Look = {"fc": GREY, "ec": "white", "hatch": HATCH, "linewidth": 0.0}
        handles.append(Patch(label="cannot be flown", **looks))
    ax.set_title(title, pad=style.LEGEND_PT if handles else None)
    if handles:
        style.legend_above(ax, len(handles), handles)
    style.settle(ax)
    return ax


@style.applied()
def curves(
    lines: Sequence[Line],
    *,
    title: str,
    x_label: str,
    y_label: str,
    marks: Sequence[Mark] = (),
    y_from_zero: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Draw curves over one quantity.

    Where lines lie on each other the first are the widest, so that all are seen; a line that lies
    wholly on another says so in the legend.

    Parameters
    ----------
    lines
        At least one, in the order of the legend.
    title, x_label, y_label
        Heading, and labels with units.
    marks
        Where something begins or ends.
    y_from_zero
        Whether the axis begins at 0.
    ax
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with quantities as the labels say.

    Raises
    ------
    InputError
        If no line has a finite value, and the axis does not begin at 0; or if a well has another
        name than `Line` allows.

    Examples
    --------
    >>> import optuav
    >>> line = optuav.plots.Line("square", [0.0, 1.0, 2.0], [0.0, 1.0, 4.0])
    >>> ax = optuav.plots.curves([line], title="powers", x_label="x [m]", y_label="y [m²]")
    >>> ax.get_legend().get_texts()[0].get_text()
    'square'
    """
    lines = several("lines", lines, Line, "at least one Line")
    strange = dict.fromkeys(line.well for line in lines if line.well not in ("", *WELLS))
    refuse(unknown("well", well, WELLS) for well in strange)
    values = np.concatenate([[], *(np.asarray(line.y, dtype=float) for line in lines)])
    if not (y_from_zero or np.isfinite(values).any()):
        raise InputError("there is nothing to draw: no line has a finite value")
    ax = ax or style.page(4.0).subplots()
    finite = values[np.isfinite(values)].tolist()
    widths, labels = _apart(lines, max(finite, default=0.0) - min(finite, default=0.0))
    looks = zip(lines, widths, labels, cycle(LINES), cycle(DASHES), strict=False)
    for line, width, label, colour, dashes in looks:
        look: style.Look = {"color": colour, "linestyle": dashes, "linewidth": width, "zorder": 3}
        (curve,) = ax.plot(line.x, line.y, **look)
        curve.set(label=label, marker=line.marker, markersize=2.6 + width)
        if line.well:
            curve.set(color=LOOKS[line.well].light, path_effects=RIMS[line.well])
        x = np.asarray(curve.get_xdata(orig=False))  # Also where y is not known
        ax.update_datalim(np.stack([x, np.zeros_like(x)], axis=1), updatey=False)
    low, high = style.margins(finite + [0.0] * y_from_zero)
    low = max(low, 0.0) if y_from_zero else low
    ax.set_ylim(low, high + ROOM_ABOVE * (high - low) * bool(marks))
    rows = -(-len(lines) // COLUMNS)
    ax.set_title(title, pad=style.LEGEND_PT * (0.35 + 0.65 * rows))
    ax.set(xlabel=x_label, ylabel=y_label)
    style.legend_above(ax, min(COLUMNS, len(lines)))
    style.group_thousands(ax)
    for mark in marks:
        ax.axvline(mark.at, color=DARK, linewidth=0.9, linestyle=style.DOTTED)
    style.settle(ax)
    style.thin_ticks(ax)
    left, right = ax.get_xlim()
    for number, (at, words) in enumerate(marks):  # on the side with more room, in two rows
        to_left = at - left > right - at
        offset_pt = (-3.0 if to_left else 3.0, -3.0 - 9.0 * (number % 2))
        fraction = ("data", "axes fraction")
        style.annotate_beside(ax, words, (at, 1.0), offset_pt, xycoords=fraction, color=DARK)
    return ax


def _apart(lines: Sequence[Line], span: float) -> tuple[list[float], list[str]]:
    """Widths of lines [pt] that tell those that lie on each other, and their labels.

    Values reach over a span.
    """
    last, step, most = WIDTHS
    labels, shared = [line.label for line in lines], False
    for number, line in enumerate(lines):
        for earlier in lines[:number]:
            near = _near(line, earlier, SAME_LINE * span)
            shared |= bool((near[1:] & near[:-1]).any())
            if len(near) > 1 and near.all() and labels[number] == line.label:
                labels[number] = f"{line.label}, as {earlier.label}"
    step = min(step, (most - last) / max(1, len(lines) - 1)) if shared else 0.0
    return [last + step * k for k in reversed(range(len(lines)))], labels


def _near(one: Line, other: Line, most: float) -> Booleans:
    """Where two lines over the same values differ by so little; nowhere if over others."""
    (x, y), (other_x, other_y) = (np.asarray(line[1:3], dtype=float) for line in (one, other))
    if not np.array_equal(x, other_x):
        return np.zeros(0, dtype=bool)
    near: Booleans = np.isclose(y, other_y, rtol=0.0, atol=most, equal_nan=True)
    return near


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
        loss = f"\n−{percent(1.0 - share)}" if at and share < 0.9995 else ""
        style.annotate_beside(ax, f"{watts(power_W)}{loss}", (at, top_W), (0.0, 2.0))
    style.group_thousands(ax)
    ax.set_xticks(range(len(stations)), [fill(words, WORDS_WIDTH) for words, *_ in stations])
    ax.tick_params(axis="x", length=0.0)
    ax.set_title(title, pad=style.LEGEND_PT)
    kinds = {"light": LASER, "electric": GREEN}
    patches = [Patch(color=colour, label=name) for name, colour in kinds.items()]
    style.legend_above(ax, 3, [*patches, Patch(label="lost before", **lost)])
    style.settle(ax)
    return ax
