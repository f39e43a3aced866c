"""Expressions: small trees of NumPy ufuncs over variables and parameters.

``+``, ``>=`` and ``np.exp`` on a symbol build the tree, so functions written for floats and arrays
take symbols unchanged. Walked again with other leaves, the same tree becomes numbers, another
library's symbols, or text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

Sense = Literal["<=", ">=", "=="]
Operand: TypeAlias = Any
"""An `Expression`, a number or an array of numbers."""

SENSES: Mapping[np.ufunc, Sense] = {
    np.less_equal: "<=",
    np.greater_equal: ">=",
    np.equal: "==",
}


class Expression(NDArrayOperatorsMixin):
    """A node of the tree; it answers to Python's operators and to NumPy's ufuncs."""

    __hash__ = object.__hash__
    order: list[Operand] | None = None

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Operand, **options: Any
    ) -> Any:
        rebinds = options.pop("out", (self,))[0] is self  # x += y calls the sum x from there on
        if method != "__call__" or options or ufunc.nout > 1 or not rebinds:
            return NotImplemented
        if ufunc in SENSES:
            return Relation(inputs[0], SENSES[ufunc], inputs[1])
        if ufunc in (np.less, np.greater, np.not_equal):
            raise TypeError("a constraint is stated with <=, >= or ==; strict ones are not closed")
        return Call(ufunc, inputs)

    def __bool__(self) -> bool:
        raise TypeError("an expression has no truth value until its variables have numbers")


class Call(Expression):
    """A ufunc, or a function that stands in for one, applied to operands."""

    def __init__(
        self, ufunc: np.ufunc | Callable[..., Any], arguments: tuple[Operand, ...]
    ) -> None:
        self.ufunc = ufunc
        self.arguments = arguments


class Variable(Expression):
    """An unknown of a model.

    Parameters
    ----------
    name
        Key of its value in points and solutions, with its unit as suffix.
    symbol
        As the mathematics writes it.
    unit
        For example ``"s"``; ``"1"`` for a ratio.
    lower, upper
        Bounds: numbers, arrays or expressions of parameters.
    label
        Name of the bounds among the constraints.
    first_slot
        Where counting starts when the variable is taken in whole slots.
    binary
        Whether it is 0 or 1.
    declared_at
        Source file and line of the declaration.
    """

    def __init__(
        self,
        name: str,
        symbol: str,
        unit: str,
        lower: Operand,
        upper: Operand,
        label: str,
        first_slot: int,
        binary: bool = False,
        declared_at: str = "",
    ) -> None:
        self.name = name
        self.symbol = symbol
        self.unit = unit
        self.lower = lower
        self.upper = upper
        self.label = label
        self.first_slot = first_slot
        self.binary = binary
        self.declared_at = declared_at


class Parameter(Expression):
    """A named number that a solve may change.

    Parameters
    ----------
    name
        Key of its value, with its unit as suffix.
    symbol, unit
        As the mathematics writes it, and its unit.
    value
        A number, or an array with one entry a programme.
    key
        The mission's key it comes from, ``""`` if it is derived.
    varies
        Whether it is to be told to a reader and changed by name; else it is one of many numbers,
        such as the duration of a stage, that differ between programmes.
    """

    def __init__(
        self,
        name: str,
        symbol: str,
        unit: str,
        value: Any,
        key: str = "",
        varies: bool = True,
    ) -> None:
        self.varies = varies
        self.name = name
        self.symbol = symbol
        self.unit = unit
        self.value = value
        self.key = key


class Let(Expression):
    """A named intermediate quantity.

    Parameters
    ----------
    name, symbol, unit
        As a reader calls it and as the mathematics writes it.
    expression
        What it stands for.
    words
        What is printed instead of an expression that would fill a page.
    trends
        What is known of how it goes with the unknowns.
    """

    def __init__(
        self,
        name: str,
        symbol: str,
        unit: str,
        expression: Operand,
        words: str = "",
        trends: Sequence[Trend] = (),
    ) -> None:
        self.words = words
        self.trends = trends
        self.name = name
        self.symbol = symbol
        self.unit = unit
        self.expression = expression


Leaf: TypeAlias = Variable | Parameter
Result = TypeVar("Result")


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

    def __bool__(self) -> bool:
        raise TypeError("a relation has no truth value; hand it to Model.subject_to")


class Trend(NamedTuple):
    """What a quantity is known to do wherever some relations of parameters hold.

    Parameters
    ----------
    falls_with, rises_with
        Names of unknowns with which it never rises, and never falls, the others held.
    where
        The relations.
    """

    falls_with: tuple[str, ...]
    rises_with: tuple[str, ...]
    where: tuple[Relation, ...]


def fold(
    expression: Operand,
    leaf: Callable[[Leaf], Result],
    call: Callable[[Any, tuple[Any, ...]], Result],
    let: Callable[[Let, Result], Result] | None = None,
    done: dict[int, Any] | None = None,
) -> Any:
    """Walk a tree bottom-up, every node once.

    Parameters
    ----------
    expression
        The tree; a bare number or array is returned as it is.
    leaf, call
        What a variable or parameter, and what a ufunc on folded arguments, becomes.
    let
        What a named quantity becomes; by default what it stands for.
    done
        What nodes became, by identity: hand the same one to the walks of trees that share nodes.
    """
    done = {} if done is None else done

    def value(node: Operand) -> Any:
        if isinstance(node, Call):
            return call(node.ufunc, tuple(done[id(each)] for each in node.arguments))
        if isinstance(node, Let):
            inner = done[id(node.expression)]
            return inner if let is None else let(node, inner)
        if isinstance(node, Variable | Parameter):
            return leaf(node)
        return node

    for node in _order(expression) if not done else _upwards(expression, done):
        done[id(node)] = value(node)
    return done[id(expression)]


def _order(expression: Operand) -> list[Operand]:
    """Nodes of a tree, each after its operands; found once, as a tree never changes."""
    if not isinstance(expression, Expression):
        return [expression]
    if expression.order is None:
        expression.order = _upwards(expression, {})
    return expression.order


def _upwards(expression: Operand, done: Mapping[int, Any]) -> list[Operand]:
    """Nodes of a tree that are not done, each after its operands."""
    found: list[Operand] = []
    seen: set[int] = set()
    waiting = [expression]
    while waiting:  # no recursion: a sum over a thousand phases is a deep tree
        node = waiting[-1]
        known = id(node) in seen or id(node) in done
        below = (
            [] if known else [n for n in _operands(node) if id(n) not in seen and id(n) not in done]
        )
        if below:
            waiting += reversed(below)
        else:
            waiting.pop()
            if not known:
                seen.add(id(node))
                found.append(node)
    return found


def _operands(node: Operand) -> tuple[Operand, ...]:
    if isinstance(node, Call):
        return node.arguments
    return (node.expression,) if isinstance(node, Let) else ()


def evaluate(
    expression: Operand, values: Mapping[str, Any], done: dict[int, Any] | None = None
) -> Any:
    """Value of an expression with numbers or arrays in place of its leaves.

    Parameters
    ----------
    expression
        The tree.
    values
        By name; a parameter that is not named keeps its own value.
    done
        As of `fold`, for trees that share nodes.

    Raises
    ------
    KeyError
        If a variable has no value.
    """

    def leaf(node: Leaf) -> Any:
        if isinstance(node, Parameter) and node.name not in values:
            return node.value
        return values[node.name]

    return fold(expression, leaf, lambda ufunc, arguments: ufunc(*arguments), done=done)


def leaves(*expressions: Operand) -> Iterator[Leaf]:
    """Variables and parameters of some trees, in order of first appearance, each name once."""
    found: dict[str, Leaf] = {}

    def leaf(node: Leaf) -> None:
        known = found.setdefault(node.name, node)
        if known is not node:
            raise ValueError(f"two different symbols are called {node.name!r}")

    done: dict[int, Any] = {}
    for expression in expressions:
        fold(expression, leaf, lambda ufunc, arguments: None, done=done)
    yield from found.values()
