"""Fleets over time: what every drone does, and who covers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.looks import PHASES
from optuav.mission.messages import several
from optuav.plots import style

ROUNDS = 2.0  # Turns of the first drone that are drawn
COVERS = "who covers"


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


@style.applied()
def fleet_turns(turns: Sequence[Turn], *, title: str, ax: Axes | None = None) -> Axes:
    """Draw a bar per drone, and below who covers.

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
    ax = ax or style.page(1.6 + 0.28 * len(turns)).subplots()
    end_s = ROUNDS * turns[0].round_s
    kinds = {"fly": "flight", "hover": "hover", "rest": "rest", "wait": None}
    colours = {words: PHASES[kind] if kind else style.PALE for words, kind in kinds.items()}
    for number, turn in enumerate(turns):
        begin_s = turn.offset_s
        while begin_s < end_s:
            leg_s = 0.5 * turn.flight_s
            lasts = ("fly", leg_s), ("hover", turn.hover_s), ("fly", leg_s)
            for words, lasts_s in (*lasts, ("rest", turn.rest_s), ("wait", turn.wait_s)):
                shown_s = max(min(lasts_s, end_s - begin_s), 0.0) / 3600.0
                look: style.Look = {"color": colours[words], "linewidth": 0.0}
                ax.broken_barh([(begin_s / 3600.0, shown_s)], (number - 0.4, 0.8), **look)
                if words == "hover":
                    below = (len(turns) + 0.1, 0.8)
                    shade = {**look, "alpha": 0.55 + 0.45 * (number % 2)}
                    ax.broken_barh([(begin_s / 3600.0, shown_s)], below, **shade)
                begin_s += lasts_s
    names = [f"drone {number}" for number in range(1, len(turns) + 1)]
    ax.set_yticks([*range(len(turns)), len(turns) + 0.5], [*names, COVERS])
    ax.invert_yaxis()
    ax.set(xlabel="time [h]", xlim=(0.0, end_s / 3600.0))
    ax.set_title(title, pad=style.LEGEND_PT)
    handles = [Patch(color=colour, label=words) for words, colour in colours.items()]
    style.legend_above(ax, len(handles), handles)
    style.settle(ax)
    return ax
