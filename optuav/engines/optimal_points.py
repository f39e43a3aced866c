"""Optimal points beside the answer of an engine, where it is not the only one."""

from __future__ import annotations

import itertools

import numpy as np

from optuav.arrays import Floats
from optuav.engines.exponential_form import Section, rows_of, stated_forms
from optuav.engines.linear_form import LinearForm, linear_form
from optuav.engines.multipliers import Point
from optuav.engines.ranges import implied_upper_bounds
from optuav.modelling.affine import NotAffineError
from optuav.modelling.expression import Variable
from optuav.modelling.kibam_form import NotExponentialError
from optuav.modelling.model import Model

SAME = 1e-9
"""Relative difference below which two objective values are the same."""
MOST_ROWS = 14
"""Rows that may hold with equality before their combinations are too many to enumerate."""
APART_S = 1e-3
"""Least distance of two points that are not one and the same but for the accuracy of an engine."""


def optimal_points(model: Model, parameters: Point, point: Point) -> list[Point]:
    """Optimal points of one programme, with an answer among them.

    Parameters
    ----------
    model, parameters
        The programme.
    point
        The answer.

    Returns
    -------
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
        forms, sizes, *_ = zip(*stated_forms(model, parameters), strict=True)
        rows = rows_of(forms, sizes, goal, other, 1, max(top, point[goal]))
    except NotExponentialError:
        return [point]
    longest = Section.at_x(rows, np.array([point[goal]])).largest(np.array([top]))[0]
    if np.isnan(longest) or longest - point[other] < APART_S:
        return [point]
    return [point, {**point, other: float(longest)}]
