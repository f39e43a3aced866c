"""Text in columns."""

from __future__ import annotations

from collections.abc import Sequence

GAP = "  "


def table(rows: Sequence[Sequence[str]]) -> str:
    """Rows of cells, lined up on the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = (
        GAP.join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        for row in rows
    )
    return "\n".join(line.rstrip() for line in padded)
