"""Phases of a mission: what runs for how long at which current."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from optuav.mission.schema import Mission
from optuav.network import vehicle
from optuav.network.legs import Legs
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import NO_LEG
from optuav.physics import kibam
from optuav.physics.packs import JobStage, Packs, Stretch

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
    leg
        Number of the leg, −1 while hovering and resting.
    durations_s, currents_A, powers_W
        Of every stage; current and power are net, into the battery: negative while they drain it.
        A duration may be a symbol.
    """

    kind: Kind
    start_place: int
    end_place: int
    leg: int
    durations_s: tuple[Any, ...]
    currents_A: tuple[Any, ...]
    powers_W: tuple[Any, ...]

    @property
    def stages(self) -> tuple[kibam.Stage, ...]:
        """Stretches of constant current, as the battery sees them."""
        return tuple(map(kibam.Stage, self.currents_A, self.durations_s))


def hover_net(worked_out: Network) -> vehicle.Load:
    """Net current [A] and power [W] into the battery while hovering."""
    drawn = vehicle.hover_load(worked_out.mission)
    where = worked_out.places
    return vehicle.Load(
        float(where.charge_current_A[HOVER] - drawn.current_A),
        float(where.received_power_W[HOVER] - drawn.power_W),
    )


def rest_net(worked_out: Network, building: Any) -> vehicle.Load:
    """Net current [A] and power [W] into the battery while resting on buildings, by number."""
    drawn = vehicle.rest_load(worked_out.mission)
    where = worked_out.places
    place = FIRST_BUILDING + building
    return vehicle.Load(
        where.charge_current_A[place] - drawn.current_A,
        where.received_power_W[place] - drawn.power_W,
    )


def phases(worked_out: Network, index: int, hover_time_s: Any, rest_time_s: Any) -> list[Phase]:
    """Phases of an itinerary in order; hover and rest time [s] may be symbols.

    Parameters
    ----------
    worked_out
        Places, legs and itineraries.
    index
        Number of the itinerary.
    hover_time_s, rest_time_s
        Δ and T' [s].
    """
    routes, table = worked_out.routes, worked_out.legs
    legs = [int(number) for number in routes.legs[index] if number != NO_LEG]
    times_s = {HOVER: hover_time_s, FIRST_BUILDING + int(routes.building[index]): rest_time_s}
    # Places are passed by where they do not serve, or have served.
    stays_s = [times_s.pop(int(table.end[leg]), 0.0) for leg in legs[:-1]]
    return phases_along(worked_out, table, legs, stays_s)


def phases_along(
    worked_out: Network, table: Legs, legs: Sequence[int], stays_s: Sequence[Any]
) -> list[Phase]:
    """Phases of any way over the places, in order.

    Parameters
    ----------
    worked_out
        The mission's places.
    table
        Legs between them.
    legs
        Numbers of the legs flown, in the table.
    stays_s
        Durations of the stays between them [s], may be symbols: a hover at the hover point, a rest
        on a building.
    """
    found: list[Phase] = []
    for leg, stay_s in zip(legs, [*stays_s, None], strict=True):
        end = int(table.end[leg])
        stages = slice(0, 1 if table.edited[leg] else None)
        found.append(
            Phase(
                "flight",
                int(table.start[leg]),
                end,
                leg,
                tuple(table.durations_s[stages, leg].tolist()),
                tuple((0.0 - table.currents_A[stages, leg]).tolist()),
                tuple((0.0 - table.powers_W[stages, leg]).tolist()),
            )
        )
        if end == HOVER:
            found.append(_stay("hover", end, stay_s, hover_net(worked_out)))
        elif end >= FIRST_BUILDING:
            net = rest_net(worked_out, end - FIRST_BUILDING)
            found.append(_stay("rest", end, stay_s, net))
    return found


def _stay(kind: Kind, place: int, duration_s: Any, net: vehicle.Load) -> Phase:
    return Phase(
        kind, place, place, NO_LEG, (duration_s,), (float(net.current_A),), (float(net.power_W),)
    )


class Flown(NamedTuple):
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
    wells: list[kibam.Wells]
    ended_s: float | None


def packs(mission: Mission) -> Packs:
    """The mission's packs, full."""
    given = mission.battery
    pack = kibam.Battery(given.capacity_As, given.available_fraction, given.flow_rate_per_s)
    return Packs(pack, given.packs, given.schedule, given.period_s)


def loads(mission: Mission, kind: Kind, stages: Iterable[kibam.Stage]) -> list[JobStage]:
    """What is drawn and what is charged in the stages of a phase, from their net currents [A]."""
    drawn_A = 0.0
    if kind != "flight":
        load = vehicle.hover_load(mission) if kind == "hover" else vehicle.rest_load(mission)
        drawn_A = float(load.current_A)
    return [
        JobStage(drawn_A, net_A + drawn_A, duration_s)
        if kind != "flight"
        else JobStage(-net_A, 0.0, duration_s)
        for net_A, duration_s in stages
    ]


def fly(mission: Mission, phases: Iterable[tuple[Kind, Iterable[kibam.Stage]]]) -> Flown:
    """Carry phases, each a kind and its stages of net current, from full packs."""
    carried, stretches, wells = packs(mission), [], []
    for kind, stages in phases:
        stretches.append(carried.job(loads(mission, kind, stages)))
        wells.append(kibam.Wells(*(np.array(well[0]) for well in carried.wells)))
    ended_s = float(carried.clock_s[0]) if carried.exhausted[0] else None
    return Flown(stretches, wells, ended_s)
