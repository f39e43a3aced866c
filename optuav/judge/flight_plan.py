"""A flight plan of a ground station, judged: time, charge and wells along it, and what is in reach.

Every leg is flown straight and from standing to standing, which takes longer than to pass a
waypoint without a stop.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from optuav.errors import Fault, InputError, collected, refuse, require
from optuav.fields import COORDINATE
from optuav.flight.model import CruisingModel, FlightModel
from optuav.judge.autopilot import SUFFIXES, flight_of
from optuav.judge.stated_flight import StatedFlight, StatedStep
from optuav.judge.timeline import DURATION, Itinerary, Move, Point, SimulatedPhase, phases, places
from optuav.judge.wells_along import Course
from optuav.mission import Mission, load
from optuav.mission.earth import DEGREES, plane, stated_system, system_in_metres
from optuav.mission.files import label, refusal
from optuav.mission.formats import HEAD, named
from optuav.mission.keys import stated_value
from optuav.mission.messages import first_ten, path_of, shown
from optuav.network.obstacles import CLEAR
from optuav.physics.kibam import Stage, step
from optuav.plan import Stop
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.export import altitude_m_of
from optuav.presentation.numbers import fixed, typed

if TYPE_CHECKING:
    import pyproj

SAME_PLACE_m = 2.0  # horizontal distance of places that are meant to be one
ROOFS = 3  # nearest roofs that are tried from a place
CHARGING = ("charge_current_A", "charge_power_W")  # keys of [flight] that a laser goes with
MILLIMETRE = 3  # decimals of places [m]
ROUNDING_m = 0.01  # distance of a place from a roof that rounded degrees may make
FAR_m = 5000.0  # from home to the nearest place of a mission that is not another's
JUDGED_WITH = ("start", "limits.deadline_s", "battery.charging", "laser")
"""Keys that a file of our own may state in place of the mission's; the laser only as left out."""
DIGITS = 9  # decimals of heights [m], as a plan states them


@dataclass(frozen=True, init=False)
class FlightPlan(Itinerary):
    r"""A flight plan as an itinerary: the moves of its items, at their speeds.

    Parameters
    ----------
    mission
        The mission that it is flown in, with the plan's ends as its route.
    stops
        Places in order.
    flown
        The moves, with the item of each.
    notes
        Sentences on what is not flown as the plan says.
    name
        Of its file.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> lines = ["QGC WPL 110", "0 1 0 16 0 0 0 0 52.5 13.4 34 1", "1 0 3 22 0 0 0 0 0 0 40 1"]
    >>> lines += ["2 0 3 16 0 0 0 0 52.502 13.4 40 1", "3 0 3 20 0 0 0 0 0 0 0 1"]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "there-and-back.waypoints"
    ...     _ = file.write_text("\n".join(lines))
    ...     judged = optuav.audit(file, "relay-today")
    >>> judged.flyable, [item for item, _ in judged.subject.flown]
    (True, ['item 1', 'item 2', 'item 3', 'item 3'])
    """

    flown: tuple[tuple[str, Move], ...]
    notes: tuple[str, ...]
    name: str

    def __init__(
        self,
        mission: Mission,
        flown: Sequence[tuple[str, Move]],
        notes: Sequence[str],
        name: str = "",
    ) -> None:
        stays = ((move.end_place, move) for _, move in flown)
        super().__init__(
            mission,
            [
                Stop(at, "rest" if move.kind == "rest" else "hover", move.duration_s)
                for at, move in stays
            ],
        )
        object.__setattr__(self, "flown", tuple(flown))
        object.__setattr__(self, "notes", tuple(notes))
        object.__setattr__(self, "name", name)

    def moves(self) -> Iterator[Move]:
        """Yield the moves in order."""
        yield from (move for _, move in self.flown)

    def named(self, flown: Sequence[SimulatedPhase]) -> Iterator[SimulatedPhase]:
        """Yield the phases with points called by the item that flies there, also once more."""
        here = flown[0].start.name if flown else ""
        for phase, (item, move) in zip(flown, self.flown, strict=True):
            start = phase.start._replace(name=here)
            if move.kind == "flight":
                here = phase.end.name if isinstance(move.end_place, str) else item
            yield replace(phase, start=start, end=phase.end._replace(name=here))


class Reached(NamedTuple):
    """A moment of a flight plan, and the places that are then in reach."""

    item: str
    what: str
    end_s: float
    charge: float  # share of the capacity in both wells
    available: float  # share of the full available well
    home: bool | None  # None where packs take turns
    roof: str  # nearest roof in reach, or empty


def read_flight(stated: str | Path, mission: Mission | str | Path) -> tuple[str, FlightPlan]:
    """The name of a file and its flight plan, flown by the drone of a mission."""
    words = "the path of a .plan, .waypoints or .kml"
    file = path_of(stated, "plan", words)
    flight, drone, faults = None, None, list[Fault]()
    with collected(faults):
        flight = flight_of(file)
    with collected(faults):
        drone = load(mission)
    refuse(faults)
    assert flight is not None
    assert drone is not None
    return label(file), placed(flight, drone, file)


def is_flight(stated: object) -> bool:
    """Return whether a path has the suffix of a flight plan, or leads to the content of one."""
    if not isinstance(stated, str | Path):
        return False
    file = Path(stated)
    if file.suffix.lower() in SUFFIXES or not file.is_file():
        return file.suffix.lower() in SUFFIXES
    try:
        with file.open("rb") as content:
            what = named(content.read(HEAD))
    except OSError:
        return False
    return what is not None and "optuav audit reads" in what.words


class Goal(NamedTuple):
    """A place that an item flies to [m], on a building perhaps, and its stay there."""

    item: str
    at_m: Point
    building: str = ""
    stay_s: float = 0.0
    speed_m_s: float = math.nan


def placed(flight: StatedFlight, drone: Mission, file: Path) -> FlightPlan:
    """A flight in the plane of a mission, or around home where the mission has no place on Earth.

    Home is at z = 0, unless the mission states the altitude of its z = 0, or begins there.
    """
    require("pyproj", "flight plans")
    import pyproj

    notes, system = [*flight.notes], stated_system(drone)
    altitude_m = None if system is None else altitude_m_of(drone)
    if system is None:
        if len(drone.buildings.names) or drone.laser is not None:
            words = "the mission has no place on Earth: its buildings and its laser are left out"
            notes.append(words)
        system, drone = plane(flight.home), _without_places(drone)
    drone, said = _as_judged(drone, flight.judged_with, file)
    notes += said
    ahead = pyproj.Transformer.from_crs(DEGREES, system_in_metres(system), always_xy=True)
    home = _home_m(flight, drone, ahead, altitude_m, file)
    point_m = partial(_point_m, flight, home, ahead, file)
    faults = list[Fault]()
    for target in flight.steps:
        with collected(faults):
            point_m(target, home)
    refuse(faults)
    goals = [*_on_roofs([*_goals(flight, home, point_m, drone, file)])]
    mission = drone.replace({"route.origin_m": home, "route.destination_m": goals[-1].at_m})
    notes += [] if stated_system(drone) is None else _far(home, drone)
    notes += _doubts(flight, goals, home, mission)
    flown = [*_moves(goals, home, mission)]
    notes += [] if flight.judged_with is not None else _lit(mission, flown)
    if not flown:
        raise refusal(file, "has no item that flies anywhere")
    return FlightPlan(mission, flown, notes, file.name)


def _without_places(drone: Mission) -> Mission:
    """A mission without its buildings and its laser."""
    return _without_laser(drone.replace({"buildings": []}))


def _without_laser(drone: Mission) -> Mission:
    """A mission without its laser and what goes with a laser."""
    beam = [key for key in ("laser", "receiver") if getattr(drone, key) is not None]
    charging = [f"flight.{key}" for key in CHARGING if getattr(drone.flight, key, None)]
    return drone.replace(dict.fromkeys([*beam, *charging]))


def _home_m(
    flight: StatedFlight,
    drone: Mission,
    ahead: pyproj.Transformer,
    altitude_m: float | None,
    file: Path,
) -> Point:
    """Home in the plane of a mission whose z = 0 has an altitude; the origin if it is there."""
    x, y, z = drone.route.origin_m
    home_x, home_y = np.round(ahead.transform(*flight.home), MILLIMETRE).tolist()
    if not math.isfinite(home_x + home_y):
        words = "a place that the mission's reference system holds"
        raise InputError([Fault("home", "", words, label(file))])
    if stated_system(drone) and math.dist((home_x, home_y), (x, y)) <= SAME_PLACE_m:
        return (x, y, z)
    if altitude_m is not None and math.isfinite(flight.home_altitude_m):
        return (home_x, home_y, round(flight.home_altitude_m - altitude_m, DIGITS))
    return (home_x, home_y, 0.0)


def _point_m(
    flight: StatedFlight,
    home: Point,
    ahead: pyproj.Transformer,
    file: Path,
    target: StatedStep,
    here: Point,
) -> Point:
    """Where a step of a flight goes from `here`; or an `InputError`."""
    place = here[:2]
    if math.isfinite(target.latitude_deg):
        at = ahead.transform(target.longitude_deg, target.latitude_deg)
        place = tuple(np.round(at, MILLIMETRE).tolist())
    base_m = home[2] - (flight.home_altitude_m if target.over == "sea" else 0.0)
    if not DURATION.accepts(target.stay_s):
        raise InputError(
            [Fault(target.item, f"{typed(target.stay_s)} s", DURATION.words, label(file))]
        )
    point = (*place, round(target.height_m + base_m, DIGITS))
    if not np.isfinite(point).all():
        words = "a height over home, as the altitude of home is unknown"
        raise InputError([Fault(target.item, "", words, label(file))])
    if not all(map(COORDINATE.accepts, point)):
        words = f"x, y and z around home: {COORDINATE.words}"
        raise InputError([Fault(target.item, shown(point), words, label(file))])
    return point


def _doubts(
    flight: StatedFlight, goals: Sequence[Goal], home: Point, mission: Mission
) -> Iterator[str]:
    """Yield sentences on speeds that do not count, on heights, and on an end in the air."""
    cruises = isinstance(mission.flight_model, CruisingModel)
    if not cruises and any(math.isfinite(goal.speed_m_s) for goal in goals):
        model = f'flight.model = "{mission.flight.model}"'
        yield f"legs are flown at the speeds of {model}, not at those of the plan"
    first, last = flight.steps[0], flight.steps[-1]
    if first.kind == "take-off" and goals[0].at_m[2] < home[2]:
        words = f"takes off downwards, by {fixed(home[2] - goals[0].at_m[2], 0)} m"
        yield f"{first.item} {words}: are its heights over home, not above the sea?"
    yield from _below_ground(goals)
    if last.kind not in ("land", "return") and goals[-1].at_m[2] > home[2]:
        yield f"the plan ends in the air at {last.item}, without a landing"


def _as_judged(
    drone: Mission, judged_with: Mapping[str, Any] | None, file: Path
) -> tuple[Mission, list[str]]:
    """The mission with the values that a file of our own was judged with, and what they change."""
    stated, source = judged_with or {}, label(file)
    faults = [
        Fault(f"judged_with.{key}", "", f"is none of {', '.join(JUDGED_WITH)}", source)
        for key in stated.keys() - {*JUDGED_WITH}
    ]
    if stated.get("laser") is not None:
        faults.append(Fault("judged_with.laser", shown(stated["laser"]), "left out: null", source))
    refuse(faults)
    values = {key: value for key, value in stated.items() if key != "laser"}
    try:
        judged = drone.replace(values)
    except InputError as error:
        raise InputError(
            replace(fault, key=f"judged_with.{fault.key}", source=source) for fault in error.faults
        ) from None
    dark = "laser" in stated and drone.laser is not None
    changes = [
        f"{key} = {json.dumps(values[key])}"
        for key in values.keys() - {"start"}
        if stated_value(judged, key) != stated_value(drone, key)
    ]
    changes += ["the charge at take-off"] * (judged.start != drone.start)
    changes += ["no laser, as none lights the hover"] * dark
    notes = list[str]()
    if changes:
        words = "judged as the file says, in place of the mission"
        notes.append(f"{words}: {', '.join(sorted(changes))}")
    if drone.start is None and "start" not in stated:
        words = "the battery is assumed full at take-off"
        notes.append(f"{words}: state another charge by [start] in the mission")
    return _without_laser(judged) if dark else judged, notes


def _far(home: Point, drone: Mission) -> Iterator[str]:
    """Yield that home is far from every roof and from the ends of the mission's route."""
    route = drone.route
    places_m = np.array([route.origin_m, route.destination_m, *drone.buildings.roof_m.tolist()])
    away_m = float(np.hypot(*(places_m[:, :2] - home[:2]).T).min())
    if away_m > FAR_m:
        words = f"{fixed(away_m / 1000.0, 1)} km away from the nearest place of the mission"
        yield f"home is {words}: is it the mission of this plan?"


def _lit(mission: Mission, flown: Sequence[tuple[str, Move]]) -> Iterator[str]:
    """Yield which stays the mission's laser lights, as a plan does not say that."""
    stays = [(item, move) for item, move in flown if move.kind != "flight"]
    at = places(mission, [move for _, move in stays]) if stays and mission.laser else {}
    lit = [item for item, move in stays if at and at[move.end_place].received.power_W > 0.0]
    if lit:
        words = "leave [laser] out of the mission if it does not"
        yield f"the mission's laser charges the drone at {first_ten(lit)}: {words}"


def _below_ground(goals: Sequence[Goal]) -> Iterator[str]:
    """Yield a sentence on the lowest place if it is below z = 0, a mission's ground."""
    lowest = min(goals, key=lambda goal: goal.at_m[2])
    if lowest.at_m[2] < -ROUNDING_m:
        place = f"{lowest.item} lies {fixed(-lowest.at_m[2], 1)} m below z = 0"
        yield f"{place}: optuav knows no terrain and cannot tell whether the ground is lower there"


def _goals(
    flight: StatedFlight,
    home: Point,
    point_m: Callable[[StatedStep, Point], Point],
    drone: Mission,
    file: Path,
) -> Iterator[Goal]:
    """The places of a flight: straight up at a take-off, level and then down to a landing."""
    here, roofs_m = home, drone.buildings.roof_m
    for target in flight.steps:
        at_m, building = point_m(target, here), ""
        apart_m = math.dist(at_m[:2], here[:2])
        if target.kind in ("land", "return") and math.dist(at_m[:2], home[:2]) <= SAME_PLACE_m:
            at_m = (*home[:2], at_m[2])
        if target.kind == "rest":
            near = np.flatnonzero(np.hypot(*(roofs_m[:, :2] - at_m[:2]).T) <= SAME_PLACE_m)
            if not len(near):
                words = "lands on the way, but not at a roof of the mission, where it could rest"
                raise InputError([Fault(target.item, "", words, label(file))])
            building = drone.buildings.names[int(near[0])]
            x, y, z = roofs_m[int(near[0])].tolist()
            at_m = (x, y, z)
        elif target.kind == "take-off" and apart_m > SAME_PLACE_m:
            yield Goal(target.item, (*here[:2], at_m[2]))
        elif target.kind == "take-off":
            at_m = (*here[:2], at_m[2])
        elif target.kind in ("land", "return") and apart_m > SAME_PLACE_m:
            yield Goal(target.item, (*at_m[:2], here[2]), speed_m_s=target.speed_m_s)
        yield Goal(target.item, at_m, building, target.stay_s, target.speed_m_s)
        here = at_m


def _on_roofs(goals: Sequence[Goal]) -> Iterator[Goal]:
    """The places of a flight; those at which it also rests are on that building."""
    rests = [goal for goal in goals if goal.building]
    for goal in goals:
        near = (rest for rest in rests if math.dist(rest.at_m, goal.at_m) <= ROUNDING_m)
        roof = goal if goal.stay_s else next(near, goal)
        yield goal._replace(at_m=roof.at_m, building=roof.building)


def _moves(goals: Sequence[Goal], home: Point, mission: Mission) -> Iterator[tuple[str, Move]]:
    """Flights from each place to the next, and stays; the last place is the destination."""
    model, here, here_m = mission.flight_model, "origin", home
    before_m = [home, *(goal.at_m for goal in goals[:-1])]
    pairs = enumerate(zip(goals, before_m, strict=True))
    last = max((number for number, (goal, m) in pairs if goal.at_m != m), default=-1)
    place: str | Point = here
    for number, goal in enumerate(goals):
        if goal.at_m != here_m:
            (x, y, z), (u, v, w) = here_m, goal.at_m
            way_m = (u - x, v - y, w - z)
            speeds = _speeds(model, way_m, goal.speed_m_s)
            to: str | Point = "destination" if number == last else goal.building or goal.at_m
            yield goal.item, Move("flight", place, to, 0.0, None, (), speeds)
            place, here_m = to, goal.at_m
        if goal.stay_s > 0.0:
            yield goal.item, Move("rest" if goal.building else "hover", place, place, goal.stay_s)


def _speeds(model: FlightModel, way_m: Point, stated_m_s: float) -> tuple[float, ...]:
    """The level speed of a leg whose level speed is stated, as far as it gets there [m/s].

    None of a leg without a stated speed, straight up or down, or in a model with its own speeds.
    """
    level = math.hypot(*way_m[:2]) / math.hypot(*way_m)
    if not (isinstance(model, CruisingModel) and level > 0.0 and math.isfinite(stated_m_s)):
        return ()
    leg = model.leg_at(way_m, stated_m_s)
    return (level * float(leg.peak_speed_m_s),)


def reached(
    plan: FlightPlan, flown: Sequence[SimulatedPhase], course: Course
) -> tuple[Reached, ...]:
    """The charge after every move, and whether home or a roof can be reached from there."""
    mission, pool = plan.mission, course.pack
    full_As, capacity_As = float(pool.full.available_As), float(mission.pool.capacity_As)
    buildings, tries = mission.buildings, list[tuple[int, Move]]()
    pooled = not mission.battery.takes_turns
    for number, (phase, (_, move)) in enumerate(zip(flown, plan.flown, strict=True)):
        if not pooled:
            break
        away_m = np.hypot(*(buildings.roof_m[:, :2] - phase.end.position_m[:2]).T)
        roofs = [buildings.names[k] for k in np.argsort(away_m)[:ROOFS]]
        tries += [(number, Move("flight", move.end_place, to, 0.0, None, ())) for to in roofs]
        tries.append((number, Move("flight", move.end_place, "origin", 0.0, None, ())))
    moves = [move for _, move in tries]
    legs = phases(mission, places(mission, moves), moves) if moves else ()
    home: list[bool | None] = [False if pooled else None] * len(flown)
    roof = [""] * len(flown)
    for (number, move), leg in zip(tries, legs, strict=True):
        wells, fits = course.ends[number][0], leg.crosses == CLEAR
        for stage in leg.stages:
            wells = step(pool, wells, Stage(stage.net.current_A, stage.duration_s))
            fits &= float(wells.available_As) >= -JUDGE_TOLERANCE * capacity_As
        left = float(wells.total_As) / capacity_As
        if fits and left >= mission.limits.min_soc - JUDGE_TOLERANCE:
            if move.end_place == "origin":
                home[number] = True
            else:
                roof[number] = roof[number] or str(move.end_place)
    rows = list[Reached]()
    for number, (phase, (item, _)) in enumerate(zip(flown, plan.flown, strict=True)):
        wells_of = course.ends[number]
        charge = sum(float(wells.total_As) for wells in wells_of) / capacity_As
        available = sum(float(wells.available_As) for wells in wells_of)
        share = available / (full_As * len(wells_of))
        figures = phase.end_s, charge, share, home[number], roof[number]
        rows.append(Reached(item, kind_of(phase), *figures))
    return tuple(rows)


def kind_of(phase: SimulatedPhase) -> str:
    """The kind of a phase; a flight straight up or down by its direction."""
    (x, y, z), *_, (u, v, w) = phase.points_m
    if phase.kind == "flight" and math.hypot(u - x, v - y) <= SAME_PLACE_m:
        return "climb" if w > z else "descent"
    return phase.kind
