"""One linear programme as a text that other solvers read: CPLEX LP format, or free MPS.

Unknowns and constraints keep their names and labels, letters that the formats do not know become
``_``. Numbers are written so that the same numbers are read back.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.errors import InputError
from optuav.modelling.affine import Affine, affine
from optuav.modelling.check import holding
from optuav.modelling.classify import traits
from optuav.modelling.expression import Operand, Sense, Variable
from optuav.modelling.model import Model
from optuav.modelling.writer import Text

WIDTH = 80
LONGEST_NAME = 120
GOAL = "objective"
RESERVED = re.compile(
    r"(\d|e\d|inf|nan).*|min|max|minimi[sz]e|maximi[sz]e|minimum|maximum|st|s\.t|subject|such|"
    r"bounds?|binary|binaries|bin|generals?|gen|integers?|free|semi|sos|end|"
    rf"{GOAL}|rhs|ranges|rows|columns|name|endata|marker|",
    re.IGNORECASE,
)
"""What a reader of one of the formats takes for a number or for a word of its own."""


@dataclass(frozen=True)
class _Column:
    """An unknown: name in the file, bounds, and whether it is a whole number."""

    name: str
    lower: float
    upper: float
    whole: bool


@dataclass(frozen=True)
class _Row:
    """A constraint Σ coefficient · unknown, compared with a number."""

    name: str
    coefficients: tuple[float, ...]
    sense: Sense
    right: float


@dataclass(frozen=True)
class _Programme:
    """A linear programme in numbers, with what a reader should know in remarks."""

    remarks: tuple[str, ...]
    maximises: bool
    goal: tuple[float, ...]
    constant: float
    columns: tuple[_Column, ...]
    rows: tuple[_Row, ...]


def need_linear(model: Model) -> None:
    """Refuse a model that LP and MPS files cannot hold.

    Raises
    ------
    InputError
        Naming the first constraint that is not linear.
    """
    found = traits(model)
    if not found.linear:
        raise InputError(
            "LP and MPS files hold linear programmes only; "
            f"{found.nonlinear_label!r} is not linear: {found.nonlinear_words}"
        )


def to_lp(model: Model, values: Mapping[str, Any], remarks: Iterable[str] = ()) -> str:
    """A linear programme in CPLEX LP format.

    Parameters
    ----------
    model
        A linear model; binary unknowns allowed.
    values
        Values of its parameters for one programme, as ``model.row(index)`` gives them; a parameter
        that is not named keeps its own.
    remarks
        Lines for the comment at the top.

    Raises
    ------
    InputError
        If a constraint is not linear (it is named), a number is not finite, or a parameter is an
        array over several programmes.
    """
    programme = _programme(model, values, remarks)
    names = [column.name for column in programme.columns]
    goal = _terms(programme.goal, names)
    if programme.constant:
        goal.append(_signed(programme.constant, ""))
    lines = [f"\\ {remark}" for remark in programme.remarks]
    lines += ["Maximize" if programme.maximises else "Minimize", *_wrapped(GOAL, goal)]
    lines += ["Subject To"]
    for row in programme.rows:
        sense = "=" if row.sense == "==" else row.sense
        lines += _wrapped(
            row.name, [*_terms(row.coefficients, names), f"{sense} {_number(row.right)}"]
        )
    binary = [column.name for column in programme.columns if _is_binary(column)]
    whole = [each.name for each in programme.columns if each.whole and not _is_binary(each)]
    lines += ["Bounds", *(_bound(each) for each in programme.columns if not _is_binary(each))]
    for section, members in (("Binaries", binary), ("Generals", whole)):
        lines += [section, *(f" {name}" for name in members)] if members else []
    return "\n".join([*lines, "End", ""])


def to_mps(model: Model, values: Mapping[str, Any], remarks: Iterable[str] = ()) -> str:
    """A linear programme in free MPS format, with the section OBJSENSE where it maximises.

    Parameters and errors are those of `to_lp`.
    """
    programme = _programme(model, values, remarks)
    letters = {"<=": "L", ">=": "G", "==": "E"}
    lines = [f"* {remark}" for remark in programme.remarks] + ["NAME optuav"]
    lines += ["OBJSENSE", "    MAX"] if programme.maximises else []
    lines += ["ROWS", f" N {GOAL}", *(f" {letters[r.sense]} {r.name}" for r in programme.rows)]
    lines += ["COLUMNS"]
    for k, column in enumerate(programme.columns):
        entries = [(GOAL, programme.goal[k])]
        entries += [(row.name, row.coefficients[k]) for row in programme.rows]
        written = [
            f" {column.name} {name} {_number(value)}"
            for place, (name, value) in enumerate(entries)
            if value or place == 0
        ]
        marks = (f" MARKER 'MARKER' '{word}'" for word in ("INTORG", "INTEND"))
        lines += [next(marks), *written, next(marks)] if column.whole else written
    rights = [(GOAL, -programme.constant), *((row.name, row.right) for row in programme.rows)]
    lines += ["RHS", *(f" RHS {name} {_number(right)}" for name, right in rights if right)]
    lines += ["BOUNDS"]
    for column in programme.columns:
        lower = f"LO BOUND {column.name} {_number(column.lower)}"
        lines.append(f" {lower}" if column.lower > -math.inf else f" MI BOUND {column.name}")
        if column.upper < math.inf:
            lines.append(f" UP BOUND {column.name} {_number(column.upper)}")
        elif column.whole:
            lines.append(f" PL BOUND {column.name}")
    return "\n".join([*lines, "ENDATA", ""])


def _programme(model: Model, values: Mapping[str, Any], remarks: Iterable[str]) -> _Programme:
    need_linear(model)
    names = [variable.name for variable in model.variables]
    goal = _form("objective", model.objective, values)
    columns = [
        _column(variable, name, values)
        for variable, name in zip(model.variables, _names(names, "x_"), strict=True)
    ]
    remarks = [model.title, *remarks]
    remarks += [
        f"{column.name} is {each.symbol}" + (f" [{each.unit}]" if each.unit != "1" else "")
        for column, each in zip(columns, model.variables, strict=True)
    ]
    rows = []
    labels = [constraint.label for constraint in model.constraints]
    for constraint, name in zip(model.constraints, _names(labels, "c_"), strict=True):
        relation = constraint.relation
        left, right = (_form(constraint.label, side, values) for side in relation.sides)
        excess = left.plus(right, -1.0)
        coefficients = tuple(float(excess.coefficients.get(each, 0.0)) for each in names)
        if not any(coefficients) and holding(relation.sense, left.constant, right.constant):
            # Another solver may not forgive the rounding of its two sides.
            remarks.append(f"{constraint.label!r} speaks of no unknown, and holds: left out")
            continue
        rows.append(_Row(name, coefficients, relation.sense, -float(excess.constant)))
    text = Text()
    remarks += [
        f"of equal answers optuav takes the one with the smallest {text.write(each)}"
        for each in model.preferences
    ]
    return _Programme(
        tuple(" ".join(remark.split()) for remark in remarks),
        model.sense == "maximise",
        tuple(float(goal.coefficients.get(each, 0.0)) for each in names),
        float(goal.constant),
        tuple(columns),
        tuple(rows),
    )


def _form(label: str, side: Operand, values: Mapping[str, Any]) -> Affine:
    """The affine form of one side, its numbers finite."""
    form = affine(side, values)
    _check(label, [form.constant, *form.coefficients.values()], np.isfinite)
    return form


def _column(variable: Variable, name: str, values: Mapping[str, Any]) -> _Column:
    lower, upper = (
        _limit(variable.label, bound, values) for bound in (variable.lower, variable.upper)
    )
    if variable.binary:
        lower, upper = max(lower, 0.0), min(upper, 1.0)
    return _Column(name, lower, upper, variable.binary)


def _limit(label: str, bound: Operand, values: Mapping[str, Any]) -> float:
    """A bound of an unknown; it may be infinite."""
    limit = affine(bound, values).constant
    _check(label, [limit], lambda number: not np.isnan(number))
    return float(limit)


def _check(label: str, numbers: Sequence[Any], usable: Any) -> None:
    if any(np.ndim(number) for number in numbers):
        raise InputError(
            f"a file holds one programme, {label!r} has several: give the values of one of them"
        )
    if not all(usable(number) for number in numbers):
        raise InputError(f"{label!r} has a number that a file cannot hold: NaN or infinite")


def _names(labels: Sequence[str], prefix: str) -> Iterator[str]:
    """Names that both formats take, one a label, all different."""
    taken = set[str]()
    for label in labels:
        name = re.sub(r"[^A-Za-z0-9_.]+", "_", label).strip("_.")[:LONGEST_NAME]
        name = prefix + name if RESERVED.fullmatch(name) else name
        unique, number = name, 1
        while unique.lower() in taken:
            number += 1
            unique = f"{name}_{number}"
        taken.add(unique.lower())
        yield unique


def _number(value: float) -> str:
    """The shortest text from which the same number is read."""
    return repr(value + 0.0).removesuffix(".0")


def _signed(value: float, name: str) -> str:
    factor = "" if name and abs(value) == 1.0 else f"{_number(abs(value))} "
    return f"{'-' if value < 0.0 else '+'} {factor}{name}".rstrip()


def _terms(coefficients: Sequence[float], names: Sequence[str]) -> list[str]:
    """The terms of a sum; a sum of nothing needs one all the same."""
    pairs = [(c, name) for c, name in zip(coefficients, names, strict=True) if c]
    return [_signed(c, name) for c, name in pairs or [(0.0, names[0])]]


def _wrapped(name: str, terms: Sequence[str]) -> list[str]:
    """A labelled sum in lines that are not too long."""
    line = " ".join(terms).removeprefix("+ ")
    return textwrap.wrap(
        f" {name}: {line}",
        WIDTH,
        subsequent_indent="   ",
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
    )


def _is_binary(column: _Column) -> bool:
    return column.whole and (column.lower, column.upper) == (0.0, 1.0)


def _bound(column: _Column) -> str:
    if (column.lower, column.upper) == (-math.inf, math.inf):
        return f" {column.name} free"
    lower = "-inf" if column.lower == -math.inf else _number(column.lower)
    if column.upper == math.inf:
        return f" {column.name} >= {lower}"
    return f" {lower} <= {column.name} <= {_number(column.upper)}"
