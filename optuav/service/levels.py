"""Pictures of how full the wells are over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

from optuav.errors import printable
from optuav.judge.replay import Replay
from optuav.network import vehicle
from optuav.studies.results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Level(NamedTuple):
    """A line of a picture: a well through simulations that begin at some moments [s]."""

    words: str
    well: Literal["available", "bound"]
    flights: Sequence[tuple[Replay, float]]


def draw_levels(results: Results, title: str, levels: Sequence[Level]) -> Axes:
    """Draw how full wells are over time."""
    from optuav.plots import Line, curves

    lines = list[Line]()
    for words, well, flights in levels:
        hours, percent = list[float](), list[float]()
        for replay, start_s in flights:
            full_As = float(getattr(vehicle.pool(replay.mission).full, f"{well}_As"))
            level_As = getattr(replay.trace, f"{well}_As")[:, 0]
            hours += ((replay.trace.time_s + start_s) / 3600.0).tolist()
            percent += (100.0 * level_As / full_As).tolist()
        lines.append(Line(words, hours, percent))
    return curves(
        lines,
        title=f"{title}: {printable(results.mission.name)}",
        x_label="time $t$ [h]",
        y_label="charge of a full well [%]",
        y_from_zero=True,
    )
