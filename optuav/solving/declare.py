"""From a question to its declarations, each over the itineraries that it serves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from formulations.soc import PAPER
from optuav.arrays import Integers
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.modelling.check import refuse_misfits
from optuav.modelling.classify import traits
from optuav.network.feasibility import blocked_legs, impossibilities
from optuav.network.graph import edited_network
from optuav.network.network import Network, build_network, nearest_building, trajectory_routes
from optuav.solving.assemble import quantities
from optuav.solving.dispatch import refuse_unfit
from optuav.solving.plans import Part
from optuav.solving.program import Program
from optuav.solving.question import AUTO, Question

if TYPE_CHECKING:
    from optuav.network.graph import Graph

MOST_REASONS = 10
"""Blocked legs that are named one by one."""


def declared_program(question: Question, network: Network) -> Program:
    """The question as a program; without parts, and with reasons, where nothing can be flown.

    Raises
    ------
    InputError
        If the engine that was asked for does not take the problem, or an array in it has neither
        one entry nor one an itinerary.
    """
    reasons = impossibilities(network)
    parts = () if reasons else _parts(question, network)
    if not parts and not reasons:
        reasons = _no_route(question, network)
    for part in parts:
        refuse_misfits(part.model, len(part.routes))
        if question.engine != AUTO:
            refuse_unfit(traits(part.model), question)
    return Program(question, network, parts, reasons)


def work_out(mission: Mission, graph: Graph | None = None) -> Network:
    """Places, legs and itineraries of a mission, or of its graph that was edited."""
    if graph is None:
        return build_network(mission)
    return edited_network(mission, graph)


def _parts(question: Question, network: Network) -> tuple[Part, ...]:
    """The declarations that answer a question, each over the itineraries it serves."""
    return tuple(
        Part(model, which)
        for which, rests in groups(question, network)
        if (model := declared(question, quantities(network, which, rests=rests))) is not None
    )


def groups(question: Question, network: Network) -> list[tuple[Integers, bool]]:
    """Routes that one declaration serves, and whether they may rest on the way."""
    routes = network.routes
    allowed = trajectory_routes(network, question.trajectory or "optimal", question.order)
    by_way = allowed[routes.building[allowed] >= 0]
    direct = allowed[routes.building[allowed] < 0]
    if question.building is not None:
        by_way = by_way[routes.building[by_way] == _number(network, question.building)]
        direct = direct[:0]
    if question.slot_s is not None and question.trajectory in ("traj1", "traj2"):
        # A rest takes at least one slot, so to pass a building by is a choice of its own.
        direct = by_way
    found = [(direct, False), (by_way, True)]
    if isinstance(question.problem, P3):
        found = found[:1]
    elif isinstance(question.problem, P4):
        found = found[1:]
    return [
        (which, rests) for group, rests in found for which in _together(question, network, group)
    ]


def declared(question: Question, given: Quantities) -> Model | None:
    """The question declared of some itineraries; None where it has no use for their rests."""
    model = question.problem.model(given, question.perspective)
    has_rest = any(variable.name == "rest_time_s" for variable in model.variables)
    return model if given.rests == has_rest else None


def _together(question: Question, network: Network, group: Integers) -> list[Integers]:
    """Routes that one declaration serves: through the wells, the order of stays matters."""
    if question.perspective in PAPER:
        return [group] if len(group) else []
    rest_first = network.routes.rest_first[group]
    return [each for each in (group[rest_first], group[~rest_first]) if len(each)]


def _number(network: Network, building: str) -> int:
    return [each.name for each in network.mission.buildings].index(building)


def _no_route(question: Question, network: Network) -> tuple[str, ...]:
    """Why no itinerary of the question can be flown."""
    routes = network.routes
    direct = isinstance(question.problem, P3) or question.trajectory == "direct"
    if not network.mission.buildings and not direct:
        return ("the mission has no building to go by way of",)
    wanted = (routes.building < 0) if direct else (routes.building >= 0)
    if question.building is not None:
        wanted &= routes.building == _number(network, question.building)
    if question.trajectory == "traj1":
        wanted &= routes.building == nearest_building(network)
    if question.order is not None:
        wanted &= routes.rest_first == (question.order == "rest-first")
    found: dict[str, None] = {}
    for index in np.flatnonzero(wanted & ~routes.flyable).tolist():
        found.update(dict.fromkeys(blocked_legs(network, index)))
        if len(found) > MOST_REASONS:
            return (*tuple(found)[:MOST_REASONS], "and other legs are blocked as well")
    unused = f"{question.problem.name} declares no rest_time_s by way of a building"
    return tuple(found) or (unused,)
