"""The two wells of the kinetic battery as tanks, at the end of every phase of a plan."""

from __future__ import annotations

import math
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from optuav.network import vehicle
from optuav.physics.kibam import Battery
from optuav.plan import Plan
from optuav.plots.style import BLACK, BLUE, SKY, VERMILLION, page, printed, styled

ROOM = 0.12
"""Between the tanks, as a share of both their widths."""
MOST_IN_A_ROW = 3


class Moment(NamedTuple):
    """Fill of the wells at a moment [-]: charge over that of the full well."""

    words: str
    available: float
    bound: float


def moments(plan: Plan) -> list[Moment]:
    """The full battery, and the wells at the end of every phase that takes time."""
    full = vehicle.pool(plan.mission).full
    return [
        Moment("full, at take-off", 1.0, 1.0),
        *(
            Moment(
                f"after {phase.kind}, {phase.end_s:.0f} s",
                sum(phase.available_As) / float(full.available_As),
                sum(phase.bound_As) / float(full.bound_As),
            )
            for phase in plan.phases
            if phase.duration_s > 0.0
        ),
    ]


def tanks(plan: Plan) -> list[Axes]:
    """Draw both wells as tanks at the end of every phase: width is size, height is charge.

    Charge flows through the pipe from the higher level to the lower one. A level below the floor
    or above the rim is one that the battery cannot have.

    Parameters
    ----------
    plan
        A plan that exists.

    Raises
    ------
    NoPlanError
        If there is no plan.
    """
    _ = plan.mission_time_s
    shown = moments(plan)
    columns = min(MOST_IN_A_ROW, len(shown))
    rows = math.ceil(len(shown) / columns)
    with styled():
        figure = page(7.2, 0.4 + 1.9 * rows)
        grid = figure.subplots(rows, columns, squeeze=False)
        pool = vehicle.pool(plan.mission)
        lowest = min(0.0, *(min(each.available, each.bound) for each in shown))
        highest = max(1.0, *(max(each.available, each.bound) for each in shown))
        figure.suptitle(
            f"{printed(plan.mission.name)}: the wells in the perspective {plan.perspective}",
            x=0.02,
            ha="left",
        )
        for ax in grid.flat[len(shown) :]:
            ax.set_axis_off()
        for ax, moment in zip(grid.flat, shown, strict=False):
            _draw(ax, pool, moment)
            ax.set(xlim=(-0.03, 1.03 + ROOM), ylim=(lowest - 0.16, highest + 0.3))
            ax.set_title(moment.words)
            ax.set_axis_off()
    return list(grid.flat[: len(shown)])


def _draw(ax: Axes, pool: Battery, moment: Moment) -> None:
    share = float(pool.available_fraction)
    for left, width, fill, colour, name, holds in (
        (0.0, share, moment.available, BLUE, "$y_1$", "$ω B$"),
        (share + ROOM, 1.0 - share, moment.bound, SKY, "$y_2$", "$(1-ω) B$"),
    ):
        impossible = not -1e-9 <= fill <= 1.0 + 1e-9
        ax.add_patch(Rectangle((left, 0.0), width, fill, facecolor=colour, alpha=0.55))
        ax.add_patch(Rectangle((left, 0.0), width, 1.0, fill=False, edgecolor=BLACK, linewidth=0.9))
        ax.annotate(
            f"{name}\n{round(100.0 * fill, 1) + 0.0:.1f} %".replace("-", "\N{MINUS SIGN}"),
            (left + 0.5 * width, max(1.0, fill) + 0.02),
            ha="center",
            va="bottom",
            fontsize=6.5,
            color=VERMILLION if impossible else BLACK,
            fontweight="bold" if impossible else "normal",
        )
        ax.annotate(
            holds, (left + 0.5 * width, min(0.0, fill) - 0.03), ha="center", va="top", fontsize=6.5
        )
    ax.plot([share, share + ROOM], [0.04, 0.04], color=BLACK, linewidth=2.2)
    ax.annotate("$k_F$", (share + 0.5 * ROOM, 0.06), ha="center", va="bottom", fontsize=7.0)
