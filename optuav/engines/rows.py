"""Rows g(x, y) ≥ 0 in two times and how wells level out in them, for many programmes at once.

With V = (1 − exp(−kx))/k and W = (1 − exp(−ky))/k a row is g = a + b x + c V + d y + e W + f V W:
what phases of constant current do to the wells of a battery, and what a deadline does to the
times. In x alone and in y alone, g turns at most once; so it has at most two roots.

References
----------
.. [1] T. R. Chandrupatla, "A new hybrid quadratic/bisection algorithm for finding the zero of a
   nonlinear function without using derivatives", Advances in Engineering Software, 1997.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.modelling.check import TOLERANCE, relations
from optuav.modelling.expression import Operand
from optuav.modelling.kibam_form import (
    CONSTANT,
    Exponential,
    Monomial,
    NotExponentialError,
    Relaxation,
    applied,
    exponential,
)
from optuav.modelling.model import Constraint, Model

Margin: TypeAlias = Callable[[Floats], Floats]
"""Values at one point of each interval."""
Selection: TypeAlias = Integers | slice
"""Some programmes or intervals, by their numbers or a slice."""
Margins: TypeAlias = Callable[[Selection], Margin]
"""The margin of some of the intervals."""
Ends: TypeAlias = tuple[Floats, Floats]
"""A point of each interval, and the margins there."""

MOST_STEPS = 200


@np.errstate(divide="ignore", invalid="ignore")
def close_in(margins: Margins, holds: Ends, fails: Ends, width: float) -> tuple[Floats, Floats]:
    """Neighbours at most a width apart, of which one holds (margin ≥ 0) and the other does not.

    The ends hold and fail, in either order, with the margins there. Inverse quadratic interpolation
    where three points allow it, else halving: [1]_. What is found of an interval does not depend on
    the others.
    """
    (x1, f1), (x2, f2) = holds, fails
    held, failed = x1.copy(), x2.copy()
    number, open_ = np.arange(len(x1)), np.ones(len(x1), bool)
    margin = margins(slice(None))
    x3, f3 = x2, f2
    for step in range(MOST_STEPS):
        span = x2 - x1
        size = np.abs(span)
        wide = size > width
        if (done := open_ & ~wide).any():
            _store(held, failed, number, done, x1, x2, f1)
        open_ = wide
        count = np.count_nonzero(wide)
        if not count:
            break
        if 2 * count < len(wide):  # until then, those that are done go along, to no effect
            number = number[wide]
            margin = margins(number)
            open_ = open_[wide]
            every = (x1, x2, x3, f1, f2, f3, span, size)
            x1, x2, x3, f1, f2, f3, span, size = (each[wide] for each in every)
        share = _share(span, x3 - x1, f1, f2, f3) if step else f1 / (f1 - f2)
        least = np.minimum(0.5 * width / size, 0.5)
        x = x1 + np.minimum(np.maximum(share, least), 1.0 - least) * span
        f = margin(x)
        same = (f >= 0.0) == (f1 >= 0.0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same, x2, x1), np.where(same, f2, f1)
        x1, f1 = x, f
    _store(held, failed, number, open_, x1, x2, f1)
    return held, failed


def _store(
    held: Floats,
    failed: Floats,
    number: Integers,
    which: Booleans,
    *ends: Floats,
) -> None:
    """Put the ends of some intervals where they belong."""
    x1, x2, f1 = (each[which] for each in ends)
    holds = f1 >= 0.0
    held[number[which]] = np.where(holds, x1, x2)
    failed[number[which]] = np.where(holds, x2, x1)


def _share(x21: Floats, x31: Floats, f1: Floats, f2: Floats, f3: Floats) -> Floats:
    """Where to look next, as a share of the way x21 from point 1 to point 2.

    Numbers that are none count as no interpolation.
    """
    f21, f31 = f2 - f1, f3 - f1
    f23 = f21 - f31
    xi, phi = x21 / (x21 - x31), f21 / f23
    quadratic = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
    share = f1 / f23 * (f3 / f21 - x31 / x21 * f2 / f31)
    return np.where(quadratic, share, 0.5)


ROUNDING = 2e-13
"""Share of the sum of a row's terms by which it may fall short of 0, for rounding."""
DUST = 1e-25
"""Share of the sum of a row's terms below which one is left out, so that no quotient overflows."""
TINY = 1e-200
"""Stands in for a rate of 0: a quotient by it keeps its limit."""
WIDTH_S = 1e-11
"""To which the ends of what rows admit are found [s]."""


class Rows(NamedTuple):
    """Coefficients (row, programme) of 1, x, V, y, W and V W; a holds the allowance for rounding.

    The rates of the two times [1/s], one a programme, are not 0 but `TINY`.
    """

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    e: Floats
    f: Floats
    rate_x_per_s: Floats
    rate_y_per_s: Floats

    @property
    def usable(self) -> Booleans:
        """Programmes without a NaN among their coefficients."""
        return np.asarray(~np.isnan(self[:6]).any(axis=(0, 1)))

    def take(self, which: Selection) -> Rows:
        """The rows of some programmes, by their numbers or a slice."""
        if isinstance(which, slice):
            return Rows(*(each[..., which] for each in self))
        return Rows(*(each.take(which, axis=-1) for each in self))

    def keep(self, rows: Booleans) -> Rows:
        """Some of the rows of all programmes."""
        a, b, c, d, e, f = (each[rows] for each in self[:6])
        return Rows(a, b, c, d, e, f, self.rate_x_per_s, self.rate_y_per_s)

    @np.errstate(invalid="ignore")
    def without_implied(self, x_top: Floats, y_top: Floats) -> Rows:
        """The rows less those that the next one implies for x and y up to their tops.

        Limits along a route follow each other in time, and the next is often the tighter. A row
        that any programme needs stays, infinite in the others, so that what is found of a programme
        does not depend on the others.
        """
        if len(self.a) < 2:
            return self
        V, W = levelled(self.rate_x_per_s, x_top), levelled(self.rate_y_per_s, y_top)
        least, *weights = (each[:-1] - each[1:] for each in self[:6])
        for weight, most in zip(weights, (x_top, V, y_top, W, V * W), strict=True):
            least = least + np.minimum(weight, 0.0) * most
        implied = (least >= 0.0) | np.isinf(self.a[:-1])
        needed = ~np.concatenate([implied, np.zeros_like(implied[:1])])
        kept = np.asarray(needed.any(axis=1))
        rows, needed = self.keep(kept), needed[kept]
        if needed.all():
            return rows
        b, c, d, e, f = (np.where(needed, each, 0.0) for each in rows[1:6])
        a = np.where(needed, rows.a, np.inf)
        return Rows(a, b, c, d, e, f, rows.rate_x_per_s, rows.rate_y_per_s)

    def at(self, x: Floats, y: Floats) -> Floats:
        """g at a point of each programme."""
        return Section.at_x(self, x).at(y)


class Section(NamedTuple):
    """Rows in y alone: a + d y + e W ≥ 0, the first three (row, programme)."""

    a: Floats
    d: Floats
    e: Floats
    rate_per_s: Floats

    @classmethod
    def at_x(cls, rows: Rows, x: Floats) -> Section:
        """The rows at one x of each programme."""
        V = levelled(rows.rate_x_per_s, x)
        return cls(rows.a + rows.b * x + rows.c * V, rows.d, rows.e + rows.f * V, rows.rate_y_per_s)

    @classmethod
    def over_x(cls, rows: Rows, low: Floats, high: Floats) -> Section:
        """Rows that hold wherever the rows hold for some x from low to high.

        The part without y is taken where it is largest, at an end or where its slope vanishes; the
        weight of W, which is monotone in x, at an end.
        """
        rate = rows.rate_x_per_s
        V_low, V_high = levelled(rate, low), levelled(rate, high)
        level = np.maximum(rows.b * low + rows.c * V_low, rows.b * high + rows.c * V_high)
        turn = np.clip(_turn(rows.b, rows.c, rate), low, high)
        level = np.fmax(level, rows.b * turn + rows.c * levelled(rate, turn))
        weight = rows.e + np.maximum(rows.f * V_low, rows.f * V_high)
        return cls(rows.a + level, rows.d, weight, rows.rate_y_per_s)

    def at(self, y: Floats) -> Floats:
        """Values at one y of each programme, or of each row."""
        return self.a + self.d * y + self.e * levelled(self.rate_per_s, y)

    def smallest(self, top: Floats) -> Floats:
        """Smallest y from 0 to top at which all rows hold, one a programme; NaN if there is none.

        It is 0 or a point at which some row begins to hold. All such points are found, on
        either side of the row's turning point, and tried.
        """
        return self._extreme(top, smallest=True)

    def largest(self, top: Floats) -> Floats:
        """Largest y from 0 to top at which all rows hold, one a programme; NaN if there is none.

        It is the top or a point at which some row ceases to hold.
        """
        return self._extreme(top, smallest=False)

    def _extreme(self, top: Floats, *, smallest: bool) -> Floats:
        zero, turn = np.zeros_like(top), self._turn_below(top)
        points = [(np.arange(len(top)), zero if smallest else top)]
        for low, high in ((zero + 0.0 * turn, turn), (turn, top + 0.0 * turn)):
            holds, fails = (low, self.at(low)), (high, self.at(high))
            if smallest:
                holds, fails = fails, holds
            which = np.nonzero((holds[1] >= 0.0) & (fails[1] < 0.0))
            points.append((which[1], self._edges(which, holds, fails)))
        found = np.full(len(top), np.inf if smallest else -np.inf)
        pick = np.minimum if smallest else np.maximum
        pick.at(found, *self._holding(points))
        return np.where(np.isfinite(found), found, np.nan)

    def _turn_below(self, top: Floats) -> Floats:
        """Where each row turns between 0 and top, else top (row, programme)."""
        turn = _turn(self.d, self.e, self.rate_per_s)
        return np.where((turn > 0.0) & (turn < top), turn, top)

    def _holding(self, points: list[tuple[Integers, Floats]]) -> tuple[Integers, Floats]:
        """Those of some points, each with its programme, at which all rows hold."""
        where, y = (np.concatenate(each) for each in zip(*points, strict=True))
        tried = Section(
            self.a[:, where], self.d[:, where], self.e[:, where], self.rate_per_s[where]
        )
        holds = (tried.at(y) >= 0.0).all(axis=0)
        return where[holds], y[holds]

    def ceilings(self, top: Floats) -> Floats:
        """Largest y to top up to which each falling row holds (row, programme); −1 if none."""
        zero = np.zeros(self.a.shape)
        at_zero, at_top = self.a, self.at(top)
        found = np.where(at_zero < 0.0, -1.0, zero + top)
        which = np.nonzero((at_zero >= 0.0) & (at_top < 0.0))
        found[which] = self._edges(which, (zero, at_zero), (zero + top, at_top))
        return found

    def _edges(self, which: tuple[Integers, ...], holds: Ends, fails: Ends) -> Floats:
        """The last points that hold, of single (row, programme) with ends on either side."""
        a, d, e = (each[which] for each in (self.a, self.d, self.e))
        rate = self.rate_per_s[which[1]]

        def margins(some: Selection) -> Margin:
            one = Section(a[some], d[some], e[some], rate[some])
            return one.at

        held, failed = ((x[which], margin[which]) for x, margin in (holds, fails))
        return close_in(margins, held, failed, WIDTH_S)[0]


def levelled(rate_per_s: Floats, time_s: Floats) -> Floats:
    """(1 − exp(−kt))/k [s], t itself where k is next to nothing."""
    found: Floats = np.expm1(-rate_per_s * time_s) / -rate_per_s
    return found


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def _turn(slope: Floats, weight: Floats, rate_per_s: Floats) -> Floats:
    """Where slope · t + weight · (1 − exp(−kt))/k turns [s]; NaN or infinite if nowhere."""
    found: Floats = -np.log(-slope / weight) / rate_per_s
    return found


def falling(rows: Rows, x_top: Floats, y_top: Floats) -> tuple[Booleans, Booleans, Booleans]:
    """Which rows never rise with x, never fall with y, never rise with y, for x, y up to the tops.

    A slope is affine in the decay of its own time and in the levelling of the other, so that its
    extremes lie in the corners.
    """
    kx, ky = rows.rate_x_per_s, rows.rate_y_per_s
    X, Y = np.exp(-kx * x_top), np.exp(-ky * y_top)
    by_y, by_x = rows.f * levelled(ky, y_top), rows.f * levelled(kx, x_top)
    most = rows.c + np.maximum(by_y, 0.0)
    falls = rows.b + np.maximum(most, most * X) <= 0.0
    most, least = rows.e + np.maximum(by_x, 0.0), rows.e + np.minimum(by_x, 0.0)
    rises_with_y = rows.d + np.minimum(least, least * Y) >= 0.0
    falls_with_y = rows.d + np.maximum(most, most * Y) <= 0.0
    return falls, rises_with_y, falls_with_y


def rows_of(
    forms: Sequence[Exponential],
    sizes: Sequence[Operand],
    x: str,
    y: str | None,
    programmes: int,
    reach_s: float | Floats,
) -> Rows:
    """Rows from forms that have to be ≥ 0, in the unknowns x and y; y is None if there is none.

    Those that cannot fall below 0 for x and y up to their reach [s], as far as their terms tell one
    by one, are left out; where other programmes need them, they are infinite. The sizes are of what
    the forms are a difference of: they and the reach, a number or one a programme, say how much
    rounding there may be.

    Raises
    ------
    NotExponentialError
        If a form holds another product than V W.
    """
    rates: dict[str, Operand] = {}
    for form in forms:
        rates |= form.rates_per_s
    kx, ky = (
        np.full(programmes, np.where(rate == 0.0, TINY, rate))
        for rate in (rates.get(name or "", 0.0) for name in (x, y))
    )
    reach_s = np.asarray(reach_s)
    V, W = levelled(kx, reach_s), levelled(ky, reach_s)
    most: dict[Monomial, Operand] = {
        CONSTANT: 1.0,
        frozenset({(x, "time")}): reach_s,
        frozenset({(x, "levelling")}): V,
    }
    if y is not None:
        most |= {frozenset({(y, "time")}): reach_s, frozenset({(y, "levelling")}): W}
        most[frozenset({(x, "levelling"), (y, "levelling")})] = V * W
    kept = []
    for form, side in zip(forms, sizes, strict=True):
        highest = {each: c * most[each] for each, c in form.terms.items() if each in most}
        shares = {each: np.abs(high) for each, high in highest.items()}
        size = sum(shares.values())
        _refuse_others(form, highest, reach_s, size)
        # Never more than a check of the answer outside the engine admits.
        allowance = np.minimum(ROUNDING * (size + side), 0.5 * TOLERANCE * np.maximum(1.0, side))
        constant = highest.pop(CONSTANT, 0.0) + allowance
        least = sum((np.minimum(each, 0.0) for each in highest.values()), constant)
        open_ = ~(least >= 0.0)
        if np.any(open_):
            dust = DUST * size
            terms = {each: form.terms[each] * (open_ & (shares[each] >= dust)) for each in highest}
            kept.append({**terms, CONSTANT: np.where(open_, constant, np.inf)})
    table = np.zeros((6, len(kept), programmes))
    for row, terms in enumerate(kept):
        for place, monomial in enumerate(most):
            if monomial in terms:
                table[place, row] = terms[monomial]
    a, b, c, d, e, f = table
    return Rows(a, b, c, d, e, f, kx, ky)


def _refuse_others(
    form: Exponential, known: Mapping[Monomial, Operand], reach_s: float | Floats, size: Operand
) -> None:
    """Refuse a form with terms that rows do not have, unless they are rounding errors."""
    for monomial in form.terms.keys() - known.keys():
        if np.any(np.abs(form.terms[monomial]) * reach_s**2 > ROUNDING * size):
            words = " times ".join(f"{kind} of {name}" for name, kind in sorted(monomial))
            raise NotExponentialError(f"it holds {words}")


class StatedForm(NamedTuple):
    """What has to be ≥ 0, and the size of the sides whose difference it is.

    The constraint that states it is None for a limit up to which a relaxed form, an upper bound of
    what the constraint states, is exact.
    """

    form: Exponential
    size: Operand
    constraint: Constraint | None
    relaxed: bool


def stated_forms(model: Model, values: Values, *, relaxed: bool = False) -> list[StatedForm]:
    """Every constraint of a model as forms.

    With `relaxed`, the bounds of `Bounded` functions are taken, and where these are exact is added.

    Raises
    ------
    NotExponentialError
        If a constraint has no such form, with its label.
    """
    found: list[StatedForm] = []
    bounded: list[Constraint] = []
    done: dict[int, Operand] = {}
    stated = list(relations(model))  # kept, so that no two nodes share an identity
    known = [] if values else model.side_forms
    for each, sides in zip_longest(stated, known):
        try:
            found += _forms(each, values, done, sides=sides)
        except NotExponentialError as error:
            if not relaxed:
                raise NotExponentialError(f"{each.label!r}: {error}") from error
            bounded.append(each)
    return [*found, *_relaxed_forms(bounded, values)] if bounded else found


def _relaxed_forms(constraints: Sequence[Constraint], values: Values) -> Iterator[StatedForm]:
    """Forms of constraints with bounds of `Bounded` functions, and where these are exact."""
    exact = Relaxation()
    at_bounds = dict[int, Operand]()
    for each in constraints:
        yield from _forms(each, values, at_bounds, exact)
    for variant in map(Relaxation, exact.names):
        done = dict[int, Operand]()
        for each in constraints:
            yield from _forms(each, values, done, variant)
    for limit in exact.limits:
        yield StatedForm(limit, 0.0, None, True)


def _forms(
    constraint: Constraint,
    values: Values,
    done: dict[int, Operand],
    relaxed: Relaxation | None = None,
    sides: tuple[Exponential, Exponential] | None = None,
) -> Iterator[StatedForm]:
    """What has to be ≥ 0 for a constraint to hold; two forms for an equation.

    The sides are the forms of both, where they are known.
    """
    call, relation = relaxed or applied, constraint.relation
    left, right = sides or (exponential(side, values, done, call) for side in relation.sides)
    margin, size = right - left, np.abs(right.terms.get(CONSTANT, 0.0))
    for sign in relation.signs[::-1]:
        yield StatedForm(margin * sign, size, constraint, relaxed is not None)
