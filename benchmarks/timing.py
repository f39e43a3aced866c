"""Medians of repeated runs in CPU time, which others on the machine bear upon least, as a table."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

from rich.table import Table


@dataclass(frozen=True)
class Row:
    """One comparison.

    Parameters
    ----------
    what
        The two sides in words.
    seconds, other_seconds
        Medians [s] of ours and of the other side, or other quantities.
    at_least, at_most
        Limits that other/ours, or ours/other, has to keep; None for a figure without a limit.
    unit
        Unit of both sides.
    """

    what: str
    seconds: float
    other_seconds: float
    at_least: float | None = None
    at_most: float | None = None
    unit: str = "s"

    @property
    def ratio(self) -> float:
        """How many times faster ours is; with `at_most`, how many times slower."""
        if self.at_most is not None:
            return self.seconds / self.other_seconds
        return self.other_seconds / self.seconds

    @property
    def missed(self) -> bool:
        """Whether a limit is not kept."""
        too_slow = self.at_least is not None and self.ratio < self.at_least
        return too_slow or (self.at_most is not None and self.ratio > self.at_most)

    @property
    def limit(self) -> str:
        """The limit in words."""
        if self.at_least is not None:
            return f"≥ {self.at_least:g}×"
        return f"≤ {self.at_most:g}×" if self.at_most is not None else ""


def median_s(run: Callable[[], object], repeats: int) -> float:
    """Median CPU time of a call [s], after one that is not counted."""
    run()
    return statistics.median(_seconds(run) for _ in range(repeats))


def interleaved_s(
    ours: Callable[[], object], other: Callable[[], object], repeats: int
) -> tuple[float, float]:
    """Medians [s] of two calls timed in turn, so that a drifting machine hits both."""
    ours()
    other()
    pairs = [(_seconds(ours), _seconds(other)) for _ in range(repeats)]
    return statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs)


def _seconds(run: Callable[[], object]) -> float:
    begin = time.process_time()
    run()
    return time.process_time() - begin


def table(name: str, rows: list[Row]) -> Table:
    """Rows as a table for the screen."""
    shown = Table(title=name, title_justify="left")
    shown.add_column("ours against the other")
    for column in ("ours", "other", "ratio", "limit"):
        shown.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        style = "bold red" if row.missed else ""
        sides = (_shown(each, row.unit) for each in (row.seconds, row.other_seconds))
        shown.add_row(row.what, *sides, f"{row.ratio:.3g}×", row.limit, style=style)
    return shown


def _shown(value: float, unit: str) -> str:
    """A quantity as text, a time in a unit that suits it."""
    if unit != "s":
        return f"{value:,.0f} {unit}"
    for name, scale in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= scale:
            return f"{value / scale:.3g} {name}"
    return f"{value / 1e-9:.3g} ns"
