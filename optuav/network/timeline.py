"""The phases of a route, and their effect on the battery packs."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from annotated_types import Len
from pydantic import ConfigDict, FailFast, Strict

from optuav.fields import LARGEST, Position, Range
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.places import DESTINATION, ORIGIN
from optuav.physics.flight import Flow
from optuav.physics.kibam import STEP_BY_CHARGING, Stage, Wells
from optuav.physics.packs import JobStage, Packs, Stretch
from optuav.physics.quantity import Quantity

Kind = Literal["flight", "hover", "rest"]
Figure = Annotated[float, Range("", ge=-LARGEST, le=LARGEST)]
Amount = Annotated[float, Range("", ge=0.0, le=LARGEST)]
PerPack = Annotated[tuple[Figure, ...], Len(1), FailFast()]
Text = Annotated[str, Strict()]
Words = Annotated[tuple[str, ...], FailFast()]

CHECKED = ConfigDict(extra="forbid", allow_inf_nan=False, revalidate_instances="always")
"""A record is validated as a part of a plan, and not where it is made."""


@dataclass(frozen=True)
class PhaseStage:
    """A part of a phase with constant current and power.

    Parameters
    ----------
    duration_s
        Duration [s], ≥ 0.
    current_A, power_W
        Net, into the battery [A], [W]; negative while the battery drains. Where charging tapers,
        the offered current: a full battery takes less.

    Examples
    --------
    >>> import optuav
    >>> (hover,) = optuav.solve("paper", "P3").phases[1].stages
    >>> round(hover.duration_s, 1), round(hover.current_A, 2)
    (577.5, -87.91)
    """

    __pydantic_config__: ClassVar[ConfigDict] = CHECKED

    duration_s: Amount
    current_A: Figure
    power_W: Figure


@dataclass(frozen=True)
class Phase:
    """A leg, a hover or a rest.

    Parameters
    ----------
    kind, start_place, end_place
        ``"flight"``, ``"hover"`` or ``"rest"``; names of places, the same in a hover or a rest.
    start_s, stages
        Start, counted from take-off [s], and at least one `PhaseStage`, in order.
    distance_m, peak_speed_m_s
        Length of a leg [m] and largest speed on it [m/s]; 0 in a hover or a rest.
    edited
        Whether the user stated its figures in a graph.
    available_As, bound_As
        Charge in the wells at its end [A s], one entry a pack; pooled packs count as one.
    waypoints_m
        Points (x, y, z) [m] of a bent leg, in order; it stops there.
    speeds_m_s
        Where the speeds of legs were sought, the largest horizontal speed over ground between one
        of these points and the next [m/s]; else none, and the leg flies as the mission states.

    Examples
    --------
    >>> import optuav
    >>> hover = optuav.solve("paper", "P3").phases[1]
    >>> hover.kind, hover.start_place, [round(charge) for charge in hover.available_As]
    ('hover', 'hover', [3811])
    """

    __pydantic_config__: ClassVar[ConfigDict] = CHECKED

    kind: Kind
    start_place: Text
    end_place: Text
    start_s: Amount
    stages: Annotated[tuple[PhaseStage, ...], Len(1)]
    distance_m: Amount
    peak_speed_m_s: Amount
    edited: Annotated[bool, Strict()]
    available_As: PerPack
    bound_As: PerPack
    waypoints_m: Annotated[tuple[Position, ...], FailFast()] = ()
    speeds_m_s: Annotated[tuple[Amount, ...], FailFast()] = ()

    @property
    def duration_s(self) -> float:
        """Duration [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def end_s(self) -> float:
        """End, counted from take-off [s]."""
        return self.start_s + self.duration_s

    @property
    def charge_As(self) -> float:
        """Net charge into the battery [A s]."""
        return sum(stage.current_A * stage.duration_s for stage in self.stages)

    @property
    def energy_J(self) -> float:
        """Net energy into the battery [J]."""
        return sum(stage.power_W * stage.duration_s for stage in self.stages)

    @property
    def current_A(self) -> float:
        """Mean net current into the battery [A]."""
        return self.charge_As / self.duration_s if self.duration_s else self.stages[0].current_A

    @property
    def power_W(self) -> float:
        """Mean net power into the battery [W]."""
        return self.energy_J / self.duration_s if self.duration_s else self.stages[0].power_W

    @property
    def net(self) -> list[Stage]:
        """Its stages as the battery model takes them."""
        return [Stage(stage.current_A, stage.duration_s) for stage in self.stages]


def stay_net(network: Network, place: Quantity) -> Flow:
    """Net current [A] and power [W] into the battery: at the hover point, or on buildings."""
    places, mission = network.places, network.mission
    hovers = np.ndim(place) == 0 and places.hovers_at(int(place))
    drawn = vehicle.hover_load(mission) if hovers else mission.flight_model.rest()
    received = places.charge_current_A[place], places.received_power_W[place]
    return Flow(received[0] - drawn.current_A, received[1] - drawn.power_W)


def route_phases(
    network: Network, route: int, hover_time_s: Quantity, rest_time_s: Quantity
) -> list[Phase]:
    """Phases of a route in order, like `phases_along`; hover and rest time [s] may be arrays."""
    routes, ends = network.routes, network.legs.end
    legs = [int(leg) for leg in routes.legs[route] if leg != NO_LEG]
    points = network.places.hovers.tolist()
    shares = (device.share * hover_time_s for device in network.mission.served)
    times_s: dict[int, Quantity] = dict(zip(points, shares, strict=True))
    if (building := int(routes.building[route])) >= 0:
        times_s[int(network.places.on(building))] = rest_time_s
    # A place that is passed again has had its stay.
    stays_s = [times_s.pop(int(ends[leg]), 0.0) for leg in legs[:-1]]
    return phases_along(network, legs, stays_s)


def phases_along(network: Network, legs: Sequence[int], stays_s: Sequence[Quantity]) -> list[Phase]:
    """Phases of legs flown one after the other; `simulated` adds starts and wells.

    In between the UAV hovers or rests for `stays_s` [s], which may be arrays.
    """
    table, places, phases = network.legs, network.places, list[Phase]()
    names = places.names
    for leg, stay_s in zip(legs, [*stays_s, None], strict=True):
        start, end, edited = int(table.start[leg]), int(table.end[leg]), bool(table.edited[leg])
        stops_m = table.waypoints_m[..., leg].tolist()
        waypoints_m = [stop_m for stop_m in stops_m if not math.isnan(stop_m[0])]
        segments = 1 + len(waypoints_m)
        in_segment = len(table.stages) // (1 + len(table.waypoints_m))
        used = slice(0, 1 if edited else in_segment * segments)
        drawn = table.currents_A[used, leg], table.powers_W[used, leg]
        nets = ((0.0 - figures).tolist() for figures in drawn)
        stages = tuple(map(PhaseStage, table.durations_s[used, leg].tolist(), *nets))
        way_m, peak_m_s = float(table.distance_m[leg]), float(table.peak_speed_m_s[leg])
        ends = names[start], names[end], 0.0
        bent = (), (), tuple(map(tuple, waypoints_m))
        speeds_m_s = () if table.speeds_m_s is None else table.speeds_m_s[:segments, leg].tolist()
        speeds = tuple(speeds_m_s)
        phases.append(Phase("flight", *ends, stages, way_m, peak_m_s, edited, *bent, speeds))
        if end not in (ORIGIN, DESTINATION):
            kind: Kind = "hover" if places.hovers_at(end) else "rest"
            stages = (PhaseStage(stay_s, *map(float, stay_net(network, end))),)
            at, edited = (names[end], names[end], 0.0), bool(places.edited[end])
            phases.append(Phase(kind, *at, stages, 0.0, 0.0, edited, (), ()))
    return phases


def simulated(mission: Mission, phases: Sequence[Phase]) -> tuple[Phase, ...]:
    """Phases with their starts and the wells at their ends, flown one by one from the start.

    Pooled packs are one battery, which may be driven past full unless charging tapers.
    """
    if mission.battery.takes_turns:
        ends = carry(mission, phases).wells
    else:
        pool, step_of = mission.pool, STEP_BY_CHARGING[mission.battery.charging]
        ends, wells = list[Wells](), vehicle.start(mission).wells(pool)
        for phase in phases:
            ends.append(wells := reduce(partial(step_of, pool), phase.net, wells))
    flown, start_s = list[Phase](), 0.0
    for phase, wells in zip(phases, ends, strict=True):
        available_As, bound_As = (tuple(np.atleast_1d(well).tolist()) for well in wells)
        flown.append(replace(phase, start_s=start_s, available_As=available_As, bound_As=bound_As))
        start_s += phase.duration_s
    return tuple(flown)


class Piece(NamedTuple):
    """A piece of a phase at constant current."""

    phase: int  # Number of the phase
    start_s: float
    stage: Stage
    # Charge in the wells of pooled packs [A s]
    before: Wells
    after: Wells


def steps(mission: Mission, phases: Iterable[Phase], pieces: int = 1) -> Iterator[Piece]:
    """Fly phases with pooled packs from take-off on, every stage in some equal pieces."""
    pool, step_of = mission.pool, STEP_BY_CHARGING[mission.battery.charging]
    wells, start_s = vehicle.start(mission).wells(pool), 0.0
    for number, phase in enumerate(phases):
        for current_A, duration_s in phase.net:
            piece = Stage(current_A, duration_s / pieces)
            for _ in range(pieces):
                before, wells = wells, step_of(pool, wells, piece)
                yield Piece(number, start_s, piece, before, wells)
                start_s += piece.duration_s


class PackCourse(NamedTuple):
    """Yield the loads of phases on the packs."""

    # For every phase, the stretches where no pack changes its part.
    stretches: list[list[Stretch]]
    wells: list[Wells]  # (pack,): charge in the wells at the end of every phase [A s]
    # When no pack is left to carry the load [s]; None if that never comes. The packs stay as they
    # are from then on.
    ended_s: float | None


def starting_packs(mission: Mission) -> Packs:
    """The mission's packs at the start: full, or with equal parts of the charge of [start]."""
    battery = mission.battery
    begin = None
    if mission.start is not None:
        total = vehicle.start(mission).wells(mission.pool)
        begin = Wells(*(well / battery.packs for well in total))
    return Packs(mission.pack, battery.packs, battery.schedule, battery.period_s, begin)


def pack_loads(mission: Mission, phase: Phase) -> list[JobStage]:
    """Return the loads and gains in the stages of a phase (`optuav.physics.packs`).

    One pack carries the whole load; in a hover or a rest the laser charges another one.
    """
    if phase.kind == "flight":
        return [JobStage(-net_A, 0.0, duration_s) for net_A, duration_s in phase.net]
    hovers = phase.kind == "hover"
    flow = vehicle.hover_load(mission) if hovers else mission.flight_model.rest()
    drawn_A = float(flow.current_A)
    return [JobStage(drawn_A, net_A + drawn_A, duration_s) for net_A, duration_s in phase.net]


def carry(mission: Mission, phases: Iterable[Phase]) -> PackCourse:
    """Carry phases by the packs in their schedule."""
    packs, stretches, wells = starting_packs(mission), [], []
    for phase in phases:
        stretches.append([*packs.stretches(pack_loads(mission, phase))])
        wells.append(Wells(*(np.array(well[0]) for well in packs.wells)))
    ended_s = float(packs.clock_s[0]) if packs.exhausted[0] else None
    return PackCourse(stretches, wells, ended_s)
