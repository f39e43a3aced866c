"""The longest part of a time: a function that trees may hold where they hold ufuncs.

In numbers it is evaluated. An engine that needs derivatives takes its share of the time as one
more unknown, with the constraints that such a part keeps (`lifted`); one that needs an easier model
takes the whole time instead (`uncapped`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from optuav.modelling.expression import Call, Expression, Let, Operand, Relation, Variable
from optuav.modelling.model import Constraint, Model
from optuav.modelling.traversal import evaluate, fold

Limits: TypeAlias = Callable[..., Iterable[tuple[str, Relation]]]


@dataclass(frozen=True, eq=False)
class LongestPart:
    """The longest part of a time that keeps some relations.

    Parameters
    ----------
    name, symbol
        Of the part.
    share
        Name of its share of the time among the unknowns of a lifted model.
    words
        What is printed.
    value
        (time, *operands) → the part, in numbers or arrays.
    limits
        (share, time, *operands) → labelled relations that any allowed part keeps, which is as long
        as that share of the time.
    least_share
        (time, *operands) → an expression of parameters: the share is never less.
    """

    name: str
    symbol: str
    share: str
    words: str
    value: Callable[..., Any]
    limits: Limits
    least_share: Callable[..., Operand]

    def of(self, time: Operand, *operands: Operand) -> Let:
        """The part of a time, which depends on further operands, as a named quantity."""
        part = Call(self, (time, *operands))
        return Let(self.name, self.symbol, "s", part, self.words)

    def __call__(self, *arguments: Any) -> Any:
        """The part, from (time, *operands)."""
        return self.value(*arguments)

    @property
    def __name__(self) -> str:
        return self.words


Chosen: TypeAlias = Callable[[LongestPart, tuple[Any, ...]], Operand]


def speaks_of_parts(*trees: Operand) -> bool:
    """Whether trees hold the longest part of a time."""
    found = []

    def call(function: Any, arguments: tuple[Any, ...]) -> None:
        if isinstance(function, LongestPart):
            found.append(function)

    done: dict[int, Any] = {}
    for tree in trees:
        fold(tree, lambda leaf: None, call, done=done)
    return bool(found)


def _rewritten(model: Model, chosen: Chosen) -> Model:
    """The model with something else in place of parts of times; equal trees become one."""
    known: dict[tuple[Any, ...], Operand] = {}
    done: dict[int, Any] = {}

    def call(function: Any, arguments: tuple[Any, ...]) -> Operand:
        if function is np.subtract and _meant(arguments[0]) is _meant(arguments[1]):
            return 0.0
        is_part = isinstance(function, LongestPart)
        key = (function.share if is_part else function, *map(_identity, arguments))
        if key not in known:
            made = chosen(function, arguments) if is_part else Call(function, arguments)
            known[key] = made
        return known[key]

    def let(node: Let, inner: Operand) -> Operand:
        key = (node.name, _identity(inner))
        if key not in known:
            known[key] = Let(node.name, node.symbol, node.unit, inner, node.words)
        return known[key]

    def tree(operand: Operand) -> Operand:
        return fold(operand, lambda leaf: leaf, call, let, done)

    found = Model(model.title)
    found.variables, found.lets = [*model.variables], [*model.lets]
    found.sense, found.has_objective = model.sense, model.has_objective
    found.objective, found.preferences = tree(model.objective), [*map(tree, model.preferences)]
    for each in model.constraints:
        left, sense, right = each.relation.left, each.relation.sense, each.relation.right
        relation = Relation(tree(left), sense, tree(right))
        found.constraints.append(replace(each, relation=relation))
    return found


def _meant(operand: Operand) -> Operand:
    """What a quantity with a name stands for; others as they are."""
    return _meant(operand.expression) if isinstance(operand, Let) else operand


def _identity(operand: Operand) -> Any:
    """Equal for operands that are the same; the tables keep expressions and arrays alive."""
    return id(operand) if isinstance(operand, Expression | np.ndarray) else operand


def uncapped(model: Model) -> Model:
    """The model with every time as a whole in place of its longest part; itself without any."""
    if not speaks_of_parts(*model.expressions):
        return model
    return _rewritten(model, lambda _, arguments: arguments[0])


def without_parts(model: Model) -> Model:
    """The model without the constraints that speak of parts of times."""
    found = copy(model)
    found.constraints = [
        each for each in model.constraints if not speaks_of_parts(*each.relation.sides)
    ]
    return found


class Lifted(NamedTuple):
    """A model whose parts of times are unknowns.

    Parameters
    ----------
    model
        With their shares among its unknowns.
    parts
        By name of a share: the part that it stands for, and its arguments in the model.
    silent
        Labels of the constraints that it adds, which nobody stated.
    """

    model: Model
    parts: Mapping[str, tuple[LongestPart, tuple[Any, ...]]]
    silent: frozenset[str] = frozenset()

    def shares(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """The shares that the longest parts have, at values of the other unknowns by name."""
        found: dict[str, Any] = {}
        done: dict[int, Any] = {}
        for name, (part, arguments) in self.parts.items():
            time, *operands = (evaluate(each, {**point, **found}, done) for each in arguments)
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.divide(part(time, *operands), time)
            found[name] = np.where(np.asarray(time) > 0.0, share, 1.0)[()]
        return found


def lifted(model: Model) -> Lifted:
    """The model with the share of every part as an unknown of its own; itself without parts."""
    parts: dict[str, tuple[LongestPart, tuple[Any, ...]]] = {}
    if not speaks_of_parts(*model.expressions):
        return Lifted(model, parts)
    shares: list[Variable] = []
    limits: list[Constraint] = []
    silent: set[str] = set()

    def share(part: LongestPart, arguments: tuple[Any, ...]) -> Operand:
        name, label = part.share, part.name
        least = part.least_share(*arguments)
        shares.append(Variable(name, f"σ_{part.symbol}", "1", least, 1.0, label, 0))
        parts[name] = part, arguments
        stated = list(part.limits(shares[-1], *arguments))
        limits.extend(Constraint(*each, "1", "") for each in stated)
        silent.update([label, *(each[0] for each in stated)])
        return shares[-1] * arguments[0]

    found = _rewritten(model, share)
    if len(parts) < len(shares):
        raise ValueError("two different parts of times have one name")
    found.variables += shares
    found.constraints += limits
    return Lifted(found, parts, frozenset(silent))
