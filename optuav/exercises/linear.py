"""Linear programmes as short texts, with a student's numbers."""

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from optuav.modelling import Model
from optuav.modelling.expression import Operand
from optuav.presentation.numbers import figure, in_format

UNKNOWNS = {
    **{"Δ": ("hover_time_s", "s"), "T'": ("rest_time_s", "s"), "λ": ("by_way", "1")},
    **{"n": ("near", "1"), "f": ("far", "1"), "q": ("flight", "%"), "r": ("rate", "%/s")},
    **{"y1": ("charge_price", "1/A"), "y2": ("time_price", "1"), "y3": ("rest_price", "1")},
}
"""Name and unit of each symbol."""
TERM = re.compile(rf"([+-]?) *([\d.]*) *({'|'.join(UNKNOWNS)})(?![a-z])")
CONSTANT = re.compile(r"([+-]?) *([\d.]+)")
IN_BRACES = re.compile(r"\{([\w.]+)(?::([^}= ]+))?(?: = (\S+), (\S+) \.\. ([^}]+))?\}")
"""A number's name in a text, with its format, and its first, second and last choice."""


def filled(text: str, numbers: Mapping[str, Any]) -> str:
    """Return a text with numbers in place of their names in braces."""
    return IN_BRACES.sub(lambda found: _figure(numbers[found[1]], found[2]), text)


def _figure(value: float | str, form: str | None) -> str:
    if isinstance(value, str):
        return value
    return in_format(value, form) if form else figure(value, 10)


def linear(numbers: Mapping[str, Any], lines: Sequence[str], *, binary: str = "") -> Model:
    """Declare a linear model: its title, its goal such as "max Δ", and rows after their labels."""
    title, goal, *rows = (filled(line, numbers).replace("−", "-") for line in lines)
    model = Model(title)
    sense, goal = goal.split(" ", 1)
    sides = " ".join([goal, *(row.split(": ")[1] for row in rows)])
    used = {symbol for _, _, symbol in TERM.findall(sides)}
    unknowns = {
        symbol: model.variable(name, symbol, unit=unit, binary=symbol == binary)
        for symbol, (name, unit) in UNKNOWNS.items()
        if symbol in used
    }

    def total(text: str) -> Operand:
        terms = [
            unknowns[symbol]
            if sign + number == ""
            else float(sign + (number or "1")) * unknowns[symbol]
            for sign, number, symbol in TERM.findall(text.replace("+", ""))
        ]
        return sum(terms[1:], start=terms[0])

    (model.maximise if sense == "max" else model.minimise)(total(goal))
    for row in rows:
        label, sides = row.split(": ")
        left, sense, right = re.split("([≤≥])", sides)
        limit = float(sum(Fraction(sign + number) for sign, number in CONSTANT.findall(right)))
        model.subject_to(label, total(left) <= limit if sense == "≤" else total(left) >= limit)
    return model
