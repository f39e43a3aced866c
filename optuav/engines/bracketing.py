"""Largest x for which some y makes all rows hold, between a point and a proof.

Where the rows allow it, the largest y that the falling rows admit is best for every x, and the
rows hold up to some x and nowhere beyond: both ends of an interval around it are evaluated.
Rows that do not fit are left out first; if what is found satisfies them, nothing was lost, for
leaving out rows only adds points. Otherwise x is swept downwards from there in boxes, each shown to
hold no point at all, until a point is met: see `sweeping`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.exponential_form import Rows, Section, falling
from optuav.engines.sign_changes import Margin, close_in
from optuav.engines.sweeping import WIDTH_S, sweep


class Interval(NamedTuple):
    """What is known of the largest x, one entry a programme.

    Parameters
    ----------
    x, y
        A point at which all rows hold; NaN without one.
    beyond
        No point has a larger x than this [s]; −inf where there is none at all.
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

    Where y is 0 and trends do not tell, the points where a row ceases to hold are all found, and
    tried from the largest.

    Parameters
    ----------
    rows
        Rows that have to hold.
    x_top, y_top
        Beyond these the rows do not hold [s], one a programme.
    any_point
        Whether to leave it at any point where looking for the largest x takes long.
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
    """Largest x under the rows that y only helps, and those that it only harms, told by mask.

    All of them fall with x, and so does the largest y. Returns a point (x, y) and what no point is
    beyond, one a programme; NaN and −inf where no x holds.
    """
    starts, slopes = _ceilings(rows, y_top, harmed)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.where(slopes > 0.0, starts / slopes, np.inf)
    end = np.minimum(x_top, ends.min(axis=0))
    helping = helped.any(axis=1)
    kept, ignored = rows.keep(helping), np.where(helped[helping], 0.0, np.inf)

    def margins(which: Any) -> Margin:
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
