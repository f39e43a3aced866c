"""A program handed to an engine once, to be solved often with changed parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.modelling import Parameter
from optuav.solving.changes import refuse
from optuav.solving.dispatch import chosen_engine
from optuav.solving.question import Question
from optuav.status import Status

if TYPE_CHECKING:
    from optuav.solving.program import Program


class CompiledProgram:
    """What `Program.compile` returns.

    Parameters
    ----------
    program
        The declared models.
    question
        What was asked, with the engine to use.

    Raises
    ------
    InputError
        If nothing can be flown, or the engine does not take the models.
    """

    def __init__(self, program: Program, question: Question) -> None:
        if not program.parts:
            raise InputError(f"nothing to compile: {'; '.join(program.reasons)}")
        if question.engine_name == "grid" and question.slot_s is None:
            question = replace(question, slot_s=program.worked_out.mission.limits.slot_s)
        self.program = program
        self.question = question
        self._models = [
            chosen_engine(part.model, question).compile(
                part.model,
                len(part.routes),
                slot_s=question.slot_s,
                time_limit_s=question.time_limit_s,
            )
            for part in program.parts
        ]
        self._parameters: dict[str, Parameter] = {}
        for part in program.parts:
            self._parameters |= part.model.parameters
        # Where the itineraries have several declarations, an array is of none of them.
        self._most = len(program.parts[0].routes) if len(program.parts) == 1 else 1

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that `solve` may change."""
        return tuple(self._parameters)

    def solve(self, **values: Any) -> Solution:
        """Solve again with other values of named parameters, the rest as in the mission.

        Parameters
        ----------
        values
            For example ``deadline_s=900, min_soc=0.1``: numbers, or arrays with one entry an
            itinerary where all of them belong to one declaration.

        Returns
        -------
        The solution of the best itinerary alone; its fields have one entry.

        Raises
        ------
        InputError
            Listing every name that is no parameter of the program, and every value that is no
            finite number, or none that the key of the mission may have from which it comes.
        SolverError
            If the engine fails, or meets numbers that it cannot use.
        """
        refuse(values, self._parameters, self._most)
        numbers = {n: np.array(v, float) if np.ndim(v) else float(v) for n, v in values.items()}
        solutions = [model.solve(numbers) for model in self._models]
        for solution in solutions:
            if Status.ERROR in solution.statuses:
                raise SolverError(solution.refusal(solution.statuses.index(Status.ERROR)))
            if Status.UNBOUNDED in solution.statuses:
                return solution.only(solution.statuses.index(Status.UNBOUNDED))
        chosen = self._best(solutions)
        if chosen is None:
            return solutions[0].only(0)
        number, entry = chosen
        solution = solutions[number]
        solution.verify(entry)
        return solution if len(solution.statuses) == 1 else solution.only(entry)

    def _best(self, solutions: Sequence[Solution]) -> tuple[int, int] | None:
        if len(solutions) == 1 and len(solutions[0].statuses) == 1:
            return (0, 0) if solutions[0].status.has_answer else None
        return self.program.best(solutions)
