"""The longest time where charging tapers: points evaluated with the taper, under a bound above.

At constant current throughout, past full too, wells hold no less than where charging tapers, and
their limits are rows of `exponential_form`: what no time exceeds there, none exceeds here. Three
answers are tried, all evaluated with the taper: the longest time of those rows, the longest along
the largest other time, and the longest for which the available well is never past full.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.engines.bracketing import Interval, largest, shortest
from optuav.engines.exponential_form import Rows, Section
from optuav.engines.sign_changes import Margin, close_in
from optuav.engines.sweeping import WIDTH_S
from optuav.modelling.check import slack
from optuav.modelling.model import Constraint
from optuav.modelling.traversal import evaluate

ROUNDING = 1e-11
"""By how much a constraint must be missed to fail, relative to max(1, |right side|)."""


class Tapered:
    """The constraints of a model that tapering concerns, next to the rows of the others.

    Parameters
    ----------
    constraints
        Those that hold a `Bounded` function.
    values
        Values of all parameters, by name.
    names
        Of the objective x and of the other time y, if there is one.
    others
        Rows of the other constraints.
    x_top, y_top
        Beyond these the rows do not hold [s], one a programme.
    """

    def __init__(
        self,
        constraints: Sequence[Constraint],
        values: Mapping[str, Any],
        names: Sequence[str],
        others: Rows,
        x_top: Floats,
        y_top: Floats,
    ) -> None:
        self.constraints, self.values, self.names = constraints, values, names
        self.others, self.x_top, self.y_top = others, x_top, y_top

    def best(self, relaxed: Rows, never_full: Rows) -> Interval:
        """The best point known, with the smallest y that was found for it, and the bound above.

        Parameters
        ----------
        relaxed
            All rows, at constant current.
        never_full
            The same, and that the available well is never past full.
        """
        bound = largest(relaxed, self.x_top, self.y_top)
        x, y = np.full_like(bound.x, np.nan), np.full_like(bound.x, np.nan)
        tried = [bound, largest(never_full, self.x_top, self.y_top)]
        tried.insert(1, self._along_largest(bound.x))
        rows = [relaxed, relaxed, never_full]
        for each, its_rows in zip(tried, rows, strict=True):
            better = ~np.isnan(each.x) & ~(each.x <= x)
            better &= self._margin(each.x, each.y, np.arange(len(x))) >= 0.0
            shorter = self._shortest(each, shortest(its_rows, each, self.y_top))
            x, y = np.where(better, each.x, x), np.where(better, shorter, y)
        return Interval(x, y, bound.beyond)

    def _along_largest(self, ends: Floats) -> Interval:
        """An x up to its end for which all holds with the largest y that the other rows admit."""
        known = np.flatnonzero(~np.isnan(ends))

        def ceiling(x: Floats, which: Integers) -> Floats:
            if len(self.names) == 1:
                return np.zeros_like(x)
            return Section.at_x(self.others.take(which), x).largest(self.y_top[which])

        def margins(some: Any) -> Margin:
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

            def margins(some: Any) -> Margin:
                which = short[some]
                return lambda at: self._margin(found.x[which], at, which)

            holds, fails = (found.y[short], at_found[short]), (y[short], at_least[short])
            y[short], _ = close_in(margins, holds, fails, WIDTH_S)
        return y

    def _margin(self, x: Floats, y: Floats, which: Integers) -> Floats:
        """How far the constraints hold, with the taper, at points of some programmes."""
        given = {name: v[which] if np.ndim(v) else v for name, v in self.values.items()}
        given |= dict(zip(self.names, (x, y), strict=False))
        least, done = np.full(np.shape(x), np.inf), dict[int, Any]()
        with np.errstate(invalid="ignore"):  # where there is no point
            for each in self.constraints:
                left, right = (evaluate(side, given, done) for side in each.relation.sides)
                share = slack(each.relation.sense, left, right) / np.maximum(1.0, np.abs(right))
                least = np.minimum(least, share + ROUNDING)
        return least
