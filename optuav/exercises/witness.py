"""Design, prove and explain why: answers that are checked condition by condition."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.errors import Fault, InputError
from optuav.exercises.answers import Form, is_close, missed
from optuav.exercises.exercise import Exercise, Grade, Kind, Task
from optuav.exercises.linear import linear
from optuav.judge import Itinerary, audit
from optuav.mission.messages import shown
from optuav.modelling import Model


class Condition(NamedTuple):
    """A condition on a witness, with the words for one that breaks it."""

    holds: bool
    words: str
    hint: str = ""
    score: float | None = None  # By default 1 for a correct answer, and else 0
    is_fact: bool = False  # Whether the words are also true of a correct answer


Conditions: TypeAlias = Iterator[Condition]


@dataclass(frozen=True)
class Witness(Exercise):
    """An exercise whose answer is a witness; the decorated function yields its conditions.

    With reasons, the answer is the letter of the right one and the witness: explain why. With a
    model, the witness proves something about it. Any other witness is a design.
    """

    form: Form = Form("...", lambda task, answer: answer)
    programme: Sequence[str] = ()  # As `linear` reads it

    @property
    def kind(self) -> Kind:  # type: ignore[override]
        """Kind of the exercise."""
        return "explain-why" if self.reasons else "prove" if self.programme else "design"

    def model_of(self, task: Task) -> Model | None:
        """Return the model that the task shows."""
        return linear(task, self.programme) if self.programme else None

    @property
    def answer(self) -> str:  # type: ignore[override]
        """Form in which an answer is written."""
        example = self.form.example
        if self.reasons:
            return f"the letter of the reason and a witness, such as ('a', {example})"
        return f"such as {example}"

    @np.errstate(all="ignore")  # A witness may be far from where formulas are meant to be used
    def grade(self, task: Task, answer: object) -> Grade:
        """Return the grade of a witness: the first condition that it breaks, then its reason."""
        objection = ""
        if task.reasons:
            reason, answer = self._reason(task, answer)
            objection = self.reasons[reason]
        last = Condition(True, "")
        for last in self.function(task, self.form.read(task, answer)):
            if not last.holds:
                return Grade.wrong(task, last.words, last.hint, last.score or 0.0)
        if objection:  # Only now, so that nobody can test letters without a witness
            words = "the witness is right, but the reason does not hold"
            return Grade.wrong(task, words, objection)
        score = 1.0 if last.score is None else last.score
        return Grade.correct(task, last.words if last.is_fact else "", score)

    def _reason(self, task: Task, answer: object) -> tuple[str, object]:
        """Return the reason that an answer chooses, and its witness."""
        if isinstance(answer, tuple | list) and len(answer) == 2 and isinstance(answer[0], str):
            letter = answer[0].strip(" ()").casefold()
            if letter in task.reasons:
                return task.reasons[letter], answer[1]
        words = f"the letter of a reason, {', '.join(task.reasons)}, and a witness, ('a', ...)"
        raise InputError([Fault("answer", shown(answer), words)])


def flown(itinerary: Itinerary, rests: int = 1) -> Conditions:
    """Yield whether an itinerary can be flown, and rests so often at most."""
    audited = audit(itinerary)
    if not audited:
        events = audited.replay.violations if audited.replay else audited.events
        words = f"it cannot be flown: at {events[0].time_s:.1f} s {events[0].words}"
        yield Condition(False, words, "optuav.audit(itinerary) lists all violations")
    own = sum(stop.kind == "rest" for stop in itinerary.stops)
    words = f"it can be flown, but has {own} rest{'s' * (own != 1)}"
    yield Condition(own <= rests, words, f"the most rests allowed: {rests}")


def longest(itinerary: Itinerary, best_s: float, least: float, rests: int = 1) -> Conditions:
    """Yield whether an itinerary can be flown, and hovers for a share of the longest time."""
    yield from flown(itinerary, rests)
    hover_s = sum(stop.duration_s for stop in itinerary.stops if stop.kind == "hover")
    share = hover_s / best_s
    percent = math.floor(1000.0 * share + 1e-6) / 10.0  # 98.96 is less than 99, and reads so
    words = f"it can be flown, and hovers for {percent:.1f} % of the longest time"
    hint = f"at least {100.0 * least:g} % are required"
    yield Condition(share >= least, words, hint, min(share, 1.0), True)


def equals(value: float, truth: float, within: float, unit: str, hint: str) -> Condition:
    """Return whether a figure is the true one, within an amount, without naming the truth."""
    words, reason = missed(value, truth, within, unit)
    return Condition(is_close(value, truth, within), f"{value:g} {unit}: {words}", reason or hint)


def within(name: str, value: float, wanted: float, by: float, unit: str, hint: str) -> Condition:
    """Return whether a quantity of a witness has the wanted value, within an amount."""
    holds = abs(value - wanted) <= by
    side = "" if holds or math.isnan(value) else ", too much" if value > wanted else ", too little"
    words = f"{name} is {value:.6g} {unit}".rstrip() + side
    hint = f"{wanted:.6g} ± {by:.3g} {unit} is required; {hint}"
    return Condition(holds, words, hint, None, True)
