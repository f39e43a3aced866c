"""The legs between any two places of a mission, and whether more stops may bring a longer hover."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from formulations.soc import AVAILABLE
from optuav.arrays import Booleans
from optuav.network.feasibility import never_flyable
from optuav.network.graph import edited_legs
from optuav.network.network import Legs, Network, build_legs
from optuav.network.obstacles import prisms
from optuav.network.one_stop import FIGURES, TOLERANCE
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.timeline import hover_net, rest_net

if TYPE_CHECKING:
    from optuav.network.graph import Graph
    from optuav.plan import Plan

MOST_COMPARED = 60
"""Buildings of a mission whose legs are all compared with the ways around them."""
SAME_S = 1e-6
"""Hover times that differ by no more than this are equal [s]."""


def more_stops_may_help(network: Network, plan: Plan, graph: Graph | None = None) -> bool:
    """Whether plans with more rests or hovers may hover longer, by arithmetic alone.

    False is certain, True is not. False is returned for one of these reasons:

    - No number of stops makes the mission flyable: the UAV is too heavy, or the device is out of
      reach.
    - In a linear perspective the legs obey the triangle inequality: no leg between origin, hover
      point, building and destination takes more time, charge or energy than a way around. Any plan
      may then leave out all stops but one hover and the rest where charging is best, and lose
      nothing.
    - Under ``available`` the legs obey it too, and the plan hovers as long as the balance of charge
      and the deadline admit on any route with one rest. Both limits hold for every plan, so the
      same argument bounds plans with more stops.

    Parameters
    ----------
    network
        The network that the plan was found in.
    plan
        The answer to (P1) over all routes with at most one rest and one hover in one piece; it may
        be a plan that says that there is none.
    graph
        The edited graph that the network was read from, if any: it may state legs between
        buildings, which the network does not have.

    Returns
    -------
    bool
        True also where this is not known: with more than 60 buildings, and for an edited network
        without its graph.
    """
    if never_flyable(network):
        return False
    hover_s = plan.hover_time_s if plan else -np.inf
    if plan.perspective == AVAILABLE and hover_s < _most_hover_s(network) - SAME_S:
        return True
    if len(network.mission.buildings) > MOST_COMPARED:
        return True
    legs = all_legs(network, graph)
    if graph is None and not _is_computed(network.legs, legs):
        return True
    return bool(ways_around(replace(network, legs=legs)).any())


def _most_hover_s(network: Network) -> float:
    """What charge and deadline leave for the hover on any route with one rest [s]; −inf if none."""
    mission, routes = network.mission, network.routes
    capacity_As = mission.battery.packs * mission.battery.capacity_As
    left_s = mission.limits.deadline_s - routes.flight_time_s
    spare_As = (1.0 - mission.limits.min_soc) * capacity_As - routes.flight_charge_As
    charging_A = np.maximum(rest_net(network, routes.building).current_A, 0.0)
    gained_A = np.where(routes.building >= 0, charging_A, 0.0)
    drawn_A = gained_A - hover_net(network).current_A
    with np.errstate(divide="ignore", invalid="ignore"):
        # Resting for all the time that is left: I Δ − c (t − Δ) = Q.
        longest_s = np.where(drawn_A > 0.0, (spare_As + gained_A * left_s) / drawn_A, np.inf)
    longest_s = np.minimum(left_s, longest_s)
    return float(np.max(longest_s, where=routes.flyable & (longest_s >= 0.0), initial=-np.inf))


def _is_computed(stated: Legs, legs: Legs) -> bool:
    """Whether a table of legs is as computed, and no edge of its graph was removed."""
    number = {way: k for k, way in enumerate(zip(legs.start, legs.end, strict=True))}
    same = [number[way] for way in zip(stated.start, stated.end, strict=True)]
    return not stated.edited.any() and bool((stated.flyable == legs.flyable[same]).all())


def all_legs(network: Network, graph: Graph | None = None) -> Legs:
    """The legs between any two places of a mission.

    A graph from `optuav.graph` has the legs with one building on the way, so those that it lacks
    are forbidden; legs between other places are as computed, unless it states them too.
    """
    places = network.places
    start, end = np.nonzero(~np.eye(len(places.names), dtype=bool))
    table = build_legs(network.mission, places, prisms(network.mission), start, end)
    if graph is None:
        return table
    gone = np.array([name not in graph for name in places.names])
    one_stop = np.zeros((len(gone), len(gone)), bool)
    one_stop[network.legs.start, network.legs.end] = True
    needed = one_stop[start, end] | gone[start] | gone[end]
    return edited_legs(table, places.names, graph, needed)


def ways_around(network: Network) -> Booleans:
    """Whether a way around takes less than a leg in time, charge or energy (figure, leg).

    Only the legs between origin, hover point, buildings and destination are looked at that a plan
    with one rest and one hover flies; one that is not there is longer than any way.

    Parameters
    ----------
    network
        Its legs lead between any two places.
    """
    table, places = network.legs, len(network.places.names)
    start, end = table.start, table.end
    one_stop = (start != DESTINATION) & (end != ORIGIN) & ((start == HOVER) | (end == HOVER))
    one_stop |= (start == ORIGIN) & (end >= FIRST_BUILDING)
    one_stop |= (start >= FIRST_BUILDING) & (end == DESTINATION)
    ways_there = table.flyable & (end != ORIGIN) & (start != DESTINATION)
    found = np.zeros((len(FIGURES), len(start)), bool)
    for row, name in enumerate(FIGURES):
        figure = np.asarray(getattr(table, name))
        direct = np.full((places, places), np.inf)
        direct[start[ways_there], end[ways_there]] = figure[ways_there]
        around = direct
        for via in range(places):
            around = np.minimum(around, around[:, via, None] + around[via])
        longest = around[start, end] * (1.0 + TOLERANCE)
        found[row] = one_stop & (direct[start, end] > longest)
    return found
