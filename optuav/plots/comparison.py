"""Comparisons: what slots cost against their length, and plans side by side as bars."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots.grouped import cannot_be_flown, draw_groups
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
COLOURS = {"battery": BLUE, "energy": ORANGE, "adjusted": SKY, "available": GREEN}
BOUNDS = {1: "at most 1 slot:\nwhole horizon,\nor no rest", 2: "less than\n2 slots"}
"""What the theory says, by number of slots."""
BESIDE = 0.12
"""Distance of a kind of programme from the next, as a share of that of the slots."""
MOST_WORDS = 8
"""Most lengths of slots below which there is room for the loss of P1 in seconds."""
LEGEND_PT = 20.0
"""Room for a legend between axes and title [pt]."""


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
    flyable
        Whether the plan can be flown; bars of plans that cannot are hatched.
    """

    perspective: str
    trajectory: str
    hover_time_s: float | None
    soc: float | None
    flyable: bool = True


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
        group_thousands(*axes)  # first: it would put numbers in place of the groups' names
        keys = [(each.trajectory, each.perspective) for each in shown]
        colours = {name: COLOURS[name] for name in series}
        hovers_s = [each.hover_time_s for each in shown]
        hatched = {key for key, each in zip(keys, shown, strict=True) if not each.flyable}
        draw_groups(
            axes.hover, groups, colours, dict(zip(keys, hovers_s, strict=True)), hatched=hatched
        )
        percents = dict(zip(keys, percent, strict=True))
        draw_groups(axes.charge, groups, colours, percents, least_percent, hatched)
        axes.hover.set_title(
            f"{printed(mission)}: longest hover by trajectory and perspective", pad=LEGEND_PT
        )
        axes.hover.set_ylabel("hover time Δ [s]")
        axes.charge.set(ylabel="charge left\n$η_1$ [%]", xlabel="trajectory")
        least = axes.charge.axhline(least_percent, color=VERMILLION, linewidth=1.0)
        least.set_label("least, $η_0$")
        patches = [Patch(color=COLOURS[name], label=name) for name in series]
        axes.hover.legend(
            handles=[*patches, least, *[cannot_be_flown()] * bool(hatched)],
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            ncols=6,
        )
        settle(axes.hover)
    return axes
