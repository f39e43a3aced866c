"""Forms of answers: a figure, figures by name, exact numbers by label, an itinerary."""

import math
import numbers
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from typing import NoReturn, TypeVar

import numpy as np

from optuav.diagnosis.infeasibility import inequalities
from optuav.errors import Fault, InputError, refuse
from optuav.exercises.exercise import Form
from optuav.exercises.task import Task
from optuav.judge import Itinerary, Stop
from optuav.mission.messages import shown
from optuav.plan import Plan
from optuav.presentation.numbers import figure

Read = TypeVar("Read")

LARGEST_POWER_OF_TEN = 300  # Power of ten from which on a decimal is refused
MOST_PARTS = 10**6  # Largest denominator of the fraction that a float is read as
STOP = '("b1", "rest", 100.0)'


def number_of(value: object) -> object:
    """Return a number in the types of `numbers` if it is an array of one number or a decimal."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return value.item()
    if (
        isinstance(value, Decimal)
        and value.is_finite()
        and abs(value.adjusted()) < LARGEST_POWER_OF_TEN
    ):
        return Fraction(value)
    return value


def finite(value: object) -> float | None:
    """Return the finite number that a value is, or None."""
    number = number_of(value)
    if isinstance(number, numbers.Real) and not isinstance(number, bool):
        with suppress(OverflowError):
            if math.isfinite(plain := float(number)):
                return plain
    return None


def fraction(value: object) -> Fraction | None:
    """Return the fraction that a value is, or the one nearest to a float, or None."""
    number = number_of(value)
    if isinstance(number, numbers.Rational) and not isinstance(number, bool):
        return Fraction(int(number.numerator), int(number.denominator))
    plain = finite(number)
    return None if plain is None else Fraction(plain).limit_denominator(MOST_PARTS)


def one_number(unit: str, least: float = -math.inf, most: float = math.inf) -> Form:
    """Form of one finite number in a unit, within a range."""
    span = f" from {figure(least)} to {figure(most)}" if math.isfinite(least) else ""

    def read(task: Task, answer: object) -> float:
        value = finite(answer)
        if value is None or not least <= value <= most:
            _refuse(answer, f"a finite number [{unit}]{span}")
        return value

    return Form(f"{min(max(least, 10.0), most)}", read, f" in {unit}")


def numbers_by_name(least: float = 0.0, **most: float) -> Form:
    """Form of several numbers by name, from a least to a largest value of each."""
    allowed = {name: f"a number from {figure(least)} to {figure(most[name])}" for name in most}

    def inside(name: str, answer: object) -> float | None:
        value = finite(answer)
        return value if value is not None and least <= value <= most[name] else None

    example = ", ".join(f"'{name}': {min(max(least, 10.0), top)}" for name, top in most.items())
    return Form(f"{{{example}}}", lambda task, answer: _by_name(answer, allowed, inside, most))


def exact(
    example: str, *labels: str, multipliers: bool = True, point: bool = False, pair: bool = False
) -> Form:
    """Form of fractions by name: multipliers of a task's constraints, a point, or both.

    Labels name constraints that the task adds to its model. A pair is a list of two such answers.
    """

    def read(task: Task, answer: object) -> object:
        assert task.model is not None
        rows = inequalities(task.model, task.model.row(0)) if multipliers else []
        unknowns = [variable.name for variable in task.model.variables] if point else []
        names = (*(row.label for row in rows), *labels, *unknowns)
        allowed = dict.fromkeys(names, "a number, such as Fraction(1, 98)")

        def one(part: object) -> dict[str, Fraction]:
            return _by_name(part, allowed, lambda _, value: fraction(value), unknowns)

        if not pair:
            return one(answer)
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            _refuse(answer, f"a list of two dicts of numbers by name: {', '.join(names)}")
        return [one(part) for part in answer]

    return Form(f"[{example}, {example}]" if pair else example, read)


EXAMPLE = "{'charge': Fraction(1, 98), ...}"
MULTIPLIERS, PROOFS = exact(EXAMPLE), exact(EXAMPLE, pair=True)


def _by_name(
    answer: object,
    allowed: Mapping[str, str],
    read: Callable[[str, object], Read | None],
    needed: Collection[str],
) -> dict[str, Read]:
    """Return the numbers of an answer by name, or raise `InputError` with all faults."""
    names = ", ".join(allowed)
    if not isinstance(answer, Mapping):
        _refuse(answer, f"a dict of numbers by name: {names}")
    faults, values = list[Fault](), dict[str, Read]()
    for name, value in dict(answer).items():
        if name not in allowed:
            key = name if isinstance(name, str) else shown(name)
            faults.append(Fault(key, shown(value), f"the names are {names}"))
        elif (number := read(name, value)) is None:
            faults.append(Fault(name, shown(value), allowed[name]))
        else:
            values[name] = number
    missing = [name for name in needed if name not in answer]
    refuse([*faults, *(Fault(name, "", f"is missing; {allowed[name]}") for name in missing)])
    return values


def _itinerary(task: Task, answer: object) -> Itinerary:
    """Return the itinerary that an answer is; `InputError` if it flies another mission."""
    if isinstance(answer, Plan | Itinerary):
        if answer.mission != task.mission:
            _refuse(answer, "an itinerary that flies task.mission")
        answer = answer.stops
    is_lone = isinstance(answer, tuple) and len(answer) == 3 and isinstance(answer[1], str)
    if is_lone or not isinstance(answer, list | tuple):
        _refuse(answer, f"an optuav.Itinerary, or a list of stops, such as [{STOP}]")
    stops = (
        Stop(*stop) if isinstance(stop, tuple | list) and len(stop) == 3 else stop
        for stop in answer
    )
    return Itinerary(task.mission, stops)


ITINERARY = Form("[('b1', 'rest', 100.0), ('hover', 'hover', 400.0)]", _itinerary)


def _refuse(answer: object, allowed: str) -> NoReturn:
    raise InputError([Fault("answer", shown(answer), allowed)])
