"""Proofs in words: constraints with their multipliers, and what they add up to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

from optuav.diagnosis.certificate import Certificate, Combination
from optuav.diagnosis.layout import columns, number_text
from optuav.diagnosis.short import shortened, written


def combination_text(used: Combination) -> list[str]:
    """Rows with their multipliers, and what they add up to; a contradiction in full."""
    if isinstance(used, Certificate):
        used, number, false = shortened(used), written, ", which is false"
    else:
        number, false = number_text, ""
    rows = [
        (f"{number(row.multiplier)} ×", row.label, _inequality(row.coefficients, row.limit, number))
        for row in used.rows
    ]
    rows.append(("sum", "", _inequality(used.coefficients, used.limit, number) + false))
    return columns(rows, formulas=True)


def _inequality(
    coefficients: Mapping[str, Fraction], limit: Fraction, number: Callable[[Fraction], str]
) -> str:
    terms: list[str] = []
    for symbol, factor in coefficients.items():
        size = symbol if abs(factor) == 1 else f"{number(abs(factor))}·{symbol}"
        sign = "−" if factor < 0 else "+"
        terms.append(f"{sign} {size}" if terms else f"{sign}{size}".removeprefix("+"))
    return f"{' '.join(terms) or '0'} ≤ {number(limit)}"
