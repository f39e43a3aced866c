"""Lines of an explanation: a label in the margin, words or columns beside it, 80 columns in all."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from fractions import Fraction

WIDTH = 80
LABEL = 13


def paragraph(label: str, words: str) -> list[str]:
    """Words wrapped beside a label in the margin."""
    return textwrap.wrap(
        words,
        WIDTH,
        initial_indent=f"{label:<{LABEL}}",
        subsequent_indent=" " * LABEL,
        break_on_hyphens=False,
    )


def columns(rows: Iterable[tuple[str, ...]], *, formulas: bool = False) -> list[str]:
    """Rows as lined-up columns under the label; the last one wraps.

    Formulas stay whole where they can: below their row, as near to their column as they fit.
    """
    table = [*rows]
    if not table:
        return []
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for row in table:
        cells = [f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)]
        start = " " * LABEL + "  ".join(cells[:-1]) + ("  " if len(cells) > 1 else "")
        last = cells[-1].rstrip()
        if formulas and LABEL <= WIDTH - len(last) < len(start):
            lines += [start.rstrip(), f"{last:>{WIDTH}}"]
            continue
        lines += textwrap.wrap(
            last,
            WIDTH,
            initial_indent=start,
            subsequent_indent=" " * (len(start) + 2),
            break_on_hyphens=False,
        ) or [start.rstrip()]
    return lines


def labelled(label: str, lines: list[str]) -> list[str]:
    """Lines with a label in the margin of the first."""
    return [f"{label:<{LABEL}}{line[LABEL:]}" if not k else line for k, line in enumerate(lines)]


def number_text(value: float | Fraction) -> str:
    """Six digits, with a true minus sign."""
    digits = f"{float(value):.6g}"
    return digits.replace("-", "−")


def with_unit(value: float, unit: str) -> str:
    """A number and its unit, none for a ratio."""
    return number_text(value) if unit == "1" else f"{number_text(value)} {unit}"
