"""Proofs found: rows of a linear programme with exact multipliers that add up to what is claimed.

Infeasible by Farkas, optimal by duality (`optuav.diagnosis.certificate`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from optuav.diagnosis.certificate import NOTHING, Bound, Certificate, Row
from optuav.diagnosis.exact import combination
from optuav.engines.linear_form import linear_form
from optuav.modelling.affine import NotAffineError, affine
from optuav.modelling.check import relations
from optuav.modelling.expression import Parameter
from optuav.modelling.model import Constraint, Model
from optuav.modelling.traversal import leaves

ROUNDING = Fraction(1, 10**11)
"""By how much rounding may violate a limit, relative to max(1, |limit|); no conflict by itself."""


def certificates(
    model: Model, parameters: Mapping[str, Any], slot_s: float | None = None
) -> Iterator[Certificate]:
    """Conflicts of linear constraints, no two of which share a constraint on their parameters.

    Constraints that are not linear are left aside: what the others prove holds with them too.

    Parameters
    ----------
    model
        The declaration.
    parameters
        Values of all its parameters, numbers.
    slot_s
        Length of the slots [s], where unknowns begin with their first one; that other slots are
        whole does not count.

    Yields
    ------
    Certificate
        Each is minimal. A repair has to resolve all of them; resolving these may bring up others.

    """
    programme = _Programme(linear_part(model), parameters, slot_s)
    target = [NOTHING] * len(model.variables) + [Fraction(-1)]
    usable = programme.usable
    while True:
        weights = combination([programme.column(k, ROUNDING) for k in usable], target)
        if weights is None:
            return
        taken = {k: weight for k, weight in zip(usable, weights, strict=True) if weight}
        first = next(iter(taken.values()))  # only the ratios count
        rows = programme.rows({k: weight / first for k, weight in taken.items()})
        yield Certificate(rows, programme.positive)
        stated = {k for k in taken if programme.parameters[k]} or set(taken)
        usable = [k for k in usable if k not in stated]


def linear_part(model: Model) -> Model:
    """The model with its linear constraints alone, and nothing sought."""
    return subset(model, [each for each in model.constraints if _is_linear(each)])


def subset(model: Model, constraints: Sequence[Constraint]) -> Model:
    """Some constraints of a model over the same unknowns, and nothing sought."""
    part = Model(model.title)
    part.variables, part.constraints = model.variables, [*constraints]
    return part


def _is_linear(constraint: Constraint) -> bool:
    try:
        for side in constraint.relation.sides:
            affine(side, {})
    except NotAffineError:
        return False
    return True


def bound(model: Model, parameters: Mapping[str, Any], binding: Collection[str]) -> Bound | None:
    """Why no point of a linear programme is better than its optimum.

    Parameters
    ----------
    model
        The declaration.
    parameters
        Values of all its parameters, numbers.
    binding
        Labels of the constraints that hold with equality at the optimum.

    Returns
    -------
    Rows among those that add up to the objective (what is minimised, negated); None if none do or
    none are needed.
    """
    programme = _Programme(model, parameters)
    usable = [k for k in programme.usable if programme.labels[k] in binding]
    weights = combination([programme.column(k)[:-1] for k in usable], programme.goal)
    if not weights or not any(weights):
        return None
    taken = {k: weight for k, weight in zip(usable, weights, strict=True) if weight}
    return Bound(programme.rows(taken), programme.by_symbol(programme.goal))


class _Programme:
    """Rows of one linear programme with what they speak of."""

    def __init__(
        self, model: Model, parameters: Mapping[str, Any], slot_s: float | None = None
    ) -> None:
        form = linear_form(model, parameters)
        self.goal = [Fraction(float(value)) for value in form.directions[0, :, 0]]
        self.symbols = [variable.symbol for variable in model.variables]
        self.labels = [*form.labels]
        self.parameters = [constrained(each) for each in _constraints(model)]
        self.numbers = [
            [*normal, limit]
            for normal, limit in zip(form.normals[..., 0], form.limits[:, 0], strict=True)
        ]
        for k, variable in enumerate(model.variables if slot_s is not None else ()):
            if variable.first_slot > 0:
                self.labels.append(f"first slot of {variable.symbol}")
                self.parameters.append(())
                unit = [-1.0 if j == k else 0.0 for j in range(len(self.symbols))]
                self.numbers.append([*unit, -variable.first_slot * (slot_s or 0.0)])

    @property
    def usable(self) -> list[int]:
        """Numbers of the rows that limit something; an infinite limit does not."""
        return [k for k, row in enumerate(self.numbers) if np.isfinite(row).all()]

    @property
    def positive(self) -> frozenset[str]:
        """Symbols of the unknowns that some row keeps at 0 or more."""
        found = set()
        for *normal, limit in self.numbers:
            given = [k for k, factor in enumerate(normal) if factor]
            if len(given) == 1 and normal[given[0]] < 0.0 and limit <= 0.0:
                found.add(self.symbols[given[0]])
        return frozenset(found)

    def column(self, row: int, allowance: Fraction = NOTHING) -> list[Fraction]:
        """(a, b) of a row, with an allowance on b."""
        *normal, limit = (Fraction(float(number)) for number in self.numbers[row])
        return [*normal, limit + allowance * max(Fraction(1), abs(limit))]

    def by_symbol(self, numbers: Sequence[Fraction]) -> dict[str, Fraction]:
        """Numbers that are not zero, by symbol of the unknown."""
        return {s: value for s, value in zip(self.symbols, numbers, strict=True) if value}

    def rows(self, taken: Mapping[int, Fraction]) -> tuple[Row, ...]:
        """The rows that carry weight, by their numbers."""
        found = []
        for k, weight in taken.items():
            *normal, limit = self.column(k)
            named = self.parameters[k]
            found.append(
                Row(
                    label=self.labels[k],
                    parameters=tuple(each.name for each in named),
                    keys=tuple(each.key for each in named if each.key),
                    multiplier=weight,
                    coefficients=self.by_symbol(normal),
                    limit=limit,
                )
            )
        return tuple(found)


def _constraints(model: Model) -> Iterator[Constraint]:
    """The constraint of every row of the linear form; an equality gives two rows."""
    for constraint in relations(model):
        yield constraint
        if constraint.relation.sense == "==":
            yield constraint


def constrained(constraint: Constraint) -> tuple[Parameter, ...]:
    """The parameters that a constraint speaks of."""
    sides = constraint.relation.sides
    return tuple(each for each in leaves(*sides) if isinstance(each, Parameter))
