"""A replayed plan over time: altitude, speed and power."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
from matplotlib.axes import Axes

from optuav.mission import Mission
from optuav.plan.trace import Event, Trace
from optuav.plots import style
from optuav.plots.bands import NAMES_PT, Band, draw_bands, phase_band, swatches
from optuav.plots.labels import mark
from optuav.plots.style import BLACK, GREY, ORANGE

MOST_MARKED = 12
"""Violations that are marked one by one."""


class Replayed(Protocol):
    """The part of what `optuav.replay` returns that is drawn."""

    @property
    def mission(self) -> Mission:
        """The mission."""

    @property
    def trace(self) -> Trace:
        """The table over time."""

    @property
    def violations(self) -> tuple[Event, ...]:
        """The reasons why the plan cannot be flown."""


class ProfileAxes(NamedTuple):
    """Altitude, speed and power, all over time."""

    altitude: Axes
    speed: Axes
    power: Axes


@style.applied()
def profile(replayed: Replayed) -> ProfileAxes:
    """Draw altitude, speed and power into the battery over a simulated plan.

    While a leg turns, the flight model freezes the position: no speed is drawn there. The
    altitudes between which the UAV may hover are dashed, and each violated limit is marked when it
    is first passed.

    Parameters
    ----------
    replayed
        From `optuav.replay`.

    Returns
    -------
    The axes, with altitude in m, speed in m/s and power in W over time in s.

    Raises
    ------
    NoPlanError
        If nothing is flown.

    Examples
    --------
    >>> import optuav
    >>> replayed = optuav.replay(optuav.solve("paper", "P3"))
    >>> optuav.plots.profile(replayed).altitude.get_title(loc="left")
    'paper: can be flown'
    """
    trace, mission = replayed.trace, replayed.mission
    axes = ProfileAxes(*style.page(5.0).subplots(3, 1, sharex=True))
    _draw_altitude(axes.altitude, mission, trace)
    moving_m_s = np.where(trace.stage == "turn", np.nan, trace.speed_m_s)
    axes.speed.plot(trace.time_s, moving_m_s, color=BLACK)
    axes.speed.set(ylabel="speed [m/s]", ylim=style.margins([0.0, *trace.speed_m_s], 0.12))
    _draw_power(axes.power, trace)
    verdict = "can be flown" if not replayed.violations else "cannot be flown"
    axes.altitude.set_title(f"{style.printed(mission.name)}: {verdict}", pad=NAMES_PT)
    entries = [
        style.entry("net power", BLACK),
        style.entry("from the laser", ORANGE, 1.0),
        style.entry("altitudes for hovering", GREY, 0.8, "--"),
        *swatches(trace.kind),
    ]
    axes.power.set(xlim=(0.0, trace.time_s[-1] or 1.0), xlabel=style.TIME)
    style.group_thousands(*axes)
    at = (0.5, -0.42)
    axes.power.legend(
        handles=entries, loc="upper center", bbox_to_anchor=at, ncols=6, columnspacing=1.4
    )
    style.settle(axes.altitude)
    draw_bands(axes, list(trace_bands(trace)))
    height_m = trace.position_m[:, 2]
    events = [
        (f"{each.kind} at {each.time_s:.1f} s", each.time_s, height)
        for each in timed(replayed)[:MOST_MARKED]
        for height in [float(np.interp(each.time_s, trace.time_s, height_m))]
    ]
    mark(axes.altitude, events, [np.stack([trace.time_s, height_m], axis=1)])
    return axes


def timed(replayed: Replayed) -> list[Event]:
    """The violations that have a moment; figures that contradict themselves have none."""
    return [event for event in replayed.violations if event.kind != "mismatch"]


def _draw_altitude(ax: Axes, mission: Mission, trace: Trace) -> None:
    z, limits = trace.position_m[:, 2], mission.limits
    for level_m in (limits.min_altitude_m, limits.max_altitude_m):
        ax.axhline(level_m, color=GREY, linewidth=0.8, linestyle=style.DASHED)
    ax.plot(trace.time_s, z, color=BLACK)
    levels = [*z, limits.min_altitude_m]
    if limits.max_altitude_m <= 3.0 * max(levels):
        levels.append(limits.max_altitude_m)
    ax.set(ylabel="altitude [m]", ylim=style.margins(levels, 0.15))


def _draw_power(ax: Axes, trace: Trace) -> None:
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.plot(trace.time_s, trace.received_power_W, color=ORANGE, linewidth=1.0)
    ax.plot(trace.time_s, trace.power_W, color=BLACK)
    shown = [0.0, *trace.power_W, *trace.received_power_W]
    ax.set(ylabel="power into\nthe battery [W]", ylim=style.margins(shown, 0.12))


def trace_bands(trace: Trace) -> Iterator[Band]:
    """The bands of the phases of a simulated plan."""
    for phase in np.unique(trace.phase):
        first, last = np.flatnonzero(trace.phase == phase)[[0, -1]]
        times_s = float(trace.time_s[first]), float(trace.time_s[last])
        yield phase_band(str(trace.kind[first]), str(trace.end_place[first]), *times_s)
