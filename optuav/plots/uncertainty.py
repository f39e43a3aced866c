"""Sensitivity: swings of single keys as a tornado, and the distribution of hover times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, GREEN, ORANGE

MOST_BARS = 20
BAR_IN, AROUND_IN = 0.24, 1.5
MOVES_S = 5e-3
"""Least swing that has a bar [s]."""
BINS = 60
LONGEST_KEY = 40


class Swing(NamedTuple):
    """A key, the ends of its range, and the longest hover at each [s]; None without a plan."""

    key: str
    low: float
    high: float
    hover_low_s: float | None
    hover_high_s: float | None


@style.applied()
def tornado(
    swings: Sequence[Swing], hover_time_s: float, mission: str, *, ax: Axes | None = None
) -> Axes:
    """Draw a bar for each of the largest swings, and say how many more there are.

    Parameters
    ----------
    swings
        The largest first.
    hover_time_s
        Longest hover of the mission with its own values [s].
    mission
        Name of the mission.
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> swing = optuav.plots.Swing("laser.power_W", 800.0, 1200.0, 560.0, 630.0)
    >>> ax = optuav.plots.tornado([swing], 597.3, "paper")
    >>> [text.get_text() for text in ax.texts]
    ['800', '1200']
    """
    moving = [each for each in swings if _swing_s(each, hover_time_s) > MOVES_S]
    shown = moving[:MOST_BARS]
    ends_s = [s for each in shown for s in each[3:] if s is not None]
    ax = ax or style.page(AROUND_IN + BAR_IN * max(1, len(shown))).subplots()
    limits = style.margins([hover_time_s, *ends_s], 0.12)
    ax.set(xlim=limits, ylim=(len(shown) - 0.4, -0.6))
    for row, each in enumerate(shown):
        _draw_swing(ax, row, hover_time_s, each)
    ax.axvline(hover_time_s, color=BLACK, linewidth=0.8)
    keys = (each.key for each in shown)
    short = [key if len(key) <= LONGEST_KEY else f"{key[: LONGEST_KEY - 1]}…" for key in keys]
    ax.set_yticks(range(len(shown)), short)
    ax.tick_params(axis="y", length=0.0)
    more = f"; {len(moving) - len(shown)} more keys move it less" if moving != shown else ""
    ax.set_xlabel(f"longest hover Δ [s]{more}")
    ax.set_title(f"{style.printed(mission)}: one key at a time, at the values beside the bars")
    for label, colour in (("key at its low end", ORANGE), ("key at its high end", BLUE)):
        ax.barh([0], [0], color=colour, label=label)
    ax.legend(loc="lower right")
    ax.xaxis.grid(True, linewidth=0.3, color=style.GREY)
    ax.set_axisbelow(True)
    style.settle(ax)
    return ax


def _draw_swing(ax: Axes, row: int, hover_time_s: float, swing: Swing) -> None:
    """Draw both ends of a key, the shorter bar before the longer, with the values at their tips.

    An end without a plan is an empty bar to the edge of the picture.
    """
    ends = (swing.hover_low_s, swing.low, ORANGE), (swing.hover_high_s, swing.high, BLUE)
    bars = [(s - hover_time_s, value, colour) for s, value, colour in ends if s is not None]
    edge_s = ax.get_xlim()[0]
    for value, colour in ((value, colour) for s, value, colour in ends if s is None):
        width_s, hatch = edge_s - hover_time_s, "////"
        (bar,) = ax.barh(row, width_s, left=hover_time_s, height=0.7, fill=False, hatch=hatch)
        bar.set(edgecolor=colour, linewidth=0.5)
        backing = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        words = f" {_value(value)}: no plan"
        ax.annotate(words, (edge_s, row), va="center", ha="left", fontsize=6.5, bbox=backing)
    for width_s, _, colour in sorted(bars, key=lambda bar: -abs(bar[0])):
        ax.barh(row, width_s, left=hover_time_s, height=0.7, color=colour, linewidth=0.0)
    for towards in (-1.0, 1.0):
        beyond = {
            value: towards * width_s for width_s, value, _ in bars if towards * width_s > MOVES_S
        }
        if beyond:
            tip = (hover_time_s + towards * max(beyond.values()), float(row))
            style.beside(ax, " and ".join(map(_value, beyond)), tip, (2.0 * towards, 0.0))


@style.applied()
def hover_times(
    times_s: Floats, mission: str, *, fixed_s: float | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the distribution of the longest hover, with its median and the middle 90 %.

    Parameters
    ----------
    times_s
        Longest hover of every sample [s]; 0 where there is no plan.
    mission
        Name of the mission.
    fixed_s
        Hover of the plan that is held fixed [s].
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import numpy, optuav
    >>> times_s = numpy.array([0.0, 590.0, 600.0, 610.0])
    >>> optuav.plots.hover_times(times_s, "paper").get_ylabel()
    'share of samples [%]'
    """
    planned = times_s[times_s > 0.0]
    low_s, middle_s, high_s = np.quantile(times_s, (0.05, 0.5, 0.95)).tolist()
    ax = ax or style.page(3.4).subplots()
    values = planned if len(planned) else np.zeros(1)
    weights = np.full(len(values), 100.0 / len(times_s))
    ax.hist(values, bins=BINS, weights=weights, color=GREEN, linewidth=0.0)
    ax.axvspan(low_s, high_s, color=GREEN, alpha=0.15, linewidth=0.0)
    ax.axvline(middle_s, color=BLACK, linewidth=1.0)
    words = [f"median {middle_s:.0f} s", f"90 % within {low_s:.0f} to {high_s:.0f} s"]
    if fixed_s is not None:
        ax.axvline(fixed_s, color=style.VERMILLION, linewidth=1.2, linestyle="--")
        words.append(f"fixed plan {fixed_s:.0f} s (dashed)")
    if len(planned) < len(times_s):
        words.append(f"no plan in {1.0 - len(planned) / len(times_s):.1%}")
    ax.set(xlabel="longest hover Δ [s]", ylabel="share of samples [%]")
    ax.set_title(f"{style.printed(mission)}: {', '.join(words)}")
    style.group_thousands(ax)
    style.settle(ax)
    return ax


def _swing_s(swing: Swing, hover_time_s: float) -> float:
    return max(abs((end or 0.0) - hover_time_s) for end in swing[3:])


def _value(value: float) -> str:
    """A number in four digits, without an exponent where it is short enough."""
    return style.minus(f"{value:.0f}" if 1e4 <= abs(value) < 1e6 else f"{value:.4g}")
