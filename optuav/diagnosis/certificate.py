"""Proofs that a reader can check by hand: named constraints, added up with exact multipliers.

The rows a·x ≤ b of a linear programme, each times a multiplier y ≥ 0, add up to a consequence
(Σ y a)·x ≤ Σ y b. Farkas: a programme is infeasible exactly if some sum reads 0 ≤ something
negative. Duality: an optimum is one if some sum bounds the objective by it. The numbers are the
exact rational values of the floats in the programme.

References
----------
.. [1] A. Schrijver, "Theory of linear and integer programming", Wiley, 1986, chapter 7.
.. [2] J. W. Chinneck, "Feasibility and infeasibility in optimization", Springer, 2008.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from optuav.diagnosis.exact import combination
from optuav.engines.linear_form import linear_form
from optuav.modelling.affine import NotAffineError, affine
from optuav.modelling.check import relations
from optuav.modelling.expression import Parameter
from optuav.modelling.model import Constraint, Model
from optuav.modelling.walk import leaves

NOTHING = Fraction(0)
ROUNDING = Fraction(1, 10**11)
"""By how much rounding may violate a limit, relative to max(1, |limit|); no conflict by itself."""


@dataclass(frozen=True)
class Row:
    """A constraint as a row Σ coefficient · unknown ≤ limit, and how often it is taken.

    Parameters
    ----------
    label
        Of the constraint, as declared.
    parameters
        Names of the parameters that it speaks of.
    keys
        The mission's keys among them, dotted.
    multiplier
        y, exact.
    coefficients
        By symbol of the unknown, exact; unknowns that do not occur are left out.
    limit
        b, exact.
    """

    label: str
    parameters: tuple[str, ...]
    keys: tuple[str, ...]
    multiplier: Fraction
    coefficients: Mapping[str, Fraction]
    limit: Fraction


@dataclass(frozen=True)
class Combination:
    """Constraints added up, each times its multiplier.

    Parameters
    ----------
    rows
        The constraints that are used; none of them can be spared.
    """

    rows: tuple[Row, ...]

    @property
    def coefficients(self) -> dict[str, Fraction]:
        """Σ y a by symbol of the unknown, without zeros."""
        symbols = dict.fromkeys(symbol for row in self.rows for symbol in row.coefficients)
        sums = {
            symbol: sum(
                (row.multiplier * row.coefficients.get(symbol, NOTHING) for row in self.rows),
                NOTHING,
            )
            for symbol in symbols
        }
        return {symbol: value for symbol, value in sums.items() if value}

    @property
    def limit(self) -> Fraction:
        """Σ y b."""
        return sum((row.multiplier * row.limit for row in self.rows), NOTHING)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the constraints, each once."""
        return tuple(dict.fromkeys(row.label for row in self.rows))

    @property
    def keys(self) -> tuple[str, ...]:
        """The mission's keys in them, each once."""
        return tuple(dict.fromkeys(key for row in self.rows for key in row.keys))

    @property
    def is_valid(self) -> bool:
        """Whether rows may be added up so: no multiplier is negative."""
        return bool(self.rows) and all(row.multiplier >= 0 for row in self.rows)

    def __str__(self) -> str:
        from optuav.diagnosis.writing import combination_text

        return "\n".join(combination_text(self))

    def to_dict(self) -> dict[str, Any]:
        """As plain data; every number exact, as ``"numerator/denominator"``, and rounded."""
        return {
            "holds": self.holds(),
            "rows": [
                {
                    "label": row.label,
                    "parameters": list(row.parameters),
                    "keys": list(row.keys),
                    "multiplier": _number(row.multiplier),
                    "coefficients": {s: _number(a) for s, a in row.coefficients.items()},
                    "limit": _number(row.limit),
                }
                for row in self.rows
            ],
            "sum": {
                "coefficients": {s: _number(a) for s, a in self.coefficients.items()},
                "limit": _number(self.limit),
            },
        }

    def holds(self) -> bool:
        """Whether the sum is a consequence of the rows, evaluated exactly."""
        return self.is_valid


def _number(value: Fraction) -> dict[str, Any]:
    return {"exact": str(value), "rounded": float(value)}


@dataclass(frozen=True)
class Certificate(Combination):
    """Constraints that contradict each other: they add up to 0 ≤ something negative.

    Parameters
    ----------
    positive
        Symbols of the unknowns that are 0 or more, by constraints that need not be among the rows.
    """

    positive: frozenset[str] = frozenset()

    def holds(self) -> bool:
        """Whether the rows prove that no point satisfies them all, evaluated exactly."""
        return self.is_valid and not self.coefficients and self.limit < 0


@dataclass(frozen=True)
class Bound(Combination):
    """Constraints that add up to objective ≤ limit: no point that satisfies them is better.

    Parameters
    ----------
    objective
        Coefficients of what is maximised by symbol of the unknown, exact, without zeros.
    """

    objective: Mapping[str, Fraction]

    def holds(self) -> bool:
        """Whether the rows prove the bound, evaluated exactly."""
        return self.is_valid and self.coefficients == self.objective


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
