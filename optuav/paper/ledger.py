"""The ledger: the paper's statements with our values, computed when it is called."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.messages import nearest
from optuav.paper.computations import computation
from optuav.paper.curves import papers
from optuav.paper.statement import Entry, Interval, PaperStatement, Value, Verdict, data
from optuav.studies.results import as_csv

Progress: TypeAlias = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Ledger:
    """Entries of the ledger, in the paper's order.

    Printed, it is a summary; `details` has every entry in full.

    Parameters
    ----------
    entries
        One a statement of the paper.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.ledger(["text-e1", "text-e2"])
    >>> [entry.verdict.value for entry in found.entries]
    ['matched', "contradicts the paper's own numbers"]
    """

    entries: tuple[Entry, ...]

    @property
    def counts(self) -> Mapping[Verdict, int]:
        """How many entries have each verdict, in the order of the verdicts."""
        found = Counter(entry.verdict for entry in self.entries)
        return {verdict: found[verdict] for verdict in Verdict if found[verdict]}

    @property
    def table2(self) -> tuple[Entry, ...]:
        """The entries that are cells of Table II, row by row."""
        return tuple(each for each in self.entries if each.statement.name.startswith("table2-"))

    @property
    def summary(self) -> str:
        """The counts, and a line for each statement that does not match."""
        words = sum(not entry.statement.is_number for entry in self.entries)
        lines = [f"{len(self.entries)} statements of the paper, {words} of them in words"]
        lines += [f"{count:5}  {verdict.value}" for verdict, count in self.counts.items()]
        for verdict in (Verdict.WITHIN, Verdict.CONTRADICTS, Verdict.UNDECIDED, Verdict.DIFFERS):
            found = [entry for entry in self.entries if entry.verdict is verdict]
            lines += ["", f"{verdict.value[0].upper()}{verdict.value[1:]}:"] if found else []
            lines += [f"  {_line(entry)}" for entry in found]
        return "\n".join(lines)

    @property
    def details(self) -> str:
        """Every entry as a few lines."""
        return "\n\n".join(map(_block, self.entries))

    def __str__(self) -> str:
        return self.summary

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


def _line(entry: Entry) -> str:
    paper = entry.statement
    ours = ", ".join(
        f"{entry.shown(value)} {by}"
        for value, by in ((entry.printed, "printed"), (entry.recovered, "recovered"))
        if value is not None
    )
    return f"{paper.name}: {paper.stated} {paper.unit}".rstrip() + f"; ours {ours}"


def _block(entry: Entry) -> str:
    paper = entry.statement
    reason = f": {entry.reason}" if entry.reason else ""
    return "\n".join(
        (
            f"{paper.name}  {paper.place}: {paper.what}",
            f"  paper      {paper.stated} {paper.unit}".rstrip(),
            f"  printed    {entry.shown(entry.printed)}",
            f"  recovered  {entry.shown(entry.recovered)}",
            f"  verdict    {entry.verdict.value}{reason}",
            f"  how        {paper.how}; {entry.command}",
        )
    )


def statements() -> tuple[PaperStatement, ...]:
    """All statements, about in the paper's order."""
    return tuple(_statement(dict(each)) for each in data()["statement"])


def _statement(fields: dict[str, Any]) -> PaperStatement:
    key = fields.pop("key", None)
    if key is not None:
        fields |= {"how": f"{key} of the mission", "command": "optuav show paper"}
        return PaperStatement(**fields, compute=partial(_setting, key=key), given=True)
    room = fields.pop("room", None)
    compute = _value(fields.pop("compute"))
    return PaperStatement(**fields, compute=compute, room=room and partial(_room, room))


def _setting(mission: Mission, key: str) -> Value:
    section, _, name = key.partition(".")
    return float(getattr(getattr(mission, section), name))


def _value(named: Sequence[str | float]) -> Callable[[Mission], Value]:
    name, *options = named
    return lambda mission: computation(str(name))(mission, *options)


def _room(named: Sequence[str | float]) -> Value | Interval:
    values = map(_value(named), papers())
    return next((value for value in values if value is not None), None)


def ledger(names: Collection[str] = (), *, progress: Progress | None = None) -> Ledger:
    """Compute our values for the paper's numbers.

    Parameters
    ----------
    names
        Names of entries, or beginnings of names where no entry has the name; all by default.
    progress
        Called with the number of entries done, of all, and the name of the next.

    Returns
    -------
    Ledger
        The entries in the paper's order, with their verdicts.

    Raises
    ------
    InputError
        If a name belongs to no entry.

    Examples
    --------
    >>> import optuav
    >>> (hover,) = optuav.ledger(["text-voltage-hover"]).entries
    >>> hover.statement.stated, f"{hover.recovered:.2f}", hover.verdict.value
    ('14.33', '14.33', 'matched with recovered parameters')
    """
    chosen = tuple(_chosen(statements(), names))
    printed, recovered = papers()
    entries = []
    for done, each in enumerate(chosen):
        if progress is not None:
            progress(done, len(chosen), each.name)
        entries.append(Entry(each, each.compute(printed), each.compute(recovered)))
    return Ledger(tuple(entries))


def _chosen(known: Sequence[PaperStatement], names: Collection[str]) -> Iterator[PaperStatement]:
    every = [each.name for each in known]
    unknown = [name for name in names if not any(each.startswith(name) for each in every)]
    if unknown:
        words = "the name of an entry, or its beginning"
        raise InputError(
            Fault("name", repr(name), f"{words}{nearest(name, every)}") for name in unknown
        )
    whole = set(every).intersection(names)
    beginnings = tuple(name for name in names if name not in whole)
    for each in known:
        if not names or each.name in whole or each.name.startswith(beginnings):
            yield each
