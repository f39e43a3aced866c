"""Multipliers at a point: of the constraints that hold with equality there.

A point is stationary where the slope of the objective is a sum of theirs with weights λ ≥ 0. There
may be several such λ, and endlessly many along rays where the rows leave no step in some direction;
the basic ones and the rays are enumerated.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.modelling.check import relations
from optuav.modelling.derivatives import Slope, slope
from optuav.modelling.model import Model

Point = Mapping[str, Any]
ACTIVE = 1e-6
"""Relative slack below which a constraint counts as holding with equality."""
NEGLIGIBLE = 1e-7
"""Multipliers and residuals of stationarity below this share of the largest are zero."""


@dataclass(frozen=True)
class Active:
    """Slopes at a point: of the objective, and of the rows g ≤ 0 that hold with equality there.

    Parameters
    ----------
    objective
        As it is stated, whether it is maximised or minimised.
    rows
        By number of the constraint among `relations` and by sign: an equality gives two rows.
    """

    objective: Slope
    rows: Mapping[tuple[int, float], Slope]


def active(model: Model, values: Point) -> Active:
    """What holds with equality at a point, of the constraints that speak of an unknown."""
    unknowns = {variable.name for variable in model.variables}
    rows: dict[tuple[int, float], Slope] = {}
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for number, constraint in enumerate(stated):
        relation = constraint.relation
        left, right = (slope(side, values, done) for side in relation.sides)
        if not np.all(nearly(left.value, right.value)):
            continue
        for turn in {"<=": (1.0,), ">=": (-1.0,), "==": (1.0, -1.0)}[relation.sense]:
            by = {
                name: turn * (left.by.get(name, 0.0) - right.by.get(name, 0.0))
                for name in {**left.by, **right.by}
            }
            if unknowns & by.keys():
                rows[number, turn] = Slope(turn * (left.value - right.value), by)
    return Active(slope(model.objective, values), rows)


def nearly(left: Any, right: Any) -> Any:
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


def rays(normals: Floats) -> Iterator[Floats]:
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
