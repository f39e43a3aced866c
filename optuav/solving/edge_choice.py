"""(P1) along the edges of the graph (`formulations.edges`), which chooses order and rest at once.

It answers for more devices than lists of their orders hold, in the perspectives of the paper.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from formulations.edges import Edge, EdgeGraph, Roof, Subtour, edge_choice, shortest_way
from formulations.parameters import Covered, Hover, Quantities
from optuav.engines.registry import AUTO
from optuav.engines.solution import Solution
from optuav.errors import Fault, SolverError, refuse
from optuav.mission import Mission
from optuav.mission.messages import shown
from optuav.modelling import Model
from optuav.network.feasibility import blocked_legs, impossibilities
from optuav.network.network import Network
from optuav.network.places import DESTINATION, ORIGIN
from optuav.network.routes import build_routes
from optuav.network.variants import as_variants
from optuav.options import Order
from optuav.physics.quantity import Quantity
from optuav.plan import Plan
from optuav.presentation.numbers import figure
from optuav.solving.assemble import map_arrays, quantities, route_quantities, table_entries
from optuav.solving.no_plan import plan_without, shortfalls
from optuav.solving.program import best_plan, declared_program
from optuav.solving.question import Question, solve_model
from optuav.solving.subtours import relaxed_subtours
from optuav.status import Status

AGREES_S, AGREES = 1e-5, 1e-9
"""Tolerance between the optimum on what was chosen and that among all [s], and relative."""
NO_WAY = "no way that can be flown leads over all hover points with one rest at most"


@dataclass(frozen=True)
class EdgeAnswer:
    """The best plan along some edges, and the programme that chose the order of its hovers."""

    plan: Plan
    edges: EdgeGraph | None = None  # None where no flight is possible
    subtours: Sequence[Subtour] = ()  # For which the programme has a row
    model: Model | None = None


def best_along_edges(question: Question, network: Network) -> EdgeAnswer:
    """The best plan over all orders of devices, or over one, and all places of the rest.

    The programme chooses the order. The rest and the times come from the routes of that order, as
    for a stated one, and have to agree with the programme.
    """
    refuse(faults_of_edges(network.mission, question))
    if reasons := impossibilities(network, one_stop=False):
        return EdgeAnswer(plan_without(question, network, Status.INFEASIBLE, "physics", reasons))
    graph = edge_graph(question, network)
    if graph is None:
        return EdgeAnswer(_no_way(question, network))
    subtours = relaxed_subtours(edge_choice(graph, question.perspective), graph)
    model = edge_choice(graph, question.perspective, subtours)
    solution = solve_model(model, 1, question)
    if solution.status is Status.INFEASIBLE:
        return EdgeAnswer(_no_plan(question, network, graph, solution), graph, subtours, model)
    if not solution.status.has_answer:
        words = solution.words[0]
        raise SolverError(f"{solution.engine} did not solve the choice of edges: {words}")
    plan = best_plan(replace(question, engine=AUTO), _in_order(network, graph, solution))
    among_all_s = float(solution.objective[0])
    if not plan or not agree(plan.hover_time_s, among_all_s):
        raise SolverError(
            f"{solution.engine} returned {figure(among_all_s, 9)} s along all edges, "
            f"but {figure(plan.hover_time_s, 9)} s is best in the order that it chose"
        )
    changes = {"engine": solution.engine, "proof": solution.proof}
    return EdgeAnswer(plan.model_copy(update=changes), graph, subtours, model)


def agree(chosen_s: float, among_all_s: float) -> bool:
    """Whether the optimum on what was chosen is the one among all [s], but for rounding."""
    return math.isclose(chosen_s, among_all_s, rel_tol=AGREES, abs_tol=AGREES_S)


def faults_of_edges(mission: Mission, question: Question) -> Iterator[Fault]:
    """What the programme along edges does not state."""
    with_form = "with form = 'edges'"
    if question.slot_s is not None:
        yield Fault("slot_s", shown(question.slot_s), f"must be left out {with_form}")
    trajectory = question.problem.trajectory
    if trajectory not in ("optimal", "direct"):
        yield Fault("trajectory", shown(trajectory), f"must be optimal or direct {with_form}")
    has_energy = mission.battery.flight_energy_J is not None
    if (
        question.perspective == "adjusted"
        and mission.limits.keep_soc == "always"
        and not has_energy
    ):
        words = f"must be battery or energy {with_form} and limits.keep_soc = 'always', unless "
        words += "battery.flight_energy_J is set: the share of a leg depends on the others"
        yield Fault("perspective", shown(question.perspective), words)


def edge_graph(question: Question, network: Network) -> EdgeGraph | None:
    """The edges that routes of a question may take; None if a place of every route has none."""
    places, names = network.places, network.places.names
    points = [names[place] for place in places.hovers.tolist()]
    begin, end = [names[ORIGIN], *points], [*points, names[DESTINATION]]
    # Edges with rows of a kind follow each other: their numbers are printed as one range.
    edges = sorted(
        _edges(question, network),
        key=lambda edge: (edge.end == end[-1], edge.start != begin[0], edge.start not in begin),
    )
    from_s, to_s = dict[str, float](), dict[str, float]()  # The shortest edges of every place
    for edge in edges:
        from_s[edge.start] = min(edge.time_s, from_s.get(edge.start, edge.time_s))
        to_s[edge.end] = min(edge.time_s, to_s.get(edge.end, edge.time_s))
    if not (from_s.keys() >= {*begin} and to_s.keys() >= {*end}):
        return None
    # An edge leaves all places of a route but the last, and one leads to all but the first.
    left_s, reached_s = sum(from_s[name] for name in begin), sum(to_s[name] for name in end)
    roofs = {
        name: Roof(*charging, max(left_s + from_s[name], reached_s + to_s[name]))
        for name, charging in _charging(network)
        if name in from_s and name in to_s
    }
    used = {*begin, *end, *roofs}
    return EdgeGraph(
        _given(network),
        [edge for edge in edges if {edge.start, edge.end} <= used],
        points,
        roofs,
        max(left_s, reached_s),
        keeps_landings=network.mission.limits.keep_soc == "always",
    )


OUTSIDE: Mapping[Order | None, tuple[tuple[str, str], ...]] = {
    None: (),
    "rest-first": (("hover", "building"), ("building", "destination")),
    "between": (("origin", "building"), ("building", "destination")),
    "hover-first": (("origin", "building"), ("building", "hover")),
}
"""Kinds of places between which routes with a rest in some order fly no leg."""


def _edges(question: Question, network: Network) -> Iterator[Edge]:
    """The legs that routes of a question may fly, in the order of the network."""
    places, legs, problem = network.places, network.legs, question.problem
    figures = np.stack([legs.duration_s, legs.charge_As, legs.energy_J], axis=1).tolist()
    device_order = problem.device_order
    way = itertools.pairwise(("origin", *(device_order or ()), "destination"))
    follows, outside = {*way}, OUTSIDE[problem.order]
    for leg in np.flatnonzero(legs.flyable).tolist():
        ends = int(legs.start[leg]), int(legs.end[leg])
        start, end = (places.kind(place) for place in ends)
        edge = Edge(places.names[ends[0]], places.names[ends[1]], *figures[leg])
        by_roof = "building" in (start, end)
        if by_roof and (problem.trajectory == "direct" or (start, end) in outside):
            continue
        if by_roof or device_order is None or edge[:2] in follows:
            yield edge


def _charging(network: Network) -> Iterator[tuple[str, tuple[float, float]]]:
    """Net current [A] and received power [W] of a rest on every roof, by name."""
    table, routes = route_quantities(as_variants(network)), network.routes
    for building in network.buildings.tolist():
        route = np.flatnonzero(routes.building == building)[:1]
        stays = table.rest_current_A, table.rest_received_W
        current_A, received_W = (_number(table_entries(stay, None, route)) for stay in stays)
        yield network.mission.buildings.names[building], (current_A, received_W)


def _given(network: Network) -> Quantities:
    """The figures of the mission as numbers, with a hover of each device in the mission's order."""
    table = quantities(network, np.zeros(1, np.intp), rests=False, steps=False)
    hovers = table.hovers or [Hover(1.0, table.hover_current_A, table.hover_received_W)]
    return map_arrays(
        replace(table, landings=(), rests=True),
        _number,
        hovers=tuple(Hover(*map(_number, hover)) for hover in hovers),
        covered=tuple(Covered(name, *map(_number, point)) for name, *point in table.covered),
    )


def _number(value: Quantity) -> float:
    """The only entry of an array."""
    return float(np.squeeze(value))


def _in_order(network: Network, graph: EdgeGraph, solution: Solution) -> Network:
    """The network with all routes that hover in the order of the edges that are flown."""
    point = solution.point(0)
    flown = (edge[:2] for k, edge in enumerate(graph.edges, start=1) if point[f"edge[{k}]"] > 0.5)
    after, way = dict(flown), [network.places.names[ORIGIN]]
    while way[-1] in after:
        way.append(after.pop(way[-1]))
    order = [graph.hovers.index(name) for name in way if name in graph.hovers]
    routes = build_routes(network.legs, network.buildings, np.array([order]))
    return replace(network, routes=routes)


def _no_way(question: Question, network: Network) -> Plan:
    """The plan that says which legs are missing."""
    missing = dict.fromkeys(blocked_legs(network, 0))
    why = (NO_WAY, *missing)
    return plan_without(question, network, Status.INFEASIBLE, "physics", why)


def _no_plan(question: Question, network: Network, graph: EdgeGraph, solution: Solution) -> Plan:
    """The plan that says what cannot hold on the shortest flight."""
    subtours = relaxed_subtours(shortest_way(graph), graph)
    shortest = solve_model(shortest_way(graph, subtours), 1, question)
    if not shortest.status.has_answer:
        return _no_way(question, network)
    any_engine, way = replace(question, engine=AUTO), _in_order(network, graph, shortest)
    why = shortfalls(any_engine, way, declared_program(any_engine, way).parts)
    return plan_without(question, network, solution.status, solution.proof, why)
