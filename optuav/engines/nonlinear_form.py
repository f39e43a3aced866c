"""One programme of a model as functions of a vector, with exact derivatives, for other solvers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.linear_form import own_bounds, reaches
from optuav.errors import InputError
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, has_unknowns, slope


@dataclass(frozen=True)
class NonlinearForm:
    """Minimise f(x) over lower ≤ x ≤ upper subject to g(x) ≤ 0, or = 0 for an equation.

    x has the unknowns in the order of `names` and in their units. Constraints without an unknown
    are left out; `optuav.engines.solution.without_solver` decides them.

    Parameters
    ----------
    names, labels
        Names of the n unknowns, and labels of the m constraints.
    lower, upper, start, reach
        Bounds of the unknowns, maybe infinite; a point between them to start from, and how far
        from it each unknown may lie by the linear constraints, which is a scale of it: (n,).
    objective, gradient
        f, in the unit of the model's objective, which is −f where the model maximises; and its
        derivatives (n,).
    constraints, jacobian
        g, each entry in the unit of its constraint, (m,); and its derivatives (m, n).
    equations
        Which constraints are g(x) = 0, (m,).
    point
        Values of the unknowns by name, in their units, at a vector x.

    Examples
    --------
    >>> import numpy as np
    >>> import optuav
    >>> from optuav.engines.nonlinear_form import nonlinear_form
    >>> (part,) = optuav.formulate("paper", "P3", perspective="battery").parts
    >>> form = nonlinear_form(part.model, part.model.row(0))
    >>> form.names, form.objective(np.array([600.0])), form.gradient(np.array([600.0]))
    (('hover_time_s',), -600.0, array([-1.]))
    >>> form.constraints(np.array([600.0])).shape, form.jacobian(np.array([600.0])).shape
    ((1,), (1, 1))
    """

    names: tuple[str, ...]
    labels: tuple[str, ...]
    lower: Floats
    upper: Floats
    start: Floats
    reach: Floats
    objective: Callable[[Floats], float]
    gradient: Callable[[Floats], Floats]
    constraints: Callable[[Floats], Floats]
    jacobian: Callable[[Floats], Floats]
    equations: Booleans
    point: Callable[[Floats], dict[str, float]]

    def scaled(self) -> NonlinearForm:
        """The same programme in u = (x − start)/reach, whose numbers are all of order 1.

        The objective and each constraint are divided by their largest derivative at the start, so
        that they have no unit; `point` still gives the unknowns in theirs.
        """
        start, reach = self.start, self.reach
        steepness = _size(self.gradient(start) * reach)
        sizes = _size(self.jacobian(start) * reach)

        def x(u: Floats) -> Floats:
            return np.asarray(start + reach * u)

        return replace(
            self,
            lower=(self.lower - start) / reach,
            upper=(self.upper - start) / reach,
            start=np.zeros_like(start),
            reach=np.ones_like(reach),
            objective=lambda u: self.objective(x(u)) / float(steepness),
            gradient=lambda u: self.gradient(x(u)) * reach / steepness,
            constraints=lambda u: self.constraints(x(u)) / sizes,
            jacobian=lambda u: self.jacobian(x(u)) * reach / sizes[:, None],
            point=lambda u: self.point(x(u)),
        )


def _size(slopes: Floats) -> Floats:
    """Largest derivative of each function; 1 where it has none."""
    sizes = np.abs(slopes).max(axis=-1)
    return np.where(np.isfinite(sizes) & (sizes > 0.0), sizes, 1.0)


def nonlinear_form(model: Model, parameters: Mapping[str, float]) -> NonlinearForm:
    """One programme as functions of a vector.

    Parameters
    ----------
    model
        The declaration.
    parameters
        Values of all its parameters by name, such as ``model.row(0)``.

    Raises
    ------
    InputError
        If a function in it has no derivative.
    """
    names = tuple(variable.name for variable in model.variables)
    rows = [row for row in model.constraints if has_unknowns(*row.relation.sides)]
    goal = -model.sign * model.objective
    gaps = [row.relation.signs[0] * (row.relation.left - row.relation.right) for row in rows]

    def point(x: Floats) -> dict[str, float]:
        return dict(zip(names, map(float, x), strict=True))

    def values(x: Floats, *trees: Operand) -> Floats:
        numbers, done = {**parameters, **point(x)}, dict[int, Operand]()
        return np.array([float(evaluate(tree, numbers, done)) for tree in trees])

    def slopes(x: Floats, *trees: Operand) -> Floats:
        values, done = {**parameters, **point(x)}, dict[int, Operand]()
        rates = [slope(tree, values, done).by for tree in trees]
        table = [[float(by.get(name, 0.0)) for name in names] for by in rates]
        return np.array(table).reshape(len(trees), len(names))

    lower, upper = np.array([*own_bounds(model, parameters).values()]).reshape(-1, 2).T
    start, reach = reaches(model, parameters)
    try:
        slopes(start, goal, *gaps)
    except NotImplementedError as error:
        raise InputError(f"the model has no derivatives: {error}") from error
    return NonlinearForm(
        names,
        tuple(row.label for row in rows),
        lower,
        upper,
        start,
        reach,
        lambda x: float(values(x, goal)[0]),
        lambda x: slopes(x, goal)[0],
        lambda x: values(x, *gaps),
        lambda x: slopes(x, *gaps),
        np.array([row.relation.sense == "==" for row in rows], dtype=bool),
        point,
    )
