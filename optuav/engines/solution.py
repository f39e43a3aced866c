"""What every engine returns."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from optuav.errors import SolverError
from optuav.modelling.check import check
from optuav.modelling.model import Model
from optuav.status import Status as Status  # noqa: PLC0414

Floats = npt.NDArray[np.float64]
Booleans = npt.NDArray[np.bool_]


class ShadowPrice(NamedTuple):
    """Change of the best objective per unit of a parameter, the others held.

    Parameters
    ----------
    less, more
        One-sided derivatives: per unit that is taken away, and per unit that is added. They are
        equal but at a kink, as where another constraint takes over; infinite where that side is
        infeasible.
    """

    less: float
    more: float

    @property
    def has_kink(self) -> bool:
        """Whether the two sides differ."""
        return not math.isclose(self.less, self.more, rel_tol=1e-6, abs_tol=1e-9)


@dataclass(frozen=True)
class Solution:
    """Answers to one or several programmes that were declared as one.

    Parameters
    ----------
    engine
        Name of the engine.
    proof
        How it knows, in a word or two.
    statuses
        One `Status` a programme.
    objective
        Objective values, one a programme; NaN without an answer.
    values
        Values of the variables by name, one a programme; NaN without an answer.
    binding
        By label of a constraint, whether it holds with equality at the answer, one a programme.
    multipliers
        By label of a constraint, its multiplier: seconds of objective per unit of the constraint,
        ≥ 0, one a programme. Empty from engines that have none.
        That of an equality has the sign of what one more unit of its right side brings.
    regular
        Whether point and multipliers are known to be the only optimal ones, one a programme.
    beyond
        What the objective is known not to exceed, one a programme; from engines that bracket it.
    words
        What the engine itself said, one a programme.
    model, given
        The declaration that was solved, and the values of parameters that differed from it.
    """

    engine: str
    proof: str
    statuses: Sequence[Status]
    objective: Floats
    values: Mapping[str, Floats]
    binding: Mapping[str, Booleans]
    multipliers: Mapping[str, Floats] = field(default_factory=dict)
    regular: Booleans | None = None
    beyond: Floats | None = None
    words: Sequence[str] = ()
    model: Model | None = None
    given: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        counts = Counter(status.value for status in self.statuses)
        said = ", ".join(f"{count} {words}" for words, count in counts.items())
        if len(self.statuses) == 1:
            said = f"{self.status.value}, objective {self.objective[0]:.6g}"
        return f"<Solution by {self.engine}: {said}>"

    def point(self, index: int) -> dict[str, float]:
        """Values of the variables in the answer to a programme.

        Raises
        ------
        SolverError
            If that programme has no answer.
        """
        status = self.statuses[index]
        if not status.has_answer:
            raise SolverError(f"{self.engine} has no values: the programme is {status.value}")
        return {name: float(values[index]) for name, values in self.values.items()}

    def only(self, index: int) -> Solution:
        """The solution to a single programme, cut out."""
        one = slice(index, index + 1)
        return replace(
            self,
            statuses=[self.statuses[index]],
            objective=self.objective[one],
            values={name: each[one] for name, each in self.values.items()},
            binding={label: each[one] for label, each in self.binding.items()},
            multipliers={label: each[one] for label, each in self.multipliers.items()},
            regular=None if self.regular is None else self.regular[one],
            beyond=None if self.beyond is None else self.beyond[one],
            words=self.words[one],
            given={**(self.model.row(index) if self.model else {}), **self.given_at(index)},
        )

    @property
    def status(self) -> Status:
        """Status of the only programme."""
        (status,) = self.statuses
        return status

    def binding_labels(self, index: int) -> tuple[str, ...]:
        """Labels of the constraints that hold with equality in the answer to a programme."""
        return tuple(label for label, binds in self.binding.items() if binds[index])

    def shadow_prices(self, index: int = 0) -> dict[str, ShadowPrice]:
        """Shadow price of every parameter in a programme, by name; see `ShadowPrice`.

        Empty for an answer in whole slots, which small changes leave where it is, and where there
        is no answer.
        """
        from optuav.engines.sensitivity import shadow_prices

        return shadow_prices(self, index)

    def given_at(self, index: int) -> dict[str, Any]:
        """Values of the parameters of a programme that differed from the model's."""
        return {n: value[index] if np.ndim(value) else value for n, value in self.given.items()}

    def multipliers_at(self, index: int) -> dict[str, float]:
        """Multipliers of the constraints in the answer to a programme."""
        return {label: float(values[index]) for label, values in self.multipliers.items()}


def verify(model: Model, solution: Solution, index: int) -> None:
    """Evaluate an answer again, outside the engine that gave it.

    Raises
    ------
    SolverError
        If the answer violates a constraint.
    """
    values = {**model.row(index), **solution.given_at(index), **solution.point(index)}
    rows = check(model, values)
    broken = [f"{row.label} by {-row.slack:.3g}" for row in rows if not row.satisfied]
    if broken:
        raise SolverError(f"{solution.engine} returned a point that violates {', '.join(broken)}")


def unanswered(model: Model, engine: str, proof: str, status: Status, words: str) -> Solution:
    """A solution to one programme that has no values."""
    nothing = np.array([np.nan])
    return Solution(
        engine,
        proof,
        [status],
        nothing,
        {variable.name: nothing for variable in model.variables},
        {},
        words=[words],
        model=model,
    )


def stacked(solutions: Sequence[Solution]) -> Solution:
    """Solutions to single programmes of one model as one."""
    first = solutions[0]
    labels = dict.fromkeys(label for each in solutions for label in each.binding)
    priced = dict.fromkeys(label for each in solutions for label in each.multipliers)
    stated = dict.fromkeys(name for each in solutions for name in each.given)
    no, none = np.array([False]), np.array([np.nan])
    return Solution(
        first.engine,
        first.proof,
        [status for each in solutions for status in each.statuses],
        np.concatenate([each.objective for each in solutions]),
        {name: np.concatenate([each.values[name] for each in solutions]) for name in first.values},
        {k: np.concatenate([each.binding.get(k, no) for each in solutions]) for k in labels},
        {k: np.concatenate([each.multipliers.get(k, none) for each in solutions]) for k in priced},
        words=[words for each in solutions for words in each.words],
        model=first.model,
        given={k: np.concatenate([each.given.get(k, none) for each in solutions]) for k in stated},
    )
