"""Certificates with numbers short enough to check by hand.

Where times are at least 0, a row a·x ≤ b holds with a smaller a and a larger b too. Rounded so,
each row says a little less than it did; if the rows still contradict each other, that is a proof,
and its sum is exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

from optuav.diagnosis.certificate import NOTHING, Certificate, Row
from optuav.diagnosis.exact import combination

DIGITS = (4, 6, 9, 12)
"""Significant digits that are tried."""
LONGEST = 12
"""Characters of a number that can be checked by hand."""


def shortened(proof: Certificate) -> Certificate:
    """A certificate from the same constraints with fewer digits; the same where there is none."""
    for digits in DIGITS:
        rows = [_weaker(row, digits, proof.positive) for row in proof.rows]
        symbols = [*dict.fromkeys(symbol for row in rows for symbol in row.coefficients)]
        columns = [
            [*(row.coefficients.get(each, NOTHING) for each in symbols), row.limit] for row in rows
        ]
        weights = combination(columns, [NOTHING] * len(symbols) + [Fraction(-1)])
        if weights is None:
            continue
        first = next(weight for weight in weights if weight)
        used = _weighted(rows, [weight / first for weight in weights])
        found = Certificate(used, proof.positive)
        if found.holds():
            return found
    return proof


def _weighted(rows: Sequence[Row], weights: Sequence[Fraction]) -> tuple[Row, ...]:
    pairs = zip(rows, weights, strict=True)
    return tuple(replace(row, multiplier=weight) for row, weight in pairs if weight)


def _weaker(row: Row, digits: int, positive: frozenset[str]) -> Row:
    """A row that follows from another where some unknowns are at least 0."""
    coefficients = {
        symbol: _floor(factor, digits) if symbol in positive else factor
        for symbol, factor in row.coefficients.items()
    }
    return replace(row, coefficients=coefficients, limit=-_floor(-row.limit, digits))


def _floor(value: Fraction, digits: int) -> Fraction:
    """The largest number of so many significant digits that is not larger."""
    if not value:
        return value
    unit = Fraction(10) ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return math.floor(value / unit) * unit


def written(value: Fraction) -> str:
    """A number in full: as a decimal where that ends, else as a fraction; in short where long."""
    rest, places = value.denominator, 0
    for prime in (2, 5):
        count = 0
        while rest % prime == 0:
            rest, count = rest // prime, count + 1
        places = max(places, count)
    text = f"{float(value):.{places}f}" if rest == 1 and places <= LONGEST else str(value)
    if len(text) > LONGEST + 3 or (rest == 1 and Fraction(text) != value):
        text = f"≈{float(value):.6g}"
    return text.replace("-", "−")
