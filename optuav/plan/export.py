"""Files of a plan for maps and for ground stations of drones."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np

from optuav.errors import Fault, InputError, require, shown
from optuav.export import NOT_FLOWN, PlanOnEarth, Position, Step, shapes, waypoints
from optuav.mission.earth import DEGREES, stated_system, system_in_metres
from optuav.mission.files import ending_of, write_text
from optuav.mission.messages import path_of
from optuav.network.map_extent import scene
from optuav.plan.data import PlanData

WRITERS: dict[str, Callable[[PlanOnEarth], str]] = {
    ".kml": shapes.kml,
    ".geojson": shapes.geojson,
    ".plan": waypoints.plan,
    ".waypoints": waypoints.waypoints,
}
"""Writer of a course, by the suffix of the file."""
DIGITS = 9  # Decimals of degrees, 0.1 mm
NO_EARTH = "is missing; an export needs the mission's place on Earth: crs, or [earth]"


def export(plan: PlanData, path: str | Path, *, force: bool = False) -> Path:
    """Write the course of a plan; see `Plan.export`."""
    file = path_of(path)
    write = WRITERS[ending_of(file, *WRITERS)]
    course = course_of(plan)
    if not (plan.flyable or force):
        why = "; ".join(plan.faults) or "its simulation failed or is missing; optuav audit"
        words = f"true; {why}. force = True (--force) exports the plan all the same"
        raise InputError([Fault("plan.flyable", shown(plan.flyable), words)])
    write_text(file, write(course))
    return file


def course_of(plan: PlanData) -> PlanOnEarth:
    """The places and waypoints of a plan on Earth, in its order, without stays of no length."""
    mission, route = plan.mission, plan.route
    if (crs := stated_system(mission)) is None:
        raise InputError([Fault("crs", "", NO_EARTH)])
    require("pyproj", "exports of plans")
    import pyproj

    names = [*dict.fromkeys(route)]
    bent_m = [at for by in plan.waypoints_m for at in by]
    position_m = np.array([*scene(mission).positions(names), *bent_m])
    ahead = pyproj.Transformer.from_crs(system_in_metres(crs), DEGREES, always_xy=True)
    degrees = np.column_stack(ahead.transform(*position_m[:, :2].T))
    if not np.isfinite(degrees).all():
        words = "a reference system that holds all places of the plan"
        raise InputError([Fault("crs", crs, words)])
    angles = np.round(degrees, DIGITS)
    points = [Position(*row) for row in np.column_stack([angles, position_m[:, 2]]).tolist()]
    places, bends = dict(zip(names, points, strict=False)), iter(points[len(names) :])
    steps = []
    for phase in plan.phases:
        if phase.kind == "flight" or phase.duration_s > 0.0:
            end, way = (
                phase.end_place,
                (*islice(bends, len(phase.waypoints_m)), places[phase.end_place]),
            )
            if phase.kind == "flight":
                way = (places[phase.start_place], *way)
            steps.append(Step(phase.kind, end, way, phase.duration_s, phase.peak_speed_m_s))
    altitude_m = mission.earth.altitude_m if mission.earth else 0.0
    return PlanOnEarth(mission.name, (NOT_FLOWN, *plan.faults), altitude_m, tuple(steps))
