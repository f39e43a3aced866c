"""A declared model as a model of Pyomo, which hands it to solvers or writes it for them."""

import io
import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from optuav.arrays import Values
from optuav.engines.linear_form import reaches
from optuav.engines.solution import without_solver
from optuav.errors import InputError, SolverError, require
from optuav.modelling.expression import Leaf, Let, Operand, Variable
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, fold, has_unknowns
from optuav.presentation.numbers import figure
from optuav.silence import silent

NAME = "pyomo"
SAME_VALUE = 1e-9  # Relative difference allowed between Pyomo's value of a tree and optuav's
FORMULAS: Mapping[Any, Callable[..., Any]] = {
    **{ufunc: ufunc for ufunc in (np.add, np.subtract, np.multiply, np.divide, np.power)},
    **{ufunc: ufunc for ufunc in (np.negative, np.positive, np.square, np.reciprocal, np.absolute)},
    np.expm1: lambda a: library().exp(a) - 1.0,
    np.log1p: lambda a: library().log(1.0 + a),
    np.maximum: lambda a, b: 0.5 * (a + b + abs(a - b)),
    np.minimum: lambda a, b: 0.5 * (a + b - abs(a - b)),
}
"""Functions that NumPy leaves to its operands, and functions missing from formats of solvers."""
RELATIONS = {"<=": operator.le, ">=": operator.ge, "==": operator.eq}


def library() -> Any:
    """Pyomo's modelling environment; `InputError` where Pyomo is not installed."""
    require("pyomo", "models for Pyomo")
    import pyomo.environ

    return pyomo.environ


@contextmanager
def failures_named(of: str, kind: type[Exception] = SolverError) -> Iterator[None]:
    """Turn errors of Pyomo or a solver into an error of ours, and silence them."""
    from pyomo.common.log import LoggingIntercept

    with silent(), LoggingIntercept(io.StringIO(), "pyomo"):
        try:
            yield
        except Exception as error:  # Plugins raise errors of any kind
            raise kind(f"{NAME} with {of} failed: {error}") from error


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
    pyo, done = library(), dict[int, Any]()
    if checked and (decided := without_solver(model, NAME, values)):
        raise InputError(f"there is nothing to hand over: {decided.words[0]}")
    names, (first, reach) = [x.name for x in model.variables], reaches(model, values)
    starts = dict(zip(names, (first + 0.5 * reach).tolist(), strict=True))
    numbers = {name: float(value) for name, value in values.items()}
    made = pyo.ConcreteModel(" ".join(model.title.split()))
    made.unknowns = pyo.Var(names, initialize=starts)
    made.parameters = pyo.Param([*numbers], initialize=numbers, within=pyo.Any, mutable=True)
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
        built = fold(expression, leaf, applied, let, done)
        ours, theirs = evaluate(expression, {**values, **starts}), pyo.value(built, exception=False)
        if theirs is not None and abs(ours - theirs) > SAME_VALUE * max(1.0, abs(ours)):
            lost = (
                f"{label!r} is {figure(ours, 9)}, but {figure(theirs, 9)} by the functions that "
                "Pyomo has"
            )
            raise InputError(f"{lost}: its exp(x) − 1 leaves no digits of a tiny x")
        return built

    for variable in model.variables:
        unknown = made.unknowns[variable.name]
        unknown.bounds = tree(variable.label, variable.lower), tree(variable.label, variable.upper)
        unknown.domain = pyo.Binary if variable.binary else pyo.Reals
    for row in model.constraints:
        if has_unknowns(*row.relation.sides):
            sides = (tree(row.label, side) for side in row.relation.sides)
            made.constraints[str(row.label)] = RELATIONS[row.relation.sense](*sides)
    sense = pyo.maximize if model.sense == "maximise" else pyo.minimize
    made.objective = pyo.Objective(expr=tree("objective", model.objective), sense=sense)
    made.preferences = pyo.ObjectiveList()
    for goal in model.preferences:
        made.preferences.add(tree("preference", goal)).deactivate()
    return made
