"""The hover point as an unknown: never worse than w_U, and where the mission allows it."""

from __future__ import annotations

import numpy as np

import optuav
from optuav.mission import vehicle


def test_a_free_hover_point_is_never_worse_and_is_covered() -> None:
    """On `paper` the gain is thousandths of a second; the point keeps ball and altitude band."""
    mission = optuav.load("paper")
    plan = optuav.solve(mission, hover_point="free")
    assert plan.status == "locally_optimal"
    assert plan.hover_time_s >= optuav.solve(mission).hover_time_s - 1e-9
    point_m = plan.mission.route.hover_m
    assert point_m is not None
    distance_m = np.linalg.norm(np.subtract(point_m, mission.link.device_m))
    assert distance_m <= vehicle.coverage_radius_m(mission) * (1 + 1e-9)
    assert mission.limits.min_altitude_m <= point_m[2] <= mission.limits.max_altitude_m
    again = optuav.solve(plan.mission)
    assert abs(again.hover_time_s - plan.hover_time_s) < 1e-6
