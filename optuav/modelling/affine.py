"""Affine forms of expressions: a constant and a coefficient for every variable."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from optuav.modelling.expression import Leaf, Operand, Parameter
from optuav.modelling.traversal import fold, leaves


class NotAffineError(ValueError):
    """The expression is not affine in the variables."""


@dataclass(frozen=True)
class Affine:
    """constant + Σ coefficient · variable, each a number or an array over programmes."""

    constant: Operand
    coefficients: Mapping[str, Operand]

    def plus(self, other: Affine, factor: float) -> Affine:
        """This form plus a multiple of another."""
        names = [*self.coefficients, *(n for n in other.coefficients if n not in self.coefficients)]
        return Affine(
            self.constant + factor * other.constant,
            {
                name: self.coefficients.get(name, 0.0) + factor * other.coefficients.get(name, 0.0)
                for name in names
            },
        )

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

    def leaf(node: Leaf) -> Operand:
        if isinstance(node, Parameter):
            return values.get(node.name, node.value)
        return Affine(0.0, {node.name: 1.0})

    folded = fold(expression, leaf, _apply)
    return folded if isinstance(folded, Affine) else Affine(folded, {})


class AffineForms:
    """Affine forms, kept until a parameter in the tree has another value.

    For trees that live as long as this, and parameters that are all given as numbers. Copies and
    pickles of it are empty: they are of other trees.
    """

    def __reduce__(self) -> tuple[type[AffineForms], tuple[()]]:
        return AffineForms, ()

    def __init__(self) -> None:
        self._found: dict[int, tuple[tuple[str, ...], tuple[Operand, ...], Affine]] = {}

    def __call__(self, expression: Operand, values: Mapping[str, Operand]) -> Affine:
        """The affine form of an expression, see `affine`."""
        known = self._found.get(id(expression))
        names = known[0] if known else _parameters(expression)
        given = tuple(map(values.get, names))
        if known and known[1] == given:
            return known[2]
        form = affine(expression, values)
        self._found[id(expression)] = names, given, form
        return form


def _parameters(expression: Operand) -> tuple[str, ...]:
    return tuple(each.name for each in leaves(expression) if isinstance(each, Parameter))


def reciprocal(divisor: Operand) -> Operand:
    """1/divisor; infinite for 0, as in NumPy, so that an engine can say which constraint has it."""
    try:
        return 1.0 / divisor
    except ZeroDivisionError:
        return math.inf


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


def _apply(ufunc: np.ufunc, arguments: tuple[Operand, ...]) -> Operand:
    moving = [isinstance(each, Affine) for each in arguments]
    if not any(moving):
        return ufunc(*arguments)
    if not is_affine(ufunc, moving):
        raise NotAffineError(not_affine(ufunc))
    if ufunc in (np.add, np.subtract):
        left, right = (each if isinstance(each, Affine) else Affine(each, {}) for each in arguments)
        return left.plus(right, 1.0 if ufunc is np.add else -1.0)
    if ufunc is np.negative:
        return arguments[0].times(-1.0)
    if ufunc is np.positive:
        return arguments[0]
    left, right = arguments
    if ufunc is np.divide:
        return left.times(reciprocal(right))
    return left.times(right) if isinstance(left, Affine) else right.times(left)
