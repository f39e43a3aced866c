"""A replayed plan over time: altitude, speed and power."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from optuav.mission import Mission
from optuav.plan.trace import Event, Trace
from optuav.plots.bands import NAMES_PT, Band, draw_bands, swatch
from optuav.plots.labels import Label, place, settle
from optuav.plots.style import (
    BLACK,
    GREY,
    KINDS,
    ORANGE,
    VERMILLION,
    group_thousands,
    margins,
    need_panels,
    page,
    printed,
    styled,
)

MOST_MARKED = 12
"""Violations that are marked one by one."""


class Replayed(Protocol):
    """What `optuav.replay` returns, as far as it is drawn."""

    @property
    def mission(self) -> Mission:
        """The mission."""

    @property
    def trace(self) -> Trace:
        """The table over time."""

    @property
    def violations(self) -> tuple[Event, ...]:
        """What keeps the plan from being flown."""


class ProfileAxes(NamedTuple):
    """Altitude, speed and power, all over time."""

    altitude: Axes
    speed: Axes
    power: Axes


def profile(replayed: Replayed, axes: ProfileAxes | None = None) -> ProfileAxes:
    """Draw altitude, speed and power into the battery over a simulated plan.

    While a leg turns, the model freezes the position: no speed is drawn there. The altitudes
    between which the UAV may hover are dashed, and each violated limit is marked when it is first
    passed.

    Parameters
    ----------
    replayed
        From `optuav.replay`.
    axes
        Where to draw; on a page of its own by default.

    Raises
    ------
    NoPlanError
        If nothing is flown.
    """
    trace, mission = replayed.trace, replayed.mission
    need_panels(axes, ProfileAxes)
    with styled():
        if axes is None:
            axes = ProfileAxes(*page(7.2, 5.0).subplots(3, 1, sharex=True))
        _draw_altitude(axes.altitude, mission, trace)
        moving_m_s = np.where(trace.stage == "turn", np.nan, trace.speed_m_s)
        axes.speed.plot(trace.time_s, moving_m_s, color=BLACK)
        axes.speed.set(ylabel="speed [m/s]", ylim=margins([0.0, *trace.speed_m_s], 0.12))
        _draw_power(axes.power, trace)
        for ax in axes:
            ax.set_xlim(0.0, trace.time_s[-1])
        axes.power.set_xlabel("time since take-off $t$ [s]")
        verdict = "can be flown" if not replayed.violations else "cannot be flown"
        axes.altitude.set_title(f"{printed(mission.name)}: {verdict}", pad=NAMES_PT)
        group_thousands(*axes)
        _legend(axes.power, trace)
        settle(axes.altitude)
        draw_bands(axes, list(trace_bands(trace)))
        _mark(axes.altitude, trace, replayed.violations)
    return axes


def _draw_altitude(ax: Axes, mission: Mission, trace: Trace) -> None:
    z, limits = trace.position_m[:, 2], mission.limits
    for level_m in (limits.min_altitude_m, limits.max_altitude_m):
        ax.axhline(level_m, color=GREY, linewidth=0.8, linestyle=(0.0, (4.0, 2.0)))
    ax.plot(trace.time_s, z, color=BLACK)
    levels = [*z, limits.min_altitude_m]
    if limits.max_altitude_m <= 3.0 * max(levels):
        levels.append(limits.max_altitude_m)
    ax.set(ylabel="altitude [m]", ylim=margins(levels, 0.15))


def _draw_power(ax: Axes, trace: Trace) -> None:
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.plot(trace.time_s, trace.received_power_W, color=ORANGE, linewidth=1.0)
    ax.plot(trace.time_s, trace.power_W, color=BLACK)
    shown = [0.0, *trace.power_W, *trace.received_power_W]
    ax.set(ylabel="power into\nthe battery [W]", ylim=margins(shown, 0.12))


def trace_bands(trace: Trace) -> Iterator[Band]:
    """The phases of a simulated plan, with their names."""
    for phase in np.unique(trace.phase):
        (inside,) = np.nonzero(trace.phase == phase)
        first, last = inside[0], inside[-1]
        kind, at = str(trace.kind[first]), str(trace.end_place[first])
        words = (f"rest, {printed(at)}",) if kind == "rest" else ()
        begin_s, end_s = float(trace.time_s[first]), float(trace.time_s[last])
        yield Band(begin_s, end_s, KINDS[kind], (*words, kind))


def _mark(ax: Axes, trace: Trace, violations: Sequence[Event]) -> None:
    """Mark when limits are first passed; figures that contradict themselves have no moment."""
    timed = [event for event in violations if event.kind != "mismatch"][:MOST_MARKED]
    z = trace.position_m[:, 2]
    marks = [
        Label(
            f"{event.kind} at {event.time_s:.1f} s",
            (event.time_s, float(np.interp(event.time_s, trace.time_s, z))),
            style={"color": VERMILLION},
        )
        for event in timed
    ]
    for mark in marks:
        ax.plot(*mark.at, "o", color=VERMILLION, markersize=4.5, clip_on=False, zorder=5)
    place(ax, marks, [np.stack([trace.time_s, z], axis=1)])


def _legend(ax: Axes, trace: Trace) -> None:
    lines = [
        Line2D([], [], color=BLACK, label="net power"),
        Line2D([], [], color=ORANGE, linewidth=1.0, label="from the laser"),
        Line2D([], [], color=GREY, linewidth=0.8, linestyle="--", label="altitudes for hovering"),
    ]
    kinds = dict.fromkeys(str(kind) for kind in trace.kind)
    ax.legend(
        handles=[*lines, *(swatch(KINDS[kind], kind) for kind in kinds)],
        loc="upper center",
        bbox_to_anchor=(0.5, -0.42),
        ncols=6,
        columnspacing=1.4,
    )
