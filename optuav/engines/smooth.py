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
import operator
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from optuav.engines.ranges import implied_upper_bounds, lower_bounds, own_upper_bounds
from optuav.engines.solution import Solution, Status, stacked, unanswered
from optuav.errors import SolverError
from optuav.modelling.check import check, holding
from optuav.modelling.expression import Operand, Relation, Variable, evaluate, fold, leaves
from optuav.modelling.model import Model

NAME = "casadi"
PROOF = "local: the best of several starts"
SHARES = (0.02, 0.5, 0.98)
"""Where the starts lie between the bounds of an unknown."""
MOST_STARTS = 27
TYPICAL = 1000.0
"""Reach of an unknown for which nothing states a bound."""
EQUAL = 1e-10
"""Relative loss of the objective that the preferences may use up."""
OPTIONS = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-10,
    "ipopt.constr_viol_tol": 1e-11,
    "ipopt.bound_relax_factor": 0.0,
}
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
TOO_SLOW = ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded")
UNBOUNDED = "Diverging_Iterates"
UNUSABLE = "Invalid_Number_Detected"


def operations() -> Mapping[np.ufunc, Callable[..., Any]]:
    """What a ufunc becomes on CasADi's symbols."""
    import casadi

    return {
        np.add: operator.add,
        np.subtract: operator.sub,
        np.multiply: operator.mul,
        np.divide: operator.truediv,
        np.power: operator.pow,
        np.negative: operator.neg,
        np.positive: operator.pos,
        np.absolute: casadi.fabs,
        np.sign: casadi.sign,
        np.sqrt: casadi.sqrt,
        np.exp: casadi.exp,
        np.expm1: casadi.expm1,
        np.log: casadi.log,
        np.log1p: casadi.log1p,
        np.sin: casadi.sin,
        np.cos: casadi.cos,
        np.arcsin: casadi.asin,
        np.arctan2: casadi.atan2,
        np.maximum: casadi.fmax,
        np.minimum: casadi.fmin,
    }


class Compiled:
    """A model handed to CasADi once, to be solved with changing parameters.

    Parameters
    ----------
    model
        Any smooth model with continuous unknowns.
    time_limit_s
        Longest that one solve may take [s]; no limit by default.
    """

    def __init__(self, model: Model, time_limit_s: float | None = None) -> None:
        import casadi

        self.model = model
        self.time_limit_s = time_limit_s
        self.names = [variable.name for variable in model.variables]
        self.given = list(model.parameters)
        self.base = model.row(0)
        unknowns = casadi.SX.sym("x", len(self.names))
        scales = casadi.SX.sym("s", len(self.names))
        parameters = casadi.SX.sym("p", len(self.given))
        best = casadi.SX.sym("best")
        leaves = {name: unknowns[k] * scales[k] for k, name in enumerate(self.names)}
        leaves |= {name: parameters[k] for k, name in enumerate(self.given)}
        table = operations()

        def symbols(tree: Operand) -> Any:
            return casadi.SX(
                fold(
                    tree,
                    lambda leaf: leaves[leaf.name],
                    lambda ufunc, arguments: table[ufunc](*arguments),
                )
            )

        self.sign = 1.0 if model.sense == "maximise" else -1.0
        cost = -self.sign * symbols(model.objective)
        # A constraint without unknowns leaves IPOPT no interior to walk in.
        self.constraints = [each for each in model.constraints if _has_unknowns(each.relation)]
        self.settled = [each for each in model.constraints if not _has_unknowns(each.relation)]
        self.relations = [each.relation for each in self.constraints]
        excess = [symbols(each.left) - symbols(each.right) for each in self.relations]
        everything = casadi.vertcat(parameters, scales)
        self._goals = [self._solver(unknowns, everything, cost, excess)]
        for preference in model.preferences:
            # Among equally good points: the objective may not get worse than it was.
            self._goals.append(
                self._solver(
                    unknowns,
                    casadi.vertcat(everything, best),
                    symbols(preference),
                    [*excess, cost - best],
                )
            )

    def _solver(self, unknowns: Any, parameters: Any, cost: Any, excess: Sequence[Any]) -> Any:
        import casadi

        options: dict[str, Any] = dict(OPTIONS)
        if self.time_limit_s is not None:
            options["ipopt.max_wall_time"] = self.time_limit_s
        programme = {"x": unknowns, "p": parameters, "f": cost, "g": casadi.vertcat(*excess)}
        return casadi.nlpsol("programme", "ipopt", programme, options)

    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name.

        Raises
        ------
        SolverError
            If IPOPT fails or the time limit passes.
        """
        parameters = {**self.base, **values}
        numbers = np.array([float(parameters[name]) for name in self.given])
        lower = lower_bounds(self.model, parameters)
        own_upper = own_upper_bounds(self.model, parameters)
        if not np.isfinite(numbers).all():
            return unanswered(self.model, NAME, PROOF, Status.ERROR, "a parameter is no number")
        if any(lower[name] > own_upper[name] for name in self.names):
            return unanswered(
                self.model, NAME, "bounds contradict", Status.INFEASIBLE, "not handed to IPOPT"
            )
        broken = [each.label for each in self.settled if not _holds(each.relation, parameters)]
        if broken:
            words = f"does not hold whatever the unknowns: {', '.join(broken)}"
            return unanswered(self.model, NAME, "evaluated", Status.INFEASIBLE, words)
        upper = implied_upper_bounds(self.model, parameters, lower)
        reach = {n: _reach(lower[n], min(upper[n], own_upper[n])) for n in self.names}
        scale = np.array([reach[name] for name in self.names])
        bounds = {
            "lbx": np.array([lower[name] for name in self.names]) / scale,
            "ubx": np.array([own_upper[name] for name in self.names]) / scale,
        }
        low = [-math.inf if each.sense == "<=" else 0.0 for each in self.relations]
        high = [math.inf if each.sense == ">=" else 0.0 for each in self.relations]
        sides = {"lbg": np.array(low), "ubg": np.array(high)}
        begin = time.monotonic()
        best: tuple[float, dict[str, float], Any] | None = None
        said: list[str] = []
        for start in self._starts(lower, reach):
            if self.time_limit_s is not None and time.monotonic() - begin > self.time_limit_s:
                raise SolverError(f"{NAME} did not finish within the time limit")
            answer = self._goals[0](
                x0=start / scale, p=np.concatenate([numbers, scale]), **bounds, **sides
            )
            word = self._goals[0].stats()["return_status"]
            said.append(word)
            if word in TOO_SLOW:
                raise SolverError(f"{NAME} did not finish within the time limit")
            point = self._point(answer, scale, lower, own_upper)
            if word not in SOLVED or not self._feasible(parameters, point):
                continue
            value = self.sign * float(evaluate(self.model.objective, {**parameters, **point}))
            if best is None or value > best[0] + EQUAL * max(1.0, abs(best[0])):
                best = (value, point, answer)
        if best is None:
            return self._nothing(said)
        point = self._preferred(best, parameters, numbers, scale, bounds, sides, lower, own_upper)
        return self._solution(parameters, point, best[2], scale, said)

    def _starts(self, lower: Mapping[str, float], reach: Mapping[str, float]) -> list[Any]:
        shares = itertools.islice(itertools.product(SHARES, repeat=len(self.names)), MOST_STARTS)
        return [
            np.array([lower[n] + s * reach[n] for n, s in zip(self.names, share, strict=True)])
            for share in shares
        ]

    def _point(
        self, answer: Any, scale: Any, lower: Mapping[str, float], upper: Mapping[str, float]
    ) -> dict[str, float]:
        found = np.asarray(answer["x"]).ravel() * scale
        return {
            name: min(max(float(found[k]), lower[name]), upper[name])
            for k, name in enumerate(self.names)
        }

    def _feasible(self, parameters: Mapping[str, Any], point: Mapping[str, float]) -> bool:
        return all(bool(row.satisfied) for row in check(self.model, {**parameters, **point}))

    def _preferred(
        self,
        best: tuple[float, dict[str, float], Any],
        parameters: Mapping[str, Any],
        numbers: Any,
        scale: Any,
        bounds: Mapping[str, Any],
        sides: Mapping[str, Any],
        lower: Mapping[str, float],
        upper: Mapping[str, float],
    ) -> dict[str, float]:
        """The point with the smallest first preference among those as good as the best."""
        value, point, _ = best
        for solver in self._goals[1:]:
            floor = -value + EQUAL * max(1.0, abs(value))
            answer = solver(
                x0=np.array([point[name] for name in self.names]) / scale,
                p=np.concatenate([numbers, scale, [floor]]),
                **bounds,
                lbg=np.append(sides["lbg"], -math.inf),
                ubg=np.append(sides["ubg"], 0.0),
            )
            found = self._point(answer, scale, lower, upper)
            if solver.stats()["return_status"] in SOLVED and self._feasible(parameters, found):
                point = found
        return point

    def _nothing(self, said: Sequence[str]) -> Solution:
        words = ", ".join(dict.fromkeys(said))
        if UNBOUNDED in said:
            status, proof = Status.UNBOUNDED, "local: the iterates diverge"
        elif all(word == UNUSABLE for word in said):
            status, proof = Status.ERROR, "none"
        else:
            status = Status.INFEASIBLE
            proof = f"local: none of {len(said)} starts led to a feasible point"
        return unanswered(self.model, NAME, proof, status, words)

    def _solution(
        self,
        parameters: Mapping[str, Any],
        point: dict[str, float],
        answer: Any,
        scale: Any,
        said: Sequence[str],
    ) -> Solution:
        rows = check(self.model, {**parameters, **point})
        weights = np.asarray(answer["lam_g"]).ravel()
        weights = np.array(
            [
                weight if each.sense == "==" else abs(weight)
                for each, weight in zip(self.relations, weights, strict=True)
            ]
        )
        at_bounds = np.abs(np.asarray(answer["lam_x"]).ravel()) / scale
        labels = [each.label for each in self.constraints]
        multipliers = dict(zip(labels, weights, strict=True))
        for variable, weight in zip(self.model.variables, at_bounds, strict=True):
            multipliers[variable.label] = multipliers.get(variable.label, 0.0) + weight
        binding: dict[str, bool] = {}
        for row in rows:
            if not np.ndim(row.slack) and row.label not in multipliers:
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
    return any(isinstance(each, Variable) for each in leaves(relation.left, relation.right))


def _holds(relation: Relation, values: Mapping[str, Any]) -> bool:
    sides = (evaluate(side, values) for side in (relation.left, relation.right))
    return bool(holding(relation.sense, *sides))


def _reach(lower: float, upper: float) -> float:
    """How far an unknown may be from its lower bound, for starts and scaling."""
    return upper - lower if math.isfinite(upper) and upper > lower else TYPICAL


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
