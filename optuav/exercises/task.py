"""A student's task, conditions on an answer to it, and its grade."""

import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

from optuav.errors import Fault, InputError, printed
from optuav.mission import Mission
from optuav.mission.messages import nearest
from optuav.modelling import Model

Kind: TypeAlias = Literal["predict", "declare", "design", "prove", "explain-why"]

CORRECT, WRONG, OPEN = "correct", "not correct", "no answer yet"


@dataclass(frozen=True)
class Task:
    """An exercise with a student's numbers.

    Parameters
    ----------
    number, kind
        Number of the exercise, and its kind: predict, declare, design, prove or explain-why.
    text
        Question with the numbers, and the reasons to choose from, one per line.
    numbers
        Numbers of the student, by key of the mission or by name; also ``task["name"]``.
    mission, model
        Mission with the numbers in it, and the model to prove something about, or None.
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

        content = [markup.element("p", markup.element("strong", f"Exercise {self.number}"))]
        for paragraph in self.text.split("\n"):
            words = paragraph.split("`")  # Every second piece stood between two of them
            pieces = (markup.element("code", w) if k % 2 else w for k, w in enumerate(words))
            content.append(markup.element("p", *pieces))
        return markup.shown(*content, *(html(self.model) if self.model else []))


@dataclass(frozen=True)
class Grade:
    """Verdict on an answer; true if the answer is correct.

    Parameters
    ----------
    number, verdict
        Number of the exercise, and ``"correct"``, ``"not correct"`` or ``"no answer yet"``.
    words, hint
        First mistake, or how good the answer is; and what to think about next, never the answer.
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


class Condition(NamedTuple):
    """A condition on an answer, with the words for one that breaks it."""

    holds: bool
    words: str
    hint: str = ""
    score: float | None = None  # By default 1 for a correct answer, and else 0
    is_fact: bool = False  # Whether the words are also true of a correct answer


Conditions: TypeAlias = Iterator[Condition]
