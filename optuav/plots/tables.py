"""A table as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from optuav.plots.style import PALE, VERMILLION, applied, page

ROW_IN = 0.24
"""Height of a row [inch]."""


def table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    title: str,
    widths: Sequence[float],
    marked: Mapping[tuple[int, int], str] | None = None,
) -> Axes:
    """Draw a table.

    Parameters
    ----------
    head
        Headings.
    rows
        Cells, as many a row as there are headings.
    title
        What is shown.
    widths
        Widths of the columns, relative to each other.
    marked
        By row and column, words why a cell stands out; they are printed below the table.
    """
    noted = marked or {}
    words = sorted(set(noted.values()))  # in one order in all tables with the same words
    lines = len(rows) + 1 + 0.8 * len(words)
    with applied():
        ax = page(0.45 + ROW_IN * lines).subplots()
        ax.set_axis_off()
        ax.set_title(title)
        edges = [sum(widths[:number]) / sum(widths) for number in range(len(widths) + 1)]
        ax.set(xlim=(0.0, 1.0), ylim=(-lines, 0.0))
        for number, row in enumerate([head, *rows]):
            if number % 2:
                ax.axhspan(-number - 1.0, -number, color=PALE, alpha=0.35, linewidth=0.0)
            for column, cell in enumerate(row):
                why = noted.get((number - 1, column))
                raised = f"$^{{{words.index(why) + 1}}}$" if why else ""
                ax.text(
                    edges[column] + 0.004 if column == 0 else edges[column + 1] - 0.012,
                    -number - 0.5,
                    f"{cell}{raised}",
                    ha="left" if column == 0 else "right",
                    va="center",
                    fontsize=7.2,
                    fontweight="bold" if number == 0 else "normal",
                    color=VERMILLION if why else "black",
                )
        for number, why in enumerate(words, start=1):
            ax.text(
                0.0,
                -(len(rows) + 1) - 0.8 * number + 0.3,
                f"$^{number}$ {why}",
                va="center",
                fontsize=6.8,
                color=VERMILLION,
            )
    return ax
