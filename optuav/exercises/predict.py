"""Predict: a figure that the model decides, with hints for the mistakes that are often made."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

from optuav.exercises.answers import figure
from optuav.exercises.exercise import Exercise, Grade, Kind, Task

Predictions: TypeAlias = Iterator[tuple[float, str]]
"""The true answer with a hint for any other one; then wrong answers with a hint for each."""

NEAR = 0.1  # How far an answer may be from a usual mistake, relative to it, if within the tolerance
ROUNDED = 0.01  # Relative distance from the truth that rounding may explain
FACTORS = {100.0: "a factor of 100", 1000.0: "a factor of 1000"}
OF_TIME = {60.0: "minutes for seconds", 3600.0: "hours for seconds"}


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
        tolerance = f"within {self.within:g} {self.unit}".rstrip()
        if is_close(value, truth, self.within):
            return Grade.correct(task, tolerance)
        for wrong, words in predictions:
            if is_close(value, wrong, min(self.within, NEAR * abs(wrong))):
                return Grade.wrong(task, "a common mistake", words)
        near = ROUNDED * abs(truth)
        if is_close(value, truth, near):
            words = f"close, but not {tolerance}: it looks rounded"
            return Grade.wrong(
                task, words, f"keep all digits until the end, and answer {tolerance}"
            )
        for factor, words in {**FACTORS, **(OF_TIME if self.unit == "s" else {})}.items():
            if any(is_close(x, truth, near) for x in (value * factor, value / factor)):
                return Grade.wrong(task, f"off by {words}", f"the unit is {self.unit}")
        if is_close(-value, truth, self.within):
            return Grade.wrong(task, "the sign is wrong", hint)
        return Grade.wrong(task, "too large" if value > truth else "too small", hint)


def is_close(value: float, other: float, within: float) -> bool:
    """Whether two figures agree within an amount, with room for the last digits."""
    return math.isfinite(other) and abs(value - other) <= within * (1.0 + 1e-9)
