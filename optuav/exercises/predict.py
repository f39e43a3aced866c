"""Predict: a figure that the model decides, with hints for the mistakes that are often made."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from optuav.exercises.answers import figure, is_close, missed
from optuav.exercises.exercise import Exercise, Grade, Kind, Task

Predictions: TypeAlias = Iterator[tuple[float, str]]
"""The true answer with a hint for any other one; then wrong answers with a hint for each."""

NEAR = 0.1  # How far an answer may be from a usual mistake, relative to it, if within the tolerance


@dataclass(frozen=True)
class Predict(Exercise):
    """An exercise whose answer is a figure in a unit within a tolerance.

    The decorated function yields `Predictions`.
    """

    unit: str = ""
    within: float = 0.0
    kind: ClassVar[Kind] = "predict"

    def grade(self, task: Task, answer: object) -> Grade:
        """Return the grade of a figure."""
        value = figure(self.unit).read(task, answer)
        predictions: Predictions = self.function(task)
        truth, hint = next(predictions)
        if is_close(value, truth, self.within):
            return Grade.correct(task, f"within {self.within:g} {self.unit}".rstrip())
        for wrong, words in predictions:
            if is_close(value, wrong, min(self.within, NEAR * abs(wrong))):
                return Grade.wrong(task, "a common mistake", words)
        words, reason = missed(value, truth, self.within, self.unit)
        return Grade.wrong(task, words, reason or hint)
