"""The wells of the battery over plans: pooled as bands, or pack by pack where packs take turns."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, compress

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.judge.replay import Replay, replay
from optuav.looks import PHASES
from optuav.network.timeline import carry
from optuav.physics.packs import NOBODY
from optuav.plan import Plan, Plans, load_plans
from optuav.plan.display import (
    AVAILABLE,
    BOUND,
    EXCESS,
    LACKING,
    low_landings,
    reserve_from_s,
)
from optuav.plan.trace import Trace
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, DARK, PINK, SKY, mark
from optuav.presentation.numbers import figure, seconds

FADED = 0.6  # Share of white over everything after the battery runs dry
FILLS, FADE = 1.5, 2.0  # Heights of layers, above the bands of the phases
HATCH = "//////"
MOST_ENTRIES = 7  # Largest number of entries side by side in a legend
SHORT = 0.02  # Share of the axis by which a mission ends before it, for a word beside its line
CLOSE_LEVELS = 0.05  # Share of the axis between two levels of charge that share a line of words
COLOURS = (BLUE, PINK, SKY, DARK)  # Colours of the packs by number, repeated
FLIES, CHARGED = (-24.0, 12.0), (-38.0, 12.0)
"""Lower edge and height of the strips that show which pack flies and which is charged [%]."""


@style.applied()
def wells(plans: Plans, *, figure: style.AnyFigure | None = None) -> Sequence[Axes]:
    """Draw both wells of the pooled battery as bands over time, one panel per plan.

    The available well lies on the bound one, so that it runs dry where its band closes; charge the
    plan takes after that is hatched, and all that follows fades, as it cannot be flown. Charge that
    the full well does not take is hatched as well. The line of the reserve spans the mission where
    it holds at every landing, and stands at its end where it holds only there; landings below it
    are marked.

    Parameters
    ----------
    plans
        One or several, or the paths of their files; usually of one mission by perspective.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with charge in A s over time in s.

    Raises
    ------
    InputError
        Without a plan to draw.
    NoPlanError
        If one of the plans does not exist.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3", perspective="battery")
    >>> (ax,) = optuav.plots.wells([plan])
    >>> ax.get_title(loc="left")
    'paper: hover $Δ$ = 688.85 s, cannot be flown, perspective battery'
    """
    plans = load_plans(plans)
    axes = _panels(plans, 2.0, figure)
    replays = [replay(plan) for plan in plans]
    for ax, plan, replayed in zip(axes, plans, replays, strict=True):
        drawn = draw_wells(ax, replayed)
        words = [f"hover $Δ$ = {seconds(plan.hover_time_s)}"]
        words += [f"rest $T'$ = {seconds(plan.rest_time_s)}"] * (plan.rest_time_s > 0.0)
        words += ["cannot be flown"] * (not replayed.flyable)
        words.append(style.perspective(plan.perspective))
        ax.set_title(style.titled(plan.mission.name, *words), pad=style.NAMES_PT)
    style.group_thousands(*axes)
    ends = [plan.runs_dry_s for plan in plans], [plan.overfull_s for plan in plans]
    hatched = [any(moment_s is not None for moment_s in moments) for moments in ends]
    _legend_below(axes, [*drawn[:-2], *compress(drawn[-2:], hatched)], plans)
    for ax, replayed in zip(axes, replays, strict=True):
        style.draw_bands([ax], style.phase_bands(replayed))
    for ax, plan, replayed in zip(axes, plans, replays, strict=True):
        time_s, total_As = replayed.trace.time_s, _total_As(replayed.trace)
        under = [np.stack([time_s, share * total_As], axis=1) for share in np.linspace(0, 1, 9)]
        events = list[tuple[str, float, float, str]]()
        if (full_s := plan.overfull_s) is not None:
            level_As = float(np.interp(full_s, time_s, total_As))
            events.append(
                (f"driven past full at {seconds(full_s, 1)}", full_s, level_As, "overfull")
            )
        if (dry_s := plan.runs_dry_s) is not None:
            ax.axvline(dry_s, **style.limit("dry", cased=True), zorder=FADE + 0.2)
            under.append(np.array([(dry_s, end) for end in ax.get_ylim()]))
            ax.axvspan(dry_s, time_s[-1], color="white", alpha=FADED, linewidth=0.0, zorder=FADE)
            level_As = float(np.interp(dry_s, time_s, total_As))
            left = style.grouped(round(level_As))
            events.append(
                (f"dry at {seconds(dry_s, 1)}\n{left} A s still bound", dry_s, level_As, "dry")
            )
        events += [
            (landing.words, landing.time_s, landing.charge_As, "dry")
            for landing in low_landings(plan)
            if dry_s is None or landing.time_s < dry_s
        ]
        ceiling = [(time_s[end], total_As[0]) for end in (0, -1)]
        mark(ax, events, under, [ceiling])
    return axes


def _total_As(trace: Trace) -> Floats:
    """Charge in both wells of all packs over time [A s]."""
    return np.asarray((trace.available_As + trace.bound_As).sum(axis=1))


def draw_wells(ax: Axes, replayed: Replay) -> list[Artist]:
    """Draw the wells as bands, the available one on top, with levels; entries of the legend."""
    trace, mission = replayed.trace, replayed.mission
    time_s, bound_As, total_As = trace.time_s, trace.bound_As.sum(axis=1), _total_As(trace)
    top_As, there_As = np.maximum(total_As, bound_As), np.minimum(total_As, bound_As)
    flat: style.Look = {"linewidth": 0.0, "zorder": FILLS}
    bound = ax.fill_between(time_s, 0.0, bound_As, color=BOUND, **flat)
    bound.set_label("bound $y_2$")
    above = ax.fill_between(time_s, bound_As, top_As, color=AVAILABLE, **flat)
    above.set_label("available $y_1$")
    lost = ax.fill_between(time_s, there_As, bound_As, facecolor="none", zorder=FADE + 0.1)
    lost.set(edgecolor=LACKING, hatch=HATCH, linewidth=0.0, label="not there")
    full = mission.pool.full
    excess_As = np.maximum(total_As - bound_As - full.available_As, 0.0)
    over = ax.fill_between(time_s, total_As - excess_As, total_As, facecolor="white", **flat)
    over.set(edgecolor=EXCESS, hatch=HATCH, label="past full")
    (line,) = ax.plot(time_s, total_As, color=BLACK, linewidth=0.9, zorder=FADE + 0.2)
    line.set_label("total $y_1 + y_2$")
    full_As, end_s = float(full.total_As), float(time_s[-1])
    least_As = mission.limits.min_soc * full_As
    ax.axhline(full_As, **style.limit("overfull", cased=True))
    holds = [reserve_from_s(mission, end_s), end_s]
    ax.plot(holds, [least_As, least_As], **style.limit("charge", cased=True))
    low, (_, high) = min(0.0, *total_As), style.margins([0.0, *total_As, full_As], 0.16, 0.0)
    ax.set(ylim=(low, high), ylabel="charge [A s]")
    least, (_, right_s) = "to be kept: $η_0 B$", ax.get_xlim()
    levels = {least_As: least, full_As: "full: $B$"}
    if end_s < (1.0 - SHORT) * right_s:  # Beside the line, which ends with the mission
        del levels[least_As]
        beside: style.Look = {"xytext": (3.0, 0.0), "textcoords": "offset points", "va": "center"}
        ax.annotate(least, (end_s, least_As), **beside)
    elif full_As - least_As < CLOSE_LEVELS * (high - low):
        levels = {least_As: ", ".join(levels.values())}
    side = ax.secondary_yaxis("right")
    side.set_yticks([*levels], [*levels.values()])
    side.tick_params(length=0.0)
    side.spines["right"].set_visible(False)
    return [line, above, bound, lost, over]


def _panels(
    plans: Sequence[Plan], height_in: float, figure: style.AnyFigure | None
) -> Sequence[Axes]:
    """Axes of a height [inch] for each plan, over the time of the longest."""
    page = figure or style.page(0.7 + height_in * len(plans))
    grid = page.subplots(len(plans), 1, sharex=True, squeeze=False)
    end_s = max(plan.mission_time_s for plan in plans)
    grid[-1, 0].set(xlim=(0.0, end_s or 1.0), xlabel=style.TIME)
    return style.Panels(grid[:, 0])


def _legend_below(axes: Sequence[Axes], handles: Sequence[Artist], plans: Sequence[Plan]) -> None:
    """Put a legend below all panels, of drawn elements and the kinds of phases; settle them."""
    entries = [*handles, *style.swatches(phase.kind for plan in plans for phase in plan.phases)]
    columns = math.ceil(len(entries) / math.ceil(len(entries) / MOST_ENTRIES))
    page = axes[0].get_figure()
    assert page is not None
    page.legend(handles=entries, loc="outside lower center", ncols=columns)
    style.settle(axes[0])


@style.applied()
def packs(plans: Plans, *, figure: style.AnyFigure | None = None) -> Sequence[Axes]:
    """Draw the available wells of all packs over time, one panel per plan.

    Levels are shares of a full available well, so that pooled packs stand beside single ones; the
    bound wells are thin lines. Strips below show which pack flies, and which the laser charges; a
    dot marks a pack that is empty and taken out of service.

    Parameters
    ----------
    plans
        One or several, or the paths of their files; usually of one mission by schedule.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with levels in % over time in s.

    Raises
    ------
    InputError
        Without a plan to draw.
    NoPlanError
        If one of the plans does not exist.

    Examples
    --------
    >>> import optuav
    >>> mission = optuav.load("paper").replace({"battery.schedule": "sequential"})
    >>> (ax,) = optuav.plots.packs([optuav.solve(mission, "P3", slot_s=50.0)])
    >>> ax.get_title(loc="left")
    'paper: schedule sequential, hover $Δ$ = 500.00 s'
    """
    plans = load_plans(plans)
    axes = _panels(plans, 1.35, figure)
    for ax, plan in zip(axes, plans, strict=True):
        _draw_packs(ax, plan)
        ax.tick_params(bottom=ax is axes[-1])
    most = max(len(plan.phases[0].available_As) for plan in plans)
    lines = [style.entry(f"pack {pack + 1}", _colour(pack)) for pack in range(most)]
    _legend_below(axes, [*lines, style.entry("bound well $y_2/(1-ω)B$", BLACK, 0.5)], plans)
    return axes


def _draw_packs(ax: Axes, plan: Plan) -> None:
    """Draw the packs of a plan over its phases."""
    pool, replayed = plan.mission.pool, replay(plan)
    trace = replayed.trace
    for phase in plan.phases:
        ax.axvspan(phase.start_s, phase.end_s, color=PHASES[phase.kind], alpha=0.13, linewidth=0.0)
    size_As = pool.capacity_As / trace.available_As.shape[1]
    full = replace(pool, capacity_As=size_As).full  # Of each line
    columns = (trace.available_As, full.available_As, 1.4), (trace.bound_As, full.bound_As, 0.5)
    for levels_As, full_As, width in columns:
        for number, percent in enumerate((100.0 * levels_As / full_As).T):
            ax.plot(trace.time_s, percent, color=_colour(number), linewidth=width)
    for stretch in chain.from_iterable(carry(plan.mission, plan.phases).stretches):
        times_s = [(float(stretch.start_s[0]), float(stretch.duration_s[0]))]
        carrier, served = int(stretch.carrier[0]), int(stretch.served[0])
        if stretch.emptied[0]:
            dot: style.Look = {"markersize": 4.0, "clip_on": False, "zorder": 5}
            ax.plot(sum(times_s[0]), 0.0, "o", color=_colour(carrier), **dot)
        if carrier != NOBODY:
            ax.broken_barh(times_s, FLIES, color=_colour(carrier), linewidth=0.0)
        if served != NOBODY and stretch.currents_A[0, served] > 1e-9:
            ax.broken_barh(times_s, CHARGED, color=_colour(served), linewidth=0.0)
    ax.axhline(0.0, color=BLACK, linewidth=0.6)
    ax.set(ylim=(CHARGED[0] - 2.0, 106.0), yticks=(0, 50, 100), ylabel="$y_1/ωB$ [%]")
    beside: style.Look = {"transform": ax.get_yaxis_transform(), "ha": "right", "va": "center"}
    for (low, height), words in ((FLIES, "flies"), (CHARGED, "charged")):
        ax.text(-0.008, low + 0.5 * height, words, fontsize=6.0, **beside)
    battery = plan.mission.battery
    turn = f" every {figure(battery.period_s)} s" if battery.period_s else ""
    heading = [f"schedule {battery.schedule}{turn}", f"hover $Δ$ = {seconds(plan.hover_time_s)}"]
    heading += ["cannot be flown"] * (not replayed.flyable)
    ax.set_title(style.titled(plan.mission.name, *heading))


def _colour(number: int) -> str:
    """The colour of a pack."""
    return COLOURS[number % len(COLOURS)]
