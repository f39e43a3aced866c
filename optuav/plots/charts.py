"""Bars by group, curves, waterfalls of power, swings of keys, and spreads of hover times."""

from collections.abc import Mapping, Sequence
from itertools import cycle, pairwise
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from optuav.arrays import Floats
from optuav.errors import InputError, refuse
from optuav.looks import LOOKS
from optuav.mission.messages import several, unknown
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, DARK, GREEN, GREY, LASER, ORANGE, PINK, SKY
from optuav.presentation.numbers import percent

COLOURS = {
    **{"battery": BLUE, "energy": ORANGE, "adjusted": SKY, "available": GREEN},
    **{"direct": GREY, "traj1": SKY, "traj2": ORANGE, "optimal": BLUE},
    **{"P3": GREY, "P4": ORANGE, "P2": SKY, "P2-tight": BLUE, "P1": GREEN, "": BLUE},
}
"""Colours of bars by name, in their order side by side."""
PRINTED = {
    "battery": "Battery Persp.",
    "energy": "Ener. Persp.",
    "adjusted": "Adj. Ener. Persp.",
    "available": "available well\n(ours)",
}
"""Names of groups that are perspectives, as the paper's figures print them."""
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
MOST_KEYS, LONGEST_KEY = 20, 40
KEY_IN, AROUND_IN = 0.24, 1.5  # Height of a key in a tornado, and of what surrounds them [inch]
LEAST_ROOM = 0.12  # Share of the bars' reach that is left on either side of them
TIP_PT = 2.0  # Distance of words from the tip of their bar
MOVES_S = 5e-3  # Least swing that has a bar [s]
BINS = 60
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
    known = [bar.value for bar in shown if bar.value is not None]
    low, high = style.margins([0.0, floor, *known], 0.14)
    ax.set(ylabel=y_label, ylim=(low if min(known, default=0.0) < 0.0 else 0.0, high))
    for group, name, value, flyable in shown:
        middle = used.index(name) - 0.5 * (len(used) - 1)
        at, end = groups.index(group) + width * middle, value or 0.0
        (bar,) = ax.bar(at, end, 0.92 * width, color=COLOURS[name])
        if flyable is False:
            bar.set(hatch=HATCH, edgecolor="white", linewidth=0.0)
        words = f"{end:.{1 if abs(end) < LONG else 0}f}"
        if value is None:  # on two lines, as bars are narrow, and above the line of the level
            words, end = "no\nplan", max(floor, 0.0)
        style.beside(ax, style.minus(words), (at, end), (0.0, 2.0 if end >= 0.0 else -2.0))
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
    for line, colour, dashes in zip(lines, cycle(LINES), cycle(DASHES), strict=False):
        (curve,) = ax.plot(line.x, line.y, color=colour, linestyle=dashes, zorder=3)
        curve.set(label=line.label, marker=line.marker, markersize=4.0)
        if line.well:
            curve.set(color=LOOKS[line.well].light, path_effects=RIMS[line.well])
        x = np.asarray(curve.get_xdata(orig=False))  # Also where y is not known
        ax.update_datalim(np.stack([x, np.zeros_like(x)], axis=1), updatey=False)
    low, high = style.margins(values[np.isfinite(values)].tolist() + [0.0] * y_from_zero)
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
    left, right = ax.get_xlim()
    for number, (at, words) in enumerate(marks):  # on the side with more room, in two rows
        to_left = at - left > right - at
        offset_pt = (-3.0 if to_left else 3.0, -3.0 - 9.0 * (number % 2))
        fraction = ("data", "axes fraction")
        style.beside(ax, words, (at, 1.0), offset_pt, xycoords=fraction, color=DARK)
    return ax


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


@style.applied()
def tornado(rows: Sequence[Mapping[str, Any]], hover_time_s: float, mission: str) -> Axes:
    """Draw a bar for each row of the largest effects, the largest first, and how many more."""
    moving = [row for row in rows if row["swing_s"] > MOVES_S]
    shown = moving[:MOST_KEYS]
    ends_s = [row[end] for row in shown for end in ("hover_low_s", "hover_high_s")]
    ax = style.page(AROUND_IN + KEY_IN * (1 + max(1, len(shown)))).subplots()
    known_s = [hover_time_s, *(s for s in ends_s if s is not None)]
    limits = style.margins(known_s, LEAST_ROOM)
    ax.set(xlim=limits, ylim=(len(shown) + 0.6, -0.6))  # the last row is the legend's
    for at, row in enumerate(shown):
        _draw_swing(ax, at, hover_time_s, row)
    ax.axvline(hover_time_s, color=BLACK, linewidth=0.8)
    keys = (row["key"] for row in shown)
    short = [key if len(key) <= LONGEST_KEY else f"{key[: LONGEST_KEY - 1]}…" for key in keys]
    ax.set_yticks(range(len(shown)), short)
    ax.tick_params(axis="y", length=0.0)
    more = f"; {len(moving) - len(shown)} more keys move it less" if moving != shown else ""
    ax.set_xlabel(f"longest hover Δ [s]{more}")
    ax.set_title(f"{style.drawable(mission)}: one key at a time, at the values beside the bars")
    ends = (("key at its low end", ORANGE), ("key at its high end", BLUE))
    handles = [Patch(label=words, color=colour, linewidth=0.0) for words, colour in ends]
    ax.legend(handles=handles, loc="lower right", ncols=2)
    ax.xaxis.grid(True, linewidth=0.3, color=GREY)
    style.settle(ax)
    gap = 4.0 * TIP_PT * style.root(ax).dpi / style.POINTS_PER_INCH
    widest = max((gap + text.get_window_extent().width for text in ax.texts), default=0.0)
    share = widest / ax.get_window_extent().width  # Share of the axes on either side of the bars
    ax.set_xlim(style.margins(known_s, max(LEAST_ROOM, share / (1.0 - 2.0 * share))))
    style.settle(ax)
    return ax


def _draw_swing(ax: Axes, row: int, hover_time_s: float, swing: Mapping[str, Any]) -> None:
    """Draw both ends of a key, the shorter bar before the longer, with the values at their tips.

    An end without a plan is an empty bar to the edge of the picture.
    """
    low_s, high_s = ax.get_xlim()
    beyond_s = low_s - (high_s - low_s)  # the edge, wherever it will be
    own: style.Look = {"left": hover_time_s, "height": 0.7, "linewidth": 0.0}
    tips: dict[bool, dict[str, float]] = {False: {}, True: {}}  # by whether the hover is longer
    for end, colour in (("low", ORANGE), ("high", BLUE)):
        at, end_s = swing[end], swing[f"hover_{end}_s"]
        # In four digits, without an exponent where it is short enough.
        words = style.minus(f"{at:.0f}" if 1e4 <= abs(at) < 1e6 else f"{at:.4g}")
        change_s = (beyond_s if end_s is None else end_s) - hover_time_s
        (bar,) = ax.barh(row, change_s, color=colour, zorder=1.0 - 1e-6 * abs(change_s), **own)
        if end_s is None:
            bar.set(fill=False, hatch="////", edgecolor=colour, linewidth=0.5)
            backing = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
            shown: style.Look = {"va": "center", "fontsize": 6.5, "bbox": backing}
            at_edge = ("axes fraction", "data")
            ax.annotate(f" {words}: no plan", (0.0, row), xycoords=at_edge, **shown)
        elif abs(change_s) > MOVES_S:
            tips[change_s > 0.0][words] = end_s
    for longer, beyond in tips.items():
        if beyond:
            tip = ((max if longer else min)(beyond.values()), float(row))
            offset_pt = (TIP_PT if longer else -TIP_PT, 0.0)
            style.beside(ax, " and ".join(beyond), tip, offset_pt, fontsize=6.5)


@style.applied()
def hover_times(times_s: Floats, mission: str, *, fixed_s: float | None = None) -> Axes:
    """Draw the spread of the longest hover [s], 0 without a plan, and of a fixed plan [s]."""
    planned = times_s[times_s > 0.0]
    low_s, middle_s, high_s = np.quantile(times_s, (0.05, 0.5, 0.95)).tolist()
    ax = style.page(3.4).subplots()
    values = planned if len(planned) else np.zeros(1)
    weights = np.full(len(values), 100.0 / len(times_s))
    ax.hist(values, bins=BINS, weights=weights, color=GREEN, linewidth=0.0)
    ax.axvspan(low_s, high_s, color=GREEN, alpha=0.15, linewidth=0.0)
    ax.set_xlim(left=values.min())
    ax.axvline(middle_s, color=BLACK, linewidth=1.0)
    words = [f"median {middle_s:.0f} s", f"90 % within {low_s:.0f} to {high_s:.0f} s"]
    if fixed_s is not None:
        ax.axvline(fixed_s, color=DARK, linewidth=1.2, linestyle="--")
        words.append(f"fixed plan {fixed_s:.0f} s (dashed)")
    if len(planned) < len(times_s):
        words.append(f"no plan in {percent(1.0 - len(planned) / len(times_s))}")
    ax.set(xlabel="longest hover Δ [s]", ylabel="share of samples [%]")
    ax.set_title(f"{style.drawable(mission)}: {', '.join(words)}")
    style.group_thousands(ax)
    style.settle(ax)
    return ax
