"""Shared unknowns, and a constant M that switches off the rows of what does not apply."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import reduce

import numpy as np

from optuav.modelling.affine import affine
from optuav.modelling.disjunction.cases import Case, goals
from optuav.modelling.disjunction.join import Join
from optuav.modelling.disjunction.substitution import applied, substituted
from optuav.modelling.expression import Operand, Relation, Sense
from optuav.modelling.model import Constraint


class BigM(Join):
    """Shared unknowns, and a constant that switches off the rows of what does not apply."""

    def state(self) -> None:
        """State the joined model."""
        self.one_applies()
        tops = {
            name: self.model.let(f"most {each.symbol}", self.top(name), symbol=f"U_{each.symbol}")
            for name, each in self.unknowns.items()
        }
        for case, choice in zip(self.cases, self.choices, strict=True):
            off, instead = 1.0 - choice, {**case.given, **self.unknowns}
            for number, each in enumerate(self.rows(case), start=1):
                left, right = (substituted(side, instead) for side in each.relation.sides)
                both = each.relation.sense == "=="
                for sense in inequalities(each.relation.sense):
                    label = f"{each.label}, {case.label}"
                    most = self.model.let(
                        f"M{number} of {label}" + (f" ({sense})" if both else ""),
                        self.most(case, each.relation, sense, tops),
                        symbol=f"M{number}_{case.index}",
                    )
                    loose = right + most * off if sense == "<=" else right - most * off
                    self.row(label, left, sense, loose, each)
            own = {each.name for each in case.declared.variables}
            for name, unknown in self.unknowns.items():
                if name not in own:
                    said = Constraint("", Relation(unknown, "<=", tops[name]), unknown.unit, "")
                    label = f"no {unknown.symbol}, {case.label}"
                    self.row(label, unknown, "<=", tops[name] * off, said)
        self.aim(self.goal)

    def top(self, name: str) -> Operand:
        """Upper bound on an unknown: the largest of those that the alternatives put on it."""
        if any(unknown.lower != 0.0 for unknown in self.unknowns.values()):
            raise ValueError("the form big-M needs unknowns that are never negative")
        having = [
            case
            for case in self.cases
            if any(each.name == name for each in case.declared.variables)
        ]
        bounds: list[Operand] = [] if len(having) == len(self.cases) else [0.0]
        for case in having:
            found = [*self.bounds(case, name)]
            if not found:
                raise ValueError(
                    f"the form big-M needs a bound on {self.unknowns[name].symbol}, by a row of "
                    f"{case.name} whose coefficients are plain numbers; the form hull needs none"
                )
            bounds.append(reduce(np.minimum, found))
        return reduce(np.maximum, bounds)

    def bounds(self, case: Case, name: str) -> Iterator[Operand]:
        """Bounds on an unknown by single rows of an alternative, the other unknowns at 0."""
        nothing = {**case.given, **dict.fromkeys(self.unknowns, 0.0)}
        for each in self.rows(case):
            for sense in inequalities(each.relation.sense):
                small, large = (
                    each.relation.sides if sense == "<=" else reversed(each.relation.sides)
                )
                form = affine(small, case.given).plus(affine(large, case.given), -1.0)
                slopes = form.coefficients
                plain = all(isinstance(slope, float) and slope >= 0.0 for slope in slopes.values())
                if plain and slopes.get(name, 0.0) > 0.0:
                    at_nothing = substituted(large, nothing), substituted(small, nothing)
                    room = applied(np.subtract, at_nothing)
                    yield applied(np.divide, (room, slopes[name]))

    def most(
        self, case: Case, relation: Relation, sense: Sense, tops: Mapping[str, Operand]
    ) -> Operand:
        """M: by how much a row may be violated while the unknowns keep their bounds."""
        small, large = relation.sides
        if sense == ">=":
            small, large = large, small
        slopes = case.numbers(small, large).coefficients
        worst = {name: tops[name] if slope > 0.0 else 0.0 for name, slope in slopes.items()}
        at_worst = {**case.given, **dict.fromkeys(self.unknowns, 0.0), **worst}
        return applied(np.subtract, (substituted(small, at_worst), substituted(large, at_worst)))

    def goal(self, k: int) -> Operand:
        """A goal in the shared unknowns; by how much the alternatives differ goes with λ."""
        slopes: dict[str, tuple[float, Operand]] = {}
        constants = []
        for case, choice in zip(self.cases, self.choices, strict=True):
            goal = goals(case)[k]
            numbers, symbols = case.numbers(goal), affine(goal, case.given)
            for each in case.declared.variables:
                slope = numbers.coefficients.get(each.name, 0.0)
                known, _ = slopes.setdefault(
                    each.name, (slope, symbols.coefficients.get(each.name, 0.0))
                )
                if known != slope:
                    raise ValueError(
                        "the form big-M needs goals that differ by constants only; "
                        "the form hull takes any"
                    )
            nothing = {**case.given, **dict.fromkeys(self.unknowns, 0.0)}
            constants.append(applied(np.multiply, (substituted(goal, nothing), choice)))
        total = self.total(constants, f"v{k}")
        for name, (_, slope) in slopes.items():
            term = applied(np.multiply, (slope, self.unknowns[name]))
            total = applied(np.add, (total, term))
        return total


def inequalities(sense: Sense) -> tuple[Sense, ...]:
    """The inequalities that a row is."""
    return ("<=", ">=") if sense == "==" else (sense,)
