"""Smooth programmes by CasADi and IPOPT: a local optimum from several starts, and said to be one.

References
----------
.. [1] J. Andersson et al., "CasADi: a software framework for nonlinear optimization and optimal
   control", Mathematical Programming Computation, 2019.
.. [2] A. Wächter, L. Biegler, "On the implementation of an interior-point filter line-search
   algorithm for large-scale nonlinear programming", Mathematical Programming, 2006.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from optuav.engines.arrays import Floats
from optuav.engines.ipopt import (
    NO_WAY_IN,
    OPTIONS,
    SOLVED,
    TOO_SLOW,
    UNBOUNDED,
    UNUSABLE,
    operations,
    run,
    told,
)
from optuav.engines.ranges import implied_upper_bounds, lower_bounds, own_upper_bounds
from optuav.engines.solution import Solution, stacked, unanswered
from optuav.errors import InputError, SolverError
from optuav.modelling.check import check, holding
from optuav.modelling.expression import Operand, Relation, Variable
from optuav.modelling.longest import lifted
from optuav.modelling.model import Model
from optuav.modelling.walk import evaluate, fold, leaves
from optuav.status import Status

NAME = "casadi"
PROOF = "local: the best of several starts"
SHARES = (0.02, 0.5, 0.98)
"""Where the starts lie between the bounds of an unknown."""
MOST_STARTS = 27
TYPICAL = 1000.0
"""Reach of an unknown for which nothing states a bound."""
LEAST = 1e-3
"""Least reach by which an unknown is scaled, where the constraints leave it next to none."""
EQUAL = 1e-10
"""Relative loss of the objective that the preferences may use up."""
AT_BOUND = 1e-9
"""Relative distance from a bound that is as good as none."""
STEEP = 100.0
"""Largest slope of an objective as IPOPT sees it; its tolerances are absolute."""
ACCURACY = 1e-10
"""What IPOPT asks of optimality, scaled, unless a caller is content with less."""
ITERATIONS = 3000


@dataclass(frozen=True)
class _Data:
    """Numbers of one programme: of the parameters, and of the unknowns before scaling.

    Bounds, sides and starts are as IPOPT gets them.
    """

    parameters: Mapping[str, Any]
    numbers: Floats
    lower: Floats
    upper: Floats
    scale: Floats
    starts: Sequence[Floats]
    sides: Mapping[str, Floats]

    def arguments(self, start: Floats, more: Sequence[float]) -> dict[str, Floats]:
        """Of a call from a start, with further parameters and as many more rows ≤ 0."""
        kept = len(more) - 1
        return {
            "x0": start,
            "p": np.concatenate([self.numbers, self.scale, more]),
            "lbx": self.lower / self.scale,
            "ubx": self.upper / self.scale,
            "lbg": np.append(self.sides["lbg"], np.full(kept, -math.inf)),
            "ubg": np.append(self.sides["ubg"], np.zeros(kept)),
        }


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
        with told():
            import casadi

        self.lifted = lifted(model)
        self.model = model = self.lifted.model
        self.accuracy = accuracy
        self.iterations = iterations
        self.time_limit_s = time_limit_s
        self.names = [variable.name for variable in model.variables]
        self.given = list(model.given)
        self.base = model.row(0)
        unknowns = casadi.SX.sym("x", len(self.names))
        scales = casadi.SX.sym("s", len(self.names))
        parameters = casadi.SX.sym("p", len(self.given))
        steepness = casadi.SX.sym("w")
        leaves = {name: unknowns[k] * scales[k] for k, name in enumerate(self.names)}
        leaves |= {name: parameters[k] for k, name in enumerate(self.given)}
        table = operations()

        def applied(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Any:
            if ufunc not in table:
                raise InputError(f"engine {NAME} does not know the function {ufunc.__name__}")
            return table[ufunc](*arguments)

        def symbols(tree: Operand) -> Any:
            return casadi.SX(fold(tree, lambda leaf: leaves[leaf.name], applied))

        self.sign = 1.0 if model.sense == "maximise" else -1.0
        cost = -self.sign * symbols(model.objective)
        # A constraint without unknowns leaves IPOPT no interior to walk in.
        self.constraints = [each for each in model.constraints if _has_unknowns(each.relation)]
        self.settled = [each for each in model.constraints if not _has_unknowns(each.relation)]
        self.relations = [each.relation for each in self.constraints]
        excess = [symbols(each.left) - symbols(each.right) for each in self.relations]
        everything = casadi.vertcat(parameters, scales)
        self._slope = casadi.Function(
            "slope", [unknowns, everything], [casadi.gradient(cost, unknowns)]
        )
        # Of later goals each keeps the earlier ones as good as they were.
        goals = [cost / steepness, *map(symbols, model.preferences)]
        floors = casadi.SX.sym("floor", len(model.preferences))
        self._programmes = [
            self._solver(
                unknowns,
                casadi.vertcat(everything, steepness, *(floors[j] for j in range(k))),
                goal,
                [*excess, *(goals[j] - floors[j] for j in range(k))],
            )
            for k, goal in enumerate(goals)
        ]

    def _solver(self, unknowns: Any, parameters: Any, cost: Any, excess: Sequence[Any]) -> Any:
        import casadi

        options: dict[str, Any] = {**OPTIONS, "ipopt.tol": self.accuracy}
        options["ipopt.max_iter"] = self.iterations
        if self.time_limit_s is not None:
            options["ipopt.max_wall_time"] = self.time_limit_s
        programme = {"x": unknowns, "p": parameters, "f": cost, "g": casadi.vertcat(*excess)}
        with told():
            return casadi.nlpsol("programme", "ipopt", programme, options)

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
        numbers = np.array([float(parameters[name]) for name in self.given])
        if not np.isfinite(numbers).all():
            return unanswered(self.model, NAME, PROOF, Status.ERROR, "a parameter is no number")
        lower = lower_bounds(self.model, parameters)
        upper = own_upper_bounds(self.model, parameters)
        if any(lower[name] > upper[name] for name in self.names):
            return unanswered(
                self.model, NAME, "bounds contradict", Status.INFEASIBLE, "not handed to IPOPT"
            )
        broken = [each.label for each in self.settled if not _holds(each.relation, parameters)]
        if broken:
            words = f"does not hold whatever the unknowns: {', '.join(broken)}"
            return unanswered(self.model, NAME, "evaluated", Status.INFEASIBLE, words)
        data = self._data(parameters, numbers, lower, upper)
        if starts:
            points = [np.array([start[name] for name in self.names]) for start in starts]
            data = replace(data, starts=[point / data.scale for point in points])
        steepness = self._steepness(data)
        begin = time.monotonic()
        best: tuple[float, dict[str, float], Any] | None = None
        said: list[str] = []
        for start in data.starts:
            if self.time_limit_s is not None and time.monotonic() - begin > self.time_limit_s:
                raise SolverError(f"{NAME} did not finish within the time limit")
            answer, word = run(self._programmes[0], data.arguments(start, [steepness]))
            said.append(word)
            if word in TOO_SLOW:
                raise SolverError(f"{NAME} did not finish within the time limit")
            point = self._point(answer, data)
            if word not in SOLVED or not self._feasible(parameters, point):
                continue
            value = self.sign * float(evaluate(self.model.objective, {**parameters, **point}))
            if best is None or value > best[0] + EQUAL * max(1.0, abs(best[0])):
                best = (value, point, answer)
        if best is None:
            return self._nothing(said)
        point = self._preferred(best[1], data, steepness)
        weights = np.asarray(best[2]["lam_g"]).ravel() * steepness
        at_bounds = np.asarray(best[2]["lam_x"]).ravel() * steepness / data.scale
        return self._solution(parameters, point, weights, at_bounds, said)

    def _data(
        self,
        parameters: Mapping[str, Any],
        numbers: Floats,
        lower: Mapping[str, float],
        upper: Mapping[str, float],
    ) -> _Data:
        implied = implied_upper_bounds(self.model, parameters, lower)
        spans = [
            _span(lower[name], min(implied[name], upper[name]), upper[name]) for name in self.names
        ]
        first, scale = np.array(spans).reshape(-1, 2).T
        free = len(self.names) - len(self.lifted.parts)
        shares = itertools.islice(itertools.product(SHARES, repeat=free), MOST_STARTS)
        low = [-math.inf if each.sense == "<=" else 0.0 for each in self.relations]
        high = [math.inf if each.sense == ">=" else 0.0 for each in self.relations]
        return _Data(
            parameters,
            numbers,
            np.array([lower[name] for name in self.names]),
            np.array([upper[name] for name in self.names]),
            scale,
            [self._start(share, first, scale, parameters) for share in shares],
            {"lbg": np.array(low), "ubg": np.array(high)},
        )

    def _start(
        self, shares: Sequence[float], first: Floats, scale: Floats, parameters: Mapping[str, Any]
    ) -> Floats:
        """A start at shares of the way between the bounds; parts of times as long as they can."""
        free = (first + np.array([*shares, *[0.0] * len(self.lifted.parts)]) * scale).tolist()
        point = dict(zip(self.names, free, strict=True))
        point |= self.lifted.shares({**parameters, **point})
        return np.array([point[name] for name in self.names]) / scale

    def _steepness(self, data: _Data) -> float:
        """What to divide the objective by, from its slope halfway between the bounds."""
        halfway = data.starts[len(data.starts) // 2]
        slope = np.asarray(self._slope(halfway, np.concatenate([data.numbers, data.scale])))
        largest = float(np.abs(slope).max(initial=0.0))
        return largest / STEEP if math.isfinite(largest) and largest > 0.0 else 1.0

    def _point(self, answer: Any, data: _Data) -> dict[str, float]:
        found = np.clip(np.asarray(answer["x"]).ravel() * data.scale, data.lower, data.upper)
        for bound in (data.lower, data.upper):
            # An interior point stops short of a bound that it was on its way to.
            reach = AT_BOUND * np.maximum(1.0, np.abs(bound))
            found = np.where(np.isfinite(bound) & (np.abs(found - bound) <= reach), bound, found)
        point = dict(zip(self.names, found.tolist(), strict=True))
        return point | self.lifted.shares({**data.parameters, **point})

    def _feasible(self, parameters: Mapping[str, Any], point: Mapping[str, float]) -> bool:
        return all(bool(row.satisfied) for row in check(self.model, {**parameters, **point}))

    def _preferred(
        self, point: dict[str, float], data: _Data, steepness: float
    ) -> dict[str, float]:
        """Among points as good as the best, the one that the preferences take, one by one."""
        floors: list[float] = []
        goals = [self.model.objective, *self.model.preferences]
        for number, programme in enumerate(self._programmes[1:]):
            kept = float(evaluate(goals[number], {**data.parameters, **point}))
            kept = kept if number else -self.sign * kept
            floors.append(kept + EQUAL * max(1.0, abs(kept)))
            start = np.array([point[name] for name in self.names]) / data.scale
            scaled = [floors[0] / steepness, *floors[1:]]
            answer, word = run(programme, data.arguments(start, [steepness, *scaled]))
            found = self._point(answer, data)
            if word in SOLVED and self._feasible(data.parameters, found):
                point = found
        return point

    def _nothing(self, said: Sequence[str]) -> Solution:
        words = ", ".join(dict.fromkeys(said))
        if UNBOUNDED in said:
            status, proof = Status.UNBOUNDED, "local: the iterates diverge"
        elif all(word == UNUSABLE for word in said):
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
        rows = check(self.model, {**parameters, **point})
        multipliers = {
            each.label: float(weight if each.relation.sense == "==" else abs(weight))
            for each, weight in zip(self.constraints, weights, strict=True)
        }
        for variable, weight in zip(self.model.variables, np.abs(at_bounds), strict=True):
            multipliers[variable.label] = multipliers.get(variable.label, 0.0) + float(weight)
        binding: dict[str, bool] = {}
        for row in rows:
            if not np.ndim(row.slack) and row.label not in multipliers:
                continue
            if row.label in self.lifted.silent:
                continue
            tight = abs(float(row.slack)) <= 1e-7 * max(1.0, abs(float(row.right)))
            binding[row.label] = binding.get(row.label, False) or tight
        for each in self.settled:
            multipliers[each.label], binding[each.label] = 0.0, False
        return Solution(
            engine=NAME,
            proof=PROOF,
            statuses=[Status.LOCALLY_OPTIMAL],
            objective=np.array([float(evaluate(self.model.objective, {**parameters, **point}))]),
            values={name: np.array([value]) for name, value in point.items()},
            binding={label: np.array([tight]) for label, tight in binding.items()},
            multipliers={label: np.array([weight]) for label, weight in multipliers.items()},
            words=[", ".join(dict.fromkeys(said))],
            model=self.model,
            given={name: np.array([value]) for name, value in parameters.items()},
        )


def _has_unknowns(relation: Relation) -> bool:
    return any(isinstance(each, Variable) for each in leaves(*relation.sides))


def _holds(relation: Relation, values: Mapping[str, Any]) -> bool:
    sides = (evaluate(side, values) for side in relation.sides)
    return bool(holding(relation.sense, *sides))


def _span(lower: float, likely: float, upper: float) -> tuple[float, float]:
    """Where the starts of an unknown begin and how far they reach, from its bounds.

    `likely` is the upper bound that the constraints put on it as well.
    """
    if math.isinf(lower):
        return (-0.5 * TYPICAL if math.isinf(upper) else upper - TYPICAL), TYPICAL
    if not likely > lower or math.isinf(likely):
        return lower, TYPICAL
    return lower, max(likely - lower, LEAST)


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
