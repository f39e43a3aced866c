"""Shadow prices: what one more unit of a parameter brings, from the Lagrangian.

With L(x, λ, p) = f − Σ λ_k g_k for constraints g_k ≤ 0, the best value v(p) has the one-sided
derivatives v'(p; ±1) = max over optimal x of min over optimal λ of ±∂L/∂p. Where x and λ are
unique both sides agree; where they are not, the two sides are told apart: optimal points and
multipliers are then enumerated from the rows that hold with equality. Rows that leave no step in
some direction have multipliers without end, along rays: there that side is infeasible.

References
----------
.. [1] E. G. Gol'shtein, "Theory of convex programming", AMS, 1972 (marginal values).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from optuav.engines.multipliers import (
    NEGLIGIBLE,
    Point,
    active,
    along,
    basic_multipliers,
    nearly,
    rays,
)
from optuav.engines.optimal_points import MOST_ROWS, optimal_points
from optuav.modelling.check import relations
from optuav.modelling.derivatives import slope
from optuav.modelling.model import Model
from optuav.modelling.traversal import has_unknowns


class ShadowPrice(NamedTuple):
    """Change of the best objective per unit of a parameter, the others held.

    Parameters
    ----------
    less, more
        One-sided derivatives: per unit that is taken away, and per unit that is added. They are
        equal but at a kink, as where another constraint takes over; infinite where that side is
        infeasible.
    """

    less: float
    more: float

    @property
    def has_kink(self) -> bool:
        """Whether the two sides differ."""
        return not math.isclose(self.less, self.more, rel_tol=1e-6, abs_tol=1e-9)


def prices_of(
    model: Model, parameters: Point, point: Point, multipliers: Mapping[str, Any]
) -> dict[str, tuple[Any, Any]]:
    """Both sides of the price of every parameter where point and multipliers are the only ones.

    Parameters
    ----------
    model
        The declaration.
    parameters
        Values by name of those that differ from the model's.
    point
        Values of the unknowns by name.
    multipliers
        Of the constraints, by label; like the others numbers, or arrays over programmes.
    """
    rates = _rates(model, {**parameters, **point}, multipliers)
    return _with_edges(model, parameters, {name: (rate, rate) for name, rate in rates.items()})


def prices_at_a_kink(model: Model, parameters: Point, point: Point) -> dict[str, tuple[Any, Any]]:
    """Both sides of the price of every parameter at an optimal point, whatever the multipliers.

    Empty where there are none, or too many rows hold with equality to enumerate them.
    """
    found = _one_sided(model, parameters, optimal_points(model, parameters, point))
    return _with_edges(model, parameters, found)


def _with_edges(
    model: Model, parameters: Point, prices: dict[str, tuple[Any, Any]]
) -> dict[str, tuple[Any, Any]]:
    """Prices that are infinite on the sides where nothing is feasible, whatever the unknowns do.

    Of parameters in a constraint without unknowns that holds with equality.
    """
    worse = -np.inf * model.towards
    for constraint in model.constraints:
        relation = constraint.relation
        if has_unknowns(*relation.sides):
            continue
        left, right = slope(relation.left, parameters), slope(relation.right, parameters)
        met = nearly(left.value, right.value)
        for name in prices.keys() & {**left.by, **right.by}.keys():
            growth = met * (left.by.get(name, 0.0) - right.by.get(name, 0.0))
            up, down = growth > 0.0, growth < 0.0
            blocked = {"<=": (down, up), ">=": (up, down), "==": (up | down, up | down)}
            no_less, no_more = blocked[relation.sense]
            less, more = prices[name]
            prices[name] = np.where(no_less, -worse, less)[()], np.where(no_more, worse, more)[()]
    return prices


def _rates(model: Model, values: Point, multipliers: Mapping[str, Any]) -> dict[str, Any]:
    """∂L/∂p at a point with the given multipliers, by name of the parameter."""
    objective = slope(model.objective, values)
    sign = model.towards
    rates: dict[str, Any] = {name: objective.by.get(name, 0.0) for name in model.parameters}
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for constraint in stated:
        weight = multipliers.get(constraint.label, 0.0)
        if not np.any(weight):
            continue
        relation = constraint.relation
        left, right = (slope(side, values, done) for side in relation.sides)
        if not (left.by.keys() | right.by.keys()) & rates.keys():
            continue
        # Both bounds of an unknown share a label: the weight belongs to the one that is met.
        weight = sign * np.where(nearly(left.value, right.value), weight, 0.0)
        turn = -1.0 if relation.sense == ">=" else 1.0
        for side, direction in ((left, turn), (right, -turn)):
            for name, derivative in side.by.items():
                if name in rates:
                    rates[name] = rates[name] - weight * direction * derivative
    return rates


def _one_sided(model: Model, parameters: Point, points: list[Point]) -> dict[str, tuple[Any, Any]]:
    """Both derivatives from all optimal points and multipliers."""
    sign = model.towards
    local = [active(model, {**parameters, **point}) for point in points]
    names = [variable.name for variable in model.variables]
    common = set.intersection(*(set(each.rows) for each in local))
    rows = [key for key in local[0].rows if key in common]
    if len(rows) > MOST_ROWS:
        return {}
    normals = along([local[0].rows[key] for key in rows], names)
    goal = sign * along([local[0].objective], names)[0]
    multipliers = list(basic_multipliers(normals, goal))
    if not multipliers:
        return {}
    endless = list(rays(normals))
    prices = {}
    for name in model.parameters:
        more, less = -np.inf, np.inf
        size = NEGLIGIBLE / max(1.0, abs(float(parameters[name])))
        for each in local:
            gain = sign * float(each.objective.by.get(name, 0.0))
            growth = along([each.rows[key] for key in rows], [name])[:, 0]
            rates = [gain - float(weights @ growth) for weights in multipliers]
            blocked = [float(ray @ growth) for ray in endless]
            if not any(amount > size for amount in blocked):
                more = max(more, min(rates))
            if not any(amount < -size for amount in blocked):
                less = min(less, max(rates))
        prices[name] = float(sign * less), float(sign * more)
    return prices
