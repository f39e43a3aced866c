"""Forms of answers: a figure, figures by name, fractions by name, an itinerary."""

import math
import numbers
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from typing import Any, NamedTuple, NoReturn

import numpy as np

from optuav.errors import Fault, InputError, refuse
from optuav.exercises.exercise import Task
from optuav.judge import Itinerary, Stop
from optuav.mission.messages import shown
from optuav.plan import Plan


class Form(NamedTuple):
    """The form of an answer: an example, and how it is read, or refused with an `InputError`."""

    example: str
    read: Callable[[Task, object], Any]


LARGEST = 300  # Power of ten from which on a decimal is refused
MOST_PARTS = 10**6  # Largest denominator of the fraction that a float is read as
STOP = '("b1", "rest", 100.0)'
ROUNDED = 0.01  # Relative distance from the truth that rounding may explain
FACTORS = {100.0: "a factor of 100", 1000.0: "a factor of 1000"}
FACTORS_OF_UNITS = {
    "s": {60.0: "minutes for seconds", 3600.0: "hours for seconds"},
    "A s": {3600.0: "ampere-hours for ampere-seconds"},
}


def number_of(value: object) -> object:
    """Return a number in the types of `numbers` if it is an array of one number or a decimal."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return value.item()
    if isinstance(value, Decimal) and value.is_finite() and abs(value.adjusted()) < LARGEST:
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


def figure(unit: str = "", least: float = -math.inf, most: float = math.inf) -> Form:
    """Form of one finite number in a unit, within a range."""
    named = f"a finite number [{unit}]" if unit else "a finite number"
    allowed = named + (f" from {least:g} to {most:g}" if math.isfinite(least) else "")

    def read(task: Task, answer: object) -> float:
        value = finite(answer)
        if value is None or not least <= value <= most:
            _refuse(answer, allowed)
        return value

    return Form("10.0", read)


def is_close(value: float, other: float, within: float) -> bool:
    """Whether two figures agree within an amount, with room for the last digits."""
    return math.isfinite(other) and abs(value - other) <= within * (1.0 + 1e-9)


def missed(value: float, truth: float, within: float, unit: str) -> tuple[str, str]:
    """Return how a figure misses the truth, and a hint where rounding or a unit explains it."""
    tolerance, near = f"within {within:.3g} {unit}".rstrip(), ROUNDED * abs(truth)
    if is_close(value, truth, near):
        hint = f"keep all digits until the end, and answer {tolerance}"
        return f"close, but not {tolerance}: it looks rounded", hint
    for factor, words in (FACTORS | FACTORS_OF_UNITS.get(unit, {})).items():
        if any(is_close(x, truth, near) for x in (value * factor, value / factor)):
            return f"off by {words}", f"the unit is {unit}"
    if is_close(-value, truth, within):
        return "the sign is wrong", ""
    return "too large" if value > truth else "too small", ""


def figures(**ranges: tuple[str, float, float]) -> Form:
    """Form of several numbers by name: for each its unit, least and largest value."""
    names = ", ".join(ranges)

    def read(task: Task, answer: object) -> dict[str, float]:
        if not isinstance(answer, Mapping):
            _refuse(answer, f"a dict with the numbers {names}")
        stated, faults, values = dict(answer), list[Fault](), dict[str, float]()
        for name, value in stated.items():
            if name not in ranges:
                faults.append(Fault(_key(name), shown(value), f"the names are {names}"))
        for name, (unit, least, most) in ranges.items():
            value = finite(stated.get(name))
            if value is None or not least <= value <= most:
                allowed = f"a number [{unit}] from {least:g} to {most:g}"
                faults.append(Fault(name, shown(stated[name]) if name in stated else "", allowed))
            else:
                values[name] = value
        refuse(faults)
        return values

    return Form("{" + ", ".join(f"'{name}': 10.0" for name in ranges) + "}", read)


def fractions(
    answer: object, names: Sequence[str], needed: Collection[str] = ()
) -> dict[str, Fraction]:
    """Return the numbers of an answer as fractions, or raise `InputError` with all faults."""
    faults, values = list[Fault](), dict[str, Fraction]()
    if not isinstance(answer, Mapping):
        _refuse(answer, f"a dict of numbers by name: {', '.join(names)}")
    for name, stated in dict(answer).items():
        value = number_of(stated)
        if name not in names:
            faults.append(Fault(_key(name), shown(value), f"the names are {', '.join(names)}"))
        elif isinstance(value, bool) or not isinstance(value, numbers.Real):
            faults.append(Fault(name, shown(value), "a number, such as Fraction(1, 98)"))
        elif isinstance(value, numbers.Rational):
            values[name] = Fraction(int(value.numerator), int(value.denominator))
        elif not math.isfinite(value):
            faults.append(Fault(name, shown(value), "a finite number"))
        else:
            values[name] = Fraction(float(value)).limit_denominator(MOST_PARTS)
    faults += [Fault(name, "", "is missing") for name in needed if name not in answer]
    refuse(faults)
    return values


def _itinerary(task: Task, answer: object) -> Itinerary:
    """Return the itinerary that an answer is; `InputError` if it flies another mission."""
    if isinstance(answer, Plan | Itinerary):
        if answer.mission != task.mission:
            _refuse(answer, "an itinerary that flies task.mission")
        answer = answer.stops
    if isinstance(answer, tuple) and len(answer) == 3 and isinstance(answer[1], str):
        _refuse(answer, f"a list of stops, such as [{STOP}]")
    if not isinstance(answer, Sequence) or isinstance(answer, str):
        _refuse(answer, f"an optuav.Itinerary, or stops in order such as {STOP}")
    stops = list[Any]()
    for number, stop in enumerate(answer):
        is_three = isinstance(stop, tuple | list) and len(stop) == 3
        if not is_three and not isinstance(stop, Stop):
            raise InputError([Fault(f"stops.{number}", shown(stop), f"a stop such as {STOP}")])
        stops.append(Stop(*stop) if is_three else stop)
    return Itinerary(task.mission, tuple(stops))


ITINERARY = Form("[('b1', 'rest', 100.0), ('hover', 'hover', 400.0)]", _itinerary)


def _key(name: object) -> str:
    return name if isinstance(name, str) else shown(name)


def _refuse(answer: object, allowed: str) -> NoReturn:
    raise InputError([Fault("answer", shown(answer), allowed)])
