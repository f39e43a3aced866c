"""From times that would do if nothing were refused near full to times that do: the taper's truth.

A model in which charging tapers holds longest parts of times. With the whole times in their place
it has the form that `bracketing` solves, and more points: what no time is beyond there, none is
beyond here. If the answer satisfies the model itself, it is the longest. Otherwise the model itself
is evaluated. Where what is asked of the wells falls with x and rises with y (the model states its
trends), the largest y that the other rows admit is best for every x, and the rows hold up to some x
and nowhere beyond: both ends of an interval around it are evaluated. Elsewhere the longest time
that was met is told, with what has not been ruled out.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from typing import Any

import numpy as np

from optuav.engines.arrays import Booleans, Floats
from optuav.engines.bracketing import Interval
from optuav.engines.exponential_form import Rows, Section, falling
from optuav.engines.sign_changes import Margin, Numbers, close_in
from optuav.engines.sweeping import WIDTH_S
from optuav.modelling.check import slack
from optuav.modelling.expression import Call, Let, Relation
from optuav.modelling.longest import speaks_of_parts
from optuav.modelling.model import Constraint, Model
from optuav.modelling.walk import evaluate, has_unknowns

ROUNDING = 1e-11
"""By how much a constraint must be missed to fail, relative to max(1, |right side|)."""


class Tapered:
    """A model in which charging tapers, next to the rows that it would have if it did not.

    Parameters
    ----------
    model
        The objective x is one unknown; at most one other, y.
    values
        Values of all parameters, by name.
    others
        Rows of its constraints that speak of no parts of times.
    x_top, y_top
        Beyond these they do not hold [s], one a programme.
    """

    def __init__(
        self, model: Model, values: Mapping[str, Any], others: Rows, x_top: Floats, y_top: Floats
    ) -> None:
        self.values, self.others, self.x_top, self.y_top = values, others, x_top, y_top
        self.x = model.objective.name
        self.y = next((each.name for each in model.variables if each.name != self.x), None)
        self.asked = [each for each in model.constraints if speaks_of_parts(*each.relation.sides)]

    def narrowed(self, found: Interval) -> Interval:
        """What is left of an interval for the longest x, one a programme."""
        x, y, beyond = (each.copy() for each in found)
        known = np.flatnonzero(~np.isnan(x))
        lost = known[self._margin(x[known], y[known], known) < 0.0]
        if not len(lost):
            return found
        here, ceiling_s = _Ceiling(self, lost), x[lost]
        falls, rises = self._trends()
        low, high = np.zeros(len(lost)), ceiling_s.copy()
        at_low, at_high = (here.margin(slice(None))(end) for end in (low, high))
        held, never = at_high >= 0.0, at_low < 0.0
        open_ = np.flatnonzero(~held & ~never)
        if len(open_):
            low[open_], high[open_] = close_in(
                lambda which: here.margin(open_[which]),
                (low[open_], at_low[open_]),
                (high[open_], at_high[open_]),
                WIDTH_S,
            )
        low = np.where(held, ceiling_s, np.where(never, np.nan, low))
        x[lost], y[lost] = low, here.y(low, slice(None))
        proved = falls[lost] & ~held
        beyond[lost[proved]] = np.where(never, -np.inf, high)[proved]
        beyond[lost[rises[lost]]] = -np.inf
        return Interval(x, y, beyond)

    def shortest(self, found: Interval, shortest_s: Floats) -> Floats:
        """Smallest y for the x of each programme, from one below which none will do.

        Where the wells do not keep to a trend it is one that does, and may not be the smallest.
        """
        y = shortest_s.copy()
        known = np.flatnonzero(~np.isnan(found.x))
        short = known[self._margin(found.x[known], y[known], known) < 0.0]
        if not len(short):
            return y

        def margins(which: Any) -> Margin:
            these = short[which]
            return lambda at: self._margin(found.x[these], at, these)

        holds, fails = found.y[short], y[short]
        margin = margins(slice(None))
        ends = (holds, margin(holds)), (fails, margin(fails))
        y[short], _ = close_in(margins, *ends, WIDTH_S)
        return y

    def _margin(self, x: Floats, y: Floats, which: Numbers) -> Floats:
        """How far the constraints on parts of times hold at points of some programmes."""
        point = {self.x: x} | ({self.y: y} if self.y else {})
        given = {n: v[which] if np.ndim(v) else v for n, v in self.values.items()} | point
        least, done = np.full(np.shape(x), np.inf), dict[int, Any]()
        for each in self.asked:
            sides = (evaluate(s, given, done) for s in each.relation.sides)
            left, right = sides
            short = slack(each.relation.sense, left, right) / np.maximum(1.0, np.abs(right))
            least = np.minimum(least, short + ROUNDING)
        return least

    def _trends(self) -> tuple[Booleans, Booleans]:
        """Of each programme: whether all falls with x, with the largest y best, or rises with x."""
        falls, up, down = falling(self.others, self.x_top, self.y_top)
        count = len(self.x_top)
        monotone = (falls & (up | down)).all(axis=0)
        each = [self._known(constraint) for constraint in self.asked]
        return (
            monotone & np.all([np.broadcast_to(known[0], count) for known in each], axis=0),
            np.all([np.broadcast_to(known[1], count) for known in each], axis=0),
        )

    def _known(self, constraint: Constraint) -> tuple[Any, Any]:
        """Whether a constraint is known to fall with x and rise with y, or to rise with x alone."""
        relation = constraint.relation
        left, fixed = self._without_divisor(relation.left), not has_unknowns(relation.right)
        if not isinstance(left, Let) or not fixed or relation.sense != ">=":
            return False, False
        falls: Any = False
        rises: Any = False
        for trend in left.trends:
            where = reduce(np.logical_and, map(self._certain, trend.where))
            others = {self.y} - {None}
            if self.x in trend.falls_with and others <= set(trend.rises_with):
                falls = falls | where
            if self.x in trend.rises_with and not others:
                rises = rises | where
        return falls, rises

    def _without_divisor(self, tree: Any) -> Any:
        """What goes as a quotient by something positive does; other trees as they are."""
        if not isinstance(tree, Call) or tree.ufunc is not np.divide:
            return tree
        above, below = tree.arguments
        fixed = not has_unknowns(below) and np.all(evaluate(below, self.values) > 0.0)
        return above if fixed else tree

    def _certain(self, relation: Relation) -> Any:
        sides = (evaluate(side, self.values) for side in relation.sides)
        return slack(relation.sense, *sides) >= 0.0


class _Ceiling:
    """Some programmes with the largest y that the other rows admit for every x."""

    def __init__(self, tapered: Tapered, which: Numbers) -> None:
        self.tapered, self.which = tapered, which
        self.rows, self.y_top = tapered.others.take(which), tapered.y_top[which]

    def y(self, x: Floats, which: Any) -> Floats:
        """The largest y; NaN where there is none."""
        if self.tapered.y is None:
            return np.where(np.isnan(x), np.nan, 0.0)
        return Section.at_x(self.rows.take(which), x).largest(self.y_top[which])

    def margin(self, which: Any) -> Margin:
        """How far all holds there for some of them, < 0 where there is no such y."""

        def margin(x: Floats) -> Floats:
            y = self.y(x, which)
            found = self.tapered._margin(x, np.nan_to_num(y), self.which[which])
            return np.where(np.isnan(y), -1.0, found)

        return margin
