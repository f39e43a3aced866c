"""Smooth programmes by CasADi and IPOPT: the best local optimum of several starts.

References
----------
.. [1] J. Andersson et al., "CasADi: a software framework for nonlinear optimization and optimal
   control", Mathematical Programming Computation, 2019.
.. [2] A. Wächter, L. Biegler, "On the implementation of an interior-point filter line-search
   algorithm for large-scale nonlinear programming", Mathematical Programming, 2006.
"""

import itertools
import math
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats, Values
from optuav.engines.linear_form import own_bounds, reaches
from optuav.engines.registry import OneByOne, Single
from optuav.engines.solution import Solution, single, without_solver
from optuav.errors import InputError, SolverError
from optuav.modelling.check import evaluated
from optuav.modelling.classify import traits
from optuav.modelling.expression import Operand
from optuav.modelling.forms import NotAffineError, affine
from optuav.modelling.model import Model
from optuav.modelling.traversal import (
    KINKED,
    PARTIALS,
    change_by_step,
    evaluate,
    fold,
    has_unknowns,
)
from optuav.status import Status

NAME = "casadi"
PROOF = "local: the best of several starts"
CORNER = "evaluated: all unknowns are at their lower bounds, and nothing is gained by leaving them"
OPTIONS: Mapping[str, Operand] = {
    "print_time": False,
    "calc_lam_p": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.constr_viol_tol": 1e-11,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.diverging_iterates_tol": 1e8,
}
LATE = f"{NAME} did not finish within the time limit"
LOSS_TO_LATER_GOALS = 1e-10
"""Loss of a goal that later ones may use up, as a share of its value, or of a second's worth."""
ACCURACY = 1e-10  # What IPOPT asks of optimality, scaled, unless a caller is content with less
ITERATIONS = 3000
SHARES = (0.02, 0.5, 0.98)  # Where the starts lie between the bounds of an unknown
MOST_STARTS = 27
DEEP = 1000  # Depth of the comparison of expressions
AT_BOUND = 1e-9  # Relative distance from a bound that is as good as none
STEEP = 100.0  # Largest slope of an objective as the solver sees it; its tolerances are absolute
PRICED = 1e-3 * STEEP  # Multiplier, as the solver sees it, that is not a leftover of its barrier


@contextmanager
def errors_named() -> Iterator[None]:
    """Turn the library's errors into `SolverError`."""
    try:
        yield
    except ImportError as error:
        raise SolverError(f"engine casadi needs the package casadi: {error}") from error
    except RuntimeError as error:
        raise SolverError(f"casadi failed: {error}") from error


def run(programme: Any, arguments: Mapping[str, Floats]) -> tuple[Any, str]:
    """The answer of IPOPT, and its return status."""
    with errors_named():
        return programme(**arguments), programme.stats()["return_status"]


def applied(ufunc: np.ufunc, operands: Sequence[Any]) -> Any:
    """A ufunc of CasADi's symbols, which know what NumPy asks of them."""
    if ufunc not in PARTIALS and ufunc not in KINKED:
        raise InputError(f"engine {NAME} does not know the function {ufunc.__name__}")
    with warnings.catch_warnings():
        # CasADi announces another type of result for numbers, which these are not.
        warnings.simplefilter("ignore", FutureWarning)
        return ufunc(*operands)


class Scaled(NamedTuple):
    """One programme: values of all parameters, by name and as handed over, and where to look.

    The solver sees an unknown over its scale, and the objective over its steepness.
    """

    parameters: Values
    numbers: Floats  # Parameters and scales
    lower: Floats
    upper: Floats
    scale: Floats
    starts: Sequence[Floats]
    steepness: float = 1.0


class Functions(NamedTuple):
    """A model in CasADi's terms."""

    slope: Any  # Slope of the objective
    normals: Any  # Slopes of the rows
    programmes: list[Any]  # One for each goal
    least: Floats  # Limits of the rows
    most: Floats


class CasadiProgramme:
    """A smooth model handed to CasADi once, to be solved with changing parameters; see `Casadi`.

    It is one programme for the objective and one for each preference, with limits that keep the
    earlier goals as good as they were. Constraints without an unknown are not handed over. Those
    that an equation implies have no limit: with one, IPOPT has no interior to walk in, and
    multipliers grow that excuse any error.
    """

    def __init__(
        self,
        model: Model,
        time_limit_s: float | None = None,
        accuracy: float = ACCURACY,
        iterations: int = ITERATIONS,
    ) -> None:
        self.model, self.base, self.limit_s = model, model.row(0), time_limit_s or math.inf
        self.names = [variable.name for variable in model.variables]
        self.linear = traits(model).linear
        self.goals = [-model.sign * model.objective, *model.preferences]
        self.constraints = [row for row in model.constraints if has_unknowns(*row.relation.sides)]
        self.options = {**OPTIONS, "ipopt.tol": accuracy, "ipopt.max_iter": iterations}
        if time_limit_s is not None:
            self.options["ipopt.max_wall_time"] = time_limit_s

    @cached_property
    def _functions(self) -> Functions:
        """The model handed over, when IPOPT is first needed."""
        with errors_named():
            import casadi

        unknowns, scales = (casadi.SX.sym(letter, len(self.names)) for letter in "xs")
        parameters, steepness = casadi.SX.sym("p", len(self.base)), casadi.SX.sym("w")
        floors = casadi.SX.sym("floor", len(self.model.preferences))
        leaves = {name: unknowns[k] * scales[k] for k, name in enumerate(self.names)}
        leaves |= {name: parameters[k] for k, name in enumerate(self.base)}

        done: dict[int, Any] = {}  # Rows share most of their nodes

        def symbols(tree: Operand) -> Any:
            """A tree in CasADi's symbols."""
            return casadi.SX(fold(tree, lambda leaf: leaves[leaf.name], applied, done=done))

        relations = [constraint.relation for constraint in self.constraints]
        sides = [[*map(symbols, relation.sides)] for relation in relations]
        equal = np.array([relation.sense == "==" for relation in relations], bool)
        zeros = [gap for x, y in itertools.compress(sides, equal) for gap in (x - y, y - x)]
        implied = [any(casadi.is_equal(x - y, zero, DEEP) for zero in zeros) for x, y in sides]
        rows = [(x - y) * r.signs[0] for (x, y), r in zip(sides, relations, strict=True)]
        least = np.where(equal, 0.0, -math.inf)
        most = np.where(np.array(implied, bool) & ~equal, math.inf, 0.0)
        cost, *preferences = map(symbols, self.goals)
        numbers = casadi.vertcat(parameters, scales)
        slope = casadi.Function("slope", [unknowns, numbers], [casadi.gradient(cost, unknowns)])
        gradients = casadi.jacobian(casadi.SX(casadi.vertcat(*rows)), unknowns)
        normals = casadi.Function("normals", [unknowns, numbers], [gradients])
        programmes, passed = [], casadi.vertcat(numbers, steepness)
        for k, goal in enumerate([cost / steepness, *preferences]):
            programme = {"x": unknowns, "p": passed, "f": goal, "g": casadi.vertcat(*rows)}
            with errors_named():
                programmes.append(casadi.nlpsol("programme", "ipopt", programme, self.options))
            if k < len(preferences):
                rows.append(goal - floors[k])
                passed = casadi.vertcat(passed, floors[k])
        return Functions(slope, normals, programmes, least, most)

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        parameters = {**self.base, **values}
        if decided := without_solver(self.model, NAME, parameters):
            return decided
        solution = partial(single, self.model, NAME, parameters)
        bounds = own_bounds(self.model, parameters)
        if corner := self._corner(parameters, bounds):
            point, duals = corner
            return solution(Status.OPTIMAL, CORNER, "not handed to IPOPT", point, duals=duals)
        scaled = self._scaled(parameters, bounds)
        best, said = self._best(scaled)
        words = ", ".join(dict.fromkeys(said))
        if best is None and "Diverging_Iterates" in said:
            level, said = self._best(scaled._replace(steepness=math.inf))
            if level is not None:
                return solution(Status.UNBOUNDED, "local: the iterates diverge", words)
            words = ", ".join(dict.fromkeys(said))
        if best is None:
            if {*said} == {"Invalid_Number_Detected"}:
                return solution(Status.ERROR, "none", words)
            # Where all is linear, the least violation nearby is the least of all.
            proved = "Infeasible_Problem_Detected" in said and self.linear
            proof = f"local: none of {len(said)} starts led to a feasible point"
            return solution(Status.INFEASIBLE if proved else Status.UNKNOWN, proof, words)
        point, answer = best
        prices = (np.asarray(answer[name]).ravel() for name in ("lam_g", "lam_x"))
        weights, at_bounds = (price * scaled.steepness for price in prices)
        duals = dict.fromkeys((row.label for row in self.model.constraints), 0.0)
        for row, weight in zip(self.constraints, weights.tolist(), strict=True):
            duals[row.label] = weight if row.relation.sense == "==" else abs(weight)
        at_bounds = np.abs(at_bounds / scaled.scale)
        for variable, weight in zip(self.model.variables, at_bounds.tolist(), strict=True):
            duals[variable.label] = duals.get(variable.label, 0.0) + weight
        if not (self.linear and self._is_alone(answer, scaled)):
            point = self._preferred(point, scaled)
        return solution(Status.LOCALLY_OPTIMAL, PROOF, words, point, duals=duals)

    def _corner(
        self, parameters: Values, bounds: Mapping[str, tuple[float, float]]
    ) -> tuple[dict[str, float], dict[str, float]] | None:
        """The point at all lower bounds and its multipliers, if no other is better for any goal.

        None unless bounds are finite, the point is feasible, and goals are affine and never fall.
        """
        point = {name: lower for name, (lower, _) in bounds.items()}
        if not all(map(math.isfinite, point.values())):
            return None
        try:
            slopes = [affine(goal, parameters).coefficients for goal in self.goals]
        except NotAffineError:
            return None
        rises = all(slope >= 0.0 for goal in slopes for slope in goal.values())
        rows = evaluated(self.model, {**parameters, **point}) if rises else ()
        if not rows or not all(row.satisfied for row in rows):
            return None
        held = {x.label: slopes[0].get(x.name, 0.0) for x in self.model.variables}
        return point, dict.fromkeys((row.label for row in rows), 0.0) | held

    def _scaled(self, parameters: Values, bounds: Mapping[str, tuple[float, float]]) -> Scaled:
        """A programme with scales and starts that its bounds and constraints suggest."""
        lower, upper = np.array(list(bounds.values())).reshape(-1, 2).T
        first, reach = reaches(self.model, parameters)
        shares = itertools.islice(itertools.product(SHARES, repeat=len(lower)), MOST_STARTS)
        starts = [(first + np.array(share) * reach) / reach for share in shares]
        middle = starts[len(starts) // 2]
        numbers = np.array([*(float(parameters[name]) for name in self.base), *reach])
        slope = np.abs(np.asarray(self._functions.slope(middle, numbers)))
        largest = float(slope.max(initial=0.0))
        steepness = largest / STEEP if math.isfinite(largest) and largest > 0.0 else 1.0
        starts = [middle, *starts] if self.linear else starts
        return Scaled(parameters, numbers, lower, upper, reach, starts, steepness)

    def _best(self, scaled: Scaled) -> tuple[tuple[dict[str, float], Any] | None, list[str]]:
        """The best point that IPOPT reaches from any start, its answer, and all return statuses."""
        begin, least = time.monotonic(), math.inf
        best: tuple[dict[str, float], Any] | None = None
        said: list[str] = []
        for start in scaled.starts:
            if time.monotonic() - begin > self.limit_s:
                raise SolverError(LATE)
            point, answer, word = self._reached(scaled, start)
            said.append(word)
            if point is not None:
                at = {**scaled.parameters, **point}
                cost = float(evaluate(self.goals[0], at))
                if best is None or cost < least - self._equal(self.goals[0], least, at):
                    best, least = (point, answer), cost
                if self.linear:  # any local optimum is the global one
                    break
        return best, said

    def _is_alone(self, answer: Any, scaled: Scaled) -> bool:
        """Return whether no other point of a linear model is as good: priced rows fix the point."""
        weights, at_bounds = (np.abs(np.asarray(answer[k]).ravel()) for k in ("lam_g", "lam_x"))
        normals = self._functions.normals(answer["x"], scaled.numbers)
        rows = np.asarray(normals).reshape(-1, len(self.names))
        prices = np.concatenate([weights * np.linalg.norm(rows, axis=1), at_bounds])
        held = (prices > PRICED)[:, None]
        rank = np.linalg.matrix_rank(np.vstack([rows, np.eye(len(self.names))]) * held)
        return bool(rank == len(self.names))

    def _preferred(self, point: dict[str, float], scaled: Scaled) -> dict[str, float]:
        """Return the one of equally good points with the smallest preferences, in order."""
        floors: list[float] = []
        for goal in self.goals[:-1]:
            at = {**scaled.parameters, **point}
            kept = float(evaluate(goal, at))
            kept += self._equal(goal, kept, at)
            floors.append(kept if floors else kept / scaled.steepness)
            start = np.array([point[name] for name in self.names]) / scaled.scale
            point = self._reached(scaled, start, floors)[0] or point
        return point

    def _equal(self, goal: Operand, value: float, at: Values) -> float:
        """Difference to a value of a goal that counts as none."""
        return LOSS_TO_LATER_GOALS * max(
            float(change_by_step(goal, self.model.variables, at)), abs(value)
        )

    def _reached(
        self, scaled: Scaled, start: Floats, floors: Sequence[float] = ()
    ) -> tuple[dict[str, float] | None, Any, str]:
        """IPOPT's point from a start with limits for earlier goals, its answer and status.

        None unless it is solved and feasible; a point is moved onto bounds that it nearly reaches.
        """
        arguments = {
            "x0": start,
            "p": np.array([*scaled.numbers, scaled.steepness, *floors]),
            "lbx": scaled.lower / scaled.scale,
            "ubx": scaled.upper / scaled.scale,
            "lbg": np.append(self._functions.least, [-math.inf] * len(floors)),
            "ubg": np.append(self._functions.most, [0.0] * len(floors)),
        }
        answer, word = run(self._functions.programmes[len(floors)], arguments)
        if word in ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded"):
            raise SolverError(LATE)
        values = np.clip(np.asarray(answer["x"]).ravel() * scaled.scale, scaled.lower, scaled.upper)
        for bound in (scaled.lower, scaled.upper):
            reach = AT_BOUND * np.maximum(1.0, np.abs(bound))
            values = np.where(np.isfinite(bound) & (np.abs(values - bound) <= reach), bound, values)
        point = dict(zip(self.names, values.tolist(), strict=True))
        rows = evaluated(self.model, {**scaled.parameters, **point})
        solved = word in ("Solve_Succeeded", "Solved_To_Acceptable_Level")
        return (point if solved and all(row.satisfied for row in rows) else None), answer, word


@dataclass(frozen=True)
class Casadi(OneByOne):
    """The engine that hands smooth programmes to CasADi and IPOPT.

    Parameters
    ----------
    accuracy
        Tolerance of IPOPT on optimality, scaled, > 0.
    iterations
        Largest number of iterations of IPOPT from each start, ≥ 1.

    Examples
    --------
    >>> from optuav.engines.casadi_engine import Casadi
    >>> Casadi(accuracy=1e-6)
    Casadi(accuracy=1e-06, iterations=3000)
    """

    name = NAME
    nonlinear = True
    needs = ("derivatives",)
    accuracy: float = ACCURACY
    iterations: int = ITERATIONS

    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        return CasadiProgramme(model, time_limit_s, self.accuracy, self.iterations).solve
