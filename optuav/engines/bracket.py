"""The longest time that limits of battery wells admit, bracketed by a point and a proof.

Takes models that maximise one of at most two times, with constraints of the form that phases of
constant current give (see `rows`), linear ones among them. The answer comes with a time that no
answer exceeds; `bracketing` says how.

Where charging tapers, wells hold no more than at constant current throughout, past full too, and
than when full: what no time exceeds then, none exceeds here. Three answers are tried, all evaluated
with the taper: the longest time under that bound, the longest along the largest other time, and the
longest for which the available well is never past full.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines.bracketing import WIDTH_S, Interval, largest, shortest
from optuav.engines.registry import Capability, Direct, capability
from optuav.engines.rows import (
    Margin,
    Rows,
    Section,
    Selection,
    StatedForm,
    close_in,
    rows_of,
    stated_forms,
)
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.modelling.check import slack
from optuav.modelling.expression import Operand
from optuav.modelling.kibam_form import CONSTANT, Exponential, Monomial
from optuav.modelling.model import Constraint, Model
from optuav.modelling.traversal import evaluate
from optuav.status import Status

ROUNDING = 1e-11
"""By how much a constraint must be missed to fail, relative to max(1, |right side|)."""


@dataclass(frozen=True)
class Tapered:
    """The constraints that charging with a taper changes, and the rows of the `others`.

    Values of all parameters by name; names of the objective x and of the other time y, if there is
    one. Beyond the tops [s], one a programme, the rows do not hold.
    """

    constraints: Sequence[Constraint]
    values: Values
    names: Sequence[str]
    others: Rows
    x_top: Floats
    y_top: Floats

    def best(self, relaxed: Rows, never_full: Rows) -> Interval:
        """The best point known, with the smallest y that was found for it, and the bound above.

        `relaxed` are all rows, at constant current; `never_full` say, besides, that the available
        well is never past full.
        """
        bound = largest(relaxed, self.x_top, self.y_top)
        x, y = np.full_like(bound.x, np.nan), np.full_like(bound.x, np.nan)
        tried = (
            (bound, relaxed),
            (self._along_largest(bound.x), relaxed),
            (largest(never_full, self.x_top, self.y_top), never_full),
        )
        for each, its_rows in tried:
            better = ~np.isnan(each.x) & ~(each.x <= x)
            better &= self._margin(each.x, each.y, np.arange(len(x))) >= 0.0
            shorter = self._shortest(each, shortest(its_rows, each, self.y_top))
            x, y = np.where(better, each.x, x), np.where(better, shorter, y)
        return Interval(x, y, bound.beyond)

    def _along_largest(self, ends: Floats) -> Interval:
        """Points with the largest y that the other rows admit at which all constraints hold."""
        known = np.flatnonzero(~np.isnan(ends))

        def ceiling(x: Floats, which: Integers) -> Floats:
            if len(self.names) == 1:
                return np.zeros_like(x)
            return Section.at_x(self.others.take(which), x).largest(self.y_top[which])

        def margins(some: Selection) -> Margin:
            which = known[some]

            def margin(x: Floats) -> Floats:
                y = ceiling(x, which)
                return np.where(np.isnan(y), -1.0, self._margin(x, np.nan_to_num(y), which))

            return margin

        low, high = np.zeros(len(known)), ends[known]
        margin = margins(slice(None))
        at_low, at_high = margin(low), margin(high)
        inside = np.flatnonzero((at_low >= 0.0) & (at_high < 0.0))
        found = np.where(at_high >= 0.0, high, np.nan)
        if len(inside):
            holds, fails = (low[inside], at_low[inside]), (high[inside], at_high[inside])
            found[inside], _ = close_in(lambda some: margins(inside[some]), holds, fails, WIDTH_S)
        x, y = np.full_like(ends, np.nan), np.full_like(ends, np.nan)
        x[known], y[known] = found, ceiling(found, known)
        return Interval(x, y, ends)

    def _shortest(self, found: Interval, least_s: Floats) -> Floats:
        """Smallest y between a least one and one that holds, for the x of each programme."""
        y = least_s.copy()
        known = np.flatnonzero(~np.isnan(found.x))
        at_least = self._margin(found.x, least_s, np.arange(len(y)))
        at_found = self._margin(found.x, found.y, np.arange(len(y)))
        short = known[(at_least[known] < 0.0) & (at_found[known] >= 0.0)]
        if len(short):

            def margins(some: Selection) -> Margin:
                which = short[some]
                return lambda at: self._margin(found.x[which], at, which)

            holds, fails = (found.y[short], at_found[short]), (y[short], at_least[short])
            y[short], _ = close_in(margins, holds, fails, WIDTH_S)
        return y

    def _margin(self, x: Floats, y: Floats, which: Integers) -> Floats:
        """How far the constraints hold, with the taper, at points of some programmes."""
        given = {name: v[which] if np.ndim(v) else v for name, v in self.values.items()}
        given |= dict(zip(self.names, (x, y), strict=False))
        least, done = np.full(np.shape(x), np.inf), dict[int, Operand]()
        with np.errstate(invalid="ignore"):  # where there is no point
            for each in self.constraints:
                left, right = (evaluate(side, given, done) for side in each.relation.sides)
                share = slack(each.relation.sense, left, right) / np.maximum(1.0, np.abs(right))
                least = np.minimum(least, share + ROUNDING)
        return least


NAME = "bracket"
PROOF = "bracketed: a feasible time, and proof that none is longer"
PROOF_OF_NONE = "bracketed: proof that no times satisfy all constraints"
UNDECIDED = "found neither a time nor proof that there is none"

STATUSES = np.array(
    [Status.OPTIMAL, Status.FEASIBLE, Status.INFEASIBLE, Status.ERROR], dtype=object
)
OPTIMAL, FEASIBLE, INFEASIBLE, ERROR = range(4)


def solve(
    model: Model,
    programmes: int,
    values: Values | None = None,
    *,
    slot_s: float | None = None,
    time_limit_s: float | None = None,
) -> Solution:
    """Bracket the longest time of every programme; arguments as of `registry.Engine.solve`.

    The objective is one unknown, to be maximised; there is at most one other; both are from 0. The
    solution's `beyond` is what no answer exceeds: the status is feasible where that is farther than
    `bracketing.WIDTH_S` from the answer, and error where not even that is known, or a number is
    NaN.

    Raises
    ------
    InputError
        If no linear constraint bounds an unknown.
    NotExponentialError
        If a constraint has another form.
    """
    given = values or {}
    names = sorted((each.name for each in model.variables), key=model.objective.name.__ne__)
    forms = stated_forms(model, given, relaxed=True)
    tops, usable = _reaches(forms, names, programmes)
    rows = _rows((each for each in forms if each.constraint), names, tops)
    usable &= rows.usable
    if tapers := any(each.relaxed for each in forms):
        found = _tapered(model, given, forms, names, tops)
    else:
        found = largest(rows, *tops)
        found = found._replace(y=shortest(rows, found, tops[1]))
    codes = np.select(
        [~usable, np.isneginf(found.beyond), np.isnan(found.x), ~found.proved],
        [ERROR, INFEASIBLE, ERROR, FEASIBLE],
        OPTIMAL,
    )
    answered = (codes == OPTIMAL) | (codes == FEASIBLE)
    points = {
        name: np.where(answered, each, np.nan)
        for name, each in zip(names, (found.x, found.y), strict=False)
    }
    return Solution(
        engine=NAME,
        proof=PROOF if answered.any() else PROOF_OF_NONE,
        statuses=STATUSES[codes].tolist(),
        objective=points[names[0]] + 0.0,
        values={each.name: points[each.name] for each in model.variables},
        tight=None,
        duals={} if tapers else None,
        beyond=np.where(usable, found.beyond, np.nan),
        words=[UNDECIDED if each else "" for each in usable & (codes == ERROR)],
        model=model,
        given=given,
    )


def _reaches(
    forms: Sequence[StatedForm], names: Sequence[str], programmes: int
) -> tuple[tuple[Floats, Floats], Booleans]:
    """How far both times can go [s], the second 0 where there is but one, and where that is known.

    Raises
    ------
    InputError
        If no linear constraint bounds an unknown.
    """
    tops = [_top([each.form for each in forms], name, programmes) for name in names]
    for name, top in zip(names, tops, strict=True):
        if np.isinf(top).any():
            raise InputError(
                f"engine {NAME} needs a linear constraint that bounds {name}: "
                "given.keep_deadline states the deadline"
            )
    usable = np.asarray(~np.isnan(tops).any(axis=0))
    x_top, y_top = (np.where(usable, each, 0.0) for each in (*tops, np.zeros(programmes))[:2])
    return (x_top, y_top), usable


def _rows(forms: Iterable[StatedForm], names: Sequence[str], tops: tuple[Floats, Floats]) -> Rows:
    """Forms as rows in one or two times."""
    x, *others = names
    kept = list(forms)
    stated, sizes = [each.form for each in kept], [each.size for each in kept]
    rows = rows_of(stated, sizes, x, next(iter(others), None), len(tops[0]), np.maximum(*tops))
    return rows.without_implied(*tops)


def _tapered(
    model: Model,
    given: Values,
    forms: Sequence[StatedForm],
    names: Sequence[str],
    tops: tuple[Floats, Floats],
) -> Interval:
    """What is known of the longest time where charging tapers."""
    constraints = dict.fromkeys(each.constraint for each in forms if each.relaxed)
    values = {name: each.value for name, each in model.given.items()} | {**given}
    exact = [each for each in forms if not each.relaxed]
    relaxed = [each for each in forms if each.constraint is not None]
    tapered = Tapered(
        [each for each in constraints if each], values, names, _rows(exact, names, tops), *tops
    )
    return tapered.best(_rows(relaxed, names, tops), _rows(forms, names, tops))


def some_point(model: Model, programmes: int, values: Values | None = None) -> dict[str, Floats]:
    """Times that satisfy all constraints, NaN where none are known; parameters as for `solve`.

    What is sought does not matter, nor how the times compare with others.
    """
    found, usable = _any_point(model, programmes, values)
    times = (np.where(usable, each, np.nan) for each in (found.x, found.y))
    return dict(zip([each.name for each in model.variables], times, strict=False))


def no_point(model: Model, programmes: int, values: Values | None = None) -> Booleans:
    """Where it is proved that no times satisfy all constraints; parameters as for `solve`."""
    found, usable = _any_point(model, programmes, values)
    return usable & np.isneginf(found.beyond)


def _any_point(model: Model, programmes: int, values: Values | None) -> tuple[Interval, Booleans]:
    """What is known of the times, and where the figures are numbers."""
    names = [each.name for each in model.variables]
    forms = stated_forms(model, values or {})
    tops, usable = _reaches(forms, names, programmes)
    rows = _rows(forms, names, tops)
    return largest(rows, *tops, any_point=True), usable & rows.usable


def _top(forms: Sequence[Exponential], name: str, programmes: int) -> Floats:
    """Longest that a time can be [s], by the constraints that are linear and only shorten times."""
    own: Monomial = frozenset({(name, "time")})
    top = np.full(programmes, np.inf)
    for form in forms:
        slopes = {each: c for each, c in form.terms.items() if each != CONSTANT}
        if (
            own in slopes
            and not form.rates_per_s
            and all(np.all(c <= 0.0) for c in slopes.values())
        ):
            least = np.maximum(form.terms.get(CONSTANT, 0.0), 0.0)
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                top = np.minimum(top, np.where(slopes[own] < 0.0, least / -slopes[own], np.inf))
    return top


@dataclass(frozen=True)
class Bracket(Direct):
    """The engine of the longest time that limits of battery wells admit.

    Examples
    --------
    >>> import optuav
    >>> from optuav.engines.bracket import Bracket
    >>> plan = optuav.solve("paper", "P3", engine=Bracket(), perspective="available")
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    577.524 s, optimal
    """

    name: ClassVar[str] = NAME
    takes: ClassVar[Capability] = capability(NAME)
    solve = staticmethod(solve)
