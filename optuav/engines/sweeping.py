"""A sweep of x downwards in boxes, each shown to hold no point, until a point is met.

A box is dropped if the rows, each at its largest over the box, leave no y; or if two of them in a
combination do. Where one row asks for a larger y and another for a smaller one, the combination is
made that does not change with y at the point where they are closest: what is left of it over the
box is of second order in its size, so that boxes are large even where the rows nearly meet.
"""

from __future__ import annotations

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.engines.exponential_form import Rows, Section, falling, levelled

WIDTH_S = 1e-8
"""Largest distance between a point that holds and one beyond which none does [s]."""
MOST_BOXES = 1000
"""That a sweep tries before it gives up."""
SMALLEST_BOX_S = 1e-10


def sweep(
    rows: Rows, x_top: Floats, y_top: Floats, beyond: Floats, *, any_point: bool = False
) -> tuple[Floats, Floats, Floats]:
    """Sweep x down from what no point is beyond, until a point is met; x, y and beyond.

    The boxes double as long as they can be dropped, and halve when they cannot.

    Parameters
    ----------
    rows
        Rows that have to hold.
    x_top, y_top
        Beyond these the rows do not hold [s], one a programme.
    beyond
        No point has a larger x than this [s].
    any_point
        Whether to leave it at any point, not the one with the largest x.
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
    """Smallest y at which those rows hold that rise with y, at one x of each programme."""
    at_x = Section.at_x(rows, x)
    only = Section(
        np.where(rising, at_x.a, 1.0),
        np.where(rising, at_x.d, 0.0),
        np.where(rising, at_x.e, 0.0),
        at_x.rate_per_s,
    )
    return only.smallest(y_top)


def _combination(rows: Rows, rising: Booleans, x: Floats, y: Floats) -> Rows:
    """The tightest rising row and the tightest other one, so weighted that y changes nothing.

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
    """What a row that does not change with y at a point is at most within reach of it.

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
