"""The routes of a mission with many buildings that may be the best, by bounds on all of them."""

from __future__ import annotations

import numpy as np

from formulations.p1 import P1
from formulations.p3 import P3
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats, Integers
from optuav.engines.registry import AUTO
from optuav.mission import Mission
from optuav.network.network import Network, network_by
from optuav.network.places import Places, build_places
from optuav.network.prisms import prisms
from optuav.solving.best_plans import hover_bounds_s
from optuav.solving.outcome import by_balance
from optuav.solving.program import Program, declared_program
from optuav.solving.question import Question
from optuav.status import SAME_S

AT_ONCE = 1 << 12
"""Buildings that are bounded together: their legs stay in the cache."""
FIRST, MOST = 50, 20_000  # Routes that are solved first, and most of them
SLACK_S = 2.0 * SAME_S  # By which a bound may fall short for rounding and ties [s]


def narrowed(mission: Mission, question: Question) -> Program | None:
    """The program over all routes that may be the best, or that its words speak of.

    It has the plan, or the reasons for none, of the program over all routes; None where any may.
    """
    problem, every = question.problem, mission.buildings.names
    if question.several or question.p1.hover_point != "w_U":
        return None
    places = build_places(mission, prisms(mission.buildings))
    if isinstance(problem, P3) or problem.trajectory == "direct":
        return _over(mission, question, places, np.zeros(0, dtype=np.intp))
    if problem.building is not None:
        return _over(mission, question, places, np.array([every.index(problem.building)]))
    turns = mission.battery.takes_turns and question.perspective == AVAILABLE
    alike = question.engine == AUTO and question.slot_s is None
    if problem != P1() or question.perspective not in (*PAPER, AVAILABLE) or turns or not alike:
        return None
    # Walls forbid routes and make none better: of legs to roofs, those to the best alone are tried.
    clear = mission.replace({"flight.through_buildings": True})
    bounds_s, size = _bounds_s(clear, question, places), FIRST
    to_hover, from_hover = network_by(mission, places, np.arange(0)).legs.flyable
    if not from_hover:
        bounds_s[:, 0::2] = -np.inf  # Rest first
    if not to_hover:
        bounds_s[:, 1::2] = -np.inf
    while size <= MOST:
        best = [np.argpartition(-each, min(size, len(each) - 1))[:size] for each in bounds_s]
        chosen = np.unique(np.concatenate(best) // 2)
        program = _over(mission, question, places, chosen)
        scores = [
            (solution.objective * part.declared.towards).max(initial=-np.inf)
            for part, solution in zip(program.parts, program.answers(), strict=True)
        ]
        promised_s, *flights_s = _figures_s(program.network).max(axis=1)
        found_s = np.fmax.reduce(scores, initial=0.0), max(promised_s, 0.0), *flights_s
        open_ = (bounds_s >= np.array(found_s)[:, None] - SLACK_S) & (bounds_s > -np.inf)
        if np.isin(np.flatnonzero(open_.any(axis=0)) // 2, chosen).all():
            return program
        size *= 4
    return None


def _over(mission: Mission, question: Question, places: Places, buildings: Integers) -> Program:
    """The program over the routes by way of some buildings alone."""
    return declared_program(question, network_by(mission, places, buildings))


def _bounds_s(mission: Mission, question: Question, places: Places) -> Floats:
    """By route with a rest: what no Δ exceeds [s], and the figures of `_figures_s`."""
    count, found = len(mission.buildings), list[Floats]()
    for begin in range(0, count, AT_ONCE):
        network = network_by(mission, places, np.arange(begin, min(begin + AT_ONCE, count)))
        bound_s = hover_bounds_s(network, question.perspective)[1:]
        found.append(np.concatenate([bound_s[None], _figures_s(network)]))
    return np.concatenate(found, axis=1)


def _figures_s(network: Network) -> Floats:
    """By route with a rest: what charge promises, and how short the flight is, by order [s].

    That is minus the flight time of rest first and of hover first; −∞ of the other order, and of
    routes that cannot be flown.
    """
    routes = network.routes
    promised_s, short_s = by_balance(network, rests=True)[0], -routes.flight_time_s
    by_order = [np.where(routes.rest_first == first, short_s, -np.inf) for first in (True, False)]
    return np.where(routes.flyable, [promised_s, *by_order], -np.inf)[:, 1:]
