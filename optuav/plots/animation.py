"""A simulated plan in motion: the map, and the wells of the battery as they are emptied."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from optuav.plan.trace import Trace
from optuav.plots.bands import NAMES_PT, draw_bands, swatch
from optuav.plots.charge import Course
from optuav.plots.labels import Label, place, settle
from optuav.plots.moving import drawn
from optuav.plots.replayed import Replayed, trace_bands
from optuav.plots.scene import Scene, draw_plan_view, drawn_sight_lines, scene, scenery_labels
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREY,
    KINDS,
    ORANGE,
    SKY,
    VERMILLION,
    group_thousands,
    page,
    printed,
    styled,
)
from optuav.plots.ways import stop_look
from optuav.plots.well_bands import draw_wells

FRAMES, FRAMES_PER_S = 120, 10
"""Moments that are shown, evenly over the mission, and how many a second."""
HELD = 20
"""Frames for which the end is held."""
DOTS_PER_INCH = 100


def animate(replayed: Replayed) -> FuncAnimation:
    """Show a simulated plan in motion, in a quarter of a minute: map and wells together.

    On the map the UAV flies its way, and is joined to the laser while that delivers power; beside
    it the bands of the wells grow. From the first violated limit on, the UAV is red.

    Parameters
    ----------
    replayed
        From `optuav.replay`.

    Returns
    -------
    An animation on a page of its own, to be saved (`save_animation`) or shown in a notebook.

    Raises
    ------
    NoPlanError
        If nothing is flown.
    """
    end_s = float(replayed.trace.time_s[-1])
    with styled():
        still = _still(replayed)
        figure = page(*still.get_size_inches())
        figure.set_layout_engine("none")
        figure.set_dpi(DOTS_PER_INCH)
        figure.figimage(drawn(still), zorder=-1)  # what does not move is drawn once
        left, right = (_over(figure, ax) for ax in still.axes[:2])
        moving = _moving(left, right, replayed)
    moments_s = [*np.linspace(0.0, end_s, FRAMES).tolist(), *itertools.repeat(end_s, HELD)]
    return FuncAnimation(
        figure, moving, frames=moments_s, interval=1000.0 / FRAMES_PER_S, cache_frame_data=False
    )


def _over(figure: Figure, ax: Axes) -> Axes:
    """Axes that show nothing of themselves, where others lie in a figure of the same size."""
    over = figure.add_axes(ax.get_position().bounds)
    over.set(xlim=ax.get_xlim(), ylim=ax.get_ylim(), xticks=[], yticks=[])
    over.set_axis_off()
    return over


def _still(replayed: Replayed) -> Figure:
    """All that does not move: the map on the left, the wells over the mission on the right."""
    trace = replayed.trace
    figure = page(7.6, 3.8)
    figure.set_dpi(DOTS_PER_INCH)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.0))
    lived = Course(trace.time_s, trace.available_As.sum(axis=1), trace.bound_As.sum(axis=1))
    draw_wells(right, replayed.mission, lived)
    right.set(xlim=(0.0, trace.time_s[-1] or 1.0), xlabel="time since take-off $t$ [s]")
    right.set_title(" ", pad=NAMES_PT)
    left.set_title(" ")
    shown = scene(replayed.mission)
    _draw_map(left, shown, trace)
    group_thousands(left, right)
    figure.legend(handles=_entries(trace), loc="outside lower center", ncols=7)
    settle(left)
    _name_places(left, shown, trace)
    draw_bands([right], list(trace_bands(trace)))
    figure.set_layout_engine("none")
    return figure


def _draw_map(ax: Axes, shown: Scene, trace: Trace) -> None:
    draw_plan_view(ax, shown)
    x, y, _ = trace.position_m.T
    ax.plot(x, y, color=GREY, linewidth=0.8, linestyle=(0.0, (4.0, 2.0)), zorder=3)
    for number in np.unique(trace.phase):
        first = int(np.argmax(trace.phase == number))
        if trace.kind[first] != "flight":
            ax.plot(x[first], y[first], zorder=4, **stop_look(str(trace.kind[first]), True))
    for end in (0, -1):
        ax.plot(x[end], y[end], "D", color=BLACK, markersize=4, zorder=4)


def _name_places(ax: Axes, shown: Scene, trace: Trace) -> None:
    """Names without symbols, for which a small map has no room."""
    x, y, _ = trace.position_m.T
    reached = [int(np.flatnonzero(trace.phase == number)[-1]) for number in np.unique(trace.phase)]
    named = {str(trace.start_place[0]): 0, **{str(trace.end_place[at]): at for at in reached}}
    labels = [Label(printed(name), (float(x[at]), float(y[at]))) for name, at in named.items()]
    written = {label.at for label in labels}
    labels += [
        replace(label, text=label.text.partition(" $")[0])
        for label in scenery_labels(shown)
        if tuple(label.at) not in written
    ]
    place(ax, labels, [np.stack([x, y], axis=1)], drawn_sight_lines(ax))


def _moving(left: Axes, right: Axes, replayed: Replayed) -> Callable[[float], list[Artist]]:
    """What draws a moment [s]."""
    trace, laser = replayed.trace, replayed.mission.laser
    end_s = float(trace.time_s[-1])
    (trail,) = left.plot([], [], color=BLUE, linewidth=1.6)
    (beam,) = left.plot([], [], color=ORANGE, linewidth=1.6)
    (craft,) = left.plot([], [], "o", markersize=8, markeredgecolor="white")
    veil = right.axvspan(0.0, end_s, color="white", alpha=0.85, linewidth=0.0)
    (now,) = right.plot([], [], color=BLACK, linewidth=0.8)
    clock = left.set_title("", y=1.0)
    verdict = right.set_title("", y=1.0, pad=NAMES_PT, color=VERMILLION)
    timed = [event for event in replayed.violations if event.kind != "mismatch"]

    def show(moment_s: float) -> list[Artist]:
        at = max(0, int(np.searchsorted(trace.time_s, moment_s, side="right")) - 1)
        here = [float(np.interp(moment_s, trace.time_s, each)) for each in trace.position_m.T[:2]]
        trail.set_data(*np.concatenate([trace.position_m[: at + 1, :2], [here]]).T)
        lit = laser is not None and trace.received_power_W[at] > 0.0
        beam.set_data(*np.array([laser.position_m[:2], here]).T if laser and lit else ([], []))
        past = [event for event in timed if event.time_s <= moment_s]
        craft.set_data(here[:1], here[1:])
        craft.set_markerfacecolor(VERMILLION if past else BLACK)
        veil.set_bounds(moment_s, 0.0, end_s - moment_s, 1.0)
        now.set_data([moment_s, moment_s], right.get_ylim())
        clock.set_text(
            f"{printed(replayed.mission.name)}, $t$ = {moment_s:.0f} s: {trace.kind[at]}"
        )
        verdict.set_text(", ".join(f"{each.kind} at {each.time_s:.1f} s" for each in past[:2]))
        return [trail, beam, craft, veil, now, clock, verdict]

    return show


def _entries(trace: Trace) -> list[Artist]:
    kinds = dict.fromkeys(str(kind) for kind in trace.kind)
    return [
        Line2D([], [], color=ORANGE, linewidth=1.6, label="power from the laser"),
        Patch(color=BLUE, linewidth=0.0, label="available $y_1$"),
        Patch(color=SKY, linewidth=0.0, label="bound $y_2$"),
        *(swatch(KINDS[kind], kind) for kind in kinds),
    ]
