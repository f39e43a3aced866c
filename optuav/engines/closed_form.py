"""Linear programmes in one or two unknowns, solved exactly at their vertices, many at once.

The rows a·x ≤ b of a programme meet pairwise in candidate points. A feasible candidate whose two
rows carry multipliers λ ≥ 0 with Σ λ a = c is optimal: every feasible x has
c·x = Σ λ a·x ≤ Σ λ b = c·x*. That is the proof which is reported. As every unknown has a lower
bound, a programme without a feasible candidate is infeasible, and one with a feasible but no
optimal candidate is unbounded.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Floats, Integers, Values
from optuav.engines.linear_form import linear_form
from optuav.engines.registry import MOST_UNKNOWNS, Engine
from optuav.engines.solution import Solution
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate
from optuav.status import Status

NAME = "closed-form"
PROOF = "closed form: linear programming duality"
NUMBERS_AT_ONCE = 1 << 16
VERTEX_TOLERANCE = 1e-11
"""Relative to the size of a candidate; rows and directions are scaled to unit length first."""
FOUND_OUT = (Status.OPTIMAL, Status.INFEASIBLE, Status.UNBOUNDED, Status.ERROR)
PARALLEL = 1e-13  # Sine of the angle below which two rows do not meet


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def solve(
    model: Model, programmes: int, values: Values | None = None, **limits: float | None
) -> Solution:
    """Exact answers to a linear programme for every entry of its parameters.

    Arguments as of `optuav.engines.registry.Engine.solve`; a programme with a NaN among its numbers
    has status error.
    """
    unknowns, numbers = len(model.variables), values or {}
    if not 1 <= unknowns <= MOST_UNKNOWNS:
        raise ValueError(f"{NAME} accepts one or two unknowns, the model has {unknowns}")
    lower = [evaluate(variable.lower, numbers) for variable in model.variables]
    for variable, bound in zip(model.variables, lower, strict=True):
        if np.isneginf(bound).any():
            raise ValueError(f"{NAME} needs a lower bound on {variable.symbol}")
    form = linear_form(model, numbers, programmes)
    # A row without unknowns is feasible or not, whatever the point: it meets no other row.
    meeting = np.flatnonzero((form.normals != 0.0).any(axis=(1, 2)))
    # Single rows, or all pairs, the bounds first.
    bases = list(itertools.combinations(meeting[::-1].tolist(), unknowns))
    chunk = 1 + NUMBERS_AT_ONCE // (len(bases) * len(form.labels))
    figures = form.normals, form.limits, form.directions
    parts = [
        _best_vertices(bases, *(figure[..., first : first + chunk] for figure in figures))
        for first in range(0, programmes, chunk)
    ]
    points, found_out = (np.concatenate(pieces, axis=-1) for pieces in zip(*parts, strict=True))
    found_out = np.where(form.usable, found_out, FOUND_OUT.index(Status.ERROR))
    # A vertex may lie beyond a bound by rounding; no unknown does.
    points = np.array([np.maximum(*bounds) for bounds in zip(points, lower, strict=True)])
    points = np.where(found_out == FOUND_OUT.index(Status.OPTIMAL), points, np.nan)
    reached = (form.directions[0] * points).sum(axis=0) + form.offsets[0]
    return Solution(
        engine=NAME,
        proof=PROOF,
        statuses=[FOUND_OUT[code] for code in found_out.tolist()],
        objective=form.sign * reached + 0.0,
        values=dict(zip(form.names, points, strict=True)),
        duals=None,
        declared=model,
        given=numbers,
    )


def _best_vertices(
    bases: Sequence[tuple[int, ...]], normals: Floats, limits: Floats, directions: Floats
) -> tuple[Floats, Integers]:
    """Best vertices of programmes and the numbers of their statuses in `FOUND_OUT`.

    Normals (row, unknown, programme), limits (row, programme), goals in order (goal, unknown,
    programme).
    """
    size = _sizes(normals)
    a, b = normals / size[:, None], limits / size
    c = directions / _sizes(directions)[:, None]
    candidates, multipliers = _intersections(a, b, c[0], bases)
    terms = a[:, None] * candidates
    allowance = VERTEX_TOLERANCE * np.maximum(1.0, np.abs(terms).max(axis=2))
    feasible = (terms.sum(axis=2) - b[:, None] <= allowance).all(axis=0)
    best = feasible.copy()
    for goal, direction in enumerate(c):
        reached = np.where(best, (direction * candidates).sum(axis=1), -np.inf)
        top = reached.max(axis=0)
        best &= reached >= top - VERTEX_TOLERANCE * np.maximum(1.0, np.abs(top))
        if not goal:
            proved = (best & (multipliers >= -VERTEX_TOLERANCE).all(axis=1)).any(axis=0)
    points = candidates[best.argmax(axis=0), :, np.arange(a.shape[2])].T + 0.0
    return points, np.where(feasible.any(axis=0), np.where(proved, 0, 2), 1)


def _sizes(vectors: Floats) -> Floats:
    """Lengths of vectors (vector, unknown, programme), 1 where it is 0."""
    length = np.hypot.reduce(vectors, axis=1)
    return np.where(length > 0.0, length, 1.0)


def _intersections(
    a: Floats, b: Floats, direction: Floats, bases: Sequence[tuple[int, ...]]
) -> tuple[Floats, Floats]:
    """Candidates (candidate, unknown, programme) and multipliers λ of their rows, Σ λ a = c.

    NaN where the rows do not meet. Two rows meet at a step along the first from its foot point,
    which lies on both to within rounding however flat their angle, and keeps a bound as stated.
    """
    if a.shape[1] == 1:
        rows = [row for (row,) in bases]
        normal = np.where(a[rows, 0] == 0.0, np.nan, a[rows, 0])
        return (b[rows] / normal)[:, None], (direction[0] / normal)[:, None]
    first, second = zip(*bases, strict=True)
    (p, q), (r, s) = a[list(first)].swapaxes(0, 1), a[list(second)].swapaxes(0, 1)
    determinant = p * s - q * r
    determinant = np.where(np.abs(determinant) > PARALLEL, determinant, np.nan)
    e, f = b[list(first)], b[list(second)]
    step = (f - e * (p * r + q * s)) / determinant
    x, y = e * p - step * q, e * q + step * p
    u, v = direction
    λ, μ = (u * s - v * r) / determinant, (v * p - u * q) / determinant
    return np.array([x, y]).swapaxes(0, 1), np.array([λ, μ]).swapaxes(0, 1)


@dataclass(frozen=True)
class ClosedForm(Engine):
    """The engine of linear programmes in one or two times.

    Examples
    --------
    >>> import optuav
    >>> from optuav.engines.closed_form import ClosedForm
    >>> plan = optuav.solve("paper", "P3", engine=ClosedForm(), perspective="battery")
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    688.848 s, optimal
    """

    name = NAME
    most_unknowns = MOST_UNKNOWNS
    needs = ("lower bounds",)
    solve = staticmethod(solve)
