"""What the longest hover, which (P1) asks for, tells of an answer to (P2)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from formulations.p1 import P1
from optuav.engines.solution import Solution
from optuav.network.network import Network
from optuav.plan import Plan
from optuav.solving.dispatch import answer
from optuav.solving.given import quantities
from optuav.solving.planning import Part
from optuav.solving.question import Question
from optuav.solving.ties import SAME_S
from optuav.status import Status

PROVED = {
    "P2": "bounded: no flight and rest is shorter than the shortest flight",
    "P2-tight": "bounded: no flight and rest is shorter, as the engine {} proves that no hover is "
    "longer",
}
"""How it is known that an answer that was found locally is the best, by problem."""


def against_p1(asked: Question, worked_out: Network, parts: Sequence[Part], plan: Plan) -> Plan:
    """The plan with what (P1) tells of it, and proved where that is a proof; P2 and P2-tight only.

    (P2) minimises T_fl + T'. As printed it cannot be less than the shortest T_fl. With the deadline
    tight it is T_max − Δ, and Δ cannot be more than in (P1).

    Parameters
    ----------
    asked, worked_out, parts
        The question, and the models that answered it.
    plan
        The answer.
    """
    if asked.problem.name not in PROVED:
        return plan
    solutions = [_longest_hovers(asked, worked_out, part) for part in parts]
    notes = list(_notes(asked, solutions, plan.hover_time_s))
    changes: dict[str, object] = {}
    if plan.status is Status.LOCALLY_OPTIMAL:
        over_s = (
            plan.flight_time_s + plan.rest_time_s - _least_s(asked, worked_out, parts, solutions)
        )
        if over_s <= SAME_S:
            proof = PROVED[asked.problem.name].format(solutions[0].engine)
            changes = {"status": Status.OPTIMAL, "proof": proof}
        elif math.isfinite(over_s):
            notes.append(f"not proved: up to {over_s:.6g} s less has not been ruled out")
    return plan.model_copy(update={"notes": (*plan.notes, *notes), **changes})


def _least_s(
    asked: Question, worked_out: Network, parts: Sequence[Part], solutions: Sequence[Solution]
) -> float:
    """What T_fl + T' is known not to go below [s]; −∞ where nothing is known."""
    flight_s = [worked_out.routes.flight_time_s[part.routes] for part in parts]
    if asked.problem.name == "P2":
        return min(float(each.min()) for each in flight_s)
    deadline_s, longest_s = worked_out.mission.limits.deadline_s, -math.inf
    for flown_s, solution in zip(flight_s, solutions, strict=True):
        if solution.beyond is None:
            return -math.inf
        beyond_s = solution.beyond
        if "rest_time_s" not in solution.values:
            # Without a rest all of the time left is hovered, or the deadline is not tight.
            beyond_s = beyond_s[beyond_s >= deadline_s - flown_s - SAME_S]
        longest_s = max(longest_s, float(beyond_s.max(initial=-math.inf)))
    return deadline_s - longest_s


def _notes(asked: Question, solutions: Sequence[Solution], hover_time_s: float) -> Iterator[str]:
    if asked.problem.name == "P2":
        yield "(P2) as printed holds no Δ in its objective: any feasible hover time is as good"
    longest_s = max(float(np.nanmax(each.objective, initial=-np.inf)) for each in solutions)
    if longest_s > hover_time_s + SAME_S:
        yield (
            f"(P1) hovers {longest_s:.2f} s on the same mission, "
            f"{longest_s - hover_time_s:.2f} s longer"
        )


def _longest_hovers(asked: Question, worked_out: Network, part: Part) -> Solution:
    rests = any(each.name == "rest_time_s" for each in part.model.variables)
    given = quantities(worked_out, part.routes, rests=rests)
    p1 = P1().model(given, asked.perspective)
    return answer(p1, len(part.routes), replace(asked, problem=P1()))
