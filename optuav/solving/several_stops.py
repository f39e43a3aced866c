"""(P1) with several rests and hovers, in any order over all places."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from decimal import ROUND_CEILING, Decimal

import numpy as np

from formulations.soc import AVAILABLE, LABELS
from optuav.arrays import Floats, Integers
from optuav.errors import SolverError
from optuav.network import vehicle
from optuav.network.feasibility import blocked_legs, impossibilities
from optuav.network.graph import Graph
from optuav.network.legs import NO_LEG
from optuav.network.network import Network
from optuav.network.one_stop import all_legs, find_shortcuts
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.routes import Routes, routes_along
from optuav.network.timeline import phases_along, simulated, stay_net
from optuav.network.variants import as_variants
from optuav.physics.quantity import TINY
from optuav.plan import Plan
from optuav.presentation.numbers import figure
from optuav.search.branch import INTERRUPTED, TIE_S, Progress, SearchResult, search
from optuav.search.greedy import greedy, hover_bound_s
from optuav.search.sequences import patterns, sequences
from optuav.search.terrain import Terrain
from optuav.solving.assemble import quantities
from optuav.solving.constraint_words import ENDS
from optuav.solving.no_plan import plan_without, shortfalls
from optuav.solving.program import Program
from optuav.solving.route_models import declarations
from optuav.solving.route_plan import AnswerFields, plan_for, replayed
from optuav.solving.stops_by_charge import longest_by_charge
from optuav.status import Status

ENGINE = "search"
MOST_SEQUENCES = 1 << 20  # sequences that are compared at most in a linear perspective
REACHED_LIMIT = 1e-8  # share of the capacity [-] or of the deadline within which a limit is reached


def several_stops(
    program: Program, graph: Graph | None = None, progress: Progress | None = None
) -> Plan:
    """The plan of the longest hover time with at most as many stops as the program asks for.

    Under ``available`` by branch and bound. In the linear perspectives one rest and one hover are
    enough if the legs obey the triangle inequality, as the state of charge at the end is linear in
    the total times of flying, hovering and resting: all stops but one hover and the rest where
    charging is best may be left out. Where edited graphs or buildings in the way break that
    inequality, all sequences are compared, each by its linear programme with the rest on its best
    building. If η0 must be left at every landing, each sequence has a programme with all its stays.
    """
    question = program.question
    rests, hovers = question.p1.stops, question.p1.hovers
    if impossibilities(program.network, one_stop=False):
        return program.solve()
    network = replace(program.network, legs=all_legs(program.network, graph))
    most = f"at most {rests} rest{'s' * (rests != 1)} and {hovers} hover{'s' * (hovers != 1)}"
    if question.perspective == AVAILABLE:
        limit_s = question.time_limit_s
        arrays = terrain(network)
        result = search(arrays, rests, hovers, time_limit_s=limit_s, progress=progress)
        if result.ended:
            bound_s = min(result.bound_s, hover_bound_s(arrays, rests, hovers))
            plans = filter(None, (result.stops, greedy(arrays, rests, hovers)))
            longest = max(plans, key=lambda plan: plan.hover_s, default=None)
            result = replace(result, stops=longest, bound_s=bound_s)
        return _plan(program, network, result, most)
    if network.mission.limits.keep_soc == "always":
        places, routed = _every_sequence(program, network, rests, hovers)
        limit_s = question.time_limit_s
        result = longest_by_charge(routed, places, question.perspective, limit_s)
        return _plan(program, network, result, most)
    if rests and not find_shortcuts(network):
        plan = program.solve()
        note = "one rest and one hover are enough: no way around is shorter than a leg"
        return plan.model_copy(update={"notes": (*plan.notes, note)})
    compared = _compared(program, network, rests, hovers)
    if not compared.parts:
        why = f"no sequence of stops with {most} can be flown within the deadline"
        compared = replace(compared, reasons=(why, *_why_none(program)))
    plan = compared.solve()
    proof = f"all sequences with {most} compared, each by {plan.proof}"
    return plan.model_copy(update={"engine": ENGINE, "proof": proof}) if compared.parts else plan


def terrain(network: Network) -> Terrain:
    """The arrays that a search takes, for a network whose legs lead between any two places."""
    mission, table = network.mission, network.legs
    places = len(network.places.names)

    def square(figures: Floats, absent: float) -> Floats:
        filled = np.full((*figures.shape[:-1], places, places), absent)
        filled[..., table.start, table.end] = np.where(table.flyable, figures, absent)
        return filled

    stay_current_A, buildings = np.zeros(places), np.arange(FIRST_BUILDING, places)
    for place in (HOVER, buildings):
        stay_current_A[place] = stay_net(network, place).current_A
    pool, limits = mission.pool, mission.limits
    least_As = limits.min_soc * float(pool.capacity_As)
    return Terrain(
        pool,
        limits.deadline_s,
        least_As,
        square(table.duration_s, np.inf),
        square(table.durations_s, 0.0),
        square(table.currents_A, 0.0),
        stay_current_A,
        mission.battery.charging == "taper",
        vehicle.start(mission),
        least_As if limits.keep_soc == "always" else -math.inf,
    )


def _routes(network: Network, places: Integers, building: Integers) -> Routes:
    """Sequences of places (place, sequence) as routes, and the building each rests on; −1: none."""
    table = network.legs
    number = np.full((len(network.places.names),) * 2, NO_LEG, dtype=np.intp)
    number[table.start, table.end] = np.arange(len(table.start))
    legs = np.where(places[1:] >= 0, number[places[:-1], places[1:]], NO_LEG).T
    hovers_first = (places == HOVER).argmax(axis=0)
    rests_first = (places == FIRST_BUILDING + building).argmax(axis=0)
    hovers = ~((building >= 0) & (rests_first < hovers_first))
    one = np.zeros((len(legs), 1), np.intp)
    return routes_along(table, legs, building, hovers.astype(np.intp), one)


def _compared(program: Program, network: Network, rests: int, hovers: int) -> Program:
    """The linear programmes of all sequences, each with a rest on its best building."""
    _, network = _every_sequence(program, network, rests, hovers)
    every_route = np.ones((1, len(network.routes)), bool)
    declared = declarations(program.question, as_variants(network), every_route)
    return replace(program, network=network, parts=tuple(part for part, _ in declared))


def _every_sequence(
    program: Program, network: Network, rests: int, hovers: int
) -> tuple[Integers, Network]:
    """All sequences (place, sequence), −1 beyond the end, and the network with them as routes.

    Each route has the rest on its best building.
    """
    question, town = program.question, terrain(network)
    net = stay_net(network, np.arange(FIRST_BUILDING, len(town.duration_s)))
    gain = net.current_A if question.perspective == "battery" else net.power_W
    # Behind the last stop of a sequence stands −1, which takes the last entry: no place.
    worth = np.concatenate([np.full(FIRST_BUILDING, -np.inf), gain, [-np.inf]])
    columns, count = [np.zeros((rests + hovers + 2, 0), dtype=np.intp)], 0
    for pattern in patterns(rests, hovers):
        for boxes in sequences(town, pattern):
            rows = np.full((rests + hovers + 2, len(boxes)), -1, dtype=np.intp)
            rows[: len(boxes.places)] = boxes.places
            columns.append(rows)
            count += len(boxes)
            if count > MOST_SEQUENCES:
                many = f"more than {MOST_SEQUENCES} sequences of stops"
                raise SolverError(f"{many}: ask for fewer stops or hovers")
    places = np.concatenate(columns, axis=1)
    best = np.take_along_axis(places, worth[places].argmax(axis=0)[None], axis=0)[0]
    building = np.where(best >= FIRST_BUILDING, best - FIRST_BUILDING, -1)
    return places, replace(network, routes=_routes(network, places, building))


def _why_none(program: Program) -> Sequence[str]:
    """Why not even one rest, if there may be any, and one hover make a plan."""
    parts = [part for part in program.parts if program.question.p1.stops or not part.rests]
    if parts:
        return shortfalls(program.question, program.network, parts)
    return program.reasons or blocked_legs(program.network, 0)


def _plan(program: Program, network: Network, found: SearchResult, most: str) -> Plan:
    """Return the plan of a search result, or of one rest and one hover if that is as good."""
    question, stops = replace(program.question, engine=ENGINE), found.stops
    if stops is None and found.bound_s <= 0.0:
        why = (f"no plan with {most} keeps the battery and the deadline", *_why_none(program))
        proof = "branch and bound over all sequences of stops"
        return plan_without(question, program.network, Status.INFEASIBLE, proof, why)
    # Rounded up: no plan hovers longer than the number that is written either.
    bound = Decimal(found.bound_s).quantize(Decimal("0.000001"), ROUND_CEILING)
    none_longer = f"with {most} no plan hovers longer than {bound} s"
    proof, hover_s = f"branch and bound: {none_longer}", stops.hover_s if stops else -math.inf
    one = None
    if question.p1.stops and (not stops or found.ended or len(stops.stays_s) <= 2):
        with suppress(SolverError):  # a search that ends early is never worse than this
            one = program.solve()
    # Among equally good plans with one rest and one hover, its own engine finds the shortest.
    if one and (one.hover_time_s < hover_s - TIE_S or (one.bound and stops and not found.ended)):
        one = None
    hover_s = one.hover_time_s if one else hover_s
    gap_s, notes = found.bound_s - hover_s, list[str]()
    status = Status.OPTIMAL if gap_s <= 3.0 * TIE_S else Status.FEASIBLE
    open_ = {"bound": found.bound_s} if status is Status.FEASIBLE else {}
    if found.ended:
        left = f"a gap of {figure(gap_s, 3)} s is left"
        notes.append(f"the search {found.ended}; not proved to be best, {left}")
    if one:
        edits = {"status": status, "notes": (*one.notes, *notes), "proof": proof, "engine": ENGINE}
        return one.model_copy(update=edits | open_)
    if stops is None:
        none = "without a plan or proof that none exists"
        message = f"the search {found.ended} {none}: {none_longer}"
        if found.ended != INTERRUPTED:
            message += ". Allow more time (time_limit_s), or fewer stops or hovers"
        raise SolverError(message)
    network = replace(network, routes=_routes(network, stops.places[:, None], np.array([-1])))
    legs = network.routes.legs[0].tolist()
    flown = simulated(network.mission, phases_along(network, legs, stops.stays_s.tolist()))
    # All rests count as one by their mean net current.
    rests = stops.places[1:-1] >= FIRST_BUILDING
    times_s, net = stops.stays_s[rests], stay_net(network, stops.places[1:-1][rests])
    rest_time_s = float(times_s.sum())
    share = times_s / max(rest_time_s, TINY)
    values = replace(
        quantities(network, np.array([0])),
        rest_current_A=float((net.current_A * share).sum()),
        rest_received_W=float((net.power_W * share).sum()),
    )
    times = stops.hover_s, rest_time_s
    said: AnswerFields = {"engine": ENGINE, "proof": proof, "status": status, "notes": notes}
    if status is Status.FEASIBLE:
        said["bound"] = found.bound_s
    plan = plan_for(question, network, flown, values, times, **said)
    return replayed(plan.model_copy(update={"binding": tuple(_binding(plan))}))


def _binding(plan: Plan) -> Iterator[str]:
    """Labels of the limits that a plan reaches."""
    limits, pool = plan.mission.limits, plan.mission.pool
    if plan.mission_time_s >= limits.deadline_s * (1.0 - REACHED_LIMIT):
        yield "deadline"
    for phase in plan.phases:
        moment = ENDS[phase.kind].format(phase.start_place, phase.end_place)
        share = phase.available_As[0] / pool.capacity_As
        charges = phase.kind != "flight" and plan.mission.battery.charging != "taper"
        if share <= REACHED_LIMIT:
            yield f"{LABELS['dry']} {moment}"
        elif charges and share >= pool.available_fraction - REACHED_LIMIT:
            yield f"{LABELS['past full']} {moment}"
    if plan.soc is not None and plan.soc["battery"] <= limits.min_soc + REACHED_LIMIT:
        yield "state of charge"
