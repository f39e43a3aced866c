"""The wells of the battery over plans."""

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
    legend_below,
    panels,
    plan_bands,
)
from optuav.plots.labels import mark
from optuav.plots.style import BLACK, BLUE, GREY, SKY, VERMILLION

POINTS_PER_STAGE = 65
FADED = 0.6
"""Share of white over what follows the moment at which the battery is empty."""
FILLS, FADE = 1.5, 2.0
"""Heights of layers, above the bands of the phases."""
HATCH = "//////"


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
    """The moments at which the available well is driven past full and runs dry."""
    for words, moment_s in (("driven past full", plan.overfull_s), ("dry", plan.runs_dry_s)):
        if moment_s is None:
            continue
        level_As = float(np.interp(moment_s, lived.time_s, lived.total_As))
        text = f"{words} at {moment_s:.1f} s"
        if words == "dry":
            left = f"{level_As:,.0f}".replace(",", "\N{THIN SPACE}")
            text += f"\n{left} A s still bound"
        yield text, moment_s, level_As
