"""What a step of a parameter changes at the optimum, by solving again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.engines import bracket, closed_form
from optuav.engines.solution import Solution
from optuav.modelling import Parameter
from optuav.solving import Program
from optuav.status import Status

AGAIN = {closed_form.NAME: closed_form.solve, bracket.NAME: bracket.solve}
"""The engines that prove every answer, and quickly enough to be asked twice for every price."""
ROUNDING = 1e-12
"""Share of the objective that is rounding where all of it is solved in closed form."""
BRACKETED = 1e-7
"""Change of the objective within which two bracketed answers are the same."""


@dataclass(frozen=True)
class Effect:
    """Change of the best objective by a step of one parameter, the others held.

    Parameters
    ----------
    program
        What was declared.
    solutions
        Answers with continuous times, one for every part.
    chosen
        Part and entry of the best one.
    """

    program: Program
    solutions: Sequence[Solution]
    chosen: tuple[int, int]

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def __call__(self, parameter: Parameter, step: float) -> float:
        """Solved again by the same engines, so that kinks on the way count.

        Infinite where the step leaves no plan; NaN where an engine is not among those, or leaves
        an answer open and says so.
        """
        number, entry = self.chosen
        towards = self.program.parts[number].model.towards
        own = np.ndim(parameter.value) > 0
        value: Any = parameter.value + step
        if own:
            value = np.where(np.arange(len(value)) == entry, value, parameter.value)
        answers = [*self.solutions]
        for k, part in enumerate(self.program.parts):
            if self.solutions[k].engine not in AGAIN:
                return math.nan
            if k == number or not own:
                solve = AGAIN[self.solutions[k].engine]
                answers[k] = solve(part.model, len(part.routes), {parameter.name: value})
        if any(any(each.words) or Status.FEASIBLE in each.statuses for each in answers):
            return math.nan
        best = max(np.fmax.reduce(towards * each.objective, initial=-math.inf) for each in answers)
        before = float(self.solutions[number].objective[entry])
        change = float(towards * best - before)
        return 0.0 if abs(change) <= self._same(before) else change

    def _same(self, objective: float) -> float:
        """How far apart two answers can be that are the same."""
        exact = all(solution.engine == closed_form.NAME for solution in self.solutions)
        return ROUNDING * abs(objective) if exact else BRACKETED
