"""Forms of expressions: affine ones, and those with exponentials that level out.

What phases of constant current do to the wells of a battery is a sum of 1, their durations t, and
products of (1 − exp(−kt))/k with one factor a duration at most. It is found by walking a tree, or
by handing forms to the physics instead of numbers; coefficients may be arrays over programmes.
The integral (1 − exp(−kt))/k stands for the decay, as it keeps its digits where k is next to
nothing.

Phases may also take shares s of one time t, as hovers over several devices do. Then a factor is
V_s = (1 − exp(−kst))/k, the levelling of a share. A later phase of share r takes it to
V_s exp(−krt) = V_(s+r) − V_r, without a division by k; so there is one factor for each sum of
shares that follow each other.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, SupportsFloat, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from optuav.arrays import Values
from optuav.modelling.expression import (
    Bounded,
    Call,
    Expression,
    Leaf,
    Operand,
    Relation,
    Share,
    Variable,
)
from optuav.modelling.traversal import fold, nodes

Factor: TypeAlias = tuple[str, Literal["time"] | float]
"""A time t, or by its share s, mostly 1.0, the levelling (1 − exp(−kst))/k."""
Monomial: TypeAlias = frozenset[Factor]  # A time, or levellings of shares of different times

CONSTANT: Monomial = frozenset()
CANCELLED = 4e-15  # Share of a coefficient below which its difference to another is rounding


class ShareOfTime(float):
    """The share of a time that a phase takes: a factor of the time, but not of its rate."""


def part(share: Operand, time: Operand) -> Operand:
    """The time that a phase with a share of it takes, in numbers, symbols or forms."""
    return (share if isinstance(share, Expression) else ShareOfTime(share)) * time


class NotExponentialError(ValueError):
    """The expression is not a form of times and levellings."""


class NotAffineError(ValueError):
    """The expression is not affine in the variables; the culprit is sought once it is read."""

    def __init__(self, words: Callable[[], str]) -> None:
        super().__init__(words)
        self._words = words

    def __str__(self) -> str:
        return self._words()


@dataclass(eq=False, repr=False)
class Exponential(NDArrayOperatorsMixin):
    """Σ coefficient · monomial, with k by name of an unknown that levels out [1/s].

    It answers to Python's operators and to NumPy's ufuncs; figures are numbers or arrays over
    programmes.
    """

    terms: Mapping[Monomial, Operand]
    rates_per_s: Values = field(default_factory=dict)
    share: float = 1.0  # A form of one time alone may be of a share of it: its terms count times it
    decays: tuple[str, float] | None = None  # Time and share where it is exp(−kst)

    @property
    def whole(self) -> "Exponential":
        """The same form, of whole times."""
        if self.share == 1.0:
            return self
        return Exponential({e: c * self.share for e, c in self.terms.items()}, self.rates_per_s)

    @property
    def linear(self) -> bool:
        """True if each term is a number times one time at most."""
        for monomial in self.terms:
            for _, kind in monomial:
                if kind != "time" or len(monomial) > 1:
                    return False
        return True

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Operand, **options: Operand
    ) -> Operand:
        return NotImplemented if method != "__call__" or options else applied(ufunc, inputs)


NOWHERE = Exponential({frozenset({("", 1.0)}): math.nan})
"""Placeholder for a tree without a form."""


def applied(ufunc: np.ufunc, operands: tuple[Operand, ...]) -> Operand:
    """A function of forms and numbers.

    A term whose coefficients cancel but for rounding is dropped.
    """
    left, right = operands[0], operands[-1]
    first, last = isinstance(left, Exponential), isinstance(right, Exponential)
    if not (first or last):
        return ufunc(*operands)
    if ufunc is np.negative:
        ufunc, right, last = np.multiply, -1.0, False
    elif ufunc is np.divide and not last:
        zero = isinstance(right, float | int) and right == 0.0
        # Infinite as in NumPy, so that an engine can say which constraint has it.
        ufunc, right = np.multiply, math.inf if zero else 1.0 / right
    if ufunc is np.multiply and not (first and last):
        form, factor = (left, right) if first else (right, left)
        if isinstance(factor, ShareOfTime):
            return Exponential(form.terms, form.rates_per_s, float(factor) * form.share)
        multiplied = {e: c * factor for e, c in form.terms.items()}
        return Exponential(multiplied, form.rates_per_s, form.share)
    left = left if first else Exponential({CONSTANT: left})
    right = right if last else Exponential({CONSTANT: right})
    if ufunc is np.positive:
        return left
    terms: dict[Monomial, Operand] = {}
    if ufunc in (np.exp, np.expm1):  # exp(−kt) = 1 − k (1 − exp(−kt))/k
        moving = {term: c for term, c in left.terms.items() if term != CONSTANT or np.any(c)}
        if len(moving) != 1:
            raise NotExponentialError("exp of a sum")
        ((monomial, coefficient),) = moving.items()
        ((name, kind), *others) = monomial
        if others or kind != "time":
            raise NotExponentialError("exp of a product of unknowns")
        decays = name, left.share
        terms[frozenset[Factor]({decays})] = coefficient
        if ufunc is np.expm1:
            return Exponential(terms, {name: -coefficient})
        return Exponential({CONSTANT: 1.0, **terms}, {name: -coefficient}, decays=decays)
    left, right = left.whole, right.whole
    if ufunc in (np.add, np.subtract):
        terms |= left.terms
        for monomial, coefficient in right.terms.items():
            before = terms.get(monomial)
            if before is not None:
                terms[monomial] = ufunc(before, coefficient)
            else:
                terms[monomial] = coefficient if ufunc is np.add else -coefficient
            if monomial and ufunc is np.subtract and before is not None:
                rest = np.abs(terms[monomial])
                if np.all((rest == 0.0) | (rest < CANCELLED * np.abs(before))):
                    del terms[monomial]
    elif ufunc is np.multiply:
        if right.decays is None and (decay := left.decays) is not None:
            swaps = any(_levelled_alike(monomial, decay) for monomial in right.terms)
            left, right = (right, left) if swaps else (left, right)
        for one, a in left.terms.items():
            if right.decays is not None and (taken := _levelled_alike(one, right.decays)):
                (name, share), (_, passed) = taken, right.decays
                for later, sign in ((share + passed, 1.0), (passed, -1.0)):
                    both = one - {taken} | {(name, later)}
                    terms[both] = terms[both] + sign * a if both in terms else sign * a
                continue
            for other, b in right.terms.items():
                both = one | other
                if one and other:
                    levelling = {name for name, kind in both if kind != "time"}
                    if len(levelling) < len(one) + len(other):
                        raise NotExponentialError("unknowns are multiplied")
                terms[both] = terms[both] + a * b if both in terms else a * b
    else:
        raise NotExponentialError(f"{ufunc.__name__} of the unknowns is not a levelling")
    rates = right.rates_per_s
    if left.rates_per_s and left.rates_per_s is not rates:
        for name in left.rates_per_s.keys() & rates.keys():
            if not same_rate(left.rates_per_s[name], rates[name]):
                raise NotExponentialError(f"{name} levels out at two rates")
        rates = {**left.rates_per_s, **rates}
    return Exponential(terms, rates)


def _levelled_alike(monomial: Monomial, decays: tuple[str, float]) -> tuple[str, float] | None:
    """The levelling in a monomial of the time that decays; None without one."""
    for name, kind in monomial:
        if name == decays[0] and not isinstance(kind, str):
            return name, kind
    return None


def same_rate(one: Operand, other: Operand) -> bool:
    """Return whether two rates are the same number or array."""
    return one is other or np.array_equal(one, other, equal_nan=True)


@dataclass
class Relaxation:
    """Functions of forms, with bounds in place of `Bounded` functions.

    Those named `at_ceiling` are at their ceilings. It collects the others' names, and as limits
    what must be ≥ 0 for their bounds to be exact.
    """

    at_ceiling: str = ""
    names: dict[str, None] = field(default_factory=dict)
    limits: list[Exponential] = field(default_factory=list)

    def __call__(self, function: Operand, operands: tuple[Operand, ...]) -> Operand:
        """Return the form of a function."""
        if not isinstance(function, Bounded):
            return applied(function, operands)
        bound, ceiling, level, limit, *_ = operands
        self.names[function.name] = None
        self.limits.append(limit - level)
        return ceiling if function.name == self.at_ceiling else bound


def form_of_leaf(leaf: Leaf, values: Values) -> Operand:
    """A time, or the value of a parameter."""
    if isinstance(leaf, Variable):
        return Exponential({frozenset({(leaf.name, "time")}): 1.0})
    value = values.get(leaf.name, leaf.value)
    return (
        ShareOfTime(value)
        if isinstance(leaf, Share) and isinstance(value, SupportsFloat)
        else value
    )


def exponential(
    expression: Operand,
    values: Values,
    done: dict[int, Operand] | None = None,
    call: Callable[[Operand, tuple[Operand, ...]], Operand] = applied,
) -> Exponential:
    """The form of a tree; values of parameters by name, `done` as of `fold`.

    `call` gives the form of a function. `NotExponentialError` without a form: a time
    multiplies an unknown, is in a divisor or in another function, or levels out at two rates.
    """
    form = (done or {}).get(id(expression))
    if form is None:
        form = fold(expression, lambda leaf: form_of_leaf(leaf, values), call, done=done)
    return form.whole if isinstance(form, Exponential) else Exponential({CONSTANT: form})


class Affine(NamedTuple):
    """constant + Σ coefficient · variable, each a number or an array over programmes."""

    constant: Operand
    coefficients: Values

    def times(self, factor: Operand) -> "Affine":
        """This form times a number or an array."""
        scaled = {name: coefficient * factor for name, coefficient in self.coefficients.items()}
        return Affine(self.constant * factor, scaled)


def affine(expression: Operand, values: Values, done: dict[int, Operand] | None = None) -> Affine:
    """Affine form of an expression.

    Parameters
    ----------
    expression
        The tree.
    values
        Values of parameters by name; one that is not named keeps its own.
    done
        As of `fold`, for trees that share nodes.

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
    done = {} if done is None else done
    form = done.get(id(expression), expression)
    if isinstance(form, Expression):
        form = NOWHERE
        with suppress(NotExponentialError):
            form = exponential(expression, values, done)
    if not isinstance(form, Exponential):
        return Affine(form, {})
    if not form.linear:
        raise NotAffineError(lambda: not_linear(nodes(expression), done))
    form = form.whole
    coefficients = {name: c for monomial, c in form.terms.items() for name, _ in monomial}
    return Affine(form.terms.get(CONSTANT, 0.0), coefficients)


def not_linear(every: Iterable[Expression], forms: Mapping[int, Operand]) -> str:
    """Name the first function that is not linear, among nodes in the order of evaluation."""
    for node in every:
        form = forms.get(id(node), NOWHERE) if node.moves else None
        if isinstance(node, Call) and isinstance(form, Exponential) and not form.linear:
            return f"{node.ufunc.__name__} of the unknowns is not linear"
    raise AssertionError("all of these functions are linear")


def excess(
    relation: Relation, values: Values, done: dict[int, Operand] | None = None
) -> tuple[Affine, Operand]:
    """Left side less right side as an affine form, and the constant on the right; see `affine`."""
    left, right = (affine(side, values, done) for side in relation.sides)
    coefficients = dict(left.coefficients)
    for name, coefficient in right.coefficients.items():
        coefficients[name] = coefficients.get(name, 0.0) - coefficient
    return Affine(left.constant - right.constant, coefficients), right.constant
