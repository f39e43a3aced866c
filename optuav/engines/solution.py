"""The solution that every engine returns."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain
from typing import Any

import numpy as np

from optuav.arrays import Floats, Number, Values
from optuav.engines import prices
from optuav.engines.linear_form import own_bounds
from optuav.engines.prices import Residuals, ShadowPrices
from optuav.errors import SolverError
from optuav.frames import DataFrame, frame, without_rounding
from optuav.modelling.check import LONGEST_LABEL, Checks, evaluated, relations, unusable
from optuav.modelling.expression import Operand
from optuav.modelling.model import Model
from optuav.modelling.traversal import change_by_step, evaluate, has_unknowns
from optuav.presentation.blocks import Block, Fold, Heading, Table
from optuav.presentation.numbers import figure, typed, with_unit
from optuav.presentation.presented import Presented
from optuav.status import SAME_S, Status

DUALITY = "linear programming duality, KKT conditions evaluated again"
HEADS = ("constraint", "slack", "multiplier", "")
ROUNDED_OBJECTIVE = 1e-13  # Share of an objective that is rounding
TIGHT = 1e-7  # Slack below which a constraint holds with equality, relative to max(1, |right side|)


@dataclass(frozen=True)
class Solution(Presented):
    """Answers to one or several programmes that were declared as one.

    Sequences and arrays have one entry a programme.

    Parameters
    ----------
    engine, proof
        Its name, and how it knows, in a word or two.
    declared
        The model solved; programmes of a kind may share it.
    statuses
        Status of each programme.
    objective, values
        The best objective, and the variables by name, in their units; NaN without an answer.
    tight
        Labels of the constraints that bind (from the grid: that a slot more or less of an unknown
        would violate). None where that follows from the answer.
    duals
        Multipliers that the engine found, by label of the constraint; empty from engines that have
        none. None where they follow from the answer: see `multipliers_at`.
    beyond
        Proved bound on the objective; None if the engine has none.
    words
        The engine's own words.
    given
        Values of parameters unlike the declared ones, by name; `solve` fills in its own.

    Examples
    --------
    >>> import optuav
    >>> (solution,) = optuav.formulate("paper", "P3", perspective="battery").answers()
    >>> solution.values["hover_time_s"].round(2).tolist(), solution.status.value
    ([688.85], 'optimal')
    >>> {label: round(multiplier, 2) for label, multiplier in solution.multipliers_at(0).items()}
    {'P3.a state of charge': 819.02, 'P3.b hover time': 0.0}
    """

    engine: str
    proof: str
    declared: Model
    statuses: Sequence[Status]
    objective: Floats
    values: Mapping[str, Floats]
    tight: Sequence[Sequence[str]] | None = None
    duals: Sequence[Mapping[str, float]] | None = ()
    beyond: Floats | None = None
    words: Sequence[str] = ()
    given: Mapping[str, Number] = field(default_factory=dict)

    @cached_property
    def model(self) -> Model:
        """The declaration with the values of its parameters."""
        values = self.parameters_at(0) if len(self.statuses) == 1 else self.given
        return self.declared.with_values(values) if self.given else self.declared

    def __repr__(self) -> str:
        counts = Counter(status.value for status in self.statuses)
        counted = ", ".join(f"{count} {words}" for words, count in counts.items())
        if len(self.statuses) == 1:
            counted = f"{self.status.value}, objective {figure(self.objective[0])}"
        return f"<Solution by {self.engine}: {counted}>"

    def blocks(self) -> Iterator[Block]:
        """Yield the only answer with a row for each constraint; of several how many there are."""
        if len(self.statuses) != 1 or not self.status.has_answer:
            good = all(status.has_answer for status in self.statuses)
            yield Heading(repr(self).strip("<>"), good=good)
            symbols = (f"{x.symbol} [{x.unit}]" for x in self.declared.variables)
            heads = ("programme", "status", "objective", *symbols)
            columns = (self.objective, *(self.values[x.name] for x in self.declared.variables))
            rows = [
                (str(k), status.value, *(figure(float(column[k])) for column in columns))
                for k, status in enumerate(self.statuses)
            ]
            yield Fold(f"Programmes ({len(rows)})", [Table(heads, rows)], in_text=False)
            return
        verdict, reached = self._heads()
        yield Heading(verdict, good=True)
        rows = [
            (label, figure(slack), "–" if weight is None else figure(weight), binds)
            for label, slack, weight, binds in self._constraints()
        ]
        yield Table(
            HEADS, rows, last=1, longest=LONGEST_LABEL, above=reached, below=[self._lacks()]
        )

    def _heads(self) -> tuple[str, str]:
        """Status and values of the only answer."""
        values = [
            f"{x.symbol} = {with_unit(self.values[x.name][0], x.unit)}"
            for x in self.declared.variables
        ]
        reached = f"{self.declared.sense} {figure(self.objective[0])} at {', '.join(values)}"
        return f"{self.status.value} by {self.engine} ({self.proof})", reached

    def _lacks(self) -> str:
        """The residuals of the only answer."""
        residuals = self.residuals()._asdict().items()
        return ", ".join(f"{name} {figure(amount, 1)}" for name, amount in residuals)

    def _constraints(self, index: int = 0) -> list[tuple[str, float, float | None, str]]:
        """Label, slack as it is shown, multiplier if known, and if it binds, by constraint."""
        weights, binding = self.multipliers_at(index), self.binding_labels(index)
        rows = {label: float(without_rounding(x[index])) for label, x in self.slacks.items()}
        return [(n, x, weights.get(n), "binds" * (n in binding)) for n, x in rows.items()]

    def to_frame(self) -> DataFrame:
        """One row a constraint in each programme that has an answer; needs pandas.

        Returns
        -------
        DataFrame
            Columns ``programme`` (its number from 0), ``constraint``, ``slack`` in the constraint's
            unit, ``multiplier`` (None where the engine gives none) and ``binds``.
        """
        answered = (k for k, status in enumerate(self.statuses) if status.has_answer)
        rows = [(k, *row, bool(b)) for k in answered for *row, b in self._constraints(k)]
        return frame(rows, ["programme", "constraint", "slack", "multiplier", "binds"])

    @cached_property
    def second(self) -> Floats:
        """`change_by_step` of the objective in each programme, in the objective's unit."""
        goal, unknowns = self.declared.objective, self.declared.variables
        return np.full(
            self.objective.shape, change_by_step(goal, unknowns, {**self.given, **self.values})
        )

    @property
    def ties(self) -> Floats:
        """Difference to each objective that counts as none, in its unit: `SAME_S` of a time."""
        return np.maximum(SAME_S * self.second, ROUNDED_OBJECTIVE * np.abs(self.objective))

    def point(self, index: int) -> dict[str, float]:
        """Values of the variables in the answer to a programme; `SolverError` without one."""
        status = self.statuses[index]
        if not status.has_answer:
            raise SolverError(f"{self.engine} has no values: the programme is {status.value}")
        return {name: float(values[index]) for name, values in self.values.items()}

    def _at(self, index: int) -> dict[str, Operand]:
        """Values of parameters and variables in the answer to a programme."""
        return {**self.parameters_at(index), **self.point(index)}

    def refuse_unusable(self) -> None:
        """Raise `SolverError` where a programme has numbers that the engine cannot use."""
        if Status.ERROR in self.statuses:
            words = f"{self.engine} met numbers that it cannot use"
            at = self.parameters_at(self.statuses.index(Status.ERROR))
            raise SolverError(": ".join(filter(None, (words, unusable(self.declared, at)))))

    @property
    def status(self) -> Status:
        """Status of the only programme."""
        (status,) = self.statuses
        return status

    def parameters_at(self, index: int) -> dict[str, Number]:
        """Values of all parameters in a programme, by name."""
        values = {**{n: p.value for n, p in self.declared.given.items()}, **self.given}.items()
        return {name: value[index] if np.ndim(value) else value for name, value in values}

    def multipliers_at(self, index: int) -> dict[str, float]:
        """Multiplier of every constraint in the answer to a programme, by label.

        In units of the objective per unit of the constraint, ≥ 0; of an equality with the sign of
        the gain from one more unit of its right side. Empty without an answer or multipliers of the
        engine; computed where an engine with optimal answers gives none.
        """
        if not self.statuses[index].has_answer or self.duals is not None:
            return dict(*(self.duals or ())[index : index + 1])
        zeros = dict.fromkeys((relation.label for relation in relations(self.declared)), 0.0)
        return zeros | prices.local_multipliers(self.declared, self._at(index))

    def binding_labels(self, index: int, rows: Checks | None = None) -> tuple[str, ...]:
        """Labels of the constraints that bind in an answer, see `tight`; rows as of `verify`."""
        if self.tight is not None:
            return tuple(self.tight[index])
        if not self.statuses[index].has_answer:
            return ()
        if rows is None:
            rows = evaluated(self.declared, self._at(index))
        sizes = ((row, abs(float(row.slack)), abs(float(row.right))) for row in rows)
        near = (row for row, slack, right in sizes if slack <= TIGHT * max(1.0, right))
        binding = (row.label for row in near if has_unknowns(*row.constraint.relation.sides))
        return tuple(dict.fromkeys(binding))

    def verify(self, index: int = 0) -> Checks:
        """Evaluate an answer again, outside its engine; `SolverError` if it fails."""
        rows = evaluated(self.declared, self._at(index))
        broken = [
            f"{row.label} by {typed(float(-row.slack), 3)}" for row in rows if not row.satisfied
        ]
        if broken:
            raise SolverError(f"{self.engine} returned a point that violates {', '.join(broken)}")
        return rows

    @cached_property
    def slacks(self) -> Mapping[str, Floats]:
        """Slack of every constraint by label, in its own unit, one per programme.

        Negative where it is violated, NaN without an answer; of two bounds with one label the
        nearer one.
        """
        answered = np.array([status.has_answer for status in self.statuses])
        least_slacks: dict[str, Floats] = {}
        with np.errstate(invalid="ignore", over="ignore"):  # without an answer
            rows = evaluated(self.declared, {**self.given, **self.values})
        for row in rows:
            least = np.minimum(row.slack, least_slacks.get(row.label, np.inf))
            least_slacks[row.label] = np.where(answered, least, np.nan)
        return least_slacks

    def residuals(self, index: int = 0) -> Residuals:
        """Measure how far an answer is from feasibility and optimality.

        See `optuav.engines.prices.Residuals`.
        """
        return prices.residuals(self.declared, self._at(index), self.multipliers_at(index))

    def shadow_prices(self, index: int = 0) -> ShadowPrices:
        """Shadow price of every parameter in a programme, by name; see `ShadowPrice`.

        Empty without an answer, and in whole slots, which small changes do not move.
        """
        has_duals = self.duals is None or any(self.duals[index : index + 1])
        if not has_duals or not self.statuses[index].has_answer:
            return ShadowPrices({}, {})
        # Where the optimum is flat, exact times too meet a row by less than all their digits.
        shares = (prices.MET, prices.NEARLY_MET) if self.duals is None else (prices.NEARLY_MET,)
        at = self.declared, self.parameters_at(index), self.point(index)
        return prices.shadow_prices(*at, shares)

    def only(self, index: int) -> "Solution":
        """The solution to a single programme."""
        one = slice(index, index + 1)
        return replace(
            self,
            statuses=[self.statuses[index]],
            objective=self.objective[one],
            values={name: value[one] for name, value in self.values.items()},
            tight=self.tight and self.tight[one],
            duals=self.duals and self.duals[one],
            beyond=None if self.beyond is None else self.beyond[one],
            words=self.words[one],
            given=self.parameters_at(index),
        )


def returned(
    answer: object, engine: str, model: Model, programmes: int, values: Values | None = None
) -> Solution:
    """Return the solution of an engine from outside, with the objective that its values have.

    `SolverError` if it is not a solution to that many programmes of the model.
    """
    if not isinstance(answer, Solution):
        raise SolverError(f"engine {engine} returned {answer!r:.60}, not a Solution")
    statuses, points, wrong = list(answer.statuses), dict[str, Floats](), list[str]()
    if len(statuses) != programmes or not all(isinstance(status, Status) for status in statuses):
        wrong.append(f"statuses must be {programmes} of optuav's Status")
    for name in (variable.name for variable in model.variables):
        points[name] = np.asarray(answer.values.get(name), dtype=object)
        if points[name].shape != (programmes,):
            wrong.append(f"values[{name!r}] must be {programmes} numbers")
    if wrong:
        raise SolverError(f"engine {engine} returned no answers to the model: {', '.join(wrong)}")
    points = {name: point.astype(float) for name, point in points.items()}
    reached = evaluate(model.objective, {**(values or {}), **points})
    answered = np.array([status.has_answer for status in statuses])
    objective = np.where(answered, reached, np.nan)
    if not np.isfinite(objective[answered]).all():
        raise SolverError(f"engine {engine} returned values that are not numbers as an answer")
    return replace(answer, engine=engine, statuses=statuses, values=points, objective=objective)


def single(
    model: Model,
    engine: str,
    parameters: Values,
    status: Status,
    proof: str,
    words: str = "",
    point: Mapping[str, float] | None = None,
    *,
    tight: Sequence[str] | None = None,
    duals: Mapping[str, float] | None = None,
) -> Solution:
    """A solution to one programme from numbers; without a point it has no values."""
    values = point or dict.fromkeys((variable.name for variable in model.variables), np.nan)
    reached = evaluate(model.objective, {**parameters, **point}) if point else np.nan
    return Solution(
        engine,
        proof,
        model,
        [status],
        np.array([reached], float),
        {name: np.array([value]) for name, value in values.items()},
        None if tight is None else [tight],
        [duals or {}],
        words=[words],
        given={name: np.array([value]) for name, value in parameters.items()},
    )


def without_solver(model: Model, engine: str, parameters: Values) -> Solution | None:
    """The solution to one programme that numbers decide without a search; else None."""
    solution = partial(single, model, engine, parameters)
    if not np.isfinite([float(parameters[name]) for name in model.given]).all():
        return solution(Status.ERROR, "evaluated", "a parameter is not a number")
    if any(lower > upper for lower, upper in own_bounds(model, parameters).values()):
        return solution(Status.INFEASIBLE, "bounds contradict", "bounds of an unknown contradict")
    settled = [row for row in model.constraints if not has_unknowns(*row.relation.sides)]
    if broken := [row.label for row in evaluated(settled, parameters) if not row.satisfied]:
        words = f"does not hold for all values of the unknowns: {', '.join(broken)}"
        return solution(Status.INFEASIBLE, "evaluated", words)
    return None


def concatenated(solutions: Sequence[Solution]) -> Solution:
    """Solutions to single programmes of one model as one, with the proof of those that answer."""
    first = next((solution for solution in solutions if solution.status.has_answer), solutions[0])

    def listed(name: str) -> list[Any] | None:
        """Entries of all solutions; None if they follow from the answers."""
        if getattr(first, name) is None:
            return None
        return [*chain(*(getattr(solution, name) or () for solution in solutions))]

    joined: dict[str, Any] = {k: listed(k) for k in ("statuses", "tight", "duals", "words")}
    for name, columns in (("values", first.values), ("given", first.given)):
        tables = [getattr(solution, name) for solution in solutions]
        joined[name] = {k: np.concatenate([table[k] for table in tables]) for k in columns}
    objective = np.concatenate([solution.objective for solution in solutions])
    return replace(first, objective=objective, **joined)
