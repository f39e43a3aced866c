"""Many small linear programmes at once, by the dual simplex method: every iterate is a bound.

All are max worth · x with rows · x ≤ limits and x ≥ 0. The first row bounds the sum of all unknowns
of positive worth, and no worth is larger than 1: exchanging its slack for the first of these
unknowns gives a basis that is dual feasible. The method keeps it so, and its value falls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers

ROW_TOLERANCE = 1e-9  # Violation of a row, its largest coefficient being 1, that counts as none
IMPOSSIBLE = 1e-5  # Violation of a row, beyond rounding, that no point can mend
LEAST_PIVOT = 1e-9  # Smaller coefficients count as 0
EXCHANGES = 10  # Largest number of exchanges, as a multiple of the number of rows


class Optima(NamedTuple):
    """Values that no point exceeds (programme,), −inf without any point, and the last x.

    The value is the optimum, and x a point, where the method was not stopped.
    """

    value: Floats
    x: Floats  # (unknown, programme)
    complete: Booleans
    # Multipliers of the rows (row, programme), ≥ 0, that prove the value: the dual values, or a
    # sum of rows that no point keeps.
    prices: Floats


def dual_simplex(rows: Floats, limits: Floats, worth: Floats, enough: Floats) -> Optima:
    """Solve programmes of rows (row, unknown, programme) and limits (row, programme).

    The worth (unknown,) is the same for all. A programme is stopped once its value is no more than
    what is enough (programme,).
    """
    count, unknowns, programmes = rows.shape
    scale = np.abs(rows).max(axis=1)
    scale[scale == 0.0] = 1.0
    table = np.empty((count + 1, unknowns + 1, programmes))
    table[:-1, :-1], table[:-1, -1] = rows / scale[:, None], limits / scale
    table[-1, :-1], table[-1, -1] = -worth[:, None], 0.0
    # Unknowns by number, then slacks: those in the basis, by row, and the others, by column.
    basic = np.tile(np.arange(unknowns, unknowns + count)[:, None], programmes)
    other = np.tile(np.arange(unknowns)[:, None], programmes)
    first = np.zeros(programmes, dtype=np.intp)
    _exchange(table, basic, other, first, first + int(worth.argmax()))
    value, x = np.empty(programmes), np.zeros((unknowns, programmes))
    complete, left = np.zeros(programmes, bool), np.arange(programmes)
    prices = np.zeros((count, programmes))
    for exchange in range(EXCHANGES * count + 1):
        row = table[:-1, -1].argmin(axis=0)
        column_of = np.arange(len(left))
        lacks = table[row, -1, column_of] < -ROW_TOLERANCE
        entries = table[row[None], np.arange(unknowns)[:, None], column_of]
        enters = entries < -LEAST_PIVOT
        steps = np.where(enters, table[-1, :-1], np.inf) / np.where(enters, -entries, 1.0)
        column = steps.argmin(axis=0)
        stuck = lacks & ~enters.any(axis=0)
        void = stuck & (table[row, -1, column_of] < -IMPOSSIBLE)
        stops = table[-1, -1] <= enough[left]
        ends = ~lacks | stuck | stops | (exchange == EXCHANGES * count)
        if ends.any():
            at, ended = left[ends], table[:-1, -1, ends]
            value[at] = np.where(void[ends], -np.inf, table[-1, -1, ends])
            complete[at] = ~lacks[ends]
            in_basis = basic[:, ends]
            which, which_at = np.nonzero(in_basis < unknowns)
            x[in_basis[which, which_at], at[which_at]] = ended[which, which_at]
            proves = np.where(void, row, count)[ends]
            which, which_at = np.nonzero(other[:, ends] >= unknowns)
            slacks = other[:, ends][which, which_at] - unknowns
            worth_of = table[..., ends][proves[which_at], which, which_at]
            prices[slacks, at[which_at]] = np.maximum(worth_of, 0.0)
            # The slack that the stuck row states is its own unknown.
            basics = basic[row, column_of][ends]
            slack = np.flatnonzero(void[ends] & (basics >= unknowns))
            prices[basics[slack] - unknowns, at[slack]] = 1.0
            left, row, column = left[~ends], row[~ends], column[~ends]
            table, basic, other = table[..., ~ends], basic[:, ~ends], other[:, ~ends]
            if not len(left):
                break
        _exchange(table, basic, other, row, column)
    return Optima(value, np.maximum(x, 0.0), complete, prices / scale)


def _exchange(
    table: Floats, basic: Integers, other: Integers, row: Integers, column: Integers
) -> None:
    """Exchange the unknown of a row of the basis for that of a column, in place."""
    at = np.arange(table.shape[2])
    pivot = table[row, column, at]
    line = table[row[None], np.arange(table.shape[1])[:, None], at] / pivot
    line[column, at] = 1.0 / pivot
    factor = table[np.arange(len(table))[:, None], column[None], at]
    table[:, column, at] = 0.0
    table -= factor[:, None] * line
    table[row, :, at] = line.T
    basic[row, at], other[column, at] = other[column, at], basic[row, at]
