"""Models for Pyomo, which hands them to the solvers that it finds, or writes them for others."""

import io
import operator
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from optuav.arrays import Values
from optuav.engines.linear_form import own_bounds, reaches
from optuav.engines.registry import Capability, OneByOne, Single
from optuav.engines.solution import DUALITY, Solution, single, without_solver
from optuav.errors import Fault, InputError, SolverError, printable, refuse, require, shown
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
SAME = 1e-9  # Relative difference allowed between Pyomo's value of a tree and optuav's
FILES = {"nl": "# ", "gms": "* ", "bar": "// "}
"""Start of a comment, by suffix of a format; in .nl only the first line has one."""
FORMULAS: Mapping[Any, Callable[..., Any]] = {
    **{ufunc: ufunc for ufunc in (np.add, np.subtract, np.multiply, np.divide, np.power)},
    **{ufunc: ufunc for ufunc in (np.negative, np.positive, np.square, np.reciprocal, np.absolute)},
    np.expm1: lambda a: library().exp(a) - 1.0,
    np.log1p: lambda a: library().log(1.0 + a),
    np.maximum: lambda a, b: 0.5 * (a + b + abs(a - b)),
    np.minimum: lambda a, b: 0.5 * (a + b - abs(a - b)),
}
"""Functions that NumPy leaves to its operands, and functions missing from formats of solvers."""
COMPARED = {"<=": operator.le, ">=": operator.ge, "==": operator.eq}
FOUND = {"infeasible": Status.INFEASIBLE, "unbounded": Status.UNBOUNDED}
ANSWERED = ("optimal", "locallyOptimal", "globallyOptimal")  # Words of solvers that have a point


@contextmanager
def failures_named(of: str, kind: type[Exception] = SolverError) -> Iterator[None]:
    """Turn errors of Pyomo or a solver into an error of ours, and silence their logs."""
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
    name = getattr(function, "__name__", "")
    named = getattr(library(), name.replace("arc", "a"), None)
    if isinstance(function, np.ufunc) and (call := FORMULAS.get(function, named)):
        return call(*(operand.item() if np.ndim(operand) else operand for operand in operands))
    raise InputError(f"Pyomo does not know the function {name}")


def to_pyomo(model: Model, values: Values, *, checked: bool = True) -> Any:
    """Return a model with numbers as a ``ConcreteModel`` of Pyomo, see `Program.to_pyomo`.

    `InputError` if Pyomo, a function of it or its digits are missing, or, where that is checked,
    if the numbers by themselves leave no point.
    """
    pyo, done, (first, reach) = library(), dict[int, Any](), reaches(model, values)
    if checked and (decided := without_solver(model, NAME, values)):
        raise InputError(f"there is nothing to hand over: {decided.words[0]}")
    names, numbers = [x.name for x in model.variables], {k: float(v) for k, v in values.items()}
    starts = dict(zip(names, (first + 0.5 * reach).tolist(), strict=True))
    made = pyo.ConcreteModel(" ".join(model.title.split()))
    made.unknowns = pyo.Var(names, initialize=starts)
    made.parameters = pyo.Param([*values], initialize=numbers, within=pyo.Any, mutable=True)
    made.quantities, made.constraints = pyo.Expression(pyo.Any), pyo.Constraint(pyo.Any)

    def leaf(node: Leaf) -> Any:
        return (made.unknowns if isinstance(node, Variable) else made.parameters)[node.name]

    def let(node: Let, inner: Any) -> Any:
        if not node.moves:
            return inner  # Bounds take no named quantity
        key = (node.name, len(made.quantities)) if node.name in made.quantities else node.name
        made.quantities[key] = inner
        return made.quantities[key]

    def tree(label: str, expression: Operand) -> Any:
        known = fold(expression, leaf, applied, let, done)
        ours, theirs = evaluate(expression, {**values, **starts}), pyo.value(known, exception=False)
        if theirs is not None and abs(ours - theirs) > SAME * max(1.0, abs(ours)):
            lost = f"{label!r} is {ours:.9g}, but {theirs:.9g} by the functions that Pyomo has"
            raise InputError(f"{lost}: its exp(x) − 1 leaves no digits of a tiny x")
        return known

    for variable in model.variables:
        unknown = made.unknowns[variable.name]
        unknown.bounds = tree(variable.label, variable.lower), tree(variable.label, variable.upper)
        unknown.domain = pyo.Binary if variable.binary else pyo.Reals
    for row in model.constraints:
        if has_unknowns(*row.relation.sides):
            sides = (tree(row.label, side) for side in row.relation.sides)
            made.constraints[str(row.label)] = COMPARED[row.relation.sense](*sides)
    sense = pyo.maximize if model.sense == "maximise" else pyo.minimize
    made.objective = pyo.Objective(expr=tree("objective", model.objective), sense=sense)
    made.preferences = pyo.ObjectiveList()
    for goal in model.preferences:
        made.preferences.add(tree("preference", goal)).deactivate()
    return made


def to_file(model: Model, values: Values, form: str, remarks: Iterable[str] = ()) -> str:
    """The text of a file in a format of `FILES`, with remarks and the names of the unknowns."""
    made = to_pyomo(model, values)
    with tempfile.TemporaryDirectory() as folder, failures_named(f"its .{form} writer", InputError):
        path = Path(folder) / f"programme.{form}"
        # Not every reader of .nl skips comments, which the labels are there.
        _, number = made.write(str(path), io_options={"symbolic_solver_labels": form != "nl"})
        symbols = made.solutions.symbol_map[number].byObject
        text = path.read_text("utf-8")
    notes = [model.title, *remarks]
    for variable in model.variables:
        unit = "" if variable.unit == "1" else f" [{variable.unit}]"
        if symbol := symbols.get(id(made.unknowns[variable.name])):  # else no constraint has it
            notes.append(f"{symbol} is {variable.name}, {variable.symbol}{unit}")
    if form == "nl":
        head, _, rest = text.partition("\n")
        return f"{head.partition('#')[0]}# {printable('; '.join(notes))}\n{rest}"
    return "".join(f"{FILES[form]}{printable(note)}\n" for note in notes) + text


@dataclass(frozen=True)
class Pyomo(OneByOne):
    """The engine that hands models to a solver through Pyomo; needs the extra ``pyomo``.

    Parameters
    ----------
    solver
        Name of a solver that Pyomo finds, by default HiGHS, which takes linear models.
    options
        Options of the solver, by its own names; HiGHS's options are checked.

    Raises
    ------
    InputError
        If the solver is not a name, or HiGHS takes no such option.

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

    def __post_init__(self) -> None:
        if not isinstance(self.solver, str):
            raise InputError([Fault("solver", shown(self.solver), f"a name, such as {HIGHS!r}")])
        if not isinstance(self.options, Mapping):
            raise InputError([Fault("options", shown(self.options), "values by name")])
        refuse(self._refused() if self.options and self.solver in (HIGHS, "highs") else ())

    def _refused(self) -> Iterator[Fault]:
        """Options that HiGHS does not take; Pyomo leaves them out without a word."""
        import highspy

        file = highspy.Highs()  # type: ignore[no-untyped-call]
        file.setOptionValue("output_flag", False)
        for key, option in self.options.items():
            with suppress(TypeError):
                if file.setOptionValue(key, option) == highspy.HighsStatus.kOk:
                    continue
            yield Fault(f"options[{shown(key)}]", shown(option), "an option and a value of HiGHS")

    @property
    def takes(self) -> Capability:  # type: ignore[override]
        """The models the solver takes, as far as known."""
        if self.solver in LINEAR:
            return Capability(NAME, integer=True)
        return Capability(NAME, nonlinear=True, integer=True, needs=("derivatives",))

    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Hand over a model, to be solved for one programme at a time."""
        made = to_pyomo(model, model.row(0), checked=False)
        options: Values = {"options": {**SETTINGS.get(self.solver, {}), **self.options}}
        if time_limit_s is not None:
            options = {**options, "timelimit": time_limit_s}
        if not self._solver().available(exception_flag=False):
            words = f"a solver that Pyomo finds; optuav[pyomo] installs only HiGHS, {HIGHS}"
            raise InputError([Fault("solver", shown(self.solver), words)])
        return lambda values: self._solved(model, made, {**model.row(0), **values}, options)

    def _solver(self) -> Any:
        """A solver that knows of no programme yet."""
        with failures_named(self.solver):
            return library().SolverFactory(self.solver)

    def _solved(self, model: Model, made: Any, parameters: Values, asked: Values) -> Solution:
        """The solution with values of parameters: the best for each goal among the best before."""
        if decided := without_solver(model, NAME, parameters):
            return decided
        solution, linear = partial(single, model, NAME, parameters), traits(model).linear
        goals, solver, words = [made.objective, *made.preferences.values()], self._solver(), []
        made.parameters.store_values({key: float(value) for key, value in parameters.items()})
        made.del_component("kept")
        made.kept = library().ConstraintList()
        for goal in goals:
            for other in goals:
                other.activate() if other is goal else other.deactivate()
            with failures_named(self.solver):
                results = solver.solve(made, load_solutions=False, **asked)
                words.append(str(results.solver.termination_condition))
                if words[-1] in ANSWERED:
                    made.solutions.load_from(results)
            if words[-1] == "maxTimeLimit":
                raise SolverError(f"{NAME} with {self.solver} did not finish within the time limit")
            if words[-1] not in ANSWERED:
                break
            sign, reached = 1.0 if goal.is_minimizing() else -1.0, library().value(goal)
            made.kept.add(sign * (goal.expr - reached) <= EQUAL * max(1.0, abs(reached)))
        if (word := words[0]) not in ANSWERED:
            # A local solver proves no infeasibility.
            known = FOUND if linear or word != "infeasible" else {}
            return solution(known.get(word, Status.UNKNOWN), f"by {self.solver}", word)
        whole = [variable.binary for variable in model.variables]
        x = np.array([unknown.value for unknown in made.unknowns.values()], float)
        bounds = np.transpose([*own_bounds(model, parameters).values()])
        x = np.clip(np.where(whole, np.round(x), x), *bounds) + 0.0
        point = dict(zip(made.unknowns, x.tolist(), strict=True))
        status, proof = Status.LOCALLY_OPTIMAL, f"local: {self.solver} says {word}"
        if linear:
            branched = f"branch and bound ({self.solver})"
            status, proof = Status.OPTIMAL, branched if any(whole) else DUALITY
        answer = solution(status, proof, word, point)
        if any(whole):
            return answer
        answer = replace(answer, duals=None)
        if np.max(answer.residuals()) > STATIONARY:
            return replace(answer, statuses=[Status.FEASIBLE], proof=f"{self.solver} says {word}")
        return answer
