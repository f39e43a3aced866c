"""Discharges of a full battery, from files: what was drawn, and when the battery was empty."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.data import Column, Table, clock_faults, gaps, headings_of, read
from optuav.errors import Fault, InputError

LIFETIMES = (
    Column("load", "text"),
    Column("current", "current"),
    Column("duration", "time", needed=False, blanks=True),
    Column("lifetime", "time"),
)
"""Of a file of lifetimes: a line for every piece of a load, the pieces of one load in order."""
RECORD = (Column("time", "time"), Column("current", "current"))
"""Of a record, whose last line is the moment of cut-off."""
LEAST_SAMPLES = 3
ENOUGH_TO_BE_LATE = 10
"""Lines of a record from which on there is a usual step."""
MOST_PIECES = 200_000
"""Most pieces of constant current that a load may have until the battery is empty."""


@dataclass(frozen=True)
class Discharge:
    """A load and how long the battery held it.

    Parameters
    ----------
    name
        Of the load or the record.
    pieces
        Current [A], positive while discharging, and duration [s]; repeated until the end.
    lifetime_s
        When the battery was empty [s].
    doubt
        What may be wrong with a record, in a sentence; or empty.
    """

    name: str
    pieces: tuple[tuple[float, float], ...]
    lifetime_s: float
    doubt: str = ""

    @property
    def constant(self) -> bool:
        """Whether the current is always the same."""
        return len({current_A for current_A, _ in self.pieces}) == 1

    @property
    def changes(self) -> tuple[Floats, Floats]:
        """By how much the current changes [A] and how long before the end [s]."""
        currents_A, durations_s = map(np.array, zip(*self.pieces, strict=True))
        rounds = math.ceil(self.lifetime_s / durations_s.sum()) if not self.constant else 1
        starts_s = np.cumsum(np.tile(durations_s, rounds)) - np.tile(durations_s, rounds)
        changes_A = np.diff(np.tile(currents_A, rounds), prepend=0.0)
        counted = (starts_s < self.lifetime_s) & (changes_A != 0.0)
        return changes_A[counted], self.lifetime_s - starts_s[counted]

    @property
    def ends_in_pause(self) -> bool:
        """Whether nothing is drawn just before the end."""
        return float(self.changes[0].sum()) <= 0.0


def discharges_in(path: Path) -> list[Discharge]:
    """What a file holds: lifetimes if it says so, otherwise a record."""
    if any(each.partition("_")[0] in ("load", "lifetime") for each in headings_of(path)):
        return _lifetimes(read(path, LIFETIMES))
    return [_record(path, read(path, RECORD, LEAST_SAMPLES))]


def _lifetimes(table: Table) -> list[Discharge]:
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(table.texts["load"]):
        rows.setdefault(name, []).append(row)
    current_A, lifetime_s = table.numbers["current"], table.numbers["lifetime"]
    duration_s = table.numbers.get("duration", np.full(len(current_A), math.nan))
    faults, found = list[Fault](), list[Discharge]()
    for name, own in rows.items():
        faults += _faults_of_load(table, own)
        pieces = [(float(current_A[row]), float(duration_s[row])) for row in own]
        if len(own) == 1:
            pieces = [(pieces[0][0], float(lifetime_s[own[0]]))]
        found.append(Discharge(name, tuple(pieces), float(lifetime_s[own[0]])))
    if faults:
        raise InputError(faults)
    return found


def _faults_of_load(table: Table, rows: Sequence[int]) -> Iterator[Fault]:
    current_A, lifetime_s = table.numbers["current"], table.numbers["lifetime"]
    duration_s = table.numbers.get("duration", np.full(len(current_A), math.nan))
    name = table.texts["load"][rows[0]]
    for row in rows:
        if not lifetime_s[row] > 0.0:
            yield table.fault(row, "lifetime", float(lifetime_s[row]), "a time above 0")
        if lifetime_s[row] != lifetime_s[rows[0]]:
            words = f"one lifetime for all pieces of {name}; a second discharge gets a second name"
            yield table.fault(row, "lifetime", float(lifetime_s[row]), words)
        if len(rows) > 1 and not duration_s[row] > 0.0:
            words = f"a time above 0, as {name} has several pieces"
            value = "an empty cell" if math.isnan(duration_s[row]) else f"{duration_s[row]:g}"
            yield table.fault(row, "duration", value, words)
    if not max(current_A[row] for row in rows) > 0.0:
        words = f"some current above 0 in {name}: positive is discharge"
        yield table.fault(rows[0], "current", float(current_A[rows[0]]), words)
    if len(rows) > 1 and all(duration_s[row] > 0.0 for row in rows):
        pieces = lifetime_s[rows[0]] / sum(duration_s[row] for row in rows) * len(rows)
        if pieces > MOST_PIECES:
            words = f"at most {MOST_PIECES} pieces of {name} until the battery is empty"
            yield table.fault(rows[0], "duration", float(duration_s[rows[0]]), words)


def _record(path: Path, table: Table) -> Discharge:
    faults = list(clock_faults(table))
    if faults:
        raise InputError(faults)
    time_s, current_A = table.numbers["time"], table.numbers["current"]
    if not np.max(current_A[:-1]) > 0.0:
        words = "some current above 0: positive is discharge"
        raise InputError([table.fault(0, "current", float(current_A[0]), words)])
    pieces = zip(current_A[:-1].tolist(), np.diff(time_s).tolist(), strict=True)
    lasts_s = float(time_s[-1] - time_s[0])
    return Discharge(path.stem, tuple(pieces), lasts_s, _held_long(path.stem, table))


def _held_long(name: str, table: Table) -> str:
    """A doubt where a logger may have stopped; a current holds until the next line all the same."""
    late = list(gaps(table)) if len(table.lines) >= ENOUGH_TO_BE_LATE else []
    if not late:
        return ""
    more = f" and {len(late) - 1} more" if len(late) > 1 else ""
    return (
        f"{name} has long stretches without a line, {late[0].value}{more}: the current is taken to "
        "hold until the next line"
    )
