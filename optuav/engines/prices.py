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
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Floats, Values
from optuav.engines.linear_form import LinearForm, linear_form
from optuav.engines.ranges import implied_upper_bounds
from optuav.engines.rows import rows_of, stated_forms
from optuav.modelling.check import Checks, evaluated, relations
from optuav.modelling.expression import Operand, Relation, Variable
from optuav.modelling.forms import NotAffineError, NotExponentialError
from optuav.modelling.model import Model
from optuav.modelling.traversal import Slope, evaluate, has_unknowns, slope

Point: TypeAlias = Values
Price: TypeAlias = tuple[Operand, Operand]
"""Both sides of a shadow price, of one programme or arrays over several."""
ACTIVE = 1e-6
"""Relative slack below which a constraint counts as holding with equality."""
NEGLIGIBLE = 1e-7
"""Multipliers and residuals of stationarity below this share of the largest are zero."""


class Active(NamedTuple):
    """Slopes at a point: of the objective as stated, and of the rows g ≤ 0 that are met there.

    Rows by number of the constraint among `relations` and by sign: an equality gives two.
    """

    objective: Slope
    rows: Mapping[tuple[int, float], Slope]


def active(model: Model, values: Point) -> Active:
    """Slopes of the constraints of the unknowns that hold with equality at a point."""
    unknowns = {variable.name for variable in model.variables}
    rows: dict[tuple[int, float], Slope] = {}
    done: dict[int, Operand] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for number, constraint in enumerate(stated):
        gap, met = _gap(constraint.relation, values, done)
        if np.all(met) and unknowns & gap.by.keys():
            for sign in constraint.relation.signs:
                by = {name: sign * rate for name, rate in gap.by.items()}
                rows[number, sign] = Slope(sign * gap.value, by)
    return Active(slope(model.objective, values), rows)


def _gap(
    relation: Relation, values: Point, done: dict[int, Operand] | None = None
) -> tuple[Slope, Operand]:
    """Left side less right side, and whether they count as equal."""
    left, right = (slope(side, values, done) for side in relation.sides)
    names = {**left.by, **right.by}
    by = {name: left.by.get(name, 0.0) - right.by.get(name, 0.0) for name in names}
    return Slope(left.value - right.value, by), nearly(left.value, right.value)


def nearly(left: Operand, right: Operand) -> Operand:
    """Whether the sides of a constraint count as equal."""
    return np.abs(left - right) <= ACTIVE * np.maximum(1.0, np.abs(right))


def along(slopes: Iterable[Slope], names: Sequence[str]) -> Floats:
    """Derivatives by some names, one row a slope."""
    found = [[float(each.by.get(name, 0.0)) for name in names] for each in slopes]
    return np.array(found).reshape(-1, len(names))


def local_multipliers(model: Model, values: Point) -> dict[str, float]:
    """Multipliers ≥ 0 of the constraints at a locally optimal point, by label.

    One of them where there are several; empty where the point is not stationary.
    """
    names = [variable.name for variable in model.variables]
    here = active(model, values)
    goal = model.towards * along([here.objective], names)[0]
    weights = next(basic_multipliers(along(here.rows.values(), names), goal), np.empty(0))
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


SAME = 1e-9
"""Relative difference below which two objective values are the same."""
MOST_ROWS = 14
"""Rows that may hold with equality before their combinations are too many to enumerate."""
APART_S = 1e-3
"""Least distance of two points that are not one and the same but for the accuracy of an engine."""


def optimal_points(model: Model, parameters: Point, point: Point) -> list[Point]:
    """Optimal points of one programme, with an answer among them.

    Of a linear model all optimal vertices, exact where the answer is one; of the longest of two
    times through both wells the answer, and the one with the longest other time, if that is
    another; else the answer alone.
    """
    try:
        form = linear_form(model, parameters)
    except NotAffineError:
        return _with_longest_other(model, parameters, point)
    return _vertices(form, point)


def _vertices(form: LinearForm, point: Point) -> list[Point]:
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


def _with_longest_other(model: Model, parameters: Point, point: Point) -> list[Point]:
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


def prices_of(
    model: Model, parameters: Point, point: Point, multipliers: Values
) -> dict[str, Price]:
    """Both sides of the price of every parameter where point and multipliers are unique.

    Values by name, multipliers by label; numbers, or arrays over programmes.
    """
    rates = _rates(model, {**parameters, **point}, multipliers)
    return _with_edges(model, parameters, {name: (rate, rate) for name, rate in rates.items()})


def prices_at_a_kink(model: Model, parameters: Point, point: Point) -> dict[str, Price]:
    """Both sides of the price of every parameter at an optimal point, whatever the multipliers.

    Empty where there are none, or too many rows hold with equality to enumerate them.
    """
    found = _one_sided(model, parameters, optimal_points(model, parameters, point))
    return _with_edges(model, parameters, found)


def _with_edges(model: Model, parameters: Point, prices: dict[str, Price]) -> dict[str, Price]:
    """Prices that are infinite on the sides where nothing is feasible, whatever the unknowns do.

    Of parameters in a constraint without unknowns that holds with equality.
    """
    worse = -np.inf * model.towards
    for constraint in model.constraints:
        relation = constraint.relation
        if has_unknowns(*relation.sides):
            continue
        gap, met = _gap(relation, parameters)
        for name in prices.keys() & gap.by.keys():
            growth = met * gap.by[name]
            up, down = growth > 0.0, growth < 0.0
            blocked = {"<=": (down, up), ">=": (up, down), "==": (up | down, up | down)}
            no_less, no_more = blocked[relation.sense]
            less, more = prices[name]
            prices[name] = np.where(no_less, -worse, less)[()], np.where(no_more, worse, more)[()]
    return prices


def _rates(model: Model, values: Point, multipliers: Values) -> dict[str, Operand]:
    """∂L/∂p at a point with the given multipliers, by name of the parameter."""
    objective = slope(model.objective, values)
    sign = model.towards
    rates: dict[str, Operand] = {name: objective.by.get(name, 0.0) for name in model.parameters}
    done: dict[int, Operand] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for constraint in stated:
        weight = multipliers.get(constraint.label, 0.0)
        if not np.any(weight):
            continue
        gap, met = _gap(constraint.relation, values, done)
        # Both bounds of an unknown share a label: the weight belongs to the one that is met.
        weight = sign * constraint.relation.signs[0] * np.where(met, weight, 0.0)
        for name in rates.keys() & gap.by.keys():
            rates[name] = rates[name] - weight * gap.by[name]
    return rates


def _one_sided(model: Model, parameters: Point, points: list[Point]) -> dict[str, Price]:
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
