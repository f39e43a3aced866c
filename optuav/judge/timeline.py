"""The phases of a plan, computed again from its mission: places, stages, loads and motion."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import refuse
from optuav.fields import COORDINATE, Range
from optuav.flight.model import CruisingModel, FlightModel
from optuav.mission import Mission, load
from optuav.mission.forms import SCHEMA
from optuav.mission.messages import nearest
from optuav.mission.validation import Breach, StatedMission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, crossed, roofs_below
from optuav.network.places import ends_of
from optuav.network.prisms import prisms
from optuav.network.ways import build_ways
from optuav.physics.flight import Flow, Loads
from optuav.physics.quantity import Vector
from optuav.plan import Phase as Planned
from optuav.plan import Plan, Stop
from optuav.presentation.numbers import coordinates

Kind = Literal["flight", "hover", "rest"]
NOTHING = Flow(0.0, 0.0)
Point = tuple[float, float, float]
DURATION = Range("s", ge=0, le=1e7)


@dataclass(frozen=True, init=False)
class Itinerary:
    """Stops in order, from origin to destination; optuav adds the legs between them.

    Parameters
    ----------
    mission
        The mission, or its name or path.
    stops
        Any number, in order; a building may be visited again. The stops of a plan also work.

    Raises
    ------
    InputError
        If a stop names no place of the mission, is not a rest or hover, or its duration is
        out of range.

    Examples
    --------
    >>> import optuav
    >>> stops = (optuav.Stop("b9", "rest", 231.8), optuav.Stop("hover", "hover", 605.4))
    >>> itinerary = optuav.Itinerary(optuav.load("paper"), stops)
    >>> [stop.at for stop in itinerary.stops]
    ['b9', 'hover']
    """

    mission: Mission
    stops: tuple[Stop, ...]

    def __init__(self, mission: Mission | str | Path, stops: Stop | Iterable[Stop]) -> None:
        listed = [stops] if isinstance(stops, Stop) or not isinstance(stops, Iterable) else stops
        as_tables = [_stated(stop) if isinstance(stop, Stop) else stop for stop in listed]
        object.__setattr__(self, "mission", load(mission))
        refuse(StatedMission({"stops": as_tables}).faults(stop_breaches(as_tables, self.mission)))
        object.__setattr__(self, "stops", tuple(Stop(**table) for table in as_tables))

    def to_dict(self) -> dict[str, object]:
        """Return the itinerary as plain data, ready for JSON and for `optuav.audit`."""
        stops = [*map(_stated, self.stops)]
        return {"schema": SCHEMA, "mission": self.mission.to_dict(), "stops": stops}

    def moves(self) -> Iterator["Move"]:
        """Yield the flights between the stops, and the stays, in order."""
        here: str | Point = "origin"
        for stop in self.stops:
            if stop.at != here:
                yield Move("flight", here, stop.at)
            yield Move(stop.kind, stop.at, stop.at, stop.duration_s)
            here = stop.at
        if here != "destination":
            yield Move("flight", here, "destination")


def _stated(stop: Stop) -> dict[str, Any]:
    """The keys of a stop with their values."""
    return {key: getattr(stop, key) for key in ALLOWED}


def _is_place(at: object) -> bool:
    """Return whether a value may be the name of a place, or is a point [m]."""
    if isinstance(at, str):
        return True
    at = at.tolist() if isinstance(at, np.ndarray) else at
    return isinstance(at, list | tuple) and len(at) == 3 and all(map(COORDINATE.accepts, at))


ALLOWED: Mapping[str, tuple[str, Callable[[object], bool]]] = {
    "at": ("the name of a place, or [x, y, z] [m] to hover at", _is_place),
    "kind": ('"rest" or "hover"', lambda value: value in ("rest", "hover")),
    "duration_s": (DURATION.words, DURATION.accepts),
}
"""The keys of a stop: allowed values in words, and a test."""
STOP = f"a table (in Python a Stop) with {', '.join(ALLOWED)}"


def stop_breaches(stops: Sequence[object], mission: Mission | None) -> Iterator[Breach]:
    """Yield the faults of stated stops; places are judged if the mission is known."""
    place_names = (*ends_of(mission), *mission.buildings.names) if mission else ()
    for number, stop in enumerate(stops):
        if not isinstance(stop, dict):
            yield Breach(("stops", number), STOP)
            continue
        for name in {**ALLOWED, **stop}:
            key, (words, fits) = ("stops", number, name), ALLOWED.get(name, ("", bool))
            if not words:
                yield Breach(key, f"unknown key{nearest(name, ALLOWED)}")
            elif name not in stop:
                yield Breach(key, f"is missing; {words}")
            elif not fits(stop[name]):
                yield Breach(key, words)
            elif (
                mission
                and name == "at"
                and isinstance(at := stop[name], str)
                and at not in place_names
            ):
                hint = nearest(at, place_names)
                yield Breach(key, f"is not a place of the mission {mission.name}{hint}")


class Move(NamedTuple):
    """A kind of phase, its places, and a stay's duration [s]; the phase if the user stated it.

    A plan's leg has waypoints [m], perhaps none; an itinerary's leg has the mission's way. Its
    segments have speeds [m/s] where the plan states them, else the mission's.
    """

    kind: Kind
    start_place: str | Point
    end_place: str | Point
    duration_s: float = 0.0
    stated: Planned | None = None
    waypoints_m: tuple[Point, ...] | None = None
    speeds_m_s: tuple[float, ...] = ()


def moves(subject: Plan | Itinerary) -> Iterator[Move]:
    """The moves of a plan or an itinerary, in order."""
    if isinstance(subject, Plan):
        for phase in subject.phases:
            stay = phase.kind, phase.start_place, phase.end_place, phase.duration_s
            edited = phase if phase.edited else None
            yield Move(*stay, edited, phase.waypoints_m, phase.speeds_m_s)
        return
    yield from subject.moves()


class Place(NamedTuple):
    """A place, with the number of its building (−1 if none) and the laser's power for a stay.

    The position (x, y, z) [m] is NaN for a hover point that does not exist.
    """

    name: str
    building: int
    roof: int  # Number of the building on whose roof it stands, −1 if none
    position_m: Point
    sight: bool
    received: Flow


class SimulatedStage(NamedTuple):
    """A stage of constant current, from its start counted from take-off, and its flows."""

    name: str  # On a leg that of the flight model's stage, else the kind of the phase
    start_s: float
    duration_s: float
    drawn: Flow
    received: Flow

    @property
    def end_s(self) -> float:
        """End, counted from take-off [s]."""
        return self.start_s + self.duration_s

    @property
    def net(self) -> Flow:
        """Current [A] and power [W] into the battery."""
        (drawn_A, drawn_W), (received_A, received_W) = self.drawn, self.received
        return Flow(float(received_A - drawn_A), float(received_W - drawn_W))


@dataclass(frozen=True)
class SimulatedPhase:
    """A leg, a hover or a rest, with its stages in order, at least one.

    A leg has a length, a peak speed, waypoints, and perhaps stated speeds of its segments.
    """

    kind: Kind
    start: Place
    end: Place
    start_s: float  # Counted from take-off, as the end
    end_s: float
    stages: tuple[SimulatedStage, ...]
    distance_m: float
    peak_speed_m_s: float
    crosses: int  # Number of a building in the way of a leg, −1 if it is clear
    stated: bool  # Whether its figures are the user's
    waypoints_m: tuple[Point, ...]
    speeds_m_s: tuple[float, ...]
    # Between its points, by the flight model; none of stays and where the user stated figures
    segments: tuple[Loads, ...] = field(compare=False, repr=False)

    @cached_property
    def duration_s(self) -> float:
        """Duration [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def points_m(self) -> list[Point]:
        """Start, waypoints and end [m]."""
        return [self.start.position_m, *self.waypoints_m, self.end.position_m]


def places(mission: Mission, planned: Sequence[Move]) -> dict[str | Point, Place]:
    """The places of some moves by name or point, and the laser's power where they stay."""
    route, laser = mission.route, mission.laser
    first_m, *others_m = vehicle.hover_points_m(mission)
    ends_m = route.origin_m, first_m, route.destination_m, *others_m
    names = [*dict.fromkeys(end for move in planned for end in move[1:3])]
    known: dict[str | Point, tuple[int, Vector]] = {
        name: (CLEAR, point_m) for name, point_m in zip(ends_of(mission), ends_m, strict=True)
    }
    known |= {point: (CLEAR, point) for point in names if not isinstance(point, str)}
    wanted, stays = {*names}, {move.end_place for move in planned if move.kind != "flight"}
    for number, roof in enumerate(mission.buildings.names):
        if roof in wanted:
            known[roof] = number, tuple(mission.buildings.roof_m[number])
    numbers, points_m = zip(*(known[name] for name in names), strict=True)
    building, at_m = np.array(numbers, dtype=np.intp), np.array(points_m, dtype=float)
    roofs = np.where(building == CLEAR, roofs_below(mission.buildings, at_m), building).tolist()
    sights: Sequence[bool] = [False] * len(names)
    if laser is not None:
        from_m, to_m = np.broadcast_arrays(laser.position_m, at_m)
        blockers = crossed(prisms(mission.buildings), from_m, to_m, building[:, None])
        sights = ((blockers == CLEAR) & ~np.isnan(to_m[:, 0])).tolist()
    by_name = dict[str | Point, Place]()
    of_places = zip(names, numbers, roofs, at_m.tolist(), sights, strict=True)
    for name, number, roof, (x, y, z), sight in of_places:
        received = vehicle.charging(mission, (x, y, z)) if sight and name in stays else NOTHING
        words = name if isinstance(name, str) else coordinates((x, y, z), 10)
        by_name[name] = Place(words, number, roof, (x, y, z), sight, received)
    return by_name


def phases(
    mission: Mission, at: Mapping[str | Point, Place], planned: Sequence[Move]
) -> tuple[SimulatedPhase, ...]:
    """The phases of some moves between places that are known."""
    flight = mission.flight_model
    loads = {"hover": vehicle.hover_load(mission), "rest": flight.rest()}
    simulated, start_s = list[SimulatedPhase](), 0.0
    ends = [(at[move.start_place], at[move.end_place]) for move in planned]
    bends = _ways(mission, planned, ends)
    for move, (start, end), (blocker, waypoints_m) in zip(planned, ends, bends, strict=True):
        user, length_m, peak_m_s, legs = move.stated, 0.0, 0.0, list[Loads]()
        rows = list[tuple[str, float, Flow, Flow]]()
        if user is not None:  # the load of a stay is computed all the same
            length_m, peak_m_s = user.distance_m, user.peak_speed_m_s
            for stage in user.stages:
                drawn = loads.get(move.kind, Flow(-stage.current_A, -stage.power_W))
                received = stage.current_A + drawn.current_A, stage.power_W + drawn.power_W
                rows.append((move.kind, stage.duration_s, drawn, Flow(*received)))
        elif move.kind != "flight":
            rows.append((move.kind, move.duration_s, loads[move.kind], end.received))
        else:
            points_m = [start.position_m, *waypoints_m, end.position_m]
            length_m = sum(math.dist(*ends) for ends in pairwise(points_m))
            legs = segments(flight, points_m, move.speeds_m_s)
            for flown in legs:
                peak_m_s = max(peak_m_s, float(flown.peak_speed_m_s))
                flows = map(Flow, flown.currents_A, flown.powers_W)
                named = zip(flown.stages, flown.durations_s, flows, strict=True)
                rows += [(*stage, NOTHING) for stage in named]
        stages, end_s = list[SimulatedStage](), start_s
        for name, duration_s, drawn, received in rows:
            stages.append(SimulatedStage(name, end_s, float(duration_s), drawn, received))
            end_s = stages[-1].end_s
        crosses = blocker if move.kind == "flight" and user is None else CLEAR
        ways = waypoints_m, move.speeds_m_s, tuple(legs)
        figures = length_m, peak_m_s, crosses, user is not None, *ways
        phase = SimulatedPhase(move.kind, start, end, start_s, end_s, tuple(stages), *figures)
        simulated.append(phase)
        start_s = end_s
    return tuple(simulated)


def _ways(
    mission: Mission, planned: Sequence[Move], ends: Sequence[tuple[Place, Place]]
) -> Iterator[tuple[int, tuple[Point, ...]]]:
    """By move, a building that its straight way crosses, −1 for none, and its waypoints [m]."""
    rule, none = mission.flight.obstacle_rule, np.empty((len(ends), 0, 3))
    blockers, waypoints_m = np.full(len(ends), CLEAR), none
    if rule != "ignore":
        ends_m = np.array([[place.position_m for place in pair] for pair in ends])
        roofs = np.array([[place.roof for place in pair] for pair in ends])
        blockers = crossed(prisms(mission.buildings), ends_m[:, 0], ends_m[:, 1], roofs)
        if rule != "refuse" and any(move.waypoints_m is None for move in planned):
            lines = np.arange(2 * len(ends)).reshape(-1, 2)
            # A way is found from the place that comes first in the mission.
            rank = {name: number for number, name in enumerate(ends_of(mission))}
            ranks = [[rank.get(at.name, at.building + len(rank)) for at in pair] for pair in ends]
            turned = np.array([start > end for start, end in ranks])
            lines[turned] = lines[turned, ::-1]
            roofs[turned] = roofs[turned, ::-1]
            town = (mission.buildings,)
            ways = build_ways(mission, town, ends_m.reshape(1, -1, 3), lines, roofs)
            blockers, waypoints_m = ways.blocker[0], ways.of_legs(np.arange(len(ends)), turned)[0]
    for move, blocker, bent_m in zip(planned, blockers.tolist(), waypoints_m, strict=True):
        bends_m = move.waypoints_m
        if bends_m is None:
            bends_m = tuple(map(tuple, bent_m[np.isfinite(bent_m[:, 0])].tolist()))
        yield CLEAR if bends_m else blocker, bends_m


def segments(
    flight: FlightModel, points_m: Sequence[Point], speeds_m_s: Sequence[float] = ()
) -> list[Loads]:
    """Legs from rest to rest along points (x, y, z) [m], at the mission's speeds or at others."""
    ways = ways_along(points_m)
    if not speeds_m_s:
        return [flight.leg(way_m) for way_m in ways]
    assert isinstance(flight, CruisingModel)  # A plan over another has no speeds
    return [flight.leg_at(*way_and_speed) for way_and_speed in zip(ways, speeds_m_s, strict=True)]


def ways_along(points_m: Sequence[Point]) -> list[Point]:
    """The ways from one point to the next [m]."""
    return [(d - a, e - b, f - c) for (a, b, c), (d, e, f) in pairwise(points_m)]


def motion(mission: Mission, phase: SimulatedPhase, passed_s: Floats) -> dict[str, Floats]:
    """Motion at moments since a phase began [s], as columns of a `Trace`.

    A leg with stated figures is flown at constant speed; its attitude is unknown (NaN), as in
    flight models that have none.
    """
    moved_m, speed_m_s = np.zeros((len(passed_s), 3)), np.zeros_like(passed_s)
    pitch_rad = roll_rad = np.full_like(passed_s, np.nan if phase.kind == "flight" else 0.0)
    points_m = np.array(phase.points_m) - phase.points_m[0]
    if phase.stated and phase.kind == "flight":
        along_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points_m, axis=0), axis=1)))
        flown_m = passed_s / phase.duration_s * along_m[-1]
        moved_m = np.stack([np.interp(flown_m, along_m, x) for x in points_m.T], axis=1)
        speed_m_s = np.full_like(passed_s, phase.distance_m / phase.duration_s)
    elif phase.kind == "flight":
        begins_s = np.cumsum([0.0, *(float(leg.duration_s) for leg in phase.segments[:-1])])
        leg_numbers = np.searchsorted(begins_s, passed_s, side="right") - 1
        pitch_rad, roll_rad = np.zeros((2, len(passed_s)))
        for k, leg in enumerate(phase.segments):
            state = mission.flight_model.state(leg, passed_s[at := leg_numbers == k] - begins_s[k])
            moved_m[at] = points_m[k] + np.stack(state.position_m, axis=1)
            speed_m_s[at] = state.speed_m_s
            pitch_rad[at], roll_rad[at] = state.attitude
    position_m = np.array(phase.start.position_m) + moved_m
    columns = {"position_m": position_m, "speed_m_s": speed_m_s}
    return {**columns, "pitch_rad": pitch_rad, "roll_rad": roll_rad}
