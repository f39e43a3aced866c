"""What a mission's author should know: well-formed, but impossible or unwise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav.mission.feasibility import impossibilities
from optuav.mission.network import Network, network
from optuav.mission.places import HOVER
from optuav.mission.schema import Mission

SECONDS_PER_HOUR = 3600.0


def advice(mission: Mission) -> tuple[str, ...]:
    """Warnings about a valid mission, in words; empty if there is nothing to say.

    Parameters
    ----------
    mission
        Any valid mission.
    """
    worked_out = network(mission)
    found = list(impossibilities(worked_out))
    if not found:
        found += _deadline(worked_out)
    found += _charging(mission)
    found += _dark(worked_out)
    return tuple(found)


def _deadline(worked_out: Network) -> Iterator[str]:
    routes = worked_out.itineraries
    shortest_s = float(routes.flight_time_s[routes.flyable].min())
    deadline_s = worked_out.mission.limits.deadline_s
    if shortest_s > deadline_s:
        yield (
            f"limits.deadline_s = {deadline_s:g} s is shorter than the flight alone, "
            f"{shortest_s:.2f} s"
        )


def _charging(mission: Mission) -> Iterator[str]:
    given = mission.battery
    recommended_A = given.packs * given.capacity_As / SECONDS_PER_HOUR
    if given.charge_current_A > recommended_A:
        yield (
            f"battery.charge_current_A = {given.charge_current_A:g} A is above 1 C of the battery, "
            f"{recommended_A:g} A"
        )


def _dark(worked_out: Network) -> Iterator[str]:
    where, mission = worked_out.places, worked_out.mission
    if mission.laser is None:
        return
    exists = np.isfinite(where.position_m).all(axis=1)
    in_the_dark = exists & ~where.laser_sight
    names = [where.names[place] for place in (HOVER, *where.buildings) if in_the_dark[place]]
    if names:
        shown = ", ".join(names[:10]) + (", …" if len(names) > 10 else "")
        yield f"the laser does not see {shown}: no charging there"
