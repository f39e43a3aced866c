"""The labelled table that every study returns, and the pieces of text it is printed with."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from optuav.errors import folded, line_width, printed
from optuav.frames import DataFrame, frame
from optuav.mission import Mission

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCHEMA = 2
NONE = "none"

Row: TypeAlias = Mapping[str, Any]
Show: TypeAlias = Callable[["Results"], Iterable[str]]
Pictures: TypeAlias = Iterable[tuple[str, "Axes"]]
Draw: TypeAlias = Callable[["Results"], Pictures]


@dataclasses.dataclass(frozen=True)
class Results:
    """A table of results: named columns with units, and one row per answer.

    Printed, it is text of at most 80 columns, or as many as the environment states in COLUMNS.

    Parameters
    ----------
    kind
        Kind of the table, for example ``"optuav comparison"``.
    mission
        The mission that was studied.
    facts
        What holds for the table as a whole, by name.
    units
        Unit of each column by its name; ``""`` for words and truth values, ``"-"`` for ratios.
    rows
        The rows, each a mapping with an entry per column; None for no value. A row may
        have further entries, which `to_dict` shows.
    show
        Makes the pieces of the printed text: a function of the table.
    draw
        Makes the pictures: a function of the table that yields names and axes.

    Examples
    --------
    >>> import optuav
    >>> results = optuav.compare("paper", by="trajectory", perspective="battery")
    >>> results.units["hover_time_s"], results.facts["by"]
    ('s', ('trajectory',))
    """

    kind: str
    mission: Mission
    facts: Mapping[str, Any]
    units: Mapping[str, str]
    rows: tuple[Row, ...]
    show: Show = dataclasses.field(repr=False, compare=False)
    draw: Draw = dataclasses.field(repr=False, compare=False)

    __str__ = printed(lambda self: folded("\n".join(self.show(self)), line_width()))

    def __repr__(self) -> str:
        size = f"{len(self.rows)} rows, {len(self.units)} columns"
        return f"<{self.kind} for {self.mission.name!r}: {size}>"

    def _repr_html_(self) -> str:
        from optuav.diagnosis.infeasibility import plain
        from optuav.markup import folded, pairs, paragraph, shown, table

        rows = [[as_cell(value) for value in row.values()] for row in plain(self.records())]
        facts = pairs((name, as_cell(value)) for name, value in plain(self.facts).items())
        head = f"{self.kind.removeprefix('optuav ')}: {self.mission.name}"
        return shown(paragraph(head), table([*self.units], rows), folded("Facts", facts))

    def records(self) -> list[dict[str, Any]]:
        """Return the rows as flat records with an entry a column; places of a route as text."""
        return [
            {
                name: " > ".join(row[name]) if isinstance(row[name], tuple) else row[name]
                for name in self.units
            }
            for row in self.rows
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return facts, rows and mission as plain data, ready for JSON."""
        from optuav.diagnosis.infeasibility import plain

        return {
            "schema": SCHEMA,
            "kind": self.kind,
            **plain(self.facts),
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

        return Figures((name, root(axes)) for name, axes in self.draw(self))

    def save_pictures(self, directory: str | Path) -> list[Path]:
        """Write the pictures into a directory, made if it is missing, and return the files.

        Raises
        ------
        InputError
            If matplotlib is missing, or the directory cannot be made or written to.
        """
        from optuav.plots import save_figures

        return save_figures(self.draw(self), directory)


def labelled_rows(
    columns: Iterable[str], rows: Iterable[Iterable[object]]
) -> tuple[dict[str, Any], ...]:
    """Return rows of values as rows by column."""
    return tuple(dict(zip(columns, row, strict=True)) for row in rows)


class ResultsWithFacts(Results):
    """A table whose facts are its attributes too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["facts"][name]
        except KeyError:
            raise AttributeError(name) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.facts]


def as_cell(value: object) -> str | float | None:
    """Return a value as a cell of a table in a notebook."""
    if value is None or isinstance(value, str | int | float):
        return value
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {as_cell(each)}" for name, each in value.items())
    if isinstance(value, list):
        return ", ".join(str(as_cell(element)) for element in value)
    return repr(value)


def as_csv(records: Sequence[Mapping[str, object]], columns: Sequence[str] = ()) -> str:
    """Return flat records as comma-separated values; a missing value is an empty field."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns or list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def fixed(value: float | None, digits: int = 2, *, otherwise: str = NONE, sign: str = "") -> str:
    """Return a number with `digits` decimals, or another word for None."""
    return otherwise if value is None else f"{value:{sign}.{digits}f}"
