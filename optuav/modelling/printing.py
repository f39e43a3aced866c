"""A model as a page of mathematics: for a terminal, or for a lecture."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import takewhile
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from optuav.modelling.affine import NotAffineError, affine
from optuav.modelling.expression import Call, Let, Operand, fold
from optuav.modelling.model import Constraint, Model
from optuav.modelling.notation import Latex, Notation, Text

WIDTH = 96
MARGIN = 11

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


def text(model: Model) -> str:
    """The programme in lines of at most `WIDTH` characters, broken between terms.

    Every parameter is listed with its value, its unit and the mission's key it comes from; one
    that is an array over programmes, with the number and the range of its entries.
    """
    notation = Text()
    lines = [model.title, ""]
    for head, rows in _statement(model, notation):
        bracketed = [(maths, name and f"({name})") for maths, name in rows]
        columns = _columns(bracketed, " " * MARGIN)
        lines += [f"{head:<{MARGIN}}{columns[0][MARGIN:]}", *columns[1:]]
    for head, rows in _conditions(model, notation):
        lines += [head, *_columns([(name, maths) for maths, name in rows], "  ")]
    given = [
        (each.symbol, each.name, notation.write(each.value), each.unit, each.key)
        for each in model.parameters.values()
    ]
    lines += ["where", *_columns(given, "  ")] if given else []
    return "\n".join(line.rstrip().replace(notation.after, " ") for line in lines)


def latex(model: Model) -> str:
    r"""The programme as an ``align*`` environment (package amsmath).

    Without its ``&`` and ``\\``, every line is one that matplotlib's mathtext can set.
    """
    notation = Latex()
    sections = [*_statement(model, notation), *_conditions(model, notation)]
    given = [
        (f"{notation.symbol(each.symbol)} = {notation.quantity(each.value, each.unit)}", each.key)
        for each in model.parameters.values()
    ]
    sections += [("where", given)] if given else []
    lines = [
        rf"{notation.words(head)} & {maths}" + (f" && {notation.words(name)}" if name else "")
        for section, rows in sections
        for head, (maths, name) in zip([section] + [""] * len(rows), rows, strict=False)
    ]
    return "\n".join([r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"])


def _statement(model: Model, notation: Notation) -> Iterator[tuple[str, list[Line]]]:
    """What is sought, and over which unknowns."""
    goals = [notation.write(each) for each in _goals(model)]
    yield model.sense, [(f",{notation.words(' then smallest ')}".join(goals), "")]
    yield (
        "over",
        [
            (
                f"{notation.symbol(each.symbol)} {notation.member} "
                f"{notation.interval(each)}{notation.unit(each.unit)}",
                "" if each.label == f"bounds of {each.symbol}" else each.label,
            )
            for each in model.variables
        ],
    )


def _goals(model: Model) -> list[Operand]:
    """What is sought first, then among equals; not what an earlier goal has settled already."""
    goals: list[Operand] = []
    settled: set[str] = set()
    for goal in (model.objective, *model.preferences):
        unknown = _only_unknown(goal)
        if unknown not in settled:
            goals.append(goal)
        settled |= {unknown} if unknown else set()
    return goals


def _only_unknown(goal: Operand) -> str:
    """Name of the unknown that an affine goal in a single unknown settles; else nothing."""
    try:
        names = [*affine(goal, {}).coefficients]
    except NotAffineError:
        return ""
    return names[0] if len(names) == 1 else ""


def _conditions(model: Model, notation: Notation) -> Iterator[tuple[str, list[Line]]]:
    """The constraints, and the quantities that they speak of by name; neither where empty."""
    constraints = [_constraint(each, notation) for each in model.constraints]
    named = [_definition(each, notation) for each in _named_quantities(model)]
    for head, said in (("subject to", constraints), ("with", named)):
        if said:
            yield head, list(_merged(said, notation))


def _constraint(stated: Constraint, notation: Notation) -> Said:
    relation = stated.relation
    number = _only_number(_outermost(relation.left, relation.right))
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


def _merged(lines: Sequence[Said], notation: Notation) -> Iterator[Line]:
    """The lines, those that differ in a number alone as one."""
    alike: dict[str | int, list[Said]] = {}
    for place, line in enumerate(lines):
        alike.setdefault(line.pattern or place, []).append(line)
    for same in alike.values():
        if len(same) == 1:
            yield same[0].maths, same[0].name
            continue
        numbers = [each.number for each in same if each.number is not None]
        words = zip(*(each.name.split() for each in same), strict=False)
        common = [first for first, *others in takewhile(lambda each: len({*each}) == 1, words)]
        yield same[0].pattern + notation.running(INDEX, numbers), " ".join([*common, "…"])


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


def _columns(rows: Sequence[tuple[str, ...]], indent: str) -> list[str]:
    """Rows as lined-up columns; the last one continues on lines of its own where it is long."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)][:-1]
    lines = []
    for row in rows:
        padded = (f"{cell:<{width}}  " for cell, width in zip(row, widths, strict=False))
        start = "".join([indent, *padded])
        wrapped = textwrap.wrap(
            row[-1],
            WIDTH,
            initial_indent=start,
            subsequent_indent=" " * (len(start) + 2),
            break_long_words=False,
            break_on_hyphens=False,
        )
        lines += wrapped or [start]
    return lines
