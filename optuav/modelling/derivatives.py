"""Exact derivatives of expressions with respect to their variables and parameters.

Every node carries its value and its derivatives by leaf (forward differentiation), so one walk
serves numbers and arrays alike.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from optuav.modelling.expression import Leaf, Operand, Parameter
from optuav.modelling.traversal import fold


@dataclass(frozen=True)
class Slope:
    """Value of an expression and its derivatives by the names of its leaves."""

    value: Operand
    by: Mapping[str, Operand]


Partials = Callable[..., tuple[Operand, ...]]

PARTIALS: Mapping[np.ufunc, Partials] = {
    np.add: lambda value, a, b: (1.0, 1.0),
    np.subtract: lambda value, a, b: (1.0, -1.0),
    np.multiply: lambda value, a, b: (b, a),
    np.divide: lambda value, a, b: (1.0 / b, -value / b),
    np.negative: lambda value, a: (-1.0,),
    np.positive: lambda value, a: (1.0,),
    np.absolute: lambda value, a: (np.sign(a),),
    np.fabs: lambda value, a: (np.sign(a),),
    np.floor: lambda value, a: (0.0,),
    np.ceil: lambda value, a: (0.0,),
    np.trunc: lambda value, a: (0.0,),
    np.sign: lambda value, a: (0.0,),
    np.heaviside: lambda value, a, b: (0.0, np.where(a == 0.0, 1.0, 0.0)),
    np.square: lambda value, a: (2.0 * a,),
    np.reciprocal: lambda value, a: (-value * value,),
    np.sqrt: lambda value, a: (0.5 / value,),
    np.cbrt: lambda value, a: (1.0 / (3.0 * value * value),),
    np.exp: lambda value, a: (value,),
    np.exp2: lambda value, a: (np.log(2.0) * value,),
    np.expm1: lambda value, a: (value + 1.0,),
    np.log: lambda value, a: (1.0 / a,),
    np.log1p: lambda value, a: (1.0 / (1.0 + a),),
    np.log2: lambda value, a: (1.0 / (np.log(2.0) * a),),
    np.log10: lambda value, a: (1.0 / (np.log(10.0) * a),),
    np.sin: lambda value, a: (np.cos(a),),
    np.cos: lambda value, a: (-np.sin(a),),
    np.tan: lambda value, a: (1.0 + value * value,),
    np.sinh: lambda value, a: (np.cosh(a),),
    np.cosh: lambda value, a: (np.sinh(a),),
    np.tanh: lambda value, a: (1.0 - value * value,),
    np.arcsin: lambda value, a: (1.0 / np.sqrt(1.0 - a * a),),
    np.arccos: lambda value, a: (-1.0 / np.sqrt(1.0 - a * a),),
    np.arctan: lambda value, a: (1.0 / (1.0 + a * a),),
    np.arcsinh: lambda value, a: (1.0 / np.sqrt(a * a + 1.0),),
    np.arccosh: lambda value, a: (1.0 / np.sqrt(a * a - 1.0),),
    np.arctanh: lambda value, a: (1.0 / (1.0 - a * a),),
    np.deg2rad: lambda value, a: (np.pi / 180.0,),
    np.radians: lambda value, a: (np.pi / 180.0,),
    np.rad2deg: lambda value, a: (180.0 / np.pi,),
    np.degrees: lambda value, a: (180.0 / np.pi,),
    np.logaddexp: lambda value, a, b: (np.exp(a - value), np.exp(b - value)),
    np.hypot: lambda value, a, b: (a / value, b / value),
    np.arctan2: lambda value, a, b: (b / (a * a + b * b), -a / (a * a + b * b)),
    np.maximum: lambda value, a, b: (np.where(a >= b, 1.0, 0.0), np.where(a >= b, 0.0, 1.0)),
    np.fmax: lambda value, a, b: (np.where(a >= b, 1.0, 0.0), np.where(a >= b, 0.0, 1.0)),
    np.minimum: lambda value, a, b: (np.where(a <= b, 1.0, 0.0), np.where(a <= b, 0.0, 1.0)),
    np.fmin: lambda value, a, b: (np.where(a <= b, 1.0, 0.0), np.where(a <= b, 0.0, 1.0)),
}
"""Partial derivatives by argument, from the value and the arguments; see `_power_partials`, too."""

DIFFERENTIABLE = PARTIALS.keys() | {np.power}
"""Functions with a derivative here, at least almost everywhere."""

SMOOTH = DIFFERENTIABLE - {
    np.absolute, np.fabs, np.sign, np.heaviside, np.floor, np.ceil, np.trunc,
    np.maximum, np.fmax, np.minimum, np.fmin,
}  # fmt: skip
"""Those of them without steps and kinks."""


def slope(
    expression: Operand, values: Mapping[str, Operand], done: dict[int, Operand] | None = None
) -> Slope:
    """Value of an expression and its derivatives with respect to every leaf in it.

    Values of the variables by name, and of parameters that differ from their own: numbers or arrays
    that broadcast; `done` as of `fold`.

    Raises
    ------
    NotImplementedError
        If the tree holds a function without a derivative here.
    """

    def leaf(node: Leaf) -> Slope:
        own = isinstance(node, Parameter) and node.name not in values
        return Slope(node.value if own else values[node.name], {node.name: 1.0})  # type: ignore[union-attr]

    found = fold(expression, leaf, _apply, done=done)
    return found if isinstance(found, Slope) else Slope(found, {})


def _apply(ufunc: np.ufunc, arguments: tuple[Operand, ...]) -> Operand:
    numbers = tuple(each.value if isinstance(each, Slope) else each for each in arguments)
    value = ufunc(*numbers)
    if ufunc is np.power:
        partials = _power_partials(value, numbers, arguments)
    elif ufunc in PARTIALS:
        partials = PARTIALS[ufunc](value, *numbers)
    else:
        raise NotImplementedError(f"{ufunc.__name__} has no derivative here")
    by: dict[str, Operand] = {}
    for argument, partial in zip(arguments, partials, strict=True):
        if isinstance(argument, Slope):
            for name, derivative in argument.by.items():
                term = partial * derivative
                by[name] = by[name] + term if name in by else term
    return Slope(value, by)


def _power_partials(
    value: Operand, numbers: tuple[Operand, ...], arguments: tuple[Operand, ...]
) -> tuple[Operand, Operand]:
    base, exponent = numbers
    by_base = exponent * base ** (exponent - 1.0)
    varies = isinstance(arguments[1], Slope)
    return by_base, value * np.log(base) if varies else 0.0
