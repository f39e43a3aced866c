"""Proofs that a reader can check by hand: constraints added up with exact multipliers.

The rows a·x ≤ b of a linear programme, each times a multiplier y ≥ 0, add up to a consequence
(Σ y a)·x ≤ Σ y b. Farkas: a programme is infeasible exactly if some sum reads 0 ≤ something
negative. Duality: an optimum is proved by a sum that bounds the objective by it. The numbers are
the exact rational values of the floats in the programme.

References
----------
.. [1] A. Schrijver, "Theory of linear and integer programming", Wiley, 1986, chapter 7.
.. [2] J. W. Chinneck, "Feasibility and infeasibility in optimization", Springer, 2008.
.. [3] R. G. Bland, "New finite pivoting rules for the simplex method", Mathematics of Operations
   Research, 1977.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from optuav.arrays import Values
from optuav.diagnosis.words import columns, exact_text, number_text
from optuav.engines.linear_form import linear_form
from optuav.modelling.check import relations
from optuav.modelling.expression import Parameter
from optuav.modelling.forms import NotAffineError, affine
from optuav.modelling.model import Constraint, Model
from optuav.modelling.traversal import leaves

ZERO = Fraction(0)
ROUNDING = Fraction(1, 10**11)
"""By how much rounding may violate a limit, relative to max(1, |limit|), without a conflict."""
DIGITS = (4, 6, 9, 12)
"""Significant digits to which the rows of a certificate are rounded, the fewest that do."""

Column = Sequence[Fraction]


@dataclass(frozen=True)
class Row:
    """A constraint as a row Σ coefficient · unknown ≤ limit, with its multiplier in a sum."""

    label: str
    parameters: tuple[str, ...]  # Names of the parameters in the constraint
    keys: tuple[str, ...]  # Their keys of the mission
    coefficients: Mapping[str, Fraction]  # By symbol of the unknown, exact, without zeros
    limit: Fraction
    multiplier: Fraction = ZERO


@dataclass(frozen=True)
class Combination:
    """Constraints added up, each times its multiplier; none of the rows can be spared."""

    rows: tuple[Row, ...]

    @property
    def coefficients(self) -> dict[str, Fraction]:
        """Σ y a by symbol of the unknown, without zeros."""
        sums: dict[str, Fraction] = {}
        for row in self.rows:
            for symbol, factor in row.coefficients.items():
                sums[symbol] = sums.get(symbol, ZERO) + row.multiplier * factor
        return {symbol: value for symbol, value in sums.items() if value}

    @property
    def limit(self) -> Fraction:
        """Σ y b."""
        return sum((row.multiplier * row.limit for row in self.rows), ZERO)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the constraints, each once."""
        return tuple(dict.fromkeys(row.label for row in self.rows))

    @property
    def keys(self) -> tuple[str, ...]:
        """The mission's keys in them, each once."""
        return tuple(dict.fromkeys(key for row in self.rows for key in row.keys))

    def holds(self) -> bool:
        """Whether the rows may be added up: there are some, and no multiplier is negative."""
        return bool(self.rows) and all(row.multiplier >= 0 for row in self.rows)

    def lines(self) -> list[str]:
        """Lines of text: the rows with their multipliers, and their sum."""
        return _lines(self, number_text, "")

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def to_dict(self) -> dict[str, object]:
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


def _number(value: Fraction) -> dict[str, object]:
    return {"exact": str(value), "rounded": float(value)}


@dataclass(frozen=True)
class Certificate(Combination):
    """Constraints that contradict each other: they add up to 0 ≤ something negative (Farkas).

    Parameters
    ----------
    rows
        The constraints that are used; none of them can be spared.
    positive
        Symbols of the unknowns that are 0 or more, by constraints that need not be among the rows.

    Examples
    --------
    >>> import optuav
    >>> late = optuav.load("paper").replace({"limits.deadline_s": 60})
    >>> part = optuav.formulate(late, "P3", perspective="battery").parts[0]
    >>> (certificate,) = certificates(part.model, part.model.row(0))
    >>> certificate.holds(), certificate.keys
    (True, ('limits.deadline_s',))
    >>> print(certificate)
                 1 ×  P3.b hover time  −Δ ≤ 0
                 1 ×  P3.b hover time  Δ ≤ −15.79
                 sum                   0 ≤ −15.79, which is false
    """

    positive: frozenset[str] = frozenset()

    def holds(self) -> bool:
        """Whether the rows prove that no point satisfies them all, evaluated exactly."""
        return super().holds() and not self.coefficients and self.limit < 0

    def lines(self) -> list[str]:
        """Lines of text: rounded rows, of which no digit is left out, and their exact sum."""
        return _lines(shortened(self), exact_text, ", which is false")


@dataclass(frozen=True)
class Bound(Combination):
    """Constraints that add up to objective ≤ limit: no point that satisfies them is better."""

    objective: Mapping[str, Fraction]  # What is maximised, by symbol of the unknown

    def holds(self) -> bool:
        """Whether the rows prove the bound, evaluated exactly."""
        return super().holds() and self.coefficients == self.objective


def _lines(used: Combination, number: Callable[[Fraction], str], verdict: str) -> list[str]:
    def inequality(coefficients: Mapping[str, Fraction], limit: Fraction) -> str:
        terms: list[str] = []
        for symbol, factor in coefficients.items():
            size = symbol if abs(factor) == 1 else f"{number(abs(factor))}·{symbol}"
            sign = "−" if factor < 0 else "+"
            terms.append(f"{sign} {size}" if terms else f"{sign}{size}".removeprefix("+"))
        return f"{' '.join(terms) or '0'} ≤ {number(limit)}"

    rows = [
        (f"{number(row.multiplier)} ×", row.label, inequality(row.coefficients, row.limit))
        for row in used.rows
    ]
    rows.append(("sum", "", inequality(used.coefficients, used.limit) + verdict))
    return columns(rows, formulas=True)


def certificates(
    model: Model, parameters: Values, slot_s: float | None = None
) -> Iterator[Certificate]:
    """Minimal conflicts of linear constraints, no two of which share a constraint on parameters.

    A repair has to resolve all of them; resolving these may bring up others. Constraints that are
    not linear are left out: what the others prove holds with them too. In slots the unknowns take
    at least their first slot; that slots are whole is not used.
    """
    rows = _rows(linear_part(model), parameters, slot_s)
    symbols = [each.symbol for each in model.variables]
    positive = frozenset(
        symbol
        for row in rows
        for symbol, factor in row.coefficients.items()
        if len(row.coefficients) == 1 and factor < 0 and row.limit <= 0
    )
    target = [ZERO] * len(symbols) + [Fraction(-1)]
    while True:
        weights = combination([_column(row, symbols, ROUNDING) for row in rows], target)
        if weights is None:
            return
        used = {k for k, weight in enumerate(weights) if weight}
        yield Certificate(_weighted(rows, weights), positive)
        stated = {k for k in used if rows[k].parameters} or used
        rows = [row for k, row in enumerate(rows) if k not in stated]


def bound(model: Model, parameters: Values, binding: Collection[str]) -> Bound | None:
    """Rows among the binding ones that add up to the objective: no point is better.

    What is minimised counts negated. None if no rows do, or none are needed.
    """
    symbols = [each.symbol for each in model.variables]
    goal = [Fraction(float(x)) for x in linear_form(model, parameters).directions[0, :, 0]]
    rows = [row for row in _rows(model, parameters) if row.label in binding]
    weights = combination([_column(row, symbols)[:-1] for row in rows], goal)
    if not weights or not any(weights):
        return None
    used = (replace(row, multiplier=y) for row, y in zip(rows, weights, strict=True) if y)
    objective = {symbol: x for symbol, x in zip(symbols, goal, strict=True) if x}
    return Bound(tuple(used), objective)


def linear_part(model: Model) -> Model:
    """The model with its linear constraints alone, and no objective."""
    return subset(model, [each for each in model.constraints if _is_linear(each)])


def subset(model: Model, constraints: Iterable[Constraint]) -> Model:
    """Some constraints of a model over the same unknowns, and no objective."""
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


def parameters_in(constraint: Constraint) -> tuple[Parameter, ...]:
    """The parameters in a constraint."""
    found = leaves(*constraint.relation.sides)
    return tuple(each for each in found if isinstance(each, Parameter))


def _rows(model: Model, parameters: Values, slot_s: float | None = None) -> list[Row]:
    """The rows of a linear programme that limit something; an infinite limit does not."""
    form = linear_form(model, parameters)
    symbols = [each.symbol for each in model.variables]
    # An equality gives two rows of the linear form.
    stated = [c for c in relations(model) for _ in range(1 + (c.relation.sense == "=="))]
    found = []
    for constraint, normal, limit in zip(
        stated, form.normals[..., 0].tolist(), form.limits[:, 0].tolist(), strict=True
    ):
        if np.isfinite([*normal, limit]).all():
            named = parameters_in(constraint)
            numbers = zip(symbols, map(Fraction, normal), strict=True)
            found.append(
                Row(
                    constraint.label,
                    tuple(each.name for each in named),
                    tuple(each.key for each in named if each.key),
                    {symbol: factor for symbol, factor in numbers if factor},
                    Fraction(limit),
                )
            )
    for each in model.variables if slot_s is not None else ():
        if each.first_slot > 0:
            least_s = Fraction(each.first_slot * (slot_s or 0.0))
            label = f"first slot of {each.symbol}"
            found.append(Row(label, (), (), {each.symbol: Fraction(-1)}, -least_s))
    return found


def _column(row: Row, symbols: Sequence[str], allowance: Fraction = ZERO) -> list[Fraction]:
    """(a, b) of a row, with a relative allowance on b."""
    limit = row.limit + allowance * max(Fraction(1), abs(row.limit))
    return [*(row.coefficients.get(symbol, ZERO) for symbol in symbols), limit]


def _weighted(rows: Sequence[Row], weights: Sequence[Fraction]) -> tuple[Row, ...]:
    """The rows that carry weight, that of the first as 1: only the ratios count."""
    first = next(weight for weight in weights if weight)
    pairs = zip(rows, weights, strict=True)
    return tuple(replace(row, multiplier=weight / first) for row, weight in pairs if weight)


def combination(vectors: Sequence[Column], target: Column) -> list[Fraction] | None:
    """Multipliers y ≥ 0 with Σ y_k vector_k = target, exact; None if there are none.

    The vectors that carry weight are linearly independent, so that none of them can be spared.
    Phase one of the simplex method, with Bland's rule against cycling [3]_.
    """
    count = len(vectors)
    signs = [-1 if value < 0 else 1 for value in target]
    rows = [
        [*(sign * vector[k] for vector in vectors), sign * target[k]]
        for k, sign in enumerate(signs)
    ]
    basis = [count + k for k in range(len(rows))]  # at first what is missing of each target
    missing = [sum((row[j] for row in rows), ZERO) for j in range(count + 1)]
    while missing[count] > 0:
        entering = next((j for j in range(count) if missing[j] > 0), None)
        if entering is None:
            return None
        ratios = [
            (row[count] / row[entering], basis[k], k)
            for k, row in enumerate(rows)
            if row[entering] > 0
        ]
        leaving = min(ratios)[2]
        basis[leaving] = entering
        pivot = rows[leaving][entering]
        rows[leaving] = [value / pivot for value in rows[leaving]]
        for k, row in enumerate(rows):
            if k != leaving and row[entering]:
                rows[k] = _without(row, rows[leaving], row[entering])
        missing = _without(missing, rows[leaving], missing[entering])
    found = [ZERO] * count
    for k, column in enumerate(basis):
        if column < count:
            found[column] = rows[k][count]
    return found


def _without(row: Column, other: Column, factor: Fraction) -> list[Fraction]:
    return [value - factor * taken for value, taken in zip(row, other, strict=True)]


def shortened(proof: Certificate) -> Certificate:
    """A certificate from the same constraints with fewer digits; the same where there is none.

    Where unknowns are at least 0, a row a·x ≤ b implies one with a smaller a and a larger b. If the
    rows rounded so still contradict each other, that is a proof, and its sum is exact.
    """
    for digits in DIGITS:
        rows = [_rounded(row, digits, proof.positive) for row in proof.rows]
        symbols = [*dict.fromkeys(symbol for row in rows for symbol in row.coefficients)]
        target = [ZERO] * len(symbols) + [Fraction(-1)]
        weights = combination([_column(row, symbols) for row in rows], target)
        if weights is not None:
            found = Certificate(_weighted(rows, weights), proof.positive)
            if found.holds():
                return found
    return proof


def _rounded(row: Row, digits: int, positive: Collection[str]) -> Row:
    """A row that follows from another where some unknowns are at least 0."""
    coefficients = {
        symbol: _floor(factor, digits) if symbol in positive else factor
        for symbol, factor in row.coefficients.items()
    }
    return replace(row, coefficients=coefficients, limit=-_floor(-row.limit, digits))


def _floor(value: Fraction, digits: int) -> Fraction:
    """The largest number of so many significant digits that is not larger."""
    if not value:
        return value
    unit = Fraction(10) ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return math.floor(value / unit) * unit
