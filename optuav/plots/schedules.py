"""Packs by schedule: the wells of every pack, and which pack flies and is charged, over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from optuav.network.timeline import carry, full_packs
from optuav.physics.kibam import Battery, Stage, Wells, step
from optuav.physics.packs import NOBODY, Stretch
from optuav.plan import Plan
from optuav.plots import style
from optuav.plots.bands import legend_below, panels

COLOURS = (style.BLUE, style.VERMILLION, style.PURPLE, style.SKY)
"""Colours of the packs by number, repeated."""
POINTS = 33
"""Points of a curve within a stretch."""
FLIES, CHARGED = (-24.0, -12.0), (-38.0, -26.0)
"""Where the strips lie that show which pack flies and which is charged [%]."""


@style.applied()
def packs(plans: Sequence[Plan]) -> Sequence[Axes]:
    """Draw the available wells of all packs over time, one panel a plan.

    Levels are shares of a full available well, so that pooled packs stand beside single ones; the
    bound wells are thin lines. Strips below show which pack flies, and which the laser charges; a
    dot marks a pack that is empty and taken out of service.

    Parameters
    ----------
    plans
        Plans that exist, usually of one mission under several schedules.

    Returns
    -------
    The axes, with levels in % over time in s.

    Raises
    ------
    InputError
        If there is no plan to draw.
    NoPlanError
        If one of the plans does not exist.

    Examples
    --------
    >>> import optuav
    >>> mission = optuav.load("paper").replace({"battery.schedule": "sequential"})
    >>> (ax,) = optuav.plots.packs([optuav.solve(mission, "P3", slot_s=50.0)])
    >>> ax.get_title(loc="left")
    'sequential: hovers $Δ$ = 500.00 s'
    """
    axes = panels(plans, 1.35)
    for ax, plan in zip(axes, plans, strict=True):
        _draw_panel(ax, plan)
    for ax in axes[:-1]:
        ax.tick_params(bottom=False)
    most = max(len(plan.phases[0].available_As) for plan in plans)
    lines = [style.entry(f"pack {pack + 1}", _colour(pack)) for pack in range(most)]
    bound = style.entry("bound well $y_2/(1-ω)B$", style.BLACK, 0.5)
    legend_below(axes[-1], [*lines, bound], plans)
    style.settle(axes[0])
    return axes


def _draw_panel(ax: Axes, plan: Plan) -> None:
    given, carried = plan.mission.battery, full_packs(plan.mission)
    for phase in plan.phases:
        colour = style.KINDS[phase.kind]
        ax.axvspan(phase.start_s, phase.end_s, color=colour, alpha=0.13, linewidth=0.0)
    wells = Wells(*(np.full(carried.count, float(well)) for well in carried.pack.full))
    by_phase = carry(plan.mission, plan.phases).stretches
    for stretch in (each for stretches in by_phase for each in stretches):
        _draw_curves(ax, carried.pack, wells, stretch)
        _draw_strips(ax, stretch)
        wells = Wells(*(well[0] for well in stretch.wells))
    ax.axhline(0.0, color="black", linewidth=0.6)
    ax.set(ylim=(CHARGED[0] - 2.0, 106.0), yticks=(0, 50, 100), ylabel="$y_1/ωB$ [%]")
    beside = {"transform": ax.get_yaxis_transform(), "ha": "right", "va": "center"}
    for (low, high), words in ((FLIES, "flies"), (CHARGED, "charged")):
        ax.text(-0.008, 0.5 * (low + high), words, fontsize=6.0, **beside)  # type: ignore[arg-type]
    turn = f", every {given.period_s:g} s" if given.period_s else ""
    ax.set_title(f"{given.schedule}{turn}: hovers $Δ$ = {plan.hover_time_s:.2f} s")


def _draw_curves(ax: Axes, pack: Battery, wells: Wells, stretch: Stretch) -> None:
    """Draw both wells of every pack within a stretch; straight where a full pack is kept full."""
    passed_s = np.linspace(0.0, float(stretch.duration_s[0]), POINTS)
    time_s, full = float(stretch.start_s[0]) + passed_s, pack.full
    for number, current_A in enumerate(stretch.currents_A[0]):
        start = Wells(*(well[number] for well in wells))
        lived = step(pack, start, Stage(current_A, passed_s))
        colour = _colour(number)
        ax.plot(time_s, 100.0 * lived.available_As / full.available_As, color=colour)
        ax.plot(time_s, 100.0 * lived.bound_As / full.bound_As, color=colour, linewidth=0.5)
    if stretch.emptied[0]:
        colour = _colour(int(stretch.carrier[0]))
        ax.plot(time_s[-1], 0.0, "o", color=colour, markersize=4.0, clip_on=False, zorder=5)


def _draw_strips(ax: Axes, stretch: Stretch) -> None:
    """Draw which pack flies and which is charged; one that takes no charge is not."""
    start_s, duration_s = float(stretch.start_s[0]), float(stretch.duration_s[0])
    for number, (low, high) in ((stretch.carrier[0], FLIES), (stretch.served[0], CHARGED)):
        charged = (low, high) == CHARGED
        if number == NOBODY or (charged and not stretch.currents_A[0, number] > 1e-9):
            continue
        colour = _colour(int(number))
        ax.broken_barh([(start_s, duration_s)], (low, high - low), color=colour, linewidth=0.0)


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)]
