"""Rows g(x, y) ≥ 0 in two times x and y and the levelling of wells, for many programmes at once.

With V = (1 − exp(−kx))/k and W = (1 − exp(−ky))/k a row is g = a + b x + c V + d y + e W + f V W:
the effect of phases of constant current on the wells of a battery, and of a deadline on the
times. In x or y with the other fixed, g turns at most once; so it has at most two roots.

Phases that take shares s of x have levellings V_s = (1 − exp(−ksx))/k of their own, and the row
is g = a + b x + Σ c_s V_s + d y + (e + Σ f_s V_s) W. In y it turns at most once; in x it may more
often. Bounds over a range of x are then sums of what each term is at most, or at least.

References
----------
.. [1] T. R. Chandrupatla, "A new hybrid quadratic/bisection algorithm for finding the zero of a
   nonlinear function without using derivatives", Advances in Engineering Software, 1997.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.modelling.check import CONSTRAINT_TOLERANCE, relations
from optuav.modelling.declaration import Constraint
from optuav.modelling.expression import Operand
from optuav.modelling.forms import (
    CONSTANT,
    Exponential,
    Monomial,
    NotExponentialError,
    Relaxation,
    applied,
    exponential,
    same_rate,
)
from optuav.modelling.model import Model

Margin: TypeAlias = Callable[..., Floats]
"""Values at one point of each of some intervals, from what belongs to them."""

MOST_STEPS = 200
ROUNDED_ROW = (
    2e-13  # Share of the sum of a row's terms that it may fall short of 0 by, for rounding
)
DUST = 1e-25
"""Share of the sum of a row's terms below which one is left out, so that no quotient overflows."""
TINY = 1e-200  # Replacement of a rate of 0, as in the physics, which engines do not import
SPACING = 4.0 * np.finfo(float).eps  # Share of numbers that lie next to each other
ROOT_WIDTH_S = 1e-11  # Accuracy of the ends of feasible stretches [s]


@np.errstate(divide="ignore", invalid="ignore")
def bracket_root(
    margin: Margin,
    start: Floats,
    goal: Floats,
    width: float,
    *own: Floats | Integers,
    known: tuple[Floats, Floats] | None = None,
) -> tuple[Floats, Floats]:
    """The last points that hold (margin ≥ 0) on the way from a start that does to a goal.

    With neighbours at most a width apart that do not hold [1]_; the goal twice where it holds, NaN
    and the goal where neither end does. What belongs to intervals has them along its last axis.
    Margins at start and goal may be known.
    """
    f1, f2 = known or (margin(start, *own), margin(goal, *own))
    held, failed = np.where(f2 >= 0.0, goal, np.where(f1 >= 0.0, start, np.nan)), goal.copy()
    which = np.flatnonzero((f1 >= 0.0) & (f2 < 0.0))
    x1, x2, f1, f2, *left = take_entries((start, goal, f1, f2, *own), which)
    x3, f3 = x2, f2
    for step in range(MOST_STEPS):
        wide = np.abs(x2 - x1) > width + SPACING * np.abs(x1)
        if not wide.all():
            tables = which, x1, x2, x3, f1, f2, f3, *left
            which, x1, x2, x3, f1, f2, f3, *left = take_entries(tables, np.flatnonzero(wide))
        if not len(which):
            break
        x21, f21 = x2 - x1, f2 - f1
        share = -f1 / f21
        if step:
            x31, f31 = x3 - x1, f3 - f1
            xi, phi = x21 / (x21 - x31), f21 / (f21 - f31)
            quadratic = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
            share = f1 / (f21 - f31) * (f3 / f21 - x31 / x21 * f2 / f31)
            share = np.where(quadratic, share, 0.5)
        least = np.minimum(0.5 * width / np.abs(x21), 0.5)
        x = x1 + np.minimum(np.maximum(share, least), 1.0 - least) * x21
        f = margin(x, *left)
        same = (f >= 0.0) == (f1 >= 0.0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same, x2, x1), np.where(same, f2, f1)
        x1, f1 = x, f
        held[which], failed[which] = np.where(f1 >= 0.0, (x1, x2), (x2, x1))
    return held, failed


def take_entries(tables: Iterable[Any], which: Integers) -> list[Any]:
    """Select entries along the last axis of tables by ascending numbers."""
    return [t if len(which) == t.shape[-1] else t.take(which, axis=-1) for t in tables]


def levelled(rate_per_s: Floats, time_s: Floats) -> Floats:
    """(1 − exp(−kt))/k [s], t for k next to 0; apart from the physics, like `TINY`."""
    levelled_s: Floats = np.expm1(-rate_per_s * time_s) / -rate_per_s
    return levelled_s


class Section(NamedTuple):
    """Rows a + d y + e W ≥ 0 in only y; weights of a, d and e, (3, row, programme)."""

    weights: Floats
    rate_per_s: Floats

    def at(self, y: Floats) -> Floats:
        """Values at one y of each programme, or of each row."""
        a, d, e = self.weights
        found: Floats = a + d * y + e * levelled(self.rate_per_s, y)
        return found

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def end(self, top: Floats, *, smallest: bool = False) -> Floats:
        """Largest or smallest y from 0 to top under all rows, one per programme; NaN if none.

        All points where a row begins or ceases to hold are found and tried, with 0 and the top.
        """
        _, d, e = self.weights
        turns = -np.log(-d / e) / self.rate_per_s  # NaN or infinite if nowhere
        turns = np.where((turns > 0.0) & (turns < top), turns, top)
        ends = np.zeros((3, *turns.shape))
        ends[1], ends[2] = turns, top
        values = self.at(ends)
        pair = (1, 0) if smallest else (0, 1)
        (start, at_start), (goal, at_goal) = ((ends[k : k + 2], values[k : k + 2]) for k in pair)
        _, row, number = here = np.nonzero((at_start >= 0.0) & (at_goal < 0.0))
        edges, _ = bracket_root(
            lambda y, *own: Section(*own).at(y),
            start[here],
            goal[here],
            ROOT_WIDTH_S,
            self.weights[:, row, number],
            self.rate_per_s[number],
            known=(at_start[here], at_goal[here]),
        )
        number = np.concatenate([np.arange(len(top)), number])
        y = np.concatenate([0.0 * top if smallest else top, edges])
        tried = Section(self.weights[..., number], self.rate_per_s[number])
        hold = (tried.at(y) >= 0.0).all(axis=0)
        best_y = np.full(len(top), np.inf if smallest else -np.inf)
        (np.minimum if smallest else np.maximum).at(best_y, number[hold], y[hold])
        return np.where(np.isfinite(best_y), best_y, np.nan)


WHOLE_TIME = (1.0,)  # The only share of a time that phases take whole


class Rows(NamedTuple):
    """Weights of 1, x, y and W and, for every share of x, of V and V W; (…, row, programme).

    In the order 1, x, V, y, W, V W where x is taken whole; with several shares V, and V W, stand
    for one table each. That of 1 has the allowance for rounding. The rates of the two times [1/s],
    one per programme, are not 0 but `TINY`.
    """

    weights: Floats  # (4 + 2 shares, row, programme)
    rate_x_per_s: Floats
    rate_y_per_s: Floats
    shares: tuple[float, ...] = WHOLE_TIME

    @property
    def tables(self) -> tuple[Floats, Floats, Floats]:
        """Weights and rates."""
        return self.weights, self.rate_x_per_s, self.rate_y_per_s

    @classmethod
    def of(cls, shares: tuple[float, ...], *tables: Any) -> Rows:
        """Rows of some shares with tables of weights and rates."""
        weights, rate_x_per_s, rate_y_per_s = tables
        return cls(weights, rate_x_per_s, rate_y_per_s, shares)

    @property
    def parts(self) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
        """The weights of 1, x, y and W, and by share (share, row, programme) of V and V W."""
        return split_by_share(self.weights)

    def take(self, which: Integers) -> Rows:
        """The rows of some programmes by ascending numbers."""
        return Rows.of(self.shares, *take_entries(self.tables, which))

    def levelled(self, x: Floats) -> list[Floats]:
        """V of every share of x [s]."""
        return [levelled(self.rate_x_per_s, x if s == 1.0 else s * x) for s in self.shares]

    def at(self, x: Floats, y: Floats) -> Floats:
        """Values at one point of each programme."""
        a, b, d, e, cs, fs = self.parts
        level, weight = a + b * x, e
        for V, c, f in zip(self.levelled(x), cs, fs, strict=True):
            level, weight = level + c * V, weight + f * V
        found: Floats = level + d * y + weight * levelled(self.rate_y_per_s, y)
        return found

    def at_x(self, x: Floats) -> Section:
        """The rows at one x of each programme."""
        a, b, d, e, cs, fs = self.parts
        level, weight = a + b * x, e
        for V, c, f in zip(self.levelled(x), cs, fs, strict=True):
            level, weight = level + c * V, weight + f * V
        return Section(np.array([level, d, weight]), self.rate_y_per_s)

    @np.errstate(divide="ignore", invalid="ignore", over="ignore")
    def over_x(self, low: Floats, high: Floats) -> Section:
        """Rows that hold wherever the rows hold for some x from low to high.

        Each part is taken where it is largest, at an end or where its slope vanishes; of several
        levellings each takes its part of the slope along, by its share of their weights.
        """
        a, b, d, e, cs, fs = self.parts
        rate, level, weight = self.rate_x_per_s, a, e
        for s, b_s, c, f in zip(self.shares, _slopes(b, cs), cs, fs, strict=True):
            k = rate if s == 1.0 else s * rate
            V_low, V_high = (levelled(rate, x if s == 1.0 else s * x) for x in (low, high))
            most = np.maximum(b_s * low + c * V_low, b_s * high + c * V_high)
            turns = np.clip(-np.log(-b_s / (c if s == 1.0 else s * c)) / k, low, high)
            V_turns = levelled(rate, turns if s == 1.0 else s * turns)
            most = np.fmax(most, b_s * turns + c * V_turns)
            level, weight = level + most, weight + np.maximum(f * V_low, f * V_high)
        return Section(np.array([level, d, weight]), self.rate_y_per_s)

    def trends(self, x_top: Floats, y_top: Floats) -> tuple[Booleans, Booleans, Booleans]:
        """Return which rows never rise with x, fall with y, or rise with y, up to the tops.

        A slope is affine in the decay of its own time and in the levelling of the other, so that
        its extremes lie in the corners; of several levellings the extremes are added.
        """
        _, b, d, e, cs, fs = self.parts
        kx, ky = self.rate_x_per_s, self.rate_y_per_s
        Y, W = np.exp(-ky * y_top), levelled(ky, y_top)
        slope, most, least = b, e, e
        for s, V, c, f in zip(self.shares, self.levelled(x_top), cs, fs, strict=True):
            by_y, by_x = f * W, f * V
            steep = c + np.maximum(by_y, 0.0)
            steepest = np.maximum(steep, steep * np.exp(-kx * (x_top if s == 1.0 else s * x_top)))
            slope = slope + (steepest if s == 1.0 else s * steepest)
            most, least = most + np.maximum(by_x, 0.0), least + np.minimum(by_x, 0.0)
        falls = slope <= 0.0
        rises_with_y = d + np.minimum(least, least * Y) >= 0.0
        falls_with_y = d + np.maximum(most, most * Y) <= 0.0
        return falls, rises_with_y, falls_with_y


def split_by_share(weights: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Weights of `Rows` of 1, x, y and W, and by share of V and V W."""
    end = len(weights) // 2
    return (
        weights[0],
        weights[1],
        weights[end],
        weights[end + 1],
        weights[2:end],
        weights[end + 2 :],
    )


def _slopes(b: Floats, cs: Floats) -> Sequence[Floats]:
    """The weight of x in parts, one for every levelling, by the sizes of their weights."""
    if len(cs) == 1:
        return (b,)
    sizes = np.abs(cs)
    total = sizes.sum(axis=0)
    shares = np.where(total > 0.0, sizes / np.where(total > 0.0, total, 1.0), 1.0 / len(cs))
    return list(b * shares)


class StatedForm(NamedTuple):
    """A form that must be ≥ 0; a `relaxed` one is an upper bound of its constraint's form."""

    form: Exponential
    size: Operand  # Size of the sides whose difference it is
    constraint: Constraint | None = None  # None for a limit of the range where a bound is exact
    relaxed: bool = False


def rows_of(stated: Sequence[StatedForm], names: Sequence[str], reach_s: Floats) -> Rows:
    """Rows from forms that must be ≥ 0, in one or two unknowns.

    Those that cannot fall below 0 up to a reach [s], by the bounds of their terms, are left out, or
    infinite where other programmes need them. Sizes and reach say how much rounding there may be.
    """
    rates: dict[str, Operand] = {}
    for stated_form in stated:
        for name, rate in stated_form.form.rates_per_s.items():
            if not same_rate(rates.setdefault(name, rate), rate):
                raise NotExponentialError(f"{name} levels out at two rates")
    x, y = (*names, "")[:2]
    shares = shares_of(stated, x)
    if y and shares_of(stated, y) != WHOLE_TIME:
        raise NotExponentialError(f"phases take shares of {y}, and not of {x}")
    own_rates = (rates.get(name, 0.0) for name in (x, y))
    kx, ky = (np.full(reach_s.shape, np.where(k == 0.0, TINY, k)) for k in own_rates)
    Vs = [levelled(kx, reach_s if s == 1.0 else s * reach_s) for s in shares]
    W = levelled(ky, reach_s)
    most = np.array([np.ones_like(W), reach_s, *Vs, reach_s, W, *(V * W for V in Vs)])
    own: list[Monomial] = [CONSTANT, frozenset({(x, "time")})]
    own += [frozenset({(x, s)}) for s in shares]
    if y:
        own += [frozenset({(y, "time")}), frozenset({(y, 1.0)})]
        own += [frozenset({(x, s), (y, 1.0)}) for s in shares]
    sides = np.zeros((len(stated), len(reach_s)))
    weights = np.zeros((len(most), *sides.shape))
    for row, (form, side, *_) in enumerate(stated):
        sides[row] = side
        for monomial, coefficient in form.terms.items():
            weights[own.index(monomial), row] = coefficient
    highest = weights * most[:, None]
    sizes = np.abs(highest)
    size = sizes.sum(axis=0)
    # Never more than the tolerance of a check of the answer outside the engine.
    most = 0.5 * CONSTRAINT_TOLERANCE * np.maximum(1.0, sides)
    weights[0] += np.minimum(ROUNDED_ROW * (size + sides), most)
    open_ = ~(weights[0] + np.minimum(highest[1:], 0.0).sum(axis=0) >= 0.0)
    weights[1:] *= open_ & (sizes[1:] >= DUST * size)
    weights[0] = np.where(open_, weights[0], np.inf)
    return Rows(weights[:, open_.any(axis=1)], kx, ky, shares)


def shares_of(stated: Sequence[StatedForm], name: str) -> tuple[float, ...]:
    """The shares of a time whose levellings are in forms, rising; the whole without any."""
    shares = {
        kind
        for form, *_ in stated
        for monomial in form.terms
        for factor, kind in monomial
        if factor == name and kind != "time"
    }
    return tuple(sorted(shares)) or WHOLE_TIME


def stated_forms(model: Model, values: Values, *, relaxed: bool = False) -> list[StatedForm]:
    """Return the forms that must be ≥ 0 for a model's constraints to hold; two for an equation.

    With `relaxed`, the bounds of `Bounded` functions are taken, and where these are exact is added.
    """
    read: list[tuple[Constraint, Sequence[Exponential], bool]] = []
    bounded: list[Constraint] = []
    done = model.walked.forms(values)
    for row in relations(model):
        try:
            read.append((row, [exponential(e, values, done) for e in row.relation.sides], False))
        except NotExponentialError as error:
            if not relaxed:
                raise NotExponentialError(f"{row.label!r}: {error}") from error
            bounded.append(row)
    exact = Relaxation()
    kinds = [exact]  # Grows by one more for each ceiling met at the bounds
    for relaxation in kinds:
        done = {}
        for row in bounded:
            sides = [exponential(e, values, done, relaxation) for e in row.relation.sides]
            read.append((row, sides, True))
        kinds += map(Relaxation, exact.names) if relaxation is exact else ()
    listed = list[StatedForm]()
    for row, (left, right), bounds in read:
        size = np.abs(right.terms.get(CONSTANT, 0.0))
        for sign in row.relation.signs[::-1]:
            form = applied(np.subtract, (right, left) if sign > 0.0 else (left, right))
            listed.append(StatedForm(form, size, row, bounds))
    return [*listed, *(StatedForm(limit, 0.0, None, True) for limit in exact.limits)]
