"""By how much an answer misses the conditions of optimality, evaluated again in NumPy.

Of a point x with multipliers λ, for an objective f that is maximised under g ≤ 0: feasibility,
λ ≥ 0, complementarity λ g = 0 and stationarity ∂f/∂x = Σ λ ∂g/∂x (Karush, Kuhn and Tucker). The
derivatives are those of the declared trees, so nothing here comes from a solver.

References
----------
.. [1] S. Boyd, L. Vandenberghe, "Convex optimization", Cambridge University Press, 2004, 5.5.3.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from optuav.modelling.check import Checks, evaluated
from optuav.modelling.derivatives import slope
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate


class Residuals(NamedTuple):
    """What an answer lacks; all are 0 where nothing is missing.

    The last three are NaN from engines without multipliers, such as those that count in slots.

    Parameters
    ----------
    violation
        Largest violation of a constraint, relative to max(1, |right side|) [-].
    sign
        Largest amount by which the multiplier of an inequality is below 0, in units of the
        objective per unit of the constraint.
    complementarity
        Largest product of a multiplier and the slack of its constraint, in units of the objective.
    stationarity
        Largest slope of the Lagrangian along an unknown, in units of the objective per unit of the
        unknown.
    """

    violation: float
    sign: float = math.nan
    complementarity: float = math.nan
    stationarity: float = math.nan


def residuals(
    model: Model, values: Mapping[str, Any], multipliers: Mapping[str, float]
) -> Residuals:
    """What a point and its multipliers lack.

    Parameters
    ----------
    model
        The declaration.
    values
        Of the unknowns and the parameters, by name.
    multipliers
        Of the constraints, by label, of equalities signed; empty if there are none.
    """
    rows = evaluated(model, values)
    if not multipliers or any(map(math.isnan, multipliers.values())):
        return Residuals(_violation(rows))
    negative, products, slopes = [0.0], [0.0], [0.0]
    done: dict[int, Any] = {}
    steepness = {k: model.towards * v for k, v in slope(model.objective, values, done).by.items()}
    for constraint, row in zip(model.constraints, rows, strict=False):
        weight, relation = multipliers.get(constraint.label, 0.0), constraint.relation
        products.append(abs(weight * row.slack))
        negative.append(0.0 if relation.sense == "==" else -weight)
        turned = -weight if relation.sense == ">=" else weight
        for side, factor in ((relation.left, -turned), (relation.right, turned)):
            for name, rate in slope(side, values, done).by.items():
                steepness[name] = steepness.get(name, 0.0) + factor * rate
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


def _largest(amounts: Sequence[Any]) -> float:
    """The largest of some amounts; NaN where one is NaN, and 0 without a sign."""
    return float(np.max(amounts)) + 0.0
