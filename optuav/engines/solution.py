"""What every engine returns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from optuav.errors import SolverError
from optuav.modelling.check import check
from optuav.modelling.model import Model

Floats = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]


class Status(StrEnum):
    """What is known of a programme as it was stated; one list for all engines."""

    OPTIMAL = "optimal"
    LOCALLY_OPTIMAL = "locally_optimal"
    FEASIBLE = "feasible"
    INFEASIBLE = "infeasible"
    UNBOUNDED = "unbounded"
    ERROR = "error"

    @property
    def has_answer(self) -> bool:
        """Whether values belong to it."""
        return self in (Status.OPTIMAL, Status.LOCALLY_OPTIMAL, Status.FEASIBLE)


@dataclass(frozen=True)
class Solution:
    """Answers to one or several programmes that were declared as one.

    Parameters
    ----------
    engine
        Name of the engine.
    proof
        How it knows, in a word or two.
    statuses
        One `Status` a programme.
    objective
        Objective values, one a programme; NaN without an answer.
    values
        Values of the variables by name, one a programme; NaN without an answer.
    binding
        By label of a constraint, whether it holds with equality at the answer, one a programme.
    """

    engine: str
    proof: str
    statuses: Sequence[Status]
    objective: Floats
    values: Mapping[str, Floats]
    binding: Mapping[str, Booleans]

    def point(self, index: int) -> dict[str, float]:
        """Values of the variables in the answer to a programme.

        Raises
        ------
        SolverError
            If that programme has no answer.
        """
        status = self.statuses[index]
        if not status.has_answer:
            raise SolverError(f"{self.engine} has no values: the programme is {status.value}")
        return {name: float(values[index]) for name, values in self.values.items()}

    def binding_labels(self, index: int) -> tuple[str, ...]:
        """Labels of the constraints that hold with equality in the answer to a programme."""
        return tuple(label for label, binds in self.binding.items() if binds[index])


def verify(model: Model, solution: Solution, index: int) -> None:
    """Evaluate an answer again, outside the engine that gave it.

    Raises
    ------
    SolverError
        If the answer violates a constraint.
    """
    rows = check(model, {**model.row(index), **solution.point(index)})
    broken = [f"{row.label} by {-row.slack:.3g}" for row in rows if not row.satisfied]
    if broken:
        raise SolverError(f"{solution.engine} returned a point that violates {', '.join(broken)}")
