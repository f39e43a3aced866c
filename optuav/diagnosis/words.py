"""Lines of an explanation: a label in the margin, text or columns beside it, 80 columns wide."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from fractions import Fraction

WIDTH = 80
LABEL = 13
MOST_CHARACTERS = 12
"""Characters of a number that can be checked by hand."""


def paragraph(label: str, text: str) -> list[str]:
    """Text wrapped beside a label in the margin."""
    return _wrapped(text, f"{label:<{LABEL}}", LABEL)


def _wrapped(text: str, start: str, indent: int) -> list[str]:
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=start,
        subsequent_indent=" " * indent,
        break_on_hyphens=False,
    ) or [start.rstrip()]


def columns(rows: Iterable[tuple[str, ...]], *, formulas: bool = False) -> list[str]:
    """Rows as aligned columns under the label; the last column wraps.

    Formulas stay on one line where they can: below their row, as near to their column as they fit.
    """
    table = [*rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for row in table:
        cells = [f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)]
        start = " " * LABEL + "  ".join([*cells[:-1], ""])
        last = cells[-1].rstrip()
        if formulas and LABEL <= WIDTH - len(last) < len(start):
            lines += [start.rstrip(), f"{last:>{WIDTH}}"]
        else:
            lines += _wrapped(last, start, len(start) + 2)
    return lines


def labelled(label: str, lines: list[str]) -> list[str]:
    """Lines with a label in the margin of the first."""
    return [f"{label:<{LABEL}}{line[LABEL:]}" if not k else line for k, line in enumerate(lines)]


def listed(names: Iterable[str]) -> str:
    """Names in a sentence: commas, and "and" before the last."""
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def number_text(value: float | Fraction) -> str:
    """Six digits, with a true minus sign."""
    return f"{float(value):.6g}".replace("-", "−")


def exact_text(value: Fraction) -> str:
    """A number in full, as a decimal where that ends, else as a fraction; rounded where long."""
    rest, places = value.denominator, 0
    for prime in (2, 5):
        count = 0
        while rest % prime == 0:
            rest, count = rest // prime, count + 1
        places = max(places, count)
    ends = rest == 1
    text = f"{float(value):.{places}f}" if ends and places <= MOST_CHARACTERS else str(value)
    if len(text) > MOST_CHARACTERS + 3 or (ends and Fraction(text) != value):
        text = f"≈{float(value):.6g}"
    return text.replace("-", "−")


def with_unit(value: float, unit: str) -> str:
    """A number and its unit, none for a ratio."""
    return number_text(value) if unit == "1" else f"{number_text(value)} {unit}"
