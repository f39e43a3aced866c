"""Design, prove and explain why: answers that are checked condition by condition."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.errors import Fault, InputError
from optuav.exercises.answers import Form
from optuav.exercises.exercise import Exercise, Grade, Kind, Task
from optuav.judge import Itinerary, audit
from optuav.mission.messages import shown
from optuav.modelling import Model


class Condition(NamedTuple):
    """A condition on an answer; the words of the last one are also said of a correct answer."""

    holds: bool
    words: str
    hint: str = ""
    score: float | None = None  # By default 1 for a correct answer, and else 0


Conditions: TypeAlias = Iterator[Condition]


@dataclass(frozen=True)
class Witness(Exercise):
    """An exercise whose answer is a witness, which the decorated function tests.

    With reasons, the answer is the letter of the right one and the witness: explain why. With a
    model, the witness proves something about it. Any other witness is a design.
    """

    form: Form = lambda task, answer: answer
    model: Callable[[Task], Model] | None = None

    @property
    def kind(self) -> Kind:  # type: ignore[override]
        """Kind of the exercise."""
        return "explain-why" if self.reasons else "prove" if self.model else "design"

    def model_of(self, task: Task) -> Model | None:
        """Return the model that the task shows."""
        return self.model(task) if self.model else None

    @np.errstate(all="ignore")  # A witness may be far from where formulas are meant to be used
    def grade(self, task: Task, answer: object) -> Grade:
        """Return the grade of a witness: the first condition that fails."""
        if task.reasons:
            reason, answer = self._reason(task, answer)
            if hint := self.reasons[reason]:
                return Grade.wrong(task, "it is not this reason", hint)
        test = Condition(True, "")
        for test in self.function(task, self.form(task, answer)):
            if not test.holds:
                return Grade.wrong(task, test.words, test.hint, test.score or 0.0)
        return Grade.correct(task, test.words, 1.0 if test.score is None else test.score)

    def _reason(self, task: Task, answer: object) -> tuple[str, object]:
        """Return the reason that an answer chooses, and its witness."""
        if isinstance(answer, tuple | list) and len(answer) == 2 and isinstance(answer[0], str):
            if reason := task.reasons.get(answer[0].strip(" ()").casefold()):
                return reason, answer[1]
        letters = ", ".join(task.reasons)
        words = f"the letter of a reason, {letters}, and a witness, such as ('a', ...)"
        raise InputError([Fault("answer", shown(answer), words)])


def flown(itinerary: Itinerary, best_s: float, least: float, rests: int = 1) -> Conditions:
    """Condition whether an itinerary flies, rests so often at most, and hovers a share of the best."""
    audited = audit(itinerary)
    if not audited or audited.replay is None:
        events = audited.replay.violations if audited.replay else audited.events
        words = f"it cannot be flown: at {events[0].time_s:.1f} s {events[0].words}"
        yield Condition(False, words, "optuav.audit(itinerary) lists all violations")
        return
    own = sum(phase.kind == "rest" for phase in audited.replay.phases)
    yield Condition(own <= rests, f"it can be flown, but has {own} rests", f"rest {rests} times at most")
    share = audited.replay.times_s["hover_time_s"] / best_s
    percent = math.floor(1000.0 * share + 1e-6) / 10.0  # 98.96 is less than 99, and reads so
    words = f"it can be flown, and hovers for {percent:.1f} % of the longest time"
    yield Condition(share >= least, words, f"at least {100.0 * least:g} % are required", min(share, 1.0))


def within(value: float, wanted: float, by: float, unit: str, name: str, hint: str) -> Condition:
    """Condition whether a quantity of a witness has the wanted value, within an amount."""
    words = f"{name} is {value:.6g} {unit}".rstrip()
    return Condition(abs(value - wanted) <= by, words, f"it must be {wanted:.6g} ± {by:g} {unit}; {hint}")
