"""Is a point feasible? Every constraint evaluated in NumPy, apart from any solver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.errors import Fault, InputError
from optuav.modelling.display import table
from optuav.modelling.expression import Sense
from optuav.modelling.model import Constraint, Model
from optuav.modelling.traversal import evaluate

TOLERANCE = 1e-9
"""A constraint holds if it is short by no more than this, relative to max(1, |right side|)."""
MOST_NAMED = 10
"""Points at which a constraint is violated that are told by name."""
SIGNS: Mapping[Sense, str] = {"<=": "≤", ">=": "≥", "==": "="}


@dataclass(frozen=True)
class Check:
    """One constraint at a point, or at an array of points.

    Parameters
    ----------
    constraint
        As declared, or a bound of a variable.
    left, right
        Values of the two sides.
    slack
        By how much it holds; negative where it is violated.
    satisfied
        Whether it holds within `TOLERANCE`.
    points
        What an array of points is, in words; by default how many there are.
    names
        What each of them is called; empty where they have no names.
    """

    constraint: Constraint
    left: Any
    right: Any
    slack: Any
    satisfied: Any
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
        """How the sides compare."""
        return self.constraint.relation.sense

    @property
    def declared_at(self) -> str:
        """Source file and line of the declaration."""
        return self.constraint.declared_at

    def __str__(self) -> str:
        return " ".join([f"{self.label}:", *self.cells[1:]]).rstrip()

    @property
    def cells(self) -> tuple[str, ...]:
        """Label, both sides, verdict and source line, as the table of `Checks` shows them."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        if np.ndim(self.satisfied):
            points = self.points or f"at {np.size(self.satisfied)} points"
            return self.label, points, self._verdict_at_points(unit), self.declared_at
        sides = f"{self.left:.6g} {SIGNS[self.sense]} {self.right:.6g}{unit}"
        verdict = f"holds, slack {abs(self.slack):.6g}{unit}"
        if not self.satisfied:
            verdict = f"VIOLATED by {-self.slack:.6g}{unit}"
        return self.label, sides, verdict, self.declared_at

    def _verdict_at_points(self, unit: str) -> str:
        """Whether it holds at all points, else at which it is violated, and by how much."""
        violated = np.flatnonzero(~np.ravel(self.satisfied))
        if not violated.size:
            return f"holds at all, least slack {np.min(np.abs(self.slack)):.6g}{unit}"
        verdict = f"VIOLATED at {violated.size} by up to {-np.min(self.slack):.6g}{unit}"
        if len(self.names) != np.size(self.satisfied):
            return verdict
        named = ", ".join(self.names[index] for index in violated[:MOST_NAMED])
        more = violated.size - MOST_NAMED
        return f"{verdict}: {named}" + (f" and {more} more" if more > 0 else "")


class Checks(tuple[Check, ...]):
    """The constraints of a model at a point, in order; printed as a table."""

    @property
    def satisfied(self) -> bool:
        """Whether all of them hold, at every point."""
        return all(bool(np.all(row.satisfied)) for row in self)

    def __str__(self) -> str:
        heads = ("constraint", "left and right", "verdict", "declared at")
        return table([heads, *(row.cells for row in self)])

    __repr__ = __str__


def relations(model: Model) -> Iterator[Constraint]:
    """All constraints of a model, the finite bounds of its variables among them."""
    yield from model.constraints
    for variable in model.variables:
        stated = variable.unit, variable.declared_at, variable.kind
        if not _is_number(variable.lower, -np.inf):
            yield Constraint(variable.label, variable >= variable.lower, *stated)
        if not _is_number(variable.upper, np.inf):
            yield Constraint(variable.label, variable <= variable.upper, *stated)


def _is_number(bound: Any, number: float) -> bool:
    return isinstance(bound, float) and bound == number


def holding(sense: Sense, left: Any, right: Any) -> Any:
    """Whether two values compare as they should, within `TOLERANCE`."""
    allowance = TOLERANCE * np.maximum(1.0, np.abs(right))
    if sense == ">=":
        return left >= right - allowance
    if sense == "<=":
        return left <= right + allowance
    return np.abs(left - right) <= allowance


def slack(sense: Sense, left: Any, right: Any) -> Any:
    """By how much two values compare as they should; negative where they do not."""
    if sense == "==":
        return -np.abs(left - right)
    return left - right if sense == ">=" else right - left


def check(model: Model, point: Mapping[str, Any]) -> Checks:
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
    """
    return evaluated(model, _numbers(point, model))


def evaluated(model: Model, point: Mapping[str, Any]) -> Checks:
    """`check` at a point that is known to be one; what the model does not know is passed over.

    Raises
    ------
    KeyError
        If a variable has no value.
    """
    rows = []
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for constraint in stated:
        left = evaluate(constraint.relation.left, point, done)
        right = evaluate(constraint.relation.right, point, done)
        sense = constraint.relation.sense
        rows.append(
            Check(
                constraint,
                left,
                right,
                slack(sense, left, right),
                holding(sense, left, right),
            )
        )
    return Checks(rows)


def _numbers(point: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """The values of a point as numbers and arrays that broadcast with those of the model."""
    found: dict[str, Any] = {}
    faults = [*_misnamed(point, model)]
    for name, value in point.items():
        try:
            found[name] = value if isinstance(value, float) else _number(value)
        except (TypeError, ValueError):
            faults.append(Fault(name, repr(value), "a number or an array of at least one number"))
    shapes = {name: np.shape(value) for name, value in found.items() if np.ndim(value)}
    kept = (each.value for name, each in model.given.items() if name not in found)
    own = {np.shape(value) for value in kept if np.ndim(value)}
    try:
        np.broadcast_shapes(*shapes.values(), *own)
    except ValueError:
        told = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        model_has = f", also with the model's {', '.join(map(str, sorted(own)))}" if own else ""
        faults.append(Fault("point", told, f"arrays whose shapes broadcast{model_has}"))
    if faults:
        raise InputError(faults)
    return found


def _misnamed(point: Mapping[str, Any], model: Model) -> Iterator[Fault]:
    """Variables without a value, and names that are of nothing in the model."""
    known = [*(each.name for each in model.variables), *model.given]
    for variable in model.variables:
        if variable.name not in point:
            yield Fault(variable.name, "", "a variable of the model without a value")
    strange = [name for name in point if name not in known]
    for name in strange:
        words = f"the model has no such name; it has {', '.join(known)}"
        yield Fault(name, repr(point[name]), words)


def _number(value: Any) -> Any:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "biuf" or not numbers.size:
        raise TypeError
    return numbers.astype(float)[()]
