"""Constraints and named quantities of a model, line by line; lines that are alike as one."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from optuav.modelling.expression import Call, Let, Operand
from optuav.modelling.model import Constraint, Model
from optuav.modelling.notation import Notation
from optuav.modelling.traversal import fold

INDEX = "j"
"""What runs where lines differ in a number alone."""
NUMBERED = re.compile(r"(.+)_(\d+)")

Line: TypeAlias = tuple[str, str]
"""A piece of mathematics and what it is called."""


class Said(NamedTuple):
    """A line, and what it is with a running index in place of the one number of its symbols."""

    maths: str
    name: str
    pattern: str
    number: int | None


def constraint_lines(model: Model, notation: Notation) -> list[Line]:
    """The constraints as they were stated."""
    return _merged([_constraint(each, notation) for each in model.constraints], notation)


def definition_lines(model: Model, notation: Notation) -> list[Line]:
    """The named quantities of which constraints and other named quantities speak."""
    return _merged([_definition(each, notation) for each in _named_quantities(model)], notation)


def _constraint(stated: Constraint, notation: Notation) -> Said:
    relation = stated.relation
    number = _only_number(_outermost(*relation.sides))
    pattern = "" if number is None else notation.write(relation, _indexed)
    return Said(notation.write(relation), stated.label, pattern, number)


def _definition(named: Let, notation: Notation) -> Said:
    def equation(called: Callable[[str], str]) -> str:
        words = notation.words(named.words)
        return f"{notation.symbol(called(named.symbol))} = " + (
            words if words else notation.write(named.expression, called)
        )

    number = _only_number([named, *([] if named.words else _outermost(named.expression))])
    return Said(equation(str), named.name, "" if number is None else equation(_indexed), number)


def _outermost(*expressions: Operand) -> Iterator[Let]:
    """The named quantities that expressions speak of, without those that these are made of."""
    waiting, seen = [*expressions], set[int]()
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, Let):
            yield node
        elif isinstance(node, Call):
            waiting += node.arguments


def _only_number(named: Iterable[Let]) -> int | None:
    """The number that their symbols have, such as y1_5 and y2_5; None without or with several."""
    numbers = {found[2] for each in named if (found := NUMBERED.fullmatch(each.symbol))}
    return int(numbers.pop()) if len(numbers) == 1 else None


def _indexed(symbol: str) -> str:
    """A symbol with the running index for its number."""
    return NUMBERED.sub(rf"\1_{INDEX}", symbol)


def _merged(lines: Sequence[Said], notation: Notation) -> list[Line]:
    """The lines, those that differ in a number alone as one."""
    merged: list[Line] = []
    alike: dict[Any, list[Said]] = {}
    seen: Counter[tuple[str, int | None]] = Counter()
    for place, line in enumerate(lines):
        again = seen[line.pattern, line.number]  # what is stated twice stands there twice
        seen[line.pattern, line.number] += 1
        alike.setdefault((line.pattern, again) if line.pattern else place, []).append(line)
    for same in alike.values():
        if len(same) == 1:
            merged.append((same[0].maths, same[0].name))
            continue
        numbers = [each.number for each in same if each.number is not None]
        words = zip(*(each.name.split() for each in same), strict=False)
        common = [first for first, *others in takewhile(lambda each: len({*each}) == 1, words)]
        through = notation.running(INDEX, numbers)
        merged.append((same[0].pattern + through, " ".join([*common, "…"])))
    return merged


class Spoken(NamedTuple):
    """Named quantities below a node, by identity: those to print, and those only told in words."""

    printed: dict[int, Let]
    in_words: dict[int, Let]


def _named_quantities(model: Model) -> list[Let]:
    """The named quantities that the page speaks of, each after those that it is made of.

    Of a chain of quantities told in words only the last is.
    """
    done: dict[int, Any] = {}
    leaf = Spoken({}, {})
    walked = [
        fold(expression, lambda node: leaf, _spoken_together, _spoken, done)
        for expression in model.expressions
    ]
    whole = _spoken_together(np.add, tuple(walked))
    return [*(whole.printed | whole.in_words).values()]


def _spoken_together(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Spoken:
    found = Spoken({}, {})
    for each in arguments:
        if isinstance(each, Spoken):
            found.printed.update(each.printed)
            found.in_words.update(each.in_words)
    return found


def _spoken(named: Let, below: Any) -> Spoken:
    found = below if isinstance(below, Spoken) else Spoken({}, {})
    if named.words:
        return Spoken(found.printed, {id(named): named})
    return Spoken(found.printed | found.in_words | {id(named): named}, {})
