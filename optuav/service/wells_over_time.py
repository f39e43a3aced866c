"""Pictures of how full the wells are over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

from optuav.judge.replay import Replay
from optuav.studies.results import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Flights: TypeAlias = Sequence[tuple[Replay, float]]
"""Simulations with the moments at which they begin [s]."""


def draw_wells(result: Result, title: str, flights: Flights) -> Axes:
    """Draw how full both wells are over time."""
    from optuav.plots import Line, curves
    from optuav.plots.charts import WELLS
    from optuav.plots.style import titled

    lines = list[Line]()
    for well in WELLS:
        hours, percent = list[float](), list[float]()
        for replay, start_s in flights:
            full_As = float(getattr(replay.mission.pool.full, f"{well}_As"))
            level_As = getattr(replay.trace, f"{well}_As")[:, 0]
            hours += ((replay.trace.time_s + start_s) / 3600.0).tolist()
            percent += (100.0 * level_As / full_As).tolist()
        lines.append(Line(f"{well} well", hours, percent, well=well))
    title = titled(result.mission.name, title)
    x_label, y_label = "time $t$ [h]", "charge of a full well [%]"
    return curves(lines, title=title, x_label=x_label, y_label=y_label, y_from_zero=True)
