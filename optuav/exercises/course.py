"""Functions for students: the numbers of all exercises, a task, and its grade."""

import linecache
import re
import traceback
import unicodedata
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from types import EllipsisType, FrameType

from formulations.formulation import Formulation
from optuav.errors import MOST_SHOWN, Fault, InputError, OptuavError, printable
from optuav.exercises.exercise import Exercise
from optuav.exercises.task import OPEN, WRONG, Grade, Task
from optuav.mission.messages import nearest, shown

PARTS = ("battery", "optimisation", "models")
"""Files of exercises."""

RENUMBERED = {"10": "12", "11": "10", "12": "11"}
"""Lessons that have another number now."""


@cache
def _exercises() -> Mapping[str, Exercise]:
    """Every exercise by number."""
    parts = (vars(import_module(f"optuav.exercises.{part}")) for part in PARTS)
    items = (item for part in parts for item in part.values())
    exercises = {item.number: item for item in items if isinstance(item, Exercise)}
    return dict(sorted(exercises.items()))


def numbers(lesson: str = "") -> tuple[str, ...]:
    """Return the numbers of the exercises, in order.

    Parameters
    ----------
    lesson
        Number of a lesson, such as ``"01"``; all lessons by default.

    Returns
    -------
    Numbers as `task` and `check` take them.

    Examples
    --------
    >>> from optuav import exercises
    >>> exercises.numbers("01")[0]
    '01.1'
    """
    beginning = f"{lesson}." if lesson else ""
    return tuple(number for number in _exercises() if number.startswith(beginning))


def task(number: str, student: str = "") -> Task:
    """Return an exercise with the numbers of a student.

    Parameters
    ----------
    number
        Its number, such as ``"01.2"``; `numbers` lists them.
    student
        Any text that names the student, such as a matriculation number; without one, the numbers
        are those of the lessons' worked solutions.

    Returns
    -------
    Task
        Its text, and the mission, the model and the numbers that it is about.

    Raises
    ------
    InputError
        If there is no such exercise, or the student is not a text.

    Examples
    --------
    >>> from optuav import exercises
    >>> task = exercises.task("01.1", student="ada")
    >>> task.mission.battery.capacity_As == task["battery.capacity_As"]
    True
    """
    exercises, faults = _exercises(), list[Fault]()
    if not isinstance(number, str) or number not in exercises:
        faults.append(Fault("number", shown(number), _unknown(number, exercises)))
    if not isinstance(student, str):
        faults.append(Fault("student", shown(student), "a text, as student='123456'"))
    if faults:
        raise InputError(faults)
    return exercises[number].task(unicodedata.normalize("NFC", student.strip()))


def _unknown(number: object, known: Mapping[str, Exercise]) -> str:
    """Say that no exercise has a number, and list the exercises of its lesson now."""
    text = number if isinstance(number, str) else shown(number)
    text = f"0{text}" if re.fullmatch(r"[0-9]\.[0-9]+", text) else text
    if text in known or not re.fullmatch(r"([0-3][0-9]|A[12])\.[0-9]+", text):
        return f"no exercise has this number{nearest(text, known)}; there are {', '.join(known)}"
    lesson = text.partition(".")[0]
    places = [f"in lesson {lesson} there is now {_exercise_words(lesson, known)}"]
    if lesson in RENUMBERED:
        now = RENUMBERED[lesson]
        places.append(
            f"the lesson that was {lesson} is {now} now, with {_exercise_words(now, known)}"
        )
    return f"no exercise has this number any more; {'; '.join(places)}"


def _exercise_words(lesson: str, known: Mapping[str, Exercise]) -> str:
    named = [f"{number} ({known[number].kind})" for number in numbers(lesson)]
    return ", ".join(named) or "no exercise"


def check(number: str, answer: object, student: str = "") -> Grade:
    """Grade an answer to an exercise, with a hint where it is not correct.

    Parameters
    ----------
    number
        Number of the exercise, such as ``"01.2"``.
    answer
        As the task shows. A `Formulation` may be given by its class, a float multiplier is read as
        the nearest fraction whose denominator is at most a million, and an itinerary may be a
        `Plan`. An ellipsis ``...`` stands for no answer yet.
    student
        The text for which the task was made.

    Returns
    -------
    Grade
        True if the answer is correct. An answer of another kind and a formulation whose code
        raises an error are not correct: the words say what was expected, and where the code stops.

    Raises
    ------
    InputError
        If there is no such exercise, or the student is not a text.

    Examples
    --------
    >>> from optuav import exercises
    >>> print(exercises.check("01.1", ...))
    exercise 01.1: no answer yet
    """
    posed = task(number, student)
    if isinstance(answer, EllipsisType):
        return Grade(number, OPEN)
    exercise, at_fault = _exercises()[number], BaseException
    try:
        objection, value = exercise.read(posed, answer)
        # From here on only a declaration runs code of the student's own.
        at_fault = BaseException if exercise.kind == "declare" else OptuavError
        return exercise.grade(posed, objection, value)
    except KeyboardInterrupt:
        raise
    except at_fault as error:
        try:
            words = _refusal(error, answer)
        except (Exception, SystemExit):  # Of an error without words
            words = type(error).__name__
        return Grade(number, WRONG, printable(words))


def _refusal(error: BaseException, answer: object) -> str:
    """Say why an answer cannot be graded: its form, or where the code of a formulation stops."""
    kind = answer if isinstance(answer, type) else type(answer)
    named = "" if isinstance(error, OptuavError) else f"{type(error).__name__}: "
    if issubclass(kind, Formulation) and not kind.__module__.startswith("formulations."):
        steps = traceback.walk_tb(error.__traceback__)
        own_steps = [step for step in steps if step[0].f_globals.get("__name__") == kind.__module__]
        if own_steps:
            return _stopped(error, *own_steps[-1])
        if named:
            return f"{named}{error}"
    if not isinstance(error, InputError):
        return f"not an answer: {named}{error}"
    first, *_ = faults = error.faults[:MOST_SHOWN]
    if first.key == "answer":
        return f"the answer must be {first.allowed}, not {first.value}"
    return f"not an answer: {'; '.join(map(str, faults))}"


def _stopped(error: BaseException, frame: FrameType, line: int) -> str:
    """Say at which line of a student's code an error stopped it."""
    text = linecache.getline(frame.f_code.co_filename, line, frame.f_globals).strip()
    where = f"line {line} of your code" + (f", {text!r}" if text else "")
    names = dir(error.obj) if isinstance(error, AttributeError) else [*frame.f_locals]
    missed = isinstance(error, AttributeError | NameError) and error.name
    words = str(error)
    spelled = nearest(missed, names) if missed and "did you mean" not in words else ""
    return f"{type(error).__name__} in {where}: {words}{spelled}"
