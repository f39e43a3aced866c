"""Files of a plan for maps and for ground stations of drones."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from math import inf
from pathlib import Path
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, refuse, require, shown
from optuav.export import NOT_FLOWN, Flight, PlanOnEarth, Position, Step, shapes, waypoints
from optuav.fields import Range
from optuav.mission import Mission
from optuav.mission.earth import DEGREES, stated_system, system_in_metres
from optuav.mission.files import ending_of, refusal, write_files
from optuav.mission.messages import first_ten, misfits, path_of
from optuav.network.map_extent import scene
from optuav.network.timeline import Phase
from optuav.network.timeline import steps as network_steps
from optuav.physics.kibam import time_to_full
from optuav.plan.climbs import (
    EMPTY,
    FlightCharge,
    climbs,
    deadline_warning,
    flight_charges,
    level_speeds_m_s,
    more_reserve,
    short,
    taken_off_with,
)
from optuav.plan.data import PlanData

MAPS: dict[str, Callable[[PlanOnEarth], str]] = {".kml": shapes.kml, ".geojson": shapes.geojson}
"""Writer of a whole course, by the suffix of the file."""
MISSIONS = ".plan", ".waypoints"
"""Suffixes of files that hold one flight each."""
SUFFIXES = *MAPS, *MISSIONS
CLIMB = Range("m", gt=0.0, le=1000.0)
CLIMB_M = 12.0
DIGITS = 9  # Decimals of degrees, 0.1 mm
NO_EARTH = "is missing; an export needs the mission's place on Earth: crs, or [earth]"
GEOIDS = "us_nga_egm08_25.tif", "us_nga_egm96_15.tif"
"""Grids of heights of the sea above the ellipsoid, EGM2008 and EGM96, as PROJ names them."""
ABOVE_SEA = (
    "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad "
    "+step +proj=vgridshift +grids={} +multiplier=1 "
    "+step +proj=unitconvert +xy_in=rad +xy_out=deg"
)
NO_GEOID = (
    "Without heights: GeoJSON wants them above the ellipsoid, and pyproj has no geoid here "
    f"({GEOIDS[1]}; python -m pyproj sync --file us_nga_egm96 fetches it)."
)
NO_ALTITUDE = (
    "earth.altitude_m is 0, as where it is not stated: altitudes above the sea are those above "
    "z = 0. State it, unless your ground is at sea level."
)
ABOVE_SEA_LEVEL = " altitudes_m is above mean sea level."


class Exported(NamedTuple):
    """Files of a plan, not yet written, and what is to be told about them."""

    files: dict[Path, bytes]
    notes: tuple[str, ...]


def export(
    plan: PlanData, path: str | Path, *, climb_m: float | None = None, force: bool = False
) -> tuple[Path, ...]:
    """Write the course of a plan; see `Plan.export`."""
    files, _ = exported(plan, path, climb_m=climb_m, force=force)
    write_files(files)
    return tuple(files)


def exported(
    plan: PlanData, path: str | Path, *, climb_m: float | None = None, force: bool = False
) -> Exported:
    """Return the files of a plan's course; see `Plan.export`."""
    file = path_of(path)
    suffix = ending_of(file, *SUFFIXES)
    refuse(climb_faults(climb_m, suffix))
    course = course_of(plan)
    if not (plan.flyable or force):
        why = "; ".join(plan.faults) or "its simulation failed or is missing; optuav audit"
        words = f"true; {why}. force = True (--force) exports the plan all the same"
        raise InputError([Fault("plan.flyable", shown(plan.flyable), words)])
    if suffix in MAPS:
        course = with_heights_told(course) if suffix == ".geojson" else course
        return Exported({file: MAPS[suffix](course).encode()}, course.notes[1:])
    height_m = CLIMB_M if climb_m is None else climb_m
    flights = [*course.flights]
    charges = flight_charges(plan.mission, plan.phases, height_m)
    if not force and any(charge.dry for charge in charges):
        words = f"with its climbs, the plan {EMPTY}.{more_reserve(plan.mission, charges)}"
        raise InputError(f"{words} force = True (--force) exports it all the same.")
    warnings = (
        *short(plan.mission, charges, "the plan"),
        *deadline_warning(plan.mission, plan.phases, height_m),
    )
    cost = [*climbs(plan.mission, len(flights), height_m)]
    notes = (*course.notes, *warnings, *cost)
    files = dict[Path, bytes]()
    for number, (flight, charge) in enumerate(zip(flights, charges, strict=True), start=1):
        name = f"{file.stem}-{number}" if len(flights) > 1 else file.stem
        title = f"{course.name}, flight {number} of {len(flights)}: {flight.words}"
        files |= flight_files(
            flight, file.with_name(f"{name}{file.suffix}"), height_m, course.altitude_m,
            (title, taken_off_with(charge), *notes), start_of(plan.mission, charge),
        )  # fmt: skip
    if (stale := _stale(file, files)) and not force:
        words = f"flights of another plan: {first_ten(stale)}; name another file, or delete them"
        raise refusal(file.parent, f"holds {words}")
    return Exported(files, notes[1:])


def _stale(file: Path, files: Iterable[Path]) -> list[str]:
    """Names of flights beside those of a file, such as hill-3.plan, that are not replaced."""
    written, name = (
        {path.name for path in files},
        re.compile(rf"{re.escape(file.stem)}(-[1-9]\d*)?"),
    )
    beside = file.parent.glob(f"*{file.suffix}")
    return sorted({path.name for path in beside if name.fullmatch(path.stem)} - written)


def climb_faults(climb_m: float | None, suffix: str) -> Iterator[Fault]:
    """Yield the faults of a climb for files of a suffix."""
    if climb_m is not None:
        yield from misfits(("climb_m", climb_m, CLIMB))
        if suffix in MAPS:
            yield Fault("climb_m", shown(climb_m), f"goes with {' and '.join(MISSIONS)}")


def with_heights_told(course: PlanOnEarth) -> PlanOnEarth:
    """The course with a note if it has no heights above the ellipsoid."""
    flat = course.start.ellipsoid_m is None
    return course._replace(notes=(*course.notes, NO_GEOID + ABOVE_SEA_LEVEL)) if flat else course


def flight_files(
    flight: Flight,
    file: Path,
    climb_m: float,
    altitude_m: float,
    notes: tuple[str, ...],
    judged_with: Mapping[str, object],
) -> dict[Path, bytes]:
    """The file of one flight; beside a text of waypoints, which has no place for it, its notes."""
    if file.suffix.lower() == ".plan":
        return {file: waypoints.plan(flight, climb_m, altitude_m, notes, judged_with).encode()}
    text = waypoints.waypoints(flight, climb_m, altitude_m)
    return {file: text.encode(), file.with_suffix(".txt"): ("\n".join(notes) + "\n").encode()}


def start_of(mission: Mission, charge: FlightCharge) -> dict[str, object]:
    """The start of a mission that is one flight; None for a full battery, none of packs in turn."""
    if mission.battery.takes_turns:
        return {}
    wells = None if charge.start is None else charge.start._asdict()
    return {"start": wells and {key: float(As) for key, As in wells.items()}}


def course_of(plan: PlanData) -> PlanOnEarth:
    """The places and waypoints of a plan on Earth, in its order, without hovers of no length."""
    mission, route = plan.mission, plan.route
    names = [*dict.fromkeys(route)]
    bent_m = [at for by in plan.waypoints_m for at in by]
    positions_m = scene(mission).positions(names)
    at_m = dict(zip(names, positions_m, strict=True))
    points = positions_on_earth(mission, np.array([*positions_m, *bent_m]))
    places, bends = dict(zip(names, points, strict=False)), iter(points[len(names) :])
    steps, tapers_s = [], tapers(mission, plan.phases)
    for number, phase in enumerate(plan.phases):
        if phase.kind != "hover" or phase.duration_s > 0.0:
            end, way = (
                phase.end_place,
                (*islice(bends, len(phase.waypoints_m)), places[phase.end_place]),
            )
            if phase.kind == "flight":
                way = (places[phase.start_place], *way)
            speeds_m_s = phase.peak_speed_m_s, level_speeds_m_s(mission, phase, at_m)
            full_s = tapers_s.get(number)
            steps.append(Step(phase.kind, end, way, phase.duration_s, *speeds_m_s, full_s))
    notes = (NOT_FLOWN, *plan.faults, *altitude_told(mission))
    return PlanOnEarth(mission.name, notes, altitude_m_of(mission), tuple(steps), route[0])


def tapers(mission: Mission, phases: Sequence[Phase]) -> dict[int, float]:
    """When less than the offered current begins to flow [s from its begin], by its number."""
    if mission.battery.charging != "taper" or mission.battery.takes_turns:
        return {}
    pool, begins_s, moments_s = mission.pool, dict[int, float](), dict[int, float]()
    for number, start_s, stage, before, _ in network_steps(mission, phases):
        begin_s = begins_s.setdefault(number, start_s)
        full_s = (
            float(time_to_full(pool, before, stage.current_A)) if stage.current_A > 0.0 else inf
        )
        if full_s < stage.duration_s:
            moments_s.setdefault(number, start_s - begin_s + full_s)
    return moments_s


def altitude_m_of(mission: Mission) -> float:
    """Altitude of the mission's z = 0 above mean sea level [m]."""
    return mission.earth.altitude_m if mission.earth else 0.0


def altitude_told(mission: Mission) -> Iterator[str]:
    """Yield that z = 0 is at sea level, which it is too where nothing is stated."""
    if altitude_m_of(mission) == 0.0:
        yield NO_ALTITUDE


def system_on_earth(mission: Mission) -> str:
    """The reference system of a mission; `InputError` if it has no place on Earth."""
    if (crs := stated_system(mission)) is None:
        raise InputError([Fault("crs", "", NO_EARTH)])
    return crs


def positions_on_earth(mission: Mission, position_m: Floats) -> list[Position]:
    """Places of a mission (place, 3) [m] on Earth; needs pyproj.

    Raises
    ------
    InputError
        If the mission states no reference system, or one that does not hold all places.
    """
    crs = system_on_earth(mission)
    require("pyproj", "exports")
    import pyproj

    ahead = pyproj.Transformer.from_crs(system_in_metres(crs), DEGREES, always_xy=True)
    degrees = np.column_stack(ahead.transform(*position_m[:, :2].T.tolist()))
    if not np.isfinite(degrees).all():
        words = "a reference system that holds all places of the plan"
        raise InputError([Fault("crs", crs, words)])
    angles = np.round(degrees, DIGITS)
    above_m = _above_ellipsoid_m(angles, position_m[:, 2] + altitude_m_of(mission))
    columns = *angles.T.tolist(), position_m[:, 2].tolist(), above_m
    return [Position(*row) for row in zip(*columns, strict=True)]


def _above_ellipsoid_m(degrees: Floats, altitude_m: Floats) -> list[float | None]:
    """Heights above the ellipsoid by the first geoid that pyproj has [m]; None without any."""
    import pyproj

    for grid in GEOIDS:
        try:
            above = pyproj.Transformer.from_pipeline(ABOVE_SEA.format(grid))
        except pyproj.exceptions.ProjError:
            continue
        longitudes_deg, latitudes_deg = degrees.T.tolist()
        above_m = above.transform(longitudes_deg, latitudes_deg, altitude_m.tolist())
        height_m = np.asarray(above_m[2])
        if np.isfinite(height_m).all():
            return [round(each_m, 3) for each_m in height_m.tolist()]
    return [None] * len(altitude_m)
