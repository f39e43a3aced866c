"""What is found by walking the trees of a model once: its nodes, and their forms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import itemgetter
from typing import Any, TypeAlias

from optuav.arrays import Values
from optuav.modelling.expression import Call, Let, Operand, Parameter, Variable
from optuav.modelling.forms import NOWHERE, Exponential, NotExponentialError, applied

Take: TypeAlias = Callable[[Sequence[Any]], tuple[Any, ...]]
"""The operands of a node, from a list of what the nodes, and then the numbers, have become."""


@dataclass(eq=False)
class Walk:
    """What was found by walking the trees of a model, which most often stays as declared."""

    state: list[Any]  # What decides which trees these are, and the kind of the model
    trees: list[Operand]  # Objective, preferences, variables, bounds, both sides of constraints
    nodes: list[Any]  # Every node once, each after its operands
    given: Mapping[str, Parameter]  # Everything that occurs in them and has a value, by name
    traits: object = None  # See `classify.traits`; None where they were not asked for
    _above: dict[frozenset[str], list[int]] = field(default_factory=dict)

    @cached_property
    def tape(self) -> tuple[list[Take | None], list[Operand]]:
        """How to take the operands of every node, None of a leaf, and the numbers among them."""
        place, numbers = {id(node): k for k, node in enumerate(self.nodes)}, list[Operand]()
        takes = list[Take | None]()
        for node in self.nodes:
            where, operands = list[int](), node.arguments if isinstance(node, Call) else ()
            for each in (node.expression,) if isinstance(node, Let) else operands:
                where.append(place.get(id(each), len(place) + len(numbers)))
                numbers += [] if id(each) in place else [each]
            # Of a single place, `itemgetter` gives what is there, and of a slice a list.
            alone = itemgetter(slice(where[0], where[0] + 1)) if len(where) == 1 else None
            takes.append(alone or (itemgetter(*where) if where else None))
        return takes, numbers

    @cached_property
    def _table(self) -> list[Operand]:
        """Forms of the nodes by the parameters' own values, then the numbers."""
        table = [*self.nodes, *self.tape[1]]
        self._form(table, range(len(self.nodes)), {})
        return table

    def _form(self, table: list[Operand], places: Iterable[int], values: Values) -> None:
        """Put the forms of some nodes in their places, `NOWHERE` for what has none."""
        nodes, takes = self.nodes, self.tape[0]
        for k in places:
            node, take = nodes[k], takes[k]
            if take is None:
                if isinstance(node, Variable):
                    table[k] = Exponential({frozenset({(node.name, "time")}): 1.0})
                else:
                    table[k] = values.get(node.name, node.value)
                continue
            operands = take(table)
            if not node.moves:
                table[k] = operands[0] if isinstance(node, Let) else node.ufunc(*operands)
            elif isinstance(node, Let):
                table[k] = operands[0]
            elif any(each is NOWHERE for each in operands):
                table[k] = NOWHERE
            else:
                try:
                    table[k] = applied(node.ufunc, operands)
                except NotExponentialError:
                    table[k] = NOWHERE

    def forms(self, values: Values) -> dict[int, Operand]:
        """Forms of the nodes that have one, by identity; values that differ from their own."""
        if not values:
            return self._own_forms
        names, table = frozenset(values), [*self._table]
        if names not in self._above:
            self._above[names] = self._places_above(names)
        self._form(table, self._above[names], values)
        return self._by_identity(table)

    @cached_property
    def _own_forms(self) -> dict[int, Operand]:
        return self._by_identity(self._table)

    def _by_identity(self, table: list[Operand]) -> dict[int, Operand]:
        """The forms in a table by the identity of their nodes."""
        pairs = zip(map(id, self.nodes), table, strict=False)
        return {node: form for node, form in pairs if form is not NOWHERE}

    def _places_above(self, names: frozenset[str]) -> list[int]:
        """Places of some parameters, and of every node that holds one of them."""
        found = {id(self.given[name]): 0 for name in self.given.keys() & names}
        for node in self.nodes:
            if any(id(each) in found for each in node.below):
                found[id(node)] = 0
        return [k for k, node in enumerate(self.nodes) if id(node) in found]
