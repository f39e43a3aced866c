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
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats, Values
from optuav.engines.linear_form import implied_upper_bounds, linear_form
from optuav.engines.rows import rows_of, stated_forms
from optuav.frames import DataFrame, frame
from optuav.modelling.check import CONSTRAINT_TOLERANCE, evaluated, relations
from optuav.modelling.expression import Operand, Parameter, Relation
from optuav.modelling.forms import NotAffineError, NotExponentialError
from optuav.modelling.model import Model
from optuav.modelling.traversal import Slope, evaluate, leaves, slope
from optuav.presentation.blocks import Block, Table
from optuav.presentation.numbers import figure
from optuav.presentation.presented import Presented

MET, NEARLY_MET = 1e-8, 1e-6
"""Share of its largest term below which a row counts as met, in exact and in other answers."""
NEGLIGIBLE = 1e-7  # Share of the largest below which multipliers and their residuals are zero
SAME_VALUE = 1e-9
"""Difference of equal values of the objective as a share of them, and of terms that cancel."""
ROUNDED = 1e-14  # Share of a vertex's largest unknown below which another is 0, but for rounding
MOST_ROWS = 14  # Rows that hold with equality, before their combinations are too many to enumerate
BESIDE = 1e-150  # Distance from 0, and from its kinks, where functions have a slope
APART_S = 1e-3  # Least distance of points that are not one but for the accuracy of an engine


def _rate(of: Slope, names: Sequence[str]) -> Floats:
    """Derivatives by some names."""
    return np.array([float(of.by.get(name, 0.0)) for name in names])


def _gap(relation: Relation, values: Values, done: dict[int, Operand]) -> tuple[Slope, Slope]:
    """Left side less right side, and the right side."""
    left, right = (slope(side, values, done) for side in relation.sides)
    by = {name: left.by.get(name, 0.0) - right.by.get(name, 0.0) for name in {*left.by, *right.by}}
    return Slope(left.value - right.value, by), right


def _met(
    model: Model, values: Values, names: Sequence[str], share: float = NEARLY_MET
) -> dict[tuple[int, float], Floats]:
    """Derivatives by some names of the rows g ≤ 0 that hold with equality at a point.

    By number of the constraint among `relations` and by sign: an equality gives two.
    """
    rows, done = dict[tuple[int, float], Floats](), dict[int, Operand]()
    count = len(model.variables)
    sizes = np.array([max(abs(values[name]), k < count) for k, name in enumerate(names)], float)
    constraints = list(relations(model))  # kept, so that no two nodes share an identity
    for number, relation in enumerate(constraint.relation for constraint in constraints):
        gap, right = _gap(relation, values, done)
        rate = _rate(gap, names)
        allowance = CONSTRAINT_TOLERANCE * np.maximum(1.0, np.abs(right.value))
        least = (not rate[:count].any()) * allowance
        if np.abs(gap.value) <= np.max(share * np.abs(rate) * sizes, initial=least):
            rows |= {(number, sign): sign * rate for sign in relation.signs}
    return rows


def local_multipliers(model: Model, values: Values) -> dict[str, float]:
    """Multipliers ≥ 0 of the constraints at a locally optimal point, by label.

    One of them where there are several; empty where the point is not stationary.
    """
    names = [variable.name for variable in model.variables]
    goal, rows = _rate(slope(model.objective, values), names), _met(model, values, names)
    normals = np.array([*rows.values()]).reshape(-1, len(names))
    weights = next(basic_multipliers(normals, model.sign * goal), np.empty(0))
    constraints = list(relations(model))
    by_label: dict[str, float] = {}
    for (number, turn), weight in zip(rows, weights.tolist(), strict=False):
        label, sense = constraints[number].label, constraints[number].relation.sense
        by_label[label] = by_label.get(label, 0.0) + weight * (turn if sense == "==" else 1.0)
    return by_label


def basic_multipliers(normals: Floats, goal: Floats) -> Iterator[Floats]:
    """Basic solutions λ ≥ 0 of Σ λ a = c."""
    size = float(np.abs(goal).max(initial=0.0))
    multipliers: list[Floats] = []
    for rows, unit, lengths in _combinations(normals, range(len(goal) + 1)):
        if rows and np.linalg.matrix_rank(unit, tol=1e-9) < len(rows):
            continue
        weights = np.linalg.lstsq(unit.T, goal, rcond=None)[0] if rows else np.empty(0)
        missed = np.abs(unit.T @ weights - goal).max(initial=0.0)
        if missed > NEGLIGIBLE * size or (weights < -NEGLIGIBLE * size).any():
            continue
        full = np.zeros(len(normals))
        full[rows] = np.maximum(weights, 0.0) / lengths
        if not any(np.allclose(full, other, rtol=1e-9, atol=1e-12 * size) for other in multipliers):
            multipliers.append(full)
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


def optimal_points(model: Model, parameters: Values, point: Values) -> list[list[Values]]:
    """Sets of optimal points of one programme; a later one counts if an earlier one has no prices.

    For a linear model: all optimal vertices, and the answer if it is not among them. For the
    longest of two times through both wells: the answer, with the optimum of the longest other time;
    then only that, as an answer is not exact where the other time hardly matters. Otherwise only
    the answer.
    """
    try:
        form = linear_form(model, parameters)
    except NotAffineError:
        return _with_longest_other(model, parameters, point)
    a, b, c = form.normals[..., 0], form.limits[..., 0], form.directions[0, :, 0]
    a, b = a[np.isfinite(b)], b[np.isfinite(b)]
    x = np.array([point[name] for name in form.names])
    best, size = float(c @ x), SAME_VALUE * np.maximum(1.0, np.abs(b))
    close = SAME_VALUE * max(np.abs(c).max(initial=0.0), abs(best))
    vertices: list[Floats] = []
    few = np.count_nonzero(a.any(axis=1)) <= MOST_ROWS
    for rows, unit, lengths in _combinations(a, [len(x)] if few else []):
        if np.linalg.matrix_rank(unit) < len(x):
            continue
        vertex = np.asarray(np.linalg.solve(unit, b[rows] / lengths), dtype=float)
        vertex[np.abs(vertex) <= ROUNDED * np.abs(vertex).max(initial=0.0)] = 0.0
        if (a @ vertex - b > size).any() or abs(c @ vertex - best) > close:
            continue
        if not any(np.allclose(vertex, other, rtol=1e-9, atol=1e-9) for other in vertices):
            vertices.append(vertex)
    if not any(np.allclose(x, vertex, rtol=1e-6, atol=1e-6) for vertex in vertices):
        vertices.append(x)
    return [[dict(zip(form.names, row.tolist(), strict=True)) for row in vertices]]


def _with_longest_other(model: Model, parameters: Values, point: Values) -> list[list[Values]]:
    """An answer through both wells, and the one with the longest time beside the objective's."""
    held = {leaf.name for leaf in leaves(model.objective)}
    unknowns = sorted((variable.name not in held, variable.name) for variable in model.variables)
    if [other for other, _ in unknowns] != [False, True]:
        return [[point]]
    goal, other = (name for _, name in unknowns)
    top = implied_upper_bounds(model, parameters, {**point, other: 0.0})[other]
    try:
        reach_s = np.array([max(top, point[goal])])
        rows = rows_of(stated_forms(model, parameters), (goal, other), reach_s)
    except NotExponentialError:
        return [[point]]
    rows.weights[0] += CONSTRAINT_TOLERANCE  # Rounding ends no time that may be of any length
    longest_s = float(rows.at_x(np.array([point[goal]])).end(np.array([top]))[0])
    if math.isnan(longest_s):
        return [[point]]
    last = {**point, other: longest_s}
    return [[point, last] if longest_s - point[other] >= APART_S else [point], [last]]


class ShadowPrice(NamedTuple):
    """Change of the best objective per unit of a parameter, the others held.

    Parameters
    ----------
    less, more
        Below and above the present value, in units of the objective (s of hover) per unit of the
        parameter. They differ at a kink, as where another constraint takes over; a side that is
        infeasible is infinite, one beyond the parameter's range NaN.

    Examples
    --------
    >>> import optuav
    >>> program = optuav.formulate("paper", optuav.P4("b1"), perspective="battery")
    >>> price = program.shadow_prices()["deadline_s"]
    >>> round(price.less, 4), round(price.more, 4), price.has_kink
    (0.1021, 0.1021, False)
    """

    less: float
    more: float

    @property
    def has_kink(self) -> bool:
        """True if the two sides differ, or one is beyond the range."""
        return not math.isclose(self.less, self.more, rel_tol=1e-6)


class ShadowPrices(Presented, dict[str, ShadowPrice]):
    """Shadow prices by name of the parameter: a dict.

    Parameters
    ----------
    prices, parameters
        The prices, and the parameters that they belong to, by name.

    Examples
    --------
    >>> import optuav
    >>> prices = optuav.formulate("paper", "P3", perspective="battery").shadow_prices()
    >>> round(prices["packs"].more, 1), prices.parameters["packs"].key
    (389.0, 'battery.packs')
    """

    def __init__(
        self, prices: Mapping[str, ShadowPrice], parameters: Mapping[str, Parameter]
    ) -> None:
        super().__init__(prices)
        self.parameters = {name: parameters[name] for name in prices}

    def __repr__(self) -> str:
        return f"<ShadowPrices of {len(self)} parameters, {sum(map(any, self.values()))} not 0>"

    def blocks(self) -> Iterator[Block]:
        """Yield a row for each parameter."""
        rows = [
            (name, p.symbol, "" if p.unit == "1" else p.unit, *map(figure, self[name]))
            for name, p in self.parameters.items()
        ]
        words = "Change of the best objective per unit of a parameter, the others held"
        heads = ("parameter", "symbol", "unit", "less", "more")
        yield Table(heads, rows, words=3, longest=60, above=words)

    def to_frame(self) -> DataFrame:
        """One row a parameter; needs pandas.

        Returns
        -------
        DataFrame
            Columns ``parameter``, ``symbol``, ``unit``, ``key`` of the mission, and ``less`` and
            ``more`` as of `ShadowPrice`.
        """
        rows = [(n, str(p.symbol), p.unit, p.key, *self[n]) for n, p in self.parameters.items()]
        return frame(rows, ["parameter", "symbol", "unit", "key", "less", "more"])


def shadow_prices(
    model: Model, parameters: Values, point: Values, shares: Sequence[float] = (MET, NEARLY_MET)
) -> ShadowPrices:
    """Shadow price of every parameter at an optimal point, by the first of some shares like `MET`.

    Empty without multipliers, or if too many rows hold with equality to enumerate them.
    """
    tried = itertools.product(optimal_points(model, parameters, point), shares)
    prices = (_prices_at(model, parameters, points, share) for points, share in tried)
    return ShadowPrices(next(filter(None, prices), {}), model.parameters)


def _prices_at(
    model: Model, parameters: Values, points: Sequence[Values], share: float
) -> dict[str, ShadowPrice]:
    """Shadow price of every parameter at optimal points; empty without points."""
    sign, count, named = model.sign, len(model.variables), list(model.parameters)
    names = [*(variable.name for variable in model.variables), *named]
    at = np.array([parameters[n] for n in named])
    size = NEGLIGIBLE / np.maximum(1.0, np.abs(at))
    gains = []
    for side in (-1.0, 1.0):
        moved = at + side * np.maximum(np.abs(at) * 4e-16, BESIDE)
        beside = dict(zip(named, moved.tolist(), strict=True))
        values = [{**parameters, **beside, **point} for point in points]
        goals = [sign * _rate(slope(model.objective, value), names) for value in values]
        local = [_met(model, value, names, share) for value in values]
        common = [key for key in local[0] if all(key in rows for rows in local)]
        slopes = [np.array([rows[k] for k in common]).reshape(-1, len(names)) for rows in local]
        normals = slopes[0][:, :count]
        if np.count_nonzero(normals.any(axis=1)) > MOST_ROWS:
            return {}
        weights = np.array([*basic_multipliers(normals, goals[0][:count])])
        if not len(weights):
            return {}
        endless = np.vstack([np.empty((0, len(common))), *rays(normals)])
        at_points = []
        for goal, rows in zip(goals, slopes, strict=True):
            still, moving = goal[count:], rows[:, count:]
            rates = side * (still - weights @ moving)
            rates[np.abs(rates) <= SAME_VALUE * (np.abs(still) + weights @ np.abs(moving))] = 0.0
            blocked = (side * endless @ moving > size).any(axis=0)
            at_points.append(np.where(blocked, -np.inf, rates.min(axis=0)))
        gains.append(sign * side * np.max(at_points, axis=0))
    sides = np.transpose(gains).tolist()
    return {name: ShadowPrice(*ends) for name, ends in zip(named, sides, strict=True)}


class Residuals(NamedTuple):
    """Return the residual of the optimality conditions at an answer; 0 where it meets them.

    Parameters
    ----------
    violation
        The largest violation of a constraint, relative to ``max(1, |right side|)``.
    sign, complementarity, stationarity
        The most negative multiplier of an inequality, the largest product of a multiplier and its
        slack, and the largest slope of the Lagrangian along an unknown, all as sizes; NaN from
        engines without multipliers. In the unit of the objective, as s of hover: the first per
        unit of the constraint, the last per unit of the unknown.

    Examples
    --------
    >>> import optuav
    >>> (solution,) = optuav.formulate("paper", "P3", perspective="battery").answers()
    >>> all(residual < 1e-9 for residual in solution.residuals())
    True
    """

    violation: float
    sign: float = math.nan
    complementarity: float = math.nan
    stationarity: float = math.nan


def residuals(model: Model, values: Values, multipliers: Mapping[str, float]) -> Residuals:
    """Return the residual of the optimality conditions at a point with multipliers.

    Values of unknowns and parameters by name, multipliers by label, of equalities signed.
    """
    rows, done = evaluated(model, values), dict[int, Operand]()
    relative = (-row.slack / max(1.0, abs(float(row.right))) for row in rows)
    violation = float(np.max([0.0, *relative]))
    if not multipliers or any(map(math.isnan, multipliers.values())):
        return Residuals(violation + 0.0)
    names = [variable.name for variable in model.variables]
    steepness = model.sign * _rate(slope(model.objective, values, done), names)
    negative, products = [0.0], [0.0]
    for row in rows[: len(model.constraints)]:
        weight, relation = multipliers.get(row.label, 0.0), row.constraint.relation
        products.append(abs(weight * float(row.slack)))
        negative.append(0.0 if relation.sense == "==" else -weight)
        gap, _ = _gap(relation, values, done)
        steepness -= weight * relation.signs[0] * _rate(gap, names)
    for k, variable in enumerate(model.variables):
        weight, x = multipliers.get(variable.label, 0.0), values[variable.name]
        below, above = (abs(x - evaluate(end, values)) for end in (variable.lower, variable.upper))
        # Both bounds share a multiplier: it pushes away from the nearer one.
        pushes = ([weight] if below <= above else []) + ([-weight] if above <= below else [])
        negative.append(-weight)
        products.append(weight * min(below, above) if weight else 0.0)
        steepness[k] = min(abs(steepness[k] + push) for push in pushes)
    worst = (float(np.max(measure)) + 0.0 for measure in (negative, products, np.abs(steepness)))
    return Residuals(violation + 0.0, *worst)
