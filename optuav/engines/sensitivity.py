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

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.engines.linear_form import linear_form
from optuav.engines.solution import Floats, ShadowPrice, Solution
from optuav.modelling.affine import NotAffineError
from optuav.modelling.check import relations
from optuav.modelling.derivative import Slope, slope
from optuav.modelling.expression import Variable, leaves
from optuav.modelling.model import Model

Point = Mapping[str, Any]
ACTIVE = 1e-6
"""Relative slack below which a constraint counts as holding with equality."""
NEGLIGIBLE = 1e-7
"""Multipliers and residuals of stationarity below this share of the largest are zero."""
SAME = 1e-9
"""Relative difference below which two objective values are the same."""
MOST_ROWS = 14
"""Rows that may hold with equality before their combinations are too many to enumerate."""


def shadow_prices(solution: Solution, index: int) -> dict[str, ShadowPrice]:
    """Shadow price of every parameter of a programme, in objective per unit of the parameter.

    Parameters
    ----------
    solution
        An answer with multipliers.
    index
        Number of the programme.
    """
    model = solution.model
    if model is None or not solution.multipliers or not solution.statuses[index].has_answer:
        return {}
    parameters = {**model.row(index), **solution.given_at(index)}
    point = solution.point(index)
    if solution.regular is not None and solution.regular[index]:
        rates = _rates(model, {**parameters, **point}, solution.multipliers_at(index))
        prices = {name: ShadowPrice(float(rate), float(rate)) for name, rate in rates.items()}
    else:
        prices = _one_sided(model, parameters, _optimal_points(model, parameters, point))
    worse = _worse(model)
    for name, (less, more) in _at_the_edge(model, parameters).items():
        if name in prices:
            price = prices[name]
            prices[name] = ShadowPrice(
                -worse if less else price.less, worse if more else price.more
            )
    return prices


def all_shadow_prices(solution: Solution) -> dict[str, tuple[Floats, Floats]]:
    """Shadow prices of all programmes at once: by name, arrays of `less` and of `more`.

    NaN where a programme has no answer.
    """
    model = solution.model
    if model is None or not solution.multipliers or solution.regular is None:
        return {}
    multipliers = solution.multipliers.items()
    weights = {label: np.where(np.isnan(each), 0.0, each) for label, each in multipliers}
    rates = _rates(model, {**solution.given, **solution.values}, weights)
    count = len(solution.statuses)
    found = {name: np.array(np.broadcast_to(rate, count), float) for name, rate in rates.items()}
    edges = _at_the_edge(model, solution.given)
    worse, never = _worse(model), (False, False)
    prices = {
        name: (
            np.where(edges.get(name, never)[0], -worse, rate),
            np.where(edges.get(name, never)[1], worse, rate),
        )
        for name, rate in found.items()
    }
    for index in np.flatnonzero(~solution.regular):
        single = shadow_prices(solution, int(index))
        for name, (less, more) in prices.items():
            price = single.get(name, ShadowPrice(np.nan, np.nan))
            less[index], more[index] = price.less, price.more
    return prices


def _worse(model: Model) -> float:
    """The best value of an infeasible programme."""
    return -np.inf if model.sense == "maximise" else np.inf


def _at_the_edge(model: Model, values: Point) -> dict[str, tuple[Any, Any]]:
    """Of parameters: whether less, and whether more, is infeasible whatever the unknowns do.

    They stand in a constraint without unknowns that holds with equality.
    """
    found: dict[str, tuple[Any, Any]] = {}
    for constraint in model.constraints:
        relation = constraint.relation
        if any(isinstance(leaf, Variable) for leaf in leaves(relation.left, relation.right)):
            continue
        left, right = slope(relation.left, values), slope(relation.right, values)
        met = np.abs(left.value - right.value) <= ACTIVE * np.maximum(1.0, np.abs(right.value))
        for name in {**left.by, **right.by}:
            growth = met * (left.by.get(name, 0.0) - right.by.get(name, 0.0))
            less, more = found.get(name, (False, False))
            if relation.sense in ("<=", "=="):
                less, more = less | (growth < 0.0), more | (growth > 0.0)
            if relation.sense in (">=", "=="):
                less, more = less | (growth > 0.0), more | (growth < 0.0)
            found[name] = less, more
    return found


def _rates(model: Model, values: Point, multipliers: Mapping[str, Any]) -> dict[str, Any]:
    """∂L/∂p at a point with the given multipliers, by name of the parameter."""
    objective = slope(model.objective, values)
    sign = 1.0 if model.sense == "maximise" else -1.0
    rates: dict[str, Any] = {name: objective.by.get(name, 0.0) for name in model.parameters}
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for constraint in stated:
        weight = multipliers.get(constraint.label, 0.0)
        if not np.any(weight):
            continue
        relation = constraint.relation
        left, right = (slope(side, values, done) for side in (relation.left, relation.right))
        if not (left.by.keys() | right.by.keys()) & rates.keys():
            continue
        # Both bounds of an unknown share a label: the weight belongs to the one that is met.
        met = np.abs(left.value - right.value) <= ACTIVE * np.maximum(1.0, np.abs(right.value))
        weight = sign * np.where(met, weight, 0.0)
        turn = -1.0 if relation.sense == ">=" else 1.0
        for side, direction in ((left, turn), (right, -turn)):
            for name, derivative in side.by.items():
                if name in rates:
                    rates[name] = rates[name] - weight * direction * derivative
    return rates


def _optimal_points(model: Model, parameters: Point, point: Point) -> list[Point]:
    """The answer, and for a linear model the vertices that are as good; exact where it is one."""
    try:
        form = linear_form(model, parameters)
    except NotAffineError:
        return [point]
    a, b, c = form.normals[..., 0], form.limits[..., 0], form.directions[0, :, 0]
    x = np.array([point[name] for name in form.names])
    best = float(c @ x)
    finite = np.flatnonzero(np.isfinite(b) & (a != 0.0).any(axis=1))
    found: list[Floats] = []
    if len(finite) <= MOST_ROWS:
        for rows in itertools.combinations(finite.tolist(), len(x)):
            square = a[list(rows)]
            if np.linalg.matrix_rank(square / np.linalg.norm(square, axis=1)[:, None]) < len(x):
                continue
            vertex = np.asarray(np.linalg.solve(square, b[list(rows)]), dtype=float)
            size = np.maximum(1.0, np.abs(b[finite]))
            if ((a[finite] @ vertex - b[finite]) > SAME * size).any():
                continue
            if abs(float(c @ vertex) - best) > SAME * max(1.0, abs(best)):
                continue
            if not any(np.allclose(vertex, other, rtol=1e-9, atol=1e-9) for other in found):
                found.append(vertex)
    if not any(np.allclose(x, vertex, rtol=1e-6, atol=1e-6) for vertex in found):
        found.append(x)
    return [dict(zip(form.names, each.tolist(), strict=True)) for each in found]


def _one_sided(model: Model, parameters: Point, points: list[Point]) -> dict[str, ShadowPrice]:
    """Both derivatives from all optimal points and multipliers."""
    sign = 1.0 if model.sense == "maximise" else -1.0
    local = [_active(model, {**parameters, **point}) for point in points]
    names = [variable.name for variable in model.variables]
    common = set.intersection(*(set(each.rows) for each in local))
    labels = [key for key in local[0].rows if key in common]
    normals = np.array(
        [[float(local[0].rows[key].by.get(name, 0.0)) for name in names] for key in labels]
    ).reshape(len(labels), len(names))
    goal = sign * np.array([float(local[0].objective.by.get(name, 0.0)) for name in names])
    if len(labels) > MOST_ROWS:
        return {}
    multipliers = list(_basic_multipliers(normals, goal))
    if not multipliers:
        return {}
    rays = list(_rays(normals))
    prices = {}
    for name in model.parameters:
        more, less = -np.inf, np.inf
        size = NEGLIGIBLE / max(1.0, abs(float(parameters[name])))
        for each in local:
            gain = sign * float(each.objective.by.get(name, 0.0))
            growth = np.array([float(each.rows[key].by.get(name, 0.0)) for key in labels])
            rates = [gain - float(weights @ growth) for weights in multipliers]
            blocked = [float(ray @ growth) for ray in rays]
            if not any(amount > size for amount in blocked):
                more = max(more, min(rates))
            if not any(amount < -size for amount in blocked):
                less = min(less, max(rates))
        prices[name] = ShadowPrice(less=float(sign * less), more=float(sign * more))
    return prices


def local_multipliers(model: Model, values: Point) -> dict[str, float]:
    """Multipliers ≥ 0 of the constraints at a locally optimal point, by label.

    One of them where there are several; empty where the point is not stationary.
    """
    names = [variable.name for variable in model.variables]
    active = _active(model, values)
    normals = np.array([[float(row.by.get(n, 0.0)) for n in names] for row in active.rows.values()])
    sign = 1.0 if model.sense == "maximise" else -1.0
    goal = sign * np.array([float(active.objective.by.get(name, 0.0)) for name in names])
    stated = list(relations(model))
    weights = next(_basic_multipliers(normals.reshape(-1, len(names)), goal), np.empty(0))
    found: dict[str, float] = {}
    for (number, turn), weight in zip(active.rows, weights, strict=False):
        relation = stated[number].relation
        signed = turn * float(weight) if relation.sense == "==" else float(weight)
        found[stated[number].label] = found.get(stated[number].label, 0.0) + signed
    return found


@dataclass(frozen=True)
class _Active:
    """Slopes at a point: of the objective, and of the constraints that hold with equality."""

    objective: Slope
    rows: Mapping[tuple[int, float], Slope]


def _active(model: Model, values: Point) -> _Active:
    rows: dict[tuple[int, float], Slope] = {}
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for number, constraint in enumerate(stated):
        relation = constraint.relation
        left, right = (slope(side, values, done) for side in (relation.left, relation.right))
        if abs(left.value - right.value) > ACTIVE * max(1.0, abs(float(right.value))):
            continue
        for turn in {"<=": (1.0,), ">=": (-1.0,), "==": (1.0, -1.0)}[relation.sense]:
            by = {
                name: turn * (left.by.get(name, 0.0) - right.by.get(name, 0.0))
                for name in {**left.by, **right.by}
            }
            if any(name in by for name in (variable.name for variable in model.variables)):
                rows[number, turn] = Slope(turn * (left.value - right.value), by)
    return _Active(slope(model.objective, values), rows)


def _basic_multipliers(normals: Floats, goal: Floats) -> Iterator[Floats]:
    """Basic solutions λ ≥ 0 of Σ λ a = c."""
    count = len(normals)
    size = max(1.0, float(np.abs(goal).max(initial=0.0)))
    lengths = np.linalg.norm(normals, axis=1)
    found: list[Floats] = []
    for chosen in itertools.chain.from_iterable(
        itertools.combinations(range(count), k) for k in range(len(goal) + 1)
    ):
        rows = list(chosen)
        if (lengths[rows] == 0.0).any():
            continue
        unit = normals[rows] / lengths[rows, None]
        if rows and np.linalg.matrix_rank(unit, tol=1e-9) < len(rows):
            continue
        weights = np.linalg.lstsq(unit.T, goal, rcond=None)[0] if rows else np.empty(0)
        if np.abs(unit.T @ weights - goal).max(initial=0.0) > NEGLIGIBLE * size:
            continue
        if (weights < -NEGLIGIBLE * size).any():
            continue
        full = np.zeros(count)
        full[rows] = np.maximum(weights, 0.0) / lengths[rows]
        if not any(np.allclose(full, other, rtol=1e-9, atol=1e-12) for other in found):
            found.append(full)
            yield full


def _rays(normals: Floats) -> Iterator[Floats]:
    """Extreme rays of λ ≥ 0 with Σ λ a = 0: sums of rows that no step can lower."""
    count, size = normals.shape
    lengths = np.linalg.norm(normals, axis=1)
    for chosen in itertools.chain.from_iterable(
        itertools.combinations(range(count), k) for k in range(1, size + 2)
    ):
        rows = list(chosen)
        idle = lengths[rows] == 0.0
        if idle.any():
            if len(rows) == 1:
                yield np.eye(count)[rows[0]]
            continue
        unit = normals[rows] / lengths[rows, None]
        if np.linalg.matrix_rank(unit, tol=1e-9) != len(rows) - 1:
            continue
        weights = np.linalg.svd(unit.T)[2][-1]
        weights = weights if weights.sum() > 0.0 else -weights
        if (weights > 1e-9).all():
            ray = np.zeros(count)
            ray[rows] = weights / lengths[rows]
            yield ray / ray.max()
