"""A student's task, conditions on an answer to it, and its grade."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.messages import nearest
from optuav.modelling import Model
from optuav.presentation.blocks import Block, Facts, Heading, Note
from optuav.presentation.presented import Presented
from optuav.presentation.text import as_text

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

    def __str__(self) -> str:
        text = Note([f"Exercise {self.number} ({self.kind})", *self.text.split("\n")])
        return "\n\n".join([as_text([text]), *([str(self.model)] if self.model else [])])

    def __repr__(self) -> str:
        return f"<Task {self.number}: {self.kind}>"

    def _repr_html_(self) -> str:
        from optuav.modelling.mathml import html
        from optuav.presentation import markup

        content = [markup.element("p", markup.element("strong", f"Exercise {self.number}"))]
        for paragraph in self.text.split("\n"):
            words = paragraph.split("`")  # Every second piece stood between two of them
            pieces = (markup.element("code", w) if k % 2 else w for k, w in enumerate(words))
            content.append(markup.element("p", *pieces))
        return markup.page(*content, *(html(self.model) if self.model else []))


@dataclass(frozen=True)
class Grade(Presented):
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

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict, and a hint if there is one."""
        verdict = "; ".join(filter(None, (f"exercise {self.number}: {self.verdict}", self.words)))
        yield Heading(verdict, good=None if self.verdict == OPEN else bool(self))
        if self.hint:
            yield Facts([("Hint", self.hint)])

    def __repr__(self) -> str:
        return f"<Grade {self.number}: {self.verdict}>"


class Condition(NamedTuple):
    """A condition on an answer, with the words for one that breaks it."""

    holds: bool
    words: str
    hint: str = ""
    score: float | None = None  # By default 1 for a correct answer, and else 0
    is_fact: bool = False  # Whether the words are also true of a correct answer


Conditions: TypeAlias = Iterator[Condition]
