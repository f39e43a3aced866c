"""The battery over a plan: both wells, and the current that fills or drains them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from optuav.arrays import Floats
from optuav.network import vehicle
from optuav.physics.charging import STEPS
from optuav.physics.kibam import Battery, Stage, Wells
from optuav.plan import Phase as Planned
from optuav.plan import Plan
from optuav.plots.bands import NAMES_PT, Band, draw_bands, swatch
from optuav.plots.labels import Label, place, settle
from optuav.plots.style import (
    BLACK,
    BLUE,
    KINDS,
    SKY,
    VERMILLION,
    group_thousands,
    margins,
    need_panels,
    page,
    printed,
    styled,
)

POINTS_PER_STAGE = 65


class BatteryAxes(NamedTuple):
    """Charge in the wells and current, both over time."""

    wells: Axes
    current: Axes


class Course(NamedTuple):
    """Charge in the wells over time: arrays of one length [s], [A s]."""

    time_s: Floats
    available_As: Floats
    bound_As: Floats


def battery(plan: Plan, axes: BatteryAxes | None = None) -> BatteryAxes:
    """Draw the charge in both wells of the pooled battery and the current, over time.

    The wells follow the kinetic battery model through every stage of constant current. Levels of
    the full and the empty wells are marked, and the moments at which the available well runs dry
    or is driven past full.

    Parameters
    ----------
    plan
        A plan that exists.
    axes
        Where to draw; on a page of its own by default.

    Raises
    ------
    NoPlanError
        If there is no plan.
    """
    end_s = plan.mission_time_s
    need_panels(axes, BatteryAxes)
    with styled():
        if axes is None:
            top, bottom = page(7.2, 4.6).subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
            axes = BatteryAxes(top, bottom)
        pool = vehicle.pool(plan.mission)
        lived = course(pool, plan)
        _draw_wells(axes.wells, pool, lived)
        _draw_current(axes.current, lived)
        for ax in axes:
            ax.set_xlim(0.0, end_s or 1.0)
        group_thousands(*axes)
        axes.current.set_xlabel("time since take-off $t$ [s]")
        left = 100.0 * (lived.available_As[-1] + lived.bound_As[-1]) / pool.capacity_As
        heading = f"{printed(plan.mission.name)}: battery, $η_1$ = {left:.1f} % at the end"
        axes.wells.set_title(heading, pad=NAMES_PT)
        _legend(axes, plan)
        settle(axes.wells)
        draw_bands(axes, [phase_band(phase) for phase in plan.phases if phase.duration_s > 0.0])
        _mark_moments(axes.wells, plan, pool, lived)
    return axes


def course(pool: Battery, plan: Plan) -> Course:
    """Charge in the wells over time, exact at every point, both ends of every stage included."""
    charged = STEPS[plan.mission.battery.charging]
    wells, start_s = pool.full, 0.0
    times, available, bound = [], [], []
    for stage in (stage for phase in plan.phases for stage in phase.stages):
        passed_s = np.linspace(0.0, stage.duration_s, POINTS_PER_STAGE)
        within = charged(pool, wells, Stage(stage.current_A, passed_s))
        times.append(start_s + passed_s)
        available.append(within.available_As)
        bound.append(within.bound_As)
        wells = Wells(float(within.available_As[-1]), float(within.bound_As[-1]))
        start_s += stage.duration_s
    return Course(*map(np.concatenate, (times, available, bound)))


def _draw_wells(ax: Axes, pool: Battery, lived: Course) -> None:
    time_s, available_As, bound_As = lived
    full = pool.full
    low, high = margins([0.0, *available_As, *(available_As + bound_As), pool.capacity_As], 0.06, 0)
    ax.axhspan(low, 0.0, facecolor="none", hatch="////", edgecolor=f"{VERMILLION}80", linewidth=0.0)
    ax.axhline(0.0, color=VERMILLION, linewidth=0.9)
    for level_As, colour in ((full.available_As, BLUE), (full.bound_As, SKY)):
        ax.axhline(level_As, color=colour, linewidth=0.8, linestyle=(0.0, (4.0, 2.0)))
    ax.plot(time_s, available_As + bound_As, color=BLACK, linewidth=0.8)
    ax.plot(time_s, available_As, color=BLUE)
    ax.plot(time_s, bound_As, color=SKY)
    ax.set(ylim=(low, high), ylabel="charge in the wells [A s]")
    levels = [
        (0.0, "$y_1$ empty"),
        (full.bound_As, "$y_2$ full: $(1-ω)B$"),
        (full.available_As, "$y_1$ full: $ωB$"),
    ]
    _right_ticks(ax, levels)


def _right_ticks(ax: Axes, levels: Sequence[tuple[float, str]]) -> None:
    """Name levels at the right side; those too close for two lines share one."""
    low, high = ax.get_ylim()
    groups: list[tuple[float, str]] = []
    for level, words in sorted(levels):
        if groups and level - groups[-1][0] < 0.05 * (high - low):
            groups[-1] = (groups[-1][0], f"{groups[-1][1]}, {words}")
        else:
            groups.append((level, words))
    side = ax.secondary_yaxis("right")
    side.set_yticks([level for level, _ in groups], [words for _, words in groups])
    side.tick_params(length=0.0)
    side.spines["right"].set_visible(False)


def _draw_current(ax: Axes, lived: Course) -> None:
    """What the battery takes and gives, from what it holds: charging may taper."""
    moments = np.flatnonzero(np.diff(lived.time_s, prepend=-1.0) > 0.0)
    edges, total_As = lived.time_s[moments], (lived.available_As + lived.bound_As)[moments]
    currents = np.diff(total_As) / np.diff(edges)
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.stairs(currents, edges, color=BLACK, baseline=None, linewidth=1.1)
    ax.set(ylim=margins([0.0, *currents], 0.12), ylabel="current into\nthe battery $I$ [A]")


def _legend(axes: BatteryAxes, plan: Plan) -> None:
    lines = [
        Line2D([], [], color=BLACK, linewidth=0.8, label="total $y_1 + y_2$"),
        Line2D([], [], color=BLUE, label="available well $y_1$"),
        Line2D([], [], color=SKY, label="bound well $y_2$"),
    ]
    kinds = dict.fromkeys(phase.kind for phase in plan.phases)
    bands = [swatch(KINDS[kind], kind) for kind in kinds]
    axes.current.legend(
        handles=[*lines, *bands],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.36),
        ncols=6,
        columnspacing=1.4,
    )


def phase_band(phase: Planned) -> Band:
    """A phase as a band, with its name."""
    words = (f"rest, {printed(phase.end_place)}",) if phase.kind == "rest" else ()
    return Band(phase.start_s, phase.end_s, KINDS[phase.kind], (*words, phase.kind))


def _mark_moments(ax: Axes, plan: Plan, pool: Battery, lived: Course) -> None:
    """Mark when the available well runs dry or is driven past full."""
    marks = [
        Label(f"{words} at {moment_s:.1f} s", (moment_s, level_As), style={"color": VERMILLION})
        for words, moment_s, level_As in (
            ("runs dry", plan.runs_dry_s, 0.0),
            ("driven past full", plan.overfull_s, pool.full.available_As),
        )
        if moment_s is not None
    ]
    for mark in marks:
        ax.plot(*mark.at, "o", color=VERMILLION, markersize=4.5, clip_on=False, zorder=5)
    total_As = lived.available_As + lived.bound_As
    end = (float(lived.time_s[-1]), float(total_As[-1]))
    ax.plot(*end, "o", color=BLACK, markersize=3.0, clip_on=False, zorder=5)
    curves = [np.stack([lived.time_s, y], axis=1) for y in (*lived[1:], total_As)]
    levels = [[(0.0, y), (plan.mission_time_s, y)] for y in (0.0, *pool.full)]
    place(ax, marks, curves, levels)
