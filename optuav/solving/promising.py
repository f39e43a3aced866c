"""The routes of a mission with many buildings that may be the best, by bounds on all of them."""

from __future__ import annotations

import numpy as np

from formulations.p1 import P1
from formulations.p3 import P3
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats, Integers
from optuav.mission import Mission
from optuav.network.network import network_by
from optuav.network.places import Places, build_places
from optuav.network.prisms import prisms
from optuav.network.routes import SAME_S
from optuav.solving.best_plans import hover_bounds_s
from optuav.solving.outcome import by_balance
from optuav.solving.program import Program, declared_program
from optuav.solving.question import AUTO, Question

AT_ONCE = 1 << 12
"""Buildings without walls that are bounded together: their legs stay in the cache."""
FIRST, MOST = 50, 20_000  # Routes that are solved first, and buildings that are solved at all
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
    bound_s, noted_s, flight_s = _bounds_s(mission, question, places)
    first = np.argpartition(-bound_s, min(FIRST, len(bound_s) - 1))[:FIRST]
    noted = np.flatnonzero(noted_s >= max(noted_s.max(), 0.0) - SLACK_S)
    shortest = 2 * flight_s[0::2].argmin(), 2 * flight_s[1::2].argmin()
    chosen = np.unique(np.concatenate([first, noted, shortest]) // 2)
    while len(chosen) <= MOST:
        program = _over(mission, question, places, chosen)
        scores = [
            (solution.objective * part.declared.towards).max(initial=-np.inf)
            for part, solution in zip(program.parts, program.answers(), strict=True)
        ]
        open_ = np.flatnonzero(bound_s >= np.fmax.reduce(scores, initial=0.0) - SLACK_S) // 2
        if not len(more := np.setdiff1d(open_, chosen)):
            return program
        chosen = np.union1d(chosen, more)
    return None


def _over(mission: Mission, question: Question, places: Places, buildings: Integers) -> Program:
    """The program over the routes by way of some buildings alone."""
    return declared_program(question, network_by(mission, places, buildings))


def _bounds_s(mission: Mission, question: Question, places: Places) -> Floats:
    """By route with a rest: what no Δ exceeds, what charge promises, and the flight time [s]."""
    count, found = len(mission.buildings), list[Floats]()
    at_once = count if len(prisms(mission.buildings).building) else AT_ONCE
    for begin in range(0, count, at_once):
        some = np.arange(begin, min(begin + at_once, count))
        network = network_by(mission, places, some)
        routes = network.routes
        promised_s = np.where(routes.flyable, by_balance(network, rests=True)[0], -np.inf)
        flight_s = np.where(routes.flyable, routes.flight_time_s, np.inf)
        bound_s = hover_bounds_s(network, question.perspective)
        found.append(np.stack([bound_s, promised_s, flight_s])[:, 1:])
    return np.concatenate(found, axis=1)
