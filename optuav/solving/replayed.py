"""Every plan is simulated again, by code that knows nothing of how it was found."""

from __future__ import annotations

from formulations.soc import AVAILABLE
from optuav.errors import SolverError
from optuav.judge.replay import replay
from optuav.plan import Plan
from optuav.solving.question import PROBLEMS

TOLD_BY_THE_PLAN = ("empty", "full")
"""Events of which the plan warns on its own."""


def replayed(plan: Plan) -> Plan:
    """The plan with the verdict of its simulation; as it is where there is none.

    Raises
    ------
    SolverError
        If a plan of the perspective `available` cannot be flown, which would be an error of ours.
    """
    if not plan:
        return plan
    found = replay(plan)
    if plan.perspective == AVAILABLE and plan.problem in PROBLEMS and not found.flyable:
        words = "; ".join(event.words + event.figures for event in found.violations)
        raise SolverError(f"{plan.engine} returned a plan that fails its simulation: {words}")
    more = tuple(
        f"this plan cannot be flown: {event.words}{event.figures}"
        for event in found.violations
        if event.kind not in TOLD_BY_THE_PLAN
    )
    return plan.model_copy(update={"flyable": found.flyable, "notes": (*plan.notes, *more)})
