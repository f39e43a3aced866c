"""The parts of an exercise: numbers drawn for each student, its task, and grades of answers."""

import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from typing import Any, ClassVar, Literal, Self, TypeAlias

from optuav.errors import Fault, InputError, printable, printed
from optuav.mission import Mission, load
from optuav.mission.messages import nearest
from optuav.modelling import Model

Kind: TypeAlias = Literal["predict", "declare", "design", "prove", "explain-why"]
Draws: TypeAlias = Mapping[str, Any]
"""Choices of each number, by mission key or name, or a function of the numbers before."""

CORRECT, WRONG, OPEN = "correct", "not correct", "no answer yet"
LETTERS = "abcdef"
NUMBER = re.compile(r"\{([a-zA-Z][\w.]*)(?::([^}]*))?\}")


def decimals(first: float, last: float, step: float) -> tuple[float, ...]:
    """Return numbers from first to last in equal steps, each the float of its short decimal."""
    return tuple(round(first + k * step, 9) for k in range(round((last - first) / step) + 1))


@dataclass(frozen=True)
class Task:
    """An exercise with a student's numbers.

    Parameters
    ----------
    number, kind
        Number of the exercise, and its kind: predict, declare, design, prove or explain-why.
    text
        Question, with the numbers; the reasons to choose from are lines of their own.
    numbers
        Numbers drawn for the student, by key of the mission or by name; also ``task["name"]``.
    mission
        Mission of the exercise, with the numbers in it.
    model
        Model to prove something about, or None.
    reasons
        Reasons to choose from, by letter.

    Examples
    --------
    >>> from optuav import exercises
    >>> task = exercises.task("05.1", student="ada")
    >>> task.kind, task["hover_A"]
    ('declare', 80)
    """

    number: str
    kind: Kind
    text: str
    numbers: Mapping[str, float | str]
    mission: Mission
    model: Model | None = None
    reasons: Mapping[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        if name not in self.numbers:
            words = f"the numbers of exercise {self.number} are {', '.join(self.numbers)}"
            raise InputError([Fault(str(name), "", words + nearest(str(name), self.numbers))])
        return self.numbers[name]

    @printed
    def __str__(self) -> str:
        lines = [f"Exercise {self.number} ({self.kind})"]
        for paragraph in self.text.split("\n"):
            lines += textwrap.wrap(paragraph, 80, subsequent_indent="    " * (paragraph[:1] == "("))
        return "\n".join([*lines, "", str(self.model)] if self.model else lines)

    def __repr__(self) -> str:
        return f"<Task {self.number}: {self.kind}>"

    def _repr_html_(self) -> str:
        from optuav import markup
        from optuav.modelling.mathml import html

        shown = [markup.element("p", markup.element("strong", f"Exercise {self.number}"))]
        for paragraph in self.text.split("\n"):
            words = paragraph.split("`")  # Every second piece stood between two of them
            pieces = (markup.element("code", w) if k % 2 else w for k, w in enumerate(words))
            shown.append(markup.element("p", *pieces))
        return markup.shown(*shown, *(html(self.model) if self.model else []))


@dataclass(frozen=True)
class Grade:
    """Verdict on an answer; true if the answer is correct.

    Parameters
    ----------
    number
        Number of the exercise.
    verdict
        ``"correct"``, ``"not correct"`` or ``"no answer yet"``.
    words
        The first mistake, or how good the answer is.
    hint
        What to think about next; never the answer.
    score
        From 0 to 1; for an itinerary its hover time as a share of the best.

    Examples
    --------
    >>> from optuav import exercises
    >>> grade = exercises.check("02.1", 10.0, student="ada")
    >>> bool(grade), grade.verdict
    (False, 'not correct')
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
        return "\n".join(textwrap.fill(line, 80, subsequent_indent="  ") for line in lines)

    def __repr__(self) -> str:
        return f"<Grade {self.number}: {self.verdict}>"

    def _repr_html_(self) -> str:
        from optuav import markup

        verdict = "; ".join(filter(None, (f"Exercise {self.number}: {self.verdict}", self.words)))
        content = [markup.paragraph(verdict, good=None if self.verdict == OPEN else bool(self))]
        content += [markup.paragraph(f"Hint: {self.hint}")] if self.hint else []
        return markup.shown(*content)

    @classmethod
    def correct(cls, task: Task, words: str = "", score: float = 1.0) -> Self:
        """Return the grade of a correct answer."""
        return cls(task.number, CORRECT, words, score=score)

    @classmethod
    def wrong(cls, task: Task, words: str, hint: str = "", score: float = 0.0) -> Self:
        """Return the grade of an answer that is not correct."""
        return cls(task.number, WRONG, printable(words), printable(hint), score)


@dataclass(frozen=True)
class Exercise:
    """An exercise as the bank declares it: a decorator of the function that knows the answer."""

    number: str
    text: (
        str  # With names of numbers in braces, such as {limits.deadline_s} or {limits.min_soc:.0%}
    )
    draws: Draws = field(default_factory=dict)
    mission: str = "paper"
    fixed: Mapping[str, object] = field(default_factory=dict)  # Other keys of the mission
    reasons: Mapping[str, str] = field(default_factory=dict)  # With hints; the right one has none
    function: Callable[..., Any] = print  # In place of the one that is decorated
    kind: ClassVar[Kind]
    answer: ClassVar[str] = ""  # How an answer is written

    def __call__(self, function: Callable[..., Any]) -> Self:
        """Return the exercise with its function, as a decorator."""
        return replace(self, function=function)

    def grade(self, task: Task, answer: object) -> Grade:
        """Return the grade of an answer."""
        raise NotImplementedError

    def model_of(self, task: Task) -> Model | None:
        """Return the model that the task shows."""
        return None

    def task(self, student: str) -> Task:
        """Return a student's task: a hash chooses each number, so it is the same anywhere."""
        numbers = dict[str, Any]()
        for name, choices in self.draws.items():
            if callable(choices):
                numbers[name] = choices(numbers)
            else:
                numbers[name] = choices[self._hash(name, student) % len(choices)]
        keys = {name: value for name, value in numbers.items() if "." in name}
        mission = load(self.mission).replace({**self.fixed, **keys})
        ordered = sorted(self.reasons, key=lambda reason: self._hash(reason, student))
        reasons = dict(zip(LETTERS, ordered, strict=False))
        lines = [self.text, *(f"({letter}) {reason}" for letter, reason in reasons.items())]
        lines += [f"Answer: {self.answer}"] if self.answer else []
        text = filled("\n".join(lines), numbers)
        task = Task(self.number, self.kind, text, numbers, mission, None, reasons)
        return replace(task, model=self.model_of(task))

    def _hash(self, name: str, student: str) -> int:
        text = "\n".join((self.number, name, student))
        return int.from_bytes(sha256(text.encode("utf-8", "surrogatepass")).digest()[:8], "big")


def filled(text: str, numbers: Mapping[str, Any]) -> str:
    """Return a text with numbers in place of their names in braces."""
    return NUMBER.sub(lambda name: _written(numbers[name[1]], name[2]), text)


def _written(value: float | str, form: str | None) -> str:
    return value if isinstance(value, str) else format(value, form or ".10g").replace("%", " %")
