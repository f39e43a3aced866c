"""Expressions with other operands in place of their leaves, without idle zeros and ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from optuav.modelling.expression import Operand
from optuav.modelling.walk import fold


def is_number(operand: Operand, number: float) -> bool:
    """Whether an operand is this plain number."""
    return isinstance(operand, int | float) and operand == number


def substituted(expression: Operand, instead: Mapping[str, Operand]) -> Operand:
    """An expression with other operands in place of its leaves, by name."""
    return fold(expression, lambda node: instead[node.name], applied)


def applied(ufunc: np.ufunc, arguments: tuple[Operand, ...]) -> Operand:
    """A ufunc on operands, but nothing is added to 0 or multiplied by 0 or 1."""
    if ufunc in (np.add, np.subtract, np.multiply, np.divide):
        first, second = arguments
        if ufunc in (np.add, np.subtract) and is_number(second, 0.0):
            return first
        if ufunc in (np.add, np.subtract) and is_number(first, 0.0):
            return second if ufunc is np.add else -second
        if ufunc in (np.multiply, np.divide) and (is_number(first, 0.0) or is_number(second, 1.0)):
            return first
        if ufunc is np.multiply and (is_number(second, 0.0) or is_number(first, 1.0)):
            return second
    return ufunc(*arguments)
