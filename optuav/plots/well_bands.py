"""The wells of the battery over several plans: what each counts on, and where it runs dry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from optuav.mission import Mission
from optuav.network import vehicle
from optuav.plan import Plan
from optuav.plots.bands import NAMES_PT, draw_bands
from optuav.plots.charge import Course, course, phase_band
from optuav.plots.labels import Label, place, settle
from optuav.plots.panels import legend_below, panels
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    VERMILLION,
    group_thousands,
    margins,
    printed,
    styled,
)

FADED = 0.6
"""How far what follows on a moment at which the battery is empty fades to white."""
FILLS, FADE = 1.5, 2.0
"""Heights of layers, above the bands of the phases."""
HATCH = "//////"


def wells(plans: Sequence[Plan], axes: Sequence[Axes] | None = None) -> Sequence[Axes]:
    """Draw both wells of the pooled battery as bands over time, a panel a plan.

    The available well lies on the bound one, so that it runs dry where its band closes; what the
    plan takes after that is hatched, and all of it fades, as nothing can be flown there.

    Parameters
    ----------
    plans
        Plans that exist, usually of one mission in several perspectives.
    axes
        Where to draw, as many as there are plans; on a page of their own by default.

    Raises
    ------
    InputError
        If there is no plan to draw, or as many axes are not given.
    NoPlanError
        If one of the plans does not exist.
    """
    with styled():
        axes = panels(plans, axes, 2.0)
        lived = [course(vehicle.pool(plan.mission), plan) for plan in plans]
        for ax, plan, each in zip(axes, plans, lived, strict=True):
            draw_wells(ax, plan.mission, each)
            ax.set_title(_title(plan), pad=NAMES_PT)
        group_thousands(*axes)
        legend_below(axes[-1], _entries(), plans)
        settle(axes[0])
        for ax, plan, each in zip(axes, plans, lived, strict=True):
            draw_bands([ax], [phase_band(each) for each in plan.phases if each.duration_s > 0.0])
            _mark_moments(ax, plan, each)
    return axes


def draw_wells(ax: Axes, mission: Mission, lived: Course) -> None:
    """Draw both wells as bands, the available one on the bound one, with the levels of charge."""
    pool = vehicle.pool(mission)
    time_s, bound_As = lived.time_s, lived.bound_As
    total_As = lived.available_As + bound_As
    solid: dict[str, Any] = {"linewidth": 0.0, "zorder": FILLS}
    ax.fill_between(time_s, 0.0, bound_As, color=SKY, **solid)
    ax.fill_between(time_s, bound_As, np.maximum(total_As, bound_As), color=BLUE, **solid)
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
    levels = (
        (pool.capacity_As, "full: $B$"),
        (mission.limits.min_soc * pool.capacity_As, "to be kept: $η_0 B$"),
    )
    for level_As, _ in levels:
        ax.axhline(level_As, color=GREY, linewidth=0.8, linestyle=(0.0, (4.0, 2.0)))
    side = ax.secondary_yaxis("right")
    side.set_yticks([level for level, _ in levels], [words for _, words in levels])
    side.tick_params(length=0.0)
    side.spines["right"].set_visible(False)
    _, high = margins([0.0, *total_As, pool.capacity_As], 0.16, 0.0)
    ax.set(ylim=(min(0.0, *total_As), high), ylabel="charge [A s]")


def _title(plan: Plan) -> str:
    times = f"hover $Δ$ = {plan.hover_time_s:.2f} s"
    if plan.rest_time_s > 0.0:
        times += f", rest $T'$ = {plan.rest_time_s:.2f} s"
    words = f"{printed(plan.mission.name)}, perspective {plan.perspective}: {times}"
    return words if plan.runs_dry_s is None else f"{words}, cannot be flown"


def _mark_moments(ax: Axes, plan: Plan, lived: Course) -> None:
    """Mark when the available well is driven past full and runs dry; fade what follows on that."""
    total_As = lived.available_As + lived.bound_As
    marks = []
    for words, moment_s in (("driven past full", plan.overfull_s), ("dry", plan.runs_dry_s)):
        if moment_s is None:
            continue
        level_As = float(np.interp(moment_s, lived.time_s, total_As))
        text = f"{words} at {moment_s:.1f} s"
        if words == "dry":
            left = f"{level_As:,.0f}".replace(",", "\N{THIN SPACE}")
            text += f"\n{left} A s still bound"
            ax.axvline(moment_s, color=VERMILLION, linewidth=0.9, zorder=FADE + 0.2)
            faded: dict[str, Any] = {
                "color": "white",
                "alpha": FADED,
                "linewidth": 0.0,
                "zorder": FADE,
            }
            ax.axvspan(moment_s, lived.time_s[-1], **faded)
        marks.append(Label(text, (moment_s, level_As), style={"color": VERMILLION}))
        ax.plot(moment_s, level_As, "o", color=VERMILLION, markersize=4.5, zorder=5)
    shares = np.linspace(0.0, 1.0, 9)
    under = [np.stack([lived.time_s, share * total_As], axis=1) for share in shares]
    place(ax, marks, under, [[(0.0, total_As[0]), (lived.time_s[-1], total_As[0])]])


def _entries() -> list[Artist]:
    """What the legend says of the wells."""
    return [
        Line2D([], [], color=BLACK, linewidth=0.9, label="total $y_1 + y_2$"),
        Patch(color=BLUE, linewidth=0.0, label="available $y_1$"),
        Patch(color=SKY, linewidth=0.0, label="bound $y_2$"),
        Patch(
            facecolor="none", edgecolor=VERMILLION, hatch=HATCH, linewidth=0.0, label="not there"
        ),
    ]
