"""Fleets over time: what every drone does, and when one is on station."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from optuav.looks import PHASES
from optuav.mission.messages import several
from optuav.plots import style

TURNS_DRAWN = 2.0  # Turns of the first drone that are drawn
COVERS = "on station"
DAY_S = 86_400.0
EDGE = 0.004  # Margin for the rim of a leg, as a share of the time


class Turn(NamedTuple):
    """A drone's first take-off, and its both legs together, hover, rest and wait [s].

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.Turn(0.0, 80.0, 1800.0, 5200.0, 110.0).round_s
    7190.0
    """

    offset_s: float
    flight_s: float
    hover_s: float
    rest_s: float
    wait_s: float

    @property
    def round_s(self) -> float:
        """Duration of a turn [s]."""
        return sum(self[1:])


def fleet_turns(turns: Sequence[Turn], *, title: str, ax: Axes | None = None) -> Axes:
    """Draw a bar per drone, and below when one is on station.

    Parameters
    ----------
    turns
        Of every drone, at least one.
    title
        Heading.
    ax
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with the time [h] along.

    Raises
    ------
    InputError
        Without a turn.

    Examples
    --------
    >>> import optuav
    >>> turns = [optuav.plots.Turn(t, 80.0, 1800.0, 5200.0, 110.0) for t in (0.0, 1800.0)]
    >>> optuav.plots.fleet_turns(turns, title="two drones").get_xlabel()
    'time [h]'
    """
    turns = several("turns", turns, Turn, "at least one Turn")
    end_s = TURNS_DRAWN * turns[0].round_s
    courses = [
        [turn._replace(offset_s=s) for s in np.arange(turn.offset_s, end_s, turn.round_s).tolist()]
        for turn in turns
    ]
    return courses_drawn(courses, end_s, title, ax)


@style.applied()
def courses_drawn(
    courses: Sequence[Sequence[Turn]],
    end_s: float,
    title: str,
    ax: Axes | None = None,
    clock: Callable[[float], datetime] | None = None,
    lost: tuple[int, float] | None = None,
) -> Axes:
    """Draw a bar per drone with its turns until an end [s], and below when one is on station.

    Hovers that follow each other are on two lanes, so that overlaps show. Times are hours, or clock
    times where the clock tells the moment after so many seconds. The bar of a drone that is lost,
    by its number, ends when it fails [s].
    """
    ax = ax or style.page(1.6 + 0.28 * len(courses)).subplots()
    waits = any(turn.wait_s > 0.0 for course in courses for turn in course)
    kinds = {"fly": "flight", "hover": "hover", "rest": "rest"} | ({"wait": None} if waits else {})
    colours = {words: PHASES[kind] if kind else style.PALE for words, kind in kinds.items()}
    hovers = list[tuple[float, float]]()
    for number, course in enumerate(courses):
        ends_s = end_s
        if lost is not None and lost[0] == number + 1:
            ends_s = min(end_s, lost[1])
            ax.text(ends_s / 3600.0, number, " ✕ failed", va="center")
        for turn in course:
            begin_s, leg = turn.offset_s, ("fly", 0.5 * turn.flight_s)
            stays = leg, ("hover", turn.hover_s), leg, ("rest", turn.rest_s), ("wait", turn.wait_s)
            for words, lasts_s in stays:
                if (shown_s := min(lasts_s, ends_s - begin_s)) > 0.0:
                    rim = (
                        {"linewidth": 1.5, "zorder": 2.0} if words == "fly" else {"linewidth": 0.0}
                    )
                    look: style.Look = {"color": colours[words], **rim}  # Legs are short
                    span = [(begin_s / 3600.0, shown_s / 3600.0)]
                    ax.broken_barh(span, (number - 0.4, 0.8), **look)
                    hovers += [(begin_s, shown_s)] * (words == "hover")
                begin_s += lasts_s
    for order, (begin_s, lasts_s) in enumerate(sorted(hovers)):  # Two lanes show overlaps
        span, lane = [(begin_s / 3600.0, lasts_s / 3600.0)], len(courses) + 0.1 + 0.4 * (order % 2)
        ax.broken_barh(span, (lane, 0.4), color=colours["hover"], linewidth=0.0)
    names = [f"drone {number}" for number in range(1, len(courses) + 1)]
    ax.set_yticks([*range(len(courses)), len(courses) + 0.5], [*names, COVERS])
    ax.invert_yaxis()
    first_s = min(0.0, *(turn.offset_s for course in courses for turn in course))
    rim_s = EDGE * (end_s - first_s)
    limits = (first_s - rim_s) / 3600.0, (end_s + rim_s) / 3600.0
    ax.set(xlabel="time [h]", xlim=limits)
    if clock is not None:
        day = "%a " * (end_s > DAY_S)
        ax.xaxis.set_major_locator(MaxNLocator(steps=[1, 2, 5], nbins=8))
        ax.xaxis.set_major_formatter(lambda h, _: clock(3600.0 * h).strftime(f"{day}%H:%M"))
        ax.set_xlabel(f"clock time, from {clock(0.0):%Y-%m-%d %H:%M} on")
    ax.set_title(title, pad=style.LEGEND_PT)
    handles = [Patch(color=colour, label=words) for words, colour in colours.items()]
    style.legend_above(ax, len(handles), handles)
    style.settle(ax)
    return ax
