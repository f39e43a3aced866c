"""A program handed to an engine once, to be solved often with changed parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.engines.solution import Solution
from optuav.errors import InputError, SolverError
from optuav.modelling import Parameter
from optuav.solving.dispatch import chosen_engine
from optuav.solving.question import Question
from optuav.status import Status

if TYPE_CHECKING:
    from optuav.solving.program import Program
import reprlib
from collections.abc import Iterator, Mapping

from optuav.errors import Fault
from optuav.mission.messages import nearest, number


class CompiledProgram:
    """What `Program.compile` returns.

    Parameters
    ----------
    program
        The declared models.
    question
        What was question, with the engine to use.

    Raises
    ------
    InputError
        If nothing can be flown, or the engine does not take the models.
    """

    def __init__(self, program: Program, question: Question) -> None:
        if not program.parts:
            raise InputError(f"nothing to compile: {'; '.join(program.reasons)}")
        if question.engine_name == "grid" and question.slot_s is None:
            question = replace(question, slot_s=program.network.mission.limits.slot_s)
        self.program = program
        self.question = question
        self._solves = [
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
        solutions = [solve(numbers) for solve in self._solves]
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


def refuse(values: Mapping[str, Any], parameters: Mapping[str, Parameter], most: int) -> None:
    """Refuse values that the parameters of a program may not have.

    Those that come from a key of the mission may have what the key may have, the others any finite
    number.

    Parameters
    ----------
    values
        By name.
    parameters
        Of the program, by name.
    most
        How many entries an array has.

    Raises
    ------
    InputError
        With all of them.
    """
    faults = list(_faults(values, parameters, most))
    if faults:
        raise InputError(faults)


def _faults(
    values: Mapping[str, Any], parameters: Mapping[str, Parameter], most: int
) -> Iterator[Fault]:
    for name, value in values.items():
        words = _objection(name, value, parameters, most)
        if words:
            yield Fault(name, reprlib.repr(value), words)


def _objection(name: str, value: Any, parameters: Mapping[str, Parameter], most: int) -> str:
    """What is wrong with a value; empty if nothing is."""
    if name not in parameters:
        known = ", ".join(parameters)
        return f"is no parameter of the program{nearest(name, parameters)}; there are {known}"
    if not _numbers(value, most):
        return "a finite number" + (f", or {most} of them" if most > 1 else "")
    key = parameters[name].key
    allowed = number(key)
    if allowed is None or all(map(allowed.accepts, np.ravel(value).tolist())):
        return ""
    return f"{allowed.words}, as {key}"


def _numbers(value: Any, most: int) -> bool:
    """Whether it is a finite number or as many of them as there are."""
    if isinstance(value, bool):
        return False
    try:
        numbers = np.asarray(value)
    except ValueError:
        return False
    fits = numbers.dtype.kind in "iuf" and numbers.shape in ((), (most,))
    return fits and bool(np.isfinite(numbers).all())
