"""(P1) with several rests and hovers, in any order over all places: mission in, plan out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from formulations.perspectives import PAPER
from optuav.errors import Fault, InputError, SolverError
from optuav.mission import vehicle
from optuav.mission.feasibility import beyond_it
from optuav.mission.itineraries import NO_LEG, Itineraries
from optuav.mission.legs import Legs, all_pairs, legs_between
from optuav.mission.network import Network
from optuav.mission.phases import hover_net, phases_along, rest_net
from optuav.mission.places import FIRST_BUILDING, HOVER
from optuav.mission.quantities import Number
from optuav.mission.sight import Numbers, Points, prisms
from optuav.mission.words import shown
from optuav.physics.quantity import TINY
from optuav.plan import Plan
from optuav.search.branch import TIE_S, Found, Progress, search
from optuav.search.terrain import Terrain
from optuav.search.trial import Stops
from optuav.solving.given import quantities
from optuav.solving.planning import (
    counted,
    plan_for,
    plan_without,
    shortfalls,
    states_of_charge,
    with_wells,
)
from optuav.solving.program import Program
from optuav.solving.question import AUTO
from optuav.solving.replayed import replayed
from optuav.status import Status

if TYPE_CHECKING:
    from optuav.mission.graph import Graph

ENGINE = "search"
MOST_BUILDINGS = 1000
"""With more, the legs between any two of them do not fit into memory."""
RESTS = Number("-", ge=0, le=10, whole=True)
HOVERS = Number("-", ge=1, le=10, whole=True)
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
    if faults := tuple(_faults(program, rests, hovers)):
        raise InputError(faults)
    if beyond_it(program.worked_out):
        return program.solve()
    program = replace(program, question=replace(program.question, stops=rests, hovers=hovers))
    everywhere = replace(program.worked_out, legs=all_legs(program.worked_out, graph))
    if program.question.perspective != "available":
        from optuav.solving.linear_stops import linear_stops

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


def _faults(program: Program, rests: int, hovers: int) -> Iterator[Fault]:
    """What several stops do not go with."""
    asked = program.question
    for option, value, number in (("stops", rests, RESTS), ("hovers", hovers, HOVERS)):
        if not number.accepts(value) or not isinstance(value, int):
            yield Fault(option, shown(value), number.words)
    for option, given, only in (
        ("problem", asked.problem, "P1"),
        ("trajectory", asked.trajectory, "optimal"),
        ("order", asked.order, None),
        ("slot_s", asked.slot_s, None),
        ("engine", asked.engine, AUTO),
        ("hover_point", asked.hover_point, "w_U"),
    ):
        if given != only and (option == "problem" or asked.problem == "P1"):
            yield Fault(option, shown(given), f"{only or 'none'} with several stops")
    if asked.perspective not in (*PAPER, "available"):
        words = f"{', '.join((*PAPER, 'available'))} with several stops"
        yield Fault("perspective", shown(asked.perspective), words)
    schedule = program.worked_out.mission.battery.schedule
    if asked.perspective == "available" and schedule != "pooled":
        yield Fault("battery.schedule", shown(schedule), "pooled with several stops")
    if (buildings := len(program.worked_out.mission.buildings)) > MOST_BUILDINGS:
        words = f"at most {MOST_BUILDINGS} with several stops"
        yield Fault("buildings", str(buildings), words)


def all_legs(worked_out: Network, graph: Graph | None = None) -> Legs:
    """The legs between any two places of a mission.

    A graph from `optuav.graph` has the legs with one building on the way, so those that it lacks
    are forbidden; legs between other places are as computed, unless it states them too.
    """
    where = worked_out.places
    start, end = all_pairs(len(where.names))
    table = legs_between(worked_out.mission, where, prisms(worked_out.mission), start, end)
    if graph is None:
        return table
    from optuav.mission.edited import edited_legs

    gone = np.array([name not in graph for name in where.names])
    one_stop = np.zeros((len(gone), len(gone)), bool)
    one_stop[worked_out.legs.start, worked_out.legs.end] = True
    needed = one_stop[start, end] | gone[start] | gone[end]
    return edited_legs(table, where.names, graph, needed)


def terrain(worked_out: Network) -> Terrain:
    """What a search knows of a mission; there is no way where it has no leg that can be flown."""
    mission, table = worked_out.mission, worked_out.legs
    places = len(worked_out.places.names)

    def square(figures: Points, absent: float) -> Points:
        filled = np.full((*figures.shape[:-1], places, places), absent)
        filled[..., table.start, table.end] = np.where(table.flyable, figures, absent)
        return filled

    stay_current_A = np.zeros(places)
    stay_current_A[HOVER] = hover_net(worked_out).current_A
    buildings = np.arange(places - FIRST_BUILDING)
    stay_current_A[FIRST_BUILDING:] = rest_net(worked_out, buildings).current_A
    pool = vehicle.pool(mission)
    return Terrain(
        pool,
        mission.limits.deadline_s,
        mission.limits.min_soc * float(pool.capacity_As),
        square(table.duration_s, np.inf),
        square(table.durations_s, 0.0),
        square(table.currents_A, 0.0),
        stay_current_A,
        mission.battery.charging == "taper",
    )


def ways(worked_out: Network, places: Numbers, building: Numbers) -> Itineraries:
    """Sequences of places as itineraries over a table of legs.

    Parameters
    ----------
    worked_out
        Its legs lead between any two places.
    places
        Numbers of the places (place, sequence), −1 behind the last of a sequence.
    building
        Number of the building that each rests on (sequence,), −1 for none.
    """
    table = worked_out.legs
    number = np.full((len(worked_out.places.names),) * 2, NO_LEG, dtype=np.intp)
    number[table.start, table.end] = np.arange(len(table.start))
    legs = np.where(places[1:] >= 0, number[places[:-1], places[1:]], NO_LEG).T
    flown = legs != NO_LEG

    def total(per_leg: Points) -> Points:
        sums: Points = np.where(flown, per_leg[legs], 0.0).sum(axis=1)
        return sums

    hovers_first = (places == HOVER).argmax(axis=0)
    rests_first = (places == FIRST_BUILDING + building).argmax(axis=0)
    return Itineraries(
        legs,
        building,
        (building >= 0) & (rests_first < hovers_first),
        np.asarray(np.where(flown, table.flyable[legs], True).all(axis=1)),
        total(table.duration_s),
        total(table.charge_As),
        total(table.energy_J),
    )


def _plan(program: Program, everywhere: Network, found: Found, asked_for: str) -> Plan:
    asked = replace(program.question, engine=ENGINE)
    if found.stops is None:
        if found.bound_s > 0.0:
            raise SolverError(f"the search {found.ended} without a plan, nor proof that none is")
        why = program.reasons
        if program.parts:
            why = shortfalls(asked, program.worked_out, program.parts)
        why = (f"no plan with {asked_for} keeps the battery and the deadline", *why)
        proof = "branch and bound over all sequences of stops"
        return plan_without(asked, program.worked_out, Status.INFEASIBLE, proof, why)
    stops = found.stops
    gap_s = found.bound_s - stops.hover_s
    proved = gap_s <= 3.0 * TIE_S
    proof = f"branch and bound: with {asked_for} no plan hovers longer than {found.bound_s:.6f} s"
    simple = proved and asked.stops and len(stops.stays_s) <= 2
    one = program.solve() if simple else None
    if one and one.hover_time_s >= stops.hover_s - TIE_S:
        # Of as good plans with one rest and one hover, its engine knows the shortest.
        return one.model_copy(update={"engine": ENGINE, "proof": proof})
    way = ways(everywhere, stops.places[:, None], np.array([-1]))
    worked_out = replace(everywhere, itineraries=way)
    legs = [int(leg) for leg in way.legs[0]]
    stays_s = stops.stays_s.tolist()
    flown = with_wells(worked_out, phases_along(worked_out, worked_out.legs, legs, stays_s))
    notes = []
    if found.ended:
        notes.append(
            f"the search {found.ended}; not proved to be best, a gap of {gap_s:.3g} s is left"
        )
    if worked_out.legs.edited[legs].any():
        notes.append("some legs have figures from the graph, not from the flight model")
    if worked_out.places.edited[stops.places].any():
        notes.append(
            "some places have sight or power of the laser from the graph, not from the mission"
        )
    plan = plan_for(
        asked,
        worked_out,
        engine=asked.engine,
        proof=proof,
        status=Status.OPTIMAL if proved else Status.FEASIBLE,
        notes=tuple(notes),
        phases=flown,
        soc=counted(worked_out, flown, _states_of_charge(worked_out, stops)),
    )
    return replayed(plan.model_copy(update={"binding": tuple(_binding(plan))}))


def _states_of_charge(worked_out: Network, stops: Stops) -> dict[str, float]:
    """State of charge at the end [-] by perspective: rests count by their mean net current."""
    rests = stops.places[1:-1] >= FIRST_BUILDING
    times_s = stops.stays_s[rests]
    net = rest_net(worked_out, stops.places[1:-1][rests] - FIRST_BUILDING)
    rest_time_s = float(times_s.sum())
    share = times_s / max(rest_time_s, TINY)
    given = replace(
        quantities(worked_out, np.array([0])),
        rest_current_A=float((net.current_A * share).sum()),
        rest_received_W=float((net.power_W * share).sum()),
    )
    return states_of_charge(given, stops.hover_s, rest_time_s)


def _binding(plan: Plan) -> Iterator[str]:
    """Which limits a plan reaches, in words."""
    limits, pool = plan.mission.limits, vehicle.pool(plan.mission)
    if plan.mission_time_s >= limits.deadline_s * (1.0 - BINDS):
        yield "deadline"
    for phase in plan.phases:
        where = (
            f"{'arriving at' if phase.kind == 'flight' else phase.kind + ' at'} {phase.end_place}"
        )
        share = phase.available_As[0] / pool.capacity_As
        if share <= BINDS:
            yield f"not dry, {where}"
        elif phase.kind != "flight" and share >= pool.available_fraction - BINDS:
            yield f"not past full, {where}"
    if plan.soc is not None and plan.soc["battery"] <= limits.min_soc + BINDS:
        yield "state of charge"
