"""A programme as the text of a file: LP and free MPS by HiGHS, other formats by Pyomo.

LP and MPS hold linear programmes, with numbers to 15 digits, as HiGHS writes them. Names and labels
become names that both formats take; remarks at the top list them.
"""

import itertools
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from optuav.arrays import Values
from optuav.engines.linear_form import linear_form, own_bounds
from optuav.engines.pyomo_model import failures_named, to_pyomo
from optuav.errors import InputError, printable
from optuav.modelling.check import holding
from optuav.modelling.classify import traits
from optuav.modelling.expression import Variable
from optuav.modelling.model import Model
from optuav.modelling.writer import Text
from optuav.silence import silent

LONGEST_NAME = 120
RESERVED = (
    r"(?i)(\d|e\d|inf|nan).*|min|max|minimi[sz]e|maximi[sz]e|minimum|maximum|st|s\.t|subject|such|"
    r"bounds?|binary|binaries|bin|generals?|gen|integers?|free|semi|sos|end|"
    r"obj|objective|rhs|ranges|rows|columns|name|endata|marker|"
)
"""Texts that a reader of LP or MPS takes for a number or a keyword."""
LINEAR = ("lp", "mps")
FILES: Mapping[str, str] = {"lp": "\\ ", "mps": "* ", "nl": "# ", "gms": "* ", "bar": "// "}
"""Start of a comment, by suffix of a format; in .nl only the first line has one."""


def need_linear(model: Model) -> None:
    """Refuse a model that LP and MPS files cannot hold."""
    if flaw := traits(model).nonlinear:
        words = "{!r} is not linear: {}".format(*flaw)
        raise InputError(f"LP and MPS files can hold only linear programmes; {words}")


def to_file(model: Model, values: Values, form: str, remarks: Iterable[str] = ()) -> str:
    """The text of a file in a format of `FILES`, with title, remarks and names in comments.

    Parameters may have other values, as of ``model.row(index)``.
    """
    text, names = (_by_highs if form in LINEAR else _by_pyomo)(model, values, form)
    notes = [printable(" ".join(note.split())) for note in (model.title, *remarks, *names)]
    if form == "nl":
        head, _, rest = text.partition("\n")
        return f"{head.partition('#')[0]}{FILES[form]}{'; '.join(notes)}\n{rest}"
    return "".join(f"{FILES[form]}{note}\n" for note in notes) + text


def _symbol(variable: Variable) -> str:
    """Symbol and unit of an unknown."""
    return variable.symbol + ("" if variable.unit == "1" else f" [{variable.unit}]")


def _by_pyomo(model: Model, values: Values, form: str) -> tuple[str, list[str]]:
    """Text by a writer of Pyomo, and the meaning of the names in it."""
    made = to_pyomo(model, values)
    with tempfile.TemporaryDirectory() as folder, failures_named(f"its .{form} writer", InputError):
        path = Path(folder) / f"programme.{form}"
        # Not every reader of .nl skips comments, which the labels are there.
        _, number = made.write(str(path), io_options={"symbolic_solver_labels": form != "nl"})
        symbols = made.solutions.symbol_map[number].byObject
        text = path.read_text("utf-8")
    names = [(symbols.get(id(made.unknowns[x.name])), x) for x in model.variables]
    # A name is missing where no constraint has the unknown.
    return text, [f"{name} is {x.name}, {_symbol(x)}" for name, x in names if name]


@silent()
def _by_highs(model: Model, values: Values, form: str) -> tuple[str, list[str]]:
    """Text of a linear programme, and the meaning of the names in it."""
    import highspy

    need_linear(model)
    rows = linear_form(model, values)
    names = _legal(rows.names, "x_")
    labels_of_rows = [constraint.label for constraint in model.constraints]
    labels = _legal([*labels_of_rows, *(unknown.label for unknown in model.variables)], "c_")
    pairs = zip(names, model.variables, strict=True)
    notes = [f"{name} is {_symbol(unknown)}" for name, unknown in pairs]
    file = highspy.Highs()  # type: ignore[no-untyped-call]
    file.setOptionValue("output_flag", False)
    goal, constant = rows.sign * rows.directions[0, :, 0], rows.sign * rows.offsets[0, 0]
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
            notes.append(f"{constraint.label!r} holds for all values of the unknowns: left out")
            continue
        least = -highspy.kHighsInf if sense == "<=" else limit
        most = highspy.kHighsInf if sense == ">=" else limit
        file.addRow(least, most, len(used), used, row[used])
        file.passRowName(file.getNumRow() - 1, label)
        notes.append(f"{label} is {constraint.label!r}")
    notes += [
        f"among equal answers optuav chooses the one with the smallest {Text().write(preference)}"
        for preference in model.preferences
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"programme.{form}"
        file.writeModel(str(path))
        return path.read_text("ascii"), notes


def _refuse(label: str, numbers: Sequence[float]) -> None:
    """Refuse numbers that a file cannot hold."""
    if not np.isfinite(numbers).all():
        raise InputError(f"{label!r} has a number that a file cannot hold: NaN or infinite")


def _legal(labels: Iterable[str], prefix: str) -> list[str]:
    """Names that both formats take, one for each label, all different."""
    found: dict[str, str] = {}
    for label in labels:
        name = re.sub(r"[^A-Za-z0-9_.]+", "_", label).strip("_.")[:LONGEST_NAME]
        name = prefix + name if re.fullmatch(RESERVED, name) else name
        numbered = (f"{name}_{number}" for number in itertools.count(2))
        unique = next(u for u in itertools.chain([name], numbered) if u.lower() not in found)
        found[unique.lower()] = unique
    return list(found.values())
