"""The longest hover of a mission: `best_plans` of one variant, as the solution of its model."""

from __future__ import annotations

import numpy as np

from formulations.soc import AVAILABLE, PAPER
from optuav.engines import bracket
from optuav.engines.registry import AUTO
from optuav.engines.solution import Solution
from optuav.mission import Mission
from optuav.network.network import Network
from optuav.network.variants import as_variants
from optuav.solving.balance import TIMES
from optuav.solving.best_plans import (
    LONGEST_HOVER_PROBLEMS,
    STATUSES,
    BestPlans,
    best_plans,
    rests_for_hover,
    wants_hover,
)
from optuav.solving.question import Question, solve_model
from optuav.solving.route_models import RouteModel, declarations, permitted_routes

PROOF_OF_REST = "bracketed: the shortest rest that all limits allow for this hover"


def longest_hover(question: Question, network: Network) -> tuple[RouteModel, Solution] | None:
    """The best route of a question of the longest hover, declared, with its best times.

    So too of the shortest flight and rest for a hover through the wells. None of other questions,
    and where no route has times: why, an engine finds out.
    """
    if not (is_known(question, network.mission) and network.routes.flyable.any()):
        return None
    variants = as_variants(network)
    if wants_hover(question):
        able = permitted_routes(variants, question.problem)
        if rests_for_hover(variants, question, able) is None:
            return None
    best = best_plans(variants, question)
    if (route := best.route[0]) < 0:
        return None
    chosen = np.arange(len(network.routes))[None] == route
    ((part, _),) = declarations(question, variants, chosen)
    if question.perspective == AVAILABLE:
        return part, _bracketed(part, best)
    solution = solve_model(
        part.declared, 1, question, part.given
    )  # The exact vertex, and its proof
    return (part, solution) if solution.status.has_answer else None


def _bracketed(part: RouteModel, best: BestPlans) -> Solution:
    """Times through the wells as the solution of their model, as its engine brackets them."""
    times = zip(TIMES, (best.hover_time_s, best.rest_time_s), strict=True)
    return Solution(
        engine=bracket.NAME,
        proof=bracket.PROOF if part.declared.sign > 0 else PROOF_OF_REST,
        declared=part.declared,
        statuses=[STATUSES[best.status[0]]],
        objective=best.objective,
        values={name: time_s for name, time_s in times if name in part.unknowns},
        duals=None,
        beyond=best.bound,
        given=part.given,
    )


def is_known(question: Question, mission: Mission) -> bool:
    """Whether a question is for the longest hover in continuous times, by any engine."""
    return (
        (type(question.problem) in LONGEST_HOVER_PROBLEMS or wants_hover(question))
        and question.perspective in (*PAPER, AVAILABLE)
        and question.engine == AUTO
        and question.slot_s is None
        and not (question.searched or mission.battery.takes_turns)
    )
