"""What a model declares: labelled variables and constraints, named quantities, an objective."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from optuav.modelling.expression import (
    Let,
    Operand,
    Parameter,
    PartedLabel,
    Relation,
    Variable,
)
from optuav.modelling.traversal import leaves, nodes
from optuav.modelling.walk import Walk


@dataclass(frozen=True, eq=False)
class Constraint:
    """A labelled relation, with its subject as data.

    Parameters
    ----------
    name
        As the paper calls it.
    relation, unit
        The two sides, and the unit of both.
    declared_at
        Source file and line of the declaration.
    kind
        Kind of the limit: ``"dry"``, ``"past full"``, ``"state of charge"`` or ``"deadline"``;
        empty if not stated.
    step
        Number, from 0, of the step of the route at whose end it holds; None for the end of the
        mission, or for no moment.
    moment
        That moment, printed behind the name; None for no moment.

    Examples
    --------
    >>> import optuav
    >>> (part,) = optuav.formulate("paper", "P3", perspective="battery").parts
    >>> [(row.label, row.kind, row.unit) for row in part.model.constraints]
    [('P3.a state of charge', 'state of charge', '1')]
    """

    name: str
    relation: Relation
    unit: str = "1"
    declared_at: str = ""
    kind: str = ""
    step: int | None = None
    moment: object = None

    @cached_property
    def label(self) -> str:
        """Name and moment: no two constraints of a model have the same."""
        return self.name if self.moment is None else PartedLabel(self.name, self.moment)


class Declaration:
    """The declared parts of a model, see `Model`, and what occurs in them."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.variables: list[Variable] = []
        self.constraints: list[Constraint] = []
        self.lets: list[Let] = []
        self.sense: Literal["maximise", "minimise"] = "maximise"
        self.sign = 1.0  # −1 where it minimises: the objective times this is maximised
        self.objective: Operand = 0.0
        self.has_objective, self.objective_unit = False, ""
        self.preferences: list[Operand] = []
        self._walk = Walk([], [], [], {})

    @property
    def walked(self) -> Walk:
        """Results of walking its trees, renewed if the model has changed."""
        state = [self.objective, self.sense, *self.preferences, *self.constraints]
        for unknown in self.variables:
            state += unknown, unknown.lower, unknown.upper, unknown.binary
        before = self._walk.state
        if len(state) == len(before) and not any(map(operator.is_not, state, before)):
            return self._walk
        trees = [self.objective, *self.preferences]
        for variable in self.variables:
            trees += variable, variable.lower, variable.upper
        for stated in self.constraints:
            trees += stated.relation.sides
        all_nodes = [*nodes(*trees)]
        symbols = [node for node in all_nodes if isinstance(node, (Variable, Parameter))]
        by_name = {symbol.name: symbol for symbol in symbols}
        if len(by_name) < len(symbols):
            leaves(*trees)  # refused, with the name that two have
        named = {n: unknown for n, unknown in by_name.items() if isinstance(unknown, Parameter)}
        self._walk = Walk(state, trees, all_nodes, named)
        return self._walk

    @property
    def given(self) -> Mapping[str, Parameter]:
        """Everything that occurs in the model and has a value, by name."""
        return self.walked.given

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The named parameters that occur in the model: a reader may change them."""
        return {name: parameter for name, parameter in self.given.items() if parameter.varies}

    def row(self, index: int) -> dict[str, Any]:
        """Values of all parameters for one of several programmes that are declared as one."""
        return {
            name: parameter.value[index] if getattr(parameter.value, "ndim", 0) else parameter.value
            for name, parameter in self.walked.given.items()
        }
