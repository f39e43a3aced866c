"""Linear programmes in one or two unknowns, solved exactly at their vertices, many at once.

The rows a·x ≤ b of a programme meet pairwise in candidate points. A feasible candidate whose two
rows carry multipliers λ ≥ 0 with Σ λ a = c is optimal: every feasible x has
c·x = Σ λ a·x ≤ Σ λ b = c·x*. That is the proof which is reported. As every unknown has a lower
bound, a programme without a feasible candidate is infeasible, and one with a feasible but no
optimal candidate is unbounded.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats, Values
from optuav.engines.linear_form import linear_form
from optuav.engines.registry import Capability, Direct, capability
from optuav.engines.solution import Solution
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate
from optuav.status import Status

NAME = "closed-form"
PROOF = "closed form: linear programming duality"
MOST_UNKNOWNS = 2
NUMBERS_AT_ONCE = 1 << 16
TOLERANCE = 1e-11
"""Relative to the size of a candidate; rows and directions are scaled to unit length first."""
STRICT = 1e-9
"""Share of the largest multiplier below which a row is taken to carry no weight."""
PARALLEL = 1e-13
"""Sine of the angle below which two rows do not meet."""

STATUSES = np.array(
    [Status.OPTIMAL, Status.INFEASIBLE, Status.UNBOUNDED, Status.ERROR], dtype=object
)
OPTIMAL, INFEASIBLE, UNBOUNDED, ERROR = range(4)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def solve(
    model: Model,
    programmes: int,
    values: Values | None = None,
    *,
    slot_s: float | None = None,
    time_limit_s: float | None = None,
) -> Solution:
    """Exact answers to a linear programme for every entry of its parameters.

    Arguments as of `registry.Engine.solve`; a programme with a NaN among its numbers has status
    error.

    Raises
    ------
    NotAffineError
        If the model is not linear.
    ValueError
        If the model has no or more than two variables, or one without a lower bound.
    """
    unknowns = len(model.variables)
    if not 1 <= unknowns <= MOST_UNKNOWNS:
        raise ValueError(f"{NAME} takes one or two unknowns, the model has {unknowns}")
    for variable in model.variables:
        if np.isneginf(evaluate(variable.lower, values or {})).any():
            raise ValueError(f"{NAME} needs a lower bound on {variable.symbol}")
    form = linear_form(model, values or {}, programmes)
    # A row without unknowns is feasible or not, whatever the point: it meets no other row.
    meeting = np.flatnonzero((form.normals != 0.0).any(axis=(1, 2)))
    bases = _bases(meeting.tolist(), unknowns)
    chunk = 1 + NUMBERS_AT_ONCE // (len(bases) * len(form.labels))
    figures = form.normals, form.limits, form.directions
    parts = [
        _solve_vertices(bases, *(each[..., first : first + chunk] for each in figures))
        for first in range(0, programmes, chunk)
    ]
    codes = np.where(form.usable, np.concatenate([part.codes for part in parts]), ERROR)
    solved = codes == OPTIMAL
    points = np.where(solved, np.concatenate([part.points for part in parts], axis=-1), np.nan)
    for k, variable in enumerate(model.variables):
        # A vertex may lie beyond a bound by rounding; no unknown does.
        points[k] = np.maximum(points[k], evaluate(variable.lower, values or {}))
    active = solved & np.concatenate([part.active for part in parts], axis=-1)
    multipliers = np.concatenate([part.multipliers for part in parts], axis=-1)
    reached = (form.directions[0] * points).sum(axis=0) + form.offsets[0]
    binding: dict[str, Booleans] = {}
    weights: dict[str, Operand] = {}
    for label, sign, is_active, weight in zip(
        form.labels, form.signs, active, multipliers, strict=True
    ):
        binding[label] = binding[label] | is_active if label in binding else is_active
        weights[label] = weights.get(label, 0.0) + sign * weight
    strict = multipliers > STRICT * multipliers.max(axis=0)
    regular = solved & (active.sum(axis=0) == unknowns) & (active == strict).all(axis=0)
    return Solution(
        engine=NAME,
        proof=PROOF,
        statuses=STATUSES[codes].tolist(),
        objective=form.towards * reached + 0.0,
        values={name: points[k] for k, name in enumerate(form.names)},
        tight=binding,
        duals={label: np.where(solved, each, np.nan) for label, each in weights.items()},
        regular=regular,
        words=[""] * programmes,
        model=model,
        given=values or {},
    )


Bases: TypeAlias = list[tuple[int, ...]]


class _Part(NamedTuple):
    points: Floats
    active: Booleans
    multipliers: Floats
    codes: np.ndarray[tuple[int], np.dtype[np.intp]]


def _solve_vertices(bases: Bases, normals: Floats, limits: Floats, directions: Floats) -> _Part:
    """Best vertices of programmes: normals (row, unknown, programme), limits (row, programme).

    directions (goal, unknown, programme): what to maximise first, then among equals, and so on.
    """
    length, scale = _lengths(normals)
    a, b = normals / scale[:, None], limits / scale
    goal_length = _lengths(directions)[1]
    c = directions / goal_length[:, None]
    candidates, multipliers = _intersections(a, b, c[0], bases)
    terms = a * candidates[:, None]
    excess = terms.sum(axis=2) - b
    allowance = TOLERANCE * np.maximum(1.0, np.abs(terms).max(axis=2))
    feasible = (excess <= allowance).all(axis=1)
    reached = (c[:, None] * candidates).sum(axis=2)
    best = _largest(feasible, reached[0])
    carries = best & (multipliers >= -TOLERANCE).all(axis=1)
    proved = carries.any(axis=0)
    for preferred in reached[1:]:
        best = _largest(best, preferred)
    chosen, here = best.argmax(axis=0), np.arange(a.shape[2])
    active = (np.abs(excess) <= allowance)[chosen, :, here].T & (length > 0.0)
    codes = np.select([~feasible.any(axis=0), ~proved], [INFEASIBLE, UNBOUNDED], OPTIMAL)
    proof = carries.argmax(axis=0)
    weights = np.zeros_like(b)
    for place, rows in enumerate(np.transpose(bases)):
        np.add.at(weights, (rows[proof], here), multipliers[proof, place, here])
    weights = np.maximum(weights, 0.0) * goal_length[0] / scale
    return _Part(candidates[chosen, :, here].T + 0.0, active, weights, codes)


def _lengths(vectors: Floats) -> tuple[Floats, Floats]:
    """Lengths of vectors (vector, unknown, programme), and what to divide by: 1 where it is 0."""
    length = np.hypot.reduce(vectors, axis=1)
    return length, np.where(length > 0.0, length, 1.0)


def _largest(among: Booleans, value: Floats) -> Booleans:
    """Which of the candidates have the largest value, programme by programme."""
    ranked = np.where(among, value, -np.inf)
    top = ranked.max(axis=0)
    within: Booleans = ranked >= top - TOLERANCE * np.maximum(1.0, np.abs(top))
    return among & within


def _bases(rows: list[int], unknowns: int) -> Bases:
    """Row numbers that define the candidates: single rows, or all pairs, the bounds first."""
    return list(itertools.combinations(reversed(rows), unknowns))


def _intersections(a: Floats, b: Floats, direction: Floats, bases: Bases) -> tuple[Floats, Floats]:
    """Candidates (candidate, unknown, programme) and the multipliers of the rows that meet there.

    Multipliers have the same shape: λ with Σ λ a = c. NaN where the rows do not meet. Two rows
    meet at a step along the first from its foot point, which lies on both rows to within rounding
    however flat their angle, and keeps a bound as it was stated.
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
    return np.stack([x, y], axis=1), np.stack([λ, μ], axis=1)


@dataclass(frozen=True)
class ClosedForm(Direct):
    """The engine of linear programmes in one or two times.

    Examples
    --------
    >>> import optuav
    >>> from optuav.engines.closed_form import ClosedForm
    >>> plan = optuav.solve("paper", "P3", engine=ClosedForm(), perspective="battery")
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    688.848 s, optimal
    """

    name: ClassVar[str] = NAME
    takes: ClassVar[Capability] = capability(NAME)
    solve = staticmethod(solve)
