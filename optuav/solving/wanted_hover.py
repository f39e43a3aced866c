"""The shortest flight and rest for a wanted hover, on the routes that may have it.

Routes on which the hover does not fit are left out by the bracket of (P1), which is a proof. On the
others charge at the end bounds the rest from below. An engine answers them in the order of that
bound, until the bound of the next one exceeds the best.
"""

from __future__ import annotations

import math

import numpy as np

from formulations.p2 import P2
from optuav.arrays import Booleans
from optuav.engines.solution import Solution
from optuav.network.network import Network
from optuav.network.variants import Variants, as_variants
from optuav.solving.balance import flight_and_rest_bounds_s
from optuav.solving.best_plans import SLACK_S, bracketed, hover_bounds_s, in_steps, wants_hover
from optuav.solving.longest_hover import is_known
from optuav.solving.question import Question, solve_model
from optuav.solving.route_models import RouteModel, declarations, permitted_routes


def shortest_for_hover(
    question: Question, network: Network
) -> list[tuple[RouteModel, Solution]] | None:
    """An engine's answers on the routes that may be the best, each with its declaration.

    None of other questions; empty if it is proved that the hover fits on no route.
    """
    problem = question.problem
    if not (wants_hover(question) and is_known(question, network.mission)):
        return None
    assert isinstance(problem, P2)
    assert problem.hover_time_s is not None
    variants = as_variants(network)
    able = permitted_routes(variants, problem)
    able = able & _fits(variants, problem.hover_time_s)
    bounds_s = flight_and_rest_bounds_s(variants, problem.hover_time_s)
    least_s = np.where(able[0], bounds_s[:, 0], math.inf)
    rising = np.argsort(least_s, kind="stable")[: np.count_nonzero(least_s < math.inf)]
    answers, best_s, first, size = list[tuple[RouteModel, Solution]](), math.inf, 0, 1
    while first < len(rising) and least_s[rising[first]] <= best_s + SLACK_S:
        some = rising[first : first + size]
        some = some[least_s[some] <= best_s + SLACK_S]
        chosen = np.isin(np.arange(len(least_s)), some)[None]
        for part, _ in declarations(question, variants, chosen):
            solution = solve_model(part.declared, len(part.routes), question, part.given)
            best_s = min(best_s, float(np.nanmin(solution.objective, initial=math.inf)))
            answers.append((part, solution))
        first, size = first + size, 2 * size
    return answers


def _fits(variants: Variants, hover_s: float) -> Booleans:
    """Return on which routes (1, route) no proof excludes so long a hover."""
    least_s = max(hover_s - SLACK_S, 0.0)
    route, variant = np.nonzero(hover_bounds_s(variants, "available") >= least_s)
    fits = np.zeros((1, len(variants.network.routes)), bool)
    for some, steps in in_steps(variants, variant, route):
        *_, beyond_s = bracketed(steps, len(some), shortest_rest=False, least_s=least_s)
        fits[0, route[some]] = beyond_s > hover_s - SLACK_S
    return fits
