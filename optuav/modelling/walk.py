"""One walk through the trees of a model: its nodes, their values and their forms.

A form is a tree with numbers for its parameters: a sum of times and levellings, see
`optuav.modelling.forms`.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from optuav.arrays import Values
from optuav.modelling.expression import Call, Let, Operand, Parameter
from optuav.modelling.forms import NOWHERE, NotExponentialError, applied, form_of_leaf


@dataclass(eq=False)
class Walk:
    """Results of walking the trees of a model, kept as long as the model stays as declared."""

    state: list[Any]  # What decides which trees these are, and the kind of the model
    trees: list[Operand]  # Objective, preferences, variables, bounds, both sides of constraints
    nodes: list[Any]  # Every node once, each after its operands
    given: Mapping[str, Parameter]  # Everything that occurs in them and has a value, by name
    traits: object = None  # See `classify.traits`; None where they were not asked for
    relations: Sequence[Any] = ()  # See `check.relations`
    _forms: dict[int, Operand] = field(default_factory=dict)  # With the values of the model
    _above: dict[frozenset[str], list[Any]] = field(default_factory=dict)

    def values(self, point: Values) -> dict[int, Operand]:
        """Values of the nodes at a point, by identity; `KeyError` of a variable without one."""
        done = dict[int, Operand]()
        get = done.get
        for node in self.nodes:
            if isinstance(node, Call):
                done[id(node)] = node.ufunc(*[get(id(e), e) for e in node.arguments])
            elif isinstance(node, Let):
                done[id(node)] = get(id(node.expression), node.expression)
            else:
                has_value = node.name in point or node.moves
                done[id(node)] = point[node.name] if has_value else node.value
        return done

    def forms(self, values: Values) -> dict[int, Operand]:
        """Forms of the nodes that have one, by identity."""
        done = {**self._forms}
        get = done.get
        for node in self._nodes_above(frozenset(values)) if done else self.nodes:
            if isinstance(node, Call):
                operands = tuple([get(id(e), e) for e in node.arguments])
                # A function of more than two operands has no form at all.
                form: Operand = NOWHERE
                function: Operand = node.ufunc
                if not node.moves:
                    form = function(*operands)
                elif operands[0] is not NOWHERE and operands[-1] is not NOWHERE:
                    with suppress(NotExponentialError):
                        form = applied(function, operands)
            elif isinstance(node, Let):
                form = get(id(node.expression), node.expression)
            else:
                form = form_of_leaf(node, values)
            done[id(node)] = form
        if not values:
            self._forms = done
        return {node: form for node, form in done.items() if form is not NOWHERE}

    def _nodes_above(self, names: frozenset[str]) -> list[Any]:
        """Some parameters, and every node that holds one of them."""
        if names not in self._above:
            changed = {id(self.given[name]) for name in self.given.keys() & names}
            for node in self.nodes:
                if not changed.isdisjoint(map(id, node.below)):
                    changed.add(id(node))
            self._above[names] = [node for node in self.nodes if id(node) in changed]
        return self._above[names]
