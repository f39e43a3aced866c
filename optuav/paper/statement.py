"""A statement of the paper, its entry in the ledger, and the verdict that follows."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_DOWN, ROUND_HALF_EVEN, Decimal, InvalidOperation
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Any, TypeAlias

Value: TypeAlias = float | str | None
Interval: TypeAlias = tuple[float, float]

STATEMENTS = "statements.toml"
SIGNIFICANT = 12  # Digits of our values that count; those after them are rounding of floats


@cache
def data() -> dict[str, Any]:
    """The file of the paper's statements."""
    return tomllib.loads(files("optuav.paper").joinpath(STATEMENTS).read_text("utf-8"))


class Verdict(StrEnum):
    """How a number of the paper compares with ours."""

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
class PaperStatement:
    """A number of the paper, or a finding in words, as the file of the statements describes it.

    `compute` names the function of our value and its arguments, `room` that of the values which the
    other numbers of the paper leave for it, and `flight` the only flight model for which both are
    defined. `given` marks a setting that the missions take.
    """

    name: str
    place: str
    what: str
    stated: str
    unit: str = ""
    how: str
    compute: Sequence[Any] = ()
    room: Sequence[Any] = ()
    flight: str = ""
    reason: str = ""
    undecided: str = ""
    command: str = ""
    limit: bool = False
    given: bool = False
    fitted: bool = False

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
    """A statement with our value by the printed parameters, and by the recovered loads.

    The missions are ``paper`` and ``paper-table2``; a value is None where it does not apply. `room`
    is what the other numbers of the paper leave for the value, where the statement asks for it.
    """

    statement: PaperStatement
    printed: Value
    recovered: Value
    room: Value | Interval = None

    @property
    def command(self) -> str:
        """The command that computes our values again."""
        return self.statement.command or f"optuav ledger {self.statement.name}"

    @property
    def verdict(self) -> Verdict:
        """The verdict at the digits that the paper prints."""
        paper = self.statement
        if agrees(paper.stated, self.printed):
            return Verdict.GIVEN if paper.given else Verdict.MATCHED
        if paper.limit and agrees(paper.stated, self.printed, ROUND_DOWN):
            return Verdict.CUT
        if agrees(paper.stated, self.recovered):
            return Verdict.FITTED if paper.fitted else Verdict.RECOVERED
        if paper.room:
            return Verdict.WITHIN if fits(paper.stated, self.room) else Verdict.CONTRADICTS
        return Verdict.UNDECIDED if paper.undecided else Verdict.DIFFERS

    @property
    def reason(self) -> str:
        """Why the verdict is what it is; may be empty."""
        undecided = self.statement.undecided if self.verdict is Verdict.UNDECIDED else ""
        return "; ".join(part for part in (undecided, self.statement.reason) if part)

    def shown(self, value: Value) -> str:
        """A value of ours with two digits more than the paper prints, or a dash."""
        if value is None:
            return "–"
        if isinstance(value, str):
            return value
        last = last_digit(self.statement.stated)
        if self.statement.given:
            return f"{value:g}"
        if abs(last) > 6:
            return f"{value:.6e}"
        text = f"{value:.{max(0, 2 - last)}f}"
        return f"{value:.0f}" if float(text) == round(value) else text


def agrees(stated: str, value: Value, rounding: str = ROUND_HALF_EVEN) -> bool:
    """Whether our value, rounded to the printed digits, is the printed one."""
    if value is None or isinstance(value, str):
        return value == stated
    step = Decimal(1).scaleb(last_digit(stated))
    return Decimal(f"{value:.{SIGNIFICANT}g}").quantize(step, rounding=rounding) == Decimal(stated)


def fits(stated: str, room: Value | Interval) -> bool:
    """Whether what is printed, rounding included, may be a given value or lie in an interval."""
    if room is None or isinstance(room, str):
        return room == stated
    least, most = room if isinstance(room, tuple) else (room, room)
    low, high = printed_interval(stated)
    return low <= most and least <= high


def printed_interval(stated: str) -> Interval:
    """All values that a printed number stands for."""
    half = 0.5 * 10.0 ** last_digit(stated)
    return float(stated) - half, float(stated) + half


def last_digit(stated: str) -> int:
    """Power of ten of the last printed digit."""
    exponent = Decimal(stated).as_tuple().exponent
    assert isinstance(exponent, int)
    return exponent
