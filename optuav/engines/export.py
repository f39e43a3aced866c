"""A linear programme as CPLEX LP or free MPS text, written by HiGHS.

Names and labels become names that both formats take; remarks at the top list both. HiGHS writes
numbers to 15 digits.
"""

from __future__ import annotations

import itertools
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from optuav.arrays import Floats, Values
from optuav.errors import InputError
from optuav.modelling.check import holding
from optuav.modelling.classify import traits
from optuav.modelling.expression import Expression, Operand
from optuav.modelling.forms import affine
from optuav.modelling.model import Model
from optuav.modelling.writer import Text

LONGEST_NAME = 120
RESERVED = re.compile(
    r"(\d|e\d|inf|nan).*|min|max|minimi[sz]e|maximi[sz]e|minimum|maximum|st|s\.t|subject|such|"
    r"bounds?|binary|binaries|bin|generals?|gen|integers?|free|semi|sos|end|"
    r"obj|objective|rhs|ranges|rows|columns|name|endata|marker|",
    re.IGNORECASE,
)
"""Texts that a reader of one of the formats takes for a number or a keyword."""
FILES: Mapping[str, str] = {"lp": "\\ ", "mps": "* "}
"""How a line of comment begins, by name of the format."""


def need_linear(model: Model) -> None:
    """Refuse a model that LP and MPS files cannot hold.

    Raises
    ------
    InputError
        Naming the first constraint that is not linear.
    """
    if flaw := traits(model).nonlinear:
        label, why = flaw
        raise InputError(
            f"LP and MPS files hold linear programmes only; {label!r} is not linear: {why}"
        )


def to_file(
    model: Model,
    values: Values,
    form: str,
    remarks: Iterable[str] = (),
) -> str:
    """The text of a file that holds a linear programme: ``"lp"`` for CPLEX LP, ``"mps"`` for MPS.

    Values of the parameters are those of one programme, as ``model.row(index)`` gives them; others
    keep their own. Remarks are lines for the comment at the top.

    Raises
    ------
    InputError
        If a constraint is not linear (it is named), a number is not finite, or a parameter is an
        array over several programmes.
    """
    import highspy

    need_linear(model)
    names = [each.name for each in model.variables]
    columns = _legal(names, "x_")
    labels = _legal([each.label for each in model.constraints], "c_")
    notes = [model.title, *remarks]
    notes += [
        f"{column} is {each.symbol}" + (f" [{each.unit}]" if each.unit != "1" else "")
        for column, each in zip(columns, model.variables, strict=True)
    ]
    infinity = highspy.kHighsInf
    file = highspy.Highs()  # type: ignore[no-untyped-call]
    file.setOptionValue("output_flag", False)
    goal, constant = _form("objective", model.objective, values, names)
    file.changeObjectiveOffset(constant)
    if model.sense == "maximise":
        file.changeObjectiveSense(highspy.ObjSense.kMaximize)
    for k, (variable, column) in enumerate(zip(model.variables, columns, strict=True)):
        ends = [_limit(variable.label, end, values) for end in (variable.lower, variable.upper)]
        if variable.binary:
            ends = [min(max(end, 0.0), 1.0) for end in ends]
        file.addVar(*ends)
        file.passColName(k, column)
        file.changeColCost(k, goal[k])
        if variable.binary:
            file.changeColIntegrality(k, highspy.HighsVarType.kInteger)
    for constraint, label in zip(model.constraints, labels, strict=True):
        sense, sides = constraint.relation.sense, constraint.relation.sides
        (a, left), (b, right) = (_form(constraint.label, side, values, names) for side in sides)
        row, limit = a - b, right - left
        used = np.flatnonzero(row)
        if not len(used) and holding(sense, left, right):
            # Another solver may not forgive the rounding of its two sides.
            notes.append(f"{constraint.label!r} holds whatever the unknowns: left out")
            continue
        least = -infinity if sense == "<=" else limit
        most = infinity if sense == ">=" else limit
        file.addRow(least, most, len(used), used, row[used])
        file.passRowName(file.getNumRow() - 1, label)
        notes.append(f"{label} is {constraint.label!r}")
    notes += [
        f"of equal answers optuav takes the one with the smallest {Text().write(each)}"
        for each in model.preferences
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"programme.{form}"
        file.writeModel(str(path))
        text = path.read_text("ascii")
    return "".join(f"{FILES[form]}{' '.join(each.split())}\n" for each in notes) + text


def _form(label: str, side: Operand, values: Values, names: Sequence[str]) -> tuple[Floats, float]:
    """Coefficients of the unknowns and the constant of one side, all of them finite."""
    form = affine(side, values)
    numbers = [*(form.coefficients.get(name, 0.0) for name in names), form.constant]
    if any(np.ndim(number) for number in numbers):
        raise InputError(
            f"a file holds one programme, {label!r} has several: give the values of one of them"
        )
    if not np.isfinite(numbers).all():
        raise InputError(f"{label!r} has a number that a file cannot hold: NaN or infinite")
    return np.array(numbers[:-1], dtype=float), float(numbers[-1])


def _limit(label: str, bound: Operand, values: Values) -> float:
    """A bound of an unknown; it may be infinite."""
    infinite = not isinstance(bound, Expression) and np.isinf(bound)
    return float(bound) if infinite else _form(label, bound, values, ())[1]


def _legal(labels: Iterable[str], prefix: str) -> list[str]:
    """Names that both formats take, one for each label, all different."""
    found: dict[str, str] = {}
    for label in labels:
        name = re.sub(r"[^A-Za-z0-9_.]+", "_", label).strip("_.")[:LONGEST_NAME]
        name = prefix + name if RESERVED.fullmatch(name) else name
        numbered = (f"{name}_{number}" for number in itertools.count(2))
        unique = next(u for u in itertools.chain([name], numbered) if u.lower() not in found)
        found[unique.lower()] = unique
    return list(found.values())
