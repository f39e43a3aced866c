"""What both forms of a disjunction state on the joined model."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import numpy as np

from optuav.modelling.disjunction.cases import Case, indexed
from optuav.modelling.disjunction.substitution import applied, is_number, substituted
from optuav.modelling.expression import Expression, Operand, Parameter, Relation, Sense, Variable
from optuav.modelling.model import Constraint, Model
from optuav.modelling.notation import Text
from optuav.modelling.walk import evaluate, leaves


class Join:
    """What both forms state on a model.

    model
        The joined model, empty.
    cases
        The alternatives.
    relaxed
        Whether the choice is not binary.
    """

    def __init__(self, model: Model, cases: Sequence[Case], relaxed: bool) -> None:
        self.model = model
        self.cases = cases
        self.sums: dict[str, Variable] = {}
        declared: dict[str, Variable] = {}
        for case in cases:
            for each in case.declared.variables:
                declared.setdefault(each.name, each)
        self.unknowns = {
            name: model.variable(
                name, each.symbol, unit=each.unit, lower=self._lowest(name), binary=each.binary
            )
            for name, each in declared.items()
        }
        self.choices = [
            model.variable(
                f"choice[{case.index}]",
                f"λ_{case.index}",
                unit="1",
                upper=1.0,
                label=case.name,
                binary=not relaxed,
            )
            for case in cases
        ]

    def _lowest(self, name: str) -> float:
        """0, or −∞ where the unknown may be negative in some case."""
        bounds = [
            float(evaluate(each.lower, case.declared.row(0)))
            for case in self.cases
            for each in case.declared.variables
            if each.name == name
        ]
        return 0.0 if min(bounds) >= 0.0 else -math.inf

    def row(
        self, label: str, left: Operand, sense: Sense, right: Operand, said: Constraint
    ) -> None:
        """State a row in the unit and from the line of a declared one."""
        relation = Relation(left, sense, right)
        self.model.constraints.append(Constraint(label, relation, said.unit, said.declared_at))

    def one_applies(self) -> None:
        """State that exactly one alternative applies, and the rows on which the choice has no part.

        Those are the rows without unknowns that are the same in all alternatives.
        """
        said = Constraint("", Relation(0.0, "==", 0.0), "1", "")
        self.row("one alternative", self.total(self.choices, "λ"), "==", 1.0, said)
        for each in self.in_common:
            left, right = (substituted(s, self.cases[0].given) for s in each.relation.sides)
            self.row(each.label, left, each.relation.sense, right, each)

    @cached_property
    def in_common(self) -> list[Constraint]:
        """The constraints without unknowns that all alternatives state alike."""
        stated = [
            {
                (each.label, Text().write(each.relation)): each
                for each in case.declared.constraints
                if all(
                    isinstance(leaf, Parameter) and case.shares(leaf.name)
                    for leaf in leaves(*each.relation.sides)
                )
            }
            for case in self.cases
        ]
        return [each for key, each in stated[0].items() if all(key in rows for rows in stated)]

    def rows(self, case: Case) -> Iterator[Constraint]:
        """The rows of an alternative that the choice switches, bounds of its unknowns included."""
        common = {each.label for each in self.in_common}
        yield from (each for each in case.declared.constraints if each.label not in common)
        for each in case.declared.variables:
            lowest = self.unknowns[each.name].lower
            bounds: list[tuple[Operand, Sense, float]] = [
                (each.lower, ">=", lowest),
                (each.upper, "<=", math.inf),
            ]
            for bound, sense, stated in bounds:
                if not is_number(bound, stated):
                    yield Constraint(each.label, Relation(each, sense, bound), each.unit, "")

    def total(self, terms: Sequence[Operand], symbol: str) -> Operand:
        """Σ of one term a case; written once, a case that stands for several becomes a Σ."""
        found: Operand = 0.0
        for case, term in zip(self.cases, terms, strict=True):
            if case.several and isinstance(term, Expression):
                if not isinstance(term, Variable):
                    named = indexed(symbol, case.index)
                    term = self.model.let(named, term)  # noqa: PLW2901
                sign = f"Σ{term.symbol}"
                term = self.sums.setdefault(  # noqa: PLW2901
                    sign, Variable(sign, sign, "1", 0.0, math.inf, sign, 0)
                )
            found = applied(np.add, (found, term))
        return found

    def aim(self, goal: Callable[[int], Operand]) -> None:
        """State the objective, goal 0, and the preferences after it."""
        first = self.cases[0].declared
        goals = [goal(k) for k in range(1 + len(first.preferences))]
        self.model.sense = first.sense
        self.model.objective, *self.model.preferences = goals
