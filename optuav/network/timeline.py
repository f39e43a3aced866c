"""The phases of a route, and what they do to packs that take turns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.physics.kibam import Battery, Stage, Wells
from optuav.physics.packs import JobStage, Packs, Stretch
from optuav.physics.quantity import Quantity

Kind = Literal["flight", "hover", "rest"]


@dataclass(frozen=True)
class Phase:
    """A leg, a hover or a rest.

    Parameters
    ----------
    kind
        What the UAV does.
    start_place, end_place
        Numbers of places; the same while hovering and resting.
    stages
        Its stretches of constant current, net, into the battery: negative while they drain it.
    powers_W
        Net power into the battery in every stage [W].
    leg
        Number of the leg, −1 while hovering and resting.
    """

    kind: Kind
    start_place: int
    end_place: int
    stages: tuple[Stage, ...]
    powers_W: tuple[float, ...]
    leg: int = NO_LEG

    @property
    def duration_s(self) -> Quantity:
        """How long it takes [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def charge_As(self) -> Quantity:
        """Net charge into the battery [A s]."""
        return sum(stage.current_A * stage.duration_s for stage in self.stages)

    @property
    def energy_J(self) -> Quantity:
        """Net energy into the battery [J]."""
        stages = zip(self.powers_W, self.stages, strict=True)
        return sum(power_W * stage.duration_s for power_W, stage in stages)


def hover_net(network: Network) -> vehicle.Flow:
    """Net current [A] and power [W] into the battery while hovering."""
    drawn, places = vehicle.hover_load(network.mission), network.places
    return vehicle.Flow(
        float(places.charge_current_A[HOVER] - drawn.current_A),
        float(places.received_power_W[HOVER] - drawn.power_W),
    )


def rest_net(network: Network, building: Quantity) -> vehicle.Flow:
    """Net current [A] and power [W] into the battery while resting on buildings, by number."""
    drawn, places = vehicle.rest_load(network.mission), network.places
    place = FIRST_BUILDING + building
    return vehicle.Flow(
        places.charge_current_A[place] - drawn.current_A,
        places.received_power_W[place] - drawn.power_W,
    )


def route_phases(
    network: Network, route: int, hover_time_s: Quantity, rest_time_s: Quantity
) -> list[Phase]:
    """Phases of a route in order; hover and rest time [s] may be arrays."""
    routes, ends = network.routes, network.legs.end
    legs = [int(leg) for leg in routes.legs[route] if leg != NO_LEG]
    times_s = {HOVER: hover_time_s, FIRST_BUILDING + int(routes.building[route]): rest_time_s}
    # A place that is passed again has had its stay.
    stays_s = [times_s.pop(int(ends[leg]), 0.0) for leg in legs[:-1]]
    return phases_along(network, legs, stays_s)


def phases_along(network: Network, legs: Sequence[int], stays_s: Sequence[Quantity]) -> list[Phase]:
    """Phases of any legs flown one after the other.

    Parameters
    ----------
    network
        The mission's places and legs.
    legs
        Numbers of the legs flown.
    stays_s
        Durations of the stays between them [s], may be arrays: a hover at the hover point, a rest
        on a building.
    """
    table, found = network.legs, list[Phase]()
    for leg, stay_s in zip(legs, [*stays_s, None], strict=True):
        start, end = int(table.start[leg]), int(table.end[leg])
        used = slice(0, 1 if table.edited[leg] else None)
        currents_A, powers_W = 0.0 - table.currents_A[used, leg], 0.0 - table.powers_W[used, leg]
        stages = map(Stage, currents_A.tolist(), table.durations_s[used, leg].tolist())
        powers = tuple(powers_W.tolist())
        found.append(Phase("flight", start, end, tuple(stages), powers, leg))
        if end == HOVER or end >= FIRST_BUILDING:
            hovers = end == HOVER
            net = hover_net(network) if hovers else rest_net(network, end - FIRST_BUILDING)
            stage = Stage(float(net.current_A), stay_s)
            kind: Kind = "hover" if hovers else "rest"
            found.append(Phase(kind, end, end, (stage,), (float(net.power_W),)))
    return found


class PackCourse(NamedTuple):
    """What phases do to the packs.

    Parameters
    ----------
    stretches
        For every phase, the stretches in which no pack changes its part.
    wells
        (pack,): charge in the wells at the end of every phase [A s].
    ended_s
        When no pack is left to carry the load [s]; None if that never comes. The packs stay as they
        are from then on.
    """

    stretches: list[list[Stretch]]
    wells: list[Wells]
    ended_s: float | None


def full_packs(mission: Mission) -> Packs:
    """The mission's packs, full."""
    given = mission.battery
    pack = Battery(given.capacity_As, given.available_fraction, given.flow_rate_per_s)
    return Packs(pack, given.packs, given.schedule, given.period_s)


def pack_loads(mission: Mission, kind: Kind, stages: Iterable[Stage]) -> list[JobStage]:
    """What is drawn and what is charged in the stages of a phase, from their net currents [A].

    In flight one pack carries the whole load. While hovering and resting it carries that of the
    hover or the rest alone, and the laser charges another one (`optuav.physics.packs`).
    """
    if kind == "flight":
        return [JobStage(-net_A, 0.0, duration_s) for net_A, duration_s in stages]
    flow = vehicle.hover_load(mission) if kind == "hover" else vehicle.rest_load(mission)
    drawn_A = float(flow.current_A)
    return [JobStage(drawn_A, net_A + drawn_A, duration_s) for net_A, duration_s in stages]


def carry(mission: Mission, phases: Iterable[tuple[Kind, Iterable[Stage]]]) -> PackCourse:
    """Carry phases, each a kind and its stages of net current, by full packs in their schedule."""
    packs, stretches, wells = full_packs(mission), [], []
    for kind, stages in phases:
        stretches.append(packs.job(pack_loads(mission, kind, stages)))
        wells.append(Wells(*(np.array(well[0]) for well in packs.wells)))
    ended_s = float(packs.clock_s[0]) if packs.exhausted[0] else None
    return PackCourse(stretches, wells, ended_s)
