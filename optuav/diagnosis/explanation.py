"""An explanation: why this is the optimum, or why there is none and what would repair that."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from optuav.diagnosis.certificate import Bound
from optuav.diagnosis.conflict import Conflict
from optuav.diagnosis.prices import Price
from optuav.diagnosis.repair import Repair
from optuav.plan import Plan


@dataclass(frozen=True)
class Side:
    """A constraint at the optimum.

    Parameters
    ----------
    label, unit
        As declared.
    statement
        The constraint as mathematics; empty for one too long to read.
    left, sense, right
        Values of its sides and how they compare.
    slack
        What is to spare.
    binds
        Whether it holds with equality.
    kind, step
        What it limits, and the step of the itinerary at whose end, as of a `Constraint`.
    in_flight
        Whether that step is a stage of flight.
    """

    label: str
    unit: str
    statement: str
    left: float
    sense: str
    right: float
    slack: float
    binds: bool
    kind: str = ""
    step: int | None = None
    in_flight: bool = False

    def to_dict(self) -> dict[str, Any]:
        """As plain data; null for an infinite number."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in vars(self).items()
        }


@dataclass(frozen=True)
class Explanation:
    """What `optuav.explain` returns; print it. True where there is a plan.

    Parameters
    ----------
    plan
        What is explained.
    objective
        What was sought, as ``"s of hover"``; empty if there is no plan.
    sense
        ``"maximise"`` or ``"minimise"``.
    conflicts
        Without a plan: which constraints conflict, with proofs; empty where the reasons of the
        plan are physical.
    repairs
        Without a plan: single changes that make it feasible, the smallest first.
    constraints
        With a plan: the constraints of its programme.
    bound
        With a plan: why nothing is better; None where the programme is not linear.
    prices
        With a plan: what the parameters of its programme are worth.
    notes
        What a reader should know.
    """

    plan: Plan
    objective: str = ""
    sense: str = "maximise"
    conflicts: tuple[Conflict, ...] = ()
    repairs: tuple[Repair, ...] = ()
    constraints: tuple[Side, ...] = ()
    bound: Bound | None = None
    prices: tuple[Price, ...] = ()
    notes: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.plan)

    def __str__(self) -> str:
        from optuav.diagnosis.writing import text

        return text(self)

    def to_dict(self) -> Mapping[str, Any]:
        """As plain data: strings, numbers, lists, dicts and None."""
        plan = self.plan
        asked = ("problem", "trajectory", "building", "order", "perspective", "slot_s")
        answer: dict[str, Any] = {
            "mission": plan.mission.name,
            **{name: getattr(plan, name) for name in asked},
            "status": plan.status.value,
            "proof": plan.proof,
        }
        if plan:
            answer |= {
                "hover_time_s": plan.hover_time_s,
                "rest_time_s": plan.rest_time_s,
                "route": list(plan.route),
                "objective": self.objective,
                "constraints": [each.to_dict() for each in self.constraints],
                "bound": self.bound.to_dict() if self.bound else None,
                "prices": [each.to_dict() for each in self.prices],
            }
        else:
            answer |= {
                "reasons": list(plan.reasons),
                "conflicts": [each.to_dict() for each in self.conflicts],
                "repairs": [each.to_dict() for each in self.repairs],
            }
        return {**answer, "notes": list(self.notes)}
