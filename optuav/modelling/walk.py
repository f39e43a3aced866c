"""What is found by walking the trees of a model once: its nodes, and their forms."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple

from optuav.arrays import Values
from optuav.modelling.expression import Call, Let, Operand, Parameter
from optuav.modelling.forms import NOWHERE, Exponential, NotExponentialError, applied


class Step(NamedTuple):
    """What a node does with its operands."""

    # Takes them from a list of what the nodes, and then the numbers, have become; None of a leaf.
    take: Callable[[Sequence[Any]], Any] | None
    ufunc: Any  # None of a named quantity, which is what it stands for
    moves: bool  # Whether it holds a variable
    below: (
        Callable[[Sequence[Any]], Any] | None
    )  # As `take`, without numbers; None if there are none


@dataclass(eq=False)
class Walk:
    """What was found by walking the trees of a model, which most often stays as declared."""

    state: list[Any]  # What decides which trees these are, and the kind of the model
    trees: list[Operand]  # Objective, preferences, variables, bounds, both sides of constraints
    nodes: list[Any]  # Every node once, each after its operands
    given: Mapping[str, Parameter]  # Everything that occurs in them and has a value, by name
    traits: object = None  # See `classify.traits`; None where they were not asked for
    relations: Sequence[Any] = ()  # See `check.relations`
    _above: dict[frozenset[str], list[int]] = field(default_factory=dict)

    @cached_property
    def place(self) -> dict[int, int]:
        """Places of the nodes by identity."""
        return {id(node): k for k, node in enumerate(self.nodes)}

    @cached_property
    def tape(self) -> tuple[list[Step], list[Operand]]:
        """What every node does, and the numbers among the operands."""
        place, numbers, steps = self.place, list[Operand](), list[Step]()
        for node in self.nodes:
            where, called = list[int](), isinstance(node, Call)
            named = (node.expression,) if isinstance(node, Let) else ()
            for each in node.arguments if called else named:
                where.append(place.get(id(each), len(place) + len(numbers)))
                numbers += [] if id(each) in place else [each]
            below = [each for each in where if each < len(place)]
            mixed = _taking(below) if len(below) < len(where) else None
            ufunc = node.ufunc if called else None
            steps.append(Step(_taking(where) if where else None, ufunc, node.moves, mixed))
        return steps, numbers

    def values(self, point: Values) -> dict[int, Operand]:
        """Values of the nodes at a point, by identity; `KeyError` of a variable without one."""
        steps, numbers = self.tape
        table = [*self.nodes, *numbers]
        for k, (take, ufunc, moves, _) in enumerate(steps):
            if take is None:
                name = table[k].name
                table[k] = point[name] if moves else point.get(name, table[k].value)
            else:
                operands = take(table)
                table[k] = ufunc(*operands) if ufunc else operands[0]
        return dict(zip(map(id, self.nodes), table, strict=False))

    @cached_property
    def _table(self) -> list[Operand]:
        """Forms of the nodes by the parameters' own values, then the numbers."""
        table = [*self.nodes, *self.tape[1]]
        self._form(table, range(len(self.nodes)), {})
        return table

    def _form(self, table: list[Operand], places: Iterable[int], values: Values) -> None:
        """Put the forms of some nodes in their places, `NOWHERE` for what has none."""
        nodes, steps = self.nodes, self.tape[0]
        for k in places:
            take, ufunc, moves, _ = steps[k]
            if take is None:
                name = nodes[k].name
                time = Exponential({frozenset({(name, "time")}): 1.0}) if moves else None
                table[k] = time or values.get(name, nodes[k].value)
                continue
            operands = take(table)
            if ufunc is None:
                table[k] = operands[0]
            elif not moves:
                table[k] = ufunc(*operands)
            elif any(each is NOWHERE for each in operands):
                table[k] = NOWHERE
            else:
                try:
                    table[k] = applied(ufunc, operands)
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


def _taking(places: list[int]) -> Callable[[Sequence[Any]], Any]:
    """What takes from some places of a list; of one place, `itemgetter` would give no sequence."""
    if len(places) > 1:
        return itemgetter(*places)
    first = places[0] if places else 0
    return itemgetter(slice(first, first + len(places)))
