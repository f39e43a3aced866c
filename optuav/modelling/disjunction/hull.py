"""The convex hull of the alternatives: copies of the unknowns, constants times the choice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.modelling.affine import NotAffineError
from optuav.modelling.disjunction.cases import Case, goals, indexed
from optuav.modelling.disjunction.join import Join
from optuav.modelling.disjunction.substitution import applied
from optuav.modelling.expression import Leaf, Operand, Parameter, Relation, Variable
from optuav.modelling.model import Constraint
from optuav.modelling.walk import fold


class Hull(Join):
    """The perspective form, with copies of the unknowns."""

    def state(self) -> None:
        """State the joined model."""
        copies = [
            {
                each.name: self.model.variable(
                    f"{each.name}[{case.index}]",
                    indexed(each.symbol, case.index),
                    unit=each.unit,
                    lower=self.unknowns[each.name].lower,
                    binary=each.binary,
                )
                for each in case.declared.variables
            }
            for case in self.cases
        ]
        self.one_applies()
        for name, unknown in self.unknowns.items():
            whole = self.total([copy.get(name, 0.0) for copy in copies], unknown.symbol)
            said = Constraint("", Relation(unknown, "==", whole), unknown.unit, "")
            self.row(f"{unknown.symbol} of that alternative", unknown, "==", whole, said)
        every = [*zip(self.cases, self.choices, copies, strict=True)]
        for case, choice, copy in every:
            for each in self.rows(case):
                left, right = (
                    perspective(side, case, choice, copy) for side in each.relation.sides
                )
                self.row(f"{each.label}, {case.label}", left, each.relation.sense, right, each)
        self.aim(
            lambda k: self.total([perspective(goals(each[0])[k], *each) for each in every], f"v{k}")
        )


@dataclass(frozen=True)
class _Scaled:
    """An expression that holds copies of unknowns, its constants multiplied by the choice."""

    expression: Operand


def perspective(
    expression: Operand, case: Case, choice: Variable, copy: Mapping[str, Variable]
) -> Operand:
    """λ f(x/λ) of an affine f: copies for unknowns, and every constant multiplied by λ."""

    def leaf(node: Leaf) -> Any:
        if isinstance(node, Parameter):
            return case.given[node.name]
        return _Scaled(copy[node.name])

    def scaled(operand: Any) -> Operand:
        if isinstance(operand, _Scaled):
            return operand.expression
        return applied(np.multiply, (operand, choice))

    def call(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Any:
        holding = [isinstance(each, _Scaled) for each in arguments]
        if not any(holding):
            return applied(ufunc, arguments)
        inside = tuple(each.expression if isinstance(each, _Scaled) else each for each in arguments)
        if ufunc in (np.add, np.subtract):
            return _Scaled(applied(ufunc, tuple(map(scaled, arguments))))
        if ufunc in (np.negative, np.positive):
            return _Scaled(ufunc(*inside))
        if (ufunc is np.multiply and not all(holding)) or (ufunc is np.divide and not holding[1]):
            return _Scaled(applied(ufunc, inside))
        raise NotAffineError(f"{ufunc.__name__} of the unknowns is not linear")

    return scaled(fold(expression, leaf, call))
