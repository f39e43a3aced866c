"""Multipliers, shadow prices and residuals of an answer.

A point is stationary where the slope of the objective is a sum of slopes of the constraints that
hold with equality, with weights λ ≥ 0. There may be several such λ, and endlessly many along rays
where the rows leave no step in some direction; the basic ones and the rays are enumerated.

With L(x, λ, p) = f − Σ λ_k g_k for constraints g_k ≤ 0, the best value v(p) has the one-sided
derivatives v'(p; ±1) = max over optimal x of min over optimal λ of ±∂L/∂p [1]_. Where x and λ are
unique, both sides agree. Where they are not, optimal points and multipliers are enumerated from the
rows that hold with equality; along a ray without end that side is infeasible.

References
----------
.. [1] E. G. Gol'shtein, "Theory of convex programming", AMS, 1972 (marginal values).
.. [2] S. Boyd, L. Vandenberghe, "Convex optimization", Cambridge University Press, 2004, 5.5.3.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats, Values
from optuav.engines.linear_form import implied_upper_bounds, linear_form
from optuav.engines.rows import rows_of, stated_forms
from optuav.modelling.check import Checks, evaluated, relations
from optuav.modelling.expression import Operand, Relation, Variable
from optuav.modelling.forms import NotAffineError, NotExponentialError
from optuav.modelling.model import Model
from optuav.modelling.traversal import Slope, evaluate, slope

ACTIVE = 1e-6
"""Relative slack below which a constraint counts as holding with equality."""
NEGLIGIBLE = 1e-7
"""Multipliers and residuals of stationarity below this share of the largest are zero."""
SAME = 1e-9
"""Relative difference below which two objective values are the same."""
MOST_ROWS = 14
"""Rows that may hold with equality before their combinations are too many to enumerate."""
APART_S = 1e-3
"""Least distance of two points that are not one and the same but for the accuracy of an engine."""


class Active(NamedTuple):
    """Derivatives at a point: of the objective as stated, and of the rows g ≤ 0 that are met there.

    Rows by number of the constraint among `relations` and by sign: an equality gives two.
    """

    objective: Values
    rows: Mapping[tuple[int, float], Values]


def active(model: Model, values: Values) -> Active:
    """Derivatives of the objective, and of the constraints that hold with equality at a point."""
    rows: dict[tuple[int, float], Values] = {}
    done: dict[int, Operand] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for number, relation in enumerate(each.relation for each in stated):
        gap, right = _gap(relation, values, done)
        if np.abs(gap.value) <= ACTIVE * np.maximum(1.0, np.abs(right)):
            for sign in relation.signs:
                rows[number, sign] = {name: sign * rate for name, rate in gap.by.items()}
    return Active(slope(model.objective, values).by, rows)


def _gap(relation: Relation, values: Values, done: dict[int, Operand]) -> tuple[Slope, Operand]:
    """Left side less right side, and the value of the right side."""
    left, right = (slope(side, values, done) for side in relation.sides)
    names = {**left.by, **right.by}
    by = {name: left.by.get(name, 0.0) - right.by.get(name, 0.0) for name in names}
    return Slope(left.value - right.value, by), right.value


def _along(slopes: Iterable[Values], names: Sequence[str]) -> Floats:
    """Derivatives by some names, one row for each of some rows."""
    found = [[float(each.get(name, 0.0)) for name in names] for each in slopes]
    return np.array(found).reshape(-1, len(names))


def local_multipliers(model: Model, values: Values) -> dict[str, float]:
    """Multipliers ≥ 0 of the constraints at a locally optimal point, by label.

    One of them where there are several; empty where the point is not stationary.
    """
    names = [variable.name for variable in model.variables]
    here = active(model, values)
    goal = model.towards * _along([here.objective], names)[0]
    weights = next(basic_multipliers(_along(here.rows.values(), names), goal), np.empty(0))
    stated = list(relations(model))
    found: dict[str, float] = {}
    for (number, turn), weight in zip(here.rows, weights, strict=False):
        label, sense = stated[number].label, stated[number].relation.sense
        found[label] = found.get(label, 0.0) + float(weight) * (turn if sense == "==" else 1.0)
    return found


def basic_multipliers(normals: Floats, goal: Floats) -> Iterator[Floats]:
    """Basic solutions λ ≥ 0 of Σ λ a = c."""
    size = max(1.0, float(np.abs(goal).max(initial=0.0)))
    found: list[Floats] = []
    for rows, unit, lengths in _combinations(normals, range(len(goal) + 1)):
        if rows and np.linalg.matrix_rank(unit, tol=1e-9) < len(rows):
            continue
        weights = np.linalg.lstsq(unit.T, goal, rcond=None)[0] if rows else np.empty(0)
        missed = np.abs(unit.T @ weights - goal).max(initial=0.0)
        if missed > NEGLIGIBLE * size or (weights < -NEGLIGIBLE * size).any():
            continue
        full = np.zeros(len(normals))
        full[rows] = np.maximum(weights, 0.0) / lengths
        if not any(np.allclose(full, other, rtol=1e-9, atol=1e-12) for other in found):
            found.append(full)
            yield full


def rays(normals: Floats) -> Iterator[Floats]:
    """Extreme rays of λ ≥ 0 with Σ λ a = 0: sums of rows that no step can lower."""
    count, size = normals.shape
    yield from np.eye(count)[~normals.any(axis=1)]
    for rows, unit, lengths in _combinations(normals, range(1, size + 2)):
        if np.linalg.matrix_rank(unit, tol=1e-9) != len(rows) - 1:
            continue
        weights = np.linalg.svd(unit.T)[2][-1]
        weights = weights if weights.sum() > 0.0 else -weights
        if (weights > 1e-9).all():
            ray = np.zeros(count)
            ray[rows] = weights / lengths
            yield ray / ray.max()


def _combinations(
    normals: Floats, sizes: Iterable[int]
) -> Iterator[tuple[list[int], Floats, Floats]]:
    """Numbers of rows that are not 0, as many as a size says, with unit normals and lengths."""
    lengths = np.linalg.norm(normals, axis=1)
    moving = np.flatnonzero(lengths).tolist()
    for size in sizes:
        for rows in map(list, itertools.combinations(moving, size)):
            yield rows, normals[rows] / lengths[rows, None], lengths[rows]


def optimal_points(model: Model, parameters: Values, point: Values) -> list[Values]:
    """Optimal points of one programme, with an answer among them.

    Of a linear model all optimal vertices, exact where the answer is one; of the longest of two
    times through both wells the answer, and the one with the longest other time, if that is
    another; else the answer alone.
    """
    try:
        form = linear_form(model, parameters)
    except NotAffineError:
        return _with_longest_other(model, parameters, point)
    a, b, c = form.normals[..., 0], form.limits[..., 0], form.directions[0, :, 0]
    a, b = a[np.isfinite(b)], b[np.isfinite(b)]
    x = np.array([point[name] for name in form.names])
    best, size = float(c @ x), SAME * np.maximum(1.0, np.abs(b))
    found: list[Floats] = []
    few = np.count_nonzero(a.any(axis=1)) <= MOST_ROWS
    for rows, unit, lengths in _combinations(a, [len(x)] if few else []):
        if np.linalg.matrix_rank(unit) < len(x):
            continue
        vertex = np.asarray(np.linalg.solve(unit, b[rows] / lengths), dtype=float)
        if (a @ vertex - b > size).any() or abs(c @ vertex - best) > SAME * max(1.0, abs(best)):
            continue
        if not any(np.allclose(vertex, other, rtol=1e-9, atol=1e-9) for other in found):
            found.append(vertex)
    if not any(np.allclose(x, vertex, rtol=1e-6, atol=1e-6) for vertex in found):
        found.append(x)
    return [dict(zip(form.names, each.tolist(), strict=True)) for each in found]


def _with_longest_other(model: Model, parameters: Values, point: Values) -> list[Values]:
    """An answer through both wells, and the one with the longest other time, if it is another."""
    others = [each.name for each in model.variables if each is not model.objective]
    if not isinstance(model.objective, Variable) or len(others) != 1:
        return [point]
    (other,), goal = others, model.objective.name
    top = implied_upper_bounds(model, parameters, {**point, other: 0.0})[other]
    try:
        rows = rows_of(stated_forms(model, parameters), goal, other, 1, max(top, point[goal]))
    except NotExponentialError:
        return [point]
    longest = rows.at_x(np.array([point[goal]])).end(np.array([top]))[0]
    if np.isnan(longest) or longest - point[other] < APART_S:
        return [point]
    return [point, {**point, other: float(longest)}]


class ShadowPrice(NamedTuple):
    """Change of the best objective per unit of a parameter, the others held.

    Parameters
    ----------
    less, more
        Per unit that is taken away, and per unit that is added. They differ at a kink, as where
        another constraint takes over; infinite where that side is infeasible.
    """

    less: float
    more: float

    @property
    def has_kink(self) -> bool:
        """Whether the two sides differ."""
        return not math.isclose(self.less, self.more, rel_tol=1e-6, abs_tol=1e-9)


def shadow_prices(model: Model, parameters: Values, point: Values) -> dict[str, ShadowPrice]:
    """Shadow price of every parameter at an optimal point.

    Empty where there are no multipliers, or too many rows hold with equality to enumerate them.
    """
    sign = model.towards
    points = optimal_points(model, parameters, point)
    local = [active(model, {**parameters, **each}) for each in points]
    names = [variable.name for variable in model.variables]
    rows = [key for key in local[0].rows if all(key in each.rows for each in local)]
    normals = _along([local[0].rows[key] for key in rows], names)
    if np.count_nonzero(normals.any(axis=1)) > MOST_ROWS:
        return {}
    goal = sign * _along([local[0].objective], names)[0]
    multipliers, endless = list(basic_multipliers(normals, goal)), list(rays(normals))
    if not multipliers:
        return {}
    prices = {}
    for name in model.parameters:
        more, less = -np.inf, np.inf
        size = NEGLIGIBLE / max(1.0, abs(float(parameters[name])))
        for each in local:
            gain = sign * float(each.objective.get(name, 0.0))
            growth = _along([each.rows[key] for key in rows], [name])[:, 0]
            rates = [gain - float(weights @ growth) for weights in multipliers]
            blocked = [float(ray @ growth) for ray in endless]
            if not any(amount > size for amount in blocked):
                more = max(more, min(rates))
            if not any(amount < -size for amount in blocked):
                less = min(less, max(rates))
        prices[name] = ShadowPrice(float(sign * less), float(sign * more))
    return prices


class Residuals(NamedTuple):
    """By how much an answer misses the conditions of optimality; 0 where it meets them.

    The violation is relative to max(1, |right side|). The last three are NaN from engines without
    multipliers: the most negative multiplier of an inequality; the largest product of a multiplier
    and its slack; and the largest slope of the Lagrangian along an unknown, in units of the
    objective per unit of the unknown.
    """

    violation: float
    sign: float = math.nan
    complementarity: float = math.nan
    stationarity: float = math.nan


def residuals(model: Model, values: Values, multipliers: Mapping[str, float]) -> Residuals:
    """By how much a point and its multipliers miss the conditions of optimality.

    Values of unknowns and parameters by name, multipliers by label, of equalities signed.
    """
    rows = evaluated(model, values)
    if not multipliers or any(map(math.isnan, multipliers.values())):
        return Residuals(_violation(rows))
    negative, products, slopes = [0.0], [0.0], [0.0]
    done: dict[int, Operand] = {}
    steepness = {k: model.towards * v for k, v in slope(model.objective, values, done).by.items()}
    for constraint, row in zip(model.constraints, rows, strict=False):
        weight, relation = multipliers.get(constraint.label, 0.0), constraint.relation
        products.append(abs(weight * row.slack))
        negative.append(0.0 if relation.sense == "==" else -weight)
        gap, _ = _gap(relation, values, done)
        for name, rate in gap.by.items():
            steepness[name] = steepness.get(name, 0.0) - weight * relation.signs[0] * rate
    for variable in model.variables:
        weight, x = multipliers.get(variable.label, 0.0), values[variable.name]
        below, above = (
            abs(x - evaluate(bound, values)) for bound in (variable.lower, variable.upper)
        )
        nearer = min(below, above)
        # Both bounds share a multiplier: it pushes away from the nearer one.
        pushes = ([weight] if below == nearer else []) + ([-weight] if above == nearer else [])
        negative.append(-weight)
        products.append(weight * nearer if weight else 0.0)
        slopes.append(min(abs(steepness.get(variable.name, 0.0) + push) for push in pushes))
    return Residuals(_violation(rows), *map(_largest, (negative, products, slopes)))


def _violation(rows: Checks) -> float:
    return _largest([0.0, *(-row.slack / max(1.0, abs(row.right)) for row in rows)])


def _largest(amounts: Sequence[Operand]) -> float:
    """The largest of some amounts; NaN where one is NaN, and 0 without a sign."""
    return float(np.max(amounts)) + 0.0
