"""The smallest single changes of a mission that make an infeasible question feasible."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from optuav.diagnosis.asked import Asked, asked
from optuav.diagnosis.conflict import conflicting
from optuav.diagnosis.feasible import confirmed, feasible
from optuav.diagnosis.keys import Key, keys
from optuav.errors import InputError, SolverError
from optuav.mission import Mission
from optuav.mission.words import shown
from optuav.modelling import affine
from optuav.modelling.check import relations
from optuav.plan import Plan
from optuav.solving import Program

SWITCH = "flight.through_buildings"
NEAR = 0.1
"""Share of a value and of its change below which both are known well enough to round them."""
NEGLIGIBLE = 1e-9
"""Share of a change that is as good as none."""
MOST_DIGITS = 8
"""Digits that a small change may ask for; engines tell no smaller ones apart."""
FINER = 6
"""Digits that are added where the rounded value is not feasible."""
WRITTEN = ".15g"
"""Every digit of a rounded value: the next shorter one may not repair."""


@dataclass(frozen=True)
class Repair:
    """A change of one key that makes the question feasible.

    Parameters
    ----------
    key
        Dotted key of the mission.
    now
        Its value.
    comparison, value
        Feasible if key >= value, <= value, or (for a switch) == value; rounded on the feasible
        side.
    up_to
        Where the feasible values end, if further on they do; None if they do not.
    resolution
        Digit to which it is rounded: the value short of it by so much is infeasible. 0 for a
        switch.
    verified
        Whether the question, asked again with the value, was found to have an answer.
    """

    key: str
    now: float
    comparison: Literal[">=", "<=", "=="]
    value: float
    up_to: float | None
    resolution: float
    verified: bool

    @property
    def size(self) -> float:
        """The change as a share of the larger of the two values; 1 for a switch."""
        if self.comparison == "==":
            return 1.0
        return abs(self.value - self.now) / max(abs(self.value), abs(self.now))

    def __str__(self) -> str:
        if self.comparison == "==":
            return f"{self.key} = {shown(self.value)}"
        if self.up_to is None:
            return f"{self.key} {self.comparison} {self.value:{WRITTEN}}"
        low, high = sorted((self.value, self.up_to))
        return f"{low:{WRITTEN}} <= {self.key} <= {high:{WRITTEN}}"

    def to_dict(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "key": self.key,
            "now": self.now,
            "comparison": self.comparison,
            "value": self.value,
            "up_to": self.up_to,
            "relative_size": self.size,
            "verified": self.verified,
        }


def repairs(
    subject: Program | Plan | Mission | str | Path, /, **options: Any
) -> tuple[Repair, ...]:
    """Single changes that make an infeasible question feasible, the smallest first.

    Each numeric key of limits, battery, body, rotor, laser, link and flight is moved up and down
    within its range, everything else held. Changes that no value in the range achieves, and those
    that break another rule of missions, are left out. Every change was verified by solving again.

    Parameters
    ----------
    subject
        What `optuav.formulate` or `optuav.solve` returned, or a mission as they take it.
    **options
        Those of `optuav.formulate`, with a mission.

    Returns
    -------
    Sorted by relative size of the change; empty if the question is feasible as it is.

    Raises
    ------
    InputError
        As `optuav.formulate`, or if a plan does not tell its question.
    """
    return repairs_of(asked(subject, options))


def repairs_of(question: Asked) -> tuple[Repair, ...]:
    """As `repairs`, for a question that is known."""
    base = question.program()
    if feasible(base):
        return ()
    found = []
    if not question.mission.flight.through_buildings:
        found.append(Repair(SWITCH, False, "==", True, None, 0.0, verified=False))
    labels = conflicting(base)
    before = _numbers(base, labels)

    def changes(program: Program) -> bool:
        return bool(_numbers(program, labels) != before)

    for key in keys(question.mission):
        judge = _judge(question, key, changes)
        found += [each for sign in (1, -1) if (each := search(key, sign, judge)) is not None]
    solved = [replace(each, verified=_solved(question, each.key, each.value)) for each in found]
    offered = [each for each in solved if each.verified]
    return tuple(sorted(offered, key=lambda each: (each.size, each.key)))


class Verdict(NamedTuple):
    """Whether a value changes any number of the programmes, and makes one of them feasible."""

    changes: bool
    repairs: bool


Judge = Callable[[float], Verdict]


def _judge(question: Asked, key: Key, changes: Callable[[Program], bool]) -> Judge:
    """What a value of a key does; one that breaks a rule of missions does nothing."""

    @cache
    def judge(value: float) -> Verdict:
        number = int(value) if key.whole else value
        try:
            program = question.program(question.mission.replace({key.name: number}))
            changed = changes(program)
            return Verdict(changed, changed and feasible(program))
        except (InputError, SolverError):
            return Verdict(changes=False, repairs=False)

    return judge


def _solved(question: Asked, key: str, value: float) -> bool:
    """Whether the question has a plan with another value of a key."""
    try:
        return confirmed(question.program(question.mission.replace({key: value})))
    except (InputError, SolverError):
        return False


def _numbers(program: Program, labels: Collection[str] | None) -> list[Any]:
    """The numbers by which a program is infeasible: while they stay, so do the certificates."""
    found: list[Any] = [program.reasons, program.question.slot_s]
    for part in program.parts:
        found.append(part.routes.tobytes())
        if labels is None:
            found += [np.asarray(each.value).tobytes() for each in part.model.parameters.values()]
            continue
        for constraint in relations(part.model):
            if constraint.label in labels:
                relation = constraint.relation
                form = affine(relation.left, {}).plus(affine(relation.right, {}), -1.0)
                numbers = [form.constant, *form.coefficients.values()]
                found += [np.asarray(number).tobytes() for number in numbers]
    return found


def search(key: Key, sign: int, judge: Judge) -> Repair | None:
    """The nearest value in a direction that repairs, and where such values end.

    Values further and further away are tried first, then the gap before the nearest of them that
    repairs is halved. What repairs only between two values that were tried is not seen.

    Parameters
    ----------
    key
        What is changed.
    sign
        1 for larger values, −1 for smaller ones.
    judge
        What a value does.
    """
    values = [*key.further(sign)]
    if not any(judge(value).changes for value in values[:1] + values[-1:]):
        return None
    place = next((k for k, value in enumerate(values) if judge(value).repairs), None)
    if place is None:
        return None
    nearest = _edge(key, sign, (key.now, *values)[place], values[place], judge)
    if nearest is None:
        return None
    value, digit = nearest
    further = [value, *replace(key, now=value).further(sign)]
    bad = next((k for k, each in enumerate(further) if not judge(each).repairs), None)
    end = _edge(key, -sign, further[bad], further[bad - 1], judge) if bad else None
    return Repair(
        key=key.name,
        now=key.now,
        comparison=">=" if sign > 0 else "<=",
        value=int(value) if key.whole else value,
        up_to=end[0] if end else None,
        resolution=10.0**digit,
        verified=False,
    )


def _edge(key: Key, sign: int, bad: float, good: float, judge: Judge) -> tuple[float, int] | None:
    """The first value that repairs on the way from a bad to a good one, and its last digit.

    It is rounded away from the bad one, to three digits of itself and two of the change or finer
    where the rounded value does not repair; None if no rounded value does.
    """
    while not key.whole and abs(good - bad) > NEAR * _size(key, good):
        middle = _between(bad, good)
        if middle in (bad, good):
            break
        bad, good = (bad, middle) if judge(middle).repairs else (middle, good)
    for digit in _digits(key, bad, good):
        unit = 10.0**digit
        low, high = math.floor(sign * bad / unit), math.ceil(sign * good / unit)
        if not judge(_decimal(sign * high, digit)).repairs:
            continue
        while high - low > 1:
            middle = (low + high) // 2
            repairs = judge(_decimal(sign * middle, digit)).repairs
            low, high = (low, middle) if repairs else (middle, high)
        while sign * low * unit > sign * key.now and judge(_decimal(sign * low, digit)).repairs:
            low, high = low - 1, low
        return _decimal(sign * high, digit), digit
    return None


def _size(key: Key, value: float) -> float:
    """The smaller of a value and its distance from the present one; of zero, what is negligible."""
    change = abs(value - key.now)
    return min(change, abs(value)) if value else NEGLIGIBLE * change


def _between(one: float, other: float) -> float:
    """The geometric mean of values far apart, the arithmetic mean of others."""
    far = one * other > 0.0 and max(abs(one), abs(other)) > 4.0 * min(abs(one), abs(other))
    return math.copysign(math.sqrt(one * other), one) if far else 0.5 * (one + other)


def _digits(key: Key, bad: float, good: float) -> range:
    """Places of the last digit, the coarsest first."""
    if key.whole:
        return range(1)
    first = math.floor(math.log10(abs(good - key.now))) - 1
    if good:
        leading = math.floor(math.log10(min(abs(good), abs(bad) or math.inf)))
        first = min(max(first, leading - MOST_DIGITS + 1), leading - 2)
    return range(first, first - FINER, -1)


def _decimal(count: int, digit: int) -> float:
    """count · 10^digit as it is written."""
    return float(f"{count}e{digit}")
