"""Smooth programmes by CasADi and IPOPT: a local optimum from several starts, and said to be one.

References
----------
.. [1] J. Andersson et al., "CasADi: a software framework for nonlinear optimization and optimal
   control", Mathematical Programming Computation, 2019.
.. [2] A. Wächter, L. Biegler, "On the implementation of an interior-point filter line-search
   algorithm for large-scale nonlinear programming", Mathematical Programming, 2006.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.engines.casadi_form import NAME, CasadiForm
from optuav.engines.ipopt import NO_WAY_IN, SOLVED, TOO_SLOW, UNBOUNDED, UNUSABLE, prepared, run
from optuav.engines.ranges import lower_bounds, own_upper_bounds
from optuav.engines.scaling import ScaledProgramme, scaled_programme
from optuav.engines.solution import Solution, stacked, unanswered
from optuav.errors import SolverError
from optuav.modelling.check import evaluated, holding
from optuav.modelling.expression import Relation
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate
from optuav.status import Status

PROOF = "local: the best of several starts"
EQUAL = 1e-10
"""Relative loss of the objective that the preferences may use up."""
ACCURACY = 1e-10
"""What IPOPT asks of optimality, scaled, unless a caller is content with less."""
ITERATIONS = 3000


class Compiled:
    """A model handed to CasADi once, to be solved with changing parameters.

    Parameters
    ----------
    model
        Any smooth model with continuous unknowns.
    time_limit_s
        Longest that one solve may take [s]; no limit by default.
    accuracy
        What IPOPT asks of optimality, scaled.
    iterations
        Most that IPOPT may take from a start.

    Raises
    ------
    InputError
        If a function in the model is unknown to the engine.
    SolverError
        If CasADi or IPOPT cannot be loaded.
    """

    def __init__(
        self,
        model: Model,
        time_limit_s: float | None = None,
        accuracy: float = ACCURACY,
        iterations: int = ITERATIONS,
    ) -> None:
        self.model = model
        self.time_limit_s = time_limit_s
        self.base = self.model.row(0)
        self.form = CasadiForm(self.model)
        self.senses = [each.relation.sense for each in self.form.constraints]
        self._programmes = [
            prepared(each, time_limit_s, accuracy, iterations) for each in self.form.programmes
        ]

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def solve(
        self, values: Mapping[str, float], starts: Sequence[Mapping[str, float]] = ()
    ) -> Solution:
        """Solve with values of parameters that differ from the model's, by name.

        Parameters
        ----------
        values
            Of parameters, by name.
        starts
            Points to start from instead of those that the bounds suggest, by name.

        Raises
        ------
        SolverError
            If IPOPT fails or the time limit passes.
        """
        parameters = {**self.base, **values}
        numbers = np.array([float(parameters[name]) for name in self.form.given])
        if not np.isfinite(numbers).all():
            return unanswered(self.model, NAME, PROOF, Status.ERROR, "a parameter is no number")
        lower = lower_bounds(self.model, parameters)
        upper = own_upper_bounds(self.model, parameters)
        if any(lower[name] > upper[name] for name in self.form.names):
            return unanswered(
                self.model, NAME, "bounds contradict", Status.INFEASIBLE, "not handed to IPOPT"
            )
        broken = [each.label for each in self.form.settled if not _holds(each.relation, parameters)]
        if broken:
            words = f"does not hold whatever the unknowns: {', '.join(broken)}"
            return unanswered(self.model, NAME, "evaluated", Status.INFEASIBLE, words)
        scaled = scaled_programme(self.model, parameters, numbers, lower, upper)
        if starts:
            scaled = replace(scaled, starts=scaled.scaled(starts))
        steepness = scaled.steepness(self.form.slope)
        best, said = self._best(scaled, steepness)
        if best is None and UNBOUNDED in said:
            somewhere, said_of_it = self._best(scaled, math.inf)  # the objective made level
            if somewhere is not None:
                proof, words = "local: the iterates diverge", ", ".join(dict.fromkeys(said))
                return unanswered(self.model, NAME, proof, Status.UNBOUNDED, words)
            said = said_of_it
        if best is None:
            return self._nothing(said)
        point, answer = best
        point = self._preferred(point, scaled, steepness)
        weights = np.asarray(answer["lam_g"]).ravel() * steepness
        at_bounds = np.asarray(answer["lam_x"]).ravel() * steepness / scaled.scale
        return self._solution(parameters, point, weights, at_bounds, said)

    def _best(
        self, scaled: ScaledProgramme, steepness: float
    ) -> tuple[tuple[dict[str, float], Any] | None, list[str]]:
        """The best point that IPOPT reaches from any start, its answer, and all its words."""
        begin, most = time.monotonic(), -math.inf
        best: tuple[dict[str, float], Any] | None = None
        said: list[str] = []
        for start in scaled.starts:
            if self.time_limit_s is not None and time.monotonic() - begin > self.time_limit_s:
                raise SolverError(f"{NAME} did not finish within the time limit")
            arguments = scaled.arguments(self.senses, start, [steepness])
            answer, word = run(self._programmes[0], arguments)
            said.append(word)
            if word in TOO_SLOW:
                raise SolverError(f"{NAME} did not finish within the time limit")
            point = scaled.point(answer)
            if word not in SOLVED or not self._feasible(scaled.parameters, point):
                continue
            reached = float(evaluate(self.model.objective, {**scaled.parameters, **point}))
            if best is None or self.model.towards * reached > most + EQUAL * max(1.0, abs(most)):
                best, most = (point, answer), self.model.towards * reached
        return best, said

    def _feasible(self, parameters: Mapping[str, Any], point: Mapping[str, float]) -> bool:
        return all(bool(row.satisfied) for row in evaluated(self.model, {**parameters, **point}))

    def _preferred(
        self, point: dict[str, float], scaled: ScaledProgramme, steepness: float
    ) -> dict[str, float]:
        """Among points as good as the best, the one that the preferences take, one by one."""
        floors: list[float] = []
        goals = [self.model.objective, *self.model.preferences]
        for number, programme in enumerate(self._programmes[1:]):
            kept = float(evaluate(goals[number], {**scaled.parameters, **point}))
            kept = kept if number else -self.model.towards * kept
            floors.append(kept + EQUAL * max(1.0, abs(kept)))
            (start,) = scaled.scaled([point])
            more = [steepness, floors[0] / steepness, *floors[1:]]
            answer, word = run(programme, scaled.arguments(self.senses, start, more))
            found = scaled.point(answer)
            if word in SOLVED and self._feasible(scaled.parameters, found):
                point = found
        return point

    def _nothing(self, said: Sequence[str]) -> Solution:
        words = ", ".join(dict.fromkeys(said))
        if all(word == UNUSABLE for word in said):
            status, proof = Status.ERROR, "none"
        elif NO_WAY_IN in said:
            status = Status.INFEASIBLE
            proof = f"local: none of {len(said)} starts led to a feasible point"
        else:
            raise SolverError(f"{NAME} found no answer and no reason why: {words}")
        return unanswered(self.model, NAME, proof, status, words)

    def _solution(
        self,
        parameters: Mapping[str, Any],
        point: dict[str, float],
        weights: Floats,
        at_bounds: Floats,
        said: Sequence[str],
    ) -> Solution:
        rows = evaluated(self.model, {**parameters, **point})
        multipliers = {
            each.label: float(weight if each.relation.sense == "==" else abs(weight))
            for each, weight in zip(self.form.constraints, weights, strict=True)
        }
        for variable, weight in zip(self.model.variables, np.abs(at_bounds), strict=True):
            multipliers[variable.label] = multipliers.get(variable.label, 0.0) + float(weight)
        binding: dict[str, bool] = {}
        for row in rows:
            if not np.ndim(row.slack) and row.label not in multipliers:
                continue
            tight = abs(float(row.slack)) <= 1e-7 * max(1.0, abs(float(row.right)))
            binding[row.label] = binding.get(row.label, False) or tight
        for each in self.form.settled:
            multipliers[each.label], binding[each.label] = 0.0, False
        return Solution(
            engine=NAME,
            proof=PROOF,
            statuses=[Status.LOCALLY_OPTIMAL],
            objective=np.array([float(evaluate(self.model.objective, {**parameters, **point}))]),
            values={name: np.array([value]) for name, value in point.items()},
            binding={label: np.array([tight]) for label, tight in binding.items()},
            duals={label: np.array([weight]) for label, weight in multipliers.items()},
            words=[", ".join(dict.fromkeys(said))],
            model=self.model,
            given={name: np.array([value]) for name, value in parameters.items()},
        )


def _holds(relation: Relation, values: Mapping[str, Any]) -> bool:
    sides = (evaluate(side, values) for side in relation.sides)
    return bool(holding(relation.sense, *sides))


def solve(model: Model, programmes: int, time_limit_s: float | None = None) -> Solution:
    """Solve a smooth model for every entry of its parameters, one after the other.

    Parameters
    ----------
    model
        Any smooth model with continuous unknowns.
    programmes
        Number of entries of those parameters that are arrays, at least 1.
    time_limit_s
        Longest that one of them may take [s]; no limit by default.

    Raises
    ------
    SolverError
        If IPOPT fails or the time limit passes.
    """
    compiled = Compiled(model, time_limit_s)
    return stacked([compiled.solve(model.row(index)) for index in range(programmes)])
