"""Linear programmes as short texts, with a student's numbers."""

import re
from collections.abc import Sequence
from fractions import Fraction

from optuav.exercises.exercise import Task, filled
from optuav.modelling import Model
from optuav.modelling.expression import Operand

UNKNOWNS = {
    **{"Δ": ("hover_time_s", "s"), "T'": ("rest_time_s", "s"), "λ": ("by_way", "1")},
    **{"n": ("near", "1"), "f": ("far", "1"), "q": ("flight", "%"), "r": ("rate", "%/s")},
    **{"y1": ("charge_price", "1/A"), "y2": ("time_price", "1"), "y3": ("rest_price", "1")},
}
"""Name and unit of each symbol."""
TERM = re.compile(rf"([+-]?) *([\d.]*) *({'|'.join(UNKNOWNS)})(?![a-z])")
NUMBER = re.compile(r"([+-]?) *([\d.]+)")


def linear(task: Task, lines: Sequence[str], *, binary: str = "") -> Model:
    """Declare a linear model: its title, its goal such as "max Δ", and rows after their labels."""
    title, goal, *rows = (filled(line, task.numbers).replace("−", "-") for line in lines)
    model = Model(title)
    sense, goal = goal.split(" ", 1)
    sides = " ".join([goal, *(row.split(": ")[1] for row in rows)])
    used = [symbol for _, _, symbol in TERM.findall(sides)]
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
        limit = float(sum(Fraction(sign + number) for sign, number in NUMBER.findall(right)))
        model.subject_to(label, total(left) <= limit if sense == "≤" else total(left) >= limit)
    return model
