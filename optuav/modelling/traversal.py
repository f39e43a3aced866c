"""Walks over trees of expressions: what becomes of them, their values, and what they speak of."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from optuav.modelling.expression import (
    Call,
    Expression,
    Leaf,
    Let,
    Operand,
    Parameter,
    Variable,
)

Result = TypeVar("Result")
LEAVES = (Variable, Parameter)


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
            return call(node.ufunc, tuple([done[id(each)] for each in node.arguments]))
        if isinstance(node, Let):
            inner = done[id(node.expression)]
            return inner if let is None else let(node, inner)
        return leaf(node) if isinstance(node, LEAVES) else node

    for node in _order(expression) if not done else _upwards([expression], done):
        done[id(node)] = value(node)
    return done[id(expression)]


def _order(expression: Operand) -> list[Operand]:
    """Nodes of a tree, each after its operands; found once, as a tree never changes."""
    if not isinstance(expression, Expression):
        return [expression]
    if expression.order is None:
        expression.order = _upwards([expression], {})
    return expression.order


def nodes(*expressions: Operand) -> list[Operand]:
    """Every node of some trees once, each after its operands."""
    return _upwards(expressions, {})


def _upwards(expressions: Sequence[Operand], done: Mapping[int, Any]) -> list[Operand]:
    """Nodes of trees that are not done, each after its operands."""
    found: list[Operand] = []
    seen: set[int] = set()
    opened: set[int] = set()
    waiting = [*reversed(expressions)]
    while waiting:  # no recursion: a sum over a thousand phases is a deep tree
        node = waiting.pop()
        key = id(node)
        if key in seen or key in done:
            continue
        below = () if key in opened else _operands(node)
        if below:  # it is met again once these are found
            opened.add(key)
            waiting.append(node)
            waiting += reversed(below)
        else:
            seen.add(key)
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


def has_unknowns(*expressions: Operand) -> bool:
    """Whether some trees hold a variable."""
    return any(isinstance(leaf, Variable) for leaf in leaves(*expressions))
