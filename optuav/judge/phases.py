"""What the moves of a plan take and draw, worked out from the mission alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from optuav.judge.itinerary import Move
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, Prisms, crossed, prisms
from optuav.network.places import ENDS
from optuav.network.vehicle import Flow
from optuav.physics.flight import STAGES, Loads
from optuav.plan.phases import Kind

NOTHING = Flow(0.0, 0.0)
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Place:
    """Somewhere the UAV stays or passes.

    Parameters
    ----------
    name
        Its name.
    building
        Number of the building, −1 if it is none.
    position_m
        (x, y, z) [m]; NaN for a hover point that does not exist.
    sight
        Whether the laser is in clear sight.
    received
        Current into the battery [A] and power [W] that the laser gives there.
    """

    name: str
    building: int
    position_m: Point
    sight: bool
    received: Flow


@dataclass(frozen=True)
class Stage:
    """A stretch of constant current.

    Parameters
    ----------
    name
        Of a leg's stage, ``"turn"``, ``"accelerate"`` or ``"brake"``; ``"flight"``, ``"hover"`` or
        ``"rest"`` otherwise.
    start_s, duration_s
        When, counted from take-off, and for how long [s].
    drawn, received
        Current [A] and power [W] that leave and enter the battery.
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
    """A leg, a hover or a rest as it will be.

    Parameters
    ----------
    kind, start, end
        What and where.
    stages
        In order, at least one.
    distance_m, peak_speed_m_s
        Of a leg [m], [m/s]; 0 otherwise.
    crosses
        Number of a building in the way, −1 if there is none.
    stated
        Whether the figures are the user's own.
    """

    kind: Kind
    start: Place
    end: Place
    stages: tuple[Stage, ...]
    distance_m: float
    peak_speed_m_s: float
    crosses: int
    stated: bool

    @property
    def start_s(self) -> float:
        """When it begins, counted from take-off [s]."""
        return self.stages[0].start_s

    @cached_property
    def duration_s(self) -> float:
        """How long it takes [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def end_s(self) -> float:
        """When it ends, counted from take-off [s]."""
        return self.stages[-1].start_s + self.stages[-1].duration_s


class Site:
    """The mission's map: where its places are, what the laser gives there, what stands between."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self._numbers = {building.name: k for k, building in enumerate(mission.buildings)}
        self._found: dict[str, Place] = {}

    @cached_property
    def _obstacles(self) -> Prisms:
        return prisms(self.mission)

    def place(self, name: str) -> Place:
        """A place by its name."""
        if name not in self._found:
            self._found[name] = self._worked_out(name)
        return self._found[name]

    def crossed(self, start: Place, end: Place) -> int:
        """Number of a building through which the straight line between two places runs, or −1."""
        if self.mission.flight.through_buildings:
            return CLEAR
        return self._between(start.position_m, end.position_m, (start.building, end.building))

    def _worked_out(self, name: str) -> Place:
        number = self._numbers.get(name, CLEAR)
        position_m = self._position_m(name, number)
        laser = self.mission.laser
        if laser is None or math.isnan(position_m[0]):
            return Place(name, number, position_m, False, NOTHING)
        if self._between(laser.position_m, position_m, (number,)) != CLEAR:
            return Place(name, number, position_m, False, NOTHING)
        load = vehicle.charging(self.mission, math.dist(laser.position_m, position_m))
        return Place(name, number, position_m, True, load)

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


def phases(site: Site, moves: Sequence[Move]) -> tuple[Phase, ...]:
    """The phases of some moves; durations are NaN where the UAV cannot fly."""
    found: list[Phase] = []
    start_s = 0.0
    for move in moves:
        found.append(_phase(site, move, start_s))
        start_s = found[-1].end_s
    return tuple(found)


def _phase(site: Site, move: Move, start_s: float) -> Phase:
    start, end = site.place(move.start_place), site.place(move.end_place)
    if move.stated:
        stages = tuple(_stated(site, move, start_s))
        length_m, peak_m_s = move.distance_m, move.peak_speed_m_s
        return Phase(move.kind, start, end, stages, length_m, peak_m_s, CLEAR, True)
    if move.kind != "flight":
        return Phase(move.kind, start, end, (_stay(site, move, start_s),), 0.0, 0.0, CLEAR, False)
    way_m = displacement_m(start, end)
    loads, peak = vehicle.leg_loads(site.mission, way_m)
    stages = tuple(_flown(loads, start_s))
    crosses = site.crossed(start, end)
    return Phase("flight", start, end, stages, math.hypot(*way_m), float(peak), crosses, False)


def displacement_m(start: Place, end: Place) -> Point:
    """From one place to another [m]."""
    x, y, z = (b - a for a, b in zip(start.position_m, end.position_m, strict=True))
    return x, y, z


def _stay(site: Site, move: Move, start_s: float) -> Stage:
    drawn = _drawn(site.mission, move.kind)
    received = site.place(move.end_place).received
    return Stage(move.kind, start_s, move.duration_s, drawn, received)


def _drawn(mission: Mission, kind: Kind) -> Flow:
    """What a stay draws."""
    return (vehicle.hover_load if kind == "hover" else vehicle.rest_load)(mission)


def _stated(site: Site, move: Move, start_s: float) -> Iterator[Stage]:
    """Stages as the user stated them; what a stay draws is the UAV's and not his to state."""
    drawn = _drawn(site.mission, move.kind)
    for stage in move.stated:
        net = Flow(stage.current_A, stage.power_W)
        if move.kind == "flight":
            drawn, received = Flow(-net.current_A, -net.power_W), NOTHING
        else:
            received = Flow(net.current_A + drawn.current_A, net.power_W + drawn.power_W)
        yield Stage(move.kind, start_s, stage.duration_s, drawn, received)
        start_s += stage.duration_s


def _flown(loads: Loads, start_s: float) -> Iterator[Stage]:
    names = STAGES if len(loads.durations_s) > 1 else ("flight",)
    columns = (loads.durations_s, loads.currents_A, loads.powers_W)
    for name, duration_s, *drawn in zip(names, *columns, strict=True):
        yield Stage(name, start_s, float(duration_s), Flow(*map(float, drawn)), NOTHING)
        start_s += float(duration_s)
