"""One walk through the trees of a model: its nodes, their values and their forms.

A form is a tree with numbers for its parameters: a sum of times and levellings, see
`optuav.modelling.forms`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple

from optuav.arrays import Values
from optuav.modelling.expression import Call, Let, Operand, Parameter
from optuav.modelling.forms import NOWHERE, Exponential, NotExponentialError, applied


class Step(NamedTuple):
    """Rule that gives the value of a node from the values of its operands."""

    # Picks the operands from a list of the values of all nodes, then numbers; None for a leaf.
    take: Callable[[Sequence[Any]], Any] | None
    ufunc: Any  # None for a named quantity, which has the value of its expression
    moves: bool  # Whether the node holds a variable


@dataclass(eq=False)
class Walk:
    """Results of walking the trees of a model, kept as long as the model stays as declared."""

    state: list[Any]  # What decides which trees these are, and the kind of the model
    trees: list[Operand]  # Objective, preferences, variables, bounds, both sides of constraints
    nodes: list[Any]  # Every node once, each after its operands
    given: Mapping[str, Parameter]  # Everything that occurs in them and has a value, by name
    traits: object = None  # See `classify.traits`; None where they were not asked for
    relations: Sequence[Any] = ()  # See `check.relations`
    _table: list[Operand] = field(default_factory=list)  # Forms of the nodes, then the numbers
    _forms: dict[int, Operand] = field(default_factory=dict)
    _above: dict[frozenset[str], list[int]] = field(default_factory=dict)

    @cached_property
    def tape(self) -> tuple[list[Step], list[Operand]]:
        """The step of every node, and the numbers among their operands."""
        place, numbers = {id(node): k for k, node in enumerate(self.nodes)}, list[Operand]()
        steps = list[Step]()
        for node in self.nodes:
            where, called = list[int](), isinstance(node, Call)
            named = (node.expression,) if isinstance(node, Let) else ()
            for operand in node.arguments if called else named:
                where.append(place.get(id(operand), len(place) + len(numbers)))
                numbers += [] if id(operand) in place else [operand]
            # With one place `itemgetter` gives a bare value, with a slice a list of it.
            single = itemgetter(slice(where[0], where[0] + 1)) if len(where) == 1 else None
            take = single or (itemgetter(*where) if where else None)
            steps.append(Step(take, node.ufunc if called else None, node.moves))
        return steps, numbers

    def values(self, point: Values) -> dict[int, Operand]:
        """Values of the nodes at a point, by identity; `KeyError` of a variable without one."""
        steps, numbers = self.tape
        table = [*self.nodes, *numbers]
        for k, (take, ufunc, moves) in enumerate(steps):
            if take is None:
                name = table[k].name
                table[k] = point[name] if moves else point.get(name, table[k].value)
            else:
                operands = take(table)
                table[k] = ufunc(*operands) if ufunc else operands[0]
        return dict(zip(map(id, self.nodes), table, strict=False))

    def forms(self, values: Values) -> dict[int, Operand]:
        """Forms of the nodes that have one, by identity."""
        if self._forms and not values:
            return self._forms
        steps, numbers = self.tape
        table = [*(self._table or (*self.nodes, *numbers))]
        for k in self._places_above(frozenset(values)) if self._table else range(len(steps)):
            take, ufunc, moves = steps[k]
            if take is None:
                name = self.nodes[k].name
                time = Exponential({frozenset({(name, "time")}): 1.0}) if moves else None
                table[k] = time or values.get(name, self.nodes[k].value)
                continue
            operands = take(table)
            if ufunc is None:
                table[k] = operands[0]
            elif not moves:
                table[k] = ufunc(*operands)
            else:
                # A function of more than two operands has no form at all.
                nowhere = operands[0] is NOWHERE or operands[-1] is NOWHERE
                try:
                    table[k] = NOWHERE if nowhere else applied(ufunc, tuple(operands))
                except NotExponentialError:
                    table[k] = NOWHERE
        pairs = zip(map(id, self.nodes), table, strict=False)
        forms = {node: form for node, form in pairs if form is not NOWHERE}
        if not values:
            self._table, self._forms = table, forms
        return forms

    def _places_above(self, names: frozenset[str]) -> list[int]:
        """Places of some parameters, and of every node that holds one of them."""
        if names not in self._above:
            changed = {id(self.given[name]) for name in self.given.keys() & names}
            for node in self.nodes:
                if not changed.isdisjoint(map(id, node.below)):
                    changed.add(id(node))
            self._above[names] = [k for k, node in enumerate(self.nodes) if id(node) in changed]
        return self._above[names]
