"""Models for Pyomo, which hands them to the solvers that it finds, or writes them for others."""

import io
import operator
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Values
from optuav.engines.linear_form import own_bounds, reaches
from optuav.engines.registry import Capability, OneByOne, Single
from optuav.engines.solution import DUALITY, Solution, single, without_solver
from optuav.errors import Fault, InputError, SolverError, printable, require
from optuav.modelling.classify import traits
from optuav.modelling.expression import Leaf, Let, Operand, Variable
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, fold, has_unknowns
from optuav.status import Status

NAME = "pyomo"
HIGHS = "appsi_highs"  # HiGHS in Pyomo's words
LINEAR = (HIGHS, "highs", "appsi_cbc", "cbc", "glpk")  # Solvers that take linear models only
FINE = {f"{kind}_feasibility_tolerance": 1e-9 for kind in ("primal", "dual", "mip")}
SETTINGS: Mapping[str, Values] = {
    **dict.fromkeys((HIGHS, "highs"), FINE | {"mip_rel_gap": 0.0}),
    "ipopt": {"tol": 1e-10, "constr_viol_tol": 1e-11, "bound_relax_factor": 0.0},
}
"""Options of solvers whose defaults are too coarse for seconds."""
EQUAL = 1e-11  # Relative loss of the objective that the preferences may use up
STATIONARY = 1e-6  # Largest residual of an answer that meets the conditions of optimality
SAME = 1e-9  # Relative difference by which Pyomo's value of a tree may differ from optuav's
FILES = {"nl": "# ", "gms": "* ", "bar": "// "}
"""Start of a comment, by suffix of a format; in .nl only the first line has one."""
ALGEBRA = {np.add, np.subtract, np.multiply, np.divide, np.power, np.negative, np.positive}
ALGEBRA |= {np.square, np.reciprocal, np.absolute}  # NumPy leaves these to its operands
FORMULAS: Mapping[np.ufunc, Callable[..., Any]] = {
    np.expm1: lambda pyo, a: pyo.exp(a) - 1.0,
    np.log1p: lambda pyo, a: pyo.log(1.0 + a),
    np.maximum: lambda pyo, a, b: 0.5 * (a + b + abs(a - b)),
    np.minimum: lambda pyo, a, b: 0.5 * (a + b - abs(a - b)),
}
"""Functions that formats of solvers lack, by those that they have."""
COMPARED = {"<=": operator.le, ">=": operator.ge, "==": operator.eq}
ANSWERED = ("optimal", "locallyOptimal", "globallyOptimal")  # Words of solvers that have a point
FOUND = {"infeasible": Status.INFEASIBLE, "unbounded": Status.UNBOUNDED}


@contextmanager
def failures_named(of: str, kind: type[Exception] = SolverError) -> Iterator[None]:
    """Turn what Pyomo or a solver raises into an error of ours, and what they log into silence."""
    from pyomo.common.log import LoggingIntercept

    with LoggingIntercept(io.StringIO(), "pyomo"):
        try:
            yield
        except Exception as error:  # Plugins raise errors of any kind
            raise kind(f"{NAME} with {of} failed: {error}") from error


def library() -> Any:
    """Pyomo's modelling environment; `InputError` where Pyomo is not installed."""
    require("pyomo", "models for Pyomo")
    import pyomo.environ

    return pyomo.environ


def applied(function: Operand, operands: tuple[Any, ...]) -> Any:
    """A function of Pyomo's expressions and of numbers."""
    pyo, known = library(), [each.item() if np.ndim(each) else each for each in operands]
    if function in FORMULAS:
        return FORMULAS[function](pyo, *known)
    if function in ALGEBRA:
        return function(*known)
    named = getattr(pyo, function.__name__.replace("arc", "a"), None)
    if named is None or not isinstance(function, np.ufunc):
        raise InputError(f"Pyomo does not know the function {function.__name__}")
    return named(*known)


def to_pyomo(model: Model, values: Values, *, checked: bool = True) -> Any:
    """Return a model with numbers as a ``ConcreteModel`` of Pyomo, see `Program.to_pyomo`.

    `InputError` if Pyomo is missing or lacks a function or its digits, or, where that is checked,
    if the numbers alone leave no point.
    """
    pyo, done, (first, reach) = library(), dict[int, Any](), reaches(model, values)
    if checked and (decided := without_solver(model, NAME, values)):
        raise InputError(f"there is nothing to hand over: {decided.words[0]}")
    names, numbers = [x.name for x in model.variables], {k: float(v) for k, v in values.items()}
    starts = dict(zip(names, (first + 0.5 * reach).tolist(), strict=True))
    found = pyo.ConcreteModel(" ".join(model.title.split()))
    found.unknowns = pyo.Var(names, initialize=starts)
    found.parameters = pyo.Param([*values], initialize=numbers, within=pyo.Any, mutable=True)
    found.quantities, found.constraints = pyo.Expression(pyo.Any), pyo.Constraint(pyo.Any)

    def leaf(node: Leaf) -> Any:
        return (found.unknowns if isinstance(node, Variable) else found.parameters)[node.name]

    def let(node: Let, inner: Any) -> Any:
        if not node.moves:
            return inner  # Bounds take no named quantity
        key = (node.name, len(found.quantities)) if node.name in found.quantities else node.name
        found.quantities[key] = inner
        return found.quantities[key]

    def tree(label: str, expression: Operand) -> Any:
        known = fold(expression, leaf, applied, let, done)
        ours, theirs = evaluate(expression, {**values, **starts}), pyo.value(known, exception=False)
        if theirs is not None and abs(ours - theirs) > SAME * max(1.0, abs(ours)):
            lost = f"{label!r} is {ours:.9g}, but {theirs:.9g} by the functions that Pyomo has"
            raise InputError(f"{lost}: its exp(x) − 1 leaves no digits of a tiny x")
        return known

    for each in model.variables:
        unknown = found.unknowns[each.name]
        unknown.bounds = tree(each.label, each.lower), tree(each.label, each.upper)
        unknown.domain = pyo.Binary if each.binary else pyo.Reals
    for stated in model.constraints:
        if has_unknowns(*stated.relation.sides):
            sides = (tree(stated.label, side) for side in stated.relation.sides)
            found.constraints[str(stated.label)] = COMPARED[stated.relation.sense](*sides)
    sense = pyo.maximize if model.sense == "maximise" else pyo.minimize
    found.objective = pyo.Objective(expr=tree("objective", model.objective), sense=sense)
    found.preferences = pyo.ObjectiveList()
    for goal in model.preferences:
        found.preferences.add(tree("preference", goal)).deactivate()
    return found


def to_file(model: Model, values: Values, form: str, remarks: Iterable[str] = ()) -> str:
    """The text of a file in a format of `FILES`, with remarks and the names of the unknowns."""
    found = to_pyomo(model, values)
    with tempfile.TemporaryDirectory() as folder, failures_named(f"its .{form} writer", InputError):
        path = Path(folder) / f"programme.{form}"
        # Not every reader of .nl skips comments, which the labels are there.
        _, number = found.write(str(path), io_options={"symbolic_solver_labels": form != "nl"})
        symbols = found.solutions.symbol_map[number].byObject
        text = path.read_text("utf-8")
    notes = [model.title, *remarks]
    for each in model.variables:
        unit = "" if each.unit == "1" else f" [{each.unit}]"
        if symbol := symbols.get(id(found.unknowns[each.name])):  # else no constraint has it
            notes.append(f"{symbol} is {each.name}, {each.symbol}{unit}")
    if form == "nl":
        head, _, rest = text.partition("\n")
        return f"{head.partition('#')[0]}# {printable('; '.join(notes))}\n{rest}"
    return "".join(f"{FILES[form]}{printable(each)}\n" for each in notes) + text


class PyomoProgramme:
    """A model handed to Pyomo once, to be solved with changing parameters; see `Pyomo`."""

    def __init__(self, model: Model, engine: "Pyomo", time_limit_s: float | None) -> None:
        self.model, self.base, self.name = model, model.row(0), engine.solver
        self.pyomo, self.linear = to_pyomo(model, self.base, checked=False), traits(model).linear
        self.binary = [each.binary for each in model.variables]
        self.asked: Values = {"options": {**SETTINGS.get(self.name, {}), **engine.options}}
        self.asked |= {} if time_limit_s is None else {"timelimit": time_limit_s}
        if not self._solver().available(exception_flag=False):
            words = f"a solver that Pyomo finds; optuav[pyomo] brings HiGHS alone, {HIGHS}"
            raise InputError([Fault("solver", repr(self.name), words)])

    def _solver(self) -> Any:
        """A solver that knows of no programme yet."""
        with failures_named(self.name):
            return library().SolverFactory(self.name)

    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        parameters, pyo, solver = {**self.base, **values}, library(), self._solver()
        if decided := without_solver(self.model, NAME, parameters):
            return decided
        for name, value in parameters.items():
            self.pyomo.parameters[name] = float(value)
        self.pyomo.del_component("kept")
        self.pyomo.kept = pyo.ConstraintList()
        found = partial(single, self.model, NAME, parameters)
        goals = [self.pyomo.objective, *self.pyomo.preferences.values()]
        word = self._reached(solver, goals, 0)
        if word not in ANSWERED:
            unproved = word == "infeasible" and not self.linear
            status = Status.UNKNOWN if unproved else FOUND.get(word, Status.UNKNOWN)
            return found(status, f"by {self.name}", word)
        for number, goal in enumerate(goals[:-1]):
            sign, reached = 1.0 if goal.is_minimizing() else -1.0, pyo.value(goal)
            room = EQUAL * max(1.0, abs(reached))
            self.pyomo.kept.add(sign * (goal.expr - reached) <= room)
            if self._reached(solver, goals, number + 1) not in ANSWERED:
                break
        x = np.array([each.value for each in self.pyomo.unknowns.values()], float)
        bounds = np.transpose([*own_bounds(self.model, parameters).values()])
        x = np.clip(np.where(self.binary, np.round(x), x), *bounds) + 0.0
        point = dict(zip(self.pyomo.unknowns, x.tolist(), strict=True))
        status, proof = Status.LOCALLY_OPTIMAL, f"local: {self.name} says {word}"
        if self.linear:
            branched = f"branch and bound ({self.name})"
            status, proof = Status.OPTIMAL, branched if any(self.binary) else DUALITY
        answer = found(status, proof, word, point)
        if not any(self.binary):
            answer = replace(answer, duals=None)
            if np.max(answer.residuals()) > STATIONARY:
                return replace(answer, statuses=[Status.FEASIBLE], proof=f"{self.name} says {word}")
        return answer

    def _reached(self, solver: Any, goals: Sequence[Any], number: int) -> str:
        """Solve for one of some goals, and load the values if there are any; the solver's word."""
        for k, goal in enumerate(goals):
            goal.activate() if k == number else goal.deactivate()
        with failures_named(self.name):
            results = solver.solve(self.pyomo, load_solutions=False, **self.asked)
            word = str(results.solver.termination_condition)
            if word in ANSWERED:
                self.pyomo.solutions.load_from(results)
        if word == "maxTimeLimit":
            raise SolverError(f"{NAME} with {self.name} did not finish within the time limit")
        return word


@dataclass(frozen=True)
class Pyomo(OneByOne):
    """The engine that hands models to a solver through Pyomo; needs the extra ``pyomo``.

    Parameters
    ----------
    solver
        Name of a solver that Pyomo finds, by default HiGHS, which takes linear models.
    options
        Options of the solver, by its names of them.

    Examples
    --------
    >>> import optuav
    >>> plan = optuav.solve("paper", "P3", perspective="battery", engine=optuav.Pyomo())
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    688.848 s, optimal
    """

    name = NAME
    solver: str = HIGHS
    options: Mapping[str, Operand] = field(default_factory=dict, hash=False)

    @property
    def takes(self) -> Capability:  # type: ignore[override]
        """Which models the solver takes, as far as that is known."""
        if self.solver in LINEAR:
            return Capability(NAME, integer=True)
        return Capability(NAME, nonlinear=True, integer=True, needs=("derivatives",))

    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        return PyomoProgramme(model, self, time_limit_s).solve
