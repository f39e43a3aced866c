"""The phases of a plan, computed again from its mission: places, stages, loads and motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, Prisms, crossed, prisms
from optuav.network.places import ENDS
from optuav.network.vehicle import Flow
from optuav.physics import flight
from optuav.physics.trajectory import regime_motion, state_at
from optuav.plan import Phase as Planned
from optuav.plan import Plan

Kind = Literal["flight", "hover", "rest"]
NOTHING = Flow(0.0, 0.0)
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Stop:
    """A stay at one place.

    Parameters
    ----------
    at
        Name of a place: ``"hover"``, a building's, ``"origin"`` or ``"destination"``.
    kind
        ``"rest"`` or ``"hover"``.
    duration_s
        For how long [s], ≥ 0.
    """

    at: str
    kind: Literal["rest", "hover"]
    duration_s: float


@dataclass(frozen=True)
class Itinerary:
    """Stops in order, from origin to destination; the legs between them follow.

    Parameters
    ----------
    mission
        The mission in which it is flown.
    stops
        Any number, in order; a building may be visited again.

    Examples
    --------
    >>> import optuav
    >>> from optuav.judge import Stop
    >>> stops = (Stop("b9", "rest", 231.8), Stop("hover", "hover", 605.4))
    >>> itinerary = optuav.Itinerary(optuav.load("paper"), stops)
    >>> [stop.at for stop in itinerary.stops]
    ['b9', 'hover']
    """

    mission: Mission
    stops: tuple[Stop, ...]


class Move(NamedTuple):
    """A kind of phase, its places, and a stay's duration [s]; the phase if the user stated it."""

    kind: Kind
    start_place: str
    end_place: str
    duration_s: float = 0.0
    stated: Planned | None = None


def moves(subject: Plan | Itinerary) -> Iterator[Move]:
    """The moves of a plan or an itinerary, in order."""
    if isinstance(subject, Plan):
        for each in subject.phases:
            stated = each if each.edited else None
            yield Move(each.kind, each.start_place, each.end_place, each.duration_s, stated)
        return
    here = "origin"
    for stop in subject.stops:
        if stop.at != here:
            yield Move("flight", here, stop.at)
        yield Move(stop.kind, stop.at, stop.at, stop.duration_s)
        here = stop.at
    if here != "destination":
        yield Move("flight", here, "destination")


@dataclass(frozen=True)
class Place:
    """A place, with the number of its building (−1 if none) and what the laser gives there.

    The position (x, y, z) [m] is NaN for a hover point that does not exist.
    """

    name: str
    building: int
    position_m: Point
    sight: bool
    received: Flow

    def way_to(self, end: Place) -> Point:
        """Displacement to another place [m]."""
        x, y, z = (b - a for a, b in zip(self.position_m, end.position_m, strict=True))
        return x, y, z


@dataclass(frozen=True)
class Stage:
    """A stage of constant current: start, counted from take-off, duration, and what flows.

    The name is ``"turn"``, ``"accelerate"`` or ``"brake"`` on a leg of six stages; ``"flight"``,
    ``"hover"`` or ``"rest"`` otherwise.
    """

    name: str
    start_s: float
    duration_s: float
    drawn: Flow
    received: Flow

    @property
    def current_A(self) -> float:
        """Net, into the battery [A]."""
        return float(self.received.current_A - self.drawn.current_A)

    @property
    def power_W(self) -> float:
        """Net, into the battery [W]."""
        return float(self.received.power_W - self.drawn.power_W)


@dataclass(frozen=True)
class Phase:
    """A leg, a hover or a rest, with its stages in order, at least one.

    A leg has a length, a peak speed, and the number of a building in the way, −1 if there is none.
    The figures of a stated phase are the user's.
    """

    kind: Kind
    start: Place
    end: Place
    stages: tuple[Stage, ...]
    distance_m: float = 0.0
    peak_speed_m_s: float = 0.0
    crosses: int = CLEAR
    stated: bool = False

    @property
    def start_s(self) -> float:
        """Start, counted from take-off [s]."""
        return self.stages[0].start_s

    @cached_property
    def duration_s(self) -> float:
        """Duration [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def end_s(self) -> float:
        """End, counted from take-off [s]."""
        return self.stages[-1].start_s + self.stages[-1].duration_s


class Site:
    """The places of a mission, the laser's reach there, and the buildings between them."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self._numbers = {building.name: k for k, building in enumerate(mission.buildings)}
        self._places: dict[str, Place] = {}

    @cached_property
    def _obstacles(self) -> Prisms:
        return prisms(self.mission)

    def place(self, name: str) -> Place:
        """A place by its name."""
        if name not in self._places:
            number = self._numbers.get(name, CLEAR)
            position_m, laser = self._position_m(name, number), self.mission.laser
            sight, received = False, NOTHING
            if laser is not None and not math.isnan(position_m[0]):
                sight = self._between(laser.position_m, position_m, (number,)) == CLEAR
                if sight:
                    distance_m = math.dist(laser.position_m, position_m)
                    received = vehicle.charging(self.mission, distance_m)
            self._places[name] = Place(name, number, position_m, sight, received)
        return self._places[name]

    def crossed(self, start: Place, end: Place) -> int:
        """Number of a building through which the straight line between two places runs, or −1."""
        if self.mission.flight.through_buildings:
            return CLEAR
        return self._between(start.position_m, end.position_m, (start.building, end.building))

    def _position_m(self, name: str, number: int) -> Point:
        route = self.mission.route
        if number != CLEAR:
            return self.mission.buildings[number].position_m
        origin, hover, _ = ENDS
        if name == hover:
            x, y, z = map(float, vehicle.hover_point_m(self.mission))
            return x, y, z
        return route.origin_m if name == origin else route.destination_m

    def _between(self, start_m: Point, end_m: Point, exempt: tuple[int, ...]) -> int:
        start, end = np.array([start_m], dtype=float), np.array([end_m], dtype=float)
        return int(crossed(self._obstacles, start, end, np.array([exempt], dtype=np.intp))[0])


def phases(site: Site, planned: Sequence[Move]) -> tuple[Phase, ...]:
    """The phases of some moves; durations are NaN where the UAV cannot fly."""
    found: list[Phase] = []
    start_s = 0.0
    for move in planned:
        found.append(_phase(site, move, start_s))
        start_s = found[-1].end_s
    return tuple(found)


def _phase(site: Site, move: Move, start_s: float) -> Phase:
    start, end = site.place(move.start_place), site.place(move.end_place)
    if move.stated is not None:
        stages = tuple(_stated(site.mission, move.stated, start_s))
        speed_m_s = move.stated.peak_speed_m_s
        return Phase(move.kind, start, end, stages, move.stated.distance_m, speed_m_s, stated=True)
    if move.kind != "flight":
        drawn = _drawn(site.mission, move.kind)
        stay = Stage(move.kind, start_s, move.duration_s, drawn, end.received)
        return Phase(move.kind, start, end, (stay,))
    way_m = start.way_to(end)
    loads, peak = vehicle.leg_loads(site.mission, way_m)
    stages = tuple(_flown(loads, start_s))
    crosses = site.crossed(start, end)
    return Phase("flight", start, end, stages, math.hypot(*way_m), float(peak), crosses)


def _drawn(mission: Mission, kind: Kind) -> Flow:
    return (vehicle.hover_load if kind == "hover" else vehicle.rest_load)(mission)


def _stated(mission: Mission, phase: Planned, start_s: float) -> Iterator[Stage]:
    """Stages as the user stated them; what a stay draws is computed all the same."""
    drawn = _drawn(mission, phase.kind)
    for stage in phase.stages:
        if phase.kind == "flight":
            drawn, received = Flow(-stage.current_A, -stage.power_W), NOTHING
        else:
            received = Flow(stage.current_A + drawn.current_A, stage.power_W + drawn.power_W)
        yield Stage(phase.kind, start_s, stage.duration_s, drawn, received)
        start_s += stage.duration_s


def _flown(loads: flight.Loads, start_s: float) -> Iterator[Stage]:
    names = flight.STAGES if len(loads.durations_s) > 1 else ("flight",)
    columns = (loads.durations_s, loads.currents_A, loads.powers_W)
    for name, duration_s, *drawn in zip(names, *columns, strict=True):
        yield Stage(name, start_s, float(duration_s), Flow(*map(float, drawn)), NOTHING)
        start_s += float(duration_s)


class Motion(NamedTuple):
    """Position (moment, 3) [m], speed along the path [m/s], pitch and roll [rad]."""

    position_m: Floats
    speed_m_s: Floats
    pitch_rad: Floats
    roll_rad: Floats


def motion(mission: Mission, phase: Phase, passed_s: Floats) -> Motion:
    """Motion at moments since a phase began [s].

    A leg with stated figures is flown at constant speed; its attitude is unknown (NaN), as that of
    a leg of constant load.
    """
    start_m = np.array(phase.start.position_m)
    still, unknown = np.zeros_like(passed_s), np.full_like(passed_s, np.nan)
    if phase.kind != "flight":
        return Motion(np.tile(start_m, (len(passed_s), 1)), still, still, still)
    way_m = phase.start.way_to(phase.end)
    length_m, given = math.hypot(*way_m), mission.flight
    if phase.stated:
        share = passed_s / phase.duration_s
        speed_m_s = np.full_like(passed_s, phase.distance_m / phase.duration_s)
    elif given.model == "regimes":
        travelled_m, speed_m_s = regime_motion(
            length_m, given.acceleration_m_s2, phase.peak_speed_m_s, passed_s
        )
        share = travelled_m / length_m
    else:
        airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
        wind_N = mission.wind.force_N
        leg = flight.leg(airframe, motor, way_m, wind_N)
        state = state_at(motor, airframe.external_force_N(wind_N), leg, passed_s)
        position_m = start_m + np.stack(state.position_m, axis=1)
        attitude = state.attitude
        return Motion(position_m, state.speed_m_s, attitude.pitch_rad, attitude.roll_rad)
    return Motion(start_m + share[:, None] * np.array(way_m), speed_m_s, unknown, unknown)
