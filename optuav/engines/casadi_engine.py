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
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats, Values
from optuav.engines.linear_form import implied_upper_bounds, own_bounds
from optuav.engines.registry import OneByOne, Single, capability
from optuav.engines.solution import Solution, single
from optuav.errors import InputError, SolverError
from optuav.modelling.check import checked, evaluated
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import KINKED, PARTIALS, evaluate, fold, has_unknowns
from optuav.status import Status

NAME = "casadi"
PROOF = "local: the best of several starts"
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
EQUAL = 1e-10
"""Relative loss of the objective that the preferences may use up."""
ACCURACY = 1e-10
"""What IPOPT asks of optimality, scaled, unless a caller is content with less."""
ITERATIONS = 3000
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


@contextmanager
def errors_named() -> Iterator[None]:
    """Turn what the library raises into `SolverError`."""
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


RENAMED = {
    "add": "plus", "subtract": "minus", "multiply": "times", "divide": "rdivide",
    "absolute": "fabs", "maximum": "fmax", "minimum": "fmin",
}  # fmt: skip
"""CasADi's names of functions; the others it calls as NumPy does, or they follow from those."""


def operation(ufunc: np.ufunc) -> Callable[..., Any]:
    """What a ufunc becomes on CasADi's symbols."""
    import casadi

    name = ufunc.__name__
    others: dict[str, Callable[..., Any]] = {
        "negative": lambda a: -a,
        "positive": lambda a: a,
        "square": lambda a: a * a,
        "reciprocal": lambda a: 1.0 / a,
        "trunc": lambda a: casadi.sign(a) * casadi.floor(casadi.fabs(a)),
        "heaviside": lambda a, b: (a > 0.0) + (a == 0.0) * b,
        "cbrt": lambda a: casadi.sign(a) * casadi.fabs(a) ** (1.0 / 3.0),
        "exp2": lambda a: 2.0**a,
        "log2": lambda a: casadi.log(a) / math.log(2.0),
        "logaddexp": lambda a, b: casadi.logsumexp(casadi.vertcat(a, b)),
    }
    others |= dict.fromkeys(("deg2rad", "radians"), lambda a: a * (math.pi / 180.0))
    others |= dict.fromkeys(("rad2deg", "degrees"), lambda a: a * (180.0 / math.pi))
    if ufunc not in PARTIALS and ufunc not in KINKED:
        raise InputError(f"engine {NAME} does not know the function {name}")
    found: Callable[..., Any] = others.get(name) or getattr(casadi, RENAMED.get(name, name))
    return found


class Scaled(NamedTuple):
    """One programme: values of all parameters, by name and as handed over, and where to look.

    The solver sees an unknown over its scale; the starts are scaled.
    """

    parameters: Values
    numbers: Floats
    lower: Floats
    upper: Floats
    scale: Floats
    starts: Sequence[Floats]


class CasadiProgramme:
    """A smooth model handed to CasADi once, to be solved with changing parameters; see `Casadi`.

    It is a programme over scaled unknowns for the objective over its steepness, and one for every
    preference. Their parameters are those of the model, the scales, the steepness, and limits that
    keep the earlier goals as good as they were; their rows are the constraints, and those limits.
    Constraints without an unknown are `settled`: such a row leaves IPOPT no interior to walk in.
    """

    def __init__(
        self,
        model: Model,
        time_limit_s: float | None = None,
        accuracy: float = ACCURACY,
        iterations: int = ITERATIONS,
    ) -> None:
        with errors_named():
            import casadi

        self.model, self.time_limit_s, self.base = model, time_limit_s, model.row(0)
        self.names = [variable.name for variable in model.variables]
        stated = [(has_unknowns(*each.relation.sides), each) for each in model.constraints]
        self.constraints = [each for moves, each in stated if moves]
        self.settled = [each for moves, each in stated if not moves]
        unknowns = casadi.SX.sym("x", len(self.names))
        scales = casadi.SX.sym("s", len(self.names))
        parameters = casadi.SX.sym("p", len(self.base))
        steepness = casadi.SX.sym("w")
        floors = casadi.SX.sym("floor", len(model.preferences))
        leaves = {name: unknowns[k] * scales[k] for k, name in enumerate(self.names)}
        leaves |= {name: parameters[k] for k, name in enumerate(self.base)}

        def symbols(tree: Operand) -> Any:
            found = fold(
                tree, lambda leaf: leaves[leaf.name], lambda ufunc, of: operation(ufunc)(*of)
            )
            return casadi.SX(found)

        cost = -model.towards * symbols(model.objective)
        everything = casadi.vertcat(parameters, scales)
        gradient = casadi.gradient(cost, unknowns)
        self.slope = casadi.Function("slope", [unknowns, everything], [gradient])
        sides = [map(symbols, each.relation.sides) for each in self.constraints]
        excess = [left - right for left, right in sides]
        goals = [cost / steepness, *map(symbols, model.preferences)]
        options: dict[str, Operand] = {
            **OPTIONS,
            "ipopt.tol": accuracy,
            "ipopt.max_iter": iterations,
        }
        if time_limit_s is not None:
            options["ipopt.max_wall_time"] = time_limit_s
        self._programmes = []
        for k, goal in enumerate(goals):
            programme = {
                "x": unknowns,
                "p": casadi.vertcat(everything, steepness, *(floors[j] for j in range(k))),
                "f": goal,
                "g": casadi.vertcat(*excess, *(goals[j] - floors[j] for j in range(k))),
            }
            with errors_named():
                self._programmes.append(casadi.nlpsol("programme", "ipopt", programme, options))

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        parameters = {**self.base, **values}

        def none(status: Status, proof: str, words: str) -> Solution:
            return single(self.model, NAME, proof, status, parameters, words)

        numbers = np.array([float(parameters[name]) for name in self.base])
        if not np.isfinite(numbers).all():
            return none(Status.ERROR, PROOF, "a parameter is no number")
        bounds = own_bounds(self.model, parameters)
        if any(lower > upper for lower, upper in bounds.values()):
            return none(Status.INFEASIBLE, "bounds contradict", "not handed to IPOPT")
        broken = [row.label for row in checked(self.settled, parameters) if not row.satisfied]
        if broken:
            words = f"does not hold whatever the unknowns: {', '.join(broken)}"
            return none(Status.INFEASIBLE, "evaluated", words)
        scaled = _scaled(self.model, parameters, numbers, bounds)
        halfway = scaled.starts[len(scaled.starts) // 2]
        slope = np.abs(np.asarray(self.slope(halfway, np.concatenate([numbers, scaled.scale]))))
        largest = float(slope.max(initial=0.0))
        steepness = largest / STEEP if math.isfinite(largest) and largest > 0.0 else 1.0
        best, said = self._best(scaled, steepness)
        if best is None and UNBOUNDED in said:
            somewhere, more = self._best(scaled, math.inf)  # the objective made level
            if somewhere is not None:
                proof = "local: the iterates diverge"
                return none(Status.UNBOUNDED, proof, ", ".join(dict.fromkeys(said)))
            said = more
        words = ", ".join(dict.fromkeys(said))
        if best is None and all(word == UNUSABLE for word in said):
            return none(Status.ERROR, "none", words)
        if best is None and NO_WAY_IN in said:
            proof = f"local: none of {len(said)} starts led to a feasible point"
            return none(Status.INFEASIBLE, proof, words)
        if best is None:
            raise SolverError(f"{NAME} found no answer and no reason why: {words}")
        point, answer = best
        weights = np.asarray(answer["lam_g"]).ravel() * steepness
        duals = {
            each.label: float(weight if each.relation.sense == "==" else abs(weight))
            for each, weight in zip(self.constraints, weights, strict=True)
        }
        at_bounds = np.abs(np.asarray(answer["lam_x"]).ravel() * steepness / scaled.scale)
        for variable, weight in zip(self.model.variables, at_bounds, strict=True):
            duals[variable.label] = duals.get(variable.label, 0.0) + float(weight)
        duals |= dict.fromkeys((each.label for each in self.settled), 0.0)
        point = self._preferred(point, scaled, steepness)
        found = Status.LOCALLY_OPTIMAL
        return single(self.model, NAME, PROOF, found, parameters, words, point, duals=duals)

    def _best(
        self, scaled: Scaled, steepness: float
    ) -> tuple[tuple[dict[str, float], Any] | None, list[str]]:
        """The best point that IPOPT reaches from any start, its answer, and all return statuses."""
        begin, most = time.monotonic(), -math.inf
        best: tuple[dict[str, float], Any] | None = None
        said: list[str] = []
        for start in scaled.starts:
            late = self.time_limit_s is not None and time.monotonic() - begin > self.time_limit_s
            if not late:
                point, answer, word = self._reached(scaled, start, [steepness])
                said.append(word)
            if late or word in TOO_SLOW:
                raise SolverError(f"{NAME} did not finish within the time limit")
            if point is None:
                continue
            value = evaluate(self.model.objective, {**scaled.parameters, **point})
            value = self.model.towards * float(value)
            if best is None or value > most + EQUAL * max(1.0, abs(most)):
                best, most = (point, answer), value
        return best, said

    def _preferred(
        self, point: dict[str, float], scaled: Scaled, steepness: float
    ) -> dict[str, float]:
        """Of points as good as the best, the one with the smallest preferences, in their order."""
        floors: list[float] = []
        goals = [self.model.objective, *self.model.preferences]
        for number, goal in enumerate(goals[:-1]):
            kept = float(evaluate(goal, {**scaled.parameters, **point}))
            kept = kept if number else -self.model.towards * kept
            floors.append(kept + EQUAL * max(1.0, abs(kept)))
            start = np.array([point[name] for name in self.names]) / scaled.scale
            more = [steepness, floors[0] / steepness, *floors[1:]]
            point = self._reached(scaled, start, more)[0] or point
        return point

    def _reached(
        self, scaled: Scaled, start: Floats, more: Sequence[float]
    ) -> tuple[dict[str, float] | None, Any, str]:
        """The point that IPOPT reaches from a start, its answer and its return status.

        `more` holds the steepness, and a limit for every earlier goal. None unless it is solved and
        feasible; a point is moved onto bounds that it nearly reaches.
        """
        kept = len(more) - 1
        senses = [each.relation.sense for each in self.constraints] + ["<="] * kept
        arguments = {
            "x0": start,
            "p": np.concatenate([scaled.numbers, scaled.scale, more]),
            "lbx": scaled.lower / scaled.scale,
            "ubx": scaled.upper / scaled.scale,
            "lbg": np.array([-math.inf if sense == "<=" else 0.0 for sense in senses]),
            "ubg": np.array([math.inf if sense == ">=" else 0.0 for sense in senses]),
        }
        answer, word = run(self._programmes[kept], arguments)
        found = np.clip(np.asarray(answer["x"]).ravel() * scaled.scale, scaled.lower, scaled.upper)
        for bound in (scaled.lower, scaled.upper):
            reach = AT_BOUND * np.maximum(1.0, np.abs(bound))
            found = np.where(np.isfinite(bound) & (np.abs(found - bound) <= reach), bound, found)
        point = dict(zip(self.names, found.tolist(), strict=True))
        rows = evaluated(self.model, {**scaled.parameters, **point})
        solved = word in SOLVED and all(row.satisfied for row in rows)
        return (point if solved else None), answer, word


def _scaled(
    model: Model,
    parameters: Values,
    numbers: Floats,
    bounds: Mapping[str, tuple[float, float]],
) -> Scaled:
    """A programme with scales and starts that its bounds and constraints suggest."""
    lower, upper = np.array(list(bounds.values())).reshape(-1, 2).T
    implied = implied_upper_bounds(model, parameters, dict(zip(bounds, lower, strict=True)))
    likely = np.minimum(upper, list(implied.values()))
    reach = np.where(
        (likely > lower) & (likely < math.inf), np.maximum(likely - lower, LEAST), TYPICAL
    )
    open_below = np.where(np.isinf(upper), -0.5 * TYPICAL, upper - TYPICAL)
    scale = np.where(np.isinf(lower), TYPICAL, reach)
    first = np.where(np.isinf(lower), open_below, lower)
    shares = itertools.islice(itertools.product(SHARES, repeat=len(lower)), MOST_STARTS)
    starts = [(first + np.array(share) * scale) / scale for share in shares]
    return Scaled(parameters, numbers, lower, upper, scale, starts)


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

    name = NAME
    takes = capability(NAME)
    accuracy: float = ACCURACY
    iterations: int = ITERATIONS

    def prepare(self, model: Model, slot_s: float | None, time_limit_s: float | None) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        return CasadiProgramme(model, time_limit_s, self.accuracy, self.iterations).solve
