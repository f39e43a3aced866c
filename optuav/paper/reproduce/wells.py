"""Fig. 1: the two wells of the battery, filled as the best plan leaves them."""

from __future__ import annotations

from collections.abc import Iterator

from optuav import plots
from optuav.mission import Mission
from optuav.paper.reproduce.exhibit import (
    Exhibit,
    LeftOut,
    caption,
    number,
    percent,
    sentence,
    stem,
)
from optuav.paper.reproduce.perspectives import COUNTED
from optuav.paper.reproduce.plans import no_plan, solve
from optuav.plots.charge import moments


def wells(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """The wells at the end of every phase of the optimal plan."""
    for perspective in COUNTED:
        plan = solve(mission, perspective=perspective)
        if not plan:
            yield no_plan(plan, f"perspective {perspective}")
            continue
        levels = moments(plan)
        yield Exhibit(
            f"wells.{stem(mission)}.{perspective}",
            caption(
                mission,
                "The wells of the kinetic battery over the optimal plan",
                "Fig. 1",
                f"perspective {perspective}",
            ),
            plots.tanks(plan)[0],
            [
                {
                    "moment": each.words,
                    "available_percent_of_full": percent(each.available),
                    "bound_percent_of_full": percent(each.bound),
                }
                for each in levels
            ],
            (
                f"The available well ends at {number(100.0 * levels[-1].available, 1)} % of its "
                f"full charge, the bound well at {number(100.0 * levels[-1].bound, 1)} %.",
                *map(sentence, plan.warnings),
            ),
        )
