"""Comparisons as bars, and what slots cost against their length."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.plots import style
from optuav.plots.labels import settle
from optuav.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION

PERSPECTIVES = {"battery": BLUE, "energy": ORANGE, "adjusted": SKY, "available": GREEN}
TRAJECTORIES = {"direct": GREY, "traj1": SKY, "traj2": ORANGE, "optimal": BLUE}
PRINTED = {
    "battery": "Battery Persp.",
    "energy": "Ener. Persp.",
    "adjusted": "Adj. Ener. Persp.",
    "available": "available well\n(ours)",
}
"""Names of perspectives as the paper's figures print them."""
LONG = 1000.0
"""Least number that is written without a decimal."""
GROUP = 0.8
"""Share of the way to the next group that the bars of one take up."""
HATCH = "/////"
"""Marks bars of plans that cannot be flown."""
PROGRAMMES = {
    "P3": ("D", BLACK),
    "P4 rest-first": ("o", ORANGE),
    "P4 hover-first": ("s", BLUE),
    "P1": ("*", GREEN),
}
"""Marker and colour of every kind of programme, in the order in which they stand side by side."""
BOUNDS = {1: "at most 1 slot:\nwhole horizon,\nor no rest", 2: "less than\n2 slots"}
"""Meaning of the bounds of the theory, by number of slots."""
BESIDE = 0.12
"""Distance of a kind of programme from the next, as a share of that of the slots."""
MOST_WORDS = 8
"""Largest number of slot lengths for which there is room for the loss of P1 in seconds."""


class Bar(NamedTuple):
    """The plan for one perspective and trajectory.

    Parameters
    ----------
    perspective, trajectory
        Their names.
    hover_time_s
        Δ [s]; None without a plan.
    soc
        η1, charge left at the end [-]; None without a plan.
    flyable
        Whether the plan can be flown; bars of those that cannot are hatched.
    """

    perspective: str
    trajectory: str
    hover_time_s: float | None
    soc: float | None
    flyable: bool = True

    @property
    def percent(self) -> float | None:
        """η1 [%]; None without a plan."""
        return None if self.soc is None else 100.0 * self.soc


class BarAxes(NamedTuple):
    """Hover time, and charge left, by trajectory."""

    hover: Axes
    charge: Axes


class Gap(NamedTuple):
    """The cost of slots in one programme.

    Parameters
    ----------
    kind
        ``"P1"``, ``"P3"``, ``"P4 rest-first"`` or ``"P4 hover-first"``.
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


def bars(
    values: Mapping[str, float | None],
    *,
    title: str,
    y_label: str,
    hatched: Collection[str] = (),
    ax: Axes | None = None,
) -> Axes:
    """Draw one bar a value.

    Parameters
    ----------
    values
        By name; None where there is no plan.
    title, y_label
        Heading, and label with its unit.
    hatched
        Names of the values whose plans cannot be flown.
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> ax = optuav.plots.bars({"P3": 577.5, "P1": 597.3}, title="hover", y_label="Δ [s]")
    >>> [text.get_text() for text in ax.texts]
    ['577.5', '597.3']
    """
    shown = [(name, "", value, name not in hatched) for name, value in values.items()]
    with style.applied():
        ax = ax or style.page(3.0).subplots()
        ax.set(ylabel=y_label)
        ax.set_title(title, pad=style.LEGEND_PT if hatched else None)
        _draw_groups(ax, shown, {"": BLUE})
        if hatched:
            style.legend_above(ax, 1, [_cannot_be_flown()])
        settle(ax)
    return ax


def hover_bars(shown: Sequence[Bar], title: str, ax: Axes | None = None) -> Axes:
    """Draw the hover time of every trajectory, grouped by perspective.

    Parameters
    ----------
    shown
        At least one; perspectives appear in the order in which they come.
    title
        Heading.
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> bar = optuav.plots.Bar("battery", "direct", 688.8, 0.05, flyable=False)
    >>> [patch.get_hatch() for patch in optuav.plots.hover_bars([bar], "hover").patches]
    ['/////']
    """
    values = [each.hover_time_s for each in shown]
    return _by_perspective(shown, values, "hover time Δ [s]", title, None, ax)


def charge_bars(shown: Sequence[Bar], title: str, min_soc: float, ax: Axes | None = None) -> Axes:
    """Draw the charge left η1 of every trajectory, grouped by perspective.

    Parameters
    ----------
    shown
        At least one; perspectives appear in the order in which they come.
    title
        Heading.
    min_soc
        η0, marked among the charges, 0 to 1.
    ax
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> bar = optuav.plots.Bar("available", "direct", 577.5, 0.207)
    >>> optuav.plots.charge_bars([bar], "charge", 0.05).texts[0].get_text()
    '20.7'
    """
    values = [each.percent for each in shown]
    return _by_perspective(shown, values, "charge left $η_1(T)$ [%]", title, 100.0 * min_soc, ax)


def _by_perspective(
    shown: Sequence[Bar],
    values: Sequence[float | None],
    y_label: str,
    title: str,
    level: float | None,
    ax: Axes | None,
) -> Axes:
    bars = [
        (PRINTED[each.perspective], each.trajectory, value, each.flyable)
        for each, value in zip(shown, values, strict=True)
    ]
    with style.applied():
        ax = ax or style.page(3.4).subplots()
        ax.set_ylabel(y_label)
        ax.set_title(title, pad=style.LEGEND_PT)
        handles = _draw_groups(ax, bars, TRAJECTORIES, level)
        style.legend_above(ax, len(handles), handles)
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
        η0, marked among the charges, 0 to 1.
    axes
        Where to draw; on a page of its own by default.

    Examples
    --------
    >>> import optuav
    >>> bar = optuav.plots.Bar("battery", "direct", 688.8, 0.05)
    >>> optuav.plots.choice_bars([bar], "paper", 0.05).hover.get_ylabel()
    'hover time Δ [s]'
    """
    hovers, charges = (
        [
            (each.trajectory, each.perspective, value, each.flyable)
            for each, value in zip(shown, values, strict=True)
        ]
        for values in ([each.hover_time_s for each in shown], [each.percent for each in shown])
    )
    with style.applied():
        axes = axes or BarAxes(
            *style.page(4.6).subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
        )
        _draw_groups(axes.hover, hovers, PERSPECTIVES)
        handles = _draw_groups(axes.charge, charges, PERSPECTIVES, 100.0 * min_soc)
        words = f"{style.printed(mission)}: longest hover by trajectory and perspective"
        axes.hover.set_title(words, pad=style.LEGEND_PT)
        axes.hover.set_ylabel("hover time Δ [s]")
        axes.charge.set(ylabel="charge left\n$η_1$ [%]", xlabel="trajectory")
        style.legend_above(axes.hover, len(handles), handles)
        settle(axes.hover)
    return axes


def _draw_groups(
    ax: Axes,
    bars: Sequence[tuple[str, str, float | None, bool]],
    palette: Mapping[str, str],
    level: float | None = None,
) -> list[Artist]:
    """Draw bars in groups with their numbers, and the line of a level; entries of the legend.

    Parameters
    ----------
    ax
        Where to draw.
    bars
        Names of the group and of the bar in it, the value (None without a plan), and whether the
        plan can be flown.
    palette
        Colours by the bars' names, in the order in which they stand side by side.
    level
        A value that is marked; None for none.
    """
    groups = list(dict.fromkeys(group for group, *_ in bars))
    used = [name for name in palette if any(each[1] == name for each in bars)]
    floor, width = level or 0.0, GROUP / max(2, len(used))
    known = [value for _, _, value, _ in bars if value is not None]
    low, high = style.margins([0.0, floor, *known], 0.14)
    ax.set_ylim(low if min(known, default=0.0) < 0.0 else 0.0, high)
    for group, name, value, flyable in bars:
        middle = used.index(name) - 0.5 * (len(used) - 1)
        at, end = groups.index(group) + width * middle, value or 0.0
        (bar,) = ax.bar(at, end, 0.92 * width, color=palette[name])
        if not flyable:
            bar.set(hatch=HATCH, edgecolor="white", linewidth=0.0)
        words = f"{end:.{1 if abs(end) < LONG else 0}f}"
        if value is None:  # on two lines, as bars are narrow, and above the line of the level
            words, end = "no\nplan", max(floor, 0.0)
        ax.annotate(
            style.minus(words),
            (at, end),
            (0.0, 2.0 if end >= 0.0 else -2.0),
            textcoords="offset points",
            ha="center",
            va="bottom" if end >= 0.0 else "top",
            fontsize=7.0,
        )
    style.group_thousands(ax)
    ax.set_xticks(range(len(groups)), groups)
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.tick_params(axis="x", length=0.0)
    handles: list[Artist] = [
        Patch(color=palette[name], label=style.WORDS.get(name, name)) for name in used
    ]
    if level is not None:
        handles.append(ax.axhline(level, color=VERMILLION, linewidth=1.0, label="least, $η_0$"))
    if not all(flyable for *_, flyable in bars):
        handles.append(_cannot_be_flown())
    return handles


def _cannot_be_flown() -> Patch:
    """The entry of a legend that explains hatched bars."""
    return Patch(fc=GREY, ec="white", hatch=HATCH, linewidth=0.0, label="cannot be flown")


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

    Examples
    --------
    >>> import optuav
    >>> gap = optuav.plots.Gap("P1", 5.0, 1.5, 10.0)
    >>> optuav.plots.slot_gaps([gap], "paper").get_ylabel()
    'hover time Δ lost to slots [slots]'
    """
    slots_s = sorted({each.slot_s for each in shown})
    bounds = sorted({round(each.largest_s / each.slot_s) for each in shown if each.largest_s})
    lost = [each.gap_s / each.slot_s for each in shown]
    with style.applied():
        ax = ax or style.page(4.0).subplots()
        limits = style.margins([*bounds, *lost, 0.0], 0.06)
        ax.set(xlim=(-0.5, len(slots_s) - 0.5), ylim=limits)
        ax.set(xlabel="length of a slot", ylabel="hover time Δ lost to slots [slots]")
        ax.set_title(f"{style.printed(mission)}: what whole slots cost", pad=style.LEGEND_PT)
        ax.axhline(0.0, color=BLACK, linewidth=0.5)
        for slots in bounds:
            ax.axhline(slots, color=VERMILLION, linewidth=1.1, zorder=2)
        for number, (kind, (marker, colour)) in enumerate(PROGRAMMES.items()):
            own = [each for each in shown if each.kind == kind]
            shift = BESIDE * (number - 0.5 * (len(PROGRAMMES) - 1))
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
        levels = [(slots, BOUNDS.get(slots, "bound")) for slots in bounds]
        style.name_levels(ax, levels, VERMILLION)
        style.legend_above(ax, len(PROGRAMMES))
        settle(ax)
    return ax
