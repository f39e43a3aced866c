"""Plans that several studies show, each found once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

from optuav import solving
from optuav.mission import Mission
from optuav.paper.reproduce.exhibit import OURS, LeftOut
from optuav.plan import Plan
from optuav.solving.question import problem_of

REMEMBERED = 256
PROBLEM_FIELDS = ("trajectory", "building", "order", "hover_point", "stops", "hovers")
SEARCHED = (
    "the study takes many plans, and where the packs take turns each is a search by simulation"
)


def solve(mission: Mission, problem: str = "P1", **options: Any) -> Plan:
    """As `optuav.solve`, and remembered, with its defaults stated or not."""
    defaults = {"perspective": OURS} | ({"trajectory": "optimal"} if problem == "P1" else {})
    return _found(mission, problem, *sorted((defaults | options).items()))


@lru_cache(maxsize=REMEMBERED)
def _found(mission: Mission, problem: str, *options: tuple[str, Any]) -> Plan:
    stated = dict(options)
    fields = {each: stated.pop(each) for each in PROBLEM_FIELDS if each in stated}
    return solving.solve(mission, problem_of(problem, **fields), **stated)


def why(plan: Plan) -> str:
    """Why there is no plan."""
    return "; ".join(plan.reasons) or plan.proof


def no_plan(plan: Plan, what: str = "") -> LeftOut:
    """A study, or a part of it, that a missing plan leaves out."""
    return LeftOut(what, why(plan))


def without(plans: Mapping[str, Plan]) -> Iterator[str]:
    """Which of several plans there are not, and why; nothing where all are there."""
    lost = [f"{name} ({why(plan)})" for name, plan in plans.items() if not plan]
    if lost:
        yield f"No plan: {'; '.join(lost)}."


def grounded(plans: Sequence[Plan], what: str) -> Iterator[str]:
    """How many of the plans that are shown as rows or bars cannot be flown; nothing if all can."""
    dry = [plan for plan in plans if plan.runs_dry_s is not None]
    full = [plan for plan in plans if plan.runs_dry_s is None and plan.overfull_s is not None]
    if dry:
        yield (
            f"In {len(dry)} of {len(plans)} {what} the available well runs dry before the end: "
            f"such a plan cannot be flown."
        )
    if full:
        yield (
            f"In {len(full)} of {len(plans)} {what} the well lasts, but is charged beyond full: "
            f"such a plan cannot be flown as it stands."
        )


def is_searched(mission: Mission, perspective: str) -> bool:
    """Whether a plan takes seconds: the wells of packs that take turns are simulated."""
    return perspective == OURS and mission.battery.schedule != "pooled"
