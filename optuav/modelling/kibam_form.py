"""Forms of times and of what levels out with them: products of 1, t and (1 − exp(−kt))/k.

What phases of constant current do to the wells of a battery has this form in their durations, each
product with one factor a duration at most. It is found by walking a tree, or by handing `unknown`
to the physics instead of a number; coefficients may be arrays over programmes. The integral
(1 − exp(−kt))/k stands for the decay, as it keeps its digits where k is next to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Literal, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from optuav.modelling.expression import Bounded, Leaf, Operand, Parameter, Relation
from optuav.modelling.traversal import fold

Factor: TypeAlias = tuple[str, Literal["time", "levelling"]]
Monomial: TypeAlias = frozenset[Factor]
"""Factors t and (1 − exp(−kt))/k of different unknowns t."""

CONSTANT: Monomial = frozenset()


class NotExponentialError(ValueError):
    """The expression is no form of times and levellings."""


class Exponential(NDArrayOperatorsMixin):
    """Σ coefficient · monomial, with k by name of an unknown that levels out [1/s].

    It answers to Python's operators and to NumPy's ufuncs; figures are numbers or arrays over
    programmes.
    """

    def __init__(
        self, terms: Mapping[Monomial, Operand], rates_per_s: Mapping[str, Operand] | None = None
    ) -> None:
        self.terms = terms
        self.rates_per_s = rates_per_s or {}

    # What the mixin does by way of ufuncs takes three times as long.
    def __add__(self, other: Operand) -> Exponential:
        return _sum(self, _form(other), 1.0)

    def __sub__(self, other: Operand) -> Exponential:
        return _sum(self, _form(other), -1.0)

    def __rsub__(self, other: Operand) -> Exponential:
        return _sum(_form(other), self, -1.0)

    def __mul__(self, other: Operand) -> Exponential:
        return _product(self, other) if isinstance(other, Exponential) else _times(self, other)

    __radd__, __rmul__ = __add__, __mul__

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Operand, **options: Operand
    ) -> Operand:
        if method != "__call__" or options:
            return NotImplemented
        return _apply(ufunc, inputs)


def unknown(name: str) -> Exponential:
    """The form of an unknown itself."""
    return Exponential({frozenset({(name, "time")}): 1.0})


def applied(ufunc: np.ufunc, operands: tuple[Operand, ...]) -> Operand:
    """A function of forms and numbers."""
    for each in operands:
        if isinstance(each, Exponential):
            return _apply(ufunc, operands)
    return ufunc(*operands)


class Relaxation:
    """What functions of forms become, with bounds in place of `Bounded` functions.

    Those named `at_ceiling` are at their ceilings, the others at their bounds. It collects their
    names, and as limits what must be ≥ 0 for their bounds to be exact.
    """

    def __init__(self, at_ceiling: str = "") -> None:
        self.at_ceiling = at_ceiling
        self.names: dict[str, None] = {}
        self.limits: list[Exponential] = []

    def __call__(self, function: Operand, operands: tuple[Operand, ...]) -> Operand:
        """What a function becomes."""
        if not isinstance(function, Bounded):
            return applied(function, operands)
        bound, ceiling, level, limit, *_ = operands
        self.names[function.name] = None
        self.limits.append(limit - level)
        return ceiling if function.name == self.at_ceiling else bound


def exponential(
    expression: Operand,
    values: Mapping[str, Operand],
    done: dict[int, Operand] | None = None,
    call: Callable[[Operand, tuple[Operand, ...]], Operand] = applied,
) -> Exponential:
    """The form of a tree; values of parameters by name, `done` as of `fold`.

    `call` says what a function of forms becomes.

    Raises
    ------
    NotExponentialError
        If it has none: an unknown multiplies itself, is in a divisor or in another function,
        or levels out at two rates.
    """

    def leaf(node: Leaf) -> Operand:
        if isinstance(node, Parameter):
            return values.get(node.name, node.value)
        return unknown(node.name)

    return _form(fold(expression, leaf, call, done=done))


def side_forms(relations: Iterable[Relation]) -> list[tuple[Exponential, Exponential] | None]:
    """Forms of both sides of each relation, by the values of the parameters; None without one."""
    done = dict[int, Operand]()
    found: list[tuple[Exponential, Exponential] | None] = []
    for relation in relations:
        try:
            left, right = (exponential(side, {}, done) for side in relation.sides)
            found.append((left, right))
        except NotExponentialError:
            found.append(None)
    return found


def _form(operand: Operand) -> Exponential:
    return operand if isinstance(operand, Exponential) else Exponential({CONSTANT: operand})


def _apply(ufunc: np.ufunc, operands: tuple[Operand, ...]) -> Exponential:
    if ufunc in (np.add, np.subtract):
        return _sum(_form(operands[0]), _form(operands[1]), 1.0 if ufunc is np.add else -1.0)
    if ufunc is np.negative:
        return _times(operands[0], -1.0)
    if ufunc is np.positive:
        return _form(operands[0])
    if ufunc is np.multiply:
        left, right = operands
        if isinstance(left, Exponential) and isinstance(right, Exponential):
            return _product(left, right)
        return _times(left, right) if isinstance(left, Exponential) else _times(right, left)
    if ufunc is np.divide and not isinstance(operands[1], Exponential):
        return _times(operands[0], _reciprocal(operands[1]))
    if ufunc is np.expm1:
        return _lost(operands[0])
    if ufunc is np.exp:
        return _sum(Exponential({CONSTANT: 1.0}), _lost(operands[0]), 1.0)
    raise NotExponentialError(f"{ufunc.__name__} of the unknowns is no levelling")


def _reciprocal(divisor: Operand) -> Operand:
    """1/divisor; infinite for 0, as in NumPy, so that an engine can say which constraint has it."""
    try:
        return 1.0 / divisor
    except ZeroDivisionError:
        return math.inf


def _sum(left: Exponential, right: Exponential, factor: float) -> Exponential:
    terms = dict(left.terms)
    for monomial, coefficient in right.terms.items():
        more = coefficient if factor == 1.0 else factor * coefficient
        terms[monomial] = terms[monomial] + more if monomial in terms else more
    return Exponential(terms, _rates(left, right))


def _times(form: Exponential, factor: Operand) -> Exponential:
    return Exponential({each: c * factor for each, c in form.terms.items()}, form.rates_per_s)


def _product(left: Exponential, right: Exponential) -> Exponential:
    terms: dict[Monomial, Operand] = {}
    for one, a in left.terms.items():
        for other, b in right.terms.items():
            if {name for name, _ in one} & {name for name, _ in other}:
                raise NotExponentialError("an unknown multiplies itself")
            both = one | other
            terms[both] = terms[both] + a * b if both in terms else a * b
    return Exponential(terms, _rates(left, right))


def _lost(form: Exponential) -> Exponential:
    """exp(−kt) − 1 for an unknown t."""
    moving = {each: c for each, c in form.terms.items() if each != CONSTANT or np.any(c)}
    if len(moving) != 1:
        raise NotExponentialError("exp of a sum")
    ((monomial, coefficient),) = moving.items()
    ((name, kind), *others) = monomial
    if others or kind != "time":
        raise NotExponentialError("exp of a product of unknowns")
    return Exponential({frozenset({(name, "levelling")}): coefficient}, {name: -coefficient})


def _rates(left: Exponential, right: Exponential) -> Mapping[str, Operand]:
    if not left.rates_per_s or left.rates_per_s is right.rates_per_s:
        return right.rates_per_s
    if not right.rates_per_s:
        return left.rates_per_s
    for name in left.rates_per_s.keys() & right.rates_per_s.keys():
        one, other = left.rates_per_s[name], right.rates_per_s[name]
        if one is not other and not np.array_equal(one, other):
            raise NotExponentialError(f"{name} levels out at two rates")
    return {**left.rates_per_s, **right.rates_per_s}
