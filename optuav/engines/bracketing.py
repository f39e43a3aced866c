"""Largest x for which some y makes all rows hold, between a point and a proof.

Where the rows allow it, the largest y that the falling rows admit is best for every x, and the
rows hold up to some x and nowhere beyond: both ends of an interval around it are evaluated.
Rows that do not fit are left out first; if the point that is found satisfies them, nothing was
lost, because leaving out rows only adds points. Otherwise x is swept downwards from there in boxes,
each shown to hold no point at all, until a point is found.

A box is dropped if the rows, each at its largest over the box, leave no y, or if a combination of
two of them does. Where one row needs a larger y and another a smaller one, the combination is the
one that does not change with y at the point where they are closest: the rest of it over the box is
of second order in its size, so that boxes are large even where the rows nearly meet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.rows import Margin, Rows, Section, Selection, close_in, falling, levelled


class Interval(NamedTuple):
    """What is known of the largest x, one entry a programme.

    A point (x, y) at which all rows hold, NaN without one; and what no point has a larger x than
    [s], −inf where there is no point.
    """

    x: Floats
    y: Floats
    beyond: Floats

    @property
    def proved(self) -> Booleans:
        """Where the two are close enough, or there is proof that no point exists."""
        close: Booleans = (self.beyond - self.x <= 10.0 * WIDTH_S) | np.isneginf(self.beyond)
        return close


def largest(rows: Rows, x_top: Floats, y_top: Floats, *, any_point: bool = False) -> Interval:
    """Bracket the largest x of every programme.

    Beyond the tops [s], one a programme, the rows do not hold. Where y is 0 and trends do not tell,
    the points where a row ceases to hold are all found, and tried from the largest. With
    `any_point`, any point will do where looking for the largest x takes long.
    """
    if not y_top.any():
        return _alone(rows, x_top)
    falls, up, down = falling(rows, x_top, y_top)
    x, y, beyond = _monotone(rows, x_top, y_top, falls & up, falls & down & ~up)
    lost = np.flatnonzero(~((rows.at(x, y) >= 0.0).all(axis=0) | np.isneginf(beyond)))
    if len(alone := lost[y_top[lost] == 0.0]):
        x[alone], y[alone], beyond[alone] = _alone(rows.take(alone), x_top[alone])
        lost = lost[y_top[lost] > 0.0]
    if len(lost):
        left = rows.take(lost)
        y[lost] = Section.at_x(left, x[lost]).smallest(y_top[lost])
        lost = lost[np.isnan(y[lost])]
    if len(lost):
        x[lost], y[lost], beyond[lost] = sweep(
            rows.take(lost), x_top[lost], y_top[lost], beyond[lost], any_point=any_point
        )
    return Interval(np.where(np.isnan(y), np.nan, x), y, beyond)


def _alone(rows: Rows, x_top: Floats) -> Interval:
    """The largest x where y is 0."""
    x = Section(rows.a, rows.b, rows.c, rows.rate_x_per_s).largest(x_top)
    beyond = np.where(np.isnan(x), -np.inf, np.minimum(x + WIDTH_S, x_top))
    return Interval(x, np.where(np.isnan(x), x, 0.0), beyond)


def shortest(rows: Rows, found: Interval, y_top: Floats) -> Floats:
    """Smallest y at which all rows hold, for the x of each programme; NaN without one.

    Where rounding hides it, as where x leaves no room, it is the y that is known to hold.
    """
    y = found.y.copy()
    here = np.flatnonzero(~np.isnan(found.x))
    smallest = Section.at_x(rows.take(here), found.x[here]).smallest(y_top[here])
    y[here] = np.fmin(smallest, y[here])
    return y


def _monotone(
    rows: Rows, x_top: Floats, y_top: Floats, helped: Booleans, harmed: Booleans
) -> tuple[Floats, Floats, Floats]:
    """Largest x under the rows that rise with y (`helped`) and those that fall with it (`harmed`).

    All of them fall with x, and so does the largest y. Returns a point (x, y) and what no point is
    beyond, one a programme; NaN and −inf where no x holds.
    """
    starts, slopes = _ceilings(rows, y_top, harmed)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.where(slopes > 0.0, starts / slopes, np.inf)
    end = np.minimum(x_top, ends.min(axis=0))
    helping = np.asarray(helped.any(axis=1))
    kept, ignored = rows.keep(helping), np.where(helped[helping], 0.0, np.inf)

    def margins(which: Selection) -> Margin:
        some, more = kept.take(which), ignored[:, which]
        first, slope = starts[:, which], slopes[:, which]

        def margin(x: Floats) -> Floats:
            values = some.at(x, _lowest(first, slope, x)) + more
            found: Floats = values.min(axis=0, initial=np.inf)
            return found

        return margin

    margin = margins(slice(None))
    low, high = np.zeros_like(end), np.maximum(end, 0.0)
    at_low, at_high = margin(low), margin(high)
    impossible = (starts < 0.0).any(axis=0) | (end < 0.0) | (at_low < 0.0)
    low = np.where(at_high >= 0.0, high, low)
    open_ = np.flatnonzero(~impossible & (at_high < 0.0))
    low[open_], high[open_] = close_in(
        lambda which: margins(open_[which]),
        (low[open_], at_low[open_]),
        (high[open_], at_high[open_]),
        WIDTH_S,
    )
    low = np.where(impossible, np.nan, low)
    return low, _lowest(starts, slopes, low), np.where(impossible, -np.inf, high)


def _lowest(starts: Floats, slopes: Floats, x: Floats) -> Floats:
    """Lowest of the lines at x, not below 0."""
    found: Floats = np.maximum((starts - slopes * x).min(axis=0), 0.0)
    return found


def _ceilings(rows: Rows, y_top: Floats, harmed: Booleans) -> tuple[Floats, Floats]:
    """Lines start − slope x above which y harms a row, (line, programme); slopes are ≥ 0.

    Rows that harm but give no line are not among them.
    """
    straight = harmed & (rows.c == 0.0) & (rows.e == 0.0) & (rows.f == 0.0) & (rows.d < 0.0)
    fixed = harmed & (rows.b == 0.0) & (rows.c == 0.0) & (rows.f == 0.0) & ~straight
    starts, slopes = [y_top[None]], [np.zeros_like(y_top)[None]]
    which = straight.any(axis=1)
    a, b = rows.a[which], rows.b[which]
    d = np.where(straight[which], rows.d[which], -1.0)
    starts.append(np.where(straight[which], a / -d, np.inf))
    slopes.append(np.where(straight[which], b / d, 0.0))
    which = fixed.any(axis=1)
    section = Section(rows.a[which], rows.d[which], rows.e[which], rows.rate_y_per_s)
    starts.append(np.where(fixed[which], section.ceilings(y_top), np.inf))
    slopes.append(np.zeros(section.a.shape))
    return np.concatenate(starts), np.concatenate(slopes)


WIDTH_S = 1e-8
"""Largest distance between a point that holds and one beyond which none does [s]."""
MOST_BOXES = 1000
"""That a sweep tries before it gives up."""
SMALLEST_BOX_S = 1e-10


def sweep(
    rows: Rows, x_top: Floats, y_top: Floats, beyond: Floats, *, any_point: bool = False
) -> tuple[Floats, Floats, Floats]:
    """Lower x from its upper bound until a point is found; returns x, y and the upper bound.

    The boxes double as long as they can be dropped, and halve when they cannot. The arguments are
    those of `largest`, and what no x is beyond [s].
    """
    beyond = beyond.copy()
    _, rising, sinking = falling(rows, x_top, y_top)
    rising &= ~sinking
    x, y = np.full_like(beyond, np.nan), np.full_like(beyond, np.nan)
    size = 0.125 * beyond
    open_ = np.flatnonzero(beyond >= 0.0)
    for _ in range(MOST_BOXES):
        if not len(open_):
            break
        here, top, high = rows.take(open_), y_top[open_], beyond[open_]
        floor = np.where(np.isnan(x[open_]), 0.0, x[open_])
        low = np.maximum(high - size[open_], floor)
        empty = _empty(here, rising[:, open_], low, high, top)
        beyond[open_] = np.where(empty, low, high)
        beyond[open_[empty & (low == 0.0)]] = -np.inf
        size[open_] *= np.where(empty, 2.0, 0.5)
        # The last is near enough for a proof where small boxes cannot be shown to hold no point.
        near = np.maximum(high - 5.0 * WIDTH_S, 0.0)
        for tried in (high, 0.5 * (low + high), low, near):
            found = Section.at_x(here, tried).smallest(top)
            better = ~empty & ~np.isnan(found) & ~(x[open_] >= tried)
            x[open_[better]], y[open_[better]] = tried[better], found[better]
        close = (beyond[open_] - x[open_] <= WIDTH_S) | (any_point & ~np.isnan(x[open_]))
        stuck = (size[open_] < SMALLEST_BOX_S) & ~empty
        open_ = open_[~(close | stuck | np.isneginf(beyond[open_]))]
    return x, y, beyond


def _empty(rows: Rows, rising: Booleans, low: Floats, high: Floats, y_top: Floats) -> Booleans:
    """Which boxes from low to high hold no point."""
    over = Section.over_x(rows, low, high)
    smallest = over.smallest(y_top)
    empty = np.isnan(smallest)
    left = np.flatnonzero(~empty)
    if len(left):
        some, helped, top = rows.take(left), rising[:, left], y_top[left]
        within = Section(over.a[:, left], over.d[:, left], over.e[:, left], over.rate_per_s[left])
        x, reach_x = 0.5 * (low + high)[left], 0.5 * (high - low)[left]
        y = smallest_rising(some, helped, x, top)
        reach_y = np.maximum(np.abs(smallest[left] - y), np.abs(within.largest(top) - y))
        both = _combination(some, helped, x, y)
        empty[left] = _most(both, x, y, reach_x, reach_y, top) < 0.0
    return empty


def smallest_rising(rows: Rows, rising: Booleans, x: Floats, y_top: Floats) -> Floats:
    """Smallest y at which the rows that rise with y hold, at one x of each programme."""
    at_x = Section.at_x(rows, x)
    only = Section(
        np.where(rising, at_x.a, 1.0),
        np.where(rising, at_x.d, 0.0),
        np.where(rising, at_x.e, 0.0),
        at_x.rate_per_s,
    )
    return only.smallest(y_top)


def _combination(rows: Rows, rising: Booleans, x: Floats, y: Floats) -> Rows:
    """The sum of the tightest rising and the tightest other row whose slope in y is 0.

    One row; NaN where there is no such pair.
    """
    at_x = Section.at_x(rows, x)
    values = at_x.at(y)
    slopes = at_x.d + at_x.e * np.exp(-rows.rate_y_per_s * y)
    programme = np.arange(len(x))
    up = np.where(rising, values, np.inf).argmin(axis=0)
    down = np.where(rising, np.inf, values).argmin(axis=0)
    gain, loss = slopes[up, programme], -slopes[down, programme]
    paired = (gain > 0.0) & (loss > 0.0) & rising[up, programme] & ~rising[down, programme]
    gain, loss = np.where(paired, gain, np.nan), np.where(paired, loss, np.nan)
    a, b, c, d, e, f = (
        (loss * each[up, programme] + gain * each[down, programme])[None]
        for each in (rows.a, rows.b, rows.c, rows.d, rows.e, rows.f)
    )
    return Rows(a, b, c, d, e, f, rows.rate_x_per_s, rows.rate_y_per_s)


def _most(
    row: Rows, x: Floats, y: Floats, reach_x: Floats, reach_y: Floats, y_top: Floats
) -> Floats:
    """Upper bound, around a point, of a row whose slope in y is 0 there.

    Its value and slope there, and what its second derivatives add.
    """
    kx, ky = row.rate_x_per_s, row.rate_y_per_s
    W, W_top = levelled(ky, y), levelled(ky, y_top)
    V_low, V_high = levelled(kx, x - reach_x), levelled(kx, x + reach_x)
    here = row.at(x, y)[0]
    slope = (row.b + (row.c + row.f * W) * np.exp(-kx * x))[0]
    bend_x = kx * -np.minimum(0.0, np.minimum(row.c, row.c + row.f * W_top))[0]
    bend_y = ky * -np.minimum(0.0, np.minimum(row.e + row.f * V_low, row.e + row.f * V_high))[0]
    bent = 0.5 * bend_x * reach_x**2 + np.abs(row.f[0]) * reach_x * reach_y
    found: Floats = here + np.abs(slope) * reach_x + bent + 0.5 * bend_y * reach_y**2
    return found
