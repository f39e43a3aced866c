"""The longest time that nonlinear constraints of battery wells admit, bracketed: a proof.

Takes models that look for the largest of at most two times, with constraints of the form that
phases of constant current give (see `exponential_form`), linear ones among them. The answer comes
with a time beyond which there is none; see `bracketing`, and `tapered` where charging tapers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.bracketing import Interval, largest, shortest
from optuav.engines.exponential_form import Rows, StatedForm, rows_of, stated_forms
from optuav.engines.solution import Solution
from optuav.engines.tapered import Tapered
from optuav.errors import InputError
from optuav.modelling.check import evaluated, relations
from optuav.modelling.expression import Leaf, Variable
from optuav.modelling.kibam_form import CONSTANT, Exponential, Monomial
from optuav.modelling.model import Model
from optuav.modelling.traversal import fold
from optuav.status import Status

NAME = "bracket"
PROOF = "bracketed: a feasible time, and proof that none is longer"
PROOF_OF_NONE = "bracketed: proof that no times satisfy all constraints"
UNDECIDED = "found neither a time nor proof that there is none"
TIGHT = 1e-7
"""Slack below which a constraint counts as binding, relative to max(1, |right side|)."""

STATUSES = np.array(
    [Status.OPTIMAL, Status.FEASIBLE, Status.INFEASIBLE, Status.ERROR], dtype=object
)
OPTIMAL, FEASIBLE, INFEASIBLE, ERROR = range(4)


def solve(model: Model, programmes: int, values: Mapping[str, Any] | None = None) -> Solution:
    """Bracket the longest time for every entry of the parameters.

    Parameters
    ----------
    model
        The objective is one unknown, to be maximised; at most one other; both from 0.
    programmes
        Number of entries of those parameters that are arrays, at least 1.
    values
        Values of parameters that differ from the model's, by name.

    Returns
    -------
    A `Solution` whose `beyond` tells what no answer exceeds. Status feasible where that is farther
    than `bracketing.WIDTH_S` from the answer; error where not even that is known, or a number is
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
        binding=_binding(model, {**given, **points}, answered),
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
            raise InputError(f"engine {NAME} needs a linear constraint that bounds {name}")
    usable = np.asarray(~np.isnan(tops).any(axis=0))
    x_top, y_top = (np.where(usable, each, 0.0) for each in (*tops, np.zeros(programmes))[:2])
    return (x_top, y_top), usable


def _rows(forms: Iterable[StatedForm], names: Sequence[str], tops: tuple[Floats, Floats]) -> Rows:
    """Forms as rows in one or two times."""
    x, *others = names
    kept = list(forms)
    stated, sizes = [each.form for each in kept], [each.size for each in kept]
    return rows_of(stated, sizes, x, next(iter(others), None), len(tops[0]), np.maximum(*tops))


def _tapered(
    model: Model,
    given: Mapping[str, Any],
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


def some_point(
    model: Model, programmes: int, values: Mapping[str, Any] | None = None
) -> dict[str, Floats]:
    """Times that satisfy all constraints, NaN where none are known; parameters as for `solve`.

    What is sought does not matter, nor how the times compare with others.
    """
    names, found, usable = _any_point(model, programmes, values)
    times = (np.where(usable, each, np.nan) for each in (found.x, found.y))
    return dict(zip(names, times, strict=False))


def no_point(model: Model, programmes: int, values: Mapping[str, Any] | None = None) -> Booleans:
    """Where it is proved that no times satisfy all constraints; parameters as for `solve`."""
    _, found, usable = _any_point(model, programmes, values)
    return usable & np.isneginf(found.beyond)


def _any_point(
    model: Model, programmes: int, values: Mapping[str, Any] | None
) -> tuple[list[str], Interval, Booleans]:
    """Names of the times, what is known of them, and where the figures are numbers."""
    names = [each.name for each in model.variables]
    forms = stated_forms(model, values or {})
    tops, usable = _reaches(forms, names, programmes)
    rows = _rows(forms, names, tops)
    return names, largest(rows, *tops, any_point=True), usable & rows.usable


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


def _binding(model: Model, values: Mapping[str, Any], answered: Booleans) -> dict[str, Booleans]:
    """Which constraints of the unknowns hold with equality, by label."""
    found: dict[str, Booleans] = {}
    done: dict[int, Any] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    for each, row in zip(stated, evaluated(model, values), strict=True):
        sides = each.relation.sides
        if not any(fold(side, _is_unknown, _any, done=done) is True for side in sides):
            continue
        tight = answered & (np.abs(row.slack) <= TIGHT * np.maximum(1.0, np.abs(row.right)))
        found[row.label] = found[row.label] | tight if row.label in found else tight
    return found


def _is_unknown(leaf: Leaf) -> bool:
    return isinstance(leaf, Variable)


def _any(_: np.ufunc, arguments: tuple[Any, ...]) -> bool:
    return any(each is True for each in arguments)
