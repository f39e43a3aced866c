"""Problems whose answers are known: values, multipliers and shadow prices by hand.

Every number below is worked out in the comment of its case, in fractions, from the conditions of
optimality; none comes from an engine. Most are the paper's P3 and P4 with round numbers: Δ [s] of
hovering draws I Δ, T' [s] of resting brings R T', Q is drawn in flight, C may be drawn in all, and
T is the time that the flight leaves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from optuav.engines import closed_form, grid, linear, smooth
from optuav.engines.capabilities import takers
from optuav.engines.solution import Solution, Status
from optuav.modelling import Model, Parameter, evaluate
from optuav.modelling.check import relations
from optuav.modelling.traits import traits

Numbers = Mapping[str, float]
CHARGE, DEADLINE, HOVER, REST = "charge", "deadline", "bounds of Δ", "bounds of T'"


@dataclass(frozen=True)
class Case:
    """A problem and its answer.

    Parameters
    ----------
    name
        What is special about it.
    build
        Makes the model.
    status
        What an engine with a proof must say.
    objective
        Best value.
    values
        Those values of unknowns that the tie rule makes unique.
    multipliers
        Those multipliers that are unique, by label.
    prices
        Derivatives of the best value to either side, by parameter: (less, more), or one number
        where they are equal.
    slot_s
        Length of the slots; None for continuous times.
    """

    name: str
    build: Callable[[], Model]
    status: Status = Status.OPTIMAL
    objective: float = math.nan
    values: Numbers = field(default_factory=dict)
    multipliers: Numbers = field(default_factory=dict)
    prices: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    slot_s: float | None = None

    def engines(self) -> tuple[str, ...]:
        """Names of the engines that take the problem."""
        model = self.build()
        found = takers(traits(model), self.slot_s is not None)
        return tuple(name for name in found if name != "grid" or self.slot_s is not None)


def solved(engine: str, model: Model, slot_s: float | None = None, programmes: int = 1) -> Solution:
    """The solution of an engine."""
    if engine == closed_form.NAME:
        return closed_form.solve(model, programmes)
    if engine == linear.NAME:
        return linear.solve(model, programmes, slot_s)
    if engine == smooth.NAME:
        return smooth.solve(model, programmes)
    assert engine == grid.NAME
    assert slot_s is not None
    return grid.solve(model, programmes, slot_s)


@dataclass(frozen=True)
class Residuals:
    """By how much a point with multipliers misses the conditions of optimality.

    Parameters
    ----------
    feasibility
        Largest violation of a constraint or bound.
    sign
        Largest negative multiplier of an inequality.
    complementarity
        Largest product of a multiplier and the slack of its constraint.
    stationarity
        Largest component of the gradient of the Lagrangian.
    """

    feasibility: float
    sign: float
    complementarity: float
    stationarity: float


def residuals(solution: Solution) -> Residuals:
    """Conditions of optimality, from values of the trees and their differences alone."""
    model = solution.model
    assert model is not None
    parameters = {**model.row(0), **solution.given_at(0)}
    point = solution.point(0)
    multipliers = solution.multipliers_at(0)
    sign = 1.0 if model.sense == "maximise" else -1.0
    broken = negative = product = 0.0
    used: set[str] = set()
    terms: list[tuple[float, Any]] = [(sign, model.objective)]
    for constraint in sorted(relations(model), key=lambda each: _slack(each.relation, point)):
        slack = _slack(constraint.relation, point | parameters)
        broken = max(broken, -slack)
        if constraint.label in used:
            continue  # of the two bounds of an unknown, the nearer one has the multiplier
        used.add(constraint.label)
        weight = multipliers.get(constraint.label, 0.0)
        sense = constraint.relation.sense
        if sense != "==":
            negative = max(negative, -weight)
        product = max(product, abs(weight * slack))
        turn = 1.0 if sense == ">=" else -1.0
        terms.append((turn * weight, constraint.relation.left))
        terms.append((-turn * weight, constraint.relation.right))

    def lagrangian(name: str, value: float) -> float:
        at = {**parameters, **point, name: value}
        return math.fsum(weight * float(evaluate(tree, at)) for weight, tree in terms)

    steepest = 0.0
    for name, value in point.items():
        step = 1e-5 * max(1.0, abs(value))
        rise = lagrangian(name, value + step) - lagrangian(name, value - step)
        steepest = max(steepest, abs(rise / (2.0 * step)))
