"""What the balance of charge promises, and whether more stops may bring a longer hover."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from formulations.soc import AVAILABLE
from optuav.arrays import Booleans, Floats
from optuav.network.feasibility import never_flyable
from optuav.network.graph import edited_legs
from optuav.network.network import Legs, Network, build_legs
from optuav.network.obstacles import prisms
from optuav.network.one_stop import FIGURES, TOLERANCE
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.timeline import route_phases, simulated, stay_net
from optuav.plan import Plan
from optuav.solving.outcome import SAME_S, Part, best

if TYPE_CHECKING:
    from optuav.network.graph import Graph

MOST_COMPARED = 60  # buildings of a mission whose legs are all compared with the ways around them


def more_stops_may_help(network: Network, plan: Plan, graph: Graph | None = None) -> bool:
    """Whether plans with more rests or hovers may hover longer, by arithmetic alone.

    False is certain: no number of stops makes the mission flyable, or no leg takes more than a way
    around. In a linear perspective any plan may then leave out all stops but one hover and the rest
    where charging is best; under ``available`` the plan also hovers as long as the balance of
    charge and the deadline admit on any route with one rest, which bounds every plan.
    """
    if never_flyable(network):
        return False
    if plan.perspective == AVAILABLE:
        hovers_s, _ = by_balance(network, rests=True)
        most_s = hovers_s[network.routes.flyable].max(initial=-np.inf)
        if (plan.hover_time_s if plan else -np.inf) < most_s - SAME_S:
            return True
    if len(network.mission.buildings) > MOST_COMPARED:
        return True
    legs, own = all_legs(network, graph), network.legs
    if graph is None:
        flyable = np.zeros((len(network.places.names),) * 2, bool)
        flyable[legs.start, legs.end] = legs.flyable
        if own.edited.any() or (own.flyable != flyable[own.start, own.end]).any():
            return True
    return ways_around(replace(network, legs=legs))


def by_balance(network: Network, rests: Booleans | bool) -> tuple[Floats, Floats]:
    """The longest Δ of all routes, and the least T' for it [s], by charge and deadline.

    −∞ where there is none; a route by way of a building may rest there or not.
    """
    mission, routes = network.mission, network.routes
    capacity_As = mission.battery.packs * mission.battery.capacity_As
    left_s = mission.limits.deadline_s - routes.flight_time_s
    spare_As = (1.0 - mission.limits.min_soc) * capacity_As - routes.flight_charge_As
    drawn_A = -stay_net(network, HOVER).current_A
    charging_A = np.maximum(stay_net(network, FIRST_BUILDING + routes.building).current_A, 0.0)
    gained_A = np.where(rests & (routes.building >= 0), charging_A, 0.0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # Resting for all the time that is left: I Δ − c (t − Δ) = Q.
        most_s = (spare_As + gained_A * left_s) / (drawn_A + gained_A)
        charges = np.where(spare_As >= drawn_A * left_s, np.inf, -np.inf)
        hover_s = np.minimum(left_s, np.where(drawn_A + gained_A > 0.0, most_s, charges))
        # Where next to nothing charges, rounding asks for more rest than there is time.
        rest_s = np.clip((drawn_A * hover_s - spare_As) / gained_A, 0.0, left_s - hover_s)
    return np.where(hover_s >= 0.0, hover_s, -np.inf), np.where(gained_A > 0.0, rest_s, 0.0)


def promise(network: Network, parts: Sequence[Part], plan: Plan) -> Iterator[str]:
    """A note on what charge alone promises, where a battery that never runs dry gives less."""
    routes = network.routes
    served, rests = np.zeros((2, len(routes)), bool)
    for part in parts:
        served[part.routes], rests[part.routes] = True, part.rests
    hover_s, rest_s = by_balance(network, rests)
    hover_s = np.where(served, hover_s, -np.inf)
    route = best(hover_s, routes.flight_time_s + hover_s + rest_s, routes.building >= 0)
    if route is None or hover_s[route] <= plan.hover_time_s + SAME_S:
        return
    note = "perspective battery, which looks at the charge left at the end alone, "
    note += f"promises {hover_s[route]:.2f} s of hover"
    phases = route_phases(network, route, float(hover_s[route]), float(rest_s[route]))
    flown = plan.model_copy(update={"phases": simulated(network.mission, phases)})
    if (dry_s := flown.runs_dry_s) is not None:
        note += f"; that plan would run dry and fall at {dry_s:.2f} s"
    yield note


def all_legs(network: Network, graph: Graph | None = None) -> Legs:
    """The legs between any two places of a mission, with the figures that a graph states."""
    places = network.places
    start, end = np.nonzero(~np.eye(len(places.names), dtype=bool))
    table = build_legs(network.mission, places, prisms(network.mission), start, end)
    if graph is None:
        return table
    # A graph has the legs with one building on the way, so those that it lacks are forbidden.
    gone = np.array([name not in graph for name in places.names])
    one_stop = np.zeros((len(gone), len(gone)), bool)
    one_stop[network.legs.start, network.legs.end] = True
    needed = one_stop[start, end] | gone[start] | gone[end]
    return edited_legs(table, places.names, graph, needed)


def ways_around(network: Network) -> bool:
    """Whether a way around is shorter, in any figure, than a leg that a plan with one rest flies.

    The network's legs lead between any two places; one that is not there is longer than any way.
    """
    table, places = network.legs, len(network.places.names)
    flown = np.zeros((places, places), bool)
    flown[[ORIGIN, HOVER]] = flown[FIRST_BUILDING:, [HOVER, DESTINATION]] = True
    flown[:, ORIGIN] = flown[ORIGIN, DESTINATION] = flown[HOVER, HOVER] = False
    there = table.flyable & (table.end != ORIGIN) & (table.start != DESTINATION)
    direct = np.full((len(FIGURES), places, places), np.inf)
    figures = [getattr(table, name)[there] for name in FIGURES]
    direct[:, table.start[there], table.end[there]] = figures
    around = direct
    for via in range(places):
        around = np.minimum(around, around[:, :, via, None] + around[:, via, None])
    return bool((flown & (direct > around * (1.0 + TOLERANCE))).any())
