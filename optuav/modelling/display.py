"""A model as a page of mathematics, for a terminal or in LaTeX, and text in columns."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import takewhile
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from optuav.modelling.expression import (
    INDEX,
    Indexed,
    Leaf,
    Let,
    Operand,
    Parameter,
    Variable,
)
from optuav.modelling.forms import NotAffineError, affine
from optuav.modelling.traversal import nodes, outermost
from optuav.modelling.writer import Latex, Text

if TYPE_CHECKING:
    from optuav.modelling.model import Model

WIDTH = 96
MARGIN = 11
LONGEST_SYMBOL = 12
GAP = "  "

Line: TypeAlias = tuple[str, str]
"""A piece of mathematics and what it is called."""
Called: TypeAlias = Callable[[str], str]
"""What a symbol becomes."""
Section: TypeAlias = tuple[str, list[Line]]
"""Lines under a heading."""


def table(rows: Sequence[Sequence[str]]) -> str:
    """Rows of cells, lined up on the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = (
        GAP.join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        for row in rows
    )
    return "\n".join(line.rstrip() for line in padded)


def text(model: Model) -> str:
    """The model in lines of at most `WIDTH` characters, broken between terms.

    Every parameter is listed with its value, its unit and the mission's key that it comes from; an
    array over programmes, with the number and the range of its entries. Lines that differ in the
    number of their symbols alone are written once, see `Indexed`.
    """
    writer = Text()
    lines = [model.title, ""]
    for head, rows in _goal_and_unknowns(model, writer):
        bracketed = [(maths, name and f"({name})") for maths, name in rows]
        columns = _columns(bracketed, " " * MARGIN)
        lines += [f"{head:<{MARGIN}}{columns[0][MARGIN:]}", *columns[1:]]
    for head, rows in _conditions(model, writer):
        lines += [head, *_columns([(name, maths) for maths, name in rows], GAP)]
    given = _parameters(model, writer)
    if given:
        columns = _columns(given, GAP)
        if max(map(len, columns)) > WIDTH:  # long symbols have a line of their own
            columns = _columns(given, GAP, longest=LONGEST_SYMBOL)
        lines += ["where", *columns]
    return "\n".join(line.rstrip().replace(writer.after, " ") for line in lines)


def latex(model: Model) -> str:
    r"""The model as an ``align*`` environment (package amsmath).

    Without its ``&`` and ``\\``, every line is one that matplotlib's mathtext can set.
    """
    writer = Latex()
    sections = [*_goal_and_unknowns(model, writer), *_conditions(model, writer)]
    given = [
        (f"{writer.symbol(symbol)} = {value}{writer.unit(unit)}", key)
        for symbol, _, value, unit, key in _parameters(model, writer)
    ]
    sections += [("where", given)] if given else []
    lines = []
    for head, rows in sections:
        start = writer.words(head) + r"\quad "
        for maths, name in rows:
            first, *others = writer.lines(maths)
            lines.append(f"{start}& {first}" + (f" && {writer.words(name)}" if name else ""))
            lines += [f" & {each}" for each in others]
            start = " "
    return "\n".join([r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"])


def _goal_and_unknowns(model: Model, writer: Text) -> Iterator[Section]:
    goals = [writer.write(each) for each in _goals(model)]
    yield model.sense, [(f",{writer.words(' then smallest ')}".join(goals), "")]
    rows = [
        _row(
            "" if each.label == f"bounds of {each.symbol}" else each.label,
            [each],
            partial(_domain, writer, each),
        )
        for each in model.variables
    ]
    if rows:
        yield "over", _merged(rows, writer, all_names=True)


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


def _conditions(model: Model, writer: Text) -> Iterator[Section]:
    """The constraints, and the named quantities in them; neither where empty."""
    stated = []
    for each in model.constraints:
        write = partial(writer.write, each.relation)
        stated.append(_row(each.label, outermost(*each.relation.sides), write))
    defined = []
    for let in _named_quantities(model):
        inner = [] if let.words else outermost(let.expression)
        defined.append(_row(let.name, [let, *inner], partial(_definition, writer, let)))
    for head, rows in (("subject to", stated), ("with", defined)):
        if rows:
            yield head, _merged(rows, writer)


def _definition(writer: Text, let: Let, called: Called) -> str:
    what = writer.words(let.words) if let.words else writer.write(let.expression, called)
    return f"{writer.symbol(called(let.symbol))} = {what}"


def _domain(writer: Text, unknown: Variable, called: Called) -> str:
    symbol = writer.symbol(called(unknown.symbol))
    return f"{symbol} {writer.member} {writer.interval(unknown)}"


def _parameters(model: Model, writer: Text) -> list[tuple[str, str, str, str, str]]:
    """Symbol, name, value, unit and key of the parameters; those that differ in a number as one."""
    alike: dict[tuple[str, ...], list[Parameter]] = {}
    for each in model.parameters.values():
        alike.setdefault((_indexed(each.symbol), each.unit, each.key), []).append(each)
    found = []
    for (symbol, unit, key), those in alike.items():
        first, name, value = those[0], those[0].name, those[0].value
        if len(those) > 1 and isinstance(first.symbol, Indexed):
            name = name.replace(f"[{first.symbol.number}]", f"[{INDEX}]")
            value = np.concatenate([np.ravel(each.value) for each in those])
        else:
            symbol = first.symbol  # noqa: PLW2901
        found.append((symbol, name, writer.write(value), unit, key))
    return found


class _Row(NamedTuple):
    """A line, and its pattern with a running index in place of the one number of its symbols."""

    maths: str
    name: str
    pattern: str
    number: int | None


def _row(name: str, named: Iterable[Leaf | Let], write: Callable[[Called], str]) -> _Row:
    numbers = {each.symbol.number for each in named if isinstance(each.symbol, Indexed)}
    if len(numbers) != 1:
        return _Row(write(str), name, "", None)
    return _Row(write(str), name, write(_indexed), numbers.pop())


def _indexed(symbol: str) -> str:
    return symbol.pattern if isinstance(symbol, Indexed) else symbol


def _named_quantities(model: Model) -> list[Let]:
    """The named quantities that the page shows, each after those that it is made of.

    Of a chain of quantities that are written in words only the last is shown.
    """
    lets = [each for each in nodes(*model.expressions) if isinstance(each, Let)]
    written = [*model.expressions, *(each.expression for each in lets if not each.words)]
    seen = {id(each) for each in outermost(*written)}
    return [each for each in lets if not each.words or id(each) in seen]


def _merged(rows: Sequence[_Row], writer: Text, *, all_names: bool = False) -> list[Line]:
    """The lines, those that differ in a number alone as one under what their names share."""
    merged: list[Line] = []
    alike: dict[object, list[_Row]] = {}
    seen: Counter[tuple[str, int | None]] = Counter()
    for place, row in enumerate(rows):
        again = seen[row.pattern, row.number]  # what is stated twice is written twice
        seen[row.pattern, row.number] += 1
        alike.setdefault((row.pattern, again) if row.pattern else place, []).append(row)
    for same in alike.values():
        first = same[0]
        if len(same) == 1:
            merged.append((first.maths, first.name))
            continue
        numbers = [each.number for each in same if each.number is not None]
        names = [each.name for each in same]
        if all_names:
            name = ", ".join(filter(None, names))
        else:
            words = zip(*(each.split() for each in names), strict=False)
            shared = [word for word, *others in takewhile(lambda each: len({*each}) == 1, words)]
            name = " ".join([*shared, "…"])
        merged.append((first.pattern + writer.running(INDEX, numbers), name))
    return merged


def _columns(rows: Sequence[Sequence[str]], indent: str, *, longest: float = math.inf) -> list[str]:
    """Rows as lined-up columns; the last one continues on lines of its own where it is long.

    First cells that are longer than `longest` stand on the line before the rest of their row.
    """
    heads = ["" if len(head) > longest else head for head, *_ in rows]
    rest = [[*cells] for _, *cells in rows]
    widths = [max(map(len, column)) for column in (heads, *zip(*rest, strict=True))][:-1]
    lines = []
    for (first, *_), head, cells in zip(rows, heads, rest, strict=True):
        if first != head:
            lines.append(f"{indent}{first}")
        row = [head, *cells]
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
