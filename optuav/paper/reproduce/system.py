"""Fig. 2: the system, and the four trajectories."""

from __future__ import annotations

from collections.abc import Iterator

from optuav import plots
from optuav.mission import Mission
from optuav.paper.reproduce.exhibit import Exhibit, LeftOut, caption, deadline, stem
from optuav.paper.reproduce.perspectives import COUNTED, TRAJECTORIES
from optuav.paper.reproduce.plans import no_plan, solve, without


def system(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """The map, counting charge, and once more where the available well must last."""
    for perspective in COUNTED:
        plans = {
            name: solve(mission, trajectory=name, perspective=perspective) for name in TRAJECTORIES
        }
        found = [name for name in plans if plans[name]]
        if not found:
            yield no_plan(plans["optimal"], f"perspective {perspective}")
            continue
        yield Exhibit(
            f"system.{stem(mission)}.{perspective}",
            caption(
                mission,
                "System and trajectories",
                "Fig. 2",
                f"perspective {perspective}",
                deadline(mission),
            ),
            plots.trajectories(plans).plan,
            [
                {
                    "trajectory": name,
                    "route": " > ".join(plans[name].route),
                    "hover_time_s": plans[name].hover_time_s,
                    "rest_time_s": plans[name].rest_time_s,
                    "flight_time_s": plans[name].flight_time_s,
                    "mission_time_s": plans[name].mission_time_s,
                }
                for name in found
            ],
            (
                "Routes: "
                + "; ".join(f"{name} {' → '.join(plans[name].route)}" for name in found)
                + ".",
                *without(plans),
            ),
        )
