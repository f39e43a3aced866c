"""A model as a page of mathematics: for a terminal, or for a lecture."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence

from optuav.modelling.affine import NotAffineError, affine
from optuav.modelling.expression import Operand
from optuav.modelling.lines import Line, constraint_lines, definition_lines
from optuav.modelling.model import Model
from optuav.modelling.notation import Latex, Notation, Text

WIDTH = 96
MARGIN = 11
LONGEST_SYMBOL = 12


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
    lines += ["where", *_parameters(given)] if given else []
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
    unknowns = [
        (
            f"{notation.symbol(each.symbol)} {notation.member} "
            f"{notation.interval(each)}{notation.unit(each.unit)}",
            "" if each.label == f"bounds of {each.symbol}" else each.label,
        )
        for each in model.variables
    ]
    if unknowns:
        yield "over", unknowns


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
    for head, rows in (
        ("subject to", constraint_lines(model, notation)),
        ("with", definition_lines(model, notation)),
    ):
        if rows:
            yield head, rows


def _parameters(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """The table of parameters; where it is too wide, long symbols have a line of their own."""
    lines = _columns(rows, "  ")
    fits = max(map(len, lines)) <= WIDTH
    return lines if fits else _columns(rows, "  ", longest=LONGEST_SYMBOL)


def _columns(
    rows: Sequence[tuple[str, ...]], indent: str, *, longest: float = math.inf
) -> list[str]:
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
