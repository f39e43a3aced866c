"""(P1) with several rests and hovers, in any order over all places: mission in, plan out."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from decimal import ROUND_CEILING, Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from formulations.wells import LABELS
from optuav.errors import Fault, InputError, SolverError
from optuav.mission.messages import shown
from optuav.network import vehicle
from optuav.network.feasibility import never_flyable
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING
from optuav.network.timeline import phases_along, rest_net, simulated
from optuav.physics.quantity import TINY
from optuav.plan import Plan
from optuav.search.branch import INTERRUPTED, TIE_S, Progress, SearchResult, search
from optuav.search.trial import Stops
from optuav.solving.assemble import quantities
from optuav.solving.everywhere import terrain, ways
from optuav.solving.linear_stops import linear_stops
from optuav.solving.more_stops import all_legs
from optuav.solving.plans import (
    counted,
    plan_for,
    plan_without,
    replayed,
    shortfalls,
    states_of_charge,
)
from optuav.solving.program import Program
from optuav.status import Status

if TYPE_CHECKING:
    from optuav.network.graph import Graph

ENGINE = "search"
MOST_BUILDINGS = 1000
"""With more, the legs between any two of them do not fit into memory."""
BINDS = 1e-8
"""Share of the capacity [-] or of the deadline within which a limit is reached."""


def several_stops(
    program: Program,
    rests: int,
    hovers: int,
    graph: Graph | None = None,
    progress: Progress | None = None,
) -> Plan:
    """The plan of the longest hover time with at most so many rests and hovers.

    Parameters
    ----------
    program
        (P1) over the same mission with one rest and one hover.
    rests, hovers
        Most rests, 0 to 10, and hovers, 1 to 10.
    graph
        A graph that was edited: its edges replace the computed legs, also between buildings.
    progress
        Told how far a search is.

    Raises
    ------
    InputError
        If the question is one that several stops do not go with.
    SolverError
        If the search ends early without a plan, or its plan fails the simulation.
    """
    if faults := tuple(_faults(program)):
        raise InputError(faults)
    if never_flyable(program.network):
        return program.solve()
    everywhere = replace(program.network, legs=all_legs(program.network, graph))
    if program.question.perspective != "available":
        return linear_stops(program, everywhere, rests, hovers)
    found = search(
        terrain(everywhere),
        rests,
        hovers,
        time_limit_s=program.question.time_limit_s,
        progress=progress,
    )
    return _plan(program, everywhere, found, _counted(rests, hovers))


def _counted(rests: int, hovers: int) -> str:
    """How many stops there may be, in words."""
    rested = f"{rests} rest{'s' * (rests != 1)}"
    return f"at most {rested} and {hovers} hover{'s' * (hovers != 1)}"


def _faults(program: Program) -> Iterator[Fault]:
    """What of a mission several stops do not go with."""
    battery = program.network.mission.battery
    if program.question.perspective == "available" and battery.takes_turns:
        yield Fault("battery.schedule", shown(battery.schedule), "pooled with several stops")
    if (buildings := len(program.network.mission.buildings)) > MOST_BUILDINGS:
        words = f"at most {MOST_BUILDINGS} with several stops"
        yield Fault("buildings", str(buildings), words)


def _plan(program: Program, everywhere: Network, found: SearchResult, asked_for: str) -> Plan:
    asked, stops = replace(program.question, engine=ENGINE), found.stops
    if stops is None and found.bound_s <= 0.0:
        why = program.reasons
        if program.parts:
            why = shortfalls(asked, program.network, program.parts)
        why = (f"no plan with {asked_for} keeps the battery and the deadline", *why)
        proof = "branch and bound over all sequences of stops"
        return plan_without(asked, program.network, Status.INFEASIBLE, proof, why)
    hover_s = -math.inf if stops is None else stops.hover_s
    none_longer = f"with {asked_for} no plan hovers longer than {_rounded_up(found.bound_s)} s"
    proof = f"branch and bound: {none_longer}"
    one = _with_one_stop(program) if not stops or found.ended or len(stops.stays_s) <= 2 else None
    if one and one.hover_time_s >= hover_s - TIE_S:
        # Of as good plans with one rest and one hover, its engine knows the shortest.
        known = _known(found, one.hover_time_s)
        known["notes"] = (*one.notes, *known["notes"])
        return one.model_copy(update={"engine": ENGINE, "proof": proof, **known})
    if stops is None:
        said = f"the search {found.ended} without a plan or proof that there is none: {none_longer}"
        if found.ended != INTERRUPTED:
            said += ". Allow more time (time_limit_s), or fewer stops or hovers"
        raise SolverError(said)
    way = ways(everywhere, stops.places[:, None], np.array([-1]))
    network = replace(everywhere, routes=way)
    legs = [int(leg) for leg in way.legs[0]]
    stays_s = stops.stays_s.tolist()
    flown = simulated(network.mission, phases_along(network, legs, stays_s))
    known = _known(found, hover_s)
    notes = [*known["notes"]]
    if network.legs.edited[legs].any():
        notes.append("some legs have figures from the graph, not from the flight model")
    if network.places.edited[stops.places].any():
        notes.append(
            "some places have sight or power of the laser from the graph, not from the mission"
        )
    plan = plan_for(
        asked,
        network,
        engine=asked.engine,
        proof=proof,
        status=known["status"],
        notes=tuple(notes),
        phases=flown,
        soc=counted(network, flown, _states_of_charge(network, stops)),
    )
    return replayed(plan.model_copy(update={"binding": tuple(_binding(plan))}))


def _rounded_up(bound_s: float) -> str:
    """A time that none exceeds, in writing: none exceeds what is written either."""
    return str(Decimal(bound_s).quantize(Decimal("0.000001"), ROUND_CEILING))


def _with_one_stop(program: Program) -> Plan | None:
    """The best plan with one rest and one hover; None where there may be no rest, or none is known.

    A search that ends early is never worse than it.
    """
    if not program.question.stops:
        return None
    try:
        return program.solve()
    except SolverError:
        return None


def _known(found: SearchResult, hover_s: float) -> dict[str, Any]:
    """Whether a hover time is the longest, and a note on what a search that ended leaves open."""
    gap_s, notes = found.bound_s - hover_s, []
    if found.ended:
        notes.append(
            f"the search {found.ended}; not proved to be best, a gap of {gap_s:.3g} s is left"
        )
    status = Status.OPTIMAL if gap_s <= 3.0 * TIE_S else Status.FEASIBLE
    return {"status": status, "notes": tuple(notes)}


def _states_of_charge(network: Network, stops: Stops) -> dict[str, float]:
    """State of charge at the end [-] by perspective: rests count by their mean net current."""
    rests = stops.places[1:-1] >= FIRST_BUILDING
    times_s = stops.stays_s[rests]
    net = rest_net(network, stops.places[1:-1][rests] - FIRST_BUILDING)
    rest_time_s = float(times_s.sum())
    share = times_s / max(rest_time_s, TINY)
    given = replace(
        quantities(network, np.array([0])),
        rest_current_A=float((net.current_A * share).sum()),
        rest_received_W=float((net.power_W * share).sum()),
    )
    return states_of_charge(given, stops.hover_s, rest_time_s)


def _binding(plan: Plan) -> Iterator[str]:
    """Which limits a plan reaches, in words."""
    limits, pool = plan.mission.limits, vehicle.pool(plan.mission)
    tapers = plan.mission.battery.charging == "taper"
    if plan.mission_time_s >= limits.deadline_s * (1.0 - BINDS):
        yield "deadline"
    for phase in plan.phases:
        where = (
            f"{'arriving at' if phase.kind == 'flight' else phase.kind + ' at'} {phase.end_place}"
        )
        share = phase.available_As[0] / pool.capacity_As
        if share <= BINDS:
            yield f"{LABELS['dry']}, {where}"
        elif phase.kind != "flight" and not tapers and share >= pool.available_fraction - BINDS:
            yield f"{LABELS['past full']}, {where}"
    if plan.soc is not None and plan.soc["battery"] <= limits.min_soc + BINDS:
        yield "state of charge"
