"""The wells of the battery over plans, as curves and as bands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.physics.charging import STEPS
from optuav.physics.kibam import Battery, Stage, Wells
from optuav.plan import Plan
from optuav.plots import style
from optuav.plots.bands import (
    NAMES_PT,
    draw_bands,
    finish,
    legend_below,
    panels,
    plan_bands,
    swatches,
)
from optuav.plots.labels import mark
from optuav.plots.style import BLACK, BLUE, GREY, SKY, VERMILLION

POINTS_PER_STAGE = 65
FADED = 0.6
"""Share of white over what follows the moment at which the battery is empty."""
FILLS, FADE = 1.5, 2.0
"""Heights of layers, above the bands of the phases."""
HATCH = "//////"


class BatteryAxes(NamedTuple):
    """Charge in the wells and current, both over time."""

    wells: Axes
    current: Axes


class Course(NamedTuple):
    """Charge in the wells over time: arrays of one length [s], [A s]."""

    time_s: Floats
    available_As: Floats
    bound_As: Floats

    @property
    def total_As(self) -> Floats:
        """Charge in both wells [A s]."""
        return self.available_As + self.bound_As


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


@style.applied()
def battery(plan: Plan) -> BatteryAxes:
    """Draw the charge in both wells of the pooled battery and the current, over time.

    The wells follow the kinetic battery model (KiBaM) through every stage of constant current.
    Levels of the full and the empty wells are marked, and the moments at which the available well
    runs dry or is driven past full.

    Parameters
    ----------
    plan
        A plan that exists.

    Returns
    -------
    The axes, with charge in A s and current in A over time in s.

    Raises
    ------
    NoPlanError
        If there is no plan.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3")
    >>> optuav.plots.battery(plan).current.get_xlabel()
    'time since take-off $t$ [s]'
    """
    end_s = plan.mission_time_s
    grid = style.page(4.6).subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    axes = BatteryAxes(*grid)
    pool = vehicle.pool(plan.mission)
    lived = course(pool, plan)
    _draw_curves(axes.wells, pool, lived)
    _draw_current(axes.current, lived)
    left = 100.0 * lived.total_As[-1] / pool.capacity_As
    heading = f"{style.printed(plan.mission.name)}: battery, $η_1$ = {left:.1f} % at the end"
    axes.wells.set_title(heading, pad=NAMES_PT)
    entries = [
        style.entry("total $y_1 + y_2$", BLACK, 0.8),
        style.entry("available well $y_1$", BLUE),
        style.entry("bound well $y_2$", SKY),
        *swatches(phase.kind for phase in plan.phases),
    ]
    finish(axes, end_s, plan_bands(plan), entries, 0.36)
    end = (float(lived.time_s[-1]), float(lived.total_As[-1]))
    axes.wells.plot(*end, "o", color=BLACK, markersize=3.0, clip_on=False, zorder=5)
    heights = {"runs dry": 0.0, "driven past full": float(pool.full.available_As)}
    events = [
        (f"{words} at {moment_s:.1f} s", moment_s, heights[words])
        for words, moment_s in _moments(plan)
    ]
    curves = [np.stack([lived.time_s, y], axis=1) for y in (*lived[1:], lived.total_As)]
    levels = [[(0.0, y), (end_s, y)] for y in (0.0, *pool.full)]
    mark(axes.wells, events, curves, levels)
    return axes


def _moments(plan: Plan) -> Iterator[tuple[str, float]]:
    """The moments at which the available well is driven past full and runs dry."""
    for words, moment_s in (("driven past full", plan.overfull_s), ("runs dry", plan.runs_dry_s)):
        if moment_s is not None:
            yield words, moment_s


def _draw_curves(ax: Axes, pool: Battery, lived: Course) -> None:
    time_s, available_As, bound_As = lived
    levels_As = [0.0, *available_As, *lived.total_As, pool.capacity_As]
    low, high = style.margins(levels_As, 0.06, 0)
    ax.axhspan(low, 0.0, facecolor="none", hatch="////", edgecolor=f"{VERMILLION}80", linewidth=0.0)
    ax.axhline(0.0, color=VERMILLION, linewidth=0.9)
    for level_As, colour in zip(pool.full, (BLUE, SKY), strict=True):
        ax.axhline(level_As, color=colour, linewidth=0.8, linestyle=style.DASHED)
    ax.plot(time_s, lived.total_As, color=BLACK, linewidth=0.8)
    ax.plot(time_s, available_As, color=BLUE)
    ax.plot(time_s, bound_As, color=SKY)
    ax.set(ylim=(low, high), ylabel="charge in the wells [A s]")
    names = "$y_1$ empty", "$y_1$ full: $ωB$", "$y_2$ full: $(1-ω)B$"
    style.name_levels(ax, zip((0.0, *map(float, pool.full)), names, strict=True))


def _draw_current(ax: Axes, lived: Course) -> None:
    """Draw the current as the slope of the charge, as charging may taper."""
    later = np.flatnonzero(np.diff(lived.time_s, prepend=-1.0) > 0.0)
    edges, total_As = lived.time_s[later], lived.total_As[later]
    currents = np.diff(total_As) / np.diff(edges)
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.stairs(currents, edges, color=BLACK, baseline=None, linewidth=1.1)
    ax.set(ylim=style.margins([0.0, *currents], 0.12), ylabel="current into\nthe battery $I$ [A]")


@style.applied()
def wells(plans: Sequence[Plan]) -> Sequence[Axes]:
    """Draw both wells of the pooled battery as bands over time, one panel a plan.

    The available well lies on the bound one, so that it runs dry where its band closes; what the
    plan takes after that is hatched, and all that follows fades, as it cannot be flown.

    Parameters
    ----------
    plans
        Plans that exist, usually of one mission in several perspectives.

    Returns
    -------
    The axes, with charge in A s over time in s.

    Raises
    ------
    InputError
        If there is no plan to draw.
    NoPlanError
        If one of the plans does not exist.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3", perspective="battery")
    >>> (ax,) = optuav.plots.wells([plan])
    >>> ax.get_title(loc="left")
    'paper, perspective battery: hover $Δ$ = 688.85 s, cannot be flown'
    """
    axes = panels(plans, 2.0)
    courses = [course(vehicle.pool(plan.mission), plan) for plan in plans]
    for ax, plan, lived in zip(axes, plans, courses, strict=True):
        draw_wells(ax, plan.mission, lived)
        ax.set_title(_title(plan), pad=NAMES_PT)
    style.group_thousands(*axes)
    entries = [
        style.entry("total $y_1 + y_2$", BLACK, 0.9),
        Patch(color=BLUE, linewidth=0.0, label="available $y_1$"),
        Patch(color=SKY, linewidth=0.0, label="bound $y_2$"),
        Patch(fc="none", ec=VERMILLION, hatch=HATCH, linewidth=0.0, label="not there"),
    ]
    legend_below(axes[-1], entries, plans)
    style.settle(axes[0])
    for ax, plan, lived in zip(axes, plans, courses, strict=True):
        draw_bands([ax], plan_bands(plan))
        if plan.runs_dry_s is not None:
            ax.axvline(plan.runs_dry_s, color=VERMILLION, linewidth=0.9, zorder=FADE + 0.2)
            rest = (plan.runs_dry_s, lived.time_s[-1])
            ax.axvspan(*rest, color="white", alpha=FADED, linewidth=0.0, zorder=FADE)
        shares = np.linspace(0.0, 1.0, 9)
        under = [np.stack([lived.time_s, share * lived.total_As], axis=1) for share in shares]
        ceiling = [(lived.time_s[end], lived.total_As[0]) for end in (0, -1)]
        mark(ax, _events(plan, lived), under, [ceiling])
    return axes


def draw_wells(ax: Axes, mission: Mission, lived: Course) -> None:
    """Draw both wells as bands, the available one on the bound one, with the levels of charge."""
    pool = vehicle.pool(mission)
    time_s, bound_As, total_As = lived.time_s, lived.bound_As, lived.total_As
    ax.fill_between(time_s, 0.0, bound_As, color=SKY, linewidth=0.0, zorder=FILLS)
    top_As = np.maximum(total_As, bound_As)
    ax.fill_between(time_s, bound_As, top_As, color=BLUE, linewidth=0.0, zorder=FILLS)
    ax.fill_between(
        time_s,
        np.minimum(total_As, bound_As),
        bound_As,
        facecolor="none",
        edgecolor=VERMILLION,
        hatch=HATCH,
        linewidth=0.0,
        zorder=FADE + 0.1,
    )
    ax.plot(time_s, total_As, color=BLACK, linewidth=0.9, zorder=FADE + 0.2)
    least_As = mission.limits.min_soc * pool.capacity_As
    for level_As in (pool.capacity_As, least_As):
        ax.axhline(level_As, color=GREY, linewidth=0.8, linestyle=style.DASHED)
    _, high = style.margins([0.0, *total_As, pool.capacity_As], 0.16, 0.0)
    ax.set(ylim=(min(0.0, *total_As), high), ylabel="charge [A s]")
    style.name_levels(ax, [(pool.capacity_As, "full: $B$"), (least_As, "to be kept: $η_0 B$")])


def _title(plan: Plan) -> str:
    times = f"hover $Δ$ = {plan.hover_time_s:.2f} s"
    if plan.rest_time_s > 0.0:
        times += f", rest $T'$ = {plan.rest_time_s:.2f} s"
    words = f"{style.printed(plan.mission.name)}, perspective {plan.perspective}: {times}"
    return words if plan.runs_dry_s is None else f"{words}, cannot be flown"


def _events(plan: Plan, lived: Course) -> Iterator[tuple[str, float, float]]:
    """The moments of `_moments`, with words and on the curve of the total charge."""
    for words, moment_s in _moments(plan):
        level_As = float(np.interp(moment_s, lived.time_s, lived.total_As))
        text = f"{words.removeprefix('runs ')} at {moment_s:.1f} s"
        if words == "runs dry":
            left = f"{level_As:,.0f}".replace(",", "\N{THIN SPACE}")
            text += f"\n{left} A s still bound"
        yield text, moment_s, level_As
