"""What matters most: swings of single keys as a tornado, and how hover times are spread."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    group_thousands,
    margins,
    page,
    printed,
    styled,
)

MOST_BARS = 20
BAR_IN, AROUND_IN = 0.24, 1.5
MOVES_S = 5e-3
"""Swings below this have no bar [s]."""
BINS = 60
LONGEST_KEY = 40


class Swing(NamedTuple):
    """What a key does to the longest hover within a range.

    Parameters
    ----------
    key
        Its name.
    low, high
        The range.
    hover_low_s, hover_high_s
        Hover time at its ends [s]; None without a plan.
    """

    key: str
    low: float
    high: float
    hover_low_s: float | None
    hover_high_s: float | None


def tornado(
    swings: Sequence[Swing], hover_time_s: float, mission: str, *, ax: Axes | None = None
) -> Axes:
    """Draw a bar for each of the largest swings, and how many more there are.

    Parameters
    ----------
    swings
        The largest first.
    hover_time_s
        Longest hover of the mission as it stands [s].
    mission
        Name of the mission.
    ax
        Where to draw; on a page of its own by default.
    """
    moving = [each for each in swings if _swing_s(each, hover_time_s) > MOVES_S]
    shown = moving[:MOST_BARS]
    ends_s = [s for each in shown for s in each[3:] if s is not None]
    with styled():
        if ax is None:
            ax = page(7.2, AROUND_IN + BAR_IN * max(1, len(shown))).subplots()
        low_s, high_s = margins([hover_time_s, *ends_s], 0.12)
        ax.set(xlim=(low_s, high_s), ylim=(len(shown) - 0.4, -0.6))
        for row, each in enumerate(shown):
            for end_s, value, colour in _ends(each):
                if end_s is None:
                    _lost(ax, row, hover_time_s, value, colour)
            _bars(ax, row, hover_time_s, each)
        ax.axvline(hover_time_s, color=BLACK, linewidth=0.8)
        ax.set_yticks(range(len(shown)), [_short(each.key) for each in shown])
        ax.tick_params(axis="y", length=0.0)
        more = f"; {len(moving) - len(shown)} more keys move it less" if moving != shown else ""
        ax.set_xlabel(f"longest hover Δ [s]{more}")
        ax.set_title(f"{printed(mission)}: one key at a time, at the values beside the bars")
        for label, colour in (("key at its low end", ORANGE), ("key at its high end", BLUE)):
            ax.barh([0], [0], color=colour, label=label)
        ax.legend(loc="lower right")
        ax.xaxis.grid(True, linewidth=0.3, color=GREY)
        ax.set_axisbelow(True)
        if ax.figure is not None:
            _laid_out(ax)
    return ax


def _bars(ax: Axes, row: int, hover_time_s: float, swing: Swing) -> None:
    """Both ends of a key, the shorter bar before the longer; at their tips the values."""
    bars = [(s - hover_time_s, value, colour) for s, value, colour in _ends(swing) if s is not None]
    for width_s, _, colour in sorted(bars, key=lambda bar: -abs(bar[0])):
        ax.barh(row, width_s, left=hover_time_s, height=0.7, color=colour, linewidth=0.0)
    for towards, side in ((-1.0, "right"), (1.0, "left")):
        beyond = {
            value: towards * width_s for width_s, value, _ in bars if towards * width_s > MOVES_S
        }
        if beyond:
            ax.annotate(
                " and ".join(map(_value, beyond)),
                (hover_time_s + towards * max(beyond.values()), row),
                (2.0 * towards, 0.0),
                textcoords="offset points",
                va="center",
                ha=side,
                fontsize=6.5,
            )


def _lost(ax: Axes, row: int, hover_time_s: float, value: float, colour: str) -> None:
    """An end without a plan: an empty bar as far as the picture goes."""
    left = ax.get_xlim()[0]
    ax.barh(
        row,
        left - hover_time_s,
        left=hover_time_s,
        height=0.7,
        fill=False,
        edgecolor=colour,
        hatch="////",
        linewidth=0.5,
    )
    ax.annotate(
        f" {_value(value)}: no plan",
        (left, row),
        va="center",
        ha="left",
        fontsize=6.5,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )


def _ends(swing: Swing) -> tuple[tuple[float | None, float, str], ...]:
    """Hover time [s], value of the key and colour at both ends."""
    return (swing.hover_low_s, swing.low, ORANGE), (swing.hover_high_s, swing.high, BLUE)


def hover_times(
    times_s: Floats,
    mission: str,
    *,
    fixed_s: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw how the longest hover is spread, with its median and the middle 90 %.

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
    """
    planned = times_s[times_s > 0.0]
    low_s, middle_s, high_s = np.quantile(times_s, (0.05, 0.5, 0.95)).tolist()
    with styled():
        if ax is None:
            ax = page(7.2, 3.4).subplots()
        values = planned if len(planned) else np.zeros(1)
        weights = np.full(len(values), 100.0 / len(times_s))
        ax.hist(values, bins=BINS, weights=weights, color=GREEN, linewidth=0.0)
        ax.axvspan(low_s, high_s, color=GREEN, alpha=0.15, linewidth=0.0)
        ax.axvline(middle_s, color=BLACK, linewidth=1.0)
        words = [f"median {middle_s:.0f} s", f"90 % within {low_s:.0f} to {high_s:.0f} s"]
        if fixed_s is not None:
            ax.axvline(fixed_s, color=VERMILLION, linewidth=1.2, linestyle="--")
            words.append(f"fixed plan {fixed_s:.0f} s (dashed)")
        if len(planned) < len(times_s):
            words.append(f"no plan in {1.0 - len(planned) / len(times_s):.1%}")
        ax.set(xlabel="longest hover Δ [s]", ylabel="share of samples [%]")
        ax.set_title(f"{printed(mission)}: {', '.join(words)}")
        group_thousands(ax)
        _laid_out(ax)
    return ax


def _swing_s(swing: Swing, hover_time_s: float) -> float:
    return max(abs((end or 0.0) - hover_time_s) for end in swing[3:])


def _value(value: float) -> str:
    """A number in four digits, without an exponent where it is short enough."""
    text = f"{value:.0f}" if 1e4 <= abs(value) < 1e6 else f"{value:.4g}"
    return text.replace("-", "\N{MINUS SIGN}")


def _short(key: str) -> str:
    return key if len(key) <= LONGEST_KEY else f"{key[: LONGEST_KEY - 1]}…"


def _laid_out(ax: Axes) -> None:
    figure = ax.get_figure(root=True)
    if figure is not None:
        figure.draw_without_rendering()
