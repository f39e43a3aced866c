"""Predict: a figure, some with a word, with hints for the mistakes that are often made."""

import math
import numbers
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TypeAlias

from optuav.errors import Fault, InputError
from optuav.exercises.exercise import Draws, Exercise, Grade, Task, is_close, plain
from optuav.mission.messages import shown

Predictions: TypeAlias = Iterator[tuple[float | str, str]]
"""The true answer with a hint for any other one; then wrong answers with a hint for each.

Before them the true word with its hint, where a word is asked for as well.
"""

FACTORS = (100.0, 1000.0)  # Percent, thousands
NEAR = 0.1  # How far an answer may be from a usual mistake, relative to it, if within the tolerance
OF_TIME = (60.0, 3600.0)  # Minutes, hours
TIMES = ("s", "h", "A s", "1/s")  # Units in which these are often taken for another


def predict(
    number: str,
    text: str,
    *,
    unit: str = "",
    within: float = 0.0,
    among: Sequence[str] = (),
    mission: str = "paper",
    draws: Draws | None = None,
    fixed: Mapping[str, object] | None = None,
) -> Callable[[Callable[[Task], Predictions]], Exercise]:
    """An exercise whose answer is a figure in a unit within a tolerance.

    Where it is one of some words as well, the answer is a pair of this and the figure.
    """

    def declared(function: Callable[[Task], Predictions]) -> Exercise:
        grade = partial(_grade, function, unit, within, among)
        return Exercise(number, "predict", text, grade, mission, draws or {}, fixed or {})

    return declared


def _grade(
    function: Callable[[Task], Predictions],
    unit: str,
    within: float,
    among: Sequence[str],
    task: Task,
    answer: object,
) -> Grade:
    """The grade of a figure, or of a word and a figure."""
    found = function(task)
    if not among:
        return _figure(found, figure_of(answer, unit), unit, within, task)
    word, value = _pair(answer, unit, among)
    truth, hint = next(found)
    if word != truth:
        return Grade.wrong(task, "it is not this word", hint)
    return _figure(found, value, unit, within, task)


def _figure(found: Predictions, value: float, unit: str, within: float, task: Task) -> Grade:
    """The grade of a figure."""
    truth, hint = next(found)
    assert not isinstance(truth, str)
    if is_close(value, truth, within):
        return Grade.correct(task, f"within {within:g} {unit}".rstrip() if within else "")
    for wrong, words in found:
        if not isinstance(wrong, str) and is_close(value, wrong, min(within, NEAR * abs(wrong))):
            return Grade.wrong(task, "a common mistake", words)
    factors = (*FACTORS, *(OF_TIME if unit in TIMES else ())) if unit else ()
    near = 0.01 * abs(truth)
    if within and is_close(value, truth, near):
        words = f"close, but not within {within:g} {unit}".rstrip()
        return Grade.wrong(task, words, "keep more digits until the end")
    if any(is_close(x, truth, near) for k in factors for x in (value * k, value / k)):
        return Grade.wrong(task, "off by a power of ten or of sixty", f"the unit is {unit}")
    if is_close(-value, truth, within):
        return Grade.wrong(task, "the sign is wrong", hint)
    return Grade.wrong(task, "too large" if value > truth else "too small", hint)


def figure_of(answer: object, unit: str = "") -> float:
    """The finite number that an answer is; `InputError` if it is none."""
    number = plain(answer)
    if isinstance(number, numbers.Real) and not isinstance(number, bool):
        with suppress(OverflowError):
            if math.isfinite(value := float(number)):
                return value
    words = f"a finite number [{unit}]" if unit else "a finite number"
    raise InputError([Fault("answer", shown(answer), words)])


def _pair(answer: object, unit: str, among: Sequence[str]) -> tuple[str, float]:
    """The word and the finite number that an answer is; `InputError` if it is none."""
    if isinstance(answer, tuple | list) and len(answer) == 2 and isinstance(answer[0], str):
        word, figure = answer
        if (word := word.strip().casefold()) in among:
            return word, figure_of(figure, unit)
    words = f"one of {', '.join(map(repr, among))} and a number [{unit}], as ({among[0]!r}, 10.0)"
    raise InputError([Fault("answer", shown(answer), words)])
