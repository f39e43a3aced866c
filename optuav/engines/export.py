"""A linear programme as CPLEX LP or free MPS text, written by HiGHS.

Names and labels become names that both formats take; remarks at the top list both. HiGHS writes
numbers to 15 digits.
"""

import itertools
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from optuav.arrays import Values
from optuav.engines.linear_form import linear_form, own_bounds
from optuav.errors import InputError
from optuav.modelling.check import holding
from optuav.modelling.classify import traits
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
"""Beginning of a comment line, by name of the format."""


def need_linear(model: Model) -> None:
    """Refuse a model that LP and MPS files cannot hold."""
    if flaw := traits(model).nonlinear:
        words = "{!r} is not linear: {}".format(*flaw)
        raise InputError(f"LP and MPS files hold linear programmes only; {words}")


def to_file(model: Model, values: Values, form: str, remarks: Iterable[str] = ()) -> str:
    """The text of a file that holds a linear programme: ``"lp"`` for CPLEX LP, ``"mps"`` for MPS.

    Parameters may have other values, as of ``model.row(index)``; remarks are a comment at the top.
    """
    import highspy

    need_linear(model)
    rows = linear_form(model, values)
    names = _legal(rows.names, "x_")
    labels_of_rows = [constraint.label for constraint in model.constraints]
    labels = _legal([*labels_of_rows, *(unknown.label for unknown in model.variables)], "c_")
    notes = [model.title, *remarks]
    notes += [
        f"{name} is {each.symbol}" + (f" [{each.unit}]" if each.unit != "1" else "")
        for name, each in zip(names, model.variables, strict=True)
    ]
    file = highspy.Highs()  # type: ignore[no-untyped-call]
    file.setOptionValue("output_flag", False)
    goal, constant = rows.towards * rows.directions[0, :, 0], rows.towards * rows.offsets[0, 0]
    _refuse("objective", [*goal, constant])
    file.changeObjectiveOffset(constant)
    if model.sense == "maximise":
        file.changeObjectiveSense(highspy.ObjSense.kMaximize)
    bounds = own_bounds(model, values)
    for k, variable in enumerate(model.variables):
        low, high = bounds[variable.name]
        _refuse(variable.label, [bound for bound in (low, high) if not np.isinf(bound)])
        low, high = (max(low, 0.0), min(high, 1.0)) if variable.binary else (low, high)
        file.addVar(low, high)
        file.passColName(k, names[k])
        file.changeColCost(k, goal[k])
        if variable.binary:
            file.changeColIntegrality(k, highspy.HighsVarType.kInteger)
        if low == 0.0 > high:
            # Such a lower bound is not written, and some readers take it for none then.
            file.addRow(low, highspy.kHighsInf, 1, np.array([k]), np.array([1.0]))
            file.passRowName(file.getNumRow() - 1, labels[len(labels_of_rows) + k])
    number = 0
    for constraint, label in zip(model.constraints, labels, strict=False):
        sense, signs = constraint.relation.sense, constraint.relation.signs
        row = signs[0] * rows.normals[number, :, 0]
        limit = float(signs[0] * rows.limits[number, 0])
        number += len(signs)
        _refuse(constraint.label, [*row, limit])
        used = np.flatnonzero(row)
        if not len(used) and holding(sense, 0.0, limit):
            # Another solver may not forgive the rounding of its two sides.
            notes.append(f"{constraint.label!r} holds whatever the unknowns: left out")
            continue
        least = -highspy.kHighsInf if sense == "<=" else limit
        most = highspy.kHighsInf if sense == ">=" else limit
        file.addRow(least, most, len(used), used, row[used])
        file.passRowName(file.getNumRow() - 1, label)
        notes.append(f"{label} is {constraint.label!r}")
    notes += [
        f"of equal answers optuav takes the one with the smallest {Text().write(preference)}"
        for preference in model.preferences
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"programme.{form}"
        file.writeModel(str(path))
        text = path.read_text("ascii")
    return "".join(f"{FILES[form]}{' '.join(note.split())}\n" for note in notes) + text


def _refuse(label: str, numbers: Sequence[float]) -> None:
    """Refuse numbers that a file cannot hold."""
    if not np.isfinite(numbers).all():
        raise InputError(f"{label!r} has a number that a file cannot hold: NaN or infinite")


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
