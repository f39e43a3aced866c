"""Comparisons: what slots cost against their length, and plans side by side as bars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots.labels import settle
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    SKY,
    VERMILLION,
    group_thousands,
    margins,
    page,
    printed,
    styled,
)

LOOKS = {
    "P3": ("D", BLACK),
    "P4 rest-first": ("o", ORANGE),
    "P4 hover-first": ("s", BLUE),
    "P1": ("*", GREEN),
}
"""Marker and colour of every kind of programme, in the order in which they stand side by side."""
COLOURS = {"battery": BLUE, "energy": ORANGE, "adjusted": SKY}
BOUNDS = {1: "at most 1 slot:\nwhole horizon,\nor no rest", 2: "less than\n2 slots"}
"""What the theory says, by number of slots."""
BESIDE = 0.12
"""Distance of a kind of programme from the next, as a share of that of the slots."""
MOST_WORDS = 8
"""Most lengths of slots below which there is room for the loss of P1 in seconds."""
LEGEND_PT = 20.0
"""Room for a legend between axes and title [pt]."""
GROUP = 0.8
"""Share of the way to the next group that the bars of one take up."""


class Gap(NamedTuple):
    """What slots cost in one programme.

    Parameters
    ----------
    kind
        One of `LOOKS`.
    slot_s
        Length of the slots [s].
    gap_s
        Best hover time in continuous times less that in slots [s].
    largest_s
        Bound of the theory [s]; None where it has none.
    """

    kind: str
    slot_s: float
    gap_s: float
    largest_s: float | None


class Bar(NamedTuple):
    """What a choice of perspective and trajectory leads to.

    Parameters
    ----------
    perspective, trajectory
        Their names; trajectories are the groups.
    hover_time_s
        Δ [s]; None without a plan.
    soc
        η1, charge left at the end [-]; None without a plan.
    """

    perspective: str
    trajectory: str
    hover_time_s: float | None
    soc: float | None


class BarAxes(NamedTuple):
    """Hover time, and charge left, by trajectory."""

    hover: Axes
    charge: Axes


def slot_gaps(shown: Sequence[Gap], mission: str, *, ax: Axes | None = None) -> Axes:
    """Draw what slots cost, in slots, against their length, and the bound of the theory.

    Parameters
    ----------
    shown
        At least one.
    mission
        Name of the mission.
    ax
        Where to draw; on a page of its own by default.
    """
    slots_s = sorted({each.slot_s for each in shown})
    bounds = sorted({round(each.largest_s / each.slot_s) for each in shown if each.largest_s})
    highest = max([*bounds, *(each.gap_s / each.slot_s for each in shown)])
    lowest = min(0.0, *(each.gap_s / each.slot_s for each in shown))
    with styled():
        if ax is None:
            ax = page(7.2, 4.0).subplots()
        ax.set(xlim=(-0.5, len(slots_s) - 0.5), ylim=margins([lowest, highest], 0.06))
        ax.set(xlabel="length of a slot", ylabel="hover time Δ lost to slots [slots]")
        ax.set_title(f"{printed(mission)}: what whole slots cost", pad=LEGEND_PT)
        ax.axhline(0.0, color=BLACK, linewidth=0.5)
        for slots in bounds:
            ax.axhline(slots, color=VERMILLION, linewidth=1.1, zorder=2)
        for number, (kind, (marker, colour)) in enumerate(LOOKS.items()):
            own = [each for each in shown if each.kind == kind]
            shift = BESIDE * (number - 0.5 * (len(LOOKS) - 1))
            ax.plot(
                [slots_s.index(each.slot_s) + shift for each in own],
                [each.gap_s / each.slot_s for each in own],
                marker,
                color=colour,
                markersize=9.0 if marker == "*" else 5.0,
                markerfacecolor=colour if marker == "*" else "none",
                markeredgewidth=1.0,
                label=kind if own else None,
                zorder=3,
            )
        lost_s = {each.slot_s: each.gap_s for each in shown if each.kind == "P1"}
        words = {s: f"\nP1 loses {lost_s[s]:.3g} s" for s in lost_s if len(slots_s) <= MOST_WORDS}
        labels = [f"{slot_s:g} s{words.get(slot_s, '')}" for slot_s in slots_s]
        ax.set_xticks(range(len(slots_s)), labels)
        ax.tick_params(axis="x", length=0.0)
        side = ax.secondary_yaxis("right")
        side.set_yticks(bounds, [BOUNDS.get(slots, "bound") for slots in bounds])
        side.tick_params(length=0.0, labelcolor=VERMILLION)
        side.spines["right"].set_visible(False)
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=len(LOOKS))
        settle(ax)
    return ax


def choice_bars(
    shown: Sequence[Bar], mission: str, min_soc: float, *, axes: BarAxes | None = None
) -> BarAxes:
    """Draw hover time and charge left of plans as bars, grouped by trajectory.

    Parameters
    ----------
    shown
        At least one; perspectives and trajectories appear in the order in which they come.
    mission
        Name of the mission.
    min_soc
        η0, marked among the charges [-].
    axes
        Where to draw; on a page of its own by default.
    """
    groups = list(dict.fromkeys(each.trajectory for each in shown))
    series = list(dict.fromkeys(each.perspective for each in shown))
    least_percent = 100.0 * min_soc
    percent = [None if each.soc is None else 100.0 * each.soc for each in shown]
    with styled():
        if axes is None:
            above, below = page(7.2, 4.6).subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
            axes = BarAxes(above, below)
        _draw_bars(axes.hover, shown, [each.hover_time_s for each in shown], 0.0)
        _draw_bars(axes.charge, shown, percent, least_percent)
        group_thousands(*axes)
        axes.hover.set_title(
            f"{printed(mission)}: longest hover by trajectory and perspective", pad=LEGEND_PT
        )
        axes.hover.set_ylabel("hover time Δ [s]")
        axes.charge.set(ylabel="charge left\n$η_1$ [%]", xlabel="trajectory")
        axes.charge.set_xticks(range(len(groups)), groups)
        least = axes.charge.axhline(least_percent, color=VERMILLION, linewidth=1.0)
        least.set_label("least, $η_0$")
        patches = [Patch(color=COLOURS[name], label=name) for name in series]
        axes.hover.legend(
            handles=[*patches, least],
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            ncols=4,
        )
        settle(axes.hover)
    return axes


def _draw_bars(
    ax: Axes, shown: Sequence[Bar], values: Sequence[float | None], level: float
) -> None:
    """Draw one bar a choice with its number at the end; a level is inside the axes as well."""
    groups = list(dict.fromkeys(each.trajectory for each in shown))
    series = list(dict.fromkeys(each.perspective for each in shown))
    width = GROUP / max(2, len(series))
    known = [value for value in values if value is not None]
    low, high = margins([0.0, level, *known], 0.14)
    ax.set_ylim(low if min(known, default=0.0) < 0.0 else 0.0, high)
    for each, value in zip(shown, values, strict=True):
        middle = series.index(each.perspective) - 0.5 * (len(series) - 1)
        at, end = groups.index(each.trajectory) + width * middle, value or 0.0
        ax.bar(at, end, 0.92 * width, color=COLOURS[each.perspective])
        words = "no plan" if value is None else f"{value:.1f}"
        ax.annotate(
            words.replace("-", "\N{MINUS SIGN}"),
            (at, end),
            (0.0, 2.0 if end >= 0.0 else -2.0),
            textcoords="offset points",
            ha="center",
            va="bottom" if end >= 0.0 else "top",
            fontsize=7.0,
        )
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.tick_params(axis="x", length=0.0)
