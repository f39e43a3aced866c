"""The alternatives of a disjunction, with names for what differs; what is alike as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.modelling.affine import Affine, affine
from optuav.modelling.expression import Operand, Parameter
from optuav.modelling.model import Model
from optuav.modelling.notation import Text

LETTERS = "rstuvw"
"""Stand for the numbers of alternatives that are written once; further kinds are written out."""


@dataclass(frozen=True)
class Case:
    """An alternative, or several that are written as one.

    index
        What its symbols end in.
    name, label
        How its choice and its rows are called.
    given
        Its parameters in the joined model, by their names in the declaration.
    several
        Whether it stands for several.
    """

    index: str
    name: str
    label: str
    declared: Model
    given: Mapping[str, Parameter]
    several: bool = False

    def numbers(self, left: Operand, right: Operand = 0.0) -> Affine:
        """The difference of two sides with numbers for the parameters."""
        values = self.declared.row(0)
        return affine(left, values).plus(affine(right, values), -1.0)

    def shares(self, name: str) -> bool:
        """Whether a parameter of the declaration is the same in all alternatives."""
        return self.given[name].name == name


def shared_parameters(models: Sequence[Model]) -> dict[str, Parameter]:
    """The parameters that have one value wherever they occur, by name."""
    found: dict[str, list[Parameter]] = {}
    for model in models:
        values = model.row(0)
        for name, each in model.parameters.items():
            found.setdefault(name, []).append(_renamed(each, name, each.symbol, values[name]))
    return {name: each[0] for name, each in found.items() if len({p.value for p in each}) == 1}


def _renamed(parameter: Parameter, name: str, symbol: str, value: Any) -> Parameter:
    value = value if np.ndim(value) else float(value)
    return Parameter(name, symbol, parameter.unit, value, parameter.key)


def indexed(symbol: str, index: str) -> str:
    """A symbol with one more index."""
    return f"{symbol},{index}" if "_" in symbol else f"{symbol}_{index}"


def case_of(index: str, name: str, declared: Model, shared: Mapping[str, Parameter]) -> Case:
    """An alternative, its parameters under names of their own where they are not shared."""
    values = declared.row(0)
    own = {
        each: _renamed(p, f"{each}[{index}]", indexed(p.symbol, index), values[each])
        for each, p in declared.parameters.items()
    }
    given = {each: shared.get(each, parameter) for each, parameter in own.items()}
    return Case(index, name, name, declared, given)


def alike(cases: Sequence[Case]) -> list[Case]:
    """The cases, those that differ in the values of their parameters only as one."""
    groups: dict[Any, list[Case]] = {}
    for case in cases:
        groups.setdefault(_shape(case), []).append(case)
    letters = iter(LETTERS)
    found: list[Case] = []
    for group in groups.values():
        letter = next(letters, None) if len(group) > 1 else None
        found += group if letter is None else [_as_one(group, letter)]
    return found


def _shape(case: Case) -> tuple[Any, ...]:
    model, write = case.declared, Text().write
    rows = [
        (each.label, write(each.relation), *map(np.sign, excess.coefficients.values()))
        for each in model.constraints
        for excess in (case.numbers(*each.relation.sides),)
    ]
    bounds = [(each.name, write(each.lower), write(each.upper)) for each in model.variables]
    goals = [write(goal) for goal in (model.objective, *model.preferences)]
    return *(name for name in case.given if case.shares(name)), *goals, *rows, *bounds


def _as_one(group: Sequence[Case], letter: str) -> Case:
    first = group[0]
    numbers = [int(case.index) for case in group]
    run = numbers == [*range(numbers[0], numbers[-1] + 1)]
    which = f"{numbers[0]} … {numbers[-1]}" if run else ", ".join(map(str, numbers))
    given = dict(first.given)
    for name, parameter in first.declared.parameters.items():
        if not first.shares(name):
            values = np.array([case.given[name].value for case in group])
            symbol = indexed(parameter.symbol, letter)
            given[name] = _renamed(parameter, f"{name}[{letter}]", symbol, values)
    label = f"{letter} = {which}"
    names = ", ".join(case.name for case in group)
    return Case(letter, f"{label}: {names}", label, first.declared, given, several=True)


def goals(case: Case) -> list[Operand]:
    """What an alternative seeks, and then prefers."""
    return [case.declared.objective, *case.declared.preferences]
