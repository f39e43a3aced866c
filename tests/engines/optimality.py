"""Run any engine, and measure by how much its answer misses the conditions of optimality."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from optuav.engines import registry
from optuav.engines.solution import Solution
from optuav.modelling import Model, Relation, evaluate


def solved(
    engine: str | registry.Engine, model: Model, slot_s: float | None = None, programmes: int = 1
) -> Solution:
    """The solution of an engine; the grid needs slots."""
    return registry.engine(engine).solve(model, programmes, slot_s=slot_s)


@dataclass(frozen=True)
class Residuals:
    """What a point and its multipliers lack.

    Parameters
    ----------
    feasibility
        Largest violation of a constraint or bound.
    sign
        Largest amount by which the multiplier of an inequality is negative.
    complementarity
        Largest product of a multiplier and the slack of its constraint.
    stationarity
        Largest slope of the Lagrangian along an unknown.
    """

    feasibility: float
    sign: float
    complementarity: float
    stationarity: float


def residuals(solution: Solution) -> Residuals:
    """Of the answer to the only programme, from values of the trees and their differences alone."""
    model = solution.model
    point = solution.point(0)
    at = {**solution.parameters_at(0), **point}
    weights = solution.multipliers_at(0)
    terms: list[tuple[float, Any]] = [(1.0 if model.sense == "maximise" else -1.0, model.objective)]
    broken, negative, products, slopes = [0.0], [0.0], [0.0], [0.0]
    for constraint in model.constraints:
        relation, weight = constraint.relation, weights.get(constraint.label, 0.0)
        over = excess(relation, at)
        equal = relation.sense == "=="
        broken.append(abs(over) if equal else over)
        negative.append(0.0 if equal else -weight)
        products.append(abs(weight * over))
        turn = 1.0 if relation.sense == ">=" else -1.0
        terms += [(turn * weight, relation.left), (-turn * weight, relation.right)]
    for variable in model.variables:
        value, weight = point[variable.name], weights.get(variable.label, 0.0)
        below = value - float(evaluate(variable.lower, at))
        above = float(evaluate(variable.upper, at)) - value
        broken += [-below, -above]
        negative.append(-weight)
        nearer = min(abs(below), abs(above))
        products.append(weight * nearer if math.isfinite(nearer) else abs(weight))
        # Both bounds share a multiplier: it pushes away from the nearer one.
        slope = _slope(terms, at, variable.name)
        pushed = [slope + weight] if abs(below) == nearer else []
        pushed += [slope - weight] if abs(above) == nearer else []
        slopes.append(min(map(abs, pushed)))
    return Residuals(max(broken), max(negative), max(products), max(slopes))


def excess(relation: Relation, at: Mapping[str, Any]) -> float:
    """By how much the sides of a relation compare the wrong way; left − right of an equality."""
    difference = float(evaluate(relation.left, at) - evaluate(relation.right, at))
    return -difference if relation.sense == ">=" else difference


def _slope(terms: Sequence[tuple[float, Any]], at: Mapping[str, Any], name: str) -> float:
    """Central difference of Σ weight · tree along an unknown."""
    step = 1e-5 * max(1.0, abs(at[name]))

    def value(moved: float) -> float:
        return math.fsum(w * float(evaluate(tree, {**at, name: moved})) for w, tree in terms)

    return (value(at[name] + step) - value(at[name] - step)) / (2.0 * step)
