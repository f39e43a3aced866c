"""Walks over trees of expressions: what they become, their values, and their variables."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping
from operator import attrgetter
from typing import Any, TypeVar

from optuav.modelling.expression import Call, Expression, Leaf, Let, Operand, Parameter, Variable

Result = TypeVar("Result")


def fold(
    expression: Operand,
    leaf: Callable[[Leaf], Result],
    call: Callable[[Any, tuple[Any, ...]], Result],
    let: Callable[[Let, Result], Result] | None = None,
    done: dict[int, Result] | None = None,
) -> Any:
    """What a tree becomes, from the bottom up, every node once; a bare number is returned as it is.

    `leaf` and `call` say what a variable or parameter, and what a ufunc on folded arguments,
    becomes (numbers among the arguments stay as they are), and `let` what a named quantity does: by
    default what it stands for. `done` holds what nodes became, by identity: hand the same one to
    the walks of trees that share nodes, and keep these trees as long.
    """
    if not isinstance(expression, Expression):
        return expression
    done = {} if done is None else done
    get: Callable[[int, Any], Any] = done.get
    for node in _order(expression) if not done else _missing(expression, done):
        if isinstance(node, Call):
            operands = [get(id(each), each) for each in node.arguments]
            done[id(node)] = call(node.ufunc, tuple(operands))
        elif isinstance(node, Let):
            inner = get(id(node.expression), node.expression)
            done[id(node)] = inner if let is None else let(node, inner)
        else:
            done[id(node)] = leaf(node)
    return done[id(expression)]


def nodes(*expressions: Operand) -> list[Expression]:
    """Every node of some trees once, each after its operands, as a reader meets them."""
    found: list[Expression] = []
    seen: set[int] = set()
    waiting = [each for each in reversed(expressions) if isinstance(each, Expression)]
    while waiting:  # no recursion: a sum over a thousand phases is a deep tree
        node = waiting[-1]
        below = [each for each in node.below if id(each) not in seen]
        if below:
            waiting += reversed(below)
            continue
        waiting.pop()
        if id(node) not in seen:
            seen.add(id(node))
            found.append(node)
    return found


def outermost(*expressions: Operand) -> Iterator[Leaf | Let]:
    """Symbols in some expressions, without those that named quantities are made of."""
    waiting, seen = [*expressions], set[int]()
    while waiting:
        node = waiting.pop()
        if id(node) in seen:
            continue
        seen.add(id(node))
        if isinstance(node, Call):
            waiting += node.below
        elif isinstance(node, Variable | Parameter | Let):
            yield node


def _order(expression: Expression) -> list[Any]:
    """Nodes of a tree, each after its operands; listed once, as a tree never changes."""
    if expression.order is None:
        expression.order = _missing(expression, ())
    return expression.order


def _missing(expression: Expression, done: Container[int]) -> list[Any]:
    """Nodes of a tree that are not done, each after its operands."""
    if id(expression) in done:
        return []
    found = [expression]
    seen = {id(expression)}
    for node in found:  # which grows meanwhile
        for each in node.below:
            if id(each) not in seen and id(each) not in done:
                seen.add(id(each))
                found.append(each)
    found.sort(key=_height)
    return found


_height = attrgetter("height")


def evaluate(
    expression: Operand, values: Mapping[str, Operand], done: dict[int, Operand] | None = None
) -> Operand:
    """Value of an expression with numbers or arrays in place of its variables and parameters.

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

    Examples
    --------
    >>> import numpy as np
    >>> from optuav.modelling import Model, Parameter, evaluate
    >>> x = Model("an example").variable("x", "x", unit="s")
    >>> decay = np.exp(-Parameter("rate_per_s", "k", "1/s", 0.5) * x)
    >>> evaluate(decay, {"x": np.array([0.0, 2.0])}).round(4)
    array([1.    , 0.3679])
    """

    def leaf(node: Leaf) -> Operand:
        if isinstance(node, Parameter) and node.name not in values:
            return node.value
        return values[node.name]

    return fold(expression, leaf, lambda ufunc, arguments: ufunc(*arguments), done=done)


def leaves(*expressions: Operand) -> Iterator[Leaf]:
    """Variables and parameters of some trees, in order of first appearance, each name once.

    Raises
    ------
    ValueError
        If two different ones have the same name.
    """
    found: dict[str, Leaf] = {}
    for node in nodes(*expressions):
        if isinstance(node, Variable | Parameter) and found.setdefault(node.name, node) is not node:
            raise ValueError(f"two different symbols are called {node.name!r}")
    yield from found.values()


def has_unknowns(*expressions: Operand) -> bool:
    """Whether some trees hold a variable."""
    return any(isinstance(node, Variable) for node in nodes(*expressions))
