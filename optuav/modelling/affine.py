"""Affine forms of expressions: a constant and a coefficient for every variable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from optuav.modelling.expression import Operand, Relation
from optuav.modelling.kibam_form import CONSTANT, Exponential, applied, exponential


class NotAffineError(ValueError):
    """The expression is not affine in the variables."""


class Affine(NamedTuple):
    """constant + Σ coefficient · variable, each a number or an array over programmes."""

    constant: Operand
    coefficients: Mapping[str, Operand]

    def times(self, factor: Operand) -> Affine:
        """This form times a number or an array."""
        return Affine(
            self.constant * factor,
            {name: coefficient * factor for name, coefficient in self.coefficients.items()},
        )


def affine(expression: Operand, values: Mapping[str, Operand]) -> Affine:
    """Affine form of an expression.

    Parameters
    ----------
    expression
        The tree.
    values
        Values of parameters by name; one that is not named keeps its own.

    Raises
    ------
    NotAffineError
        If a variable is multiplied by another, is in a divisor or in a nonlinear function.

    Examples
    --------
    >>> from optuav.modelling import Model, affine
    >>> model = Model("an example")
    >>> x, y = (model.variable(name, name, unit="s") for name in "xy")
    >>> form = affine(3.0 * x - (y - 2.0) / 4.0, {})
    >>> float(form.constant), form.coefficients
    (0.5, {'x': 3.0, 'y': -0.25})
    """
    return _affine(exponential(expression, values, call=_call))


def excess(relation: Relation, values: Mapping[str, Operand]) -> tuple[Affine, Operand]:
    """Left side less right side as an affine form, and the constant on the right; see `affine`."""
    left, right = (exponential(side, values, call=_call) for side in relation.sides)
    return _affine(left - right), right.terms.get(CONSTANT, 0.0)


def _affine(form: Exponential) -> Affine:
    terms = {name: c for each, c in form.terms.items() for name, _ in each}
    return Affine(form.terms.get(CONSTANT, 0.0), terms)


def _call(ufunc: np.ufunc, operands: tuple[Operand, ...]) -> Operand:
    moving = [isinstance(each, Exponential) for each in operands]
    if any(moving) and not is_affine(ufunc, moving):
        raise NotAffineError(not_affine(ufunc))
    return applied(ufunc, operands)


def is_affine(ufunc: np.ufunc, moving: Sequence[bool]) -> bool:
    """Whether a function of operands is affine, where some of them move with the unknowns."""
    if ufunc in (np.add, np.subtract, np.negative, np.positive):
        return True
    if ufunc is np.multiply:
        return not all(moving)
    return ufunc is np.divide and not moving[1]


def not_affine(ufunc: np.ufunc) -> str:
    """Why a function of the unknowns is not affine."""
    return f"{ufunc.__name__} of the unknowns is not linear"
