"""Is a point feasible? Every constraint evaluated in NumPy, apart from any solver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.errors import Fault, InputError
from optuav.modelling.expression import Sense, evaluate
from optuav.modelling.model import Constraint, Model

TOLERANCE = 1e-9
"""A constraint holds if it is short by no more than this, relative to max(1, |right side|)."""


@dataclass(frozen=True)
class Check:
    """One constraint at a point, or at an array of points.

    Parameters
    ----------
    label, unit, declared_at
        As declared.
    sense
        How the sides compare.
    left, right
        Values of the two sides.
    slack
        By how much it holds; negative where it is violated.
    satisfied
        Whether it holds within `TOLERANCE`.
    """

    label: str
    unit: str
    declared_at: str
    sense: Sense
    left: Any
    right: Any
    slack: Any
    satisfied: Any

    def __str__(self) -> str:
        unit = "" if self.unit == "1" else f" {self.unit}"
        if np.ndim(self.satisfied):
            held = f"holds at {np.sum(self.satisfied)} of {np.size(self.satisfied)} points"
            return f"{self.label}: {held}, least slack {np.min(self.slack):.6g}{unit}"
        sides = f"{self.left:.6g} {self.sense} {self.right:.6g}{unit}"
        verdict = "holds" if self.satisfied else "VIOLATED"
        return f"{self.label}: {sides} {verdict}, slack {self.slack:.6g}{unit}"


def relations(model: Model) -> Iterator[Constraint]:
    """All constraints of a model, the finite bounds of its variables among them."""
    yield from model.constraints
    for variable in model.variables:
        if not _is_number(variable.lower, -np.inf):
            yield Constraint(variable.label, variable >= variable.lower, variable.unit, "")
        if not _is_number(variable.upper, np.inf):
            yield Constraint(variable.label, variable <= variable.upper, variable.unit, "")


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


def check(model: Model, point: Mapping[str, Any]) -> tuple[Check, ...]:
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
        If a value is no number or array of numbers, or the arrays do not broadcast.
    KeyError
        If a variable has no value.
    """
    point = _numbers(point)
    rows = []
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for constraint in stated:
        left = evaluate(constraint.relation.left, point, done)
        right = evaluate(constraint.relation.right, point, done)
        sense = constraint.relation.sense
        rows.append(
            Check(
                constraint.label,
                constraint.unit,
                constraint.declared_at,
                sense,
                left,
                right,
                slack(sense, left, right),
                holding(sense, left, right),
            )
        )
    return tuple(rows)


def _numbers(point: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a point as numbers and arrays."""
    found: dict[str, Any] = {}
    faults = []
    for name, value in point.items():
        try:
            found[name] = value if isinstance(value, float) else _number(value)
        except (TypeError, ValueError):
            faults.append(Fault(name, repr(value), "a number or an array of numbers"))
    shapes = {name: np.shape(value) for name, value in found.items() if np.ndim(value)}
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        told = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        faults.append(Fault("point", told, "arrays whose shapes broadcast"))
    if faults:
        raise InputError(faults)
    return found


def _number(value: Any) -> Any:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "biuf":
        raise TypeError
    return numbers.astype(float)[()]
