"""Expressions: small trees of NumPy ufuncs over variables and parameters.

``+``, ``>=`` and ``np.exp`` on a symbol build the tree, so functions written for floats and arrays
take symbols unchanged. With other leaves the same tree becomes numbers, another library's symbols,
or text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from optuav.errors import InputError

Sense = Literal["<=", ">=", "=="]
Operand: TypeAlias = Any  # An `Expression`, a number or an array of numbers

SENSES: Mapping[np.ufunc, Sense] = {np.less_equal: "<=", np.greater_equal: ">=", np.equal: "=="}
REFUSED: Mapping[np.ufunc, str] = {
    **dict.fromkeys((np.less, np.greater), "strict ones are not closed"),
    np.not_equal: "!= leaves out points only",
}
INDEX = "j"  # Running index of lines that differ only in a number

DIVISIONS = frozenset((np.divide, np.floor_divide, np.remainder, np.fmod))


class Indexed(str):
    """A symbol with a number, like Δ_3: a page writes lines that differ only in it as one.

    Its pattern has `INDEX` in place of the number.
    """

    pattern: str
    number: int

    def __new__(cls, symbol: str, number: int) -> Indexed:
        """The symbol with its number."""
        start = f"{symbol}{',' if '_' in symbol else '_'}"
        symbol_with_number = super().__new__(cls, f"{start}{number}")
        symbol_with_number.pattern, symbol_with_number.number = f"{start}{INDEX}", number
        return symbol_with_number

    def __reduce__(self) -> tuple[type[Indexed], tuple[str, int]]:
        """Copies and pickles are made from symbol and number."""
        return Indexed, (self.pattern[: -len(f"_{INDEX}")], self.number)


class PartedLabel(str):
    """A name made of parts: lines that differ only in a number are named by shared parts."""

    parts: tuple[object, ...]

    def __new__(cls, *parts: object) -> PartedLabel:
        """Join the parts with blanks; a part that has parts itself adds its own."""
        all_parts: tuple[object, ...] = sum((getattr(part, "parts", (part,)) for part in parts), ())
        label = super().__new__(cls, " ".join(map(str, all_parts)))
        label.parts = all_parts
        return label

    def __reduce__(self) -> tuple[type[PartedLabel], tuple[object, ...]]:
        """Copies and pickles are made from the parts."""
        return PartedLabel, self.parts


class Expression(NDArrayOperatorsMixin):
    """A node of the tree; it answers to Python's operators and to NumPy's ufuncs."""

    __hash__ = object.__hash__
    below: tuple[Expression, ...] = ()
    """The expressions among its operands."""
    moves = False
    """True if it holds a variable."""

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Operand, **options: Operand
    ) -> Operand:
        rebinds = options.pop("out", (self,))[0] is self  # x += y calls the sum x from there on
        if method != "__call__" or options or ufunc.nout > 1 or not rebinds:
            return NotImplemented
        if ufunc in REFUSED:
            raise TypeError(f"a constraint needs <=, >= or ==; {REFUSED[ufunc]}")
        operands = tuple([_operand(self, ufunc, operand) for operand in inputs])
        if ufunc in SENSES:
            return Relation(operands[0], SENSES[ufunc], operands[1])
        divisor = operands[1] if ufunc in DIVISIONS else 1.0
        if not isinstance(divisor, Expression) and np.ndim(divisor) == 0 and divisor == 0.0:
            raise InputError(f"{_called(operands[0])} is divided by 0 ({ufunc.__name__})")
        return Call(ufunc, operands)

    def __bool__(self) -> bool:
        raise TypeError("an expression has no truth value until its variables have numbers")


def _operand(met: Expression, ufunc: np.ufunc, operand: Operand) -> Operand:
    """An operand as a tree holds it; numbers are refused if they are not real."""
    if isinstance(operand, (Expression, float, int)):
        return operand
    numbers = np.asarray(operand)
    if numbers.dtype.kind not in "biuf" or not numbers.size:
        words = "operands are expressions, real numbers and arrays of them"
        raise TypeError(f"{_called(met)}: {ufunc.__name__} takes no {operand!r:.60}; {words}")
    return numbers if isinstance(operand, list | tuple) else operand


def _called(operand: Operand) -> str:
    symbol = getattr(operand, "symbol", "")
    return symbol or ("an expression" if isinstance(operand, Expression) else str(operand))


@dataclass(eq=False, repr=False)
class Call(Expression):
    """A ufunc, or a function in the place of one, applied to operands."""

    ufunc: np.ufunc | Callable[..., Operand]
    arguments: tuple[Operand, ...]

    def __post_init__(self) -> None:
        self.below = tuple(
            [argument for argument in self.arguments if isinstance(argument, Expression)]
        )
        self.moves = any(operand.moves for operand in self.below)


@dataclass(eq=False, repr=False)
class Variable(Expression):
    """An unknown of a model, which `Model.variable` declares.

    Parameters
    ----------
    name, symbol, unit
        Key of its value, how the mathematics writes it, and its unit, ``"1"`` for a ratio.
    lower, upper, label, kind, labelled
        Bounds: numbers, arrays or expressions of parameters; their name among the constraints, what
        they limit, as the kind of a constraint, and whether a page shows that name.
    first_slot, binary
        Where counting starts when it is taken in whole slots; whether it is 0 or 1.
    declared_at
        Source file and line of the declaration.

    Examples
    --------
    >>> from optuav.modelling import Model
    >>> hover = Model("longest hover").variable("hover_time_s", "Δ", unit="s", upper=600.0)
    >>> hover.symbol, hover.lower, hover.upper
    ('Δ', 0.0, 600.0)
    """

    name: str
    symbol: str
    unit: str
    lower: Operand
    upper: Operand
    label: str
    first_slot: int
    binary: bool = False
    declared_at: str = ""
    kind: str = ""
    labelled: bool = True
    moves = True


@dataclass(eq=False, repr=False)
class Parameter(Expression):
    """A named number that a solve may change.

    Parameters
    ----------
    name, symbol, unit
        Key of its value, how the mathematics writes it, and its unit, ``"1"`` for a ratio.
    value
        A number, or an array with one entry a programme.
    key
        The mission's key that it comes from, empty if it is derived.
    varies
        Whether a page lists it and a solve may change it by name; else it is one of many numbers
        that differ between programmes, such as the duration of a stage.

    Examples
    --------
    >>> import optuav
    >>> optuav.Parameter("capacity_As", "B", "A s", 36000.0, key="battery.capacity_As").value
    36000.0
    """

    name: str
    symbol: str
    unit: str
    value: Operand
    key: str = ""
    varies: bool = True


class Share(Parameter):
    """The share of a time that a phase takes, as the hover over one of several devices."""


@dataclass(eq=False, repr=False)
class Let(Expression):
    """A named intermediate quantity.

    Parameters
    ----------
    name, symbol, unit
        As a reader calls it, as the mathematics writes it, and ``"s"`` or ``"1"`` for a ratio.
    expression, words
        Its expression, and the words printed instead where that would fill a page.
    """

    name: str
    symbol: str
    unit: str
    expression: Operand
    words: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.expression, Expression):
            self.below, self.moves = (self.expression,), self.expression.moves


Leaf: TypeAlias = Variable | Parameter


@dataclass(frozen=True)
class Relation:
    """Two sides and how they compare; a statement, not a truth value."""

    left: Operand
    sense: Sense
    right: Operand

    @property
    def sides(self) -> tuple[Operand, Operand]:
        """Left and right."""
        return self.left, self.right

    @property
    def signs(self) -> tuple[float, ...]:
        """The numbers that, times left − right, give what must be at most 0."""
        return {"<=": (1.0,), ">=": (-1.0,), "==": (1.0, -1.0)}[self.sense]

    def __bool__(self) -> bool:
        raise TypeError("a relation has no truth value; hand it to Model.subject_to")


@dataclass(frozen=True)
class Bounded:
    """A function in the place of a ufunc, with bounds that engines can take instead.

    Its arguments are a bound, a constant ceiling, a level, a limit, and what `value` takes. It is
    never more than the bound or the ceiling, and equal to the bound wherever the level does not
    exceed the limit.
    """

    name: str  # For messages
    value: Callable[..., Operand]  # From the arguments behind the first four, in numbers or arrays

    @property
    def __name__(self) -> str:
        return self.name

    def __call__(
        self, bound: Operand, ceiling: Operand, level: Operand, limit: Operand, *arguments: Operand
    ) -> Operand:
        """The value."""
        return self.value(*arguments)
