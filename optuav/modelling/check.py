"""Constraints evaluated at a point, apart from any solver, and numbers that no engine can use."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Number, Truth, Values, plain
from optuav.errors import Fault, InputError, for_console, refuse, shown
from optuav.frames import DataFrame, frame, without_rounding
from optuav.modelling.declaration import Constraint
from optuav.modelling.expression import Expression, Operand, Relation, Sense
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, has_unknowns, nodes
from optuav.modelling.writer import Text
from optuav.presentation.blocks import Block, Fold, Heading, Table
from optuav.presentation.numbers import figure, typed
from optuav.presentation.presented import Presented

CONSTRAINT_TOLERANCE = 1e-9
"""A constraint holds if it is short by no more than this, relative to max(1, |right side|)."""
COLUMNS = (
    *("constraint", "point", "left", "sense", "right"),
    *("slack", "unit", "satisfied", "declared_at"),
)
HEADS = ("constraint", "left and right", "verdict", "declared at")
MOST_NAMED = 10  # Most points named as violating a constraint
LONGEST_LABEL = 60  # Most characters of a label or a verdict


@dataclass(frozen=True)
class Check:
    """One constraint at a point, or at an array of points.

    Parameters
    ----------
    constraint
        As declared, or a bound of a variable.
    left, right, slack, satisfied
        Values of the two sides in the constraint's unit, by how much it holds (negative where it is
        violated), and whether it holds within `CONSTRAINT_TOLERANCE`; numbers, or arrays by point.
    points, names
        Meaning of the points of an array, and the name of each; empty if unknown.

    Examples
    --------
    >>> import optuav
    >>> program = optuav.formulate("paper", "P3", perspective="battery")
    >>> charge = program.check({"hover_time_s": 700.0})[0]
    >>> charge.label, bool(charge.satisfied), round(float(charge.slack), 4)
    ('P3.a state of charge', False, -0.0136)
    """

    constraint: Constraint
    left: Number
    right: Number
    slack: Number
    satisfied: Truth
    points: str = ""
    names: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Label of the constraint."""
        return self.constraint.label

    @property
    def unit(self) -> str:
        """Unit of both sides."""
        return self.constraint.unit

    @property
    def sense(self) -> Sense:
        """Sense of the comparison between the sides."""
        return self.constraint.relation.sense

    @property
    def declared_at(self) -> str:
        """Source file and line of the declaration."""
        return self.constraint.declared_at

    @for_console
    def __str__(self) -> str:
        return " ".join([f"{self.label}:", *self.cells[1:]]).rstrip()

    def __repr__(self) -> str:
        return f"<Check {self}>"

    def _repr_html_(self) -> str:
        return Checks([self])._repr_html_()

    def to_frame(self) -> DataFrame:
        """Return the table that `optuav.modelling.Checks` describes."""
        return Checks([self]).to_frame()

    @property
    def cells(self) -> tuple[str, ...]:
        """Label, both sides, verdict and source line, for `optuav.modelling.Checks`."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        violated, size = np.flatnonzero(~np.ravel(self.satisfied)), np.size(self.satisfied)
        several = np.ndim(self.satisfied) > 0
        least = np.min(self.slack if violated.size else np.abs(self.slack))
        worst = f"{figure(float(without_rounding(least)))}{unit}"
        if not violated.size:
            verdict = f"holds at all, least slack {worst}" if several else f"holds, slack {worst}"
        elif not several:
            verdict = f"VIOLATED by {worst.removeprefix('−')}"
        else:
            verdict = f"VIOLATED at {violated.size} by up to {worst.removeprefix('−')}"
            if len(self.names) == size:
                more = violated.size - MOST_NAMED
                verdict += f": {', '.join(self.names[k] for k in violated[:MOST_NAMED])}"
                verdict += f" and {more} more" if more > 0 else ""
        sides = self.points or f"at {size} points"
        if not several:
            left, right = figure(float(self.left)), figure(float(self.right))
            sides = f"{left} {Text.senses[self.sense]} {right}{unit}"
        return self.label, sides, verdict, self.declared_at


class Checks(Presented, tuple[Check, ...]):
    """The constraints of a model at a point, in order; printed as a table.

    A tuple of `optuav.modelling.Check`.

    Examples
    --------
    >>> import optuav
    >>> program = optuav.formulate("paper", "P3", perspective="battery")
    >>> checks = program.check({"hover_time_s": 700.0})
    >>> [check.label for check in checks if not check.satisfied], checks.satisfied
    (['P3.a state of charge'], False)
    """

    @property
    def satisfied(self) -> bool:
        """True if all of them hold at every point."""
        return all(bool(np.all(row.satisfied)) for row in self)

    def __repr__(self) -> str:
        broken = sum(not np.all(row.satisfied) for row in self)
        return f"<Checks: {len(self)} constraints, {broken} violated>"

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict and a row for each constraint."""
        broken = [number for number, row in enumerate(self) if not np.all(row.satisfied)]
        verdict = f"{len(broken)} of {len(self)} constraints violated"
        yield Fold("", [Heading(verdict, good=not broken)], in_text=False)
        yield Table(HEADS, [row.cells for row in self], words=4, longest=LONGEST_LABEL, bad=broken)

    def to_frame(self) -> DataFrame:
        """One row a constraint, and a point where they were evaluated at several; needs pandas.

        Returns
        -------
        DataFrame
            Columns ``constraint``, ``point`` (its name or its number from 0, if there are several),
            ``left``, ``sense``, ``right``, ``slack``, ``unit``, ``satisfied`` and ``declared_at``.
        """
        rows = list[tuple[object, ...]]()
        for row in self:
            size, several = np.size(row.satisfied), np.ndim(row.satisfied)
            names = (row.names if len(row.names) == size else range(size)) if several else [None]
            numbers = np.broadcast_arrays(row.left, row.right, row.slack, row.satisfied)
            figures = zip(*(number.ravel().tolist() for number in numbers), strict=True)
            for name, (left, right, slack, holds) in zip(names, figures, strict=True):
                sides = row.label, name, left, row.sense, right
                rows.append((*sides, slack, row.unit, holds, row.declared_at))
        return frame(rows, COLUMNS)


def relations(model: Model) -> Sequence[Constraint]:
    """All constraints of a model, the finite bounds of its variables among them."""
    walk = model.walked
    if walk.relations:
        return walk.relations
    rows = [*model.constraints]
    for variable in model.variables:
        about = variable.unit, variable.declared_at, variable.kind or "bounds"
        bounds = Relation(variable, ">=", variable.lower), Relation(variable, "<=", variable.upper)
        for bound, none in zip(bounds, (-np.inf, np.inf), strict=True):
            if not (isinstance(bound.right, float) and bound.right == none):
                rows.append(Constraint(variable.label, bound, *about))
    walk.relations = rows
    return rows


def holding(sense: Sense, left: Number, right: Number) -> Truth:
    """Return whether two values satisfy a relation, within `CONSTRAINT_TOLERANCE`."""
    allowance = CONSTRAINT_TOLERANCE * np.maximum(1.0, np.abs(right))
    if sense == ">=":
        return left >= right - allowance
    if sense == "<=":
        return left <= right + allowance
    return np.abs(left - right) <= allowance


def check(model: Model, point: Values) -> Checks:
    """Evaluate every constraint of a model at a point, from wherever it comes.

    Parameters
    ----------
    model
        The declaration.
    point
        Values of the variables by name, and of parameters that differ from the model's; numbers, or
        arrays or lists of numbers that broadcast.

    Raises
    ------
    InputError
        If a variable has no value, a name is neither of a variable nor of a parameter, a value is
        no number or array of numbers, or the arrays do not broadcast with one another and with the
        model's.

    Examples
    --------
    >>> from optuav.modelling import Model, check
    >>> model = Model("an example")
    >>> x = model.variable("x", "x", unit="s", upper=5.0)
    >>> model.subject_to("half", 2.0 * x <= 8.0)
    >>> rows = check(model, {"x": 4.5})
    >>> rows.satisfied, [(row.label, float(row.slack)) for row in rows if not row.satisfied]
    (False, [('half', -1.0)])
    """
    return evaluated(model, _numbers(point, model))


def evaluated(stated: Model | Iterable[Constraint], point: Values) -> Checks:
    """`check`, also for a few constraints; ignores other names, `KeyError` for a missing one."""
    rows, done = [], dict[int, Operand]()
    if isinstance(stated, Model):
        done, stated = stated.walked.values(point), relations(stated)
    for constraint in stated:
        sense, sides = constraint.relation.sense, constraint.relation.sides
        left, right = (evaluate(side, point, done) for side in sides)
        slack = right - left if sense == "<=" else left - right
        slack = -np.abs(slack) if sense == "==" else slack
        rows.append(Check(constraint, left, right, slack, holding(sense, left, right)))
    return Checks(rows)


def _numbers(point: Values, model: Model) -> dict[str, Operand]:
    """The values of a point as numbers and arrays that broadcast with the model's."""
    names, model_given = [variable.name for variable in model.variables], model.given
    words = "is a variable of the model and needs a value"
    faults = [Fault(name, "", words) for name in names if name not in point]
    words = f"the model has no such name; it has {', '.join([*names, *model_given])}"
    unknown = [name for name in point if name not in names and name not in model_given]
    faults += [Fault(name, shown(point[name]), words) for name in unknown]
    found: dict[str, Operand] = {}
    for name, value in point.items():
        try:
            numbers = plain(value)
        except ValueError:  # lists of different lengths
            numbers = np.empty(0)
        if numbers.dtype.kind in "biuf" and numbers.size:
            found[name] = numbers.astype(float)[()]
        else:
            faults.append(Fault(name, shown(value), "a number or an array of at least one number"))
    shapes = {name: np.shape(value) for name, value in found.items() if np.ndim(value)}
    others = {
        np.shape(parameter.value) for name, parameter in model_given.items() if name not in found
    }
    try:
        np.broadcast_shapes(*shapes.values(), *others)
    except ValueError:
        words = ", also with the model's " if others - {()} else ""
        words += ", ".join(map(str, sorted(others - {()})))
        sizes = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        faults.append(Fault("point", sizes, f"arrays whose shapes broadcast{words}"))
    refuse(faults)
    return found


def refuse_misfits(model: Model, programmes: int) -> None:
    """Refuse arrays with neither one entry nor one per programme, by constraint."""

    def misfits(trees: Iterable[Operand], below: Iterable[Expression]) -> set[tuple[int, ...]]:
        """Shapes of arrays among trees and the nodes below them."""
        held = [*trees]
        for node in below:
            held += getattr(node, "arguments", ()) or (getattr(node, "value", None),)
        shapes = {number.shape for number in held if isinstance(number, np.ndarray)}
        return shapes - {(), (1,), (programmes,)}

    if not misfits(model.walked.trees, model.walked.nodes):
        return
    words, faults = f"arrays with one entry a programme, here {programmes}", list[Fault]()
    for label, sides in _stated(model).items():
        shapes = sorted(misfits(sides, nodes(*sides)))
        faults += [Fault(label, f"array of shape {shape}", words) for shape in shapes]
    raise InputError(faults)


@np.errstate(all="ignore")
def unusable(model: Model, values: Values) -> str:
    """Return where a programme has NaN: parameters, else labels of constraints."""
    wrong = (name for name in model.given if not np.isfinite(values[name]))
    if parameters := [f"{name} = {typed(values[name])}" for name in wrong]:
        return ", ".join(parameters)
    anywhere = {**values, **{variable.name: 1.0 for variable in model.variables}}

    def is_unusable(side: Operand) -> bool:
        """Return whether a side is NaN, or has unknowns and is not finite."""
        value = evaluate(side, anywhere)
        return bool(np.any(np.isnan(value)) or (np.any(np.isinf(value)) and has_unknowns(side)))

    return ", ".join(repr(n) for n, sides in _stated(model).items() if any(map(is_unusable, sides)))


def _stated(model: Model) -> dict[str, list[Operand]]:
    """The goals, and the sides of the constraints and bounds, by label."""
    found: dict[str, list[Operand]] = {"objective": [model.objective, *model.preferences]}
    for constraint in model.constraints:
        found[constraint.label] = [*constraint.relation.sides]
    for variable in model.variables:
        found.setdefault(variable.label, []).extend((variable.lower, variable.upper))
    return found
