"""The longest time that limits of battery wells allow, bracketed by a feasible point and a bound.

Takes models that maximise a multiple of one of at most two times, with constraints of the form
that phases of constant current give (see `rows`), linear ones among them. The answer comes with a
time that no answer exceeds.

Where the rows allow it, the largest y under the falling rows is best for every x, and the
rows hold up to some x and nowhere beyond: both ends of an interval around it are evaluated.
Rows that do not fit are left out first; if the point that is found satisfies them, nothing was
lost, because leaving out rows only adds points. Otherwise x is swept downwards from there in boxes,
each shown to hold no point at all, until a point is found.

A box is dropped if the rows, each at its largest over the box, leave no y, or if a combination of
two of them does. Where one row needs a larger y and another a smaller one, the combination is the
one that does not change with y at the point where they are closest: the rest of it over the box is
of second order in its size, so that boxes are large even where the rows nearly meet.

Where charging tapers, wells hold no more than at constant current throughout, past full too, and
than when full: what no time exceeds then, none exceeds here. Three answers are tried, all evaluated
with the taper: the longest time under that bound, the longest along the largest other time, and the
longest without the available well ever past full.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers, Values
from optuav.engines.registry import MOST_UNKNOWNS, Engine
from optuav.engines.rows import (
    Rows,
    Section,
    StatedForm,
    bracket_root,
    levelled,
    rows_of,
    split_by_share,
    stated_forms,
)
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.modelling.check import evaluated
from optuav.modelling.forms import CONSTANT, Monomial, affine
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate
from optuav.status import SAME_S, Status

LEAST_VIOLATION = 1e-11
"""Smallest violation that fails a constraint, relative to max(1, |right side|)."""
NAME = "bracket"
PROOF = "bracketed: a feasible time, and proof that none is longer"
PROOF_OF_NONE = "bracketed: proof that no times satisfy all constraints"
WIDTH_S = 1e-8  # Largest distance between a point that holds and one beyond which none does [s]
EDGE_S = 1e-12  # Accuracy of the last point along the lines under the other rows [s]
FOUND_OUT = [Status(status) for status in ("error", "infeasible", "unknown", "feasible", "optimal")]
MOST_BOXES = 1000  # Boxes that a sweep tries before it gives up
SMALLEST_BOX_S = 1e-10


class Interval(NamedTuple):
    """The largest x per programme, between a point where all rows hold and a bound."""

    x: Floats  # NaN without a point
    y: Floats
    beyond: Floats  # No point has a larger x than this [s]; −inf without any point


def bracket_largest(
    rows: Rows,
    x_top: Floats,
    y_top: Floats,
    *,
    any_point: bool = False,
    least: Floats | float = 0.0,
) -> Interval:
    """Bracket the largest x of every programme.

    Beyond the tops [s], one per programme, no row holds. With `any_point`, any point will do
    where the largest x takes long; programmes are skipped if plainly no x ≥ `least` holds.
    """
    if not y_top.any() and len(rows.shares) == 1:
        x = Section(rows.weights[:3], rows.rate_x_per_s).end(x_top)
        beyond = np.where(np.isnan(x), -np.inf, np.minimum(x + WIDTH_S, x_top))
        return Interval(x, 0.0 * x, beyond)
    x, y, beyond = _monotone(rows, x_top, y_top, np.asarray(least, float))
    lost = np.flatnonzero(~((rows.at(x, y) >= 0.0).all(axis=0) | np.isnan(x)))
    if len(lost):
        y[lost] = rows.take(lost).at_x(x[lost]).end(y_top[lost], smallest=True)
        lost = lost[np.isnan(y[lost])]
    if len(lost):
        wanted = np.broadcast_to(least, beyond.shape)[lost]
        tops = x_top[lost], y_top[lost]
        x[lost], y[lost], beyond[lost] = _sweep(
            rows.take(lost), *tops, beyond[lost], wanted, any_point
        )
    return Interval(np.where(np.isnan(y), np.nan, x), y, beyond)


def shortest(rows: Rows, bracketed: Interval, y_top: Floats) -> Floats:
    """Smallest y that satisfies all rows, for the x of each programme; NaN without one.

    Where rounding hides it, as where x leaves no room, it is the y that is known to hold.
    """
    y = bracketed.y.copy()
    here = np.flatnonzero(~np.isnan(bracketed.x))
    smallest = rows.take(here).at_x(bracketed.x[here]).end(y_top[here], smallest=True)
    y[here] = np.fmin(smallest, y[here])
    return y


def _monotone(
    rows: Rows, x_top: Floats, y_top: Floats, least: Floats
) -> tuple[Floats, Floats, Floats]:
    """Largest x under the rows that fall with x, and that either rise or fall with y.

    Rows that fall with y and are constant in x or linear allow y up to lines start − slope · x.
    Returns a point (x, y) and a bound beyond which no point lies, one per programme; NaN if no
    x ≥ `least` holds, with −inf if `least` is 0.
    """
    falls, rising, sinking = rows.trends(x_top, y_top)
    helped, harmed = falls & rising, falls & sinking & ~rising
    harming = harmed.any(axis=1)
    a, b, d, e, c, f = split_by_share(rows.weights[:, harming])
    level = (c == 0.0).all(axis=0) & (f == 0.0).all(axis=0)
    straight = harmed[harming] & level & (e == 0.0) & (d < 0.0)
    fixed = harmed[harming] & (b == 0.0) & level & ~straight
    ceilings = np.tile(y_top, (len(a), 1))  # Rows that are not fixed allow any y.
    row, number = np.nonzero(fixed)
    if len(row):
        section = Section(np.array([a, d, e])[:, None, row, number], rows.rate_y_per_s[number])
        ceilings[row, number] = np.nan_to_num(section.end(y_top[number]), nan=-1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        starts = np.vstack([y_top, np.where(straight, a / -d, ceilings)])
        slopes = np.vstack([0.0 * y_top, np.where(straight, b / d, 0.0)])
        ends = np.where(slopes > 0.0, starts / slopes, np.inf)
    end: Floats = np.minimum(x_top, ends.min(axis=0))
    helping = helped.any(axis=1)
    weights = rows.weights[:, helping]
    weights[0] = np.where(helped[helping], weights[0], np.inf)

    def margin(x: Floats, starts: Floats, slopes: Floats, *own: Floats) -> Floats:
        """Return the least slack of the rows at the largest y under the lines, not below 0."""
        y = np.maximum((starts - slopes * x).min(axis=0), 0.0)
        least: Floats = Rows.of(rows.shares, *own).at(x, y).min(axis=0, initial=np.inf)
        return least

    lines = starts, slopes, weights, rows.rate_x_per_s, rows.rate_y_per_s
    hopeless = (starts < 0.0).any(axis=0) | ~(end >= least)
    if np.any(least):
        hopeless |= margin(least, *lines) < 0.0
    with np.errstate(over="ignore", invalid="ignore"):  # at an end far below 0, which is hopeless
        first, last = (np.where(hopeless, -1.0, margin(at, *lines)) for at in (0.0 * end, end))
    x, beyond = bracket_root(margin, 0.0 * end, end, EDGE_S, *lines, known=(first, last))
    y = np.maximum((starts - slopes * x).min(axis=0), 0.0)
    return x, y, np.where(np.isnan(x), np.where(least > 0.0, least, -np.inf), beyond)


def _sweep(
    rows: Rows, x_top: Floats, y_top: Floats, beyond: Floats, least: Floats, any_point: bool
) -> tuple[Floats, Floats, Floats]:
    """Lower x from its upper bound until a point is found; returns x, y and the upper bound.

    The boxes double as long as they can be dropped, and halve when they cannot. Below the least
    of interest nothing is sought.
    """
    beyond = beyond.copy()
    _, rising, sinking = rows.trends(x_top, y_top)
    rising &= ~sinking
    x, y = np.full_like(beyond, np.nan), np.full_like(beyond, np.nan)
    size = 0.125 * beyond
    open_ = np.flatnonzero(beyond >= 0.0)
    for _ in range(MOST_BOXES):
        if not len(open_):
            break
        here, top, high = rows.take(open_), y_top[open_], beyond[open_]
        low = np.maximum(high - size[open_], np.nan_to_num(x[open_]))
        empty = _empty(here, rising[:, open_], low, high, top)
        beyond[open_] = np.where(empty, low, high)
        beyond[open_[empty & (low == 0.0)]] = -np.inf
        size[open_] *= np.where(empty, 2.0, 0.5)
        # The last is near enough for a proof where small boxes cannot be shown to hold no point.
        near = np.maximum(high - 5.0 * WIDTH_S, 0.0)
        for tried in (high, 0.5 * (low + high), low, near):
            tried_y = here.at_x(tried).end(top, smallest=True)
            better = ~empty & ~np.isnan(tried_y) & ~(x[open_] >= tried)
            x[open_[better]], y[open_[better]] = tried[better], tried_y[better]
        close = (beyond[open_] - x[open_] <= WIDTH_S) | (any_point & ~np.isnan(x[open_]))
        stuck = (size[open_] < SMALLEST_BOX_S) & ~empty
        open_ = open_[~(close | stuck | (beyond[open_] < least[open_]))]
    (known,) = np.nonzero(~np.isnan(x))

    def margin(x: Floats, y: Floats, *own: Floats) -> Floats:
        """Return the least slack of the rows at the chosen y."""
        least: Floats = Rows.of(rows.shares, *own).at(x, y).min(axis=0)
        return least

    # With that y, a little farther as a rule.
    farthest, _ = bracket_root(
        margin, x[known], beyond[known], EDGE_S, y[known], *rows.take(known).tables
    )
    x[known] = np.fmax(x[known], farthest)
    return x, y, beyond


def _empty(rows: Rows, rising: Booleans, low: Floats, high: Floats, y_top: Floats) -> Booleans:
    """Return which boxes from low to high hold no point."""
    over = rows.over_x(low, high)
    smallest = over.end(y_top, smallest=True)
    empty = np.isnan(smallest)
    left = np.flatnonzero(~empty)
    if len(left):
        reach_y = np.stack([smallest, over.end(y_top)])[:, left]
        x, reach_x = 0.5 * (low + high)[left], 0.5 * (high - low)[left]
        most = _most(rows.take(left), rising[:, left], x, reach_x, reach_y, y_top[left])
        empty[left] = most < 0.0
    return empty


def _most(
    rows: Rows, rising: Booleans, x: Floats, reach_x: Floats, within_y: Floats, y_top: Floats
) -> Floats:
    """Upper bound, around x, of the sum of two rows whose slope in y is 0 where they are closest.

    By value, slope and second derivatives of the tightest rising and the tightest other row, at
    the smallest y within two ends that satisfies the rising rows. NaN without such a pair.
    """
    at_x, kx, ky = rows.at_x(x), rows.rate_x_per_s, rows.rate_y_per_s
    only = np.where(rising, at_x.weights, np.reshape([1.0, 0.0, 0.0], (3, 1, 1)))
    y = Section(only, ky).end(y_top, smallest=True)
    reach_y = np.abs(within_y - y).max(axis=0)
    values, slopes = at_x.at(y), at_x.weights[1] + at_x.weights[2] * np.exp(-ky * y)
    programme = np.arange(len(x))
    up = np.where(rising, values, np.inf).argmin(axis=0), programme
    down = np.where(rising, np.inf, values).argmin(axis=0), programme
    paired = (slopes[up] > 0.0) & (slopes[down] < 0.0) & rising[up] & ~rising[down]
    gain, loss = np.where(paired, (slopes[up], -slopes[down]), np.nan)
    both = loss * rows.weights[:, *up] + gain * rows.weights[:, *down]
    _, slope, _, weight, cs, fs = split_by_share(both)
    bent, least_weight = 0.0 * slope, weight
    W, W_top = levelled(ky, y), levelled(ky, y_top)
    ends = rows.levelled(x - reach_x), rows.levelled(x + reach_x)
    for s, c, f, V_low, V_high in zip(rows.shares, cs, fs, *ends, strict=True):
        k = kx if s == 1.0 else s * kx
        by_x = (c + f * W) * np.exp(-k * x)
        slope = slope + (by_x if s == 1.0 else s * by_x)
        bend_x = k * -np.minimum(0.0, np.minimum(c, c + f * W_top))
        of_share = 0.5 * bend_x * reach_x**2 + np.abs(f) * reach_x * reach_y
        bent = bent + (of_share if s == 1.0 else s * of_share)
        least_weight = least_weight + np.minimum(f * V_low, f * V_high)
    bent = bent + 0.5 * (ky * -np.minimum(0.0, least_weight)) * reach_y**2
    here = Rows(both[:, None], kx, ky, rows.shares).at(x, y)[0]
    most: Floats = here + np.abs(slope) * reach_x + bent
    return most


def solve(
    model: Model, programmes: int, values: Values | None = None, **limits: float | None
) -> Solution:
    """Bracket the longest time of every programme.

    Arguments as of `optuav.engines.registry.Engine.solve`.
    The objective is a multiple of one of at most two unknowns from 0. No answer exceeds the
    solution's `beyond`: the status is feasible if it is farther than `SAME_S` of that unknown from
    the answer, unknown without an answer, and error if a number is NaN.
    """
    numbers, goal = values or {}, affine(model.objective, values or {})
    ((sought, rate),) = goal.coefficients.items()
    if np.any(np.asarray(rate) <= 0.0):
        raise InputError(f"engine {NAME} needs an objective that grows with {sought}")
    names = sorted((variable.name for variable in model.variables), key=sought.__ne__)
    forms = stated_forms(model, numbers, relaxed=True)
    rows, tops, usable = rows_and_tops(forms, names, programmes)
    if tapers := any(form.relaxed for form in forms):
        interval = _tapered(model, numbers, forms, names, tops, rows)
    else:
        interval = bracket_largest(rows, *tops)
        interval = interval._replace(y=shortest(rows, interval, tops[1]))
    none, unknown = np.isneginf(interval.beyond), np.isnan(interval.x)
    open_ = interval.beyond - interval.x > SAME_S
    # Numbers in `FOUND_OUT`: the first that holds, 0 where a number is NaN.
    found_out = np.where(none, 1, np.where(unknown, 2, np.where(open_, 3, 4))) * usable
    answered = usable & ~none & ~unknown
    points = {n: np.where(answered, x, np.nan) for n, x in zip(names, interval[:2], strict=False)}
    return Solution(
        engine=NAME,
        proof=PROOF if answered.any() else PROOF_OF_NONE,
        statuses=[FOUND_OUT[code] for code in found_out.tolist()],
        objective=goal.constant + rate * points[sought],
        values={variable.name: points[variable.name] for variable in model.variables},
        duals=() if tapers else None,
        beyond=np.where(usable, goal.constant + rate * interval.beyond, np.nan),
        declared=model,
        given=numbers,
    )


def rows_and_tops(
    forms: Sequence[StatedForm], names: Sequence[str], programmes: int
) -> tuple[Rows, Floats, Booleans]:
    """All rows at constant current, how far both times can go [s], and where the numbers are.

    The second time is 0 where there is but one. They go as far as constraints allow that are linear
    and, in a programme, only shorten times.
    """
    tops = np.zeros((2, programmes))
    linear = [form.terms for form, *_ in forms if not form.rates_per_s]
    for k, name in enumerate(names):
        tops[k] = np.inf
        own: Monomial = frozenset({(name, "time")})
        for terms in linear:
            if own not in terms:
                continue
            least, slope = np.maximum(terms.get(CONSTANT, 0.0), 0.0), terms[own]
            shortens: Booleans = np.ones(programmes, bool)
            for monomial, other in terms.items():
                shortens = shortens & ((monomial == CONSTANT) | (np.asarray(other) <= 0.0))
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                most = np.where(shortens & (slope < 0.0), least / -slope, np.inf)
            tops[k] = np.minimum(tops[k], most)
        if np.isinf(tops[k]).any():
            words = f"engine {NAME} needs a linear constraint that bounds {name}"
            raise InputError(f"{words}: declare the deadline with given.keep_deadline")
    usable = np.asarray(~np.isnan(tops).any(axis=0))
    tops = np.where(usable, tops, 0.0)
    exact = [form for form in forms if form.constraint or not form.relaxed]
    rows = rows_of(exact, names, tops.max(axis=0))
    usable &= ~np.isnan(rows.weights).any(axis=(0, 1))
    return rows, tops, usable


def _tapered(
    model: Model,
    given: Values,
    forms: Sequence[StatedForm],
    names: Sequence[str],
    tops: Floats,
    relaxed: Rows,
) -> Interval:
    """The best of three points with the taper, its smallest y, and the bound without it."""
    tapered = dict.fromkeys(form.constraint for form in forms if form.relaxed and form.constraint)
    values = {name: parameter.value for name, parameter in model.given.items()} | {**given}

    def margin(x: Floats, y: Floats, which: Integers) -> Floats:
        """Return the slack of the constraints, with the taper, at points of some programmes."""
        at = {name: v[which] if np.ndim(v) else v for name, v in values.items()}
        at |= dict(zip(names, (x, y), strict=False))
        least = np.full(np.shape(x), np.inf)
        with np.errstate(invalid="ignore"):  # without a point
            for row in evaluated(tapered, at):
                share = row.slack / np.maximum(1.0, np.abs(row.right))
                least = np.minimum(least, share + LEAST_VIOLATION)
        return least

    others = rows_of([form for form in forms if not form.relaxed], names, tops.max(axis=0))
    bound = bracket_largest(relaxed, *tops)

    def most(x: Floats, which: Integers) -> Floats:
        """Largest y under the other rows."""
        return others.take(which).at_x(x).end(tops[1][which])

    def along_most(x: Floats, which: Integers) -> Floats:
        return margin(x, most(x, which), which)

    numbers = np.arange(len(bound.x))
    along, _ = bracket_root(along_most, 0.0 * bound.x, bound.x, WIDTH_S, numbers)
    x, y = np.full_like(along, np.nan), np.full_like(along, np.nan)
    never_full = bracket_largest(rows_of(forms, names, tops.max(axis=0)), *tops)
    for tried in ((bound.x, bound.y), (along, most(along, numbers)), (never_full.x, never_full.y)):
        better = (margin(*tried, numbers) >= 0.0) & ~(tried[0] <= x)
        x, y = np.where(better, tried, (x, y))
    best = Interval(x, y, bound.beyond)
    least = shortest(relaxed, best, tops[1])
    y, _ = bracket_root(lambda y, which: margin(x[which], y, which), y, least, WIDTH_S, numbers)
    return best._replace(y=y)


def some_point(
    model: Model, programmes: int, values: Values | None = None
) -> tuple[dict[str, Floats], Booleans]:
    """Times that satisfy all constraints, NaN where none are known, and where it is proved none do.

    The objective does not matter. `InputError` if a time may be negative.
    """
    if any(np.any(evaluate(variable.lower, values or {}) < 0.0) for variable in model.variables):
        raise InputError(f"engine {NAME} needs unknowns of at least 0")
    names = [variable.name for variable in model.variables]
    forms = stated_forms(model, values or {})
    rows, tops, usable = rows_and_tops(forms, names, programmes)
    interval = bracket_largest(rows, *tops, any_point=True)
    times = (np.where(usable, time_s, np.nan) for time_s in (interval.x, interval.y))
    return dict(zip(names, times, strict=False)), usable & np.isneginf(interval.beyond)


@dataclass(frozen=True)
class Bracket(Engine):
    """The engine that finds the longest time within the limits of the battery's wells.

    Examples
    --------
    >>> import optuav
    >>> from optuav.engines.bracket import Bracket
    >>> plan = optuav.solve("paper", "P3", engine=Bracket(), perspective="available")
    >>> print(f"{plan.hover_time_s:.3f} s, {plan.status.value}")
    577.524 s, optimal
    """

    name = NAME
    nonlinear = True
    most_unknowns = MOST_UNKNOWNS
    needs = ("lower bounds", "levelling")
    solve = staticmethod(solve)
