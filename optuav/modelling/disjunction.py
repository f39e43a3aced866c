"""Models of which exactly one applies, joined into one model with a binary choice.

Every row of an alternative is stated once more from its own declaration. λ_r is 1 for the
alternative r that applies and 0 for the others; Σ λ_r = 1.

- ``"hull"``: each alternative has unknowns x_r of its own, and x = Σ x_r. A row a·x + c ≥ 0 becomes
  a·x_r + c λ_r ≥ 0, so that λ_r = 0 leaves x_r = 0. With λ_r in [0, 1] these rows describe the
  convex hull of all alternatives [1]_: no linear relaxation is tighter, and the best that it
  reaches is the best alternative itself, as long as nothing else ties the alternatives together.
- ``"big-M"``: the alternatives share the unknowns. A row a·x + c ≥ 0 becomes
  a·x + c ≥ −M (1 − λ_r), with M as small as bounds on the unknowns allow; those come from the rows
  whose coefficients are plain numbers, as a deadline's are. Fewer unknowns and rows, but a far
  looser relaxation: a little of each alternative slackens the rows of all of them [2]_.

References
----------
.. [1] E. Balas, "Disjunctive programming: properties of the convex hull of feasible points",
   Discrete Applied Mathematics, 1998.
.. [2] J. P. Vielma, "Mixed integer linear programming formulation techniques", SIAM Review, 2015.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, Literal

import numpy as np

from optuav.modelling.affine import Affine, NotAffineError, affine
from optuav.modelling.expression import (
    Expression,
    Leaf,
    Operand,
    Parameter,
    Relation,
    Sense,
    Variable,
    evaluate,
    fold,
    leaves,
)
from optuav.modelling.model import Constraint, Model
from optuav.modelling.notation import Text

Form = Literal["hull", "big-M"]
FORMS: tuple[Form, ...] = ("hull", "big-M")
LETTERS = "rstuvw"
"""Stand for the numbers of alternatives that are written once; further kinds are written out."""


class Disjunction(Model):
    """A joined model. Printed, what is alike for several alternatives is written once.

    Parameters
    ----------
    title
        What is sought, in a line.
    written
        The model to print.
    """

    def __init__(self, title: str, written: Model) -> None:
        super().__init__(title)
        self.written = written

    def __str__(self) -> str:
        return str(self.written)

    def to_latex(self) -> str:
        """The programme as a LaTeX ``align*`` environment, what is alike written once."""
        return self.written.to_latex()


def disjunction(
    alternatives: Mapping[str, Model], form: Form = "hull", *, relaxed: bool = False
) -> Disjunction:
    """One model in which exactly one of several linear models applies.

    Parameters
    ----------
    alternatives
        By name; all maximise or all minimise. Unknowns of the same name are the same, and one that
        an alternative does not have is 0 where it applies. Parameters of the same name and value
        are shared, others become ``name[k]`` for the alternative with number k, from 1.
    form
        ``"hull"`` or ``"big-M"``, see the module.
    relaxed
        Whether several alternatives may apply in part: 0 ≤ λ_r ≤ 1 instead of 0 or 1.

    Returns
    -------
    A model with the unknowns of the alternatives, a binary ``choice[k]`` for each, and in the form
    hull copies ``name[k]`` of its unknowns. The form hull holds for all values of the parameters;
    M is worked out for the signs that the coefficients have.

    Raises
    ------
    NotAffineError
        If an alternative is not linear.
    ValueError
        If the form does not exist, there is no alternative, or they disagree on the sense; in the
        form big-M also if an unknown has no bound that M could rest on, or objectives differ by
        more than a constant.
    """
    if form not in FORMS:
        raise ValueError(f"a disjunction has the form {' or '.join(FORMS)}, not {form!r}")
    if len({model.sense for model in alternatives.values()}) != 1:
        raise ValueError("a disjunction needs alternatives that all maximise or all minimise")
    shared = _shared(list(alternatives.values()))
    cases = [
        _case(str(number), name, model, shared)
        for number, (name, model) in enumerate(alternatives.items(), start=1)
    ]
    title = f"{cases[0].declared.title}; one of {len(cases)} alternatives"
    joined = Disjunction(title, Model(title))
    join = _Hull if form == "hull" else _BigM
    join(joined, cases, relaxed).state()
    join(joined.written, _alike(cases), relaxed).state()
    return joined


@dataclass(frozen=True)
class _Case:
    """An alternative, or several that are written as one.

    index
        What its symbols end in.
    name, label
        How its choice and its rows are called.
    given
        Its parameters in the joined model, by their names in the declaration.
    several
        Whether it stands for several.
    """

    index: str
    name: str
    label: str
    declared: Model
    given: Mapping[str, Parameter]
    several: bool = False

    def numbers(self, left: Operand, right: Operand = 0.0) -> Affine:
        """The difference of two sides with numbers for the parameters."""
        values = self.declared.row(0)
        return affine(left, values).plus(affine(right, values), -1.0)

    def shares(self, name: str) -> bool:
        """Whether a parameter of the declaration is the same in all alternatives."""
        return self.given[name].name == name


def _shared(models: Sequence[Model]) -> dict[str, Parameter]:
    """The parameters that have one value wherever they occur, by name."""
    found: dict[str, list[Parameter]] = {}
    for model in models:
        values = model.row(0)
        for name, each in model.parameters.items():
            found.setdefault(name, []).append(_renamed(each, name, each.symbol, values[name]))
    return {name: each[0] for name, each in found.items() if len({p.value for p in each}) == 1}


def _renamed(parameter: Parameter, name: str, symbol: str, value: Any) -> Parameter:
    value = value if np.ndim(value) else float(value)
    return Parameter(name, symbol, parameter.unit, value, parameter.key)


def _indexed(symbol: str, index: str) -> str:
    return f"{symbol},{index}" if "_" in symbol else f"{symbol}_{index}"


def _case(index: str, name: str, declared: Model, shared: Mapping[str, Parameter]) -> _Case:
    values = declared.row(0)
    own = {
        each: _renamed(p, f"{each}[{index}]", _indexed(p.symbol, index), values[each])
        for each, p in declared.parameters.items()
    }
    given = {each: shared.get(each, parameter) for each, parameter in own.items()}
    return _Case(index, name, name, declared, given)


def _alike(cases: Sequence[_Case]) -> list[_Case]:
    """The cases, those that differ in the values of their parameters only as one."""
    groups: dict[Any, list[_Case]] = {}
    for case in cases:
        groups.setdefault(_shape(case), []).append(case)
    letters = iter(LETTERS)
    found: list[_Case] = []
    for group in groups.values():
        letter = next(letters, None) if len(group) > 1 else None
        found += group if letter is None else [_as_one(group, letter)]
    return found


def _shape(case: _Case) -> tuple[Any, ...]:
    model, write = case.declared, Text().write
    rows = [
        (each.label, write(each.relation), *map(np.sign, excess.coefficients.values()))
        for each in model.constraints
        for excess in (case.numbers(each.relation.left, each.relation.right),)
    ]
    bounds = [(each.name, write(each.lower), write(each.upper)) for each in model.variables]
    goals = [write(goal) for goal in (model.objective, *model.preferences)]
    return *(name for name in case.given if case.shares(name)), *goals, *rows, *bounds


def _as_one(group: Sequence[_Case], letter: str) -> _Case:
    first = group[0]
    numbers = [int(case.index) for case in group]
    run = numbers == [*range(numbers[0], numbers[-1] + 1)]
    which = f"{numbers[0]} … {numbers[-1]}" if run else ", ".join(map(str, numbers))
    given = dict(first.given)
    for name, parameter in first.declared.parameters.items():
        if not first.shares(name):
            values = np.array([case.given[name].value for case in group])
            symbol = _indexed(parameter.symbol, letter)
            given[name] = _renamed(parameter, f"{name}[{letter}]", symbol, values)
    label = f"{letter} = {which}"
    names = ", ".join(case.name for case in group)
    return _Case(letter, f"{label}: {names}", label, first.declared, given, several=True)


class _Join:
    """What both forms state on a model.

    model
        The joined model, empty.
    cases
        The alternatives.
    relaxed
        Whether the choice is not binary.
    """

    def __init__(self, model: Model, cases: Sequence[_Case], relaxed: bool) -> None:
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
            sides = [_with(side, self.cases[0].given) for side in _sides(each)]
            self.row(each.label, sides[0], each.relation.sense, sides[1], each)

    @cached_property
    def in_common(self) -> list[Constraint]:
        """The constraints without unknowns that all alternatives state alike."""
        stated = [
            {
                (each.label, Text().write(each.relation)): each
                for each in case.declared.constraints
                if all(
                    isinstance(leaf, Parameter) and case.shares(leaf.name)
                    for leaf in leaves(*_sides(each))
                )
            }
            for case in self.cases
        ]
        return [each for key, each in stated[0].items() if all(key in rows for rows in stated)]

    def rows(self, case: _Case) -> Iterator[Constraint]:
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
                if not _is(bound, stated):
                    yield Constraint(each.label, Relation(each, sense, bound), each.unit, "")

    def total(self, terms: Sequence[Operand], symbol: str) -> Operand:
        """Σ of one term a case; written once, a case that stands for several becomes a Σ."""
        found: Operand = 0.0
        for case, term in zip(self.cases, terms, strict=True):
            if case.several and isinstance(term, Expression):
                if not isinstance(term, Variable):
                    named = _indexed(symbol, case.index)
                    term = self.model.let(named, term)  # noqa: PLW2901
                sign = f"Σ{term.symbol}"
                term = self.sums.setdefault(  # noqa: PLW2901
                    sign, Variable(sign, sign, "1", 0.0, math.inf, sign, 0)
                )
            found = _apply(np.add, (found, term))
        return found

    def aim(self, goal: Callable[[int], Operand]) -> None:
        """State the objective, goal 0, and the preferences after it."""
        first = self.cases[0].declared
        goals = [goal(k) for k in range(1 + len(first.preferences))]
        self.model.sense = first.sense
        self.model.objective, *self.model.preferences = goals


class _Hull(_Join):
    """The perspective form, with copies of the unknowns."""

    def state(self) -> None:
        """State the joined model."""
        copies = [
            {
                each.name: self.model.variable(
                    f"{each.name}[{case.index}]",
                    _indexed(each.symbol, case.index),
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
                left, right = (_perspective(side, case, choice, copy) for side in _sides(each))
                self.row(f"{each.label}, {case.label}", left, each.relation.sense, right, each)
        self.aim(
            lambda k: self.total(
                [_perspective(_goals(each[0])[k], *each) for each in every], f"v{k}"
            )
        )


class _BigM(_Join):
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
                left, right = (_with(side, instead) for side in _sides(each))
                both = each.relation.sense == "=="
                for sense in _inequalities(each.relation.sense):
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

    def bounds(self, case: _Case, name: str) -> Iterator[Operand]:
        """Bounds on an unknown by single rows of an alternative, the other unknowns at 0."""
        nothing = {**case.given, **dict.fromkeys(self.unknowns, 0.0)}
        for each in self.rows(case):
            for sense in _inequalities(each.relation.sense):
                small, large = _sides(each) if sense == "<=" else reversed(_sides(each))
                form = affine(small, case.given).plus(affine(large, case.given), -1.0)
                slopes = form.coefficients
                plain = all(isinstance(slope, float) and slope >= 0.0 for slope in slopes.values())
                if plain and slopes.get(name, 0.0) > 0.0:
                    room = _apply(np.subtract, (_with(large, nothing), _with(small, nothing)))
                    yield _apply(np.divide, (room, slopes[name]))

    def most(
        self, case: _Case, relation: Relation, sense: Sense, tops: Mapping[str, Operand]
    ) -> Operand:
        """M: by how much a row may be violated while the unknowns keep their bounds."""
        small, large = relation.left, relation.right
        if sense == ">=":
            small, large = large, small
        slopes = case.numbers(small, large).coefficients
        worst = {name: tops[name] if slope > 0.0 else 0.0 for name, slope in slopes.items()}
        at_worst = {**case.given, **dict.fromkeys(self.unknowns, 0.0), **worst}
        return _apply(np.subtract, (_with(small, at_worst), _with(large, at_worst)))

    def goal(self, k: int) -> Operand:
        """A goal in the shared unknowns; by how much the alternatives differ goes with λ."""
        slopes: dict[str, tuple[float, Operand]] = {}
        constants = []
        for case, choice in zip(self.cases, self.choices, strict=True):
            goal = _goals(case)[k]
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
            constants.append(_apply(np.multiply, (_with(goal, nothing), choice)))
        total = self.total(constants, f"v{k}")
        for name, (_, slope) in slopes.items():
            term = _apply(np.multiply, (slope, self.unknowns[name]))
            total = _apply(np.add, (total, term))
        return total


def _goals(case: _Case) -> list[Operand]:
    return [case.declared.objective, *case.declared.preferences]


def _sides(constraint: Constraint) -> tuple[Operand, Operand]:
    return constraint.relation.left, constraint.relation.right


def _inequalities(sense: Sense) -> tuple[Sense, ...]:
    return ("<=", ">=") if sense == "==" else (sense,)


def _is(operand: Operand, number: float) -> bool:
    return isinstance(operand, int | float) and operand == number


def _with(expression: Operand, instead: Mapping[str, Operand]) -> Operand:
    """An expression with other operands in place of its leaves, by name."""
    return fold(expression, lambda node: instead[node.name], _apply)


def _apply(ufunc: np.ufunc, arguments: tuple[Operand, ...]) -> Operand:
    """A ufunc on operands, but nothing is added to 0 or multiplied by 0 or 1."""
    if ufunc in (np.add, np.subtract, np.multiply, np.divide):
        first, second = arguments
        if ufunc in (np.add, np.subtract) and _is(second, 0.0):
            return first
        if ufunc in (np.add, np.subtract) and _is(first, 0.0):
            return second if ufunc is np.add else -second
        if ufunc in (np.multiply, np.divide) and (_is(first, 0.0) or _is(second, 1.0)):
            return first
        if ufunc is np.multiply and (_is(second, 0.0) or _is(first, 1.0)):
            return second
    return ufunc(*arguments)


@dataclass(frozen=True)
class _Scaled:
    """An expression that holds copies of unknowns, its constants multiplied by the choice."""

    expression: Operand


def _perspective(
    expression: Operand, case: _Case, choice: Variable, copy: Mapping[str, Variable]
) -> Operand:
    """λ f(x/λ) of an affine f: copies for unknowns, and every constant multiplied by λ."""

    def leaf(node: Leaf) -> Any:
        if isinstance(node, Parameter):
            return case.given[node.name]
        return _Scaled(copy[node.name])

    def scaled(operand: Any) -> Operand:
        if isinstance(operand, _Scaled):
            return operand.expression
        return _apply(np.multiply, (operand, choice))

    def call(ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Any:
        holding = [isinstance(each, _Scaled) for each in arguments]
        if not any(holding):
            return _apply(ufunc, arguments)
        inside = tuple(each.expression if isinstance(each, _Scaled) else each for each in arguments)
        if ufunc in (np.add, np.subtract):
            return _Scaled(_apply(ufunc, tuple(map(scaled, arguments))))
        if ufunc in (np.negative, np.positive):
            return _Scaled(ufunc(*inside))
        if (ufunc is np.multiply and not all(holding)) or (ufunc is np.divide and not holding[1]):
            return _Scaled(_apply(ufunc, inside))
        raise NotAffineError(f"{ufunc.__name__} of the unknowns is not linear")

    return scaled(fold(expression, leaf, call))
