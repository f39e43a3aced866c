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

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

NOTHING = Fraction(0)


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
        from optuav.diagnosis.proof_words import combination_text

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
    """Constraints that contradict each other: they add up to 0 ≤ something negative (Farkas).

    Parameters
    ----------
    rows
        The constraints that are used; none of them can be spared.
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
    rows
        The constraints that are used.
    objective
        Coefficients of what is maximised by symbol of the unknown, exact, without zeros.
    """

    objective: Mapping[str, Fraction]

    def holds(self) -> bool:
        """Whether the rows prove the bound, evaluated exactly."""
        return self.is_valid and self.coefficients == self.objective
