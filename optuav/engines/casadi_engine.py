"""Smooth programmes by CasADi and IPOPT: the best local optimum of several starts.

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
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from optuav.arrays import Floats, Values
from optuav.engines.ranges import implied_upper_bounds, lower_bounds, own_upper_bounds
from optuav.engines.registry import Capability, OneByOne, Single, capability
from optuav.engines.solution import Solution, unanswered
from optuav.errors import InputError, SolverError
from optuav.modelling.check import checked, evaluated
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, fold, has_unknowns
from optuav.status import Status

OPTIONS = {
    "print_time": False,
    "calc_lam_p": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.constr_viol_tol": 1e-11,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.diverging_iterates_tol": 1e8,
}
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
TOO_SLOW = ("Maximum_WallTime_Exceeded", "Maximum_CpuTime_Exceeded")
UNBOUNDED = "Diverging_Iterates"
UNUSABLE = "Invalid_Number_Detected"
NO_WAY_IN = "Infeasible_Problem_Detected"


@contextmanager
def errors_named() -> Iterator[None]:
    """Turn what the library raises into `SolverError`."""
    try:
        yield
    except ImportError as error:
        raise SolverError(f"engine casadi needs the package casadi: {error}") from error
    except RuntimeError as error:
        raise SolverError(f"casadi failed: {error}") from error


def prepared(
    programme: Values, time_limit_s: float | None, accuracy: float, iterations: int
) -> Any:
    """A programme of CasADi's symbols, made ready for `run`."""
    options: dict[str, Operand] = {**OPTIONS, "ipopt.tol": accuracy, "ipopt.max_iter": iterations}
    if time_limit_s is not None:
        options["ipopt.max_wall_time"] = time_limit_s
    with errors_named():
        import casadi

        return casadi.nlpsol("programme", "ipopt", programme, options)


def run(programme: Any, arguments: Mapping[str, Floats]) -> tuple[Any, str]:
    """The answer of IPOPT, and its return status."""
    with errors_named():
        return programme(**arguments), programme.stats()["return_status"]


NAME = "casadi"


class CasadiForm:
    """Programmes over scaled unknowns, with the parameters of a model as parameters.

    `programmes` holds what `casadi.nlpsol` takes, for the objective over its steepness and then for
    every preference. Their parameters are those of the model, the scales of the unknowns, the
    steepness, and limits that keep the earlier goals as good as they were; their rows are the
    `constraints`, and those limits. The `settled` constraints hold no unknown: a row without one
    leaves IPOPT no interior to walk in. `slope` is the gradient of what is minimised.

    Raises
    ------
    InputError
        If a function in the model is unknown to CasADi.
    SolverError
        If CasADi cannot be loaded.
    """

    def __init__(self, model: Model) -> None:
        with errors_named():
            import casadi

        self.names = [variable.name for variable in model.variables]
        self.given = list(model.given)
        stated = [(has_unknowns(*each.relation.sides), each) for each in model.constraints]
        self.constraints = [each for moves, each in stated if moves]
        self.settled = [each for moves, each in stated if not moves]
        unknowns = casadi.SX.sym("x", len(self.names))
        scales = casadi.SX.sym("s", len(self.names))
        parameters = casadi.SX.sym("p", len(self.given))
        steepness = casadi.SX.sym("w")
        floors = casadi.SX.sym("floor", len(model.preferences))
        leaves = {name: unknowns[k] * scales[k] for k, name in enumerate(self.names)}
        leaves |= {name: parameters[k] for k, name in enumerate(self.given)}
        table = operations()

        def applied(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Any:
            if ufunc not in table:
                raise InputError(f"engine {NAME} does not know the function {ufunc.__name__}")
            return table[ufunc](*arguments)

        def symbols(tree: Operand) -> Any:
            return casadi.SX(fold(tree, lambda leaf: leaves[leaf.name], applied))

        cost = -model.towards * symbols(model.objective)
        everything = casadi.vertcat(parameters, scales)
        self.slope = casadi.Function(
            "slope", [unknowns, everything], [casadi.gradient(cost, unknowns)]
        )
        sides = [map(symbols, each.relation.sides) for each in self.constraints]
        excess = [left - right for left, right in sides]
        goals = [cost / steepness, *map(symbols, model.preferences)]
        self.programmes = [
            {
                "x": unknowns,
                "p": casadi.vertcat(everything, steepness, *(floors[j] for j in range(k))),
                "f": goal,
                "g": casadi.vertcat(*excess, *(goals[j] - floors[j] for j in range(k))),
            }
            for k, goal in enumerate(goals)
        ]


SAME = (
    "fabs", "floor", "ceil", "sign", "sqrt", "exp", "expm1", "log", "log1p", "log10",
    "sin", "cos", "tan", "sinh", "cosh", "tanh", "hypot", "fmax", "fmin",
)  # fmt: skip
"""Functions that NumPy and CasADi call the same."""
RENAMED = {
    "absolute": "fabs", "maximum": "fmax", "minimum": "fmin", "arctan2": "atan2",
    "arcsin": "asin", "arccos": "acos", "arctan": "atan",
    "arcsinh": "asinh", "arccosh": "acosh", "arctanh": "atanh",
}  # fmt: skip
"""CasADi's names of others."""


def operations() -> Mapping[np.ufunc, Callable[..., Any]]:
    """What a ufunc becomes on CasADi's symbols."""
    import casadi

    names = {name: name for name in SAME} | RENAMED
    return {getattr(np, ours): getattr(casadi, theirs) for ours, theirs in names.items()} | {
        np.add: operator.add,
        np.subtract: operator.sub,
        np.multiply: operator.mul,
        np.divide: operator.truediv,
        np.power: operator.pow,
        np.negative: operator.neg,
        np.positive: operator.pos,
        np.trunc: lambda a: casadi.sign(a) * casadi.floor(casadi.fabs(a)),
        np.heaviside: lambda a, b: (a > 0.0) + (a == 0.0) * b,
        np.square: lambda a: a * a,
        np.reciprocal: lambda a: 1.0 / a,
        np.cbrt: lambda a: casadi.sign(a) * casadi.fabs(a) ** (1.0 / 3.0),
        np.exp2: lambda a: 2.0**a,
        np.log2: lambda a: casadi.log(a) / math.log(2.0),
        np.deg2rad: lambda a: a * (math.pi / 180.0),
        np.radians: lambda a: a * (math.pi / 180.0),
        np.rad2deg: lambda a: a * (180.0 / math.pi),
        np.degrees: lambda a: a * (180.0 / math.pi),
        np.logaddexp: lambda a, b: casadi.logsumexp(casadi.vertcat(a, b)),
    }


SHARES = (0.02, 0.5, 0.98)
"""Where the starts lie between the bounds of an unknown."""
MOST_STARTS = 27
TYPICAL = 1000.0
"""Reach of an unknown for which nothing states a bound."""
LEAST = 1e-3
"""Least reach by which an unknown is scaled, where the constraints leave it next to none."""
AT_BOUND = 1e-9
"""Relative distance from a bound that is as good as none."""
STEEP = 100.0
"""Largest slope of an objective as the solver sees it; its tolerances are absolute."""


class ScaledProgramme(NamedTuple):
    """One programme: a model with numbers for its parameters, and points to start from, scaled.

    The solver sees an unknown over its scale.
    """

    names: Sequence[str]
    parameters: Values
    numbers: Floats
    lower: Floats
    upper: Floats
    scale: Floats
    starts: Sequence[Floats]

    def arguments(
        self, senses: Sequence[str], start: Floats, more: Sequence[float]
    ) -> dict[str, Floats]:
        """Arguments of a call of IPOPT from a start, for rows of the given senses.

        `more` holds the steepness, and a limit for every earlier goal: a further row ≤ 0.
        """
        kept = len(more) - 1
        low = [-math.inf if sense == "<=" else 0.0 for sense in senses]
        high = [math.inf if sense == ">=" else 0.0 for sense in senses]
        return {
            "x0": start,
            "p": np.concatenate([self.numbers, self.scale, more]),
            "lbx": self.lower / self.scale,
            "ubx": self.upper / self.scale,
            "lbg": np.append(low, np.full(kept, -math.inf)),
            "ubg": np.append(high, np.zeros(kept)),
        }

    def point(self, answer: Any) -> dict[str, float]:
        """The point of an answer by name, moved onto bounds that it nearly reaches."""
        found = np.clip(np.asarray(answer["x"]).ravel() * self.scale, self.lower, self.upper)
        for bound in (self.lower, self.upper):
            reach = AT_BOUND * np.maximum(1.0, np.abs(bound))
            found = np.where(np.isfinite(bound) & (np.abs(found - bound) <= reach), bound, found)
        return dict(zip(self.names, found.tolist(), strict=True))

    def steepness(self, slope: Any) -> float:
        """Number by which the objective is divided, from its slope halfway between the bounds."""
        halfway = self.starts[len(self.starts) // 2]
        gradient = np.asarray(slope(halfway, np.concatenate([self.numbers, self.scale])))
        largest = float(np.abs(gradient).max(initial=0.0))
        return largest / STEEP if math.isfinite(largest) and largest > 0.0 else 1.0


def scaled_programme(
    model: Model,
    parameters: Values,
    numbers: Floats,
    lower: Mapping[str, float],
    upper: Mapping[str, float],
) -> ScaledProgramme:
    """A programme with scales and starts that its bounds and constraints suggest."""
    names = [variable.name for variable in model.variables]
    implied = implied_upper_bounds(model, parameters, lower)
    spans = [_span(lower[name], min(implied[name], upper[name]), upper[name]) for name in names]
    first, scale = np.array(spans).reshape(-1, 2).T
    shares = itertools.islice(itertools.product(SHARES, repeat=len(names)), MOST_STARTS)
    return ScaledProgramme(
        names,
        parameters,
        numbers,
        np.array([lower[name] for name in names]),
        np.array([upper[name] for name in names]),
        scale,
        [(first + np.array(share) * scale) / scale for share in shares],
    )


def _span(lower: float, likely: float, upper: float) -> tuple[float, float]:
    """Where the starts of an unknown begin and how far they reach, from its bounds.

    `likely` is the upper bound that the constraints put on it as well.
    """
    if math.isinf(lower):
        return (-0.5 * TYPICAL if math.isinf(upper) else upper - TYPICAL), TYPICAL
    if not likely > lower or math.isinf(likely):
        return lower, TYPICAL
    return lower, max(likely - lower, LEAST)


PROOF = "local: the best of several starts"
EQUAL = 1e-10
"""Relative loss of the objective that the preferences may use up."""
ACCURACY = 1e-10
"""What IPOPT asks of optimality, scaled, unless a caller is content with less."""
ITERATIONS = 3000


class CasadiProgramme:
    """A smooth model handed to CasADi once, to be solved with changing parameters; see `Casadi`.

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
    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name.

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
        settled = checked(self.form.settled, parameters)
        broken = [row.label for row in settled if not row.satisfied]
        if broken:
            words = f"does not hold whatever the unknowns: {', '.join(broken)}"
            return unanswered(self.model, NAME, "evaluated", Status.INFEASIBLE, words)
        scaled = scaled_programme(self.model, parameters, numbers, lower, upper)
        steepness = scaled.steepness(self.form.slope)
        best, said = self._best(scaled, steepness)
        if best is None and UNBOUNDED in said:
            somewhere, said_of_it = self._best(scaled, math.inf)  # the objective made level
            if somewhere is not None:
                proof = "local: the iterates diverge"
                return unanswered(self.model, NAME, proof, Status.UNBOUNDED, _words(said))
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
        """The best point that IPOPT reaches from any start, its answer, and all return statuses."""
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

    def _feasible(self, parameters: Values, point: Mapping[str, float]) -> bool:
        return all(bool(row.satisfied) for row in evaluated(self.model, {**parameters, **point}))

    def _preferred(
        self, point: dict[str, float], scaled: ScaledProgramme, steepness: float
    ) -> dict[str, float]:
        """Of points as good as the best, the one with the smallest preferences, in their order."""
        floors: list[float] = []
        goals = [self.model.objective, *self.model.preferences]
        for number, programme in enumerate(self._programmes[1:]):
            kept = float(evaluate(goals[number], {**scaled.parameters, **point}))
            kept = kept if number else -self.model.towards * kept
            floors.append(kept + EQUAL * max(1.0, abs(kept)))
            start = np.array([point[name] for name in scaled.names]) / scaled.scale
            more = [steepness, floors[0] / steepness, *floors[1:]]
            answer, word = run(programme, scaled.arguments(self.senses, start, more))
            found = scaled.point(answer)
            if word in SOLVED and self._feasible(scaled.parameters, found):
                point = found
        return point

    def _nothing(self, said: Sequence[str]) -> Solution:
        words = _words(said)
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
        parameters: Values,
        point: dict[str, float],
        weights: Floats,
        at_bounds: Floats,
        said: Sequence[str],
    ) -> Solution:
        multipliers = {
            each.label: float(weight if each.relation.sense == "==" else abs(weight))
            for each, weight in zip(self.form.constraints, weights, strict=True)
        }
        for variable, weight in zip(self.model.variables, np.abs(at_bounds), strict=True):
            multipliers[variable.label] = multipliers.get(variable.label, 0.0) + float(weight)
        multipliers |= dict.fromkeys((each.label for each in self.form.settled), 0.0)
        return Solution(
            engine=NAME,
            proof=PROOF,
            statuses=[Status.LOCALLY_OPTIMAL],
            objective=np.array([float(evaluate(self.model.objective, {**parameters, **point}))]),
            values={name: np.array([value]) for name, value in point.items()},
            tight=None,
            duals={label: np.array([weight]) for label, weight in multipliers.items()},
            words=[_words(said)],
            model=self.model,
            given={name: np.array([value]) for name, value in parameters.items()},
        )


def _words(said: Sequence[str]) -> str:
    return ", ".join(dict.fromkeys(said))


@dataclass(frozen=True)
class Casadi(OneByOne):
    """The engine that hands smooth programmes to CasADi and IPOPT.

    Parameters
    ----------
    accuracy
        Tolerance of IPOPT on optimality, scaled, > 0.
    iterations
        Most that IPOPT may take from a start, ≥ 1.

    Examples
    --------
    >>> from optuav.engines.casadi_engine import Casadi
    >>> Casadi(accuracy=1e-6)
    Casadi(accuracy=1e-06, iterations=3000)
    """

    name: ClassVar[str] = NAME
    takes: ClassVar[Capability] = capability(NAME)
    accuracy: float = ACCURACY
    iterations: int = ITERATIONS

    def prepare(self, model: Model, slot_s: float | None, time_limit_s: float | None) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        return CasadiProgramme(model, time_limit_s, self.accuracy, self.iterations).solve
