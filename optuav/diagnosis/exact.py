"""Non-negative combinations in exact fractions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

Column = Sequence[Fraction]


def combination(columns: Sequence[Column], target: Column) -> list[Fraction] | None:
    """Multipliers y ≥ 0 with Σ y_k column_k = target, exact; None if there are none.

    The columns that carry weight are linearly independent, so that none of them can be spared.
    Phase one of the simplex method; Bland's rule keeps it from going round in circles.

    Parameters
    ----------
    columns
        Vectors of one length.
    target
        What they are to add up to.

    References
    ----------
    .. [1] R. G. Bland, "New finite pivoting rules for the simplex method", Mathematics of
       Operations Research, 1977.
    """
    count = len(columns)
    signs = [-1 if value < 0 else 1 for value in target]
    rows = [
        [*(sign * column[k] for column in columns), sign * target[k]]
        for k, sign in enumerate(signs)
    ]
    basis = [count + k for k in range(len(rows))]  # at first what is missing of each target
    missing = [sum((row[j] for row in rows), Fraction(0)) for j in range(count + 1)]
    while missing[count] > 0:
        entering = next((j for j in range(count) if missing[j] > 0), None)
        if entering is None:
            return None
        ratios = [
            (row[count] / row[entering], basis[k], k)
            for k, row in enumerate(rows)
            if row[entering] > 0
        ]
        leaving = min(ratios)[2]
        basis[leaving] = entering
        pivot = rows[leaving][entering]
        rows[leaving] = [value / pivot for value in rows[leaving]]
        for k, row in enumerate(rows):
            if k != leaving and row[entering]:
                rows[k] = _without(row, rows[leaving], row[entering])
        missing = _without(missing, rows[leaving], missing[entering])
    found = [Fraction(0)] * count
    for k, column in enumerate(basis):
        if column < count:
            found[column] = rows[k][count]
    return found


def _without(
    row: Sequence[Fraction], other: Sequence[Fraction], factor: Fraction
) -> list[Fraction]:
    return [value - factor * taken for value, taken in zip(row, other, strict=True)]
