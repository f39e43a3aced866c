"""`ledger`: every statement of the paper with our values, computed when it is called."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass

from optuav.errors import Fault, InputError
from optuav.mission.messages import nearest
from optuav.paper.ledger import (
    battery_size,
    charging,
    direct_path,
    energy_model,
    introduction,
    least_charge,
    model,
    settings,
    table2,
    trajectories,
    wind,
)
from optuav.paper.ledger.scenario import papers
from optuav.paper.ledger.statement import Entry, Statement, Verdict
from optuav.studies.results import as_csv

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Ledger:
    """Entries of the ledger, in the paper's order; printed, it is a table.

    Parameters
    ----------
    entries
        One a statement of the paper.
    """

    entries: tuple[Entry, ...]

    @property
    def counts(self) -> Mapping[Verdict, int]:
        """How many entries have each verdict, in the order of the verdicts."""
        found = Counter(entry.verdict for entry in self.entries)
        return {verdict: found[verdict] for verdict in Verdict if found[verdict]}

    @property
    def in_words(self) -> Ledger:
        """Those that state no number but a finding, a formula or a range."""
        return Ledger(tuple(entry for entry in self.entries if not entry.statement.is_number))

    @property
    def summary(self) -> str:
        """The counts in a sentence."""
        counted = ", ".join(f"{count} {verdict.value}" for verdict, count in self.counts.items())
        words = len(self.in_words.entries)
        return f"{len(self.entries)} statements, {words} in words: {counted}"

    def __str__(self) -> str:
        return "\n\n".join([*map(_block, self.entries), self.summary])

    def records(self) -> list[dict[str, str]]:
        """One flat record an entry."""
        return [
            {
                "name": entry.statement.name,
                "place": entry.statement.place,
                "what": entry.statement.what,
                "stated": entry.statement.stated,
                "unit": entry.statement.unit,
                "by printed parameters": entry.shown(entry.printed),
                "by recovered parameters": entry.shown(entry.recovered),
                "verdict": entry.verdict.value,
                "reason": entry.reason,
                "how": entry.statement.how,
                "command": entry.command,
            }
            for entry in self.entries
        ]

    def to_csv(self) -> str:
        """`records` as comma-separated values with a line of headings."""
        return as_csv(self.records())

    def cells_of_table2(self) -> tuple[Entry, ...]:
        """The entries that are cells of Table II, without its deadlines."""
        return tuple(
            entry
            for entry in self.entries
            if entry.statement.name.startswith("table2-") and not entry.statement.given
        )


def _block(entry: Entry) -> str:
    """An entry as a few lines of text."""
    told = entry.statement
    unit = f" {told.unit}" if told.unit else ""
    lines = [
        f"{told.name}  {told.place}: {told.what}",
        f"  paper      {told.stated}{unit}",
        f"  printed    {entry.shown(entry.printed)}",
        f"  recovered  {entry.shown(entry.recovered)}",
        f"  verdict    {entry.verdict.value}" + (f": {entry.reason}" if entry.reason else ""),
        f"  how        {told.how}; {entry.command}",
    ]
    return "\n".join(lines)


NOT_COUNTED = (
    "numbers of sections, equations, figures and references",
    "bounds and subscripts by which a symbol, a sum or a constraint is defined",
    "what the source has commented out",
)
"""Numbers in the paper's source that state nothing."""

SUBJECTS = (
    introduction,
    energy_model,
    model,
    settings,
    table2,
    direct_path,
    trajectories,
    least_charge,
    battery_size,
    wind,
    charging,
)


def statements() -> tuple[Statement, ...]:
    """All that the paper states, but `NOT_COUNTED`, by subject, about in its order."""
    return tuple(each for subject in SUBJECTS for each in subject.statements())


def ledger(names: Collection[str] = (), *, progress: Progress | None = None) -> Ledger:
    """Compute our values for the paper's numbers.

    Parameters
    ----------
    names
        Names of entries, or beginnings of names where no entry has the name; all by default.
    progress
        Called with the number of entries done, of all, and the name of the next.

    Raises
    ------
    InputError
        If a name belongs to no entry.
    """
    known = statements()
    chosen = list(_chosen(known, names))
    printed, recovered = papers()
    entries = []
    for done, told in enumerate(chosen):
        if progress is not None:
            progress(done, len(chosen), told.name)
        entries.append(Entry(told, told.compute(printed), told.compute(recovered)))
    return Ledger(tuple(entries))


def _chosen(known: tuple[Statement, ...], names: Collection[str]) -> Iterator[Statement]:
    unknown = [name for name in names if not any(told.name.startswith(name) for told in known)]
    if unknown:
        every = [told.name for told in known]
        raise InputError(
            Fault(
                "name", repr(name), f"the name of an entry, or its beginning{nearest(name, every)}"
            )
            for name in unknown
        )
    whole = {told.name for told in known}.intersection(names)
    beginnings = tuple(name for name in names if name not in whole)
    for told in known:
        if not names or told.name in whole or told.name.startswith(beginnings):
            yield told
