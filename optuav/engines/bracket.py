"""The longest time that limits of battery wells admit, bracketed by a point and a proof.

Takes models that maximise one of at most two times, with constraints of the form that phases of
constant current give (see `rows`), linear ones among them. The answer comes with a time that no
answer exceeds; `largest` says how.

Where charging tapers, wells hold no more than at constant current throughout, past full too, and
than when full: what no time exceeds then, none exceeds here. Three answers are tried, all evaluated
with the taper: the longest time under that bound, the longest along the largest other time, and the
longest for which the available well is never past full.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines.largest import WIDTH_S, Interval, largest, shortest
from optuav.engines.registry import Engine, capability
from optuav.engines.rows import Rows, StatedForm, close_in, rows_of, stated_forms
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.modelling.check import slack
from optuav.modelling.expression import Operand
from optuav.modelling.forms import CONSTANT, Monomial
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate
from optuav.status import Status

ROUNDING = 1e-11
"""By how much a constraint must be missed to fail, relative to max(1, |right side|)."""
NAME = "bracket"
PROOF = "bracketed: a feasible time, and proof that none is longer"
PROOF_OF_NONE = "bracketed: proof that no times satisfy all constraints"
UNDECIDED = "found neither a time nor proof that there is none"


def solve(
    model: Model, programmes: int, values: Values | None = None, **limits: float | None
) -> Solution:
    """Bracket the longest time of every programme; arguments as of `registry.Engine.solve`.

    The objective is one unknown, to be maximised; there is at most one other; both are from 0. The
    solution's `beyond` is what no answer exceeds: the status is feasible where that is farther than
    `largest.WIDTH_S` from the answer, and error where not even that is known, or a number is NaN.

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
    rows = _rows([each for each in forms if each.constraint], names, tops)
    usable &= ~np.isnan(rows.weights).any(axis=(0, 1))
    if tapers := any(each.relaxed for each in forms):
        found = _tapered(model, given, forms, names, tops)
    else:
        found = largest(rows, *tops)
        found = found._replace(y=shortest(rows, found, tops[1]))
    found_out = np.select(
        [~usable, np.isneginf(found.beyond), np.isnan(found.x), ~found.proved],
        [Status.ERROR, Status.INFEASIBLE, Status.ERROR, Status.FEASIBLE],
        Status.OPTIMAL,
    )
    answered = usable & ~np.isneginf(found.beyond) & ~np.isnan(found.x)
    points = {
        name: np.where(answered, each, np.nan)
        for name, each in zip(names, (found.x, found.y), strict=False)
    }
    undecided = usable & ~answered & ~np.isneginf(found.beyond)
    return Solution(
        engine=NAME,
        proof=PROOF if answered.any() else PROOF_OF_NONE,
        statuses=[Status(each) for each in found_out.tolist()],
        objective=points[names[0]] + 0.0,
        values={each.name: points[each.name] for each in model.variables},
        tight=None,
        duals=() if tapers else None,
        beyond=np.where(usable, found.beyond, np.nan),
        words=[UNDECIDED if each else "" for each in undecided],
        model=model,
        given=given,
    )


def _reaches(
    forms: Sequence[StatedForm], names: Sequence[str], programmes: int
) -> tuple[Floats, Booleans]:
    """How far both times can go [s], the second 0 where there is but one, and where that is known.

    By the constraints that are linear and only shorten times.
    """
    tops = np.zeros((2, programmes))
    for k, name in enumerate(names):
        tops[k] = np.inf
        own: Monomial = frozenset({(name, "time")})
        for form, *_ in forms:
            slopes = {each: c for each, c in form.terms.items() if each != CONSTANT}
            if form.rates_per_s or not all(np.all(c <= 0.0) for c in slopes.values()):
                continue
            least = np.maximum(form.terms.get(CONSTANT, 0.0), 0.0)
            slope = slopes.get(own, 0.0)
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                tops[k] = np.minimum(tops[k], np.where(slope < 0.0, least / -slope, np.inf))
        if np.isinf(tops[k]).any():
            raise InputError(
                f"engine {NAME} needs a linear constraint that bounds {name}: "
                "given.keep_deadline states the deadline"
            )
    usable = np.asarray(~np.isnan(tops).any(axis=0))
    return np.where(usable, tops, 0.0), usable


def _rows(forms: Sequence[StatedForm], names: Sequence[str], tops: Floats) -> Rows:
    """Forms as rows in one or two times."""
    x, y = (*names, None)[:2]
    assert x is not None
    return rows_of(forms, x, y, tops.shape[1], tops.max(axis=0))


def _tapered(
    model: Model, given: Values, forms: Sequence[StatedForm], names: Sequence[str], tops: Floats
) -> Interval:
    """The best of three points with the taper, with the smallest y found, and the bound above.

    The bound is that of all rows at constant current (`relaxed`); `never_full` say, besides, that
    the available well is never past full; the `others` are of constraints without a taper.
    """
    tapered = dict.fromkeys(each.constraint for each in forms if each.relaxed and each.constraint)
    values = {name: each.value for name, each in model.given.items()} | {**given}

    def margin(x: Floats, y: Floats, which: Integers) -> Floats:
        """How far the constraints hold, with the taper, at points of some programmes."""
        at = {name: v[which] if np.ndim(v) else v for name, v in values.items()}
        at |= dict(zip(names, (x, y), strict=False))
        least, done = np.full(np.shape(x), np.inf), dict[int, Operand]()
        with np.errstate(invalid="ignore"):  # where there is no point
            for each in tapered:
                left, right = (evaluate(side, at, done) for side in each.relation.sides)
                share = slack(each.relation.sense, left, right) / np.maximum(1.0, np.abs(right))
                least = np.minimum(least, share + ROUNDING)
        return least

    others = _rows([each for each in forms if not each.relaxed], names, tops)
    relaxed = _rows([each for each in forms if each.constraint], names, tops)
    bound = largest(relaxed, *tops)

    def most(x: Floats, which: Integers) -> Floats:
        """Largest y that the other rows admit."""
        return others.take(which).at_x(x).end(tops[1][which])

    along, _ = close_in(
        lambda x, which: margin(x, most(x, which), which), 0.0 * bound.x, bound.x, WIDTH_S
    )
    x, y, every = np.full_like(along, np.nan), np.full_like(along, np.nan), np.arange(len(along))
    never_full = largest(_rows(forms, names, tops), *tops)
    for tried in ((bound.x, bound.y), (along, most(along, every)), (never_full.x, never_full.y)):
        better = (margin(*tried, every) >= 0.0) & ~(tried[0] <= x)
        x, y = np.where(better, tried, (x, y))
    found = Interval(x, y, bound.beyond)
    y, _ = close_in(
        lambda y, which: margin(x[which], y, which), y, shortest(relaxed, found, tops[1]), WIDTH_S
    )
    return found._replace(y=y)


def some_point(
    model: Model, programmes: int, values: Values | None = None
) -> tuple[dict[str, Floats], Booleans]:
    """Times that satisfy all constraints, NaN where none are known, and where it is proved none do.

    Parameters as for `solve`. What is sought does not matter, nor how the times compare.
    """
    names = [each.name for each in model.variables]
    forms = stated_forms(model, values or {})
    tops, usable = _reaches(forms, names, programmes)
    rows = _rows(forms, names, tops)
    usable &= ~np.isnan(rows.weights).any(axis=(0, 1))
    found = largest(rows, *tops, any_point=True)
    times = (np.where(usable, each, np.nan) for each in (found.x, found.y))
    return dict(zip(names, times, strict=False)), usable & np.isneginf(found.beyond)


@dataclass(frozen=True)
class Bracket(Engine):
    """The engine of the longest time that limits of battery wells admit.

    Examples
    --------
    >>> import optuav
    >>> from optuav.engines.bracket import Bracket
    >>> plan = optuav.solve("paper", "P3", engine=Bracket(), perspective="available")
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    577.524 s, optimal
    """

    name = NAME
    takes = capability(NAME)
    solve = staticmethod(solve)
