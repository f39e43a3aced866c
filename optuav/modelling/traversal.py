"""Walks over trees of expressions: their folds, values, slopes and leaves."""

from collections.abc import Callable, Iterable, Iterator, Mapping, MutableMapping
from typing import Any, NamedTuple, TypeVar

import numpy as np

from optuav.arrays import Values
from optuav.errors import InputError
from optuav.modelling.expression import Call, Expression, Leaf, Let, Operand, Parameter, Variable

Result = TypeVar("Result")


def fold(
    expression: Operand,
    leaf: Callable[[Leaf], Result],
    call: Callable[[Any, tuple[Any, ...]], Result],
    let: Callable[[Let, Result], Result] | None = None,
    done: dict[int, Result] | None = None,
) -> Any:
    """Fold a tree from the bottom up, every node once; a bare number is returned as it is.

    `leaf`, `call` and `let` fold a variable or parameter, a ufunc on folded arguments and a named
    quantity; by default a named quantity becomes its expression. `done` holds the folds of nodes,
    by identity: hand it to the walks of trees that share nodes, and keep these trees as long.
    """
    done = {} if done is None else done
    get: Callable[[int, Any], Any] = done.get
    is_known = id(expression) in done or not isinstance(expression, Expression)
    for node in () if is_known else nodes(expression, done=done):
        if isinstance(node, Call):
            done[id(node)] = call(node.ufunc, tuple([get(id(e), e) for e in node.arguments]))
        elif isinstance(node, Let):
            inner = get(id(node.expression), node.expression)
            done[id(node)] = inner if let is None else let(node, inner)
        else:
            done[id(node)] = leaf(node)  # type: ignore[arg-type]
    return get(id(expression), expression)


def nodes(
    *expressions: Operand, done: MutableMapping[int, Any] | None = None
) -> Iterator[Expression]:
    """Every node of some trees once, each after its operands, as a reader meets them.

    Nodes that are `done`, by identity, are left out with what lies below them; the others join
    them.
    """
    done = {} if done is None else done
    waiting = [tree for tree in reversed(expressions) if isinstance(tree, Expression)]
    while waiting:  # no recursion: a sum over a thousand phases is a deep tree
        node = waiting[-1]
        if id(node) in done:
            waiting.pop()
            continue
        for operand in reversed(node.below):
            if id(operand) not in done:
                waiting.append(operand)
        if waiting[-1] is node:
            yield node
            done.setdefault(id(node), node)


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
        elif isinstance(node, Expression):
            yield node  # type: ignore[misc]


def leaves(*expressions: Operand) -> list[Leaf]:
    """Variables and parameters of some trees, in order of first appearance, each name once.

    `ValueError` if two different ones have the same name.
    """
    found: dict[str, Leaf] = {}
    for node in nodes(*expressions):
        if isinstance(node, Variable | Parameter) and found.setdefault(node.name, node) is not node:
            raise InputError(f"two symbols are called {node.name!r}; each needs its own name")
    return [*found.values()]


def has_unknowns(*expressions: Operand) -> bool:
    """Return whether some trees hold a variable."""
    return any(isinstance(tree, Expression) and tree.moves for tree in expressions)


def evaluate(
    expression: Operand, values: Values, done: dict[int, Operand] | None = None
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
    return fold(
        expression,
        lambda x: values[x.name] if isinstance(x, Variable) else values.get(x.name, x.value),
        lambda ufunc, arguments: ufunc(*arguments),
        done=done,
    )


Partials = Callable[..., tuple[Operand, ...]]

PARTIALS: Mapping[np.ufunc, Partials] = {
    np.add: lambda value, a, b: (1.0, 1.0),
    np.subtract: lambda value, a, b: (1.0, -1.0),
    np.multiply: lambda value, a, b: (b, a),
    np.divide: lambda value, a, b: (1.0 / b, -value / b),
    np.power: lambda value, a, b: (b * a ** (b - 1.0), value * np.log(a)),
    np.negative: lambda value, a: (-1.0,),
    np.positive: lambda value, a: (1.0,),
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
    np.logaddexp: lambda value, a, b: (np.exp(a - value), np.exp(b - value)),
    np.sin: lambda value, a: (np.cos(a),),
    np.cos: lambda value, a: (-np.sin(a),),
    np.tan: lambda value, a: (1.0 + value * value,),
    np.sinh: lambda value, a: (np.cosh(a),),
    np.cosh: lambda value, a: (np.sinh(a),),
    np.tanh: lambda value, a: (1.0 - value * value,),
    np.arcsin: lambda value, a: (1.0 / np.sqrt(1.0 - a * a),),
    np.arccos: lambda value, a: (-1.0 / np.sqrt(1.0 - a * a),),
    np.arctan: lambda value, a: (1.0 / (1.0 + a * a),),
    np.arctan2: lambda value, a, b: (b / (a * a + b * b), -a / (a * a + b * b)),
    np.arcsinh: lambda value, a: (1.0 / np.sqrt(a * a + 1.0),),
    np.arccosh: lambda value, a: (1.0 / np.sqrt(a * a - 1.0),),
    np.arctanh: lambda value, a: (1.0 / (1.0 - a * a),),
    np.hypot: lambda value, a, b: (a / value, b / value),
    **dict.fromkeys((np.deg2rad, np.radians), lambda value, a: (np.pi / 180.0,)),
    **dict.fromkeys((np.rad2deg, np.degrees), lambda value, a: (180.0 / np.pi,)),
}
"""Partial derivatives of smooth functions by argument, from the value and the arguments."""

KINKED: Mapping[np.ufunc, Partials] = {
    **dict.fromkeys((np.absolute, np.fabs), lambda value, a: (np.sign(a),)),
    **dict.fromkeys((np.floor, np.ceil, np.trunc, np.sign), lambda value, a: (0.0,)),
    np.heaviside: lambda value, a, b: (0.0, np.where(a == 0.0, 1.0, 0.0)),
    **dict.fromkeys((np.maximum, np.fmax), lambda value, a, b: (1.0 * (a >= b), 1.0 * (a < b))),
    **dict.fromkeys((np.minimum, np.fmin), lambda value, a, b: (1.0 * (a <= b), 1.0 * (a > b))),
}
"""The same of functions with steps and kinks, beside these."""

SMALL = 1e-3  # Exponent below which a series keeps more digits than the rule of quotients
SHARE = 1e-3  # Share of an unknown that is no time, beside a second of one that is


class Slope(NamedTuple):
    """Value of an expression and its derivatives by the names of its leaves."""

    value: Operand
    by: Values
    of: tuple[np.ufunc, tuple[Operand, ...]] | None = None  # A function and its operands


@np.errstate(divide="ignore", invalid="ignore")  # the exponent of most powers is a number
def slope(expression: Operand, values: Values, done: dict[int, Operand] | None = None) -> Slope:
    """Value of an expression and its derivatives by every leaf in it (forward differentiation).

    Values as in `evaluate`, `done` as in `fold`. `NotImplementedError` without a derivative.
    """

    def leaf(node: Leaf) -> Slope:
        is_parameter = isinstance(node, Parameter) and node.name not in values
        return Slope(node.value if is_parameter else values[node.name], {node.name: 1.0})  # type: ignore[union-attr]

    def call(ufunc: np.ufunc, arguments: tuple[Operand, ...]) -> Slope:
        partials = PARTIALS.get(ufunc) or KINKED.get(ufunc)
        if partials is None:
            raise NotImplementedError(f"{ufunc.__name__} has no derivative here")
        numbers = [
            argument.value if isinstance(argument, Slope) else argument for argument in arguments
        ]
        value, by = ufunc(*numbers), dict[str, Operand]()
        pair, rates = _levelling(ufunc, arguments) or (arguments, partials(value, *numbers))
        for argument, partial in zip(pair, rates, strict=True):
            for name, inner in argument.by.items() if isinstance(argument, Slope) else ():
                by[name] = by.get(name, 0.0) + partial * inner
        return Slope(value, by, (ufunc, arguments))

    result = fold(expression, leaf, call, done=done)
    return result if isinstance(result, Slope) else Slope(result, {})


def change_by_step(goal: Operand, unknowns: Iterable[Variable], values: Values) -> Operand:
    """Change of a goal by a second of a time, or by a thousandth of another unknown; the largest.

    Tolerances of a goal are shares of it, so that no answer depends on the goal's unit. 0 where no
    unknown moves the goal, or its slope is not known; values as in `slope`.
    """
    if isinstance(goal, Variable) and goal.unit == "s":
        return 1.0  # At once, as most goals are times
    try:
        by = slope(goal, values).by
    except NotImplementedError:
        return 0.0
    largest: Operand = 0.0
    for unknown in (variable for variable in unknowns if variable.name in by):
        step = 1.0 if unknown.unit == "s" else SHARE * np.abs(values[unknown.name])
        change = np.abs(by[unknown.name]) * step
        largest = np.maximum(largest, np.where(np.isfinite(change), change, 0.0))
    return largest


def _levelling(
    ufunc: np.ufunc, arguments: tuple[Operand, ...]
) -> tuple[tuple[Operand, Operand], tuple[Operand, Operand]] | None:
    """k and t of (1 − exp(−kt))/k, and its derivatives by them; None of another function."""
    match ufunc, arguments:
        case np.divide, (Slope(of=(np.negative, (Slope(of=(np.expm1, (x,))),))), Slope() as k):
            match x:
                case Slope(of=(np.multiply, (Slope(of=(np.negative, (same,))), t))) if same is k:
                    t_s = t.value if isinstance(t, Slope) else t
                    low, high = np.minimum(-x.value, SMALL), np.maximum(-x.value, SMALL)
                    series = 0.5 - low / 3.0 + low**2 / 8.0 - low**3 / 30.0
                    share = (1.0 - (1.0 + high) * np.exp(-high)) / high**2
                    share = np.where(high > SMALL, share, series)[()]
                    return (k, t), (-share * t_s**2, np.exp(x.value))
    return None
