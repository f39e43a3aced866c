"""The routes over several devices that a question may take, in every order or in one.

Up to some thousands, all are rows of a table. Beyond, a route is no row before a bound has left it
open: for every order and every place of the rest, the times and charges of the legs before and
after the roof are added to those to and from each roof, a table of orders and roofs. Charge and
deadline at the end bound the hover on all of them at once; it is the longest hover itself where
nothing else counts. Routes are then compared in the order of this bound, until none is left whose
bound exceeds the best.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np

from formulations.formulation import Formulation
from formulations.p3 import P3
from formulations.soc import PAPER
from optuav.arrays import Floats, Integers
from optuav.errors import refuse
from optuav.mission import Mission
from optuav.network.graph import Graph, network_of
from optuav.network.network import Network
from optuav.network.routes import build_routes, some_routes, straight_legs
from optuav.network.variants import as_variants
from optuav.solving.assemble import route_quantities
from optuav.solving.balance import Balance, affine_charge, longest_by_balance
from optuav.solving.best_plans import SLACK_S, hover_times_s
from optuav.solving.question import (
    MOST_FREE,
    MOST_ROWS,
    Question,
    count_of_routes,
    too_many_orders,
)
from optuav.solving.route_models import permitted_routes

FIRST_ROUTES = 64  # Routes that are compared first; then twice as many, and so on up to the most
MOST_AT_ONCE = 1 << 15  # Few enough for bounded memory


def orders_of(mission: Mission, problem: Formulation) -> Integers:
    """Orders of the devices that a problem may take (order, device), the mission's first."""
    names = [device.name for device in mission.devices]
    if problem.device_order is not None:
        return np.array([[names.index(name) for name in problem.device_order]])
    return np.array([*permutations(range(len(names)))])


def network_for(mission: Mission, graph: Graph | None, question: Question) -> Network:
    """The network of a mission, or of its edited graph, with the routes of a question."""
    network = network_of(mission, graph)
    return with_routes(network, question) if mission.devices else network


def with_routes(network: Network, question: Question) -> Network:
    """The network of several devices with the routes of a question that may be the best."""
    mission, problem = network.mission, question.problem
    if problem.device_order is None and len(mission.devices) > MOST_FREE:
        refuse([too_many_orders(mission)])
    orders = orders_of(mission, problem)
    if count_of_routes(mission, problem) <= MOST_ROWS:
        return replace(network, routes=build_routes(network.legs, network.buildings, orders))
    bounds_s = [*_bounds(network, question, orders)]
    every_s = np.concatenate([bound_s.ravel() for _, bound_s in bounds_s])
    # The best hover on the few routes with the largest bounds leaves few others to sort.
    others = max(every_s.size - FIRST_ROUTES, 0)
    few = np.argpartition(every_s, others)[others:]
    few = few[every_s[few] >= 0.0]
    hovers_s = _hovers_s(_rows(network, orders, *_decoded(bounds_s, orders, few)), question, 0.0)
    best_s, first, size = float(hovers_s.max(initial=0.0)), 0, FIRST_ROUTES
    left = np.flatnonzero(every_s >= max(best_s - SLACK_S, 0.0))
    falling = left[np.argsort(-every_s[left], kind="stable")]
    chosen = list[Integers]()
    while first < len(falling) and every_s[falling[first]] >= best_s - SLACK_S:
        some = falling[first : first + size]
        some = some[every_s[some] >= best_s - SLACK_S]
        rows = _rows(network, orders, *_decoded(bounds_s, orders, some))
        hovers_s = _hovers_s(rows, question, best_s)
        best_s = max(best_s, float(hovers_s.max(initial=0.0)))
        chosen = [*chosen, some[hovers_s >= best_s - SLACK_S]]
        first, size = first + size, min(2 * size, MOST_AT_ONCE)
    if not (numbers := np.concatenate([*chosen, np.zeros(0, np.intp)])).size:
        return network  # No route has a plan: the mission's own order tells why
    order, roof, after = _decoded(bounds_s, orders, numbers)
    ties = np.lexsort((after, roof, order, roof >= 0))
    return _rows(network, orders, order[ties], roof[ties], after[ties])


def _bounds(network: Network, question: Question, orders: Integers) -> Iterator[tuple[int, Floats]]:
    """By place of the rest, −1 for none, upper bounds of Δ (order, roof or 1) [s], −∞ for none."""
    problem, last = question.problem, orders.shape[1]
    perspective = question.perspective if question.perspective in PAPER else "battery"
    whole = replace(network, routes=build_routes(network.legs, network.buildings, orders[:1]))
    table = route_quantities(as_variants(whole))
    rest_A, rest_W = (
        np.atleast_2d(x)[:, 1 :: last + 1] if np.ndim(x) and np.size(x) > 1 else x
        for x in (table.rest_current_A, table.rest_received_W)
    )
    figures = network.legs.duration_s, network.legs.charge_As, network.legs.energy_J
    legs = [np.where(network.legs.flyable, figure, np.inf) for figure in figures]
    straight, roofs = straight_legs(orders), np.arange(len(network.buildings))
    of_roof = last * (last + 1) + (2 * last + 2) * roofs
    ways = [x[straight] for x in legs]
    before = [np.cumsum(np.insert(x, 0, 0.0, axis=1), axis=1) for x in ways]
    behind = [np.cumsum(x[:, ::-1], axis=1)[:, ::-1] for x in ways]

    def bound_s(flown: list[Floats], rests: bool) -> Floats:
        """Δ by charge at the end and the deadline."""
        flown_s, flown_As, flown_J = flown
        draws = np.where(flown_As > 0.0, flown_As, 1.0)
        with np.errstate(invalid="ignore"):  # where there is no such leg
            mean_V = np.where(flown_As > 0.0, flown_J / draws, table.nominal_voltage_V)
            given = replace(
                table,
                flight_time_s=flown_s,
                flight_charge_As=flown_As,
                flight_energy_J=flown_J,
                flight_voltage_V=mean_V,
                rest_current_A=rest_A if rests else 0.0,
                rest_received_W=rest_W if rests else 0.0,
            )
            return longest_by_balance(Balance(*affine_charge(given, perspective), given.time_left))

    wanted = problem.building
    if wanted is None:
        yield -1, bound_s([x[:, -1:] for x in before], rests=False)
    if isinstance(problem, P3) or problem.trajectory == "direct":
        return
    for after in range(last + 1):
        kind = "rest-first" if after == 0 else "hover-first" if after == last else "between"
        if problem.order not in (None, kind):
            continue
        there = orders[:, after - 1] if after else None
        back = orders[:, after] if after < last else None
        flown = list[Floats]()
        for leg, until, onward in zip(legs, before, behind, strict=True):
            to_roof = leg[of_roof[None] + (0 if there is None else 1 + last + there[:, None])]
            away = 1 + 2 * last if back is None else 1 + back[:, None]
            rest = 0.0 if back is None else onward[:, after + 1, None]
            flown.append(until[:, after, None] + to_roof + leg[of_roof[None] + away] + rest)
        hover_s = bound_s(flown, rests=True)
        if wanted is not None:
            names = [network.mission.buildings.names[k] for k in network.buildings.tolist()]
            hover_s = np.where([name == wanted for name in names], hover_s, -np.inf)
        yield after, hover_s


def _decoded(
    bounds_s: list[tuple[int, Floats]], orders: Integers, numbers: Integers
) -> tuple[Integers, Integers, Integers]:
    """Order, roof (−1 for none) and place of the rest of routes by their numbers in the tables."""
    ends = np.cumsum([0, *(bound_s.size for _, bound_s in bounds_s)])
    table = np.searchsorted(ends, numbers, side="right") - 1
    widths = np.array([bound_s.shape[1] for _, bound_s in bounds_s])[table]
    after = np.array([after for after, _ in bounds_s])[table]
    order, roof = np.divmod(numbers - ends[table], widths)
    direct = after < 0
    return order, np.where(direct, -1, roof), np.where(direct, orders.shape[1], after)


def _rows(
    network: Network, orders: Integers, order: Integers, roof: Integers, after: Integers
) -> Network:
    """The network with some routes as rows."""
    routes = some_routes(network.legs, network.buildings, orders[order], roof, after)
    return replace(network, routes=routes)


def _hovers_s(network: Network, question: Question, least_s: float) -> Floats:
    """The longest hover of routes of a network [s], −∞ for none, as their numbers rise."""
    variants = as_variants(network)
    perspective = question.perspective if question.perspective != "wells" else "battery"
    hovers_s = hover_times_s(variants, perspective, max(least_s - SLACK_S, 0.0))[0]
    return np.where(permitted_routes(variants, question.problem)[0], hovers_s, -np.inf)
