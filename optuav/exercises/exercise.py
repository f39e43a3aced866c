"""An exercise: its text with numbers of each student, and its check with hints."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from hashlib import sha256
from inspect import getdoc
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from optuav.errors import Fault, InputError, OptuavError, printable
from optuav.exercises.linear import IN_BRACES, filled, linear
from optuav.exercises.task import CORRECT, WRONG, Condition, Conditions, Grade, Kind, Task
from optuav.mission import Mission, load
from optuav.mission.messages import shown

Draws: TypeAlias = Mapping[str, Any]
"""Choices of each number, by mission key or name, or a function of the numbers before."""

LETTERS = "abcdef"
REASON = re.compile(r"^[+-] (.+)(?:\n  (.+))?", re.MULTILINE)
"""A reason in a docstring; a hint stands below those that do not hold, after a minus."""


def decimals(first: float, second: float, last: float) -> tuple[float, ...]:
    """Return numbers in equal steps, each the float of its short decimal."""
    steps = round((last - first) / (second - first))
    return tuple(round(first + k * (second - first), 9) for k in range(steps + 1))


class Form(NamedTuple):
    """The form of an answer: an example, and how it is read, or refused with an `InputError`."""

    example: str
    read: Callable[[Task, object], Any]
    unit: str = ""


AS_IT_IS = Form("", lambda task, answer: answer)


@dataclass(frozen=True)
class Exercise:
    """An exercise: a check of answers, whose docstring is its text.

    Numbers stand in the text or the programme in braces, at first with their choices, such as
    {less:.1% = 0.05, 0.051 .. 0.22}, or are among `draws`. With reasons below the text, the answer
    is the letter of the right one and a witness. With a programme, the task has a model.
    """

    check: Callable[[Task, Any], Conditions]
    number: str
    kind: Kind
    form: Form
    mission: str | Mission
    draws: Draws
    programme: Sequence[str]

    @cached_property
    def text(self) -> str:
        """Text and reasons with the choices of numbers."""
        if not (text := getdoc(self.check)):
            raise OptuavError("texts of exercises are docstrings: run Python without -OO")
        return text

    @property
    def reasons(self) -> Mapping[str, str]:
        """Hint against each reason; the right one has none."""
        return dict(REASON.findall(self.text))

    @property
    def choices(self) -> Draws:
        """Choices of each number by name, at last those that follow; whole numbers stay whole."""
        choices_of = {
            name: decimals(float(first), float(second), float(last))
            if "." in first
            else range(int(first), int(last) + 1, int(second) - int(first))
            for name, _, first, second, last in IN_BRACES.findall(
                "\n".join((self.text, *self.programme))
            )
            if last and name not in self.draws
        }
        return {**choices_of, **self.draws}

    def task(self, student: str) -> Task:
        """Return a student's task: a hash chooses each number, so it is the same anywhere."""
        numbers = dict[str, Any]()
        for name, choices in self.choices.items():
            if callable(choices):
                numbers[name] = choices(numbers)
            else:
                numbers[name] = choices[self._hash(name, student) % len(choices)]
        keys = {name: value for name, value in numbers.items() if "." in name}
        ordered = sorted(self.reasons, key=lambda reason: self._hash(reason, student))
        reasons = dict(zip(LETTERS, ordered, strict=False))
        asked, (example, _, unit) = " ".join(REASON.sub("", self.text).split()), self.form
        lines = [asked, *(f"({letter}) {reason}" for letter, reason in reasons.items())]
        if reasons:
            witness = f"a witness{unit}, such as ('a', {example})"
            lines.append(f"Answer: the letter of the reason and {witness}")
        elif example:
            lines.append(f"Answer{unit}: such as {example}")
        return Task(
            self.number,
            self.kind,
            filled("\n".join(lines), numbers),
            numbers,
            load(self.mission).replace(keys),
            linear(numbers, self.programme) if self.programme else None,
            reasons,
        )

    def read(self, task: Task, answer: object) -> tuple[str, Any]:
        """Return the hint against the reason that an answer chooses, and the rest of the answer."""
        if not task.reasons:
            return "", self.form.read(task, answer)
        if isinstance(answer, tuple | list) and len(answer) == 2 and isinstance(answer[0], str):
            letter = answer[0].strip(" ()").casefold()
            if letter in task.reasons:
                return self.reasons[task.reasons[letter]], self.form.read(task, answer[1])
        letters = ", ".join(task.reasons)
        words = f"a pair: the letter of a reason ({letters}) and a witness, such as ('a', ...)"
        raise InputError([Fault("answer", shown(answer), words)])

    @np.errstate(all="ignore")  # An answer may be far from where formulas are meant to be used
    def grade(self, task: Task, objection: str, answer: Any) -> Grade:
        """Return the grade of what was read: the first condition that it breaks, then its reason.

        Only then, so that nobody can test letters without a witness.
        """
        last = Condition(True, "")
        for last in self.check(task, answer):
            if not last.holds:
                words, hint = printable(last.words), printable(last.hint)
                return Grade(task.number, WRONG, words, hint, last.score or 0.0)
        if objection:
            words = "the witness is right, but the reason does not hold"
            return Grade(task.number, WRONG, words, objection)
        score = 1.0 if last.score is None else last.score
        return Grade(task.number, CORRECT, last.words if last.is_fact else "", score=score)

    def _hash(self, name: str, student: str) -> int:
        text = "\n".join((self.number, name, student))
        return int.from_bytes(sha256(text.encode("utf-8", "surrogatepass")).digest()[:8], "big")


def exercise(
    kind: Kind,
    number: str,
    form: Form = AS_IT_IS,
    mission: str | Mission = "paper",
    *,
    draws: Draws = MappingProxyType({}),
    programme: Sequence[str] = (),
) -> Callable[[Callable[[Task, Any], Conditions]], Exercise]:
    """Declare an exercise by its check, as a decorator."""
    return lambda check: Exercise(check, number, kind, form, mission, draws, programme)


predict, declare, design = (partial(exercise, kind) for kind in ("predict", "declare", "design"))
prove, explain = partial(exercise, "prove"), partial(exercise, "explain-why")
