"""What the paper states, what we get for it, and the verdict that follows from the two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_DOWN, ROUND_HALF_EVEN, Decimal, InvalidOperation
from enum import StrEnum

from optuav.paper.ledger.scenario import Scenario

Value = float | str | None
Interval = tuple[float, float]

SIGNIFICANT = 12
"""Digits of our values that count; the rest is rounding of floats."""


class Verdict(StrEnum):
    """How a number of the paper stands beside ours."""

    MATCHED = "matched"
    CUT = "matched when cut, not rounded"
    RECOVERED = "matched with recovered parameters"
    FITTED = "used in the fit"
    WITHIN = "off by less than the rounding of the fit"
    GIVEN = "a setting, taken as given"
    CONTRADICTS = "contradicts the paper's own numbers"
    UNDECIDED = "cannot be decided"
    DIFFERS = "does not match"


@dataclass(frozen=True, kw_only=True)
class Statement:
    """A number, or a finding in a word, that stands in the paper.

    Parameters
    ----------
    name
        Short and unique.
    place
        Where it stands.
    what
        What it is the value of.
    stated
        As printed; its digits decide what matches.
    unit
        Its unit; empty for counts, ratios and words.
    how
        How our value is computed.
    compute
        Our value in a scenario; None where the scenario has none.
    reason
        What a reader should know about the verdict.
    command
        What computes our value again; ``optuav ledger NAME`` by default.
    limit
        Whether it ends an interval around 0, where a printed number rounded away from 0 would lie
        outside and cutting digits is as good a reading.
    given, fitted
        Whether it is a setting of the scenario; whether `paper-table2` was fitted to it.
    contradicted
        Whether other numbers of the paper, with their rounding, leave no room for it.
    leeway
        Between which values it lies by every set of loads that the data of the fit admit.
    undecided
        Why it cannot be decided where it does not match; empty if it can.
    """

    name: str
    place: str
    what: str
    stated: str
    unit: str = ""
    how: str
    compute: Callable[[Scenario], Value]
    reason: str | Callable[[], str] = ""
    command: str = ""
    limit: bool = False
    given: bool = False
    fitted: bool = False
    contradicted: Callable[[], bool] | None = None
    leeway: Callable[[], Interval] | None = None
    undecided: str = ""

    @property
    def is_number(self) -> bool:
        """Whether a number is stated, and not a finding in words, a formula or a range."""
        try:
            Decimal(self.stated)
        except InvalidOperation:
            return False
        return True


@dataclass(frozen=True)
class Entry:
    """A line of the ledger.

    Parameters
    ----------
    statement
        What the paper states.
    printed, recovered
        Our value by the printed parameters, mission ``paper``, and by the recovered loads, mission
        ``paper-table2``; None where that mission has none.
    """

    statement: Statement
    printed: Value
    recovered: Value

    @property
    def command(self) -> str:
        """What computes our values again."""
        return self.statement.command or f"optuav ledger {self.statement.name}"

    @property
    def verdict(self) -> Verdict:
        """What follows from comparing at the digits that the paper prints."""
        told = self.statement
        if agrees(told.stated, self.printed):
            return Verdict.GIVEN if told.given else Verdict.MATCHED
        if told.limit and agrees(told.stated, self.printed, ROUND_DOWN):
            return Verdict.CUT
        if agrees(told.stated, self.recovered):
            return Verdict.FITTED if told.fitted else Verdict.RECOVERED
        if told.leeway is not None and meets(told.stated, told.leeway()):
            return Verdict.WITHIN
        if told.contradicted is not None and told.contradicted():
            return Verdict.CONTRADICTS
        return Verdict.UNDECIDED if told.undecided else Verdict.DIFFERS

    @property
    def reason(self) -> str:
        """Why the verdict is what it is, in words."""
        told = self.statement
        why = told.reason() if callable(told.reason) else told.reason
        undecided = told.undecided if self.verdict is Verdict.UNDECIDED else ""
        return "; ".join(part for part in (undecided, why) if part)

    def shown(self, value: Value) -> str:
        """A value of ours with two digits more than the paper prints, or a dash."""
        if value is None:
            return "–"
        if isinstance(value, str):
            return value
        if self.statement.given:
            return f"{value:g}"
        last = _last_digit(self.statement.stated)
        if abs(last) > 6:
            return f"{value:.6e}"
        text = f"{value:.{max(0, 2 - last)}f}"
        return f"{value:.0f}" if float(text) == round(value) else text


def agrees(stated: str, value: Value, rounding: str = ROUND_HALF_EVEN) -> bool:
    """Whether a value of ours, brought to the digits that the paper prints, is what it prints."""
    if value is None or isinstance(value, str):
        return value == stated
    step = Decimal(1).scaleb(_last_digit(stated))
    return Decimal(f"{value:.{SIGNIFICANT}g}").quantize(step, rounding=rounding) == Decimal(stated)


def setting(name: str, place: str, what: str, value: float, unit: str = "s") -> Statement:
    """A number that a caption or a sentence sets for a study."""
    return Statement(
        name=name,
        place=place,
        what=what,
        stated=f"{value:g}",
        unit=unit,
        how="what our study of the same name takes",
        compute=lambda _: float(value),
        given=True,
    )


def printed_interval(stated: str) -> Interval:
    """All values that a printed number may stand for, as rounding goes."""
    half = 0.5 * 10.0 ** _last_digit(stated)
    return float(stated) - half, float(stated) + half


def meets(stated: str, interval: Interval) -> bool:
    """Whether a printed number, as rounding goes, may lie in an interval."""
    low, high = printed_interval(stated)
    return low <= interval[1] and interval[0] <= high


def _last_digit(stated: str) -> int:
    """Power of ten of the last printed digit."""
    exponent = Decimal(stated).as_tuple().exponent
    assert isinstance(exponent, int)
    return exponent
