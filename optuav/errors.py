"""The errors that optuav raises on purpose, and the fault of which an input error is made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

MOST_SHOWN = 20
"""Faults that a message lists one by one."""


class OptuavError(Exception):
    """Anything that optuav refuses or could not do, in words for a person."""


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input.

    Parameters
    ----------
    key
        Dotted name of the field, for example ``"limits.min_soc"``; empty for the input as a whole.
    value
        The offending value as a short text; empty where there is none (a missing key).
    allowed
        What would have been accepted, in words.
    source
        File, option or argument in which the value was stated.
    """

    key: str
    value: str
    allowed: str
    source: str = ""

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.source, self.key) if part)
        what = f" = {self.value}" if self.value and self.key else self.value
        return f"{where}{what}: {self.allowed}" if where or what else self.allowed


class InputError(OptuavError, ValueError):
    """Input that cannot be used: `faults` has all that is wrong, the message the first of it.

    Parameters
    ----------
    faults
        All that is wrong, at least one; or words on the input as a whole.
    """

    def __init__(self, faults: Iterable[Fault] | str) -> None:
        self.faults: tuple[Fault, ...] = (
            (Fault("", "", faults),) if isinstance(faults, str) else tuple(faults)
        )
        super().__init__(self.faults)

    def __str__(self) -> str:
        lines = [str(fault) for fault in self.faults[:MOST_SHOWN]]
        more = len(self.faults) - len(lines)
        return "\n".join([*lines, f"and {more} more"] if more else lines)


class NoPlanError(OptuavError):
    """A time or a state was asked of a plan that does not exist (infeasible or not solved)."""


class SolverError(OptuavError):
    """An engine failed, or did not prove its answer in the time allowed."""
