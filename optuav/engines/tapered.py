"""From times that would do if nothing were refused near full to times that do: the taper's truth.

A model in which charging tapers holds longest parts of times. With the whole times in their place
it has the form that `bracketing` solves, and more points: what no time is beyond there, none is
beyond here. If the answer satisfies the model itself, it is the longest. Otherwise the model itself
is evaluated. Where what is asked of the wells falls with x and rises with y (the model states its
trends), the largest y that the other rows admit is best for every x, and the rows hold up to some x
and nowhere beyond: both ends of an interval around it are evaluated. Elsewhere what is asked is
bounded over boxes of both times, by what the model states it to be at most (see `boxes`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import reduce
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.engines.boxes import Boxes, search
from optuav.engines.bracketing import Interval
from optuav.engines.exponential_form import Rows, Section, falling
from optuav.engines.sign_changes import Margin, close_in
from optuav.engines.sweeping import WIDTH_S
from optuav.modelling.check import slack
from optuav.modelling.expression import Call, Let, Operand, Range, Relation
from optuav.modelling.longest import speaks_of_parts
from optuav.modelling.model import Constraint, Model
from optuav.modelling.traversal import evaluate, has_unknowns

ROUNDING = 1e-11
"""By how much a constraint must be missed to fail, relative to max(1, |right side|)."""
AT_ONCE = 64
"""Programmes whose boxes are searched together."""


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
        self.bounded = list(self._bounded())

    def narrowed(self, found: Interval) -> Interval:
        """What is left of an interval for the longest x, one a programme."""
        left = Interval(*(each.copy() for each in found))
        known = np.flatnonzero(~np.isnan(left.x))
        lost = known[self._margin(left.x[known], left.y[known], known) < 0.0]
        if len(lost):
            self._follow(lost, *left)
        open_ = np.flatnonzero(~left.proved)
        for some in np.split(open_, range(AT_ONCE, len(open_), AT_ONCE)):
            self._bound(some, *left)
        return left

    def _follow(self, lost: Integers, x: Floats, y: Floats, beyond: Floats) -> None:
        """Go along the largest y from the x that is lost to one that holds, and tell both there.

        That none is beyond it is proved where all falls with x and the largest y is best.
        """
        here, ceiling_s = _Ceiling(self, lost), x[lost]
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
        proved = self._falls()[lost] & ~held
        beyond[lost[proved]] = np.where(never, -np.inf, high)[proved]

    def _bound(self, which: Integers, x: Floats, y: Floats, beyond: Floats) -> None:
        """Search the boxes of programmes that stayed open, and tell there what was found."""
        zero, y_top = np.zeros(len(which)), self.y_top[which]
        x_low = np.where(np.isnan(x[which]), zero, x[which])
        start = Boxes(x_low, beyond[which], zero, y_top, np.arange(len(which)))
        found = search(
            start,
            lambda boxes: self._most(boxes, which),
            lambda at_x, at_y, among: self._all(at_x, at_y, which[among]),
            x[which],
            y[which],
            WIDTH_S,
        )
        x[which], y[which], beyond[which] = found

    def _all(self, x: Floats, y: Floats, which: Integers) -> Floats:
        """How far all constraints hold at points of some programmes."""
        others: Floats = self.others.take(which).at(x, y).min(axis=0, initial=np.inf)
        found: Floats = np.minimum(others, self._margin(x, y, which))
        return found

    def _most(self, boxes: Boxes, which: Integers) -> Floats:
        """The least of what all constraints are at most over boxes of some programmes."""
        among = which[boxes.programme]
        over = Section.over_x(self.others.take(among), boxes.x_low, boxes.x_high)
        least: Floats = over.most(boxes.y_low, boxes.y_high).min(axis=0, initial=np.inf)
        ranges = {self.x: (boxes.x_low, boxes.x_high)}
        if self.y:
            ranges[self.y] = boxes.y_low, boxes.y_high
        given = self._of(among)
        for name, ends in ranges.items():
            given |= {f"{end} {name}": at for end, at in zip(Range._fields, ends, strict=True)}
        done = dict[int, Any]()
        for most, right in self.bounded:
            left, fixed = (evaluate(each, given, done) for each in (most, right))
            short = (left - fixed) / np.maximum(1.0, np.abs(fixed))
            least = np.minimum(least, short + ROUNDING)
        return least

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

    def _margin(self, x: Floats, y: Floats, which: Integers) -> Floats:
        """How far the constraints on parts of times hold at points of some programmes."""
        point = {self.x: x} | ({self.y: y} if self.y else {})
        given = self._of(which) | point
        least, done = np.full(np.shape(x), np.inf), dict[int, Any]()
        for each in self.asked:
            sides = (evaluate(s, given, done) for s in each.relation.sides)
            left, right = sides
            short = slack(each.relation.sense, left, right) / np.maximum(1.0, np.abs(right))
            least = np.minimum(least, short + ROUNDING)
        return least

    def _of(self, which: Integers) -> dict[str, Any]:
        """Values of the parameters of some programmes."""
        return {name: v[which] if np.ndim(v) else v for name, v in self.values.items()}

    def _falls(self) -> Booleans:
        """Of each programme: whether all falls with x, with the largest y best."""
        falls, up, down = falling(self.others, self.x_top, self.y_top)
        known = [np.broadcast_to(self._known_to_fall(c), self.x_top.shape) for c in self.asked]
        found: Booleans = np.logical_and.reduce(np.vstack([falls & (up | down), *known]))
        return found

    def _known_to_fall(self, constraint: Constraint) -> Any:
        """Whether a constraint is known to fall with x and rise with y."""
        quantity, _ = self._quantity(constraint)
        found: Any = False
        for trend in () if quantity is None else quantity.trends:
            if self.x in trend.falls_with and {self.y} - {None} <= set(trend.rises_with):
                found = found | reduce(np.logical_and, map(self._certain, trend.where))
        return found

    def _quantity(self, constraint: Constraint) -> tuple[Let | None, Operand]:
        """The quantity that is to be no less than something fixed, and by what it is divided."""
        relation, below = constraint.relation, 1.0
        left: Operand = relation.left
        if isinstance(left, Call) and left.ufunc is np.divide:
            left, below = left.arguments
        fixed = relation.sense == ">=" and not has_unknowns(relation.right)
        known = isinstance(left, Let) and fixed and not has_unknowns(below)
        if known and np.all(evaluate(below, self.values) > 0.0):
            return left, below
        return None, below

    def _bounded(self) -> Iterator[tuple[Operand, Operand]]:
        """What constraints are known to be at most, and what that must not fall below."""
        for each in self.asked:
            quantity, below = self._quantity(each)
            if quantity is not None and quantity.most is not None:
                yield quantity.most / below, each.relation.right

    def _certain(self, relation: Relation) -> Any:
        sides = (evaluate(side, self.values) for side in relation.sides)
        return slack(relation.sense, *sides) >= 0.0


class _Ceiling:
    """Some programmes with the largest y that the other rows admit for every x."""

    def __init__(self, tapered: Tapered, which: Integers) -> None:
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
