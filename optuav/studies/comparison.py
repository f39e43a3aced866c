"""What `optuav.compare` returns: one programme a row, one method a column."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optuav.mission import Mission
from optuav.status import Status

if TYPE_CHECKING:
    import pandas

SCHEMA = 1
KIND = "optuav comparison"


@dataclass(frozen=True)
class Method:
    """A way to solve a programme.

    Parameters
    ----------
    name
        For example ``"grid 5 s"``.
    engine
        Name of the engine.
    slot_s
        Length of the slots [s]; None for continuous times.
    """

    name: str
    engine: str
    slot_s: float | None


@dataclass(frozen=True)
class Cell:
    """What a method says of a programme.

    Parameters
    ----------
    method
        How it was solved.
    status
        What the engine says; `Status.ERROR` where it failed or did not finish.
    hover_time_s, rest_time_s
        Δ and T' of its answer [s]; None without one.
    gap_s
        Best Δ in continuous times, by closed form, less this Δ [s]; None where either is missing.
    largest_gap_s
        What the theory allows the gap to be [s]; None where it says nothing.
    allowance_s
        By how much rounding may carry the gap past 0 or past its bound [s].
    agrees
        Whether the answer is what the others and the theory ask; None where the engine failed.
    words
        Why the theory says what it says, or what is wrong.
    proof
        How the engine knows.
    time_s
        Time taken, from the declared programme to a checked plan [s].
    """

    method: Method
    status: Status
    hover_time_s: float | None
    rest_time_s: float | None
    gap_s: float | None
    largest_gap_s: float | None
    allowance_s: float
    agrees: bool | None
    words: str
    proof: str
    time_s: float = field(compare=False)


@dataclass(frozen=True)
class Row:
    """One programme, solved by every method.

    Parameters
    ----------
    problem
        ``"P1"``, ``"P3"`` or ``"P4"``.
    building, order
        Where (P4) rests, and whether it rests or hovers first; None otherwise.
    cells
        One a method; none where the route cannot be flown.
    reasons
        Why there is no plan in continuous times, in words; empty if there is one.
    """

    problem: str
    building: str | None
    order: str | None
    cells: tuple[Cell, ...]
    reasons: tuple[str, ...]

    @property
    def name(self) -> str:
        """Short name, for example ``"P4 b1 rest-first"``."""
        return " ".join(part for part in (self.problem, self.building, self.order) if part)


@dataclass(frozen=True)
class Comparison:
    """Discrete and continuous answers to the problems of a mission, side by side.

    Printed, it is a table. `to_frame` and `to_dict` hold every detail. It is true where some
    programme has an answer.

    Parameters
    ----------
    mission
        What was compared.
    perspective
        How the state of charge is written.
    methods
        The columns; the first is closed form, to which gaps are counted.
    rows
        P3, P4 by building and order, P1.
    """

    mission: Mission
    perspective: str
    methods: tuple[Method, ...]
    rows: tuple[Row, ...]

    def __bool__(self) -> bool:
        return any(cell.hover_time_s is not None for _, cell in self.cells)

    @property
    def cells(self) -> Iterator[tuple[Row, Cell]]:
        """Every cell with its row, row by row."""
        return ((row, cell) for row in self.rows for cell in row.cells)

    @property
    def agrees(self) -> bool:
        """Whether no answer contradicts another, or the theory."""
        return not self.disagreements

    @property
    def disagreements(self) -> tuple[str, ...]:
        """Where answers contradict each other or the theory, in words."""
        return tuple(
            f"{row.name}, {cell.method.name}: {cell.words}"
            for row, cell in self.cells
            if cell.agrees is False
        )

    @property
    def failures(self) -> tuple[str, ...]:
        """Which engines failed on what, or did not finish in time, in words."""
        return tuple(
            f"{row.name}, {cell.method.name}: {cell.words}"
            for row, cell in self.cells
            if cell.agrees is None
        )

    def __str__(self) -> str:
        from optuav.studies.tables import as_text, comparison_tables

        return as_text(comparison_tables(self))

    def to_dict(self, *, times: bool = False) -> dict[str, Any]:
        """The comparison as plain data, mission inside.

        Parameters
        ----------
        times
            Whether to tell the times taken, which differ from run to run.
        """
        return {
            "schema": SCHEMA,
            "kind": KIND,
            "perspective": self.perspective,
            "agrees": self.agrees,
            "disagreements": list(self.disagreements),
            "failures": list(self.failures),
            "rows": [
                {
                    "problem": row.problem,
                    "building": row.building,
                    "order": row.order,
                    "reasons": list(row.reasons),
                    "cells": [_record(cell, times) for cell in row.cells],
                }
                for row in self.rows
            ],
            "mission": self.mission.to_dict(),
        }

    def records(self, *, times: bool = False) -> list[dict[str, Any]]:
        """One flat record a cell; parameters as for `to_dict`."""
        return [
            {
                "problem": row.problem,
                "building": row.building,
                "order": row.order,
                **_record(cell, times),
            }
            for row, cell in self.cells
        ]

    def to_csv(self, *, times: bool = False) -> str:
        """`records` as comma-separated values with a line of headings."""
        return as_csv(self.records(times=times))

    def to_frame(self, *, times: bool = False) -> pandas.DataFrame:
        """One row a cell; needs pandas (``pip install optuav[frame]``).

        Parameters and columns are those of `records`.
        """
        import pandas

        return pandas.DataFrame(self.records(times=times))

    def save_pictures(self, directory: str | Path) -> list[Path]:
        """Write ``gaps.png`` into a directory, and ``plane.png`` where some (P4) has an answer.

        Raises
        ------
        InputError
            If matplotlib is missing, or the directory cannot be made or written to.
        """
        from optuav.studies.pictures import save_comparison

        return save_comparison(self, directory)


def as_csv(records: Sequence[Mapping[str, Any]]) -> str:
    """Flat records as comma-separated values; what is missing is an empty field."""
    text = io.StringIO()
    writer = csv.DictWriter(text, records[0] if records else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    return text.getvalue()


def _record(cell: Cell, times: bool) -> dict[str, Any]:
    record = {
        "method": cell.method.name,
        "engine": cell.method.engine,
        "slot_s": cell.method.slot_s,
        "status": cell.status.value,
        "hover_time_s": cell.hover_time_s,
        "rest_time_s": cell.rest_time_s,
        "gap_s": cell.gap_s,
        "largest_gap_s": cell.largest_gap_s,
        "agrees": cell.agrees,
        "words": cell.words,
        "proof": cell.proof,
    }
    return {**record, "time_s": cell.time_s} if times else record
