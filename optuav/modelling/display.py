"""A model as a page of mathematics, for a terminal or in LaTeX, and text in columns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import takewhile
from typing import TypeAlias

import numpy as np

from optuav.errors import Fault, InputError, encodable, shown
from optuav.modelling.declaration import Declaration
from optuav.modelling.expression import INDEX, Indexed, Let, Parameter, PartedLabel, Share
from optuav.modelling.forms import NotAffineError, affine
from optuav.modelling.traversal import outermost
from optuav.modelling.writer import LINE, MARKED, Latex, Text
from optuav.presentation.text import LEAST_ROOM, line_width, lined_up

WIDTH = 96
MARGIN = 11
LONGEST_SYMBOL = 12
GAP = "  "
UNMARKED = str.maketrans(MARKED, "0123456789")

Line: TypeAlias = tuple[str, str]  # A piece of mathematics and its name
Section: TypeAlias = tuple[str, list[Line]]  # Lines under a heading


def text(model: Declaration) -> str:
    """The model in lines of at most `WIDTH` characters by default, broken between terms.

    Every parameter is listed with value, unit and key of the mission, an array with number and
    range of its entries. Lines that differ only in the numbers of symbols are written once, see
    `Indexed`.
    """
    writer, width = Text(marks=True), line_width(WIDTH)
    lines = [model.title, ""]
    for head, rows in sections(model, writer):
        if head in CONDITIONS:
            lines += [head, *lined_up([(name, maths) for maths, name in rows], width, GAP)]
            continue
        bracketed = [(maths, name and f"({name})") for maths, name in rows]
        first, *others = lined_up(bracketed, width, " " * MARGIN)
        lines += [f"{head:<{MARGIN}}{first[MARGIN:]}", *others]
    if given := parameters(model, writer):
        table = lined_up(given, width, GAP)
        if len(table) > len(given):  # long symbols have a line of their own
            table = lined_up(given, width, GAP, longest=LONGEST_SYMBOL)
        lines += ["where", *table]
    return encodable("\n".join(lines))


def latex(
    model: Declaration, *, width: int = LINE, numbers: bool = True, labels: bool = True
) -> str:
    r"""The model as ``align*`` environments (package amsmath), the names of lines as their tags.

    The values of the parameters are an environment of their own. Without its ``&``, ``\\`` and
    tags, every line is one that matplotlib's mathtext can set. Options as of `Model.to_latex`.
    """
    if not isinstance(width, int) or width < LEAST_ROOM:
        words = f"a whole number, x >= {LEAST_ROOM} [characters]"
        raise InputError([Fault("width", shown(width), words)])
    writer = Latex(marks=True, width=width)
    shown_parameters = [
        (f"{writer.symbol(symbol)} = {value}{writer.unit(unit)}", key)
        for symbol, _, value, unit, key in parameters(model, writer)
    ]
    pages = [[*sections(model, writer)]]
    pages += [[("where", shown_parameters)]] if shown_parameters and numbers else []
    return "\n".join(_aligned(page, writer, labels) for page in pages)


def _aligned(page: Sequence[Section], writer: Latex, labels: bool) -> str:
    """Sections as one environment; in narrow columns heads are on lines of their own."""
    lines, narrow = list[str](), writer.width < LINE
    for head, rows in page:
        start = r"& \quad " if narrow else writer.words(head) + r"\quad & "
        lines += [f"& {writer.words(head)}"] if narrow else []
        for maths, name in rows:
            for line in writer.lines(maths):
                lines.append(start + line)
                start = r"& \quad " if narrow else " & "
            if name and labels:
                lines[-1] += rf" \tag*{{\({writer.words(name)}\)}}"
    return "\n".join([r"\begin{align*}", " \\\\\n".join(lines), r"\end{align*}"])


CONDITIONS = ("subject to", "with")


def sections(model: Declaration, writer: Text) -> Iterator[Section]:
    """Goal, unknowns, constraints and the named quantities in them, as far as there are any."""
    goals, settled = list[str](), set[str]()
    for goal in (model.objective, *model.preferences):
        names = set[str]()
        with suppress(NotAffineError):
            names = {*affine(goal, {}).coefficients}
        if not names or names - settled:
            goals.append(writer.write(goal))
        if len(names) == 1:  # an earlier goal settles it
            settled |= names
    yield model.sense, _merged([(f",{writer.words(' then smallest ')}".join(goals), "")], writer)
    unknowns = []
    for variable in model.variables:
        domain = f"{writer.named(variable).text} {writer.member} {writer.interval(variable)}"
        unknowns.append((domain, variable.label if variable.labelled else ""))
    constraint_rows = [(writer.write(row.relation), row.label) for row in model.constraints]
    defined = []
    lets = [node for node in model.walked.nodes if isinstance(node, Let)]
    trees = [*model.walked.trees, *(let.expression for let in lets if not let.words)]
    seen = {id(node) for node in outermost(*trees)}
    # Only the last of a chain of quantities in words is shown.
    for let in (candidate for candidate in lets if not candidate.words or id(candidate) in seen):
        what = writer.words(let.words) if let.words else writer.write(let.expression)
        defined.append((f"{writer.named(let).text} = {what}", let.name))
    if unknowns:
        yield "over", _merged(unknowns, writer, all_names=True)
    for head, rows in zip(CONDITIONS, (constraint_rows, defined), strict=True):
        if rows:
            yield head, _merged(rows, writer)


def parameters(model: Declaration, writer: Text) -> list[tuple[str, str, str, str, str]]:
    """Symbol, name, value, unit and key of the parameters; those that differ in a number as one."""
    alike: dict[tuple[str, ...], list[Parameter]] = {}
    # Shares are listed too, though nobody may change one of them alone.
    listed = (
        parameter
        for parameter in model.given.values()
        if parameter.varies or isinstance(parameter, Share)
    )
    for parameter in listed:
        pattern = getattr(parameter.symbol, "pattern", parameter.symbol)
        alike.setdefault((pattern, parameter.unit, parameter.key), []).append(parameter)
    groups = []
    for (pattern, unit, key), those in alike.items():
        symbol, name, value = str(those[0].symbol), those[0].name, those[0].value
        if len(those) > 1 and isinstance(those[0].symbol, Indexed):
            symbol, name = pattern, name.replace(f"[{those[0].symbol.number}]", f"[{INDEX}]")
            value = np.concatenate([np.ravel(parameter.value) for parameter in those])
        groups.append((symbol, name, writer.write(value), unit, key))
    return groups


def _merged(rows: Sequence[Line], writer: Text, *, all_names: bool = False) -> list[Line]:
    """Merge lines that differ only in one number, under the shared part of their names."""
    alike: dict[object, list[tuple[int, Line]]] = {}
    for place, (maths, name) in enumerate(rows):
        numbers_in = {*re.findall(f"[{MARKED}]+", maths)}
        number = int(numbers_in.pop()) if len(numbers_in) == 1 else -1
        # LaTeX has braces around two digits, and none around one.
        index = re.sub(rf"\{{[{MARKED}]+\}}|[{MARKED}]+", INDEX, maths)
        pattern: object = index if number >= 0 else place
        while any(number == known for known, _ in alike.get(pattern, ())):
            pattern = (pattern, place)  # a repeated line is written twice
        alike.setdefault(pattern, []).append((number, (maths.translate(UNMARKED), name)))
    merged: list[Line] = []
    for pattern, same in alike.items():
        numbers, lines = zip(*same, strict=True)
        names = [name for _, name in lines]
        if len(lines) == 1:
            merged += lines
            continue
        parts = zip(*(PartedLabel(label).parts for label in names), strict=False)
        shared = (words[0] for words in takewhile(lambda each: len({*each}) == 1, parts))
        name = ", ".join(filter(None, names)) if all_names else PartedLabel(*shared, "…")
        merged.append((f"{pattern}{writer.running(numbers)}", name))
    return merged
