"""What uncertain keys do: the swing that each key causes, and the spread that all cause."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.arrays import Floats
from optuav.mission.messages import plural
from optuav.plots import style
from optuav.plots.heat import LONGEST_HOVER_LABEL, NONE
from optuav.plots.style import BLACK, BLUE, DARK, GREEN, GREY, ORANGE
from optuav.presentation.keys import axis_of
from optuav.presentation.numbers import figure, fixed, percent, seconds

MOST_KEYS, LONGEST_KEY = 20, 44
KEY_IN, AROUND_IN = 0.24, 1.5  # Height of a key in a tornado, and of what surrounds them [inch]
LEAST_ROOM = 0.12  # Share of the bars' reach that is left on either side of them
TIP_PT = 2.0  # Distance of words from the tip of their bar
MOVES_S = 5e-3  # Least swing that has a bar [s]
BINS = 60
NO_PLAN = "no plan"
APART, WIDE = 0.09, 0.06
"""Distance of the bar of no plan from the values, and its width, as shares of their range."""
ROOM_ABOVE = 1.25  # Height of the axis, over the bar of no plan, for its words
LEAST_RANGE_S = 1.0


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
    keys = (axis_of(row["key"], row["unit"]) for row in shown)
    short = [key if len(key) <= LONGEST_KEY else f"{key[: LONGEST_KEY - 1]}…" for key in keys]
    ax.set_yticks(range(len(shown)), short)
    ax.tick_params(axis="y", length=0.0)
    more = f"; {len(moving) - len(shown)} more keys move it less" if moving != shown else ""
    ax.set_xlabel(f"{LONGEST_HOVER_LABEL}{more}")
    words = "longest hover by one key at a time", "at the values beside the bars"
    ax.set_title(style.titled(mission, *words))
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
        words = fixed(at, 0) if 1e4 <= abs(at) < 1e6 else figure(at, 4)
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
            style.annotate_beside(ax, " and ".join(beyond), tip, offset_pt, fontsize=6.5)


@style.applied()
def hover_times(times_s: Floats, mission: str, *, fixed_s: float | None = None) -> Axes:
    """Draw the spread of the longest hover [s], 0 without a plan, and of a fixed plan [s]."""
    planned, count = times_s[times_s > 0.0], len(times_s)
    low_s, middle_s, high_s = np.quantile(times_s, (0.05, 0.5, 0.95)).tolist()
    ax = style.page(3.4).subplots()
    if len(planned):
        weights = np.full(len(planned), 100.0 / count)
        ax.hist(planned, bins=BINS, weights=weights, color=GREEN, linewidth=0.0)
        ax.set_xlim(planned.min(), ax.get_xlim()[1])
    if len(planned) < count:
        range_s = (planned.min(), planned.max()) if len(planned) else (0.0, 0.0)
        draw_without_plan(ax, [(1.0 - len(planned) / count, GREY)], range_s)
    handles = list[Artist]()
    if middle_s > 0.0:
        middle: style.Look = {
            "color": BLACK,
            "linewidth": 1.0,
            "label": f"median {seconds(middle_s, 0)}",
        }
        handles.append(ax.axvline(middle_s, **middle))
    if high_s > 0.0:
        words = f"90 % within {fixed(low_s, 0)} to {seconds(high_s, 0)}"
        words = words if low_s > 0.0 else f"95 % at most {seconds(high_s, 0)}, or no plan"
        band: style.Look = {"color": GREEN, "alpha": 0.15, "linewidth": 0.0, "label": words}
        handles.append(ax.axvspan(max(low_s, ax.get_xlim()[0]), high_s, **band))
    if fixed_s is not None:
        look: style.Look = {"color": DARK, "linewidth": 1.2, "linestyle": "--"}
        handles.append(ax.axvline(fixed_s, **look, label=f"fixed plan {seconds(fixed_s, 0)}"))
    ax.set(xlabel=LONGEST_HOVER_LABEL, ylabel="share of samples [%]")
    words = f"longest hover in {plural(count, 'sample')}"
    ax.set_title(style.titled(mission, words), pad=style.LEGEND_PT)
    if handles:
        style.legend_above(ax, len(handles), handles)
    style.group_thousands(ax)
    style.settle(ax)
    return ax


def draw_without_plan(
    ax: Axes, shares: Sequence[tuple[float, str]], range_s: tuple[float, float]
) -> float:
    """Draw bars of what has no plan to the left of a range of values; where the first begins.

    Shares have colours; they stand side by side. The axis has no numbers beside the values.
    """
    low, high = range_s
    span = max(high - low, LEAST_RANGE_S)
    begin, width = low - (APART + WIDE) * span, WIDE * span / len(shares)
    for number, (share, colour) in enumerate(shares):
        at = begin + number * width
        ax.bar(at, 100.0 * share, width, align="edge", **{**NONE, "edgecolor": colour})
    highest = 100.0 * max(share for share, _ in shares)
    shown = {percent(share): None for share, _ in shares}
    middle = begin + 0.5 * WIDE * span
    words = "\n".join([*shown][:1] * (len(shown) == 1) + [NO_PLAN])
    style.annotate_beside(ax, words, (middle, highest), (0.0, 2.0))
    ax.set_xlim(begin - 0.03 * span, max(ax.get_xlim()[1], high))
    ax.set_ylim(0.0, max(ax.get_ylim()[1], ROOM_ABOVE * highest))
    ax.set_xticks([tick for tick in ax.get_xticks() if low <= tick <= ax.get_xlim()[1]])
    return begin
