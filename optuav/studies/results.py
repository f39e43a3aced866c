"""The base of what studies find: typed figures, a labelled table, blocks to read, pictures."""

from __future__ import annotations

import csv
import io
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, TypeAlias, TypedDict

from optuav.frames import DataFrame, frame
from optuav.mission import Mission
from optuav.presentation.numbers import seconds
from optuav.presentation.presented import Presented

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCHEMA = 2
EQUALLY_LONG_S = 1e-3  # Difference of two hovers that are called equally long

Pictures: TypeAlias = Iterator[tuple[str, "Axes"]]
"""Pictures by file name."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Result(Presented):
    """What a study found: figures as attributes, and a table with one row per answer.

    Printed, it is text as wide as the terminal, of 80 columns elsewhere, or of as many as the
    environment states in COLUMNS.

    Parameters
    ----------
    mission
        The mission that was studied.
    rows
        The rows of the table, each a mapping with an entry per column; None for no value. A row
        may have further entries, which `to_dict` shows.

    Examples
    --------
    >>> import optuav
    >>> result = optuav.compare("paper", by="trajectory", perspective="battery")
    >>> result.kind, result.units["hover_time_s"], len(result.rows)
    ('optuav comparison of plans', 's', 4)
    """

    kind: ClassVar[str]
    mission: Mission
    rows: tuple[Mapping[str, object], ...]

    @property
    @abstractmethod
    def units(self) -> Mapping[str, str]:
        """Unit of each column by name; ``""`` for words and truth values, ``"-"`` for ratios."""

    @abstractmethod
    def pictures(self) -> Pictures:
        """Yield the pictures by file name; none where there is nothing to draw."""

    def __repr__(self) -> str:
        size = f"{len(self.rows)} rows, {len(self.units)} columns"
        return f"<{self.kind} for {self.mission.name!r}: {size}>"

    def figures(self) -> dict[str, object]:
        """Return what holds for the result as a whole, by name: all fields that it is shown by."""
        table = {field.name for field in fields(Result)}
        shown = (field.name for field in fields(self) if field.repr and field.name not in table)
        return {name: getattr(self, name) for name in shown}

    def records(self) -> list[dict[str, object]]:
        """Return the rows as flat records with an entry a column; places of a route as text."""
        return [{name: _as_cell(row[name]) for name in self.units} for row in self.rows]

    def to_dict(self) -> dict[str, object]:
        """Return figures, rows and mission as plain data, ready for JSON."""
        from optuav.diagnosis.infeasibility import plain

        return {
            "schema": SCHEMA,
            "kind": self.kind,
            **plain(self.figures()),
            "units": dict(self.units),
            "rows": plain(self.rows),
            "mission": self.mission.to_dict(),
        }

    def to_csv(self) -> str:
        """Return `records` as comma-separated values below a line of column names."""
        return as_csv(self.records(), list(self.units))

    def to_frame(self) -> DataFrame:
        """Return `records` as a data frame; needs pandas (``python -m pip install pandas``)."""
        return frame(self.records(), list(self.units))

    def plot(self) -> dict[str, Figure]:
        """Return the pictures by file name; none where there is nothing to draw.

        Raises
        ------
        InputError
            If matplotlib is missing.
        """
        from optuav.plots.style import Figures, root

        return Figures((name, root(axes)) for name, axes in self.pictures())

    def save_pictures(self, directory: str | Path) -> list[Path]:
        """Write the pictures as PNG, SVG and PDF into a directory, and return the files.

        The directory is made if it is missing.

        Raises
        ------
        InputError
            If matplotlib is missing, or the directory cannot be made or written to.
        """
        from optuav.plots.files import save_everywhere

        return save_everywhere(self.pictures(), directory)


class ComparedAnswer(TypedDict):
    """The entries that the rows of all comparisons have."""

    hover_time_s: float | None
    status: str


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(Result):
    """Answers side by side, one row each; the rows of each kind of comparison have more entries."""

    rows: tuple[ComparedAnswer, ...]


def longest_of(answers: Sequence[tuple[str, ComparedAnswer]]) -> str:
    """Return the verdict of a comparison: the longest hover that can be flown, and whose it is."""
    flown = [(name, row) for name, row in answers if row.get("flyable") is not False]
    shown = flown if any(row["hover_time_s"] is not None for _, row in flown) else answers
    known_s = {name: row["hover_time_s"] for name, row in shown if row["hover_time_s"] is not None}
    if not known_s:
        return "Longest      there is no plan"
    longest_s = max(known_s.values())
    names = " and ".join(name for name, s in known_s.items() if s > longest_s - EQUALLY_LONG_S)
    fails = "" if shown is flown else ", which cannot be flown"
    return f"Longest      {seconds(longest_s)} of hover: {names}{fails}"


def _as_cell(value: object) -> object:
    """A value of a row as it stands in a flat table."""
    return " > ".join(map(str, value)) if isinstance(value, tuple) else value


def as_csv(records: Sequence[Mapping[str, object]], columns: Sequence[str] = ()) -> str:
    """Return flat records as comma-separated values; a missing value is an empty field."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns or list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()
