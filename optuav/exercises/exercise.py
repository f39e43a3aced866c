"""What an exercise is made of: numbers drawn for each student, its task, and grades of answers."""

import math
import operator
import re
import textwrap
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from functools import reduce
from hashlib import sha256
from typing import Any, Literal, TypeAlias

import numpy as np

from optuav.errors import Fault, InputError, printable, printed
from optuav.mission import Mission, load
from optuav.mission.messages import nearest
from optuav.modelling import Model
from optuav.modelling.expression import Operand

Kind: TypeAlias = Literal["predict", "declare", "prove", "design"]
Draws: TypeAlias = Mapping[str, Sequence[float | str]]
"""What a student's numbers are chosen from, by key of the mission or by name."""

CORRECT, WRONG, OPEN = "correct", "not correct", "no answer yet"
LARGEST = 300  # Power of ten from which on a decimal is none to compute with
NUMBER = re.compile(r"\{([\w.]+)(?::([^}]*))?\}")


def decimals(first: float, last: float, step: float) -> tuple[float, ...]:
    """Numbers from the first to the last in equal steps, each the float of its short decimal."""
    return tuple(round(first + k * step, 9) for k in range(round((last - first) / step) + 1))


@dataclass(frozen=True)
class Task:
    """An exercise with a student's numbers.

    Parameters
    ----------
    number, kind
        Number of the exercise, and what is to be done: predict, declare, prove or design.
    text
        What is asked, with the numbers.
    numbers
        What was drawn for the student, by key of the mission or by name; ``task["name"]`` too.
    mission
        The mission in question, with the numbers in it.
    model
        The model whose optimum or conflict is to be proved; None in other exercises.

    Examples
    --------
    >>> from optuav import exercises
    >>> task = exercises.task("02.1", student="ada")
    >>> task.kind, task["capacity_mAh"]
    ('predict', 6000)
    """

    number: str
    kind: Kind
    text: str
    numbers: Mapping[str, float | str]
    mission: Mission
    model: Model | None = None

    def __getitem__(self, name: str) -> Any:
        if name not in self.numbers:
            words = f"the numbers of exercise {self.number} are {', '.join(self.numbers)}"
            raise InputError([Fault(str(name), "", words + nearest(str(name), self.numbers))])
        return self.numbers[name]

    @printed
    def __str__(self) -> str:
        lines = [f"Exercise {self.number} ({self.kind})", *textwrap.wrap(self.text, 80)]
        return "\n".join([*lines, "", str(self.model)] if self.model else lines)

    def __repr__(self) -> str:
        return f"<Task {self.number}: {self.kind}>"

    def _repr_html_(self) -> str:
        from optuav import markup
        from optuav.modelling.mathml import html

        heading = markup.element("strong", f"Exercise {self.number} ({self.kind})")
        model = html(self.model) if self.model else []
        words = self.text.split("`")  # Every second piece stood between two of them
        said = (markup.element("code", w) if k % 2 else w for k, w in enumerate(words))
        return markup.shown(markup.element("p", heading), markup.element("p", *said), *model)


@dataclass(frozen=True)
class Grade:
    """What a grader says of an answer; true where it is correct.

    Parameters
    ----------
    number
        Number of the exercise.
    verdict
        ``"correct"``, ``"not correct"`` or ``"no answer yet"``.
    words
        What is off, or how good the answer is.
    hint
        What to think about next; never the answer.
    score
        From 0 to 1; of an itinerary its hover time as a share of the best.

    Examples
    --------
    >>> from optuav import exercises
    >>> grade = exercises.check("02.1", 10.0, student="ada")
    >>> bool(grade), grade.words
    (False, 'a common mistake')
    >>> print(grade)
    exercise 02.1: not correct; a common mistake
    Hint: both packs are emptied
    """

    number: str
    verdict: str
    words: str = ""
    hint: str = ""
    score: float = 0.0

    def __bool__(self) -> bool:
        return self.verdict == CORRECT

    @printed
    def __str__(self) -> str:
        head = f"exercise {self.number}: {self.verdict}"
        lines = [f"{head}; {self.words}" if self.words else head]
        lines += [f"Hint: {self.hint}"] if self.hint else []
        return "\n".join(textwrap.fill(each, 80, subsequent_indent="  ") for each in lines)

    def __repr__(self) -> str:
        return f"<Grade {self.number}: {self.verdict}>"

    def _repr_html_(self) -> str:
        from optuav import markup

        said = "; ".join(filter(None, (f"Exercise {self.number}: {self.verdict}", self.words)))
        content = [markup.paragraph(said, good=None if self.verdict == OPEN else bool(self))]
        content += [markup.paragraph(f"Hint: {self.hint}")] if self.hint else []
        return markup.shown(*content)

    @classmethod
    def correct(cls, task: Task, words: str = "", score: float = 1.0) -> "Grade":
        """The grade of a correct answer."""
        return cls(task.number, CORRECT, words, score=score)

    @classmethod
    def wrong(cls, task: Task, words: str, hint: str = "", score: float = 0.0) -> "Grade":
        """The grade of an answer that is not correct."""
        return cls(task.number, WRONG, printable(words), printable(hint), score)


@dataclass(frozen=True)
class Exercise:
    """An exercise as a part of the course declares it."""

    number: str
    kind: Kind
    text: str  # With names of numbers in braces, as {limits.deadline_s} or {limits.min_soc:.0%}
    grade: Callable[[Task, object], Grade]
    mission: str = "paper"
    draws: Draws = field(default_factory=dict)
    fixed: Mapping[str, object] = field(default_factory=dict)  # Other keys of the mission
    model: Callable[[Task], Model] | None = None

    def task(self, student: str) -> Task:
        """The task of a student: each number is chosen by a hash, and so the same anywhere."""
        numbers = {name: self._drawn(name, student) for name in self.draws}
        stated = {name: each for name, each in numbers.items() if "." in name}
        mission = load(self.mission).replace({**self.fixed, **stated})
        text = NUMBER.sub(lambda found: _written(numbers[found[1]], found[2]), self.text)
        task = Task(self.number, self.kind, text, numbers, mission)
        return replace(task, model=self.model(task)) if self.model else task

    def _drawn(self, name: str, student: str) -> float | str:
        choices = self.draws[name]
        drawn = "\n".join((self.number, name, student))
        digest = sha256(drawn.encode("utf-8", "surrogatepass")).digest()
        return choices[int.from_bytes(digest[:8], "big") % len(choices)]


def programme(
    title: str,
    goal: Mapping[str, tuple[str, str, float]],
    rows: Mapping[str, tuple[Mapping[str, float], float]],
    *,
    sense: Literal["maximise", "minimise"] = "maximise",
    binary: Collection[str] = (),
) -> Model:
    """A linear model from its numbers.

    The goal has symbol, unit and coefficient of each unknown; the rows have coefficients and limit,
    and are ≤ where the goal is maximised, else ≥.
    """
    model = Model(title)
    unknowns = {
        name: model.variable(name, symbol, unit=unit, binary=name in binary)
        for name, (symbol, unit, _) in goal.items()
    }

    def total(coefficients: Mapping[str, float]) -> Operand:
        terms = [(c, unknowns[name]) for name, c in coefficients.items() if c]
        return reduce(operator.add, (x if c == 1.0 else c * x for c, x in terms))

    (model.maximise if sense == "maximise" else model.minimise)(
        total({name: each[2] for name, each in goal.items()})
    )
    for label, (coefficients, limit) in rows.items():
        side = total(coefficients)
        model.subject_to(label, side <= limit if sense == "maximise" else side >= limit)
    return model


def _written(value: float | str, form: str | None) -> str:
    """A number in a text."""
    return value if isinstance(value, str) else format(value, form or ".10g").replace("%", " %")


def plain(value: object) -> object:
    """A number in the types of `numbers`, where it is an array of one number or a decimal."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return value.item()
    if isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) < LARGEST:
        return Fraction(value)
    return value


def is_close(value: float, other: float, within: float) -> bool:
    """Whether two figures agree within an amount, with room for the last digits."""
    return math.isfinite(other) and abs(value - other) <= within * (1.0 + 1e-9)
